//! Runs that are interrupted at ten moments and go on from their checkpoints: the same bytes.

use crate::common::{
    Stopped, UMBILIC, message, program, root, stopped, stops_within_a_second, umbilic,
};
use std::fs;
use std::path::Path;
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

/// A run that is stopped after some time, or sooner where it has ended by then: on a busy machine no
/// two runs take the same.
fn stopped_before_its_end(args: &[&str], out: &Path, mut after: Duration) -> Stopped {
    loop {
        let part = stopped(&mut program(args), after);
        if part.is_interrupted() || after < Duration::from_millis(2) {
            return part;
        }
        fs::remove_file(out).expect("written");
        after /= 2;
    }
}

/// Interrupts a command at ten moments of its course and resumes it; then with options it was not
/// begun with.
fn resumes_to_the_same_bytes(args: &[&str], extension: &str, other: &[&str]) {
    let folder = tempfile::tempdir().expect("a folder");
    let path = |name: &str| folder.path().join(name).display().to_string();
    let whole = path(&format!("whole.{extension}"));
    let begin = Instant::now();
    let result = umbilic(&[args, &["-o", &whole]].concat());
    let time = begin.elapsed();
    assert!(result.status.success(), "{args:?}: {}", message(&result));
    let expected = fs::read(&whole).expect("written");
    let (mut interrupted, mut begun) = (0, None);
    for moment in 0..10 {
        let (out, state) =
            (path(&format!("{moment}.{extension}")), path(&format!("{moment}.json")));
        let after = time.mul_f64((f64::from(moment) + 0.5) / 10.0);
        let what = format!("{args:?} after {after:?} of {time:?}");
        let keeping = [args, &["-o", &out, "--checkpoint", &state]].concat();
        let part = stopped_before_its_end(&keeping, Path::new(&out), after);
        if part.is_interrupted() {
            interrupted += 1;
            assert!(!Path::new(&out).exists(), "{what}");
            // Without a file where it was ended before it listened for signals, or had opened one.
            let is_kept = Path::new(&state).exists();
            let is_early =
                part.status.code().is_none() || part.said.trim_end() == "umbilic: interrupted";
            assert!(is_kept || is_early, "{what}: {}", part.said);
            let resume: &[&str] = if is_kept { &["--resume", &state] } else { &[] };
            let rest = umbilic(&[args, &["-o", &out], resume].concat());
            assert!(rest.status.success(), "{what}: {}", message(&rest));
            if is_kept && fs::read(&state).expect("a state") != b"null" {
                assert!(part.said.contains("it goes on with --resume"), "{}", part.said);
                begun = Some(state);
            }
        } else {
            assert!(part.status.success(), "{what}: {}", part.said);
        }
        assert!(fs::read(&out).expect("written") == expected, "{what}: other bytes");
        let limit = path("limit.json");
        let keeping = [args, &["-o", &out, "--checkpoint", &limit]].concat();
        if moment % 5 == 2 {
            stops_within_a_second(&what, &|| stopped(&mut program(&keeping), after));
        }
    }
    // The libraries' own tests stop each method at all ten moments.
    assert!(interrupted >= 5, "{args:?}: {interrupted} of ten signals came in time");
    let names = fs::read_dir(folder.path()).expect("a folder").flatten();
    let temporary = names.filter(|e| e.file_name().to_string_lossy().starts_with('.')).count();
    assert_eq!(temporary, 0, "{args:?} left temporary files");
    let state = begun.expect("an interruption after the first step");
    let out = path(&format!("other.{extension}"));
    let refused = umbilic(&[args, other, &["-o", &out, "--resume", &state]].concat());
    let said = message(&refused);
    assert_eq!(refused.status.code(), Some(2), "{said}");
    let sentence = "the checkpoint belongs to another input or other options; \
                    resume with the input and options it was made with";
    assert_eq!(said, format!("umbilic: {state}: {sentence}\n"));
    assert!(!Path::new(&out).exists());
}

#[test]
fn weingarten_resumes_to_the_same_bytes() {
    let args = ["weingarten", "fixtures/roof.ron", "--levels", "14x12,22x20"];
    resumes_to_the_same_bytes(&args, "ron", &["--closeness", "0.7"]);
}

#[test]
fn panel_resumes_to_the_same_bytes() {
    let args = ["panel", "fixtures/roof-optimised.ron", "--panels", "24x24", "--k", "3"];
    resumes_to_the_same_bytes(&args, "csv", &["--slope-weight", "0.7"]);
}

#[test]
fn a_search_for_molds_resumes_to_the_same_bytes() {
    let args = ["panel", "fixtures/roof-optimised.ron", "--panels", "10x10"];
    let args = [&args[..], &["--max-kink-deg", "1.2"]].concat();
    resumes_to_the_same_bytes(&args, "csv", &["--max-gap", "0.01"]);
}

#[test]
fn hnet_resumes_to_the_same_bytes() {
    let args = ["hnet", "fixtures/nets/catenoid-ring.obj"];
    resumes_to_the_same_bytes(&args, "ron", &["--boundary", "fixed"]);
}

#[test]
fn asymptotic_resumes_to_the_same_bytes() {
    let from_net = ["asymptotic", "fixtures/asymptotic/hyperbolic-enneper.obj", "--from-net"];
    resumes_to_the_same_bytes(&from_net, "ron", &["--joins", "g2"]);
}

#[test]
fn relaxed_nets_of_curves_resume_to_the_same_bytes() {
    let relaxed = ["asymptotic", "fixtures/asymptotic/catenoid-grid-3.ron", "--relaxed"];
    let relaxed = [&relaxed[..], &["--joins", "g2"]].concat();
    resumes_to_the_same_bytes(&relaxed, "ron", &["--boundary-energy", "jerk"]);
}

#[test]
fn fair_resumes_to_the_same_bytes() {
    let args = ["fair", "fixtures/quads/theta.obj", "--levels", "1"];
    resumes_to_the_same_bytes(&args, "obj", &["--energy", "bending"]);
}

#[test]
fn a_state_of_another_command_and_no_state_at_all_are_one_sentence() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = |name: &str| folder.path().join(name).display().to_string();
    let (state, out) = (path("state.json"), path("out.ron"));
    let corner = ["asymptotic", "fixtures/asymptotic/catenoid.ron", "-o", &out];
    let kept = umbilic(&[&corner[..], &["--checkpoint", &state]].concat());
    assert!(kept.status.success(), "{}", message(&kept));
    // A finished run is taken up, too.
    let expected = fs::read(&out).expect("written");
    let again = umbilic(&[&corner[..], &["--resume", &state]].concat());
    assert!(again.status.success(), "{}", message(&again));
    assert!(fs::read(&out).expect("written") == expected);
    let roof = ["weingarten", "fixtures/roof.ron", "-o", &out, "--resume"];
    let cut = path("cut.json");
    fs::write(&cut, &fs::read(&state).expect("written")[..100]).expect("written");
    let missing = path("missing.json");
    for (file, word) in [
        (&state, "the checkpoint belongs to the method `asymptotic`; resume with"),
        (&cut, "; give a file that --checkpoint has written"),
        (&missing, "cannot be read"),
    ] {
        let refused = umbilic(&[&roof[..], &[file]].concat());
        let said = message(&refused);
        assert_eq!(refused.status.code(), Some(2), "{said}");
        assert!(said.starts_with(&format!("umbilic: {file}: ")) && said.contains(word), "{said}");
        assert_eq!(said.lines().count(), 1, "{said}");
    }
    assert!(fs::read(&out).expect("still there") == expected);
    // What was interrupted before its first step starts over.
    fs::write(&state, "null").expect("written");
    let over = umbilic(&[&corner[..], &["--resume", &state]].concat());
    assert!(over.status.success(), "{}", message(&over));
    assert!(fs::read(&out).expect("written") == expected);
}

#[test]
fn a_killed_run_goes_on_from_the_last_of_its_regular_checkpoints() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = |name: &str| folder.path().join(name).display().to_string();
    let (whole, out, state) = (path("whole.csv"), path("out.csv"), path("state.json"));
    let args = ["panel", "fixtures/roof-optimised.ron", "--panels", "24x24", "--k", "3", "-o"];
    let begin = Instant::now();
    assert!(umbilic(&[&args[..], &[&whole]].concat()).status.success());
    let time = begin.elapsed();
    let keeping = [&args[..], &[&out, "--checkpoint", &state, "--checkpoint-every", "2"]].concat();
    for moment in 1..5 {
        let mut child = Command::new(UMBILIC)
            .current_dir(root())
            .args(&keeping)
            .stdout(Stdio::null())
            .spawn()
            .expect("the program starts");
        std::thread::sleep(time.mul_f64(f64::from(moment) / 5.0));
        // It may have ended by itself.
        let _ = child.kill();
        child.wait().expect("it ends");
        // Whole at any moment, if it is there.
        let resume: &[&str] = if Path::new(&state).exists() { &["--resume", &state] } else { &[] };
        let rest = umbilic(&[&args[..], &[&out], resume].concat());
        assert!(rest.status.success(), "{}", message(&rest));
        assert!(fs::read(&out).expect("written") == fs::read(&whole).expect("written"));
    }
    assert!(Path::new(&state).exists(), "no checkpoint on the way");
}
