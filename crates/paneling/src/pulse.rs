//! The observer of a run, where it can be asked from everywhere.

use gp_solver::{Checkpoint, Observer, Progress};
use rayon::prelude::*;
use std::cell::{Cell, RefCell};

/// Items that are worked on in parallel between two questions whether to stop.
const CHUNK: usize = 1024;

/// An observer shared by the loops of a run, on the thread that steps. Once it has asked for a stop
/// it is not asked again.
pub(crate) struct Pulse<'o> {
    observer: RefCell<&'o mut dyn Observer>,
    is_stopped: Cell<bool>,
}

impl<'o> Pulse<'o> {
    pub(crate) fn new(observer: &'o mut dyn Observer) -> Self {
        Self { observer: RefCell::new(observer), is_stopped: Cell::new(false) }
    }

    /// Whether to stop at once.
    pub(crate) fn is_stopped(&self) -> bool {
        if !self.is_stopped.get() {
            self.is_stopped.set(self.observer.borrow_mut().stop_requested());
        }
        self.is_stopped.get()
    }

    /// Shows a step.
    pub(crate) fn show(&self, progress: &Progress<'_>) {
        if self.observer.borrow_mut().step(progress).is_break() {
            self.is_stopped.set(true);
        }
    }

    /// Offers the state.
    pub(crate) fn offer(&self, state: &dyn Fn() -> Checkpoint) {
        self.observer.borrow_mut().checkpoint(state);
    }

    /// Where to go on from.
    pub(crate) fn resume(&self) -> Option<Checkpoint> {
        self.observer.borrow_mut().resume()
    }

    /// `of(i)` of all `i`, in parallel; `None` if asked to stop in between.
    pub(crate) fn map<T: Send>(
        &self,
        count: usize,
        least: usize,
        of: impl Fn(usize) -> T + Send + Sync,
    ) -> Option<Vec<T>> {
        self.map_with(count, least, || (), |(), i| of(i))
    }

    /// As [`map`](Self::map), with scratch space.
    pub(crate) fn map_with<S, T: Send>(
        &self,
        count: usize,
        least: usize,
        scratch: impl Fn() -> S + Send + Sync,
        of: impl Fn(&mut S, usize) -> T + Send + Sync,
    ) -> Option<Vec<T>> {
        let mut all = Vec::with_capacity(count);
        for first in (0..count).step_by(CHUNK) {
            if self.is_stopped() {
                return None;
            }
            let range = first..(first + CHUNK).min(count);
            all.par_extend(range.into_par_iter().with_min_len(least).map_init(&scratch, &of));
        }
        Some(all)
    }

    /// `of(m, item)` of every mold with its item, in parallel; `None` if asked to stop in between.
    /// `members` has the panels of each mold.
    pub(crate) fn map_molds<I: Send, T: Send>(
        &self,
        members: &[Vec<usize>],
        items: Vec<I>,
        of: impl Fn(usize, I) -> T + Send + Sync,
    ) -> Option<Vec<T>> {
        let mut all = Vec::with_capacity(members.len());
        let mut items = items.into_iter();
        while all.len() < members.len() {
            if self.is_stopped() {
                return None;
            }
            let first = all.len();
            let mut panels = 0;
            let fits = |m: &&Vec<usize>| {
                panels += m.len();
                panels <= CHUNK
            };
            let count = members[first..].iter().take_while(fits).count().max(1);
            let chunk: Vec<I> = items.by_ref().take(count).collect();
            all.par_extend(chunk.into_par_iter().enumerate().map(|(k, item)| of(first + k, item)));
        }
        Some(all)
    }
}

/// A pulse as an observer that can only ask to stop, for the loops of the solver.
pub(crate) struct Stop<'p, 'o>(pub(crate) &'p Pulse<'o>);

impl Observer for Stop<'_, '_> {
    fn stop_requested(&mut self) -> bool {
        self.0.is_stopped()
    }
}
