//! The solved boundary curves of a net.

use geom_core::DVec3;

use crate::curve::bezier::BezierCurve;
use crate::warning::Warning;

/// Solved boundary curves of a net.
#[derive(Clone, Debug, PartialEq)]
pub struct Boundary {
    /// One curve per curve of the net, in its direction.
    pub curves: Vec<BezierCurve>,
    /// Torsion per vertex, for the curves of the family of `r1` of the first face.
    pub torsions: Vec<f64>,
    /// `Σ ∫ |r″|² dt`.
    pub strain_energy: f64,
    /// Number of free torsions and further unknowns that the energy decided.
    pub freedoms: usize,
    /// Vacuous equations, odd valences.
    pub warnings: Vec<Warning>,
    /// Parameters of the declared inflections of each curve.
    pub inflections: Vec<Vec<f64>>,
    pub(crate) signs: Vec<[f64; 2]>,
    /// Unit normal per vertex.
    pub(crate) normals: Vec<DVec3>,
}

impl Boundary {
    /// `+1` or `−1`: the torsion of the curve's end over the torsion of its vertex.
    #[must_use]
    pub fn torsion_sign(&self, curve: usize, end: usize) -> f64 {
        self.signs[curve][end]
    }

    /// Whether the curves were made from normals, of one degree and with an energy of their own.
    #[must_use]
    pub fn is_from_normals(&self) -> bool {
        self.curves.iter().any(|c| c.normals().is_some())
    }
}
