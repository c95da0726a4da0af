//! The report of a Weingarten optimisation.

use super::energies::energy_history;
use super::jets::spline_view;
use crate::failure::{Failure, refused};
use crate::report_support::mesh::mesh_view;
use bspline::BsplineSurface;
use exchange::{NamedSurface, face_mesh};
use geom_core::DVec3;
use gp_solver::Counts;
use report::{LineRole, LineSet, RelationCurve, Report, ScalarField, SurfaceView};
use weingarten::{Metrics, Options, Relation, RelationLocus, Solution};

/// The surface before and after with its deviation, the energies, and the options in force.
pub(crate) fn weingarten_report(
    named: &NamedSurface,
    solution: &Solution,
    options: &Options,
    length_unit: &str,
) -> Result<Report, Failure> {
    let mut report = super::new("Weingarten optimisation");
    report.length_unit = length_unit.to_owned();
    let input = &named.surface;
    if let Some(trim) = &named.trim {
        let trim = Some(trim.without_edges());
        let after = NamedSurface { surface: solution.result.clone(), trim, ..named.clone() };
        for (name, face) in [("before", named), ("after", &after)] {
            report.stages.push(mesh_view(name, &face_mesh(face, None), length_unit)?);
        }
    } else {
        report.stages.push(spline_view("before", &[input], None, length_unit)?);
        let after = spline_view("after", &[&solution.result], Some(&[input]), length_unit)?;
        report.stages.push(with_flaws(with_misses(after, solution)?, input, solution)?);
    }
    let levels = solution.report.stages.iter().map(|l| (l.stage.name.clone(), &l.solver));
    report.energies = Some(energy_history(levels));
    report
        .relations
        .extend(solution.relation.as_ref().map(|locus| relation_curve(locus, solution)));

    let nets: Vec<&str> = solution.report.stages.iter().map(|l| l.stage.name.as_str()).collect();
    let [u, v] = solution.samples;
    // What was asked for, with what was found in place of what was left open.
    let in_force = Options { samples: Some(Counts { u, v }), ..options.clone() };
    crate::option_flags::list(&mut report, &in_force, &["levels", "relation"]);
    report.option("levels", nets.join(", "));
    report.option("relation", relation_words(&options.relation, solution));
    Ok(report)
}

/// The view with a map of where the relation asked for is missed, and by how much.
fn with_misses(view: SurfaceView, solution: &Solution) -> Result<SurfaceView, Failure> {
    let (Some(h), Some(k)) = (view.field("H"), view.field("K")) else { return Ok(view) };
    let Some(misses) = solution.relation_misses(&h.values, &k.values) else { return Ok(view) };
    let percent = misses.iter().map(|miss| 100.0 * miss).collect();
    let label = "relation missed, of the curvatures";
    let field = ScalarField::magnitude("relation-miss", label, "%", percent);
    view.with_field(field).map_err(refused)
}

/// The view with a cross at every check point where the result is torn or folded, as wide as the
/// grid it was looked at on.
fn with_flaws(
    view: SurfaceView,
    input: &BsplineSurface,
    solution: &Solution,
) -> Result<SurfaceView, Failure> {
    if solution.flaws.is_empty() {
        return Ok(view);
    }
    let of = &solution.result;
    let [u, v] = input.check_parameters();
    let half = [u, v].map(|at| 0.5 * (at[1] - at[0]));
    let domains = [of.knots_u().domain(), of.knots_v().domain()];
    let around = |at: f64, k: usize| {
        [-half[k], half[k]].map(|by| (at + by).clamp(domains[k].0, domains[k].1))
    };
    let crosses = solution.flaws.iter().flat_map(|flaw| {
        let along = around(flaw.u, 0).map(|u| of.point(u, flaw.v));
        let across = around(flaw.v, 1).map(|v| of.point(flaw.u, v));
        [along.to_vec(), across.to_vec()]
    });
    let lines: Vec<Vec<DVec3>> =
        crosses.filter(|line| line.iter().all(|p| p.is_finite())).collect();
    let label = "torn or folded between the samples";
    let lines = LineSet { visible: true, ..LineSet::new("flaws", label, LineRole::Curves, lines) };
    view.with_lines(lines).map_err(refused)
}

/// The relation over the curvatures of both surfaces.
fn relation_curve(locus: &RelationLocus, solution: &Solution) -> RelationCurve {
    let both = [&solution.before, &solution.metrics];
    let range = |low: fn(&Metrics) -> f64, high: fn(&Metrics) -> f64| {
        let least = both.map(low).into_iter().fold(f64::INFINITY, f64::min);
        [least, both.map(high).into_iter().fold(f64::NEG_INFINITY, f64::max)]
    };
    let h = range(|m| m.mean_curvature_min, |m| m.mean_curvature_max);
    let k = range(|m| m.gaussian_curvature_min, |m| m.gaussian_curvature_max);
    RelationCurve { name: locus.to_string().replace('-', "−"), points: locus.points(h, k) }
}

/// What was asked for, and what it came to if that was fitted.
fn relation_words(relation: &Relation, solution: &Solution) -> String {
    let locus = solution.relation.as_ref().map(ToString::to_string);
    match (relation, locus) {
        (Relation::LinearFit | Relation::ConstantMeanFit, Some(found)) => {
            format!("{found}, fitted")
        }
        (Relation::CurveFit, _) => "fitted curve".to_owned(),
        (Relation::Curve(points), _) => format!("curve of {} control points", points.len()),
        (_, Some(given)) => given,
        (_, None) => "any".to_owned(),
    }
}
