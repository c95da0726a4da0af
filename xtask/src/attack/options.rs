//! Options at their extremes: every option of every command, as its help names it.

use super::lab::Lab;
use super::random::Random;
use crate::shell::{Outcome, umbilic};

/// A command that runs in no time, whose options are then driven to extremes.
const BASES: &[&str] = &[
    "weingarten fixtures/saddle.ron --iterations 2",
    "panel fixtures/saddle.ron --panels 4x4",
    "hnet fixtures/nets/scherk.obj",
    "darboux fixtures/nets/scherk.obj --c -0.6",
    "asymptotic fixtures/asymptotic/catenoid.ron",
    "fair fixtures/quads/cube.obj --levels 0 --iterations 2",
    "fit fixtures/grid.obj",
    "remesh fixtures/triangles/enneper-3.obj --faces 60",
    "convert fixtures/quads/cube.obj",
];
const EXTREMES: &[&str] = &[
    "0",
    "-1",
    "1",
    "nan",
    "inf",
    "-inf",
    "1e308",
    "-1e308",
    "5e-324",
    "1e-300",
    "4294967295",
    "4294967296",
    "18446744073709551615",
    "99999999999999999999999",
    "",
    " ",
    "0x0",
    "1x1",
    "1000000x1000000",
    "4294967295x2",
    "none",
    "auto",
    "\u{1F4A3}",
    "-",
    ".",
    "/",
];
/// They name files and folders, or end at once.
const LEFT_OUT: &[&str] = &[
    "--output",
    "--metrics",
    "--report",
    "--figures",
    "--lamellas",
    "--dump-system",
    "--help",
    "--version",
    "--checkpoint",
    "--surface",
    "--part",
];

/// Draws one option of one command and one extreme, or two of each.
pub(super) fn attempt(lab: &mut Lab, random: &mut Random, known: &Known) -> Outcome {
    let (base, options) = random.one(&known.0);
    let mut arguments: Vec<String> = base.split(' ').map(str::to_owned).collect();
    for _ in 0..=random.below(2) {
        let option = random.one(options);
        // As one word, so that a value may begin with a minus.
        arguments.push(format!("{option}={}", random.one(EXTREMES)));
    }
    lab.name_output(&mut arguments, "a.obj");
    lab.attempt(&arguments, None)
}

/// Commands with the options their help names.
pub(super) struct Known(Vec<(&'static str, Vec<String>)>);

impl Known {
    pub(super) fn new() -> Outcome<Self> {
        let mut known = Vec::new();
        for base in BASES {
            let command = base.split(' ').next().unwrap_or_default();
            let output = umbilic().args([command, "--help"]).output();
            let output = output.map_err(|e| format!("umbilic: {e}"))?;
            let options = named(&String::from_utf8_lossy(&output.stdout));
            if options.len() < 3 {
                return Err(format!("the help of {command} names no options"));
            }
            known.push((*base, options));
        }
        Ok(Self(known))
    }
}

/// The long options of a help text that take a value.
fn named(help: &str) -> Vec<String> {
    let lines = help.lines().map(str::trim_start).filter(|line| line.starts_with('-'));
    let options = lines.filter_map(|line| {
        let from = line.find("--")?;
        let takes_value = line.contains('<');
        let name: String =
            line[from..].chars().take_while(|c| c.is_ascii_lowercase() || *c == '-').collect();
        (takes_value && !LEFT_OUT.contains(&name.as_str())).then_some(name)
    });
    options.collect()
}

#[cfg(test)]
mod tests {
    use super::named;

    #[test]
    fn options_are_read_from_a_help_text() {
        let help = "Options:\n  -q, --quiet\n      --levels <UxV>\n          Such as --x\n  -o, --output <FILE>\n      --k[=<X>]  Why\n";
        assert_eq!(named(help), ["--levels", "--k"]);
    }
}
