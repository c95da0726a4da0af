//! Writes the man pages and shell completions of `umbilic` into the folder given as argument:
//! `man/umbilic.1` with a page for each command, and `completions/` for five shells.

use clap_complete::Shell;
use std::path::Path;

fn main() -> std::io::Result<()> {
    let folder = std::env::args_os().nth(1).unwrap_or_else(|| "target/dist".into());
    write(Path::new(&folder))
}

pub(crate) fn write(folder: &Path) -> std::io::Result<()> {
    let (man, completions) = (folder.join("man"), folder.join("completions"));
    std::fs::create_dir_all(&man)?;
    std::fs::create_dir_all(&completions)?;
    clap_mangen::generate_to(cli::command(), &man)?;
    for shell in [Shell::Bash, Shell::Zsh, Shell::Fish, Shell::PowerShell, Shell::Elvish] {
        clap_complete::generate_to(shell, &mut cli::command(), "umbilic", &completions)?;
    }
    Ok(())
}
