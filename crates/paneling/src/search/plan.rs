//! Which attempt comes next.
//!
//! Without bounds there is one. Under bounds and with one type of molds their number rises from one
//! until the bounds are kept; with several types a fixed list of first numbers is gone through.
//! Molds of every result within the bounds are dissolved, a third of them at first and fewer after every
//! failure, until not even one can be spared; with several types single molds, or halves of them,
//! are then given cheaper types.

use crate::options::{MoldRule, mold_count};
use gp_solver::SolverError;

/// First numbers of molds of several types, in units of the square root of the number of panels.
const STARTS: [f64; 7] = [0.0, 0.1, 0.3, 0.6, 1.2, 3.0, 8.0];
/// How far from the design a cheaper type may lead, in halves of the bounds. Seams often need less
/// than the sum of what their two panels deviate.
pub(crate) const SLACKS: [f64; 3] = [1.0, 2.0, f64::INFINITY];
/// How the number of molds rises: by as much as the bounds are exceeded, within these factors.
const RISE: [f64; 2] = [1.4, 5.0];
/// Share of the molds that are dissolved first, as its inverse.
const FIRST_MERGE: usize = 3;
/// Single molds that are tried one after the other.
const SINGLES: usize = 3;

/// What is attempted.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Try {
    /// So many molds, with a type each that is within so many halves of the bounds.
    Molds { molds: usize, slack: f64 },
    /// The best result with so many of its molds dissolved, the first few left out.
    Merge { count: usize, skip: usize },
    /// One mold of the best result, or half of one, of a cheaper type, the first few left out.
    Cheapen { skip: usize },
    /// The published grid with as many molds as the best attempt.
    Grid,
    /// Nothing more.
    Done,
}

/// What an attempt has led to.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Outcome {
    /// How many times it exceeds the bounds.
    pub(crate) excess: f64,
    /// Whether it is within the bounds, and cheaper than before if molds were dissolved.
    pub(crate) is_within: bool,
    /// Whether there is a result within the bounds and the search has taken as many steps as it
    /// may.
    pub(crate) is_spent: bool,
    /// Number of molds of the last attempt within the bounds.
    pub(crate) molds: usize,
}

/// The course of a search between two attempts.
#[derive(Clone, Debug)]
pub(crate) struct Plan {
    pub(crate) next: Try,
    /// Numbers of molds and slacks of a fixed list; empty where the number rises.
    starts: Vec<(usize, f64)>,
    start: usize,
    panels: usize,
    has_bounds: bool,
    has_grid: bool,
}

impl Plan {
    pub(crate) fn new(rule: MoldRule, panels: usize, types: usize, has_grid: bool) -> Self {
        let starts = match rule {
            MoldRule::PerRoot(k) => vec![(mold_count(k, panels), 1.0)],
            MoldRule::Count(molds) => vec![(molds, 1.0)],
            MoldRule::Bounds(_) if types == 1 => Vec::new(),
            MoldRule::Bounds(_) => {
                let mut counts = STARTS.map(|k| mold_count(k, panels)).to_vec();
                counts.dedup();
                counts.iter().flat_map(|&m| SLACKS.map(|slack| (m, slack))).collect()
            }
        };
        let (molds, slack) = starts.first().copied().unwrap_or((1, 1.0));
        let has_bounds = matches!(rule, MoldRule::Bounds(_));
        let next = Try::Molds { molds, slack };
        Self { next, starts, start: 0, panels, has_bounds, has_grid }
    }

    /// Whether attempts rise in number until one is within the bounds.
    pub(crate) fn is_rising(&self) -> bool {
        self.starts.is_empty()
    }

    /// The number of molds of the first attempt, where it does not rise.
    pub(crate) fn first(&self) -> Option<usize> {
        self.starts.first().map(|s| s.0)
    }

    pub(crate) fn has_grid(&self) -> bool {
        self.has_grid
    }

    /// Chooses what comes after the attempt.
    pub(crate) fn conclude(&mut self, outcome: &Outcome) {
        self.next = match self.next {
            Try::Molds { .. } if !self.has_bounds => self.end(),
            Try::Molds { .. } if outcome.is_within => self.first_merge(outcome.molds),
            Try::Molds { molds, .. } if self.is_rising() => {
                let factor = outcome.excess.clamp(RISE[0], RISE[1]);
                let more = (molds as f64 * factor).ceil() as usize;
                let more = more.max(molds + 1).min(self.panels);
                if molds < self.panels {
                    Try::Molds { molds: more, slack: 1.0 }
                } else {
                    self.end()
                }
            }
            Try::Molds { .. } if outcome.is_spent => self.end(),
            Try::Molds { .. } => self.next_start(),
            Try::Merge { count, skip } => {
                let molds = outcome.molds;
                if outcome.is_spent {
                    self.end()
                } else if molds < 2 {
                    self.cheapen()
                } else if outcome.is_within {
                    Try::Merge { count: count.min(molds / 2).max(1), skip: 0 }
                } else if count > 1 {
                    Try::Merge { count: count / 2, skip: 0 }
                } else if skip + 1 < SINGLES.min(molds) {
                    Try::Merge { count, skip: skip + 1 }
                } else {
                    self.cheapen()
                }
            }
            Try::Cheapen { .. } if outcome.is_spent => self.end(),
            Try::Cheapen { .. } if outcome.is_within => Try::Cheapen { skip: 0 },
            Try::Cheapen { skip } if skip + 1 < SINGLES => Try::Cheapen { skip: skip + 1 },
            Try::Cheapen { .. } => self.next_start(),
            Try::Grid | Try::Done => Try::Done,
        };
    }

    /// The next of a fixed list, or the end.
    fn next_start(&mut self) -> Try {
        self.start += 1;
        match self.starts.get(self.start) {
            Some(&(molds, slack)) => Try::Molds { molds, slack },
            None => self.end(),
        }
    }

    fn first_merge(&mut self, molds: usize) -> Try {
        match molds {
            0 | 1 => self.cheapen(),
            _ => Try::Merge { count: molds.div_ceil(FIRST_MERGE), skip: 0 },
        }
    }

    fn cheapen(&mut self) -> Try {
        if self.is_rising() { self.end() } else { Try::Cheapen { skip: 0 } }
    }

    fn end(&self) -> Try {
        if self.has_grid { Try::Grid } else { Try::Done }
    }

    /// For a checkpoint.
    pub(crate) fn counts(&self) -> [u64; 4] {
        let [kind, a, b] = match self.next {
            Try::Molds { molds, .. } => [0, molds, 0],
            Try::Merge { count, skip } => [1, count, skip],
            Try::Grid => [2, 0, 0],
            Try::Done => [3, 0, 0],
            Try::Cheapen { skip } => [4, skip, 0],
        };
        [kind, a, b, self.start].map(|n| n as u64)
    }

    /// Goes on from what [`counts`](Self::counts) has given.
    pub(crate) fn restore(&mut self, counts: [usize; 4]) -> Result<(), SolverError> {
        let [kind, a, b, start] = counts;
        let slack = self.starts.get(start).map_or(1.0, |s| s.1);
        self.next = match kind {
            0 => Try::Molds { molds: a.clamp(1, self.panels), slack },
            1 => Try::Merge { count: a, skip: b },
            2 => Try::Grid,
            3 => Try::Done,
            4 => Try::Cheapen { skip: a },
            _ => {
                let what = "a run of another size, or its plan is damaged".to_owned();
                return Err(SolverError::ForeignCheckpoint { what });
            }
        };
        self.start = start;
        Ok(())
    }
}
