//! Man pages and shell completions, and what every help text has.

use std::fs;
use std::process::Command;

#[test]
fn every_command_has_a_man_page_with_its_flags() {
    let folder = tempfile::tempdir().expect("a folder");
    crate::dist_example::write(folder.path()).expect("written");
    let page = |name: &str| {
        let path = folder.path().join("man").join(name);
        fs::read_to_string(&path).unwrap_or_else(|e| panic!("{}: {e}", path.display()))
    };
    let main = page("umbilic.1");
    for command in cli::command().get_subcommands() {
        let name = command.get_name();
        assert!(main.contains(&format!("umbilic\\-{name}")), "{name} is not in umbilic.1");
        let text = page(&format!("umbilic-{name}.1"));
        for flag in command.get_arguments().filter_map(|a| a.get_long()) {
            let dashed = format!("\\-\\-{}", flag.replace('-', "\\-"));
            assert!(text.contains(&dashed), "{name}: --{flag} is missing");
        }
    }
}

#[test]
fn completions_know_commands_and_flags() {
    let folder = tempfile::tempdir().expect("a folder");
    crate::dist_example::write(folder.path()).expect("written");
    let files = ["umbilic.bash", "_umbilic", "umbilic.fish", "_umbilic.ps1", "umbilic.elv"];
    for file in files {
        let path = folder.path().join("completions").join(file);
        let text = fs::read_to_string(&path).unwrap_or_else(|e| panic!("{file}: {e}"));
        for word in ["weingarten", "analyze", "checkpoint", "require-converged"] {
            assert!(text.contains(word), "{file} lacks {word}");
        }
    }
    // The shells themselves read them, where they are installed.
    for (shell, file) in [("bash", "umbilic.bash"), ("zsh", "_umbilic"), ("fish", "umbilic.fish")] {
        let path = folder.path().join("completions").join(file);
        match Command::new(shell).arg("-n").arg(&path).output() {
            Ok(output) => assert!(output.status.success(), "{shell}: {output:?}"),
            Err(_) => eprintln!("SKIPPED completions in {shell}: it is not installed"),
        }
    }
}

#[test]
fn every_command_and_flag_says_what_it_does() {
    for command in cli::command().get_subcommands() {
        let name = command.get_name();
        assert!(command.get_about().is_some(), "{name} says nothing");
        for argument in command.get_arguments() {
            assert!(argument.get_help().is_some(), "{name}: {} says nothing", argument.get_id());
        }
    }
}
