//! The `umbilic` command.
fn main() {}
