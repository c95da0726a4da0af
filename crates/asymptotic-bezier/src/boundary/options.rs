//! What may be asked of the boundary curves: degree, energy, torsions.

use gp_solver::choices;
use serde::{Deserialize, Serialize};

/// Least and highest degree of solved boundary curves.
pub const BOUNDARY_DEGREES: [usize; 2] = [5, 9];

/// What the freedom left by the corner data minimises (Wang et al. 2019, Remark 3.4).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum BoundaryEnergy {
    /// `Σ ∫ |r″|² dt`, the paper's Eq. 3.4.
    #[default]
    Strain,
    /// `Σ ∫ |r‴|² dt`.
    Jerk,
    /// `Σ L ∫ τ² ds` with the chord `L`, over the corner torsions from the strain minimum.
    Torsion,
}

choices!(BoundaryEnergy { Strain = "strain", Jerk = "jerk", Torsion = "torsion" });

/// What is wanted of the torsion at a vertex; `K = −τ²` there.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum TorsionHandle {
    /// Left to the energy.
    #[default]
    Free,
    /// Prescribed, in 1/length, for the curves in the u-direction.
    Fixed(f64),
    /// Kept between two values.
    Between(f64, f64),
}

impl TorsionHandle {
    /// The handle that prescribes the Gaussian curvature `K ≤ 0` at a corner, with the sign of
    /// the torsion of the u-curves.
    #[must_use]
    pub fn gaussian(curvature: f64, sign: f64) -> Self {
        Self::Fixed((-curvature).max(0.0).sqrt().copysign(sign))
    }

    /// The handle that keeps the Gaussian curvature between `min` and `max`, both at most zero.
    #[must_use]
    pub fn gaussian_between(min: f64, max: f64, sign: f64) -> Self {
        let [large, small] = [min, max].map(|k| (-k).max(0.0).sqrt());
        if sign < 0.0 { Self::Between(-large, -small) } else { Self::Between(small, large) }
    }

    pub(crate) fn bounds(self) -> [f64; 2] {
        match self {
            Self::Free => [f64::NEG_INFINITY, f64::INFINITY],
            Self::Fixed(tau) => [tau, tau],
            Self::Between(min, max) => [min, max],
        }
    }
}

/// What the boundary curves are made from.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum CurveForm {
    /// By curvatures, but by normals where tangents and curvatures are estimates (nets made from meshes
    /// and polylines) and a curve between two vertices has an inflection, or nearly one.
    #[default]
    Auto,
    /// Curves with exactly the tangents and curvatures of the data, in the least-energy way.
    Curvatures,
    /// Curves of degree seven made from polynomial normals of degree four by Lelieuvre's formula
    /// `r′ = ± N × N′`, which inflections do not disturb; curvatures are met approximately.
    Normals,
}

choices!(CurveForm { Auto = "auto", Curvatures = "curvatures", Normals = "normals" });

/// Settings of the boundary solve.
#[derive(Clone, Debug, PartialEq)]
pub struct BoundaryOptions {
    /// What the curves are made from.
    pub form: CurveForm,
    /// Degree of the curves, 5 to 9; those made from normals have 7 all the same.
    pub degree: usize,
    /// What is minimised.
    pub energy: BoundaryEnergy,
    /// Handles per vertex (missing ones are free).
    pub torsions: Vec<TorsionHandle>,
}

impl Default for BoundaryOptions {
    fn default() -> Self {
        Self {
            form: CurveForm::Auto,
            degree: 5,
            energy: BoundaryEnergy::Strain,
            torsions: Vec::new(),
        }
    }
}
