//! What is on the disk after an interruption, a kill and a full disk: never half a file.

use crate::common::{
    UMBILIC, copy, examples, message, root, stopped, stops_within_a_second, umbilic,
};
use bspline::BsplineSurface;
use exchange::{LengthUnit, Mesh, Model};
use fixtures::random::Random;
use fixtures::{quad_graphs, surfaces::Shape};
use geom_core::{DVec3, PolyMesh};
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

/// A model in a file.
fn write(path: &Path, model: &Model) {
    fs::write(path, exchange::encode_model(path, model).expect("a format")).expect("written");
}

/// Quads between the control points.
fn net_of(surface: &BsplineSurface) -> PolyMesh {
    let (n, m) = (surface.n_u() as u32, surface.n_v() as u32);
    let quads: Vec<[u32; 4]> = (0..(n - 1) * (m - 1))
        .map(|k| k / (m - 1) * m + k % (m - 1))
        .map(|a| [a, a + m, a + m + 1, a + 1])
        .collect();
    PolyMesh::new(surface.control_points().to_vec(), &quads).expect("a grid")
}

#[test]
fn ctrl_c_at_any_moment_ends_every_command_within_a_second() {
    let folder = tempfile::tempdir().expect("a folder");
    let at = |name: &str| folder.path().join(name);
    copy(&root().join("fixtures"), &at("fixtures"));
    let surface = Shape::Roof.surface(90, 90, 4, 4);
    let unit = LengthUnit::default;
    write(&at("grid.obj"), &Model::of_mesh(Mesh::from_poly_mesh(&net_of(&surface)), unit()));
    write(&at("surface.ron"), &Model::of_surface("roof", surface, unit()));
    let ellipsoid = quad_graphs::ellipsoid(18, DVec3::new(1.0, 1.3, 1.7));
    write(&at("quads.obj"), &Model::of_mesh(Mesh::from_poly_mesh(&ellipsoid), unit()));
    // Larger than the examples, which other commands are run with.
    let large = |command: &str| match command {
        "analyze" => vec!["surface.ron --report page.html", "quads.obj"],
        "asymptotic" => vec!["fixtures/asymptotic/catenoid-net-30.obj --from-net -o out.step"],
        "convert" => vec!["surface.ron out.step"],
        "darboux" => vec!["fixtures/nets/catenoid-ring.obj --c -0.6 -o out.glb"],
        "fair" => vec!["quads.obj -o out.step --levels 0 --iterations 3"],
        "fit" => vec!["grid.obj --ctrl 60x60 -o out.step --report page.html"],
        "hnet" => vec!["fixtures/nets/catenoid-ring.obj -o out.step -o out.glb --report page.html"],
        "panel" => vec![
            "surface.ron --panels 30x30 -o out.glb --report page.html",
            "fixtures/roof-optimised.ron --panels 16x16 --max-kink-deg 1 -o out.csv",
        ],
        "verify" => vec!["fitted.json"],
        "weingarten" => vec!["surface.ron --iterations 1 -o out.step"],
        _ => vec![],
    };
    let fit =
        ["fit", "grid.obj", "--ctrl", "60x60", "-o", "fitted.step", "--metrics", "fitted.json"];
    let fitted = Command::new(UMBILIC).args(fit).current_dir(folder.path()).output();
    assert!(fitted.expect("it runs").status.success());
    let before: Vec<String> = names(folder.path());
    let mut random = Random::new(1);
    for command in cli::command().get_subcommands().map(|c| c.get_name().to_owned()) {
        let help = String::from_utf8(umbilic(&[&command, "--help"]).stdout).expect("text");
        let lines: Vec<String> = match large(&command)[..] {
            [] => examples(&help).into_iter().take(1).collect(),
            ref more => more.iter().map(|line| format!("umbilic {command} {line}")).collect(),
        };
        for line in lines {
            let line = line.replacen("umbilic", "exec \"$0\"", 1);
            let run = || {
                let mut shell = Command::new("sh");
                shell.args(["-c", &format!("{line} --metrics metrics.json"), UMBILIC]);
                shell.current_dir(folder.path());
                shell
            };
            let clear = || {
                for name in names(folder.path()).iter().filter(|name| !before.contains(name)) {
                    let path = at(name);
                    let is_folder = path.is_dir();
                    let gone =
                        if is_folder { fs::remove_dir_all(path) } else { fs::remove_file(path) };
                    gone.expect("removed");
                }
            };
            let begin = Instant::now();
            let whole = run().output().expect("it runs");
            let time = begin.elapsed();
            assert!(whole.status.success(), "{line}: {}", message(&whole));
            clear();
            let mut ended = Vec::new();
            for moment in 0..5 {
                let after = time.mul_f64((f64::from(moment) + random.uniform()) / 5.0);
                let what = format!("{line} after {after:?} of {time:?}");
                let end = stops_within_a_second(&what, &|| {
                    clear();
                    stopped(&mut run(), after)
                });
                if end.is_interrupted() {
                    ended.push(end.took);
                } else {
                    assert!(end.status.success(), "{what}: {}", end.said);
                }
            }
            println!("{line}: {time:?}, stopped after {ended:?}");
            assert!(!ended.is_empty(), "{line}: no signal came in time");
            // Nothing is written but what tells of the interruption.
            clear();
            let after = time.mul_f64(0.3);
            if stopped(&mut run(), after).status.code() == Some(130) {
                let found = names(folder.path());
                let new: Vec<&String> = found.iter().filter(|n| !before.contains(n)).collect();
                // The demo makes its folder first.
                let expected = ["metrics.json", "umbilic-demo"];
                assert!(new.iter().all(|n| expected.contains(&n.as_str())), "{line}: {new:?}");
                let text = fs::read_to_string(at("metrics.json")).expect("written");
                let json: serde_json::Value = serde_json::from_str(&text).expect("JSON");
                assert_eq!(json["status"], "interrupted", "{line}");
                assert_eq!(json["command"], command.as_str());
                assert_eq!(json["outputs"], serde_json::json!([]));
            }
            clear();
        }
    }
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
