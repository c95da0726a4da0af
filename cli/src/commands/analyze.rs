//! `umbilic analyze INPUT`.

use crate::args::ReportArgs;
use crate::context::Context;
use crate::failure::Failure;
use crate::outcome::{Outcome, Status};
use crate::report_support;
use exchange::{Mesh, Model};
use geom_core::{CurvatureStatistics, ValueRange, mesh_curvature_statistics};
use serde::Serialize;
use std::path::{Path, PathBuf};

/// Arguments of `analyze`.
#[derive(Debug, clap::Args)]
#[command(after_help = "Example: umbilic analyze fixtures/roof.ron --metrics roof.json")]
pub(crate) struct Analyze {
    /// File with surfaces or meshes; surfaces are preferred if it has both
    input: PathBuf,
    #[command(flatten)]
    report: ReportArgs,
}

impl Analyze {
    pub(crate) fn run(self, context: &Context) -> Result<Outcome, Failure> {
        self.report.check()?;
        let model =
            exchange::read_model(&self.input).map_err(|e| Failure::input(&self.input, e))?;
        let (kind, statistics) = measure(&self.input, &model)?;
        let mut outcome = Outcome::new(Status::Converged, 0)
            .with_input(&self.input)
            .with_metrics(&AnalyzeMetrics::new(kind, &statistics))?;
        outcome.summary = summary(&self.input, &model, kind, &statistics);
        outcome.warnings.clone_from(&model.warnings);
        if statistics.singular > 0 {
            outcome.warnings.push(format!(
                "{} of {} points are singular and have no curvature",
                statistics.singular,
                statistics.singular + statistics.samples
            ));
        }
        if self.report.wanted() {
            let mut report = report_support::new("Curvature analysis");
            report_support::add_model(&mut report, &model)?;
            report_support::add_files(&mut outcome, &self.report, context, report)?;
        }
        Ok(outcome)
    }
}

fn measure(path: &Path, model: &Model) -> Result<(&'static str, CurvatureStatistics), Failure> {
    let mut all = CurvatureStatistics::default();
    if !model.surfaces.is_empty() {
        for named in &model.surfaces {
            all.merge(&named.surface.curvature_statistics());
        }
        let rational = model.surfaces.iter().any(|named| named.surface.is_rational());
        return Ok((if rational { "rational_bspline_surface" } else { "bspline_surface" }, all));
    }
    let points = model.grids.iter().flat_map(|grid| &grid.points);
    points
        .chain(model.meshes.iter().flat_map(|mesh| &mesh.positions))
        .for_each(|p| all.add_point(*p));
    let with_faces: Vec<&Mesh> = model.meshes.iter().filter(|m| !m.faces.is_empty()).collect();
    for mesh in &with_faces {
        let mesh = mesh.to_poly_mesh().map_err(|e| Failure::input(path, e))?;
        all.merge(&mesh_curvature_statistics(&mesh));
    }
    let corners = |n: usize| with_faces.iter().all(|m| m.faces.iter().all(|f| f.len() == n));
    let has_lines = model.meshes.iter().any(|m| !m.lines.is_empty());
    let kind = match with_faces.as_slice() {
        [] if has_lines => "polylines",
        [] if !model.grids.is_empty() => "point_grid",
        [] => "points",
        _ if corners(4) => "quad_mesh",
        _ if corners(3) => "triangle_mesh",
        _ => "polygon_mesh",
    };
    Ok((kind, all))
}

/// The `metrics` object; curvatures are null where there is no surface.
#[derive(Serialize)]
struct AnalyzeMetrics {
    kind: &'static str,
    area: f64,
    bounding_box: Option<[[f64; 3]; 2]>,
    mean_curvature_min: Option<f64>,
    mean_curvature_max: Option<f64>,
    mean_curvature_mean_abs: Option<f64>,
    gaussian_curvature_min: Option<f64>,
    gaussian_curvature_max: Option<f64>,
    gaussian_curvature_mean_abs: Option<f64>,
    principal_curvature_min: Option<f64>,
    principal_curvature_max: Option<f64>,
    principal_curvature_mean_abs: Option<f64>,
    singular_points: usize,
}

impl AnalyzeMetrics {
    fn new(kind: &'static str, statistics: &CurvatureStatistics) -> Self {
        let (mean, gaussian, principal) = (
            statistics.mean_curvature(),
            statistics.gaussian_curvature(),
            statistics.principal_curvature(),
        );
        Self {
            kind,
            area: statistics.area,
            bounding_box: statistics.bounding_box.map(|b| [b.min.to_array(), b.max.to_array()]),
            mean_curvature_min: mean.map(|r| r.min),
            mean_curvature_max: mean.map(|r| r.max),
            mean_curvature_mean_abs: mean.map(|r| r.mean_abs),
            gaussian_curvature_min: gaussian.map(|r| r.min),
            gaussian_curvature_max: gaussian.map(|r| r.max),
            gaussian_curvature_mean_abs: gaussian.map(|r| r.mean_abs),
            principal_curvature_min: principal.map(|r| r.min),
            principal_curvature_max: principal.map(|r| r.max),
            principal_curvature_mean_abs: principal.map(|r| r.mean_abs),
            singular_points: statistics.singular,
        }
    }
}

fn summary(
    path: &Path,
    model: &Model,
    kind: &str,
    statistics: &CurvatureStatistics,
) -> Vec<String> {
    let unit = &model.unit;
    let mut lines = vec![format!("{}: {}", path.display(), kind.replace('_', " "))];
    for named in &model.surfaces {
        let s = &named.surface;
        let name = if named.name.is_empty() { "surface" } else { &named.name };
        let (d_u, d_v, n_u, n_v) = (s.degree_u(), s.degree_v(), s.n_u(), s.n_v());
        lines.push(format!("  {name}: degree {d_u} x {d_v}, {n_u} x {n_v} control points"));
    }
    for mesh in &model.meshes {
        let counts = [
            (mesh.positions.len(), "vertices"),
            (mesh.faces.len(), "faces"),
            (mesh.lines.len(), "polylines"),
            (mesh.groups.len(), "groups"),
        ];
        let counts = counts.iter().filter(|(n, _)| *n > 0).map(|(n, what)| format!("{n} {what}"));
        let name = if mesh.name.is_empty() { "mesh" } else { &mesh.name };
        lines.push(format!("  {name}: {}", counts.collect::<Vec<_>>().join(", ")));
    }
    if let Some(bounds) = statistics.bounding_box {
        let size = bounds.size();
        lines.push(format!("  size {:.6} x {:.6} x {:.6} {unit}", size.x, size.y, size.z));
    }
    if statistics.area > 0.0 {
        lines.push(format!("  area {:.6} {unit}²", statistics.area));
    }
    let mut row = |name: &str, range: Option<ValueRange>, power: &str| {
        if let Some(r) = range {
            lines.push(format!(
                "  {name} from {} to {}, mean size {} 1/{unit}{power}",
                number(r.min),
                number(r.max),
                number(r.mean_abs)
            ));
        }
    };
    row("mean curvature     ", statistics.mean_curvature(), "");
    row("Gaussian curvature ", statistics.gaussian_curvature(), "²");
    row("principal curvature", statistics.principal_curvature(), "");
    lines
}

/// Six decimals, or powers of ten beside a pole.
fn number(x: f64) -> String {
    if x.abs() < 1e6 { format!("{x:.6}") } else { format!("{x:.5e}") }
}
