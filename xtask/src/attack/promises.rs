//! What holds at any moment and beside anything: whole files after a kill, on a full disk and in a
//! race, an end within a second of an interrupt, bytes that no number of threads changes.

use super::lab::Lab;
use super::random::Random;
use crate::shell::{Outcome, umbilic};
use std::fs;
use std::process::{Child, Command, Stdio};
use std::thread;
use std::time::{Duration, Instant};

/// Commands with what they write, for every number of threads.
const LINES: &[(&str, &str)] = &[
    ("weingarten fixtures/saddle.ron --iterations 5", "a.ron"),
    ("weingarten fixtures/roof.ron --levels 10x8,14x10 --iterations 3", "a.step"),
    ("panel fixtures/roof.ron --panels 8x6 --molds 6", "a.csv"),
    ("hnet fixtures/nets/enneper.obj", "a.obj"),
    ("darboux fixtures/nets/scherk.obj --c -0.6", "a.glb"),
    ("asymptotic fixtures/asymptotic/hyperbolic-helicoid.obj --from-net", "a.step"),
    ("fair fixtures/quads/theta-4.obj --levels 1 --iterations 5", "a.obj"),
    ("fit fixtures/grid.obj", "a.ron"),
    ("convert fixtures/quads/cube.obj", "a.glb"),
];
const THREADS: &[&str] = &["1", "2", "4", "8"];

/// Commands that would take longer than the moment at which they are interrupted.
const LONG: &[(&str, &str)] = &[
    ("weingarten fixtures/roof.ron --levels 20x16,30x24,60x50 --iterations 400", "a.step"),
    ("panel fixtures/roof.ron --panels 40x40 --max-kink-deg 0.02", "a.csv"),
    ("hnet fixtures/nets/p-cell.obj --report {report}", "a.obj"),
    ("asymptotic fixtures/asymptotic/catenoid-net-30.obj --from-net", "a.step"),
    ("fair fixtures/quads/theta.obj --levels 2 --iterations 400", "a.step"),
    ("remesh fixtures/triangles/p-cell.obj --faces 4000", "a.obj"),
    ("analyze fixtures/quads/torus-32x64.obj --report {report}", "a.html"),
];
/// The promise is one second; what runs beside may take as much of the machine.
const AFTER_INTERRUPT: Duration = Duration::from_secs(2);
/// Exit code of an interrupted run.
const INTERRUPTED: i32 = 130;

/// The same command with several numbers of threads.
pub(super) fn threads(lab: &mut Lab, random: &mut Random) -> Outcome {
    let (line, name) = random.one(LINES);
    let mut first: Option<Vec<u8>> = None;
    for count in THREADS {
        let mut arguments: Vec<String> = line.split(' ').map(str::to_owned).collect();
        lab.name_output(&mut arguments, name);
        arguments.extend(["--threads".to_owned(), (*count).to_owned()]);
        lab.attempt(&arguments, None)?;
        let bytes = fs::read(lab.out(name)).unwrap_or_default();
        match &first {
            Some(first) if *first != bytes => {
                lab.fault("other bytes with other threads", &arguments, None)?;
            }
            Some(_) => {}
            None => first = Some(bytes),
        }
    }
    Ok(())
}

/// A kill at a random moment, over a file that was there before.
pub(super) fn kill(lab: &mut Lab, random: &mut Random) -> Outcome {
    let (line, name) = random.one(LINES);
    let mut arguments: Vec<String> = line.split(' ').map(str::to_owned).collect();
    lab.name_output(&mut arguments, name);
    lab.attempt(&arguments, None)?;
    let new = fs::read(lab.out(name)).unwrap_or_default();
    let old = b"what was there before";
    fs::write(lab.out(name), old).map_err(|e| format!("{name}: {e}"))?;
    let mut command = umbilic();
    command.args(&arguments).stdout(Stdio::null()).stderr(Stdio::null());
    let mut child = command.spawn().map_err(|e| format!("umbilic: {e}"))?;
    thread::sleep(Duration::from_micros(random.below(300_000) as u64));
    child.kill().and_then(|()| child.wait()).map_err(|e| format!("umbilic: {e}"))?;
    lab.runs += 1;
    let bytes = fs::read(lab.out(name)).unwrap_or_default();
    // The time stands in some headers.
    if bytes != old && bytes.len() != new.len() {
        lab.fault("neither the old file nor the new one after a kill", &arguments, None)?;
    }
    Ok(())
}

/// An interrupt at a random moment of a long run.
pub(super) fn interrupt(lab: &mut Lab, random: &mut Random) -> Outcome {
    if cfg!(not(unix)) {
        return Ok(());
    }
    lab.empty_out()?;
    let (line, name) = random.one(LONG);
    let report = lab.out("report.html");
    let mut arguments: Vec<String> =
        line.split(' ').map(|word| word.replace("{report}", &report)).collect();
    lab.name_output(&mut arguments, name);
    let mut child = started(&arguments)?;
    thread::sleep(Duration::from_micros(random.below(1_500_000) as u64));
    let sent = Command::new("kill").args(["-INT", &child.id().to_string()]).output();
    sent.map_err(|e| format!("kill: {e}"))?;
    let start = Instant::now();
    let status = loop {
        if let Some(status) = child.try_wait().map_err(|e| format!("umbilic: {e}"))? {
            break status;
        }
        if start.elapsed() > AFTER_INTERRUPT {
            child.kill().and_then(|()| child.wait()).map_err(|e| format!("umbilic: {e}"))?;
            return lab.fault("an interrupt did not end it", &arguments, None);
        }
        thread::sleep(Duration::from_millis(2));
    };
    lab.runs += 1;
    // Before the program hears of signals the system ends it.
    let by_signal = status.code().is_none();
    let files = lab.left()?;
    if status.code() == Some(INTERRUPTED) || by_signal {
        if files.iter().any(|(file, _)| file.starts_with('.') || file.ends_with(".tmp")) {
            lab.fault("a temporary file after an interrupt", &arguments, None)?;
        }
    } else if !matches!(status.code(), Some(0 | 3 | 4)) {
        lab.fault(&format!("{status} after an interrupt"), &arguments, None)?;
    }
    Ok(())
}

/// Two runs that write the same file at once, and one whose disk is full.
pub(super) fn race(lab: &mut Lab, random: &mut Random) -> Outcome {
    let (line, name) = random.one(LINES);
    let mut arguments: Vec<String> = line.split(' ').map(str::to_owned).collect();
    lab.name_output(&mut arguments, name);
    lab.attempt(&arguments, None)?;
    let length = fs::metadata(lab.out(name)).map_or(0, |m| m.len());
    let mut both = [started(&arguments)?, started(&arguments)?];
    for child in &mut both {
        child.wait().map_err(|e| format!("umbilic: {e}"))?;
        lab.runs += 1;
    }
    let files = lab.left()?;
    if files != [((*name).to_owned(), length)] {
        lab.fault(&format!("{files:?} after a race of two"), &arguments, None)?;
    }
    if cfg!(not(unix)) {
        return Ok(());
    }
    // A limit on the length of files stands for the full disk, in blocks of 512 bytes.
    lab.empty_out()?;
    let mut full = Command::new("sh");
    full.args(["-c", "ulimit -f 1; exec \"$0\" \"$@\""]).arg(umbilic().get_program());
    full.args(&arguments).current_dir(crate::shell::root());
    let output = full.output().map_err(|e| format!("umbilic: {e}"))?;
    lab.runs += 1;
    let files = lab.left()?;
    if length > 1024 && (output.status.success() || !files.is_empty()) {
        lab.fault(&format!("{} with {files:?} on a full disk", output.status), &arguments, None)?;
    }
    Ok(())
}

fn started(arguments: &[String]) -> Outcome<Child> {
    let mut command = umbilic();
    command.args(arguments).stdout(Stdio::null()).stderr(Stdio::null());
    command.spawn().map_err(|e| format!("umbilic: {e}"))
}
