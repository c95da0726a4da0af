//! `cargo xtask attack`: hostile files, options and moments, thrown at the commands.
//!
//! Every run ends within half a minute and four gigabytes, with an exit code of the contract, one
//! sentence for a refusal and nothing left behind, whole files and no number that is none for a
//! result. The attacks of one seed are the same every time.

mod lab;
mod mutation;
mod options;
mod promises;
mod random;
mod special;
mod targets;

use crate::shell::{Outcome, build_umbilic, check, umbilic};
use lab::Lab;
use random::Random;
use std::fs;
use std::time::{Duration, Instant};

/// Attacks for `seconds`, and returns how many runs there were.
pub(crate) fn run(seconds: &str, seed: &str) -> Outcome<String> {
    let number = |text: &str| {
        text.parse::<u64>()
            .map_err(|_| format!("`{text}` is not a whole number; try `cargo xtask attack 120 1`"))
    };
    let (seconds, seed) = (Duration::from_secs(number(seconds)?), number(seed)?);
    build_umbilic()?;
    let mut lab = Lab::new()?;
    let mut random = Random::new(seed);
    state(&lab)?;
    let targets = targets::all(&lab.folder)?;
    let known = options::Known::new()?;
    let start = Instant::now();
    special::all(&mut lab)?;
    // Built attacks are made once, the others in turn until the time is up.
    for turn in 0.. {
        if start.elapsed() >= seconds {
            break;
        }
        match turn % 16 {
            0 => promises::threads(&mut lab, &mut random)?,
            1 => promises::kill(&mut lab, &mut random)?,
            2 => promises::interrupt(&mut lab, &mut random)?,
            3 => promises::race(&mut lab, &mut random)?,
            4..9 => options::attempt(&mut lab, &mut random, &known)?,
            _ => mutation_of(random.one(&targets), &mut lab, &mut random)?,
        }
    }
    lab.told()
}

fn mutation_of(target: &targets::Target, lab: &mut Lab, random: &mut Random) -> Outcome {
    let seed = fs::read(&target.seed).map_err(|e| format!("{}: {e}", target.seed.display()))?;
    let path = lab.folder.join(format!("hostile.{}", targets::extension(&target.seed)));
    fs::write(&path, mutation::mutated(&seed, random))
        .map_err(|e| format!("{}: {e}", path.display()))?;
    let name = path.display().to_string();
    let mut arguments: Vec<String> =
        target.line.split(' ').map(|word| word.replace(targets::HOSTILE, &name)).collect();
    if let Some(extension) = target.writes {
        lab.name_output(&mut arguments, &format!("a.{extension}"));
        arguments.extend(["--metrics".to_owned(), lab.out("a.json")]);
    }
    lab.attempt(&arguments, Some(&path))
}

/// A checkpoint and metrics to be made worse.
fn state(lab: &Lab) -> Outcome {
    let mut command = umbilic();
    command.args(["weingarten", "fixtures/saddle.ron", "--iterations", "1", "-q"]);
    command.arg("-o").arg(lab.folder.join("state.ron"));
    command.arg("--checkpoint").arg(lab.folder.join("state.json"));
    command.arg("--metrics").arg(lab.folder.join("metrics.json"));
    check(command)
}
