//! What is built but worth a word.

use crate::error::Place;

/// What was built although the user should know something about it.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
#[expect(missing_docs, reason = "the messages spell out every field")]
pub enum Warning {
    /// `∫ |τ| ds` above 180 degrees.
    #[error(
        "{place}: the binormal turns by {degrees:.0} degrees (more than 180); check the end curvatures and tangents, or use the relaxed mode"
    )]
    BinormalTurning { place: Place, degrees: f64 },
    /// `τ` passes zero.
    #[error(
        "{place}: torsion changes sign ({min:.3e} to {max:.3e}), so the Gaussian curvature vanishes on it: not a strict saddle"
    )]
    TorsionSignChange { place: Place, min: f64, max: f64 },
    /// The corner torsions do not follow one pattern.
    #[error(
        "{place}: corner torsions of different sign ({values:?} for the curves in the u-direction); a strict saddle needs one sign"
    )]
    CornerTorsionSigns { place: Place, values: [f64; 4] },
    /// Curvature almost zero somewhere.
    #[error(
        "{place}: curvature falls to {ratio:.4} of its maximum (below 0.02), a near-inflection; the tangent plane is badly determined there"
    )]
    NearZeroCurvature { place: Place, ratio: f64 },
    /// `K > 0` inside.
    #[error("{place}: Gaussian curvature is positive on {percent:.1} % of the patch")]
    PositiveGauss { place: Place, percent: f64 },
    /// The patch meets itself.
    #[error("{place}: the patch intersects itself ({pairs} pairs of sampled triangles)")]
    SelfIntersection { place: Place, pairs: usize },
    /// Another choice of curvature signs turns much less.
    #[error(
        "{place}: with curvature signs {signs} the binormals turn by at most {best_degrees:.0} degrees instead of {degrees:.0}; check the signs"
    )]
    BetterBranch { place: Place, signs: String, best_degrees: f64, degrees: f64 },
    /// Torsions of different sign at the two ends of a line.
    #[error(
        "{place}: the neighbours give the ends of this line torsions of opposite sign ({start:.3e}, {end:.3e}); the Gaussian curvature vanishes somewhere on it"
    )]
    LineTorsionSigns { place: Place, start: f64, end: f64 },
    /// Nearly tangent parameter lines.
    #[error("{place}: parameter lines meet at a sine of only {sine:.3}; raise the degree")]
    LowSine { place: Place, sine: f64 },
    /// The thin-plate optimum folded, so bounds were added.
    #[error("{place}: transversality bounds were needed to keep the boundary from folding")]
    BoundsActive { place: Place },
    /// The degree asked for did not work and a higher one was taken.
    #[error("{place}: bi-{from} was not regular, bi-{to} is used")]
    DegreeRaised { place: Place, from: usize, to: usize },
    /// A patch of a joint fill folds.
    #[error(
        "{place}: with {shared} of its joins C1 the patch folds; use G1 joins or a higher degree"
    )]
    JointFold { place: Place, shared: usize },
    /// Neighbouring normals far apart: the surface folds or has a singular point.
    #[error(
        "{place}: neighbouring normals turn by {degrees:.0} degrees, the patch is singular or folds there"
    )]
    NormalFlip { place: Place, degrees: f64 },
    /// Odd interior valence.
    #[error(
        "{place}: interior vertex of odd valence {valence}; torsion and Gaussian curvature are zero there"
    )]
    OddValence { place: Place, valence: usize },
    /// Curves from normals that leave the edges of their mesh far behind.
    #[error(
        "{place}: a curve had to turn by {degrees:.0} degrees from what the edges let expect (more than 20), so the surface is rough; make the net exactly asymptotic first, with planar vertex stars, or refine it"
    )]
    RoughNet { place: Place, degrees: f64 },
    /// The torsion equation at a corner carries no unknown and is satisfied anyway.
    #[error("{place}: the torsion equation is vacuous, one extra freedom is left to the energy")]
    VacuousTorsion { place: Place },
    /// A setting for curves from curvatures, and the net needed curves from normals.
    #[error("`{option}` was not used: this net needs curves made from normals")]
    NotUsed { option: &'static str },
}
