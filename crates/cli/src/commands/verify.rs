//! `umbilic verify METRICS.json [FILE…]`.

use crate::choice::Choice;
use crate::context::Context;
use crate::failure::Failure;
use crate::outcome::{Outcome, Status};
use crate::stdout::STDOUT;
use crate::written;
use serde::{Deserialize, Serialize};
use std::path::{Path, PathBuf};
use verify::{Content, Finding, Verdict, check};

/// Arguments of `verify`.
#[derive(Debug, clap::Args)]
#[command(after_help = "\
Examples:
  umbilic fit fixtures/grid.obj -o fitted.step --metrics fitted.json
  umbilic verify fitted.json
Exit code 1 if a claim and the file differ. docs/guide/verify.md lists what can be checked.")]
pub(crate) struct Verify {
    /// Metrics file of a run
    #[arg(value_name = "METRICS.json")]
    run: PathBuf,
    /// Files the run wrote [default: those the metrics name]
    #[arg(value_name = "FILE")]
    files: Vec<PathBuf>,
    /// What the run was given [default: the file the metrics name]
    #[arg(long, value_name = "FILE")]
    input: Option<PathBuf>,
}

/// What a run says of itself.
#[derive(Deserialize)]
struct Run {
    command: String,
    status: String,
    input: Option<String>,
    outputs: Vec<String>,
    metrics: serde_json::Value,
    #[serde(flatten)]
    choice: Choice,
}

impl Verify {
    pub(crate) fn run(self, _: &Context) -> Result<Outcome, Failure> {
        let text = exchange::read_text(&self.run).map_err(|e| Failure::input(&self.run, e))?;
        let run: Run = serde_json::from_str(&text).map_err(|e| {
            Failure::input(&self.run, format!("{e}; give a file that --metrics has written"))
        })?;
        let mut outcome = Outcome::new(Status::Converged, 0).with_input(&self.run);
        let input = self.input_of(&run, &mut outcome)?;
        let mut checked: Vec<(PathBuf, Vec<Finding>)> = Vec::new();
        for path in self.files_of(&run) {
            let file = written::read(&run.command, &path)?;
            checked.push((path, check(&run.command, &run.metrics, &file, input.as_ref())));
        }
        if checked.is_empty()
            && let (Some(input), Some(name)) = (&input, &run.input)
            && run.outputs.is_empty()
        {
            // A command that measures writes no geometry: its input is what it speaks of.
            let findings = check(&run.command, &run.metrics, input, Some(input));
            checked.push((PathBuf::from(name), findings));
        }
        let rest = match checked.first() {
            Some((_, first)) => unchecked(first, &checked),
            None => check(&run.command, &run.metrics, &Content::default(), None),
        };
        let report = Report::new(&checked, &rest);
        outcome.summary = lines(&run, &checked, &rest, &report);
        outcome.differs = report.differing > 0;
        outcome.with_metrics(&report)
    }

    /// The files to look at: those given, or those of the run that may hold geometry.
    fn files_of(&self, run: &Run) -> Vec<PathBuf> {
        if !self.files.is_empty() {
            return self.files.clone();
        }
        let outputs = run.outputs.iter().map(|name| self.found(name));
        let is_metrics = |path: &PathBuf| same_file(path, &self.run);
        outputs.filter(|p| written::is_content(&run.command, p) && !is_metrics(p)).collect()
    }

    /// Where a file is that the run names: where it says, or else beside the metrics.
    fn found(&self, name: &str) -> PathBuf {
        let path = PathBuf::from(name);
        let beside =
            self.run.parent().zip(path.file_name()).map(|(folder, file)| folder.join(file));
        match beside {
            Some(beside) if !path.exists() && beside.exists() => beside,
            _ => path,
        }
    }

    fn input_of(&self, run: &Run, outcome: &mut Outcome) -> Result<Option<Content>, Failure> {
        if let Some(path) = &self.input {
            return written::read_input(path, &run.choice).map(Some);
        }
        if run.command == "demo" {
            let model = exchange::read_scene(super::demo::ROOF).map_err(Failure::other)?;
            return written::of_model(&model).map(Some).map_err(Failure::other);
        }
        let Some(name) = &run.input else { return Ok(None) };
        // What a claim about the input is worth without it: nothing; the others stand.
        let read = match name.as_str() {
            STDOUT => Err(Failure::usage("it was standard input; give a file of it as --input")),
            _ => written::read_input(&self.found(name), &run.choice),
        };
        Ok(read.map_err(|e| outcome.warnings.push(format!("the input is left out: {e}"))).ok())
    }
}

fn same_file(a: &Path, b: &Path) -> bool {
    matches!((a.canonicalize(), b.canonicalize()), (Ok(a), Ok(b)) if a == b)
}

/// Claims that no file holds.
fn unchecked(first: &[Finding], checked: &[(PathBuf, Vec<Finding>)]) -> Vec<Finding> {
    let is_open = |k: usize| checked.iter().all(|(_, f)| f[k].verdict == Verdict::NotCheckable);
    (0..first.len()).filter(|k| is_open(*k)).map(|k| first[k].clone()).collect()
}

/// The `metrics` of the check.
#[derive(Serialize)]
struct Report {
    checked: usize,
    differing: usize,
    not_checkable: usize,
}

impl Report {
    fn new(checked: &[(PathBuf, Vec<Finding>)], rest: &[Finding]) -> Self {
        let count = |verdict: Verdict| {
            checked.iter().flat_map(|(_, f)| f).filter(|f| f.verdict == verdict).count()
        };
        let differing = count(Verdict::Differs);
        Self { checked: count(Verdict::Same) + differing, differing, not_checkable: rest.len() }
    }
}

fn lines(
    run: &Run,
    checked: &[(PathBuf, Vec<Finding>)],
    rest: &[Finding],
    report: &Report,
) -> Vec<String> {
    let mut lines = vec![format!("{}, {}", run.command, run.status.replace('_', " "))];
    let width = checked.iter().flat_map(|(_, f)| f).chain(rest).map(|f| f.key.len()).max();
    let width = width.unwrap_or(0).max(3);
    let row = |key: &str, claimed: &str, got: &str, accuracy: &str, verdict: &str| {
        format!("  {key:width$} | {claimed:>20} | {got:>20} | {accuracy:>8} | {verdict}")
    };
    let heading = row("key", "claimed", "recomputed", "accuracy", "verdict");
    for (path, findings) in checked {
        lines.push(path.display().to_string());
        lines.push(heading.clone());
        for f in findings {
            let Some(got) = f.recomputed else { continue };
            let verdict = if f.verdict == Verdict::Same { "same" } else { "DIFFERS" };
            lines.push(row(
                &f.key,
                &number(f.claimed),
                &number(got),
                &format!("{:.1e}", f.accuracy),
                verdict,
            ));
        }
    }
    if !rest.is_empty() {
        lines.push("no file".to_owned());
        lines.push(heading);
        let said =
            |f: &Finding| row(&f.key, &number(f.claimed), "", "", "not checkable from files");
        lines.extend(rest.iter().map(said));
    }
    lines.push(format!(
        "{} claims checked, {} differ, {} are not checkable from files",
        report.checked, report.differing, report.not_checkable
    ));
    lines
}

/// Whole numbers as they are, others with twelve digits.
fn number(x: f64) -> String {
    if x.fract() == 0.0 && x.abs() < 1e15 { format!("{x}") } else { format!("{x:.11e}") }
}
