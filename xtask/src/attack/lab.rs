//! Running the program on hostile input, and what every run must keep to.

use crate::shell::{Outcome, root, target, umbilic};
use std::collections::BTreeMap;
use std::fs;
use std::io::Read;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, ExitStatus, Stdio};
use std::thread;
use std::time::{Duration, Instant};

/// A run on a small file ends within this.
const LIMIT: Duration = Duration::from_secs(30);
/// Address space of a run in kilobytes.
const MEMORY: &str = "4000000";
/// Lines of a refusal at most.
const SENTENCE: usize = 9;

/// Where attacks are made, and what fell.
pub(super) struct Lab {
    pub(super) folder: PathBuf,
    pub(super) runs: usize,
    codes: BTreeMap<i32, usize>,
    faults: Vec<String>,
}

/// How a run ended.
pub(super) struct Ended {
    status: Option<ExitStatus>,
    stdout: String,
    stderr: String,
}

impl Lab {
    pub(super) fn new() -> Outcome<Self> {
        let folder = target().join("attack");
        if folder.exists() {
            fs::remove_dir_all(&folder).map_err(|e| format!("{}: {e}", folder.display()))?;
        }
        for name in ["out", "found"] {
            let path = folder.join(name);
            fs::create_dir_all(&path).map_err(|e| format!("{}: {e}", path.display()))?;
        }
        Ok(Self { folder, runs: 0, codes: BTreeMap::new(), faults: Vec::new() })
    }

    /// Where the attempt in hand writes.
    pub(super) fn out(&self, name: &str) -> String {
        self.folder.join("out").join(name).display().to_string()
    }

    /// Adds to a command line where it writes, as the command wants that named.
    pub(super) fn name_output(&self, arguments: &mut Vec<String>, name: &str) {
        let is_named = match arguments.first().map_or("", String::as_str) {
            "analyze" | "verify" => return,
            "convert" => false,
            _ => true,
        };
        arguments.extend(is_named.then(|| "-o".to_owned()));
        arguments.push(self.out(name));
    }

    /// Runs the program and notes what is wrong about how it ended; `hostile` is the input to keep
    /// then.
    pub(super) fn attempt(&mut self, arguments: &[String], hostile: Option<&Path>) -> Outcome {
        self.empty_out()?;
        let ended = run(limited(arguments))?;
        self.runs += 1;
        let code = ended.status.and_then(|s| s.code());
        code.into_iter().for_each(|code| *self.codes.entry(code).or_default() += 1);
        let left = self.left()?;
        // That files and metrics differ is an answer, not a fault.
        let differs = code == Some(1) && arguments.first().is_some_and(|c| c == "verify");
        if let Some(fault) = judge(&ended, &left).filter(|_| !differs) {
            self.fault(&fault, arguments, hostile)?;
        }
        Ok(())
    }

    pub(super) fn fault(
        &mut self,
        fault: &str,
        arguments: &[String],
        hostile: Option<&Path>,
    ) -> Outcome {
        let mut line = format!("{fault}: umbilic {}", arguments.join(" "));
        if let Some(path) = hostile {
            let extension = path.extension().map_or_else(Default::default, |e| e.to_string_lossy());
            let kept = self.folder.join("found").join(format!("{}.{extension}", self.faults.len()));
            fs::copy(path, &kept).map_err(|e| format!("{}: {e}", kept.display()))?;
            line += &format!(" (input kept as {})", kept.display());
        }
        println!("  {line}");
        self.faults.push(line);
        Ok(())
    }

    /// Names and sizes of what a run has left.
    pub(super) fn left(&self) -> Outcome<Vec<(String, u64)>> {
        let folder = self.folder.join("out");
        let list = fs::read_dir(&folder).map_err(|e| format!("{}: {e}", folder.display()))?;
        let mut left: Vec<(String, u64)> = list
            .flatten()
            .map(|entry| {
                let size = entry.metadata().map_or(0, |m| m.len());
                (entry.file_name().to_string_lossy().into_owned(), size)
            })
            .collect();
        left.sort();
        Ok(left)
    }

    pub(super) fn empty_out(&self) -> Outcome {
        let folder = self.folder.join("out");
        let failed = |e: std::io::Error| format!("{}: {e}", folder.display());
        fs::remove_dir_all(&folder).map_err(failed)?;
        fs::create_dir_all(&folder).map_err(failed)
    }

    /// How many runs there were and how they ended, or what fell.
    pub(super) fn told(self) -> Outcome<String> {
        let codes: Vec<String> =
            self.codes.iter().map(|(code, n)| format!("{n} with code {code}")).collect();
        let told = format!("{} runs: {}", self.runs, codes.join(", "));
        if self.faults.is_empty() {
            Ok(told)
        } else {
            Err(format!("{told}; {} fell:\n{}", self.faults.len(), self.faults.join("\n")))
        }
    }
}

/// The program with limits on what it may use, where the system has such.
fn limited(arguments: &[String]) -> Command {
    let mut command = if cfg!(unix) {
        let mut shell = Command::new("sh");
        shell.args(["-c", &format!("ulimit -v {MEMORY}; exec \"$0\" \"$@\"")]);
        shell.arg(umbilic().get_program()).current_dir(root());
        shell
    } else {
        umbilic()
    };
    command.args(arguments);
    command
}

/// Runs a command to its end or to the limit, whichever comes first.
fn run(mut command: Command) -> Outcome<Ended> {
    command.stdin(Stdio::null()).stdout(Stdio::piped()).stderr(Stdio::piped());
    let mut child = command.spawn().map_err(|e| format!("umbilic: {e}"))?;
    // Pipes are read beside, so that a long summary does not block the program.
    let texts = [reader(child.stdout.take()), reader(child.stderr.take())];
    let status = waited(&mut child)?;
    let [stdout, stderr] = texts.map(|text| text.join().unwrap_or_default());
    Ok(Ended { status, stdout, stderr })
}

fn reader(pipe: Option<impl Read + Send + 'static>) -> thread::JoinHandle<String> {
    thread::spawn(move || {
        let mut bytes = Vec::new();
        if let Some(mut pipe) = pipe {
            // What was read before an error is judged.
            let _ = pipe.read_to_end(&mut bytes);
        }
        String::from_utf8_lossy(&bytes).into_owned()
    })
}

fn waited(child: &mut Child) -> Outcome<Option<ExitStatus>> {
    let start = Instant::now();
    loop {
        if let Some(status) = child.try_wait().map_err(|e| format!("umbilic: {e}"))? {
            return Ok(Some(status));
        }
        if start.elapsed() > LIMIT {
            child.kill().and_then(|()| child.wait()).map_err(|e| format!("umbilic: {e}"))?;
            return Ok(None);
        }
        thread::sleep(Duration::from_millis(2));
    }
}

/// What is wrong with the end of a run, if anything is.
fn judge(ended: &Ended, left: &[(String, u64)]) -> Option<String> {
    let Some(status) = ended.status else {
        return Some(format!("no end within {} s", LIMIT.as_secs()));
    };
    let said = ended.stderr.trim();
    if said.contains("panicked") || said.contains("overflowed its stack") {
        return Some(format!("it panicked ({said})"));
    }
    let without_number =
        |text: &str| text.split_whitespace().any(|w| w == "NaN" || w == "inf" || w == "-inf");
    match status.code() {
        Some(0 | 3) => {
            let empty = left.iter().find(|(_, size)| *size == 0);
            empty.map(|(name, _)| format!("{name} is empty")).or_else(|| {
                without_number(&ended.stdout).then(|| format!("no number in {}", ended.stdout))
            })
        }
        Some(2) if !is_sentence(said) => Some(format!("code 2 without a sentence ({said})")),
        Some(2) if said.lines().count() > SENTENCE => Some(format!("a refusal of pages ({said})")),
        Some(2) if !left.is_empty() => Some(format!("refused, and yet there is {}", left[0].0)),
        Some(2 | 4) => None,
        Some(code) => Some(format!("code {code} ({said})")),
        None => Some(format!("{status} ({said})")),
    }
}

/// Whether a refusal is one of the program's, or of the reader of its options.
fn is_sentence(said: &str) -> bool {
    ["umbilic: ", "error: "].iter().any(|start| said.starts_with(start))
}

#[cfg(all(test, unix))]
mod tests {
    use super::*;
    use std::os::unix::process::ExitStatusExt;

    fn ended(code: i32, stdout: &str, stderr: &str) -> Ended {
        let status = Some(ExitStatus::from_raw(code << 8));
        Ended { status, stdout: stdout.to_owned(), stderr: stderr.to_owned() }
    }

    #[test]
    fn what_every_run_keeps_to_is_judged() {
        let whole = [("a.obj".to_owned(), 10)];
        assert_eq!(judge(&ended(0, "H -1 to 2", ""), &whole), None);
        assert_eq!(judge(&ended(2, "", "umbilic: a.obj: line 3: no number"), &[]), None);
        for (ended, left, want) in [
            (ended(0, "H NaN to 2", ""), &whole[..], "no number"),
            (ended(2, "", "umbilic: no"), &whole, "refused, and yet"),
            (ended(2, "", "oh"), &[], "without a sentence"),
            (ended(101, "", "thread main panicked"), &[], "panicked"),
            (ended(0, "", ""), &[("b".to_owned(), 0)], "is empty"),
            (Ended { status: None, stdout: String::new(), stderr: String::new() }, &[], "no end"),
        ] {
            assert!(judge(&ended, left).is_some_and(|fault| fault.contains(want)), "{want}");
        }
    }
}
