//! The files a command line names: which of them are read, which are written.
//!
//! What is not an output is an input: whatever argument names a file that exists is taken for one
//! that the run reads, so that no option is forgotten.

use crate::choice::Choice;
use crate::failure::{Failure, twice};
use crate::outcome::Outcome;
use crate::stdout::STDOUT;
use clap::{ArgMatches, Command};
use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

/// Arguments that name a file to write.
const OUTPUTS: [&str; 4] = ["output", "report", "metrics", "checkpoint"];
/// Arguments that name a folder to write to.
const FOLDERS: [&str; 4] = ["figures", "lamellas", "dump_system", "folder"];
/// Arguments whose output may be the standard one.
const STREAMS: [&str; 2] = ["report", "metrics"];

/// An argument and the file it names.
type Named = (String, PathBuf);

/// The files and folders of one command line.
#[derive(Debug, Default)]
pub(crate) struct Paths {
    pub(crate) choice: Choice,
    inputs: Vec<Named>,
    outputs: Vec<Named>,
    folders: Vec<PathBuf>,
}

impl Paths {
    /// Collects them from the arguments of the command that was called.
    pub(crate) fn of(program: &Command, matches: &ArgMatches) -> Self {
        let mut paths = Self::default();
        if let Some((name, matches)) = matches.subcommand()
            && let Some(command) = program.find_subcommand(name)
        {
            // Global arguments may be listed with the command too.
            let global = program.get_arguments().filter(|arg| arg.is_global_set());
            let all = command.get_arguments().chain(global).map(|arg| arg.get_id().as_str());
            for id in all.collect::<BTreeSet<_>>() {
                paths.add(id, matches);
            }
            let said = |id: &str| -> Vec<String> {
                let values = matches.try_get_raw(id).ok().flatten().into_iter().flatten();
                values.map(|value| value.to_string_lossy().into_owned()).collect()
            };
            let input_format = said("input_format").pop();
            paths.choice = Choice { surface: said("surface"), part: said("part"), input_format };
        }
        paths
    }

    fn add(&mut self, id: &str, matches: &ArgMatches) {
        let values = matches.try_get_raw(id).ok().flatten().into_iter().flatten();
        for path in values.map(PathBuf::from) {
            if OUTPUTS.contains(&id) {
                self.outputs.push((id.to_owned(), path));
            } else if FOLDERS.contains(&id) {
                self.folders.push(path);
            } else {
                // Some options take a file in place of a value, behind a word.
                let text = path.to_string_lossy();
                let behind = text.split_once('=').map(|(_, rest)| PathBuf::from(rest));
                // What a shell has put behind standard input is a file as well.
                let piped = (path == Path::new(STDOUT)).then(|| PathBuf::from("/dev/stdin"));
                let files = [Some(path.clone()), behind, piped].into_iter().flatten();
                self.inputs.extend(files.filter(|p| p.is_file()).map(|p| (id.to_owned(), p)));
            }
        }
    }

    /// Refuses outputs that are inputs, or one another, before any work is done.
    pub(crate) fn check(&self) -> Result<(), Failure> {
        for (k, (id, path)) in self.outputs.iter().enumerate() {
            self.check_stream(id, path)?;
            self.check_input(id == "checkpoint", path)?;
            let is_other = |(other_id, other): &&Named| {
                // A name given twice for `-o` has a sentence of its own.
                let is_repeated = id == "output" && other_id == "output" && path == other;
                !is_repeated && exchange::is_same_file(path, other)
            };
            if let Some((_, other)) = self.outputs[..k].iter().find(is_other) {
                return Err(twice(path, other));
            }
        }
        Ok(())
    }

    /// As [`Self::check`], of everything that is about to be written.
    pub(crate) fn check_results(&self, outcome: &Outcome) -> Result<(), Failure> {
        for (path, _) in outcome.files.iter().chain(&outcome.pages) {
            self.check_input(false, path)?;
        }
        Ok(())
    }

    fn check_input(&self, is_checkpoint: bool, path: &Path) -> Result<(), Failure> {
        // A run may go on from the checkpoint that it writes.
        let counts = |id: &str| !(is_checkpoint && id == "resume");
        let same = |(id, input): &&Named| counts(id) && exchange::is_same_file(path, input);
        match self.inputs.iter().find(same) {
            None => Ok(()),
            Some((_, input)) if input == path => Err(Failure::usage(format!(
                "{}: this run reads the file; name another output",
                path.display()
            ))),
            Some((_, input)) => Err(Failure::usage(format!(
                "{}: is the file {} that this run reads; name another output",
                path.display(),
                input.display()
            ))),
        }
    }

    fn check_stream(&self, id: &str, path: &Path) -> Result<(), Failure> {
        if path == Path::new(STDOUT) && !STREAMS.contains(&id) {
            return Err(Failure::usage(format!(
                "--{id} -: only --metrics and --report can be written to standard output; name a file"
            )));
        }
        Ok(())
    }

    /// Makes the folders that options name, if anything is to be written to them.
    pub(crate) fn make_folders(&self, outcome: &Outcome) -> Result<(), Failure> {
        for folder in &self.folders {
            if outcome.written().any(|(path, _)| path.starts_with(folder)) {
                exchange::make_folder(folder).map_err(|e| Failure::input(folder, e))?;
            }
        }
        Ok(())
    }

    /// Whether something other than the summary goes to standard output.
    pub(crate) fn use_stdout(&self) -> bool {
        self.outputs.iter().any(|(_, path)| path == Path::new(STDOUT))
    }
}
