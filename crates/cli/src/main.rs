//! The `umbilic` command.

fn main() -> std::process::ExitCode {
    cli::main()
}
