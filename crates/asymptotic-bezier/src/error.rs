//! What cannot be attempted.

use std::fmt;

use gp_solver::SolverError;

use crate::faults::{DataFault, NetFault};

/// Which of the four boundary curves or which corner of a net a message is about.
///
/// Single patches number curves 1 to 4 as the paper does (`r1` at v = 0, `r2` at u = 0, `r3` at
/// v = 1, `r4` at u = 1) and name corners `00`, `10`, `01`, `11`; nets count from 0.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Place {
    /// Curve `r1..r4` of a single patch, 0-based here, 1-based in messages.
    PatchCurve(usize),
    /// Corner of a single patch: 0 is `00`, 1 is `10`, 2 is `01`, 3 is `11`.
    PatchCorner(usize),
    /// Curve of a net.
    NetCurve(usize),
    /// Vertex of a net.
    NetVertex(usize),
    /// Face of a net, or the patch that fills it.
    Patch(usize),
}

impl fmt::Display for Place {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::PatchCurve(i) => write!(f, "curve {}", i + 1),
            Self::PatchCorner(c) => {
                write!(f, "corner {}", ["00", "10", "01", "11"].get(*c).unwrap_or(&"?"))
            }
            Self::NetCurve(i) => write!(f, "net curve {i}"),
            Self::NetVertex(v) => write!(f, "vertex {v}"),
            Self::Patch(p) => write!(f, "patch {p}"),
        }
    }
}

/// Why corner data or a net cannot be bounded by asymptotic curves or filled.
///
/// # Example
/// ```
/// use asymptotic_bezier::{Options, solve};
/// use geom_core::{DVec3, PolyMesh};
/// let triangle = PolyMesh::new(vec![DVec3::ZERO, DVec3::X, DVec3::Y], &[[0, 1, 2]])?;
/// let error = solve(&triangle.into(), &Options::default(), &mut ()).unwrap_err();
/// assert!(error.to_string().contains("face 0"), "{error}");
/// # Ok::<(), geom_core::MeshError>(())
/// ```
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
#[expect(missing_docs, reason = "the messages spell out every field")]
pub enum Error {
    /// No extent, too much of it, or too far away.
    #[error(transparent)]
    Size(#[from] geom_core::NormalizationError),
    /// NaN or infinity in the input.
    #[error("{place}: {what} is not finite; every coordinate and curvature must be a number")]
    NotFinite { place: Place, what: &'static str },
    /// Tangent control point on its corner, or a zero tangent.
    #[error(
        "{place}: the tangent point at the {end} coincides with the corner (arm length {length:.3e}); move it along the wanted tangent"
    )]
    CoincidentTangent { place: Place, end: &'static str, length: f64 },
    /// The two curves leave the corner along one line.
    #[error(
        "{place}: boundary tangents are parallel (sine {sine:.3e}, at least 1e-6 needed); turn one of the tangents"
    )]
    ParallelTangents { place: Place, sine: f64 },
    /// Three or more tangents at one vertex that do not share a plane.
    #[error(
        "{place}: the tangents leave their common plane by {angle_deg:.3} degrees (limit {limit_deg}); asymptotic curves through one point lie in one tangent plane"
    )]
    TangentsNotCoplanar { place: Place, angle_deg: f64, limit_deg: f64 },
    /// `k = 0` at the end of a curve that is not declared straight.
    #[error(
        "{place}: zero curvature at the {end} of a curve that is not a line; give a curvature, or declare the curve a line"
    )]
    ZeroCurvature { place: Place, end: &'static str },
    /// A declared line whose tangents leave the chord.
    #[error(
        "{place}: declared a line but its tangents leave the chord (sine {sine:.3e}); align them or drop the declaration"
    )]
    LineNotStraight { place: Place, sine: f64 },
    /// A declared line with curvature data.
    #[error(
        "{place}: declared a line but curvature {curvature} is given at the {end}; set it to 0"
    )]
    LineWithCurvature { place: Place, end: &'static str, curvature: f64 },
    /// End curvatures whose signs need an inflection that is not declared.
    #[error(
        "{place}: the end curvatures bend to opposite sides, so the curve has an odd number of inflections, but {declared} are declared; flip a sign or declare the inflection"
    )]
    InflectionParity { place: Place, declared: usize },
    /// The solved curve has an inflection nobody declared.
    #[error(
        "{place}: undeclared inflection, the binormal reverses at t = {t:.6}; declare it or change the end curvatures"
    )]
    UndeclaredInflection { place: Place, t: f64 },
    /// The declared inflection could not be built.
    #[error(
        "{place}: no curve with the declared inflections found (defect {defect:.3e} in {iterations} starts); change the end data or drop the declaration"
    )]
    InflectionNotFound { place: Place, defect: f64, iterations: usize },
    /// Torsion equation without unknowns and with a defect.
    #[error(
        "{place}: the torsion equation has no solution (both far tangents lie in the corner plane), defect {defect:.3e}; move one of the far tangents out of the plane"
    )]
    TorsionInfeasible { place: Place, defect: f64 },
    /// Prescribed torsions or bounds that contradict the data or one another.
    #[error(
        "{place}: torsion is bounded below by {min} and above by {max}; no value satisfies both"
    )]
    TorsionBounds { place: Place, min: f64, max: f64 },
    /// `r′` vanishes.
    #[error(
        "{place}: cusp, the speed falls to {relative_speed:.3e} of its mean; shorten the tangents or lower the curvature"
    )]
    Cusp { place: Place, relative_speed: f64 },
    /// The tangent fields cannot match tangents and twists at the corners.
    #[error(
        "{place}: corner and twist equations contradict one another, residual {residual:.3e}; the boundary violates the torsion condition"
    )]
    CornerEquations { place: Place, residual: f64 },
    /// The crossing field changes sign and the bounds cannot prevent it.
    #[error(
        "{place}: the patch folds along {curve} (transversality {worst:.3} of the corner values at t = {t:.3}) and the bounds cannot be met at bi-{degree}; raise the degree or mend the corner data"
    )]
    Folded { place: Place, curve: Place, worst: f64, t: f64, degree: usize },
    /// C1 and G2 joins with fields or inner points that cannot be shared.
    #[error(
        "C1 and G2 joins need the tangent module and thin plates; drop the other ansatz or mask, or use G1 joins"
    )]
    JoinsNeedModule,
    /// The system of all patches together.
    #[error("the system of all patches cannot be solved ({0}); fill them with G1 joins")]
    Joint(#[source] SolverError),
    /// Curves from normals on a net whose vertices do not alternate.
    #[error(
        "the curves do not fall into two families (an inner vertex of odd valence, or a net that cannot be coloured), so no normals with K < 0 run along them; make the curves from curvatures"
    )]
    NoFamilies,
    /// Faces without the twist of an asymptotic net.
    #[error(
        "the faces at {share:.0} % of the vertices do not twist as asymptotic lines make them, so the surface is flat or the mesh runs along other lines; use a mesh along asymptotic lines"
    )]
    NoTwist { share: f64 },
    /// Least squares for the curves of a net.
    #[error("the curves of the net cannot be solved for ({0}); mend tangents and curvatures")]
    Curves(#[source] SolverError),
    /// A curve from normals that does not reach its end.
    #[error(
        "{place}: no curve from normals reaches its end (gap {gap:.3e} chords); make the net exactly asymptotic first, with planar vertex stars, or refine it"
    )]
    NotClosed { place: Place, gap: f64 },
    /// Degree outside what the construction offers.
    #[error("degree {degree} of the {what} is outside {min}..={max}")]
    Degree { what: &'static str, degree: usize, min: usize, max: usize },
    /// Quartic data: osculating planes at the ends of a curve that do not meet in a line.
    #[error(
        "{place}: the corner planes at both ends are parallel (sine {sine:.3e}), so a quartic has no middle point; use a quintic"
    )]
    QuarticPlanes { place: Place, sine: f64 },
    /// Quartic data without solution.
    #[error(
        "the four torsion equations of the quartic quadrilateral have no solution (residual {residual:.3e}); use quintics"
    )]
    QuarticInfeasible { residual: f64 },
    /// The input file lacks a field or contradicts itself.
    #[error(transparent)]
    Data(#[from] DataFault),
    /// The net is not a net of quads with curves along its edges.
    #[error(transparent)]
    Net(#[from] NetFault),
    /// A setting outside its range.
    #[error("`{name}` is {value}; it must be {need}")]
    BadOption { name: &'static str, value: f64, need: &'static str },
    /// A setting for curves from curvatures where curves from normals are asked for.
    #[error(
        "`{name}` is for curves made from curvatures; drop it, or do not ask for `curves` from normals"
    )]
    OnlyForCurvatures { name: &'static str },
    /// Stresses need both moduli.
    #[error("`{given}` is given without `{missing}`; give both or none")]
    OneModulus { given: &'static str, missing: &'static str },
    /// Blocks of the caller's on control points that a mask sets afterwards.
    #[error(
        "a mask finds the inner control points when all else is solved, so nothing can be added to \
         the problem of a patch; set `interior` to thin_plate"
    )]
    ExtendedMask,
    /// Equations of the caller's that contradict the data or one another.
    #[error(
        "stage {stage}: the equations that were added contradict what holds already, defect \
         {violation:.3e}; drop one"
    )]
    Infeasible { stage: String, violation: f64 },
    /// The observer asked to stop before there was a result.
    #[error(
        "the run was interrupted in the stage {stage}, before there was a surface; resume it from \
         its checkpoint"
    )]
    Interrupted { stage: String },
    /// There is no such stage with these options.
    #[error("there is no stage `{stage}` with these options; {remedy}")]
    NoSuchStage { stage: &'static str, remedy: &'static str },
    /// A block, a checkpoint, a factorisation.
    #[error(transparent)]
    Solver(#[from] SolverError),
}
