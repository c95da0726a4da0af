//! The report of a design: curvature maps, asymptotic directions, joins.

use super::surfaces;
use crate::args::ReportArgs;
use crate::context::Context;
use crate::failure::Failure;
use crate::outcome::Outcome;
use crate::report_support::{add_files, jets::spline_view, new};
use asymptotic_bezier::{BezierCurve, Solution};
use exchange::LengthUnit;
use report::{LineRole, LineSet, Seam, SeamTable};

/// Segments of a drawn curve.
const SEGMENTS: usize = 32;
/// Rows of the table of joins.
const WORST: usize = 20;
/// The only view.
const STAGE: &str = "asymptotic patches";

pub(super) fn add(
    outcome: &mut Outcome,
    args: &ReportArgs,
    context: &Context,
    result: &Solution,
    unit: LengthUnit,
) -> Result<(), Failure> {
    let mut report = new("Asymptotic patches");
    report.length_unit = unit.to_string();
    let named = surfaces(result)?;
    let all: Vec<_> = named.iter().map(|s| &s.surface).collect();
    let curve = |c: &BezierCurve| c.polyline(SEGMENTS);
    let lines = result.result.boundary.curves.iter().map(curve).collect();
    let mut curves = LineSet::new("curves", "asymptotic curves", LineRole::Curves, lines);
    curves.visible = true;
    let view = spline_view(STAGE, &all, None, &report.length_unit)?;
    report.stages.push(view.with_lines(curves).map_err(Failure::other)?);
    report.histograms.extend(kinks(result));
    if !result.check.joins.is_empty() {
        report.seams = Some(worst_joins(result, &unit));
    }
    add_files(outcome, args, context, report)
}

/// The joins with the largest jumps of the mean curvature.
fn worst_joins(result: &Solution, unit: &LengthUnit) -> SeamTable {
    let joins = &result.check.joins;
    let mut order: Vec<usize> = (0..joins.len()).collect();
    order.sort_by(|&a, &b| joins[b].mean_jump.total_cmp(&joins[a].mean_jump));
    let rows = order.into_iter().take(WORST).map(|k| {
        let join = &joins[k];
        let curve = &result.result.boundary.curves[join.curve];
        let [a, b] = result.net.curves()[join.curve].ends;
        Seam {
            label: format!("curve {} from vertex {a} to {b}", join.curve),
            stage: STAGE.to_owned(),
            location: curve.position(0.5),
            size: 2.0 * curve.position(0.0).distance(curve.position(1.0)),
            path: curve.polyline(SEGMENTS),
            values: vec![join.mean_jump, join.gaussian_jump, join.kink.to_degrees()],
        }
    });
    SeamTable {
        title: "Joins with the largest jumps of the mean curvature".to_owned(),
        columns: vec![
            format!("jump of H [1/{unit}]"),
            format!("jump of K [1/{unit}\u{b2}]"),
            "kink [\u{b0}]".to_owned(),
        ],
        tolerances: vec![None; 3],
        rows: rows.collect(),
    }
}

/// Kinks and jumps of the mean curvature across the shared curves.
fn kinks(result: &Solution) -> Vec<report::Histogram> {
    let joins = &result.check.joins;
    if joins.is_empty() {
        return Vec::new();
    }
    let histogram =
        |id: &str, title: &str, quantity: &str, unit: &str, values: Vec<f64>| report::Histogram {
            id: id.into(),
            title: title.into(),
            quantity: quantity.into(),
            unit: unit.into(),
            series: vec![report::Series { name: "shared curves".into(), values }],
            tolerance: None,
        };
    let kinks = joins.iter().map(|j| j.kink.to_degrees()).collect();
    let jumps = joins.iter().map(|j| j.mean_jump).collect();
    vec![
        histogram("kinks", "Kinks across shared curves", "angle of the normals", "\u{b0}", kinks),
        histogram("mean-jumps", "Jumps of the mean curvature", "jump of H", "", jumps),
    ]
}
