//! What goes along with a run: its observer, the caller's blocks, and what has been solved so far.

use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Condvar, Mutex, PoisonError};
use std::time::Duration;

use geom_core::DVec3;
use gp_solver::{
    Checkpoint, Extra, Observer, Options as SolverOptions, Problem, Progress, Run, SolverError,
    Stage, StageReport, Status, System,
};
use rayon::prelude::*;

use crate::error::Error;

/// The name of the method in checkpoints.
const METHOD: &str = "asymptotic";
/// How often the watching thread looks up while others work.
const POLL: Duration = Duration::from_micros(200);

/// Whether those who work are to stop.
#[derive(Debug, Default)]
pub(crate) struct Stop(AtomicBool);

impl Stop {
    pub(crate) fn is_set(&self) -> bool {
        self.0.load(Ordering::Relaxed)
    }
}

/// Something solved that a resumed run need not solve again.
#[derive(Clone, Debug, Default)]
pub(crate) struct Entry {
    pub(crate) numbers: Vec<f64>,
    pub(crate) counts: Vec<u64>,
}

/// The companion of a run.
///
/// What is expensive is entered in the order in which it is solved. A resumed run goes through
/// the same steps, takes what is entered instead of solving it, and so ends with the same bytes.
pub(crate) struct Watch<'w, 'e> {
    observer: &'w mut dyn Observer,
    extra: Option<&'w mut Extra<'e, Error>>,
    /// Whether somebody is there to be asked.
    heeded: bool,
    fingerprint: u64,
    stage: Stage,
    entries: Vec<Entry>,
    /// The entry that comes next.
    next: usize,
    /// The state of the solve in which the run was interrupted.
    current: Option<Checkpoint>,
    reports: Vec<StageReport>,
    iterations: usize,
}

impl<'w, 'e> Watch<'w, 'e> {
    /// A run from the start or from the observer's checkpoint.
    pub(crate) fn new(
        observer: &'w mut dyn Observer,
        extra: Option<&'w mut Extra<'e, Error>>,
        fingerprint: u64,
        stages: usize,
        origin: DVec3,
    ) -> Result<Self, Error> {
        let resumed = observer.resume();
        let mut watch = Self {
            observer,
            extra,
            heeded: true,
            fingerprint,
            stage: Stage::new("", 0, stages).at(origin.to_array(), 1.0),
            entries: Vec::new(),
            next: 0,
            current: None,
            reports: Vec::new(),
            iterations: 0,
        };
        if let Some(checkpoint) = resumed {
            checkpoint.check(METHOD, fingerprint)?;
            let count = checkpoint.counts("solved")?.first().copied().unwrap_or(0);
            for k in 0..count {
                let name = entry_name(k as usize);
                let counts = checkpoint.counts(&name)?.to_vec();
                let len = checkpoint.numbers.get(&name).map_or(0, Vec::len);
                let numbers = checkpoint.numbers(&name, len)?.to_vec();
                watch.entries.push(Entry { numbers, counts });
            }
            watch.current = checkpoint.numbers.contains_key("x").then_some(checkpoint);
        }
        Ok(watch)
    }

    /// Nobody watches.
    pub(crate) fn quiet(nobody: &'w mut ()) -> Self {
        Self {
            observer: nobody,
            extra: None,
            heeded: false,
            fingerprint: 0,
            stage: Stage::only(""),
            entries: Vec::new(),
            next: 0,
            current: None,
            reports: Vec::new(),
            iterations: 0,
        }
    }

    /// Begins a stage.
    pub(crate) fn enter(&mut self, name: &str, number: usize) {
        let Stage { count, origin, unit, .. } = self.stage;
        self.stage = Stage::new(name, number, count).at(origin, unit);
    }

    /// The stage that was begun last, its unknowns counted from a point of what is solved, which has
    /// been moved to the origin already.
    pub(crate) fn stage_from(&self, point: DVec3) -> Stage {
        let Stage { origin, unit, .. } = self.stage;
        self.stage.clone().at((DVec3::from_array(origin) + point).to_array(), unit)
    }

    /// The stage that was begun last.
    pub(crate) fn stage(&self) -> &Stage {
        &self.stage
    }

    /// Shows the start (step 0) or the end of a stage that is solved at once.
    pub(crate) fn show(&mut self, iteration: usize, energy: f64) -> Result<(), Error> {
        let progress = Progress {
            stage: &self.stage,
            iteration,
            max_iterations: 1,
            energy,
            gradient_norm: 0.0,
            x: &[],
            system: None,
        };
        match self.observer.step(&progress).is_break() {
            true => Err(self.interrupted()),
            false => self.check(),
        }
    }

    /// Ends the run if the observer wants it to.
    pub(crate) fn check(&mut self) -> Result<(), Error> {
        if self.observer.stop_requested() { Err(self.interrupted()) } else { Ok(()) }
    }

    fn interrupted(&self) -> Error {
        Error::Interrupted { stage: self.stage.name.clone() }
    }

    /// Whether the caller adds blocks.
    pub(crate) fn is_extended(&self) -> bool {
        self.extra.is_some()
    }

    /// Does something without the caller's blocks: what serves to judge, not to solve.
    pub(crate) fn unextended<T>(&mut self, work: impl FnOnce(&mut Self) -> T) -> T {
        let extra = self.extra.take();
        let out = work(self);
        self.extra = extra;
        out
    }

    /// Lets the caller add blocks to the problem of a stage.
    pub(crate) fn extend(&mut self, stage: &Stage, problem: &mut Problem<'_>) -> Result<(), Error> {
        let Some(extra) = &mut self.extra else { return Ok(()) };
        let variables = problem.variables().clone();
        extra(stage, &variables, problem)
    }

    /// The next entry, if the run was interrupted after it.
    pub(crate) fn recall(&mut self) -> Option<Entry> {
        let entry = self.entries.get(self.next)?.clone();
        self.next += 1;
        Some(entry)
    }

    /// Enters what was solved, and offers a checkpoint.
    pub(crate) fn record(&mut self, entry: Entry) {
        if !self.heeded {
            return;
        }
        self.entries.push(entry);
        self.next = self.entries.len();
        let state = Kept { fingerprint: self.fingerprint, entries: &self.entries };
        self.observer.checkpoint(&|| state.checkpoint(self.stage.number, 0));
    }

    /// Minimises the problem of the present stage from `x`; returns the status and the steps taken.
    pub(crate) fn minimize(
        &mut self,
        problem: Problem<'_>,
        x: &mut [f64],
        options: &SolverOptions,
    ) -> Result<(Status, usize), Error> {
        if let Some(entry) = self.recall() {
            let steps = steps_of(&entry, x)?;
            self.iterations += steps.1;
            return Ok(steps);
        }
        let system = System::new(problem, options.factorization)?;
        let mut run = Run::new(system, x, options)?;
        if let Some(state) = self.current.take() {
            run.resume(&state)?;
        }
        let kept = Kept { fingerprint: self.fingerprint, entries: &self.entries };
        let stage = self.stage.clone();
        let mut inner = Inner { observer: &mut *self.observer, kept, stage: stage.number };
        let result = run.go_on(&stage, &mut inner);
        x.copy_from_slice(run.x());
        let status = result?;
        if status == Status::Interrupted {
            return Err(self.interrupted());
        }
        let report = run.report(status);
        let iterations = report.iterations;
        self.iterations += iterations;
        if self.heeded {
            self.reports.push(StageReport { stage, solver: report });
            let counts = vec![iterations as u64, u64::from(status == Status::IterationLimit)];
            self.record(Entry { numbers: x.to_vec(), counts });
        }
        Ok((status, iterations))
    }

    /// As [`minimize`](Self::minimize), but what cannot be solved stays as it is: for problems that
    /// only improve what is valid already. Blocks of the caller's make no such promise.
    pub(crate) fn improve(
        &mut self,
        problem: Problem<'_>,
        x: &mut [f64],
        options: &SolverOptions,
    ) -> Result<usize, Error> {
        match self.minimize(problem, x, options) {
            Ok((_, iterations)) => Ok(iterations),
            Err(Error::Solver(SolverError::ForeignCheckpoint { what })) => {
                Err(SolverError::ForeignCheckpoint { what }.into())
            }
            Err(Error::Solver(_)) if !self.is_extended() => {
                self.record(Entry { numbers: x.to_vec(), counts: vec![0, 0] });
                Ok(0)
            }
            Err(error) => Err(error),
        }
    }

    /// Does the same for `0..count`, in parallel, while the observer is asked whether to stop.
    pub(crate) fn each<T: Send>(
        &mut self,
        count: usize,
        work: impl Fn(usize, &Stop) -> T + Sync,
    ) -> Result<Vec<T>, Error> {
        let stop = Stop::default();
        if !self.heeded {
            return Ok((0..count).into_par_iter().map(|k| work(k, &stop)).collect());
        }
        let left = Left { count: Mutex::new(count), none: Condvar::new() };
        let mut slots: Vec<Option<T>> = (0..count).map(|_| None).collect();
        rayon::in_place_scope(|scope| {
            for (k, slot) in slots.iter_mut().enumerate() {
                let (stop, left, work) = (&stop, &left, &work);
                scope.spawn(move |_| {
                    let _counted = Counted(left);
                    if !stop.is_set() {
                        *slot = Some(work(k, stop));
                    }
                });
            }
            loop {
                if self.observer.stop_requested() {
                    stop.0.store(true, Ordering::Relaxed);
                }
                // On a thread of the pool the work may have no other thread to run on.
                let executed = matches!(rayon::yield_now(), Some(rayon::Yield::Executed));
                if left.is_none_within(if executed { Duration::ZERO } else { POLL }) {
                    break;
                }
            }
        });
        // What was done after the sign to stop may be half done.
        if stop.is_set() {
            return Err(self.interrupted());
        }
        Ok(slots.into_iter().flatten().collect())
    }

    /// Steps of all least-squares solves, and what they say of themselves.
    pub(crate) fn into_reports(self) -> (usize, Vec<StageReport>) {
        (self.iterations, self.reports)
    }
}

/// How many pieces of work are not done.
struct Left {
    count: Mutex<usize>,
    none: Condvar,
}

impl Left {
    /// Whether all is done, or is so before the time is over.
    fn is_none_within(&self, time: Duration) -> bool {
        let count = self.count.lock().unwrap_or_else(PoisonError::into_inner);
        let waited = self.none.wait_timeout_while(count, time, |count| *count > 0);
        let (count, _) = waited.unwrap_or_else(PoisonError::into_inner);
        *count == 0
    }
}

/// Counts down when it goes, also in a panic.
struct Counted<'l>(&'l Left);

impl Drop for Counted<'_> {
    fn drop(&mut self) {
        let mut count = self.0.count.lock().unwrap_or_else(PoisonError::into_inner);
        *count -= 1;
        if *count == 0 {
            self.0.none.notify_all();
        }
    }
}

fn entry_name(k: usize) -> String {
    format!("solved {k:05}")
}

fn steps_of(entry: &Entry, x: &mut [f64]) -> Result<(Status, usize), Error> {
    let &[iterations, limit] = entry.counts.as_slice() else { return Err(foreign()) };
    if entry.numbers.len() != x.len() {
        return Err(foreign());
    }
    x.copy_from_slice(&entry.numbers);
    let status = if limit == 1 { Status::IterationLimit } else { Status::Converged };
    Ok((status, iterations as usize))
}

/// A checkpoint that does not fit.
pub(crate) fn foreign() -> Error {
    let what = "a run of another size".to_owned();
    Error::Solver(SolverError::ForeignCheckpoint { what })
}

/// What every checkpoint has.
#[derive(Clone, Copy)]
struct Kept<'k> {
    fingerprint: u64,
    entries: &'k [Entry],
}

impl Kept<'_> {
    fn checkpoint(&self, stage: usize, iteration: usize) -> Checkpoint {
        self.added_to(Checkpoint::new(METHOD, self.fingerprint, stage, iteration))
    }

    fn added_to(&self, mut state: Checkpoint) -> Checkpoint {
        state = state.with_counts("solved", &[self.entries.len() as u64]);
        for (k, entry) in self.entries.iter().enumerate() {
            let name = entry_name(k);
            state = state.with_numbers(&name, &entry.numbers).with_counts(&name, &entry.counts);
        }
        state
    }
}

/// Passes a solve on to the observer of the run.
struct Inner<'o> {
    observer: &'o mut dyn Observer,
    kept: Kept<'o>,
    stage: usize,
}

impl Observer for Inner<'_> {
    fn step(&mut self, progress: &Progress<'_>) -> std::ops::ControlFlow<()> {
        self.observer.step(progress)
    }

    fn stop_requested(&mut self) -> bool {
        self.observer.stop_requested()
    }

    fn checkpoint(&mut self, state: &dyn Fn() -> Checkpoint) {
        let (kept, stage) = (self.kept, self.stage);
        self.observer.checkpoint(&|| {
            let state = kept.added_to(state());
            let fingerprint = kept.fingerprint;
            Checkpoint { method: METHOD.to_owned(), fingerprint, stage, ..state }
        });
    }
}

/// What a caller may change about a problem: its blocks, their weights, what is fixed.
#[derive(PartialEq)]
pub(crate) struct Shape {
    blocks: Vec<(gp_solver::BlockId, Option<f64>)>,
    fixed: Vec<bool>,
}

impl Shape {
    pub(crate) fn of(problem: &Problem<'_>) -> Self {
        let blocks = problem.blocks().map(|(id, _)| (id, problem.weight(id).ok())).collect();
        Self { blocks, fixed: problem.variables().fixed().to_vec() }
    }

    pub(crate) fn is_fixed(&self, unknown: usize) -> bool {
        self.fixed[unknown]
    }
}
