//! Settings of an optimisation.

use serde::{Deserialize, Serialize};

use crate::error::WeingartenError;
use crate::relation::Relation;

/// Most control points or samples in one direction: enough for any design, and far below what
/// could exhaust the memory by mistake.
const MOST_PER_DIRECTION: usize = 2000;

/// Which form of the same problem is solved.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Formulation {
    /// Unknowns are the control points only, derivatives of the curvatures are exact, steps that
    /// raise the energy are refused.
    #[default]
    Reduced,
    /// The paper's guided projection: twelve auxiliary variables per sample, quadratic
    /// constraints, central differences, undamped.
    Lifted,
}

/// What the border may do.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Border {
    /// It moves like the rest.
    #[default]
    Free,
    /// Border control points glide on the curve through those of the reference; corners are held.
    Glide,
    /// It stays as it is.
    Fixed,
}

/// Weights of the terms; `None` is the default of the formulation.
///
/// | term | `reduced` | `lifted` |
/// |---|---|---|
/// | alignment (or the relation asked for) | 1 | 0.1 |
/// | closeness to the reference control points | 0.1 | 0.1 |
/// | shape preservation (edge and diagonal lengths) | 0 | 0 |
/// | fairness (of the displacement; of the net if lifted) | 0.2 | 0.2 |
/// | geodesic parallel isolines | 0 | not available |
///
/// They weigh residuals on the surface scaled to mean absolute principal curvature 5.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Weights {
    /// Of the isoline alignment, or of the relation asked for in its place.
    pub alignment: Option<f64>,
    /// Of the closeness to the control points of the reference.
    pub closeness: Option<f64>,
    /// Of the preservation of edge and diagonal lengths of the control net.
    pub shape: Option<f64>,
    /// Of the fairness.
    pub fairness: Option<f64>,
    /// Of the geodesic parallelism of the curvature isolines.
    pub parallel: Option<f64>,
}

/// A control point of the input to move before optimising: the moved surface is the reference.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Move {
    /// Index in u, from 0.
    pub i: usize,
    /// Index in v, from 0.
    pub j: usize,
    /// Displacement in units of the model.
    pub by: [f64; 3],
}

/// Settings of an optimisation.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct WeingartenOptions {
    /// Control nets of a multiresolution optimisation, `(n_u, n_v)` each: the surface is refitted
    /// and optimised at each in turn (Pellis et al. 2021, Sec. 4.1.1). Empty: the input's net.
    pub levels: Vec<(usize, usize)>,
    /// Steps per level at most.
    pub iterations: usize,
    /// Samples in u and v; twice the control points if not given.
    pub samples: Option<(usize, usize)>,
    /// Form of the problem.
    pub formulation: Formulation,
    /// What the border may do.
    pub border: Border,
    /// What the curvatures are to obey.
    pub relation: Relation,
    /// Weights of the terms.
    pub weights: Weights,
    /// Control points to move first.
    pub moves: Vec<Move>,
}

impl Default for WeingartenOptions {
    fn default() -> Self {
        Self {
            levels: Vec::new(),
            iterations: 10,
            samples: None,
            formulation: Formulation::default(),
            border: Border::default(),
            relation: Relation::default(),
            weights: Weights::default(),
            moves: Vec::new(),
        }
    }
}

/// Weights with the defaults filled in.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct EffectiveWeights {
    pub(crate) alignment: f64,
    pub(crate) closeness: f64,
    pub(crate) shape: f64,
    pub(crate) fairness: f64,
    pub(crate) parallel: f64,
}

impl WeingartenOptions {
    pub(crate) fn effective_weights(&self) -> EffectiveWeights {
        let alignment = match self.formulation {
            Formulation::Reduced => 1.0,
            Formulation::Lifted => 0.1,
        };
        let w = &self.weights;
        EffectiveWeights {
            alignment: w.alignment.unwrap_or(alignment),
            closeness: w.closeness.unwrap_or(0.1),
            shape: w.shape.unwrap_or(0.0),
            fairness: w.fairness.unwrap_or(0.2),
            parallel: w.parallel.unwrap_or(0.0),
        }
    }

    /// Everything that can be checked without the surface.
    pub(crate) fn check(&self) -> Result<(), WeingartenError> {
        let w = self.effective_weights();
        let weights = [
            ("alignment", w.alignment),
            ("closeness", w.closeness),
            ("shape", w.shape),
            ("fairness", w.fairness),
            ("parallel", w.parallel),
        ];
        for (name, value) in weights {
            if !(value >= 0.0 && value.is_finite()) {
                return Err(WeingartenError::BadOption { name, value, need: "zero or more" });
            }
        }
        for (name, value) in self.relation.numbers() {
            if !value.is_finite() {
                return Err(WeingartenError::BadOption { name, value, need: "a finite number" });
            }
        }
        match &self.relation {
            Relation::Linear(a, b, _) if *a == 0.0 && *b == 0.0 => {
                let need = "different from zero, or the second coefficient must be";
                return Err(WeingartenError::BadOption { name: "relation", value: 0.0, need });
            }
            Relation::Curve(points) if points.len() < 2 => {
                return Err(WeingartenError::ShortCurve { found: points.len() });
            }
            _ => {}
        }
        for m in &self.moves {
            if let Some(&value) = m.by.iter().find(|v| !v.is_finite()) {
                let need = "a finite displacement";
                return Err(WeingartenError::BadOption { name: "move", value, need });
            }
        }
        let (s_u, s_v) = self.samples.unwrap_or((2, 2));
        for (direction, found) in [("u", s_u), ("v", s_v)] {
            if found < 2 {
                return Err(WeingartenError::TooFewSamples { direction, found, needed: 2 });
            }
        }
        let counts = [("samples in one direction", s_u.max(s_v))]
            .into_iter()
            .chain(self.levels.iter().map(|l| ("control points in one direction", l.0.max(l.1))));
        for (what, count) in counts {
            if count > MOST_PER_DIRECTION {
                return Err(WeingartenError::TooMany { what, count, limit: MOST_PER_DIRECTION });
            }
        }
        if self.formulation == Formulation::Lifted {
            let reduced_only = [
                (self.relation != Relation::Free, "a curvature relation"),
                (w.parallel > 0.0, "the parallel weight"),
            ];
            if let Some(&(_, what)) = reduced_only.iter().find(|(asked, _)| *asked) {
                return Err(WeingartenError::NeedsReduced { what });
            }
        }
        Ok(())
    }
}
