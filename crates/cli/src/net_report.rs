//! The report of the commands on nets.

use crate::failure::Failure;
use crate::net_files::PICTURE_CELLS;
use crate::report_support;
use exchange::LengthUnit;
use geom_core::DVec3;
use gp_solver::RunReport;
use hyperbolic_nets::{HyperbolicNet, POLISH, PatchJet, SampledPatches};
use report::{
    EnergyHistory, Histogram, LineRole, LineSet, Report, ScalarField, Seam, SeamTable, Series,
    SurfaceView,
};
use std::path::Path;

/// A page about this input; status, metrics and warnings come with the files.
pub(crate) fn page(title: &str, input: &Path, unit: &LengthUnit) -> Report {
    let mut page = report_support::new(title);
    page.length_unit = unit.to_string();
    page.option("input", input.display());
    page
}

/// The smooth surface with its curvatures, panel edges, kinks and worst seams.
pub(crate) fn add_net(
    page: &mut Report,
    surface: &HyperbolicNet,
    unit: &str,
) -> Result<(), Failure> {
    let sampled =
        SampledPatches::new(surface, PICTURE_CELLS, PatchJet::sample).map_err(Failure::other)?;
    let stage = "hyperbolic net";
    let edges: Vec<Vec<DVec3>> = surface
        .net()
        .edges()
        .iter()
        .map(|e| e.ends.map(|v| surface.net().positions()[v]).to_vec())
        .collect();
    let mut view = view(stage, &sampled, unit)?;
    let per_patch = (PICTURE_CELLS + 1) * (PICTURE_CELLS + 1);
    let shape =
        surface.shape().iter().flat_map(|&w| std::iter::repeat_n(w, per_patch)).collect::<Vec<_>>();
    view = view
        .with_field(ScalarField::magnitude("shape", "shape parameter W", "", shape))
        .map_err(Failure::other)?;
    let mut lines = LineSet::new("panels", "panel edges", LineRole::Curves, edges);
    lines.visible = true;
    page.stages.push(view.with_lines(lines).map_err(Failure::other)?);
    let kinks: Vec<f64> = surface.kinks().iter().map(|k| k.to_degrees()).collect();
    page.seams = Some(worst_seams(stage, surface, &kinks));
    page.histograms.push(Histogram {
        id: "kinks".into(),
        title: "Kinks between patches".into(),
        quantity: "kink".into(),
        unit: "°".into(),
        series: vec![Series { name: "all inner edges".into(), values: kinks }],
        tolerance: None,
    });
    page.histograms.push(Histogram {
        id: "shape".into(),
        title: "Shape parameters".into(),
        quantity: "W".into(),
        unit: String::new(),
        series: vec![Series { name: "panels".into(), values: surface.shape().to_vec() }],
        tolerance: None,
    });
    Ok(())
}

/// A stage with exact normals and curvatures.
pub(crate) fn view(
    name: &str,
    sampled: &SampledPatches,
    unit: &str,
) -> Result<SurfaceView, Failure> {
    let triangles =
        sampled.quads().into_iter().flat_map(|[a, b, c, d]| [[a, b, c], [a, c, d]]).collect();
    let take =
        |f: fn(&hyperbolic_nets::SurfaceSample) -> f64| sampled.samples.iter().map(f).collect();
    SurfaceView::new(
        name,
        sampled.samples.iter().map(|s| s.point).collect(),
        sampled.samples.iter().map(|s| s.normal).collect(),
        triangles,
    )
    .and_then(|v| v.with_field(ScalarField::mean_curvature(take(|s| s.mean_curvature), unit)))
    .and_then(|v| {
        v.with_field(ScalarField::gaussian_curvature(take(|s| s.gaussian_curvature), unit))
    })
    .map_err(Failure::other)
}

fn worst_seams(stage: &str, surface: &HyperbolicNet, kinks: &[f64]) -> SeamTable {
    let edges = surface.net().inner_edges();
    let mut order: Vec<usize> = (0..edges.len()).collect();
    order.sort_by(|&a, &b| kinks[b].total_cmp(&kinks[a]));
    let row = |&k: &usize| {
        let path = [edges[k].b[0], edges[k].b[3]].map(|v| surface.net().positions()[v]);
        Seam {
            label: format!("panels {}–{}", edges[k].faces[0], edges[k].faces[1]),
            stage: stage.to_owned(),
            location: path[0].midpoint(path[1]),
            size: path[0].distance(path[1]),
            path: path.to_vec(),
            values: vec![kinks[k]],
        }
    };
    SeamTable {
        columns: vec!["kink (°)".into()],
        tolerances: vec![None],
        rows: order.iter().take(20).map(row).collect(),
        ..SeamTable::default()
    }
}

/// Energies of the terms before every step; polishing has equations and no terms.
pub(crate) fn add_energies(page: &mut Report, report: &RunReport) {
    let mut history = EnergyHistory::default();
    let mut steps = 0;
    for stage in report.stages.iter().filter(|s| s.stage.name != POLISH) {
        history.marks.push((steps, stage.stage.name.clone()));
        // A Gauss-Newton step's record has the terms it began with.
        for record in stage.solver.history.iter().skip(1) {
            for (term, &energy) in stage.solver.terms.iter().zip(&record.terms) {
                match history.terms.iter_mut().find(|s| s.name == term.name) {
                    Some(series) => series.values.push(energy),
                    None => {
                        // A term that joins later has no value before.
                        let mut values = vec![f64::NAN; steps];
                        values.push(energy);
                        history.terms.push(Series { name: term.name.clone(), values });
                    }
                }
            }
            steps += 1;
        }
    }
    if !history.terms.is_empty() {
        page.energies = Some(history);
    }
}
