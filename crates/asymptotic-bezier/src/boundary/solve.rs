//! All boundary curves of a net at once: the quadratic programme in the vertex torsions.
//!
//! The height of the third control point over the corner plane is proportional to the torsion:
//! `N·(P₃ − P₀) = k |a|³ p² τ / ((p−1)(p−2))`. At a vertex all arms have torsion `±τ_v`, so every
//! curve depends on nothing but the torsions at its two ends and its own further freedom. Each
//! curve is condensed to a quadratic form in these two torsions; what remains is one sparse
//! positive definite system with one unknown per vertex. For one patch these unknowns are the
//! four free parameters of Wang et al. 2019, §3.2, as the corner torsions.

use geom_core::DVec3;
use gp_solver::{BoundedQp, Problem, QuadraticForm, Status};
use rayon::prelude::*;

use crate::boundary::curve_energy::{CurveEnergy, CurveShare, torsion_variables};
use crate::boundary::inflection::InflectedCurve;
use crate::boundary::normals::curves::NormalCurves;
use crate::boundary::normals::net::{problem as normals_problem, solve_by_normals};
use crate::boundary::options::{BOUNDARY_DEGREES, BoundaryEnergy, BoundaryOptions, CurveForm};
use crate::boundary::solved::Boundary;
use crate::boundary::torsion_energy::{self, TorsionCurve};
use crate::curve::bernstein;
use crate::curve::bezier::BezierCurve;
use crate::data::corners::{AsymptoticNet, DATA_DEGREE};
use crate::data::vertex::{
    PLANE_TOL, VertexFrame, arm_signs, bilinear_torsions, curve_families, vertex_frames,
};
use crate::error::Error;
use crate::warning::Warning;
use crate::watch::{Shape, Watch};
use numerics::{AffineSpace, Cholesky, Matrix, affine_space, dot};

/// A coefficient of a torsion equation this small, relative to the curve's size, is no coefficient.
const VACUOUS_TOL: f64 = 1e-10;

/// One curve as an affine function of the torsions at its ends.
struct CondensedCurve {
    /// Control points, measured from the start, for `(1, τ_start, τ_end)`.
    points: [Vec<DVec3>; 3],
    /// Energy as a quadratic form in `(1, τ_start, τ_end)`, symmetric.
    energy: [[f64; 3]; 3],
    /// Torsion that data force on an end, because nothing in the curve can answer it.
    pinned: [Option<f64>; 2],
    /// Unknowns besides the torsions.
    freedoms: usize,
    /// Height per torsion, for defects in units of length.
    lever: [f64; 2],
}

/// Solves for all curves of `net`.
///
/// Returns the net with its arms projected into the vertex planes too, because the patches need
/// the same tangents.
///
/// # Errors
/// Every hard fault of the data (see [`Error`]).
pub fn solve_boundary(net: &AsymptoticNet, options: &BoundaryOptions) -> Result<Boundary, Error> {
    boundary_of(net, options, &mut Watch::quiet(&mut ()))
}

/// Whether the curves of the net are made from normals.
pub(crate) fn is_by_normals(net: &AsymptoticNet, form: CurveForm) -> bool {
    match form {
        CurveForm::Normals => true,
        CurveForm::Curvatures => false,
        CurveForm::Auto => {
            net.estimated && net.has_weak_curvature() && curve_families(net).is_some()
        }
    }
}

/// [`solve_boundary`], watched.
pub(crate) fn boundary_of(
    net: &AsymptoticNet,
    options: &BoundaryOptions,
    watch: &mut Watch<'_, '_>,
) -> Result<Boundary, Error> {
    let [min, max] = BOUNDARY_DEGREES;
    if !(min..=max).contains(&options.degree) {
        let degree = options.degree;
        return Err(Error::Degree { what: "boundary", degree, min, max });
    }
    if is_by_normals(net, options.form) {
        return solve_by_normals(net, options, watch);
    }
    let condensed = Condensed::new(net, options)?;
    let Condensed { net, frames, signs, curves, bounds, warnings } = &condensed;
    watch.check()?;
    let mut torsions = condensed.torsions(watch, options.energy)?;
    // Where no curve carries the torsion, the twist of the corners estimates it.
    let bilinear = bilinear_torsions(net, signs, frames);
    for (v, frame) in frames.iter().enumerate() {
        let Some(frame) = frame else { continue };
        let silent = frame.arms.iter().all(|(i, _)| condensed.is_silent(*i));
        if silent && bounds[v][0] < bounds[v][1] {
            torsions[v] = bilinear[v].clamp(bounds[v][0], bounds[v][1]);
        }
    }
    if options.energy == BoundaryEnergy::Torsion {
        torsion_energy::minimize(&condensed.torsion_curves(), bounds, &mut torsions, watch)?;
    }
    let free = bounds.iter().zip(frames).filter(|(b, f)| f.is_some() && b[0] < b[1]).count();

    let solved = watch.each(curves.len(), |i, _| {
        let (c, curve) = (&curves[i], &net.curves[i]);
        let [s, e] = [0, 1].map(|e| signs[i][e] * torsions[curve.ends[e]]);
        if !curve.line && curve.inflections > 0 {
            return inflected(net, frames, i, [s, e], options.degree);
        }
        let point = |k: usize| c.points[0][k] + c.points[1][k] * s + c.points[2][k] * e;
        let ends = curve.ends.map(|v| net.positions[v]);
        let offsets = (0..=options.degree).map(point).collect();
        Ok((BezierCurve::from_offsets(offsets, ends), Vec::new()))
    })?;
    let mut beziers = Vec::with_capacity(solved.len());
    let mut inflections = Vec::with_capacity(solved.len());
    for result in solved {
        let (curve, parameters) = result?;
        beziers.push(curve);
        inflections.push(parameters);
    }
    let strain_energy = beziers.iter().map(|c| c.derivative_energy(2)).sum();
    Ok(Boundary {
        curves: beziers,
        torsions,
        strain_energy,
        freedoms: free + curves.iter().map(|c| c.freedoms).sum::<usize>(),
        warnings: warnings.clone(),
        inflections,
        signs: signs.clone(),
        normals: frames.iter().map(|f| f.as_ref().map_or(DVec3::Z, |f| f.normal)).collect(),
    })
}

/// The problem of the stage, before anything is solved.
pub(crate) fn boundary_problem(
    net: &AsymptoticNet,
    options: &BoundaryOptions,
) -> Result<Problem<'static>, Error> {
    if is_by_normals(net, options.form) {
        let curves = std::sync::Arc::new(NormalCurves::of_net(net)?);
        return Ok(normals_problem(&curves, &[]));
    }
    let condensed = Condensed::new(net, options)?;
    if options.energy == BoundaryEnergy::Torsion {
        let (curves, bounds) = (condensed.torsion_curves(), &condensed.bounds);
        let held: Vec<bool> = bounds.iter().map(|b| b[0] == b[1]).collect();
        if let Some(problem) = torsion_energy::problem(&curves, bounds.len(), &held) {
            return Ok(problem);
        }
    }
    Ok(condensed.problem())
}

/// All curves of a net as functions of the vertex torsions.
struct Condensed {
    /// With arms in the tangent planes.
    net: AsymptoticNet,
    frames: Vec<Option<VertexFrame>>,
    signs: Vec<[f64; 2]>,
    curves: Vec<CondensedCurve>,
    bounds: Vec<[f64; 2]>,
    warnings: Vec<Warning>,
}

impl Condensed {
    fn new(net: &AsymptoticNet, options: &BoundaryOptions) -> Result<Self, Error> {
        net.check()?;
        net.check_curvatures()?;
        let mut net = net.clone();
        let frames = vertex_frames(&mut net, PLANE_TOL)?;
        let order = if options.energy == BoundaryEnergy::Jerk { 3 } else { 2 };
        let gram = bernstein::gram(options.degree, order);
        let curves: Vec<CondensedCurve> = (0..net.curves.len())
            .into_par_iter()
            .map(|i| condense(&net, &frames, i, options.degree, &gram))
            .collect();
        let mut bounds: Vec<[f64; 2]> = (0..net.positions.len())
            .map(|v| options.torsions.get(v).copied().unwrap_or_default().bounds())
            .collect();
        let mut warnings = Vec::new();
        let signs = arm_signs(&net, &frames);
        pin_torsions(&net, &frames, &curves, &mut bounds, &mut warnings)?;
        Ok(Self { net, frames, signs, curves, bounds, warnings })
    }

    /// Lines have no torsion; inflected curves take theirs from the curves they meet.
    fn is_silent(&self, i: usize) -> bool {
        self.net.curves[i].line || self.net.curves[i].inflections > 0
    }

    fn torsion_curves(&self) -> Vec<TorsionCurve> {
        let voiced = (0..self.curves.len()).filter(|i| !self.is_silent(*i));
        let curve = |i: usize| TorsionCurve {
            points: self.curves[i].points.clone(),
            ends: self.net.curves[i].ends,
            signs: self.signs[i],
        };
        voiced.map(curve).collect()
    }

    /// Curves whose energy the torsions decide.
    fn deciding(&self) -> impl Iterator<Item = usize> + '_ {
        (0..self.curves.len()).filter(|i| self.net.curves[*i].inflections == 0)
    }

    /// Minimises the sum of the energies over the torsions within their bounds.
    fn program(&self) -> BoundedQp {
        let mut qp = BoundedQp::new(self.bounds.len());
        for i in self.deciding() {
            let (c, ends, signs) = (&self.curves[i], self.net.curves[i].ends, self.signs[i]);
            for e in 0..2 {
                qp.quadratic(ends[e], ends[e], c.energy[1 + e][1 + e]);
                qp.linear(ends[e], c.energy[0][1 + e] * signs[e]);
            }
            qp.quadratic(ends[0], ends[1], c.energy[1][2] * signs[0] * signs[1]);
        }
        for (v, [min, max]) in self.bounds.iter().enumerate() {
            qp.bounds(v, *min, *max);
        }
        qp
    }

    fn problem(&self) -> Problem<'static> {
        let (variables, torsions) = torsion_variables(self.bounds.len());
        let share = |i: usize| {
            let [s, e] = self.signs[i];
            let signs = [1.0, s, e];
            let energy = std::array::from_fn(|a| {
                std::array::from_fn(|b| signs[a] * signs[b] * self.curves[i].energy[a][b])
            });
            CurveShare { ends: self.net.curves[i].ends, energy }
        };
        let mut problem = Problem::new(variables);
        problem.add_energy(CurveEnergy::new(self.deciding().map(share).collect(), torsions));
        problem
    }

    /// The torsions of least energy, with what the caller adds.
    fn torsions(
        &self,
        watch: &mut Watch<'_, '_>,
        energy: BoundaryEnergy,
    ) -> Result<Vec<f64>, Error> {
        let start = self.program().solve()?.x;
        // The energy of the torsion starts from here and is what the caller adds to.
        if !watch.is_extended() || energy == BoundaryEnergy::Torsion {
            return Ok(start);
        }
        let mut problem = self.problem();
        let before = Shape::of(&problem);
        let stage = watch.stage().clone();
        watch.extend(&stage, &mut problem)?;
        if Shape::of(&problem) == before {
            return Ok(start);
        }
        let form = QuadraticForm::of(&problem)?;
        let mut qp = BoundedQp::new(self.bounds.len());
        form.terms.iter().for_each(|t| _ = qp.term(t));
        for (v, [min, max]) in self.bounds.iter().enumerate() {
            let fixed = problem.variables().fixed()[v];
            let [min, max] = if fixed { [start[v]; 2] } else { [*min, *max] };
            qp.bounds(v, min, max);
        }
        form.equations.into_iter().for_each(|e| _ = qp.equal(e));
        let solution = qp.solve()?;
        if solution.status == Status::Infeasible {
            let (stage, violation) = (stage.name, solution.violation);
            return Err(Error::Infeasible { stage, violation });
        }
        Ok(solution.x)
    }
}

/// Curve `i` with its declared inflections, between ends of known torsion.
fn inflected(
    net: &AsymptoticNet,
    frames: &[Option<VertexFrame>],
    i: usize,
    torsions: [f64; 2],
    degree: usize,
) -> Result<(BezierCurve, Vec<f64>), Error> {
    let curve = &net.curves[i];
    let problem = InflectedCurve {
        chord: net.chord(curve),
        arms: curve.arms,
        normals: curve.ends.map(|v| frames[v].as_ref().map_or(DVec3::Z, |f| f.normal)),
        curvatures: curve.curvatures,
        torsions,
    };
    match problem.solve(curve.inflections) {
        Ok(found) => {
            let ends = curve.ends.map(|v| net.positions[v]);
            let curve = BezierCurve::from_offsets(found.curve.offsets().to_vec(), ends);
            Ok((curve.elevated(degree), found.parameters))
        }
        Err((defect, iterations)) => {
            Err(Error::InflectionNotFound { place: net.curve_place(i), defect, iterations })
        }
    }
}

/// Curve `i` with everything but its end torsions minimised out.
fn condense(
    net: &AsymptoticNet,
    frames: &[Option<VertexFrame>],
    i: usize,
    degree: usize,
    gram: &Matrix,
) -> CondensedCurve {
    let curve = &net.curves[i];
    let p = degree as f64;
    let scale = DATA_DEGREE as f64 / p;
    // Measured from the start: far from the origin the heights would lose their digits.
    let end_points = [DVec3::ZERO, net.chord(curve)];
    let arms = curve.arms.map(|a| a * scale);
    let normals = curve.ends.map(|v| frames[v].as_ref().map_or(DVec3::Z, |f| f.normal));
    // Constant part: end points, tangents, and the curvature's share of the third points.
    let mut base = vec![DVec3::ZERO; degree + 1];
    base[0] = end_points[0];
    base[1] = end_points[0] + arms[0];
    base[degree - 1] = end_points[1] + arms[1];
    base[degree] = end_points[1];
    let offset = |e: usize| {
        normals[e].cross(arms[e]) * (p / (p - 1.0) * curve.curvatures[e] * arms[e].length())
    };
    base[2] = end_points[0] + offset(0);
    base[degree - 2] = end_points[1] + offset(1);
    // Unknowns: own-arm coefficients, then the coordinates of the inner points.
    let mut columns = vec![(2, arms[0]), (degree - 2, arms[1])];
    for k in 3..degree.saturating_sub(2) {
        base[k] = end_points[0].lerp(end_points[1], k as f64 / p);
        columns.extend([DVec3::X, DVec3::Y, DVec3::Z].map(|axis| (k, axis)));
    }
    let n = columns.len();
    let mut hessian = Matrix::zeros(n, n);
    for (a, (ka, da)) in columns.iter().enumerate() {
        for (b, (kb, db)) in columns.iter().enumerate() {
            hessian[(a, b)] = gram[(*ka, *kb)] * da.dot(*db);
        }
    }
    let gradient: Vec<f64> = columns
        .iter()
        .map(|(k, d)| (0..=degree).map(|j| gram[(*k, j)] * d.dot(base[j])).sum())
        .collect();
    let scaling: Vec<f64> = (0..n).map(|a| hessian[(a, a)].sqrt().recip()).collect();

    // Torsion equations, right sides for (1, τ_start, τ_end).
    let size = (end_points[1] - end_points[0]).length().max(arms[0].length());
    let (mut rows, mut rhs, mut pinned) = (Vec::new(), Vec::new(), [None; 2]);
    let mut lever = [0.0; 2];
    if !curve.line && curve.inflections == 0 {
        for e in 0..2 {
            let third = if e == 0 { 3 } else { degree - 3 };
            lever[e] =
                curve.curvatures[e] * arms[e].length().powi(3) * p * p / ((p - 1.0) * (p - 2.0));
            let height = normals[e].dot(base[third] - end_points[e]);
            let row: Vec<f64> = columns
                .iter()
                .map(|(k, d)| if *k == third { normals[e].dot(*d) } else { 0.0 })
                .collect();
            let reach = columns
                .iter()
                .filter(|(k, _)| *k == third)
                .map(|(_, d)| normals[e].dot(*d).abs() / d.length())
                .fold(0.0, f64::max);
            if reach <= VACUOUS_TOL {
                let height = if height.abs() <= VACUOUS_TOL * size { 0.0 } else { height };
                pinned[e] = Some(height / lever[e]);
            } else {
                rows.push(row);
                let mut right = [-height, 0.0, 0.0];
                right[1 + e] = lever[e];
                rhs.push(right);
            }
        }
    }
    let mut c = Matrix::zeros(rows.len(), n);
    for (r, row) in rows.iter().enumerate() {
        c.row_mut(r).copy_from_slice(row);
    }
    let mut z: Vec<Vec<f64>> = Vec::with_capacity(3);
    let mut null = Matrix::zeros(n, 0);
    for k in 0..3 {
        let b: Vec<f64> = rhs.iter().map(|r| r[k]).collect();
        let AffineSpace { particular, null: basis, .. } = affine_space(&c, &b, &scaling, 1e-13);
        z.push(particular);
        null = basis;
    }
    if null.cols() > 0 {
        let reduced = null.transpose_product(&hessian.product(&null));
        if let Some(factor) = Cholesky::new(&reduced, 1e-14) {
            for (k, z) in z.iter_mut().enumerate() {
                let mut force = hessian.apply(z);
                if k == 0 {
                    force.iter_mut().zip(&gradient).for_each(|(f, g)| *f += g);
                }
                let w = factor.solve(&null.apply_transpose(&force));
                for (z, step) in z.iter_mut().zip(null.apply(&w)) {
                    *z -= step;
                }
            }
        }
    }
    let points: [Vec<DVec3>; 3] = std::array::from_fn(|k| {
        let mut points = if k == 0 { base.clone() } else { vec![DVec3::ZERO; degree + 1] };
        for ((index, d), z) in columns.iter().zip(&z[k]) {
            points[*index] += *d * *z;
        }
        points
    });
    let mut energy = [[0.0; 3]; 3];
    let constant: f64 = (0..=degree)
        .map(|a| (0..=degree).map(|b| gram[(a, b)] * base[a].dot(base[b])).sum::<f64>())
        .sum();
    for a in 0..3 {
        let hz = hessian.apply(&z[a]);
        for b in 0..3 {
            energy[a][b] = dot(&hz, &z[b]);
            if a == 0 {
                energy[a][b] += dot(&gradient, &z[b]);
            }
            if b == 0 {
                energy[a][b] += dot(&gradient, &z[a]);
            }
        }
    }
    energy[0][0] += constant;
    CondensedCurve { points, energy, pinned, freedoms: null.cols(), lever }
}

/// Applies torsions that data or parity force on a vertex.
fn pin_torsions(
    net: &AsymptoticNet,
    frames: &[Option<VertexFrame>],
    condensed: &[CondensedCurve],
    bounds: &mut [[f64; 2]],
    warnings: &mut Vec<Warning>,
) -> Result<(), Error> {
    for (v, frame) in frames.iter().enumerate() {
        let Some(frame) = frame else { continue };
        let place = net.vertex_place(v);
        if !(bounds[v][0] <= bounds[v][1]) {
            let [min, max] = bounds[v];
            return Err(Error::TorsionBounds { place, min, max });
        }
        if frame.odd {
            warnings.push(Warning::OddValence { place, valence: frame.arms.len() });
            bounds[v] = [0.0, 0.0];
        }
        let mut forced: Option<f64> = None;
        for ((curve, end), sign) in frame.arms.iter().zip(&frame.signs) {
            let Some(tau) = condensed[*curve].pinned[*end] else { continue };
            let tau = sign * tau;
            let lever = condensed[*curve].lever[*end];
            let other = forced.or((bounds[v][0] == bounds[v][1]).then_some(bounds[v][0]));
            if let Some(other) = other {
                let defect = ((tau - other) * lever).abs();
                let size = net.chord(&net.curves[*curve]).length();
                if !(defect <= 1e-10 * size) {
                    return Err(Error::TorsionInfeasible { place, defect });
                }
                let warning = Warning::VacuousTorsion { place };
                if forced.is_some() && !warnings.contains(&warning) {
                    warnings.push(warning);
                }
            }
            if !(bounds[v][0] <= tau && tau <= bounds[v][1]) && other.is_none() {
                let defect = (tau - tau.clamp(bounds[v][0], bounds[v][1])).abs() * lever.abs();
                return Err(Error::TorsionInfeasible { place, defect });
            }
            forced.get_or_insert(tau);
        }
        if let Some(tau) = forced {
            bounds[v] = [tau, tau];
        }
    }
    Ok(())
}
