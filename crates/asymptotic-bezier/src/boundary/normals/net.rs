//! The curves of a whole net from the normals along them.
//!
//! Unknown are the normal at every vertex, the tangent of every mesh line through it and the growth
//! of the normal along it (one for both sides of a line that goes on), and the middle of the
//! normals along every curve. So lines of the net have continuous tangents and derivatives of
//! the torsion at the vertices. Least squares make curves and normals fair and keep tangents and
//! normals near the data; that every curve reaches its end, and that the curvature is continuous along
//! lines, is imposed with a large weight and then, by shortest steps, to rounding.

use std::sync::Arc;

use gp_solver::{
    MinNormProjection, Options as SolverOptions, Problem, ProjectionOptions, SolverError, Status,
};

use crate::boundary::normals::blocks::{Exactness, Fairness};
use crate::boundary::normals::curve::{CURVE_DEGREE, NormalCurve};
use crate::boundary::normals::curves::{NormalCurves, one_sign};
use crate::boundary::options::BoundaryOptions;
use crate::boundary::solved::Boundary;
use crate::curve::bezier::BezierCurve;
use crate::data::corners::{AsymptoticNet, DATA_DEGREE};
use crate::data::vertex::{PLANE_TOL, arm_signs, bilinear_torsions, curve_families, vertex_frames};
use crate::error::Error;
use crate::warning::Warning;
use crate::watch::Watch;

/// Torsions times the longest chord below this are none.
const FLAT: f64 = 1e-9;
/// A net is refused if the faces at more than this share of its vertices twist the wrong way or not
/// at all: between random twists half of them do.
const MOST_WITHOUT_TWIST: f64 = 0.25;
/// Tangents that turn by more degrees from the estimates are warned about: on exact nets of coarse
/// meshes they turn by up to twelve, on meshes that are only roughly asymptotic by more than thirty,
/// with mean curvatures that jump accordingly.
const MOST_TURN: f64 = 20.0;
/// Weights of gaps and jumps, in chords, one solve after the other. Multipliers do most of the
/// closing: with weights alone, large ones, the solver crawls along the bottom of a bent valley.
const CLOSING: [f64; 4] = [10.0, 10.0, 30.0, 100.0];
/// Steps of Levenberg-Marquardt for each weight, and the relative decrease that ends them.
const STEPS: usize = 30;
const DECREASE: f64 = 1e-6;
/// Gaps that count as closed, in chords.
const CLOSED: f64 = 1e-11;

/// Solves for all curves of `net` as [`solve_boundary`](crate::solve_boundary) does, by normals.
///
/// # Errors
/// As there; [`Error::NoFamilies`] where torsions cannot alternate around every vertex,
/// [`Error::NoTwist`] for meshes along other lines, and
/// [`Error::NotClosed`] where no such curves are found.
pub(crate) fn solve_by_normals(
    net: &AsymptoticNet,
    options: &BoundaryOptions,
    watch: &mut Watch<'_, '_>,
) -> Result<Boundary, Error> {
    if options.degree != CURVE_DEGREE && options.degree != DATA_DEGREE {
        let (degree, min, max) = (options.degree, CURVE_DEGREE, CURVE_DEGREE);
        return Err(Error::Degree { what: "boundary", degree, min, max });
    }
    net.check()?;
    let mut net = net.clone();
    if curve_families(&net).is_none() {
        return Err(Error::NoFamilies);
    }
    let frames = vertex_frames(&mut net, PLANE_TOL)?;
    let signs = arm_signs(&net, &frames);
    let estimated = bilinear_torsions(&net, &signs, &frames);
    let (orientation, mut torsions) = one_sign(&estimated);
    // A twist below rounding has no sign.
    let size = net.curves.iter().map(|c| net.chord(c).length()).fold(0.0, f64::max);
    let twists = |tau: &&f64| orientation * **tau * size > FLAT;
    let without = estimated.len() - estimated.iter().filter(twists).count();
    let share = without as f64 / estimated.len() as f64;
    if share > MOST_WITHOUT_TWIST {
        return Err(Error::NoTwist { share: 100.0 * share });
    }
    let handle = |v: usize| options.torsions.get(v).copied().unwrap_or_default().bounds();
    let bounds: Vec<[f64; 2]> = (0..torsions.len()).map(handle).collect();
    let mut held = vec![false; torsions.len()];
    for (v, &[min, max]) in bounds.iter().enumerate() {
        let place = net.vertex_place(v);
        if !(min <= max) {
            return Err(Error::TorsionBounds { place, min, max });
        }
        // The torsions of a family have one sign; at zero the normal would have no length.
        let reach = if orientation > 0.0 { max } else { -min };
        if !(reach > 0.0) {
            return Err(Error::TorsionInfeasible { place, defect: -reach });
        }
        torsions[v] = torsions[v].clamp(min, max);
        held[v] = min == max;
    }
    loop {
        let curves = Arc::new(NormalCurves::new(&net, &frames, &signs, &torsions));
        let x = solved(&curves, &held, watch)?;
        let found = found_torsions(&net, &curves, &x, orientation, &torsions);
        // Torsions that left their bounds are held there, and the others found again.
        let mut again = false;
        for (v, &tau) in found.iter().enumerate() {
            let bounded = tau.clamp(bounds[v][0], bounds[v][1]);
            if bounded != tau && !held[v] {
                (torsions[v], held[v], again) = (bounded, true, true);
            }
        }
        if again {
            continue;
        }
        let beziers = beziers(&net, &curves, &x)?;
        let warnings = rough_tangents(&net, &beziers).into_iter().collect();
        return Ok(Boundary {
            strain_energy: beziers.iter().map(|c| c.derivative_energy(2)).sum(),
            freedoms: freedoms(&curves, &held),
            inflections: vec![Vec::new(); beziers.len()],
            curves: beziers,
            torsions: found,
            warnings,
            signs,
            normals: curves.normals(&x),
        });
    }
}

/// The least-squares problem with the equations of this weight.
pub(crate) fn problem(curves: &Arc<NormalCurves>, held: &[bool]) -> Problem<'static> {
    let mut problem = Problem::new(curves.variables(held));
    problem.add(Fairness::new(curves));
    let mut exact = Exactness::new(curves);
    exact.reweight(CLOSING[0], curves.start());
    problem.add(exact);
    problem.add(curves.closeness());
    problem
}

/// Least squares, then shortest steps onto the exact equations.
fn solved(
    curves: &Arc<NormalCurves>,
    held: &[bool],
    watch: &mut Watch<'_, '_>,
) -> Result<Vec<f64>, Error> {
    let variables = curves.variables(held);
    let mut fair = Fairness::new(curves);
    let mut exact = Exactness::new(curves);
    let mut pull = curves.closeness();
    let options =
        SolverOptions { max_iterations: STEPS, energy_tol: DECREASE, ..SolverOptions::default() };
    let mut x = curves.start().to_vec();
    let failed = |error: Error| match error {
        Error::Solver(e @ SolverError::ForeignCheckpoint { .. }) => Error::Solver(e),
        Error::Solver(e) => Error::Curves(e),
        other => other,
    };
    for weight in CLOSING {
        exact.reweight(weight, &x);
        let mut problem = Problem::new(variables.clone());
        problem.add(&mut fair);
        problem.add(&mut exact);
        problem.add(&mut pull);
        let stage = watch.stage().clone();
        watch.extend(&stage, &mut problem)?;
        let (status, _) = watch.minimize(problem, &mut x, &options).map_err(failed)?;
        if status == Status::IterationLimit {
            // No curves are near; more weights would take long to say so.
            break;
        }
    }
    exact.release();
    watch.check()?;
    let mut projection = MinNormProjection::new(&exact, x.len(), 3).map_err(Error::Curves)?;
    let options = ProjectionOptions { tolerance: 1e-3 * CLOSED, ..ProjectionOptions::default() };
    let (scale, stage) = (curves.scale(held), watch.stage().clone());
    projection.project(&exact, &mut x, &scale, &options, &stage, &mut ()).map_err(Error::Curves)?;
    watch.check()?;
    Ok(x)
}

/// The solved curves, if all reach their ends.
fn beziers(
    net: &AsymptoticNet,
    curves: &NormalCurves,
    x: &[f64],
) -> Result<Vec<BezierCurve>, Error> {
    let gap = |i: usize| {
        let mut exact = [0.0; 6];
        curves.curves[i].exactness(&curves.unknowns(x, i), &mut exact, None);
        exact.iter().fold(0.0_f64, |a, b| a.max(b.abs()))
    };
    let gaps = (0..curves.curves.len()).map(|i| (gap(i), i));
    if let Some((gap, i)) = gaps.max_by(|a, b| a.0.total_cmp(&b.0))
        && !(gap <= CLOSED)
    {
        return Err(Error::NotClosed { place: net.curve_place(i), gap });
    }
    let ends = |i: usize| net.curves[i].ends.map(|v| net.positions[v]);
    let all = 0..curves.curves.len();
    Ok(all.map(|i| curves.curves[i].curve(&curves.unknowns(x, i), ends(i))).collect())
}

/// Torsion per vertex with the sign of the first family.
fn found_torsions(
    net: &AsymptoticNet,
    curves: &NormalCurves,
    x: &[f64],
    sign: f64,
    before: &[f64],
) -> Vec<f64> {
    let mut out = before.to_vec();
    for (i, curve) in net.curves.iter().enumerate() {
        for e in 0..2 {
            out[curve.ends[e]] = sign * curves.curves[i].torsion(e, &curves.unknowns(x, i));
        }
    }
    out
}

/// Unknowns less equations.
fn freedoms(curves: &NormalCurves, held: &[bool]) -> usize {
    let rows = curves.curves.iter().map(NormalCurve::exact_rows).sum::<usize>();
    let fixed = held.iter().filter(|h| **h).count();
    curves.start().len().saturating_sub(rows + curves.continued.len() + fixed)
}

/// The tangent that turned most from what the positions let expect, if that is too much.
fn rough_tangents(net: &AsymptoticNet, curves: &[BezierCurve]) -> Option<Warning> {
    let turn = |(i, e): (usize, usize)| {
        let forward = [1.0, -1.0][e];
        let tangent = curves[i].jet(e as f64).first * forward;
        tangent.angle_between(net.curves[i].arms[e]).to_degrees()
    };
    let ends = (0..curves.len()).flat_map(|i| [(i, 0), (i, 1)]);
    let (degrees, (curve, end)) =
        ends.map(|at| (turn(at), at)).max_by(|a, b| a.0.total_cmp(&b.0))?;
    let place = net.vertex_place(net.curves[curve].ends[end]);
    (degrees > MOST_TURN).then_some(Warning::RoughNet { place, degrees })
}
