//! `umbilic convert IN OUT`.

use crate::args::check_output_path;
use crate::context::Context;
use crate::failure::Failure;
use crate::outcome::{Outcome, Status};
use std::path::PathBuf;

/// Arguments of `convert`.
#[derive(Debug, clap::Args)]
pub(crate) struct Convert {
    /// File to read
    input: PathBuf,
    /// File to write; the extension chooses the format
    output: PathBuf,
}

impl Convert {
    pub(crate) fn run(self, _context: &Context) -> Result<Outcome, Failure> {
        exchange::check_format(&self.output).map_err(|e| Failure::input(&self.output, e))?;
        check_output_path(&self.output)?;
        let model =
            exchange::read_model(&self.input).map_err(|e| Failure::input(&self.input, e))?;
        let bytes = exchange::encode_model(&self.output, &model)
            .map_err(|e| Failure::input(&self.output, e))?;
        let mut outcome = Outcome::new(Status::Converged, 0).with_input(&self.input);
        outcome.warnings = model.warnings;
        outcome.files.push((self.output, bytes));
        Ok(outcome)
    }
}
