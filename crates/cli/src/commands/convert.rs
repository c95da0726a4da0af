//! `umbilic convert IN OUT`.

use crate::args::{ReportArgs, check_output_path};
use crate::context::Context;
use crate::failure::Failure;
use crate::input_file::{self, PartArgs, SurfaceArgs};
use crate::outcome::{Outcome, Status};
use crate::report_support;
use curvature_variation::limit_patches;
use exchange::{LengthUnit, Mesh, Model, NamedSurface};
use geom_core::diagonal_meshes;
use serde::Serialize;
use std::path::{Path, PathBuf};

/// Arguments of `convert`.
#[derive(Debug, clap::Args)]
#[command(after_help = "\
Examples:
  umbilic convert fixtures/roof.ron roof.step
  umbilic convert fixtures/quads/cube.obj cube.step
  umbilic convert fixtures/step/assembly.step part.obj --surface 1 --surface 2 --unit mm")]
pub(crate) struct Convert {
    /// File to read
    input: PathBuf,
    /// File to write; the extension chooses the format
    output: PathBuf,
    #[command(flatten)]
    surface: SurfaceArgs,
    #[command(flatten)]
    part: PartArgs,
    /// Write all lengths in this unit: mm, cm, dm, m, km, in, ft, yd or mi
    #[arg(long, value_name = "U", value_parser = unit)]
    unit: Option<LengthUnit>,
    /// For control meshes to STEP: how far the surfaces may be off the Catmull-Clark limit, as a
    /// share of an edge
    #[arg(long, value_name = "SHARE", default_value_t = 1e-4)]
    tolerance: f64,
    /// Write a mesh of the diagonals of the quads in place of each mesh: 1 or 2 says which of the two
    #[arg(long, value_name = "1|2", value_parser = clap::value_parser!(u8).range(1..=2))]
    diagonals: Option<u8>,
    #[command(flatten)]
    report: ReportArgs,
}

fn unit(symbol: &str) -> Result<LengthUnit, String> {
    let known = "use mm, cm, dm, m, km, in, ft, yd or mi";
    LengthUnit::from_symbol(symbol).ok_or_else(|| format!("not a unit of length; {known}"))
}

impl Convert {
    pub(crate) fn run(self, context: &Context) -> Result<Outcome, Failure> {
        exchange::check_format(&self.output).map_err(|e| Failure::input(&self.output, e))?;
        check_output_path(&self.output)?;
        self.report.check()?;
        let mut model = input_file::read(context, &self.input, &self.surface, &self.part)?;
        if let Some(unit) = self.unit.clone() {
            model = model.in_unit(unit).map_err(|e| Failure::input(&self.input, e))?;
        }
        if let Some(which) = self.diagonals {
            for mesh in model.meshes.iter_mut().filter(|mesh| !mesh.faces.is_empty()) {
                let refused = |e: &dyn std::fmt::Display| Failure::input(&self.input, e);
                let quads = mesh.to_poly_mesh().map_err(|e| refused(&e))?;
                let [one, two] = diagonal_meshes(&quads).map_err(|e| refused(&e))?;
                *mesh = Mesh::from_poly_mesh(if which == 1 { &one } else { &two });
            }
        }
        let told = self.take_limit_surfaces(&mut model)?;
        let mut outcome = Outcome::new(Status::Converged, 0)
            .with_input(&self.input)
            .with_metrics(&ConvertMetrics::new(&model))?;
        outcome.warnings.clone_from(&model.warnings);
        outcome.add_model(self.output.clone(), &model)?;
        outcome.summary = summary(&self.output, &model, outcome.files[0].1.len());
        outcome.summary.extend(told);
        if self.report.wanted() {
            let mut report = report_support::new("Content of a file");
            report_support::add_model(&mut report, &model)?;
            report_support::add_files(&mut outcome, &self.report, context, report)?;
        }
        Ok(outcome)
    }
}

impl Convert {
    /// Control meshes that go into a STEP file become their limit surfaces; what is to be said of
    /// them. Triangles alone are left: they are seldom meant as a control mesh.
    fn take_limit_surfaces(&self, model: &mut Model) -> Result<Option<String>, Failure> {
        let is_step = matches!(exchange::extension_of(&self.output).as_str(), "step" | "stp");
        let polygons = |mesh: &Mesh| mesh.faces.iter().any(|f| f.len() > 3);
        if !is_step || !model.surfaces.is_empty() || !model.meshes.iter().any(polygons) {
            return Ok(None);
        }
        let (mut caps, mut fitted, mut deviation) = (0, 0, 0.0_f64);
        for mesh in std::mem::take(&mut model.meshes) {
            if mesh.faces.is_empty() {
                model.warnings.push("polylines and points are left out of the STEP file".into());
                continue;
            }
            let control = mesh.to_poly_mesh().map_err(|e| Failure::input(&self.input, e))?;
            let creases = input_file::creases(&self.input, &mesh, &mut model.warnings)?;
            let patches = limit_patches(&control, &creases, self.tolerance)
                .map_err(|e| Failure::input(&self.input, e))?;
            caps += patches.caps;
            fitted += patches.fitted;
            deviation = deviation.max(patches.max_deviation);
            let named = patches.surfaces.into_iter().map(|s| NamedSurface::new(&*mesh.name, s));
            model.surfaces.extend(named);
        }
        let exact = model.surfaces.len() - caps - fitted;
        Ok(Some(format!(
            "  Catmull-Clark limit: {exact} exact surfaces, {caps} caps at extraordinary vertices, \
             {fitted} fitted ones, at most {deviation:.1e} {} off",
            model.unit
        )))
    }
}

/// What was written, in two lines.
fn summary(path: &Path, model: &Model, bytes: usize) -> Vec<String> {
    let sum = |of: fn(&Mesh) -> usize| model.meshes.iter().map(of).sum::<usize>();
    let trimmed = model.surfaces.iter().filter(|s| s.trim.is_some()).count();
    let counts = [
        (model.surfaces.len(), "surface", "surfaces"),
        (trimmed, "of them trimmed", "of them trimmed"),
        (model.grids.len(), "point grid", "point grids"),
        (model.meshes.len(), "mesh", "meshes"),
        (sum(|m| m.positions.len()), "vertex", "vertices"),
        (sum(|m| m.faces.len()), "face", "faces"),
        (sum(|m| m.lines.len()), "polyline", "polylines"),
    ];
    let counts = counts.iter().filter(|(n, ..)| *n > 0);
    let counts = counts.map(|(n, one, more)| format!("{n} {}", if *n == 1 { one } else { more }));
    let size = match bytes {
        0..10_000 => format!("{bytes} bytes"),
        10_000..10_000_000 => format!("{} kB", bytes / 1000),
        _ => format!("{} MB", bytes / 1_000_000),
    };
    vec![
        format!("{}: {}", path.display(), counts.collect::<Vec<_>>().join(", ")),
        format!("  lengths in {}, {size}", model.unit),
    ]
}
/// The `metrics` object: what is written, and the mean of its control points if it has surfaces,
/// else of its vertices.
#[derive(Serialize)]
struct ConvertMetrics {
    surfaces: usize,
    control_points: usize,
    vertices: usize,
    faces: usize,
    #[serde(skip_serializing_if = "Option::is_none")]
    centroid: Option<[f64; 3]>,
}

impl ConvertMetrics {
    fn new(model: &Model) -> Self {
        Self {
            surfaces: model.surfaces.len(),
            control_points: model.surfaces.iter().map(|s| s.surface.control_points().len()).sum(),
            vertices: model.meshes.iter().map(|m| m.positions.len()).sum(),
            faces: model.meshes.iter().map(|m| m.faces.len()).sum(),
            centroid: model.centroid().map(|c| c.to_array()),
        }
    }
}
