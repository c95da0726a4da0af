//! The functionals and their weighted sums.

use crate::density::Density;
use std::fmt;

/// A curvature functional of a surface.
///
/// `F1` and `F3` are the amplitudes of the first and third harmonic of the arc-length derivative
/// of the normal curvature, see [`geom_core::ThirdOrder`]. The third-order functionals are the
/// scale-invariant ones: the integral times the area, except [`Functional::Sqrt`], whose integral
/// is scale invariant by itself.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Functional {
    /// `∫ dA` (Joshi 2008, Eq. 4.1), in length².
    Area,
    /// `∫ H dA` (Eq. 4.5), in length; negative where the outward normal sees a convex surface.
    MeanCurvature,
    /// `∫ K dA` (Eq. 4.6): `2πχ` on a closed surface, a check.
    Gaussian,
    /// `∫ k1² + k2² dA` (Eq. 4.10).
    Bending,
    /// `∫ H² dA` (Eq. 4.7).
    Willmore,
    /// `∫ (k1 − k2)² dA` (Eq. 4.8).
    UmbilicDeviation,
    /// `A ∫ (dk1/de1)² + (dk2/de2)² dA` (Eq. 4.12).
    ///
    /// The density is `F1² + F3² + 2 Re(Z1 Z3 e^{4iφ})` with the angle `φ` of the first principal
    /// direction; near umbilics the last term fades as `r²/(r² + 10⁻⁶ |II|²)`, `r = (k1 − k2)/2`,
    /// so that an umbilic counts with the mean over all directions.
    Mvs,
    /// As `Mvs` with the cross derivatives `dk1/de2` and `dk2/de1` (Eq. 4.13).
    MvsCross,
    /// `A ∫ F1²/2 dA` (Eq. 4.18 with the half of sec. 6.1.2, which the printed numbers use).
    F1,
    /// `A ∫ F3²/2 dA` (Eq. 4.19, same half).
    F3,
    /// `A ∫ (w1 F1² + w3 F3²)/2 dA` (Eqs. 4.16 and 4.17); both weights are 1 in the plain form.
    MehlumTarrou {
        /// Weight of `F1²`.
        w1: f64,
        /// Weight of `F3²`.
        w3: f64,
    },
    /// `A ∫ (F1²/9 + F3²)/2 dA` (Eq. 4.20).
    CrossCurvature,
    /// Mean square of all derivatives of the normal curvature, `(MehlumTarrou + CrossCurvature)/2`
    /// (Eq. 4.21, whose last line lacks the half).
    AverageDerivative,
    /// `∫ √(F1² + F3²) dA` (Eq. 4.22), regularised to `√(F1² + F3² + ε²)` where it is not smooth.
    Sqrt,
}

/// What the regularisation of [`Functional::Sqrt`] adds at most: `ε` times the area.
pub(crate) const ROOT_EPSILON: f64 = 1e-3;

impl Functional {
    /// All of them, the Mehlum-Tarrou energy unweighted.
    pub const ALL: [Self; 14] = [
        Self::Area,
        Self::MeanCurvature,
        Self::Gaussian,
        Self::Bending,
        Self::Willmore,
        Self::UmbilicDeviation,
        Self::Mvs,
        Self::MvsCross,
        Self::F1,
        Self::F3,
        Self::MehlumTarrou { w1: 1.0, w3: 1.0 },
        Self::CrossCurvature,
        Self::AverageDerivative,
        Self::Sqrt,
    ];

    /// The name used in expressions and reports.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Area => "area",
            Self::MeanCurvature => "mean_curvature",
            Self::Gaussian => "gaussian",
            Self::Bending => "bending",
            Self::Willmore => "willmore",
            Self::UmbilicDeviation => "umbilic_deviation",
            Self::Mvs => "mvs",
            Self::MvsCross => "mvs_cross",
            Self::F1 => "f1",
            Self::F3 => "f3",
            Self::MehlumTarrou { .. } => "mehlum_tarrou",
            Self::CrossCurvature => "cross_curvature",
            Self::AverageDerivative => "average_derivative",
            Self::Sqrt => "sqrt",
        }
    }

    /// With which power of lengths the value grows.
    #[must_use]
    pub fn length_power(self) -> i32 {
        match self {
            Self::Area => 2,
            Self::MeanCurvature => 1,
            _ => 0,
        }
    }

    /// Whether scaling the surface leaves the value alone.
    #[must_use]
    pub fn is_scale_invariant(self) -> bool {
        self.length_power() == 0
    }

    /// Coefficients of the density, and whether its integral is multiplied by the area.
    pub(crate) fn density(self) -> (Density, bool) {
        let zero = Density::default();
        let harmonics = |f1: f64, f3: f64| Density { f1, f3, ..zero };
        match self {
            Self::Area => (zero, false),
            Self::MeanCurvature => (Density { mean: 1.0, ..zero }, false),
            Self::Gaussian => (Density { product: 1.0, twist: -1.0, ..zero }, false),
            Self::Bending => (Density { square: 1.0, twist: 2.0, ..zero }, false),
            Self::Willmore => (Density { square: 0.25, product: 0.5, ..zero }, false),
            Self::UmbilicDeviation => {
                (Density { square: 1.0, product: -2.0, twist: 4.0, ..zero }, false)
            }
            Self::Mvs => (Density { coupling: 2.0, ..harmonics(1.0, 1.0) }, true),
            Self::MvsCross => (Density { coupling: 4.0 / 3.0, ..harmonics(10.0 / 9.0, 2.0) }, true),
            Self::F1 => (harmonics(0.5, 0.0), true),
            Self::F3 => (harmonics(0.0, 0.5), true),
            Self::MehlumTarrou { w1, w3 } => (harmonics(0.5 * w1, 0.5 * w3), true),
            Self::CrossCurvature => (harmonics(0.5 / 9.0, 0.5), true),
            Self::AverageDerivative => (harmonics(0.25 * 10.0 / 9.0, 0.5), true),
            Self::Sqrt => (Density { root: 1.0, root_epsilon: ROOT_EPSILON, ..zero }, false),
        }
    }
}

impl fmt::Display for Functional {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match *self {
            Self::MehlumTarrou { w1, w3 } if (w1, w3) != (1.0, 1.0) => {
                write!(f, "mehlum_tarrou({w1},{w3})")
            }
            _ => f.write_str(self.name()),
        }
    }
}

/// A weighted sum of functionals; a text such as `0.92*bending + 0.08*mehlum_tarrou` in files.
///
/// # Example
/// ```
/// use curvature_variation::{Energy, Functional};
/// let energy: Energy = "2*bending + 0.5*area".parse()?;
/// assert_eq!(energy.terms, [(2.0, Functional::Bending), (0.5, Functional::Area)]);
/// # Ok::<(), curvature_variation::ExpressionError>(())
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct Energy {
    /// Weight and functional of every term.
    pub terms: Vec<(f64, Functional)>,
}

impl Energy {
    /// One functional with weight 1.
    #[must_use]
    pub fn from_functional(functional: Functional) -> Self {
        Self { terms: vec![(1.0, functional)] }
    }

    /// The scale-invariant Mehlum-Tarrou energy.
    #[must_use]
    pub fn mehlum_tarrou() -> Self {
        Self::from_functional(Functional::MehlumTarrou { w1: 1.0, w3: 1.0 })
    }

    /// Whether scaling the surface leaves the value alone.
    #[must_use]
    pub fn is_scale_invariant(&self) -> bool {
        self.terms.iter().all(|(weight, term)| *weight == 0.0 || term.is_scale_invariant())
    }

    /// The value of the sum, given each functional's value.
    pub(crate) fn combine(&self, value: impl Fn(Functional) -> f64) -> f64 {
        self.terms.iter().map(|&(weight, term)| weight * value(term)).sum()
    }

    /// The coefficients `E = area · A + ∫ plain + A ∫ scaled`.
    pub(crate) fn coefficients(&self) -> Coefficients {
        let mut out = Coefficients::default();
        for &(weight, term) in &self.terms {
            if term == Functional::Area {
                out.area += weight;
            }
            let (density, scaled) = term.density();
            let target = if scaled { &mut out.scaled } else { &mut out.plain };
            *target = target.plus(weight, &density);
        }
        out
    }
}

impl Default for Energy {
    fn default() -> Self {
        Self::mehlum_tarrou()
    }
}

impl fmt::Display for Energy {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for (k, &(weight, term)) in self.terms.iter().enumerate() {
            let sign = if weight < 0.0 { "-" } else { "+" };
            match (k, weight < 0.0) {
                (0, false) => {}
                (0, true) => f.write_str("-")?,
                _ => write!(f, " {sign} ")?,
            }
            if weight.abs() != 1.0 {
                write!(f, "{}*", weight.abs())?;
            }
            write!(f, "{term}")?;
        }
        Ok(())
    }
}

/// `E = area · A + ∫ plain + A ∫ scaled`.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Coefficients {
    pub(crate) area: f64,
    pub(crate) plain: Density,
    pub(crate) scaled: Density,
}
