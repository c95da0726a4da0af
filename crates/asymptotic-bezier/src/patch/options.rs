//! How a patch is filled: degree, tangent fields, bounds, inner control points.

use gp_solver::choices;
use serde::{Deserialize, Serialize};

use crate::patch::mask::Interior;

/// Which tangent fields are used.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Ansatz {
    /// All polynomial tangent fields of the degree.
    #[default]
    Module,
    /// `x r′ + y (r′ × r″) × r′` with the free coefficients of `x` zero, degree `3p − 4`.
    Paper,
    /// The same fields with the free coefficients of `x` left to the energy.
    PaperFree,
}

choices!(Ansatz { Module = "module", Paper = "paper", PaperFree = "paper_free" });

/// Settings of the patch solve.
#[derive(Clone, Debug, PartialEq)]
pub struct PatchOptions {
    /// Degree in u and v; `None` takes 7 and goes to 8 and 11 where that folds.
    pub degree: Option<usize>,
    /// Tangent fields.
    pub ansatz: Ansatz,
    /// Transversality is kept above this share of the linear interpolation of its corner values;
    /// `None` switches the bounds off.
    pub bound: Option<f64>,
    /// Least sine between parameter lines before the next degree is tried.
    pub min_sine: f64,
    /// How the inner control points are found once the tangent fields are.
    pub interior: Interior,
}

impl Default for PatchOptions {
    fn default() -> Self {
        Self {
            degree: None,
            ansatz: Ansatz::Module,
            bound: Some(0.25),
            min_sine: 0.1,
            interior: Interior::ThinPlate,
        }
    }
}
