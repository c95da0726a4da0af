//! What is on the disk after an interruption, a kill and a full disk: never half a file.

use crate::common::{UMBILIC, message, root, umbilic};
use std::fs;
use std::io::{BufRead, BufReader, Read};
use std::path::Path;
use std::process::{Command, Output, Stdio};
use std::time::{Duration, Instant};

/// Runs a line of `sh` in the root of the repository.
fn shell(line: &str) -> Output {
    Command::new("sh").arg("-c").arg(line).current_dir(root()).output().expect("sh starts")
}

fn names(folder: &Path) -> Vec<String> {
    let entries = fs::read_dir(folder).expect("a folder");
    let name = |entry: fs::DirEntry| entry.file_name().to_string_lossy().into_owned();
    let mut names: Vec<String> = entries.flatten().map(name).collect();
    names.sort();
    names
}

/// The main job at a size whose steps take long enough to be interrupted.
fn long_job<'a>(out: &'a str, more: &[&'a str]) -> Vec<&'a str> {
    let mut args = vec!["weingarten", "fixtures/roof.ron", "--levels", "30x30"];
    args.extend(["--iterations", "30", "-o", out]);
    args.extend(more);
    args
}

#[test]
fn ctrl_c_writes_the_checkpoint_and_a_resumed_run_ends_in_the_same_bytes() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = |name: &str| folder.path().join(name).display().to_string();
    let (out, state, metrics) = (path("out.ron"), path("state.json"), path("metrics.json"));
    fs::write(&out, "before").expect("written");
    let more = ["--checkpoint", &state, "--metrics", &metrics, "-vv"];
    let mut child = Command::new(UMBILIC)
        .current_dir(root())
        .args(long_job(&out, &more))
        .stderr(Stdio::piped())
        .stdout(Stdio::null())
        .spawn()
        .expect("the program starts");
    let mut log = BufReader::new(child.stderr.take().expect("piped"));
    let mut line = String::new();
    // The log tells when the first step is taken.
    while !line.contains("iteration=") {
        line.clear();
        assert!(log.read_line(&mut line).expect("a log") > 0, "it ended before it was interrupted");
    }
    let signal = Instant::now();
    let pid = child.id().to_string();
    assert!(Command::new("kill").args(["-INT", &pid]).status().expect("kill").success());
    let mut rest = String::new();
    log.read_to_string(&mut rest).expect("a log");
    let status = child.wait().expect("it ends");
    println!("ended {:?} after the signal", signal.elapsed());
    assert_eq!(status.code(), Some(130), "{rest}");
    // The promise is a second; the bound leaves room for a busy machine.
    assert!(signal.elapsed() < Duration::from_secs(20));
    assert_eq!(fs::read_to_string(&out).expect("still there"), "before");
    assert_eq!(names(folder.path()), ["metrics.json", "out.ron", "state.json"]);
    let text = fs::read_to_string(&metrics).expect("written");
    let json: serde_json::Value = serde_json::from_str(&text).expect("JSON");
    assert_eq!(json["status"], "interrupted");
    assert_eq!(json["outputs"], serde_json::json!([state]));

    let (whole, resumed) = (path("whole.ron"), path("resumed.ron"));
    for args in [long_job(&whole, &[]), long_job(&resumed, &["--resume", &state])] {
        let result = umbilic(&args);
        assert!(result.status.success(), "{}", message(&result));
    }
    assert!(fs::read(whole).expect("written") == fs::read(resumed).expect("written"));
}

#[test]
fn ctrl_c_ends_a_command_that_has_no_state_to_keep() {
    let folder = tempfile::tempdir().expect("a folder");
    let out = folder.path().join("out.obj").display().to_string();
    let mut child = Command::new(UMBILIC)
        .current_dir(root())
        .args(["panel", "fixtures/roof-optimised.ron", "--panels", "150x150", "--molds", "40"])
        .args(["-o", &out])
        .spawn()
        .expect("the program starts");
    // Long enough for the handler to be set up, too short for 22500 panels.
    std::thread::sleep(Duration::from_millis(500));
    let signal = Instant::now();
    let pid = child.id().to_string();
    assert!(Command::new("kill").args(["-INT", &pid]).status().expect("kill").success());
    assert_eq!(child.wait().expect("it ends").code(), Some(130));
    assert!(signal.elapsed() < Duration::from_secs(20));
    assert!(names(folder.path()).is_empty());
}

#[test]
fn a_kill_at_any_moment_leaves_the_old_file_or_the_new_one() {
    let folder = tempfile::tempdir().expect("a folder");
    let out = folder.path().join("out.glb");
    let name = out.display().to_string();
    let args = ["convert", "fixtures/torus-patch.ron", &name];
    let mut whole_run = Duration::ZERO;
    // The second run is the measure: the first one has the program read from the disk.
    for _ in 0..2 {
        let begin = Instant::now();
        let result = umbilic(&args);
        whole_run = begin.elapsed();
        assert!(result.status.success(), "{}", message(&result));
    }
    let new = fs::read(&out).expect("written");
    let old = b"before".repeat(1000);
    let (mut kept, mut replaced) = (0, 0);
    for k in 0..40 {
        fs::write(&out, &old).expect("written");
        let mut child = Command::new(UMBILIC)
            .current_dir(root())
            .args(args)
            .stdout(Stdio::null())
            .stderr(Stdio::null())
            .spawn()
            .expect("the program starts");
        std::thread::sleep(whole_run.mul_f64(f64::from(k) / 28.0));
        // It may have ended by itself.
        let _ = child.kill();
        child.wait().expect("it ends");
        let found = fs::read(&out).expect("there is a file at any moment");
        assert!(found == old || found == new, "half a file after {k} / 28 of a run");
        if found == old { kept += 1 } else { replaced += 1 }
    }
    println!("{kept} kills left the old file, {replaced} came after the new one");
    assert!(kept > 0, "no kill came in time");
}

#[test]
fn a_full_disk_is_one_sentence_and_no_file() {
    let folder = tempfile::tempdir().expect("a folder");
    let old = folder.path().join("old.step");
    fs::write(&old, "before").expect("written");
    let (a, b) = (folder.path().join("a.step"), old.display());
    // The small file fits, the large one does not; neither may be touched.
    let mesh = "weingarten fixtures/roof.ron --iterations 1";
    let line = format!("{UMBILIC} {mesh} -o {b} -o {} -o {}.glb", a.display(), a.display());
    // A limit on the size of files stands for the full disk; the signal that comes with it is
    // ignored so that the write itself fails.
    let result = shell(&format!("trap '' XFSZ; ulimit -f 100; exec {line}"));
    let said = message(&result);
    assert_eq!(result.status.code(), Some(2), "{said}");
    assert!(
        said.starts_with(&format!("umbilic: {}.glb: cannot be written (", a.display())),
        "{said}"
    );
    assert!(said.contains("check permissions and free space"), "{said}");
    assert_eq!(said.lines().count(), 1, "{said}");
    assert_eq!(names(folder.path()), ["old.step"]);
    assert_eq!(fs::read_to_string(&old).expect("still there"), "before");
    // With the signal the process dies on the spot: what was there is still whole.
    let result = shell(&format!("ulimit -f 100; exec {line}"));
    assert!(!result.status.success());
    assert_eq!(fs::read_to_string(&old).expect("still there"), "before");
    assert!(!a.exists());
}

#[test]
fn a_full_file_system_is_one_sentence_and_no_file() {
    // A file system of 64 kB in a name space of its own, where the kernel allows that.
    let folder = tempfile::tempdir().expect("a folder");
    let place = folder.path().display();
    let mount = format!("mount -t tmpfs -o size=64k none {place}");
    let try_it = shell(&format!("unshare --user --map-root-user --mount sh -c '{mount}'"));
    if !try_it.status.success() {
        let reason = message(&try_it);
        eprintln!("SKIPPED a_full_file_system_is_one_sentence_and_no_file: {}", reason.trim());
        return;
    }
    let job = format!("{UMBILIC} convert fixtures/torus-patch.ron {place}/a.glb");
    let line = format!(
        "{mount} && echo before > {place}/a.glb; {job}; echo $?; cat {place}/a.glb; ls -A {place}"
    );
    let result = shell(&format!("unshare --user --map-root-user --mount sh -c '{line}'"));
    let (said, text) = (message(&result), String::from_utf8_lossy(&result.stdout).into_owned());
    assert_eq!(text, "2\nbefore\na.glb\n", "{said}");
    assert!(said.contains("a.glb: cannot be written (No space left on device"), "{said}");
    assert_eq!(said.lines().count(), 1, "{said}");
}
