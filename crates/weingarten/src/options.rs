//! Settings of an optimisation.

use bspline::BsplineSurface;
use geom_core::Cost;
use gp_solver::{Counts, List, ListItem, OptionValue, choices, options, serde_as_text};
use serde::{Deserialize, Serialize};

use crate::error::Error;
use crate::relation::Relation;

/// Most control points or samples in one direction: enough for any design, and far below what
/// could exhaust the memory by mistake.
const MOST_PER_DIRECTION: usize = 2000;

/// Memory of a sample with its derivatives and rows.
const BYTES_PER_SAMPLE: f64 = 4000.0;
/// Floating-point operations of a microsecond of one core.
const FLOPS_PER_EVALUATION: f64 = 4000.0;

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

choices!(Formulation { Reduced = "reduced", Lifted = "lifted" });

/// What the border may do.
///
/// # Example
/// ```
/// use gp_solver::OptionValue;
/// use weingarten::Border;
/// assert_eq!(Border::read("glide"), Ok(Border::Glide));
/// assert_eq!(Border::read("soft=30"), Ok(Border::Soft(30.0)));
/// assert_eq!(Border::default(), Border::Free);
/// ```
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Border {
    /// It moves like the rest.
    #[default]
    Free,
    /// Border control points glide on the curve through those of the reference; corners are held.
    Glide,
    /// It stays as it is: over several levels, that of the input on the last one.
    Fixed,
    /// Border control points are held with this weight (Pellis et al. 2021, Sec. 3.1.4).
    Soft(f64),
}

impl OptionValue for Border {
    const FORM: &'static str = "free|glide|fixed|soft=W";

    fn read(text: &str) -> Result<Self, String> {
        let weight = text.trim().strip_prefix("soft=").map(str::parse);
        match (text.trim(), weight) {
            (_, Some(Ok(weight))) => Ok(Self::Soft(weight)),
            ("free", _) => Ok(Self::Free),
            ("glide", _) => Ok(Self::Glide),
            ("fixed", _) => Ok(Self::Fixed),
            _ => Err(format!("`{text}` is none of free, glide, fixed, soft=W")),
        }
    }

    fn print(&self) -> Option<String> {
        Some(match self {
            Self::Free => "free".to_owned(),
            Self::Glide => "glide".to_owned(),
            Self::Fixed => "fixed".to_owned(),
            Self::Soft(weight) => format!("soft={weight}"),
        })
    }
}

/// A control point of the input to move before optimising: the moved surface is the reference.
///
/// # Example
/// ```
/// use gp_solver::OptionValue;
/// use weingarten::Move;
/// assert_eq!(Move::read("3,4,0,0,0.1"), Ok(Move { i: 3, j: 4, by: [0.0, 0.0, 0.1] }));
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Move {
    /// Index in u, from 0.
    pub i: usize,
    /// Index in v, from 0.
    pub j: usize,
    /// Displacement in units of the model.
    pub by: [f64; 3],
}

impl OptionValue for Move {
    const FORM: &'static str = "I,J,DX,DY,DZ";

    fn read(text: &str) -> Result<Self, String> {
        let parts: Vec<&str> = text.split(',').map(str::trim).collect();
        let parsed = (|| {
            let &[i, j, x, y, z] = parts.as_slice() else { return None };
            let by = [x.parse().ok()?, y.parse().ok()?, z.parse().ok()?];
            Some(Self { i: i.parse().ok()?, j: j.parse().ok()?, by })
        })();
        parsed.ok_or_else(|| format!("`{text}` is not of the form i,j,dx,dy,dz, as in 3,4,0,0,0.1"))
    }

    fn print(&self) -> Option<String> {
        let Self { i, j, by: [x, y, z] } = self;
        Some(format!("{i},{j},{x},{y},{z}"))
    }
}

impl ListItem for Move {
    const BETWEEN: char = ';';
    const LIST_FORM: &'static str = "I,J,DX,DY,DZ";
}

serde_as_text!(Move);

options! {
    /// Settings of an optimisation.
    ///
    /// Weights multiply residuals on the surface scaled to mean absolute principal curvature 5.
    ///
    /// # Example
    /// ```
    /// use gp_solver::Counts;
    /// use weingarten::{Border, Options, Relation};
    /// let options = Options {
    ///     levels: vec![Counts { u: 10, v: 8 }, Counts { u: 14, v: 10 }].into(),
    ///     border: Border::Glide,
    ///     relation: Relation::ConstantMean(-0.5),
    ///     ..Options::default()
    /// };
    /// assert_eq!((options.iterations, options.alignment_weight()), (10, 1.0));
    /// // The table from which flags, configuration files and reports are made.
    /// assert!(Options::FIELDS.iter().any(|field| field.name == "border"));
    /// ```
    #[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
    #[serde(default, deny_unknown_fields)]
    pub struct Options {
        /// Control nets to refit and optimise at in turn, as in 10x8,14x10,18x14,25x18; without
        /// them the input's net.
        ///
        /// Pellis et al. 2021, Sec. 4.1.1.
        levels: List<Counts> = List::default();
        /// Steps per level.
        iterations: usize = 10;
        /// Samples in u and v; twice the net if not given.
        samples: Option<Counts> = None;
        /// Eliminated unknowns with damped steps, or the published guided projection.
        formulation: Formulation = Formulation::Reduced;
        /// Whether the border moves freely, glides on its own curve, stays, or is held with a weight.
        border: Border = Border::Free;
        /// Curvature relation: free, linear[=a,b,c] (aH+bK+c=0), minimal, cmc[=H], developable,
        /// gauss=K, ratio=R (k1 = R k2), curve[=H,K;H,K;...].
        relation: Relation = Relation::Free;
        /// Weight of the isoline alignment, or of the relation asked for; without it 1, and 0.1 in
        /// the lifted formulation.
        alignment: Option<f64> = None;
        /// Weight of the closeness to the input.
        closeness: f64 = 0.1;
        /// Weight of the preservation of edge and diagonal lengths of the control net.
        shape: f64 = 0.0;
        /// Weight of the fairness of the displacement, of the net itself in the lifted formulation.
        fairness: f64 = 0.2;
        /// Weight of geodesic parallelism of the curvature isolines.
        parallel: f64 = 0.0;
        /// Move a control point first (indices from 0; repeatable).
        moves as "move": List<Move> = List::default();
    }
}

impl Options {
    /// The settings of the published scheme: guided projection of the lifted formulation with the
    /// weights of Pellis et al. 2021, Table 1.
    #[must_use]
    pub fn published() -> Self {
        Self { formulation: Formulation::Lifted, ..Self::default() }
    }

    /// The weight of the alignment in force.
    #[must_use]
    pub fn alignment_weight(&self) -> f64 {
        self.alignment.unwrap_or(match self.formulation {
            Formulation::Reduced => 1.0,
            Formulation::Lifted => 0.1,
        })
    }

    /// Everything that can be checked without the surface.
    ///
    /// # Errors
    /// [`Error`] names the first option at fault.
    pub fn check(&self) -> Result<(), Error> {
        let weights = [
            ("alignment", self.alignment_weight()),
            ("closeness", self.closeness),
            ("shape", self.shape),
            ("fairness", self.fairness),
            ("parallel", self.parallel),
            ("border", if let Border::Soft(weight) = self.border { weight } else { 0.0 }),
        ];
        for (name, value) in weights {
            if !(value >= 0.0 && value.is_finite()) {
                return Err(Error::BadOption { name, value, need: "zero or more" });
            }
        }
        for value in self.relation.numbers() {
            if !value.is_finite() {
                let (name, need) = ("relation", "made of finite numbers");
                return Err(Error::BadOption { name, value, need });
            }
        }
        match &self.relation {
            Relation::Linear(a, b, _) if *a == 0.0 && *b == 0.0 => {
                let need = "different from zero, or the second coefficient must be";
                return Err(Error::BadOption { name: "relation", value: 0.0, need });
            }
            Relation::Curve(points) if points.len() < 2 => {
                return Err(Error::ShortCurve { found: points.len() });
            }
            _ => {}
        }
        for m in self.moves.iter() {
            if let Some(&value) = m.by.iter().find(|v| !v.is_finite()) {
                let need = "a finite displacement";
                return Err(Error::BadOption { name: "move", value, need });
            }
        }
        let samples = self.samples.unwrap_or(Counts { u: 2, v: 2 });
        for (direction, found) in [("u", samples.u), ("v", samples.v)] {
            if found < 2 {
                return Err(Error::TooFewSamples { direction, found, needed: 2 });
            }
        }
        let nets = self.levels.iter().map(|l| ("control points in one direction", l.u.max(l.v)));
        let counts = [("samples in one direction", samples.u.max(samples.v))];
        for (what, count) in counts.into_iter().chain(nets) {
            if count > MOST_PER_DIRECTION {
                return Err(Error::TooMany { what, count, limit: MOST_PER_DIRECTION });
            }
        }
        if self.formulation == Formulation::Lifted {
            let reduced_only = [
                (self.relation != Relation::Free, "a curvature relation"),
                (self.parallel > 0.0, "the weight `parallel`"),
            ];
            if let Some(&(_, what)) = reduced_only.iter().find(|(asked, _)| *asked) {
                return Err(Error::NeedsReduced { what });
            }
        }
        Ok(())
    }
}

impl Options {
    /// What a run on `surface` would take, roughly: the factor of the normal matrix, as a band along
    /// the shorter side of the net or by nested dissection, and the samples.
    #[must_use]
    pub fn cost(&self, surface: &BsplineSurface) -> Cost {
        let own = [Counts { u: surface.n_u(), v: surface.n_v() }];
        let nets = if self.levels.is_empty() { &own[..] } else { &self.levels };
        let order = surface.degree_u().order().max(surface.degree_v().order());
        let mut cost = Cost::default();
        for net in nets {
            let (long, short) = (net.u.max(net.v) as f64, net.u.min(net.v) as f64);
            let unknowns = 3.0 * long * short;
            let band = (3.0 * order as f64 * short).min(unknowns);
            let samples = match self.samples {
                Some(samples) => samples.u as f64 * samples.v as f64,
                None => 4.0 * long * short,
            };
            // Of nested dissection: a separator is as long as the net is wide, and `order` rows thick.
            let separator = 3.0 * order as f64 * (long * short).sqrt();
            let factor = (unknowns * band * band).min(10.0 * separator.powi(3));
            let fill = band.min(30.0 * order as f64 * (long * short).log2().max(1.0));
            let flops = factor + samples * (9 * order.pow(4)) as f64;
            let bytes = 8.0 * unknowns * fill + samples * BYTES_PER_SAMPLE;
            cost.bytes = cost.bytes.max(bytes as u64);
            let steps = self.iterations as f64;
            cost.evaluations =
                cost.evaluations.saturating_add((steps * flops / FLOPS_PER_EVALUATION) as u64);
        }
        cost
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn moves_are_read_as_they_are_printed() {
        let want = Move { i: 3, j: 4, by: [0.0, -1.5, 2.0] };
        assert_eq!(Move::read("3,4,0,-1.5,2"), Ok(want));
        assert_eq!(Move::read(&want.print().unwrap()), Ok(want));
        assert!(Move::read("3,4,0").is_err());
    }
}
