//! `umbilic fair QUADS -o OUT`.

use crate::args::{ConfigArgs, EndingArgs, OutputArgs, ReportArgs};
use crate::checkpoints::CheckpointArgs;
use crate::context::Context;
use crate::failure::Failure;
use crate::input_file::{self, PartArgs, SurfaceArgs};
use crate::option_flags::{OptionFlags, list, refused};
use crate::outcome::Outcome;
use crate::report_support;
use crate::watch::Watch;
use curvature_variation::{
    Constraints, Error, Functional, Input, Options, Solution, SplinePatches, SurfaceSamples, solve,
    spline_patches,
};
use exchange::{Field, LengthUnit, Mesh, Model, NamedSurface};
use geom_core::{DVec3, UmbilicKind};
use gp_solver::SolverError;
use report::{EnergyHistory, FieldScale, LineRole, LineSet, ScalarField, Series, SurfaceView};
use serde::Deserialize;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use subdiv_catmull_clark::{CreaseList, SubdivisionSurface};

/// Arguments of `fair`.
#[derive(Debug, clap::Args)]
#[command(after_help = "\
Examples:
  umbilic fair fixtures/quads/theta.obj -o fair.obj -o fair.glb --levels 1
  umbilic fair fixtures/quads/theta.obj -o fair.obj --energy \"0.92*bending + 0.08*mehlum_tarrou\"
Functionals: area, mean_curvature, gaussian, bending, willmore, umbilic_deviation, mvs, mvs_cross,
f1, f3, mehlum_tarrou, mehlum_tarrou(w1,w3), cross_curvature, average_derivative, sqrt.")]
pub(crate) struct Fair {
    /// Control mesh of quads or n-gons; the surface is its Catmull-Clark limit
    input: PathBuf,
    #[command(flatten)]
    part: PartArgs,
    #[command(flatten)]
    output: OutputArgs,
    #[command(flatten)]
    options: OptionFlags<Options>,
    #[command(flatten)]
    files: FileArgs,
    #[command(flatten)]
    config: ConfigArgs,
    #[command(flatten)]
    checkpoint: CheckpointArgs,
    #[command(flatten)]
    ending: EndingArgs,
    #[command(flatten)]
    report: ReportArgs,
}

/// Files that say what is to be kept.
#[derive(Debug, clap::Args)]
struct FileArgs {
    /// Fixed vertices, pinned or pulled limit points, pinned tangent planes
    #[arg(long, value_name = "FILE.ron")]
    fix: Option<PathBuf>,
    /// Stay among the blends of the input and this mesh of the same faces; repeatable
    #[arg(long, value_name = "QUADS")]
    family: Vec<PathBuf>,
    /// Semi-sharp and sharp edges, corners, in place of those of an OBJ file
    #[arg(long, value_name = "FILE.ron")]
    creases: Option<PathBuf>,
}

impl Fair {
    pub(crate) fn run(self, context: &Context) -> Result<Outcome, Failure> {
        self.output.check()?;
        self.report.check()?;
        let options = self.options.options(&self.config)?;
        options.check().map_err(|e| self.options.refused(&self.config, e))?;
        let files = &self.files;
        let held = files.fix.is_some() || files.creases.is_some() || options.clamp_boundary;
        if held && !files.family.is_empty() {
            return Err(Failure::usage(
                "--family leaves no vertex to fix; drop --fix, --creases and --clamp-boundary",
            ));
        }
        let mut watch =
            Watch::new(context, "fairing").of(&self.input).with_checkpoints(&self.checkpoint)?;
        let mut model =
            input_file::read(context, &self.input, &SurfaceArgs::default(), &self.part)?;
        let input = self.read(&mut model)?;
        let cost = input.cost(&options).map_err(|e| refused::<Options>(&self.input, e))?;
        context.afford(cost, "levels")?;
        let mut result = solve(&input, &options, &mut watch).map_err(|e| match e {
            Error::Solver(e @ SolverError::ForeignCheckpoint { .. }) => watch.foreign(&e),
            e => self.refused(&e),
        })?;
        result.metrics.peak_memory_mb = peak_memory_mb();
        let mut outcome = Outcome::new(result.report.status, result.report.iterations)
            .with_input(&self.input)
            .with_metrics(&result.metrics)?;
        outcome.summary = summary(&result, &options);
        outcome.warnings.clone_from(&model.warnings);
        outcome.warnings.extend(result.warnings.iter().map(ToString::to_string));
        self.ending.apply(&mut outcome);
        if !watch.finish(&mut outcome) {
            return Ok(outcome);
        }
        let splines = match self.output.output.iter().find(|path| is_spline_file(path)) {
            Some(path) => Some(
                spline_patches(&result.result, &result.surface)
                    .map_err(|e| Failure::input(path, e))?,
            ),
            None => None,
        };
        if let Some(splines) = &splines {
            let before = result.warnings.len();
            result.add_splines(splines);
            outcome = outcome.with_metrics(&result.metrics)?;
            outcome.warnings.extend(result.warnings[before..].iter().map(ToString::to_string));
            outcome.summary.push(spline_summary(splines));
        }
        for path in self.output.output {
            let content = content_for(&path, &result, splines.as_ref(), &model.unit);
            outcome.add_model(path, &content)?;
        }
        if self.report.wanted() {
            let mut page = report_support::new("Fairing of a subdivision surface");
            list(&mut page, &options, &[]);
            fill_report(&mut page, &result, &options, &model.unit)?;
            report_support::add_files(&mut outcome, &self.report, context, page)?;
        }
        Ok(outcome)
    }
}

impl Fair {
    /// What the library says, of the file it speaks of.
    fn refused(&self, error: &Error) -> Failure {
        let constraints = self.files.fix.as_ref();
        let file = match error {
            Error::NoSuchVertex { .. } | Error::Weight { .. } | Error::NothingFree { .. } => {
                constraints
            }
            // Counted from 1.
            Error::OtherFaces { member } => self.files.family.get(member - 1),
            _ => None,
        };
        refused::<Options>(file.unwrap_or(&self.input), error)
    }

    /// The mesh and what the files say of it; a note on them joins the model's warnings.
    fn read(&self, model: &mut Model) -> Result<Input, Failure> {
        let mesh = read_control_mesh(&self.input, model)?;
        let creases = match &self.files.creases {
            None => {
                let mut said = Vec::new();
                let control = input_file::only_mesh(&self.input, model)?;
                let creases = input_file::creases(&self.input, control, &mut said)?;
                model.warnings.append(&mut said);
                creases
            }
            Some(path) => {
                // An edge of sharpness `inf` stays sharp for ever.
                let list: CreaseList =
                    exchange::read_ron_with_infinity(path).map_err(|e| Failure::input(path, e))?;
                model.warnings.extend(list.note().map(|n| format!("{}: {n}", path.display())));
                list.for_mesh(&mesh).map_err(|e| Failure::input(path, e))?
            }
        };
        let constraints = match &self.files.fix {
            Some(path) => exchange::read_ron(path).map_err(|e| Failure::input(path, e))?,
            None => Constraints::default(),
        };
        let symmetries = match self.options.file("symmetry") {
            None => None,
            Some(path) => {
                let declared: SymmetryFile =
                    exchange::read_ron(path).map_err(|e| Failure::input(path, e))?;
                Some(declared.matrices)
            }
        };
        let members = self.files.family.iter().map(|path| read_member(path, &self.part));
        let members = members.collect::<Result<Vec<_>, _>>()?;
        Ok(Input { mesh, creases, constraints, members, symmetries })
    }
}

/// `--symmetry FILE.ron`.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct SymmetryFile {
    /// Rotations and reflections about the mesh's centre, row by row.
    matrices: Vec<[[f64; 3]; 3]>,
}

fn read_control_mesh(path: &Path, model: &Model) -> Result<geom_core::PolyMesh, Failure> {
    let mesh = input_file::only_mesh(path, model)?;
    mesh.to_poly_mesh().map_err(|e| Failure::input(path, e))
}

/// A further mesh of `--family`.
fn read_member(path: &Path, part: &PartArgs) -> Result<geom_core::PolyMesh, Failure> {
    let model = input_file::read_other(path, part)?;
    read_control_mesh(path, &model)
}

/// Peak resident memory of this process, where the system tells.
fn peak_memory_mb() -> Option<f64> {
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    let line = status.lines().find(|line| line.starts_with("VmHWM:"))?;
    let kilobytes: f64 = line.split_whitespace().nth(1)?.parse().ok()?;
    Some(kilobytes / 1024.0)
}

fn summary(result: &Solution, options: &Options) -> Vec<String> {
    let (report, metrics) = (&result.report, &result.metrics);
    let mut lines = vec![format!(
        "{} vertices, {} patches, {} steps",
        metrics.vertices, metrics.patches, report.iterations
    )];
    for (stage, level) in report.stages.iter().zip(&result.levels) {
        let solver = &stage.solver;
        lines.push(format!(
            "  {:6} vertices        {:.4} to {:.4} in {} steps, {} symmetries, {:.2} s",
            level.vertices,
            solver.initial_energy,
            solver.final_energy,
            solver.iterations,
            level.symmetries,
            solver.timings.total.as_secs_f64()
        ));
    }
    lines.push(format!(
        "  {}  {:.4} (before {:.4}), quadrature gap {:.1e}",
        options.energy, metrics.energy_final, metrics.energy_initial, metrics.quadrature_gap
    ));
    if let Some(limit) = result.extrapolated {
        lines.push(format!("  extrapolated to vanishing mesh size {limit:.4}"));
    }
    let value = |f: Functional| result.after.get(f);
    lines.push(format!(
        "  bending {:.4}, Willmore {:.4}, SI-Mehlum-Tarrou {:.4}, SI-F1 {:.4}, SI-F3 {:.4}",
        value(Functional::Bending),
        value(Functional::Willmore),
        value(Functional::MehlumTarrou { w1: 1.0, w3: 1.0 }),
        value(Functional::F1),
        value(Functional::F3)
    ));
    let (mvs, cross) = (value(Functional::Mvs), value(Functional::MvsCross));
    lines.push(format!(
        "  SI-MVS {mvs:.4}, SI-MVScross {cross:.4} (with the half of Joshi 2008, Fig. 8.4: {:.4}, {:.4})",
        0.5 * mvs,
        0.5 * cross
    ));
    if let Some(residual) = metrics.gauss_bonnet_residual {
        lines.push(format!("  Gauss-Bonnet residual {residual:.1e}"));
    }
    if let (Some(ratio), Some(rms)) = (metrics.torus_ratio, metrics.torus_fit_rms) {
        lines.push(format!("  nearest torus has radius ratio {ratio:.4}, off by {rms:.1e} rms"));
    }
    lines
}

/// Whether a file takes spline surfaces.
fn is_spline_file(path: &Path) -> bool {
    matches!(exchange::extension_of(path).as_str(), "step" | "stp" | "3dm" | "ron")
}

fn spline_summary(splines: &SplinePatches) -> String {
    let faces = splines.surfaces.len();
    if splines.fitted == 0 {
        return format!("  {faces} spline patches, all of them exact");
    }
    format!(
        "  {faces} spline patches, {} of them fitted at extraordinary vertices and creases, at most {:.1e} off the surface",
        splines.fitted, splines.max_deviation
    )
}

/// Control mesh, sampled surface or spline patches, as the format asks for.
fn content_for(
    path: &Path,
    result: &Solution,
    splines: Option<&SplinePatches>,
    unit: &LengthUnit,
) -> Model {
    let unit = unit.clone();
    if let Some(splines) = splines.filter(|_| is_spline_file(path)) {
        let named = splines
            .surfaces
            .iter()
            .map(|(face, surface)| NamedSurface::new(format!("patch {}", face.0), surface.clone()));
        return Model { unit, surfaces: named.collect(), ..Model::default() };
    }
    match exchange::extension_of(path).as_str() {
        "glb" | "gltf" => {
            let samples = samples_of(&result.result, &result.surface);
            let mut mesh = Mesh::new(samples.positions, samples.triangles);
            mesh.normals = samples.normals;
            let field = |name: &str, values| Field { name: name.to_owned(), values };
            mesh.vertex_fields = vec![
                field("H", samples.mean_curvature),
                field("K", samples.gaussian_curvature),
                field("K1", samples.k1),
                field("K2", samples.k2),
            ];
            Model::of_mesh(mesh, unit)
        }
        _ => Model::of_mesh(Mesh::from_poly_mesh(&result.result), unit),
    }
}

pub(crate) fn samples_of(
    mesh: &geom_core::PolyMesh,
    surface: &SubdivisionSurface,
) -> SurfaceSamples {
    let side = report_support::jets::JetGrid::side_for(mesh.face_count()).min(12);
    SurfaceSamples::new(mesh, surface, side)
}

fn fill_report(
    page: &mut report::Report,
    result: &Solution,
    options: &Options,
    unit: &LengthUnit,
) -> Result<(), Failure> {
    page.length_unit = unit.to_string();
    page.option("energy", &options.energy);
    page.option("levels", options.levels);
    page.option("iterations per level", options.iterations);
    let before = samples_of(&result.initial, &result.initial_surface);
    page.stages.push(view("before", &before, &page.length_unit)?);
    let samples = samples_of(&result.result, &result.surface);
    page.option("umbilics of the result", umbilics(&samples));
    page.stages.push(view("after", &samples, &page.length_unit)?);
    let mut history = EnergyHistory::default();
    let mut values = Vec::new();
    for stage in &result.report.stages {
        history.marks.push((values.len(), format!("{} vertices", stage.stage.name)));
        values.extend(stage.solver.history.iter().map(|step| step.energy));
    }
    history.terms.push(Series { name: options.energy.to_string(), values });
    page.energies = Some(history);
    Ok(())
}

fn umbilics(samples: &SurfaceSamples) -> String {
    let count = |kind| samples.umbilics.iter().filter(|u| u.kind == kind).count();
    let mut text = format!(
        "{} lemons, {} monstars, {} stars",
        count(Some(UmbilicKind::Lemon)),
        count(Some(UmbilicKind::Monstar)),
        count(Some(UmbilicKind::Star))
    );
    let mut others: BTreeMap<i32, usize> = BTreeMap::new();
    for umbilic in samples.umbilics.iter().filter(|u| u.kind.is_none()) {
        *others.entry(umbilic.half_turns).or_default() += 1;
    }
    for (half_turns, count) in others {
        text += &format!(", {count} of index {}", 0.5 * f64::from(half_turns));
    }
    text
}

pub(crate) fn view(
    name: &str,
    samples: &SurfaceSamples,
    unit: &str,
) -> Result<SurfaceView, Failure> {
    let drawn = |error| Failure::other(format!("cannot draw the result: {error}"));
    let variation = ScalarField {
        id: "variation".to_owned(),
        label: "curvature variation |κn'|".to_owned(),
        unit: format!("1/{unit}²"),
        scale: FieldScale::Magnitude,
        range: None,
        values: samples.curvature_variation.clone(),
    };
    let mut view = SurfaceView::new(
        name,
        samples.positions.clone(),
        samples.normals.clone(),
        samples.triangles.clone(),
    )
    .and_then(|v| v.with_field(ScalarField::mean_curvature(samples.mean_curvature.clone(), unit)))
    .and_then(|v| {
        v.with_field(ScalarField::gaussian_curvature(samples.gaussian_curvature.clone(), unit))
    })
    .and_then(|v| v.with_field(ScalarField::kappa1(samples.k1.clone(), unit)))
    .and_then(|v| v.with_field(ScalarField::kappa2(samples.k2.clone(), unit)))
    .and_then(|v| v.with_field(variation))
    .map_err(drawn)?;
    let strokes = |lines: &[[DVec3; 2]]| lines.iter().map(|l| l.to_vec()).collect::<Vec<_>>();
    let size = samples.positions.iter().fold(0.0_f64, |s, p| s.max(p.length()));
    let marks = |kind| -> Vec<Vec<DVec3>> {
        let at = samples.umbilics.iter().filter(|u| u.kind == kind);
        at.flat_map(|u| {
            [DVec3::X, DVec3::Y, DVec3::Z]
                .map(|axis| vec![u.position - 0.02 * size * axis, u.position + 0.02 * size * axis])
        })
        .collect()
    };
    for (id, label, role, lines) in [
        ("f1", "first harmonic F1", LineRole::Directions, strokes(&samples.f1_strokes)),
        ("f3", "third harmonic F3", LineRole::Directions, strokes(&samples.f3_strokes)),
        ("lemons", "umbilics: lemons", LineRole::Curves, marks(Some(UmbilicKind::Lemon))),
        ("monstars", "umbilics: monstars", LineRole::Curves, marks(Some(UmbilicKind::Monstar))),
        ("stars", "umbilics: stars", LineRole::Curves, marks(Some(UmbilicKind::Star))),
        ("higher", "umbilics of higher order", LineRole::Curves, marks(None)),
    ] {
        if !lines.is_empty() {
            view = view.with_lines(LineSet::new(id, label, role, lines)).map_err(drawn)?;
        }
    }
    Ok(view)
}
