//! Relations between the curvatures that can be asked for.

use serde::{Deserialize, Serialize};

/// A relation the curvatures are to obey, in place of any relation at all.
///
/// Curvatures and coefficients are in units of the model (`H` 1/length, `K` 1/length²); the sign
/// of `H` follows the normal `s_u × s_v`.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
#[non_exhaustive]
pub enum Relation {
    /// Any relation: the isolines of `H` and `K` are aligned and the relation emerges
    /// (Pellis et al. 2021, Eq. 5).
    #[default]
    Free,
    /// `a H + b K + c = 0` with given coefficients.
    Linear(f64, f64, f64),
    /// `a H + b K + c = 0`, coefficients by total least squares at every iteration
    /// (Pellis et al. 2021, Sec. 3.2.2).
    LinearFit,
    /// `H = 0`.
    Minimal,
    /// `H` constant, of the given value.
    ConstantMean(f64),
    /// `H` constant, of the mean value over the samples of the input.
    ConstantMeanFit,
    /// `K = 0`.
    Developable,
    /// `K` constant, of the given value.
    ConstantGauss(f64),
    /// `κ₁ = R κ₂` with `κ₁ ≥ κ₂`.
    Ratio(f64),
    /// The curvature diagram follows a cubic B-spline curve of the `(H, K)` plane through the
    /// given control points (clamped uniform knots).
    Curve(Vec<[f64; 2]>),
    /// The same with a curve of eight control points, fitted at every iteration
    /// (Pellis et al. 2021, Sec. 3.2.3).
    CurveFit,
}

impl Relation {
    /// All coefficients, with the name of the option they belong to.
    pub(crate) fn numbers(&self) -> Vec<(&'static str, f64)> {
        let values = match self {
            Self::Linear(a, b, c) => vec![*a, *b, *c],
            Self::ConstantMean(x) | Self::ConstantGauss(x) | Self::Ratio(x) => vec![*x],
            Self::Curve(points) => points.iter().flatten().copied().collect(),
            _ => Vec::new(),
        };
        values.into_iter().map(|x| ("relation", x)).collect()
    }
}
