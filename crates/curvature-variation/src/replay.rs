//! Evaluations of a function that a resumed minimisation need not make again.

use std::cell::RefCell;
use std::ops::ControlFlow;

use gp_solver::{Checkpoint, Objective, Observer, Progress, SolverError};

use crate::checkpoint::METHOD;

/// Name of the counts that hold the answers.
const ANSWERS: &str = "evaluations";

/// What a function has answered: value and gradient, one evaluation after the other.
///
/// A minimisation is a function of these answers. One that is begun anew and given them again takes
/// the same steps to the bit, at no cost worth mentioning where unknowns are few.
#[derive(Default)]
pub(crate) struct Answers {
    numbers: RefCell<Numbers>,
    fingerprint: u64,
}

#[derive(Default)]
struct Numbers {
    all: Vec<f64>,
    /// Where the next answer begins.
    next: usize,
}

impl Answers {
    /// Those of a checkpoint for a function of so many unknowns, or none.
    ///
    /// # Errors
    /// [`SolverError::ForeignCheckpoint`].
    pub(crate) fn resumed(
        fingerprint: u64,
        resume: Option<&Checkpoint>,
        unknowns: usize,
    ) -> Result<Self, SolverError> {
        let Some(checkpoint) = resume else { return Ok(Self { fingerprint, ..Self::default() }) };
        checkpoint.check(METHOD, fingerprint)?;
        // As bits: a trial point may have no finite value.
        let all: Vec<f64> =
            checkpoint.counts(ANSWERS)?.iter().map(|b| f64::from_bits(*b)).collect();
        if !all.len().is_multiple_of(unknowns + 1) {
            let what = "a run of another size, or its evaluations are damaged".to_owned();
            return Err(SolverError::ForeignCheckpoint { what });
        }
        Ok(Self { numbers: RefCell::new(Numbers { all, next: 0 }), fingerprint })
    }

    fn checkpoint(&self, progress: &Progress<'_>) -> Checkpoint {
        let bits: Vec<u64> = self.numbers.borrow().all.iter().map(|x| x.to_bits()).collect();
        Checkpoint::new(METHOD, self.fingerprint, progress.stage.number, progress.iteration)
            .with_counts(ANSWERS, &bits)
    }
}

/// A function that is only evaluated where its answer is not known yet.
pub(crate) struct Replayed<'o, O> {
    pub(crate) objective: &'o mut O,
    pub(crate) answers: &'o Answers,
}

impl<O: Objective> Objective for Replayed<'_, O> {
    fn value_and_gradient(&mut self, x: &[f64], gradient: &mut [f64]) -> f64 {
        let mut numbers = self.answers.numbers.borrow_mut();
        let begin = numbers.next;
        numbers.next += 1 + x.len();
        if let Some([value, known @ ..]) = numbers.all.get(begin..begin + 1 + x.len()) {
            gradient.copy_from_slice(known);
            return *value;
        }
        let value = self.objective.value_and_gradient(x, gradient);
        numbers.all.push(value);
        numbers.all.extend_from_slice(gradient);
        value
    }
}

/// Offers the answers with every step.
pub(crate) struct Offering<'o> {
    pub(crate) observer: &'o mut dyn Observer,
    pub(crate) answers: &'o Answers,
}

impl Observer for Offering<'_> {
    fn step(&mut self, progress: &Progress<'_>) -> ControlFlow<()> {
        self.observer.checkpoint(&|| self.answers.checkpoint(progress));
        self.observer.step(progress)
    }

    fn stop_requested(&mut self) -> bool {
        self.observer.stop_requested()
    }
}
