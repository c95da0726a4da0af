//! Relations between the curvatures that can be asked for.

use gp_solver::{OptionValue, serde_as_text};

/// A relation the curvatures are to obey, in place of any relation at all.
///
/// Curvatures and coefficients are in units of the model (`H` 1/length, `K` 1/length²); the sign
/// of `H` follows the normal `s_u × s_v`.
///
/// ```
/// use gp_solver::OptionValue;
/// use weingarten::Relation;
/// assert_eq!(Relation::read("cmc=-0.5"), Ok(Relation::ConstantMean(-0.5)));
/// assert_eq!(Relation::read("linear"), Ok(Relation::LinearFit));
/// assert_eq!(Relation::Ratio(2.0).print().as_deref(), Some("ratio=2"));
/// ```
#[derive(Clone, Debug, Default, PartialEq)]
#[non_exhaustive]
pub enum Relation {
    /// `free`: any relation; the isolines of `H` and `K` are aligned and the relation emerges
    /// (Pellis et al. 2021, Eq. 5).
    #[default]
    Free,
    /// `linear=a,b,c`: `a H + b K + c = 0` with given coefficients.
    Linear(f64, f64, f64),
    /// `linear`: `a H + b K + c = 0`, coefficients by total least squares at every iteration
    /// (Pellis et al. 2021, Sec. 3.2.2).
    LinearFit,
    /// `minimal`: `H = 0`.
    Minimal,
    /// `cmc=H`: `H` constant, of the given value.
    ConstantMean(f64),
    /// `cmc`: `H` constant, of the mean value over the samples of the input.
    ConstantMeanFit,
    /// `developable`: `K = 0`.
    Developable,
    /// `gauss=K`: `K` constant, of the given value.
    ConstantGauss(f64),
    /// `ratio=R`: `κ₁ = R κ₂` with `κ₁ ≥ κ₂`.
    Ratio(f64),
    /// `curve=H,K;H,K;…`: the curvature diagram follows a cubic B-spline curve of the `(H, K)`
    /// plane through the given control points (clamped uniform knots).
    Curve(Vec<[f64; 2]>),
    /// `curve`: the same with a curve of eight control points, fitted at every iteration
    /// (Pellis et al. 2021, Sec. 3.2.3).
    CurveFit,
}

impl Relation {
    /// All coefficients.
    pub(crate) fn numbers(&self) -> Vec<f64> {
        match self {
            Self::Linear(a, b, c) => vec![*a, *b, *c],
            Self::ConstantMean(x) | Self::ConstantGauss(x) | Self::Ratio(x) => vec![*x],
            Self::Curve(points) => points.iter().flatten().copied().collect(),
            _ => Vec::new(),
        }
    }
}

impl OptionValue for Relation {
    const FORM: &'static str = "RELATION";

    fn read(text: &str) -> Result<Self, String> {
        let (name, value) = match text.split_once('=') {
            Some((name, value)) => (name.trim(), Some(value)),
            None => (text.trim(), None),
        };
        let list = |list: &str, n: usize| -> Result<Vec<f64>, String> {
            let parsed: Result<Vec<f64>, _> = list.split(',').map(|p| p.trim().parse()).collect();
            match parsed {
                Ok(numbers) if numbers.len() == n => Ok(numbers),
                _ => Err(format!("`{text}` needs {n} number(s) after {name}=")),
            }
        };
        let numbers = |n: usize| list(value.unwrap_or_default(), n);
        Ok(match (name, value) {
            ("free", None) => Self::Free,
            ("linear", None) => Self::LinearFit,
            ("linear", Some(_)) => {
                let c = numbers(3)?;
                Self::Linear(c[0], c[1], c[2])
            }
            ("minimal", None) => Self::Minimal,
            ("cmc", None) => Self::ConstantMeanFit,
            ("cmc", Some(_)) => Self::ConstantMean(numbers(1)?[0]),
            ("developable", None) => Self::Developable,
            ("gauss", Some(_)) => Self::ConstantGauss(numbers(1)?[0]),
            ("ratio", Some(_)) => Self::Ratio(numbers(1)?[0]),
            ("curve", None) => Self::CurveFit,
            ("curve", Some(points)) => {
                let point = |pair: &str| list(pair, 2).map(|p| [p[0], p[1]]);
                Self::Curve(points.split(';').map(point).collect::<Result<_, _>>()?)
            }
            _ => {
                return Err(format!(
                    "`{text}` is none of free, linear[=a,b,c], minimal, cmc[=H], developable, \
                     gauss=K, ratio=R, curve[=H,K;H,K;...]"
                ));
            }
        })
    }

    fn print(&self) -> Option<String> {
        Some(match self {
            Self::Free => "free".to_owned(),
            Self::Linear(a, b, c) => format!("linear={a},{b},{c}"),
            Self::LinearFit => "linear".to_owned(),
            Self::Minimal => "minimal".to_owned(),
            Self::ConstantMean(h) => format!("cmc={h}"),
            Self::ConstantMeanFit => "cmc".to_owned(),
            Self::Developable => "developable".to_owned(),
            Self::ConstantGauss(k) => format!("gauss={k}"),
            Self::Ratio(ratio) => format!("ratio={ratio}"),
            Self::Curve(points) => {
                let points: Vec<String> = points.iter().map(|[h, k]| format!("{h},{k}")).collect();
                format!("curve={}", points.join(";"))
            }
            Self::CurveFit => "curve".to_owned(),
        })
    }
}

serde_as_text!(Relation);

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn relations_are_read_as_they_are_printed() {
        for text in [
            "free",
            "minimal",
            "cmc",
            "cmc=-0.5",
            "linear",
            "linear=1,2,3",
            "developable",
            "gauss=0.25",
            "ratio=-1",
            "curve",
            "curve=0,1;0.5,-2",
        ] {
            let relation = Relation::read(text).unwrap();
            assert_eq!(relation.print().as_deref(), Some(text));
        }
        for bad in ["", "gauss", "linear=1,2", "cmc=x", "minimal=1", "ratio", "curve=1;2"] {
            assert!(Relation::read(bad).is_err(), "{bad}");
        }
    }
}
