//! Fills a boundary: the freedoms of least energy, bounds where the patch would fold, higher degrees
//! where bounds do not help.

use gp_solver::{BlockId, Group, Problem, QuadraticForm, Status, Variables};
use numerics::minimize_quadratic;

use crate::boundary::four_curves::PatchBoundary;
use crate::error::{Error, Place};
use crate::patch::bounds;
use crate::patch::extension::{Points, held_equations, tangent_planes};
use crate::patch::family::PatchFamily;
use crate::patch::mask::{Interior, masked, thin_plate_energy};
use crate::patch::options::{Ansatz, PatchOptions};
use crate::patch::plate_block::ThinPlate;
use crate::patch::surface::Patch;
use crate::patch::thin_plate::{MAX_SURFACE_DEGREE, fill_table};
use crate::stages::{CONTROL_POINTS, FIELDS};
use crate::warning::Warning;
use crate::watch::{Shape, Watch};

/// A filled patch.
#[derive(Clone, Debug, PartialEq)]
pub struct FilledPatch {
    /// The surface.
    pub patch: Patch,
    /// `∫∫ |R_uu|² + 2 |R_uv|² + |R_vv|²`.
    pub thin_plate_energy: f64,
    /// Freedoms of the tangent fields.
    pub freedoms: usize,
    /// Least transversality along the boundary, relative to the interpolated corner values.
    pub transversality: f64,
    /// Bounds that were needed, degrees that were raised.
    pub warnings: Vec<Warning>,
}

/// Fills one boundary; `place` names the patch in messages.
///
/// # Errors
/// [`Error::Degree`], [`Error::CornerEquations`], and
/// [`Error::Folded`] when no degree gives a regular boundary.
pub fn fill_patch(
    boundary: &PatchBoundary,
    options: &PatchOptions,
    place: Place,
) -> Result<FilledPatch, Error> {
    fill_by(boundary, options, place, &mut |n| fill_degree(boundary, n, options, place))
}

/// [`fill_patch`] of face `f` with what the caller adds.
pub(crate) fn extended_patch(
    boundary: &PatchBoundary,
    options: &PatchOptions,
    f: usize,
    watch: &mut Watch<'_, '_>,
) -> Result<FilledPatch, Error> {
    let place = Place::Patch(f);
    fill_by(boundary, options, place, &mut |n| {
        watch.check()?;
        let family = PatchFamily::new(boundary, n, options.ansatz, place)?;
        let filled = fill_family(boundary, &family, options, place)?;
        let better = extended(boundary, &family, &filled, options, f, watch)?;
        Ok(better.unwrap_or(filled.0))
    })
}

/// The problem of a patch of the lowest degree that is tried.
pub(crate) fn patch_problem(
    boundary: &PatchBoundary,
    options: &PatchOptions,
    place: Place,
) -> Result<Problem<'static>, Error> {
    let n = degrees(boundary, options)[0];
    let family = PatchFamily::new(boundary, n, options.ansatz, place)?;
    Ok(family_problem(&family).0)
}

/// The degrees to try.
fn degrees(boundary: &PatchBoundary, options: &PatchOptions) -> Vec<usize> {
    let p = boundary.curves[0].degree();
    let paper = 3 * p - 4;
    let tried: &[usize] = match (options.ansatz, options.degree) {
        (Ansatz::Module, Some(n)) => &[n],
        // Curves made from normals leave their patches as much freedom as quintics do.
        (Ansatz::Module, None) if boundary.curves.iter().all(|c| c.normals().is_some()) => {
            &[7, 8, 11]
        }
        (Ansatz::Module, None) => match p {
            ..=5 => &[7, 8, 11],
            6 => &[8, 9, 12],
            7 => &[9, 10, 13],
            8 => &[10, 11, 14],
            _ => &[11, 12, 15],
        },
        _ => &[paper],
    };
    tried.to_vec()
}

/// Fills by the first degree that gives a regular patch.
fn fill_by(
    boundary: &PatchBoundary,
    options: &PatchOptions,
    place: Place,
    fill: &mut dyn FnMut(usize) -> Result<FilledPatch, Error>,
) -> Result<FilledPatch, Error> {
    let p = boundary.curves[0].degree();
    let tried = degrees(boundary, options);
    let first = tried[0];
    let mut best: Option<FilledPatch> = None;
    let mut failure = None;
    for &n in &tried {
        let min = if p == 4 { 5 } else { p };
        if !(min..=MAX_SURFACE_DEGREE).contains(&n) {
            let (degree, max) = (n, MAX_SURFACE_DEGREE);
            return Err(Error::Degree { what: "surface", degree, min, max });
        }
        match fill(n) {
            Ok(mut filled) => {
                if n != first {
                    filled.warnings.push(Warning::DegreeRaised { place, from: first, to: n });
                }
                if tried.len() == 1 || filled.patch.least_sine(16) >= options.min_sine {
                    return Ok(filled);
                }
                best.get_or_insert(filled);
            }
            Err(error @ Error::Folded { .. }) => {
                failure.get_or_insert(error);
            }
            Err(error) => return Err(error),
        }
    }
    // None has the sine asked for: the lowest regular degree is as good as any.
    best.ok_or_else(|| failure.unwrap_or(Error::CornerEquations { place, residual: f64::NAN }))
}

fn fill_degree(
    boundary: &PatchBoundary,
    n: usize,
    options: &PatchOptions,
    place: Place,
) -> Result<FilledPatch, Error> {
    let family = PatchFamily::new(boundary, n, options.ansatz, place)?;
    Ok(fill_family(boundary, &family, options, place)?.0)
}

/// The patch of a family, and its freedoms.
fn fill_family(
    boundary: &PatchBoundary,
    family: &PatchFamily,
    options: &PatchOptions,
    place: Place,
) -> Result<(FilledPatch, Vec<f64>), Error> {
    let n = family.degree;
    let mut y = minimize_quadratic(&family.hessian, &family.gradient);
    let mut warnings = Vec::new();
    let strips = bounds::strips(family, boundary);
    let mut transversality = strips.worst(family, &y);
    // The fidelity mode shows what the paper's fields do, so nothing is added to it.
    if let (Some(theta), Ansatz::Module) = (options.bound, options.ansatz)
        && transversality.value < theta - 1e-12
    {
        if let Some(bounded) = strips.minimize(family, theta) {
            y = bounded;
            transversality = strips.worst(family, &y);
            warnings.push(Warning::BoundsActive { place });
        }
        if !(transversality.value > 0.0) {
            return Err(Error::Folded {
                place,
                curve: Place::PatchCurve(transversality.curve),
                worst: transversality.value,
                t: transversality.t,
                degree: n,
            });
        }
    }
    let thin_plate = family.patch(&y);
    let (patch, thin_plate_energy) = masked(&thin_plate.0, options.interior).unwrap_or(thin_plate);
    let filled = FilledPatch {
        patch,
        thin_plate_energy,
        freedoms: y.len(),
        transversality: transversality.value,
        warnings,
    };
    Ok((filled, y))
}

/// Fields and control points of a family from its origin: the problem, its groups, the equations of
/// the tangent planes.
fn family_problem(family: &PatchFamily) -> (Problem<'static>, Group, BlockId) {
    let n = family.degree;
    let mut variables = Variables::new();
    let fields = variables.add(FIELDS, family.gradient.len(), 1);
    let points = variables.add_grid(CONTROL_POINTS, [n + 1, n + 1], 3);
    for (i, j) in &fill_table(n).border {
        variables.fix(points, i * (n + 1) + j);
    }
    let mut problem = Problem::new(variables);
    problem.add_energy(ThinPlate::new(n, points));
    let planes = problem.add(tangent_planes(&[point_map(family)], fields, points));
    (problem, points, planes)
}

fn point_map(family: &PatchFamily) -> Points {
    let freedoms: Vec<usize> = (0..family.gradient.len()).collect();
    Points::new(family, &freedoms, freedoms.len(), geom_core::DVec3::ZERO)
}

/// The patch with what the caller adds, if that is anything.
fn extended(
    boundary: &PatchBoundary,
    family: &PatchFamily,
    (filled, y): &(FilledPatch, Vec<f64>),
    options: &PatchOptions,
    f: usize,
    watch: &mut Watch<'_, '_>,
) -> Result<Option<FilledPatch>, Error> {
    let (n, origin) = (family.degree, family.origin);
    let name = format!("{}", Place::Patch(f));
    let stage = gp_solver::Stage { name, ..watch.stage_from(origin) };
    let (mut problem, points, planes) = family_problem(family);
    let before = Shape::of(&problem);
    watch.extend(&stage, &mut problem)?;
    if Shape::of(&problem) == before {
        return Ok(None);
    }
    if options.interior != Interior::ThinPlate {
        return Err(Error::ExtendedMask);
    }
    let mut start = vec![0.0; problem.unknowns()];
    start[..y.len()].copy_from_slice(y);
    for (k, point) in filled.patch.points().iter().enumerate() {
        points.set(&mut start, k, (*point - origin).to_array());
    }
    let map = point_map(family);
    let count = y.len() + 3 * fill_table(n).inner.len();
    let mut rows: Vec<Vec<(usize, f64)>> = (0..y.len()).map(|k| vec![(k, 1.0)]).collect();
    let mut constants = vec![0.0; y.len()];
    rows.extend(map.rows);
    constants.extend(map.constants);
    let held = held_equations(&before, &problem, &start);
    // The fields know the tangent planes.
    problem.remove(planes)?;
    let mut form = QuadraticForm::of(&problem)?;
    form.equations.extend(held);
    let mut program = form.in_terms_of(&rows, &constants).dense(count);
    let strips = bounds::strips(family, boundary);
    let mut warnings = Vec::new();
    let mut solution = program.solve()?;
    let mut worst = strips.worst(family, &solution.x[..y.len()]);
    if let (Some(theta), Ansatz::Module) = (options.bound, options.ansatz)
        && worst.value < theta - 1e-12
    {
        strips.bound(family, theta, &mut program);
        let bounded = program.solve()?;
        if bounded.status == Status::Converged {
            solution = bounded;
            worst = strips.worst(family, &solution.x[..y.len()]);
            warnings.push(Warning::BoundsActive { place: Place::Patch(f) });
        }
    }
    if solution.status == Status::Infeasible {
        let (stage, violation) = (stage.name, solution.violation);
        return Err(Error::Infeasible { stage, violation });
    }
    let value = |k: usize| {
        let row = &rows[y.len() + k];
        constants[y.len() + k] + row.iter().map(|(u, a)| a * solution.x[*u]).sum::<f64>()
    };
    let point = |k: usize| geom_core::DVec3::from_array([0, 1, 2].map(|a| value(3 * k + a)));
    let patch = Patch::new(n, (0..points.len()).map(|k| origin + point(k)).collect());
    let thin_plate_energy = thin_plate_energy(&patch);
    let (freedoms, transversality) = (count, worst.value);
    Ok(Some(FilledPatch { patch, thin_plate_energy, freedoms, transversality, warnings }))
}
