//! Files that are whole after a kill at any moment, and bytes that no number of threads changes.

use super::lab::Lab;
use super::random::Random;
use crate::shell::{Outcome, umbilic};
use std::fs;
use std::process::Stdio;
use std::thread;
use std::time::Duration;

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

/// The same command with several numbers of threads.
pub(super) fn threads(lab: &mut Lab, random: &mut Random) -> Outcome {
    let (line, name) = random.one(LINES);
    let mut first: Option<Vec<u8>> = None;
    for count in THREADS {
        let mut arguments: Vec<String> = line.split(' ').map(str::to_owned).collect();
        arguments.extend(["-o".to_owned(), lab.out(name), "--threads".to_owned()]);
        arguments.push((*count).to_owned());
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
    arguments.extend(["-o".to_owned(), lab.out(name)]);
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
