//! The program from the outside: files, metrics, exit codes, messages. One test program, so that
//! what the tests share stands once and is linked once.

mod asymptotic;
mod bad_input;
mod careful_files;
mod common;
mod dist;
#[path = "../../examples/dist.rs"]
#[allow(dead_code, reason = "its main is not called")]
mod dist_example;
mod every_command;
mod fair;
mod files;
mod hard_input;
mod hyperbolic;
#[cfg(unix)]
mod interruptions;
mod invariance;
mod panel;
mod report;
#[cfg(unix)]
mod resume;
mod snapshots;
mod verify;
mod weingarten;

#[cfg(not(unix))]
#[test]
fn interruptions() {
    eprintln!("SKIPPED interruptions and resume: this platform has no signal for Ctrl-C");
}
