//! `umbilic analyze INPUT`.

use crate::args::ReportArgs;
use crate::commands::analyze_list::Listing;
use crate::commands::fair::{samples_of, view};
use crate::context::Context;
use crate::failure::Failure;
use crate::input_file::{self, PartArgs, SurfaceArgs};
use crate::outcome::{Outcome, Status};
use crate::report_support;
use curvature_variation::{Rings, SurfaceAnalysis, fitted_torus};
use exchange::{Mesh, Model, NamedSurface};
use geom_core::{
    CurvatureStatistics, DVec3, Normalization, PolyMesh, ValueRange, mesh_curvature_statistics,
};
use gp_solver::OptionValue;
use serde::Serialize;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use subdiv_catmull_clark::{Blend, SubdivisionSurface};

/// Surfaces, and meshes, that the summary names one by one.
const MOST_LINES: usize = 12;

/// Arguments of `analyze`.
#[derive(Debug, clap::Args)]
#[command(after_help = "\
Examples:
  umbilic analyze fixtures/roof.ron --metrics roof.json
  umbilic analyze fixtures/step/bracket.step --list
  umbilic analyze fixtures/step/bracket.step --surface 1 --surface 2
  umbilic analyze fixtures/quads/clifford.obj --discrete-bending
A mesh of quads is read as the control mesh of its Catmull-Clark surface.")]
pub(crate) struct Analyze {
    /// File with surfaces or meshes; surfaces are preferred if it has both
    input: PathBuf,
    #[command(flatten)]
    surface: SurfaceArgs,
    #[command(flatten)]
    part: PartArgs,
    /// Show a table of the surfaces and meshes in the file and measure no more
    #[arg(long, conflicts_with_all = ["discrete_bending", "report", "figures"])]
    list: bool,
    /// Also the edge-based bending energy of the faces themselves, to compare with the surface's
    #[arg(long)]
    discrete_bending: bool,
    /// Rings of patches the smooth blends at extraordinary vertices cover, as in fair
    /// [default: auto]
    #[arg(long, value_name = "N|auto")]
    #[arg(value_parser = Rings::read)]
    blend_rings: Option<Rings>,
    #[command(flatten)]
    report: ReportArgs,
}

impl Analyze {
    pub(crate) fn run(self, context: &Context) -> Result<Outcome, Failure> {
        self.report.check()?;
        let model = input_file::read(context, &self.input, &self.surface, &self.part)?;
        if self.list {
            let listing = Listing::new(&model);
            let outcome = Outcome::new(Status::Converged, 0).with_input(&self.input);
            let mut outcome = outcome.with_metrics(&listing)?;
            outcome.summary = listing.lines(&model.unit.to_string());
            outcome.warnings.clone_from(&model.warnings);
            return Ok(outcome);
        }
        let rings = self.blend_rings.and_then(Rings::count);
        // Near the origin nothing is lost to rounding.
        let (centred, center) = centred(&model);
        let Measured { kind, statistics, subdivision, limit, warnings } =
            measure(&self.input, &centred, rings)?;
        let statistics = statistics.moved(center);
        let mut metrics = AnalyzeMetrics::new(kind, &statistics);
        metrics.subdivision = subdivision;
        if self.discrete_bending {
            metrics.discrete_bending = Some(discrete_energy(&self.input, &model)?);
        }
        let mut outcome =
            Outcome::new(Status::Converged, 0).with_input(&self.input).with_metrics(&metrics)?;
        outcome.summary = summary(&self.input, &model, kind, &statistics);
        outcome.summary.extend(energy_lines(&metrics));
        outcome.warnings.clone_from(&model.warnings);
        outcome.warnings.extend(warnings);
        outcome.warnings.extend(creases(&model));
        if statistics.singular > 0 {
            outcome.warnings.push(format!(
                "{} of {} points are singular and have no curvature; they stand for {:.2} % of the area",
                statistics.singular,
                statistics.singular + statistics.samples,
                100.0 * statistics.singular_area / statistics.area.max(f64::MIN_POSITIVE)
            ));
        }
        if self.report.wanted() {
            let mut report = report_support::new("Curvature analysis");
            match limit {
                Some((mut mesh, surface)) => {
                    mesh.positions_mut().iter_mut().for_each(|p| *p += center);
                    report.length_unit = model.unit.to_string();
                    let samples = samples_of(&mesh, &surface);
                    report.stages.push(view("limit surface", &samples, &report.length_unit)?);
                }
                None => report_support::add_model(&mut report, &measured_only(model))?,
            }
            report_support::add_files(&mut outcome, &self.report, context, report)?;
        }
        Ok(outcome)
    }
}

/// A model moved to the origin, and by what it has been moved away from. One that has no place of
/// its own stays.
fn centred(model: &Model) -> (Model, DVec3) {
    let mut model = model.clone();
    let mut points: Vec<DVec3> = Vec::new();
    for named in &model.surfaces {
        points.extend(named.surface.control_points());
    }
    model.meshes.iter().for_each(|mesh| points.extend(&mesh.positions));
    model.grids.iter().for_each(|grid| points.extend(&grid.points));
    let Ok(place) = Normalization::of(&points) else { return (model, DVec3::ZERO) };
    let by = -place.center();
    for named in &mut model.surfaces {
        named.surface = named.surface.translated(by);
        named.trim = named.trim.as_ref().map(|trim| {
            trim.with_mapped_edges(|p| p + by).unwrap_or_else(|_| trim.without_edges())
        });
    }
    model.meshes.iter_mut().flat_map(|mesh| &mut mesh.positions).for_each(|p| *p += by);
    model.grids.iter_mut().flat_map(|grid| &mut grid.points).for_each(|p| *p += by);
    (model, place.center())
}

/// What an input is and what it measures.
struct Measured {
    kind: &'static str,
    statistics: CurvatureStatistics,
    subdivision: Option<SubdivisionMetrics>,
    /// The subdivision surface with its control mesh, as the model that was measured stands.
    limit: Option<(PolyMesh, SubdivisionSurface)>,
    warnings: Vec<String>,
}

/// The creases inside of the surfaces, in words.
fn creases(model: &Model) -> Vec<String> {
    let of = |named: &NamedSurface| {
        let name = if named.name.is_empty() { "surface" } else { &named.name };
        let found = named.surface.creases(named.trim.as_ref());
        let split = "split it there before a method that needs smoothness";
        found.iter().map(|c| format!("{name} has {c}; {split}")).collect::<Vec<_>>()
    };
    model.surfaces.iter().flat_map(of).collect()
}

/// The model without curvatures its file may hold: the page shows those that were measured.
fn measured_only(mut model: Model) -> Model {
    let curvatures = ["H", "K", "k1", "k2", "K1", "K2"];
    for mesh in &mut model.meshes {
        mesh.vertex_fields.retain(|field| !curvatures.contains(&field.name.as_str()));
    }
    model
}

fn measure(path: &Path, model: &Model, rings: Option<usize>) -> Result<Measured, Failure> {
    let mut statistics = CurvatureStatistics::default();
    let (mut subdivision, mut warnings) = (None, Vec::new());
    if !model.surfaces.is_empty() {
        for named in &model.surfaces {
            statistics.merge(&named.curvature_statistics());
        }
        let rational = model.surfaces.iter().any(|named| named.surface.is_rational());
        let kind = if rational { "rational_bspline_surface" } else { "bspline_surface" };
        return Ok(Measured { kind, statistics, subdivision, limit: None, warnings });
    }
    let with_faces: Vec<&Mesh> = model.meshes.iter().filter(|m| !m.faces.is_empty()).collect();
    let corners = |n: usize| with_faces.iter().all(|m| m.faces.iter().all(|f| f.len() == n));
    if let [mesh] = with_faces[..]
        && corners(4)
    {
        let creases = input_file::creases(path, mesh, &mut warnings)?;
        let mesh = mesh.to_poly_mesh().map_err(|e| Failure::input(path, e))?;
        match curvature_variation::analyze(&mesh, &creases, Blend::Smooth, rings) {
            Ok(found) => {
                subdivision = Some(SubdivisionMetrics::new(&found));
                let statistics = found.statistics;
                let kind = "subdivision_surface";
                let limit = Some((found.mesh, found.surface));
                return Ok(Measured { kind, statistics, subdivision, limit, warnings });
            }
            Err(error) => warnings.push(format!(
                "the mesh has no Catmull-Clark surface to measure, so its vertices are: {error}"
            )),
        }
    }
    let points = model.grids.iter().flat_map(|grid| &grid.points);
    points
        .chain(model.meshes.iter().flat_map(|mesh| &mesh.positions))
        .for_each(|p| statistics.add_point(*p));
    for mesh in &with_faces {
        let mesh = mesh.to_poly_mesh().map_err(|e| Failure::input(path, e))?;
        statistics.merge(&mesh_curvature_statistics(&mesh));
    }
    let has_lines = model.meshes.iter().any(|m| !m.lines.is_empty());
    let kind = match with_faces.as_slice() {
        [] if has_lines => "polylines",
        [] if !model.grids.is_empty() => "point_grid",
        [] => "points",
        _ if corners(4) => "quad_mesh",
        _ if corners(3) => "triangle_mesh",
        _ => "polygon_mesh",
    };
    Ok(Measured { kind, statistics, subdivision, limit: None, warnings })
}

fn discrete_energy(path: &Path, model: &Model) -> Result<f64, Failure> {
    let mut meshes = model.meshes.iter().filter(|m| !m.faces.is_empty()).peekable();
    if !model.surfaces.is_empty() || meshes.peek().is_none() {
        return Err(Failure::input(path, "--discrete-bending needs a mesh; this file has none"));
    }
    let energy = |m: &Mesh| m.to_poly_mesh().map(|m| curvature_variation::discrete_bending(&m));
    let energies = meshes.map(energy).collect::<Result<Vec<f64>, _>>();
    Ok(energies.map_err(|e| Failure::input(path, e))?.iter().sum())
}

/// What a subdivision surface measures beyond its curvatures.
#[derive(Serialize)]
struct SubdivisionMetrics {
    energies: BTreeMap<&'static str, f64>,
    quadrature_gap: f64,
    gauss_bonnet_residual: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    torus_ratio: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    torus_fit_rms: Option<f64>,
    patches: usize,
    #[serde(skip_serializing_if = "Option::is_none")]
    blend_rings: Option<[usize; 2]>,
}

impl SubdivisionMetrics {
    fn new(found: &SurfaceAnalysis) -> Self {
        let torus = fitted_torus(&found.mesh, &found.surface);
        Self {
            energies: found.energies.by_name(),
            quadrature_gap: found.quadrature_gap,
            gauss_bonnet_residual: found.gauss_bonnet_residual,
            torus_ratio: torus.map(|(torus, _)| torus.ratio()),
            torus_fit_rms: torus.map(|(_, rms)| rms),
            patches: found.mesh.face_count(),
            blend_rings: found.surface.blend_rings(),
        }
    }
}

fn energy_lines(metrics: &AnalyzeMetrics) -> Vec<String> {
    let mut lines = Vec::new();
    if let Some(subdivision) = &metrics.subdivision {
        let value = |name: &str| subdivision.energies[name];
        lines.push(format!(
            "  bending {:.4}, Willmore {:.4}, SI-Mehlum-Tarrou {:.4}, SI-MVScross {:.4}, SI-MVS {:.4}",
            value("bending"),
            value("willmore"),
            value("mehlum_tarrou"),
            value("mvs_cross"),
            value("mvs")
        ));
        let mut checks = format!("  quadrature gap {:.1e}", subdivision.quadrature_gap);
        if let Some(residual) = subdivision.gauss_bonnet_residual {
            checks += &format!(", Gauss-Bonnet residual {residual:.1e}");
        }
        lines.push(checks);
        if let (Some(ratio), Some(rms)) = (subdivision.torus_ratio, subdivision.torus_fit_rms) {
            lines
                .push(format!("  nearest torus has radius ratio {ratio:.4}, off by {rms:.1e} rms"));
        }
    }
    if let Some(energy) = metrics.discrete_bending {
        lines.push(format!("  discrete bending of the faces {energy:.4}"));
    }
    lines
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
    mean_curvature_p01: Option<f64>,
    mean_curvature_p99: Option<f64>,
    gaussian_curvature_p01: Option<f64>,
    gaussian_curvature_p99: Option<f64>,
    principal_curvature_p01: Option<f64>,
    principal_curvature_p99: Option<f64>,
    mean_curvature_min_at: Option<[f64; 3]>,
    mean_curvature_max_at: Option<[f64; 3]>,
    gaussian_curvature_min_at: Option<[f64; 3]>,
    gaussian_curvature_max_at: Option<[f64; 3]>,
    singular_points: usize,
    singular_area: f64,
    #[serde(flatten)]
    subdivision: Option<SubdivisionMetrics>,
    #[serde(skip_serializing_if = "Option::is_none")]
    discrete_bending: Option<f64>,
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
            mean_curvature_p01: mean.map(|r| r.low),
            mean_curvature_p99: mean.map(|r| r.high),
            gaussian_curvature_p01: gaussian.map(|r| r.low),
            gaussian_curvature_p99: gaussian.map(|r| r.high),
            principal_curvature_p01: principal.map(|r| r.low),
            principal_curvature_p99: principal.map(|r| r.high),
            mean_curvature_min_at: mean.map(|r| r.min_at.to_array()),
            mean_curvature_max_at: mean.map(|r| r.max_at.to_array()),
            gaussian_curvature_min_at: gaussian.map(|r| r.min_at.to_array()),
            gaussian_curvature_max_at: gaussian.map(|r| r.max_at.to_array()),
            singular_points: statistics.singular,
            singular_area: statistics.singular_area,
            subdivision: None,
            discrete_bending: None,
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
    for named in model.surfaces.iter().take(MOST_LINES) {
        let s = &named.surface;
        let name = if named.name.is_empty() { "surface" } else { &named.name };
        let (d_u, d_v, n_u, n_v) = (s.degree_u(), s.degree_v(), s.n_u(), s.n_v());
        let trimmed = if named.trim.is_some() { ", trimmed" } else { "" };
        lines
            .push(format!("  {name}: degree {d_u} x {d_v}, {n_u} x {n_v} control points{trimmed}"));
    }
    let more = |n: usize, what: &str| {
        n.checked_sub(MOST_LINES + 1).map(|n| format!("  and {} more {what}; see --list", n + 1))
    };
    lines.extend(more(model.surfaces.len(), "surfaces"));
    for mesh in model.meshes.iter().take(MOST_LINES) {
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
    lines.extend(more(model.meshes.len(), "meshes"));
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
            lines.push(format!(
                "    on 98 % of the area {} to {}; least near {}, largest near {}",
                number(r.low),
                number(r.high),
                place(r.min_at),
                place(r.max_at)
            ));
        }
    };
    row("mean curvature     ", statistics.mean_curvature(), "");
    row("Gaussian curvature ", statistics.gaussian_curvature(), "²");
    row("principal curvature", statistics.principal_curvature(), "");
    lines
}

fn place(p: DVec3) -> String {
    format!("({:.4}, {:.4}, {:.4})", p.x, p.y, p.z)
}

/// Six decimals, or powers of ten beside a pole.
fn number(x: f64) -> String {
    if x.abs() < 1e6 { format!("{x:.6}") } else { format!("{x:.5e}") }
}
