//! Settings of a fairing.

use gp_solver::{OptionValue, choices, options, serde_as_text};
use serde::{Deserialize, Deserializer, Serialize, Serializer};
use subdiv_catmull_clark::{Blend, Creases, SubdivisionError, SubdivisionSurface};

use crate::error::Error;
use crate::functional::Energy;
use crate::rules::Quadrature;
use geom_core::PolyMesh;

/// Gauss points per side at most: more would only exhaust the memory by mistake.
const MOST_NODES: usize = 64;

/// How a level is minimised.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Method {
    /// L-BFGS whose metric is a Gauss-Newton Hessian, renewed every 40 steps; the first steps on a
    /// level are Gauss-Newton steps.
    #[default]
    #[serde(alias = "lagged-gauss-newton")]
    LaggedGaussNewton,
    /// Damped Gauss-Newton steps.
    #[serde(alias = "gauss-newton")]
    GaussNewton,
    /// L-BFGS with the H³ norm as metric (Renka and Neuberger 1995; Joshi 2008, sec. 7.2.1).
    Sobolev,
    /// Plain L-BFGS, as the thesis.
    Lbfgs,
}

choices!(Method {
    LaggedGaussNewton = "lagged_gauss_newton",
    GaussNewton = "gauss_newton",
    Sobolev = "sobolev",
    Lbfgs = "lbfgs",
});

/// How extraordinary vertices are repaired, see [`Blend`].
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum BlendKind {
    /// A polynomial of free curvature is blended in.
    #[default]
    Smooth,
    /// The published flat spot.
    Flat,
}

choices!(BlendKind { Smooth = "smooth", Flat = "flat" });

impl From<BlendKind> for Blend {
    fn from(kind: BlendKind) -> Self {
        match kind {
            BlendKind::Smooth => Self::Smooth,
            BlendKind::Flat => Self::Flat,
        }
    }
}

/// Rings of patches a smooth blend covers, where there is room.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Rings {
    /// As many as [`SubdivisionSurface::with_rings`] finds best: more on finer meshes.
    #[default]
    Auto,
    /// So many, from 1 up.
    Count(usize),
}

impl Rings {
    /// The number, if one is given.
    #[must_use]
    pub fn count(self) -> Option<usize> {
        match self {
            Self::Auto => None,
            Self::Count(rings) => Some(rings),
        }
    }
}

impl OptionValue for Rings {
    const FORM: &'static str = "N|auto";

    fn read(text: &str) -> Result<Self, String> {
        match text.trim().parse() {
            _ if text.trim() == "auto" => Ok(Self::Auto),
            Ok(rings) if rings > 0 => Ok(Self::Count(rings)),
            _ => Err(format!("`{text}` is no number of rings; give a number from 1 up, or auto")),
        }
    }

    fn print(&self) -> Option<String> {
        Some(self.count().map_or("auto".to_owned(), |rings| rings.to_string()))
    }
}

/// A number, or the word `auto`.
impl Serialize for Rings {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        match self.count() {
            None => serializer.serialize_str("auto"),
            Some(rings) => serializer.serialize_u64(rings as u64),
        }
    }
}

impl<'de> Deserialize<'de> for Rings {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        #[derive(Deserialize)]
        #[serde(untagged)]
        enum Value {
            Number(usize),
            Text(String),
        }
        let text = match Value::deserialize(deserializer)? {
            Value::Number(rings) => rings.to_string(),
            Value::Text(text) => text,
        };
        Self::read(&text).map_err(serde::de::Error::custom)
    }
}

/// Which symmetries of the input are kept, unless the input [declares](crate::Input::symmetries)
/// some.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Symmetry {
    /// All that the mesh has; just one fundamental domain is then evaluated.
    #[default]
    Auto,
    /// None.
    None,
}

choices!(Symmetry { Auto = "auto", None = "none" });

impl OptionValue for Energy {
    const FORM: &'static str = "EXPR";

    fn read(text: &str) -> Result<Self, String> {
        text.parse().map_err(|error: crate::ExpressionError| error.to_string())
    }

    fn print(&self) -> Option<String> {
        Some(self.to_string())
    }
}

impl OptionValue for Quadrature {
    const FORM: &'static str = "NxN";

    fn read(text: &str) -> Result<Self, String> {
        let parts = text.split_once(['x', 'X']);
        let numbers =
            parts.and_then(|(a, b)| Some((a.trim().parse().ok()?, b.trim().parse().ok()?)));
        match numbers {
            Some((regular, extraordinary)) => Ok(Self { regular, extraordinary }),
            None => Err(format!("`{text}` is not of the form NxN, as in 8x16")),
        }
    }

    fn print(&self) -> Option<String> {
        Some(format!("{}x{}", self.regular, self.extraordinary))
    }
}

serde_as_text!(Energy, Quadrature);

options! {
    /// Settings of a fairing.
    ///
    /// # Example
    /// ```
    /// use curvature_variation::{Method, Options};
    /// let energy = "0.92*bending + 0.08*mehlum_tarrou".parse()?;
    /// let options = Options { energy, levels: 1, ..Options::default() };
    /// assert_eq!((options.iterations, options.method), (2000, Method::LaggedGaussNewton));
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    #[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
    #[serde(default, deny_unknown_fields)]
    pub struct Options {
        /// What to minimise, a sum such as 0.92*bending + 0.08*mehlum_tarrou.
        energy: Energy = Energy::default();
        /// Refinements, each followed by a minimisation.
        levels: usize = 2;
        /// Steps per level at most.
        iterations: usize = 2000;
        /// How to descend.
        method: Method = Method::LaggedGaussNewton;
        /// Surface at extraordinary vertices: free curvature, or the published flat spot.
        blend: BlendKind = BlendKind::Smooth;
        /// Rings of patches a smooth blend covers where there is room: a number, or auto for more
        /// of them on finer meshes.
        blend_rings: Rings = Rings::Auto;
        /// Keep the boundary and the two rings next to it.
        ///
        /// On every level, which keeps position, tangents and curvatures along the boundary (Joshi
        /// 2008, sec. 8); the quads at the boundary are left out of the energy. As
        /// [`Constraints::clamp_boundary`](crate::Constraints::clamp_boundary).
        clamp_boundary: bool = false;
        /// Symmetries to keep.
        symmetry: Symmetry = Symmetry::Auto;
        /// Gauss points per side of a patch while minimising, on regular patches and on the others;
        /// rarely needed.
        quadrature: Quadrature = Quadrature::NORMAL;
        /// Relative gain of a round of 40 steps below which a level has converged; rarely needed.
        ///
        /// A level has converged once a round (or 20 steps in a row) lowers the energy by
        /// `≤ tolerance · |E|`.
        tolerance: f64 = 1e-5;
    }
}

impl Options {
    /// Everything that can be checked without the mesh.
    ///
    /// # Errors
    /// [`Error::NoEnergy`], [`Error::BadOption`].
    pub fn check(&self) -> Result<(), Error> {
        if self.energy.terms.iter().all(|t| t.0 == 0.0) {
            return Err(Error::NoEnergy);
        }
        let weights = self.energy.terms.iter().map(|&(weight, _)| weight);
        if let Some(value) = weights.into_iter().find(|w| !w.is_finite()) {
            return Err(Error::BadOption {
                name: "energy",
                value,
                need: "a sum of finite weights",
            });
        }
        if !(self.tolerance >= 0.0 && self.tolerance.is_finite()) {
            let (name, value) = ("tolerance", self.tolerance);
            return Err(Error::BadOption { name, value, need: "zero or more" });
        }
        let Quadrature { regular, extraordinary } = self.quadrature;
        for nodes in [regular, extraordinary] {
            if !(1..=MOST_NODES).contains(&nodes) {
                let (name, value) = ("quadrature", nodes as f64);
                return Err(Error::BadOption { name, value, need: "from 1 to 64 points per side" });
            }
        }
        if self.blend_rings == Rings::Count(0) {
            let (name, value) = ("blend_rings", 0.0);
            return Err(Error::BadOption { name, value, need: "1 or more" });
        }
        Ok(())
    }

    /// The surface of a mesh with the blends these options ask for.
    pub(crate) fn surface_of(
        &self,
        mesh: &PolyMesh,
        creases: &Creases,
    ) -> Result<SubdivisionSurface, SubdivisionError> {
        let (blend, rings) = (self.blend.into(), self.blend_rings.count());
        SubdivisionSurface::with_rings(mesh, creases, blend, rings)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_option_reads_what_it_prints() {
        let mut made = Options {
            energy: "0.92*bending - 0.5*mehlum_tarrou(1,0.25)".parse().unwrap(),
            blend_rings: Rings::Count(3),
            method: Method::Sobolev,
            ..Options::default()
        };
        let before = made.clone();
        for field in Options::FIELDS {
            let text = (field.get)(&made).unwrap();
            (field.reset)(&mut made);
            (field.set)(&mut made, &text).unwrap();
        }
        assert_eq!(made, before);
        assert_eq!(Options::default().iterations, 2000);
    }

    #[test]
    fn nonsense_is_refused_by_the_name_of_the_field() {
        let refused = |options: Options| options.check().unwrap_err().to_string();
        let defaults = Options::default;
        let tolerance = refused(Options { tolerance: f64::NAN, ..defaults() });
        assert_eq!(tolerance, "`tolerance` is NaN; it must be zero or more");
        let rings = refused(Options { blend_rings: Rings::Count(0), ..defaults() });
        assert!(rings.starts_with("`blend_rings` is 0"), "{rings}");
        let nodes = Quadrature { regular: 0, extraordinary: 16 };
        let nodes = refused(Options { quadrature: nodes, ..defaults() });
        assert!(nodes.starts_with("`quadrature` is 0"), "{nodes}");
    }
}
