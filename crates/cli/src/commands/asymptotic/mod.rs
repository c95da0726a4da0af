//! `umbilic asymptotic DATA -o OUT`.

mod lamellas;
mod page;

use crate::args::{ConfigArgs, EndingArgs, OutputArgs, ReportArgs, check_output_folder};
use crate::checkpoints::CheckpointArgs;
use crate::context::Context;
use crate::failure::Failure;
use crate::input_file::PartArgs;
use crate::option_flags::{OptionFlags, in_flags};
use crate::outcome::{Outcome, Status};
use crate::watch::Watch;
use asymptotic_bezier::{DataFile, Error, Input, Options, Solution, solve};
use bspline::{BsplineSurface, Degree, KnotVector};
use exchange::{LengthUnit, Mesh, Model, NamedSurface};
use gp_solver::SolverError;
use std::path::{Path, PathBuf};

/// Arguments of `asymptotic`.
#[derive(Debug, clap::Args)]
#[command(
    after_help = "Examples:\n  umbilic asymptotic fixtures/asymptotic/catenoid.ron -o patch.step -o patch.glb\n  umbilic hnet fixtures/nets/enneper.obj -o net.ron\n  umbilic asymptotic net.ron --from-net --joins g2 -o shell.step --report shell.html"
)]
pub(crate) struct Asymptotic {
    /// Corner data or a net of curves (RON), polylines of the curves (OBJ), or with --from-net an
    /// asymptotic quad mesh or the net file of `umbilic hnet`
    data: PathBuf,
    #[command(flatten)]
    part: PartArgs,
    #[command(flatten)]
    output: OutputArgs,
    #[command(flatten)]
    options: OptionFlags<Options>,
    /// Write the unrolled strips (lamellas.svg, lamellas.dxf) and tables (lamellas.csv, nodes.csv)
    /// into this folder, which is made if need be
    #[arg(long, value_name = "DIR")]
    lamellas: Option<PathBuf>,
    #[command(flatten)]
    config: ConfigArgs,
    #[command(flatten)]
    checkpoint: CheckpointArgs,
    #[command(flatten)]
    ending: EndingArgs,
    #[command(flatten)]
    report: ReportArgs,
}

impl Asymptotic {
    pub(crate) fn run(self, context: &Context) -> Result<Outcome, Failure> {
        self.output.check()?;
        for path in &self.output.output {
            exchange::check_format(path).map_err(|e| Failure::input(path, e))?;
        }
        self.report.check()?;
        let options = self.options.options(&self.config)?;
        if let Some(folder) = &self.lamellas {
            check_output_folder(folder)?;
        }
        let said = |e: &dyn std::fmt::Display| in_flags::<Options>(&e.to_string());
        options.check().map_err(|e| self.options.refused(&self.config, e))?;
        let mut watch =
            Watch::new(context, "solving").of(&self.data).with_checkpoints(&self.checkpoint)?;
        let (input, unit, warnings) = read_input(context, &self.data, &self.part, &options)?;
        let result = match solve(&input, &options, &mut watch) {
            Ok(result) => result,
            Err(Error::Interrupted { .. }) => {
                return Ok(Outcome::new(Status::Interrupted, 0).with_input(&self.data));
            }
            Err(Error::Solver(e @ SolverError::ForeignCheckpoint { .. })) => {
                return Err(watch.foreign(&e));
            }
            Err(error) => return Err(Failure::input(&self.data, said(&error))),
        };
        let iterations = result.relaxed.as_ref().map_or(0, |r| r.iterations);
        let mut outcome = Outcome::new(result.report.status, iterations)
            .with_input(&self.data)
            .with_metrics(&result.metrics)?;
        self.ending.apply(&mut outcome);
        outcome.summary = summary(&result, &unit);
        outcome.warnings = warnings;
        outcome.warnings.extend(result.warnings.iter().map(|w| said(w)));
        if !watch.finish(&mut outcome) {
            return Ok(outcome);
        }
        for path in self.output.output {
            let model = model_for(&path, &result, &unit)?;
            outcome.add_model(path, &model)?;
        }
        if let Some(folder) = &self.lamellas {
            outcome.files.extend(lamellas::files(folder, &result, &options, &unit));
        }
        if self.report.wanted() {
            page::add(&mut outcome, &self.report, context, &result, unit)?;
        }
        Ok(outcome)
    }
}

fn read_input(
    context: &Context,
    path: &Path,
    part: &PartArgs,
    options: &Options,
) -> Result<(Input, LengthUnit, Vec<String>), Failure> {
    let refused = |e: &dyn std::fmt::Display| Failure::input(path, e);
    let is_mesh = options.from_net && exchange::extension_of(path) != "ron";
    if !part.part.is_empty() && !is_mesh {
        return Err(Failure::usage("--part chooses from a mesh; leave it out"));
    }
    if options.from_net {
        let (mesh, unit, warnings) = if exchange::extension_of(path) == "ron" {
            let text = exchange::read_text(path).map_err(|e| refused(&e))?;
            let net = exchange::read_net(&text).map_err(|e| refused(&e))?;
            (net.to_poly_mesh().map_err(|e| refused(&e))?, LengthUnit::default(), Vec::new())
        } else {
            crate::net_files::read_mesh(context, path, part)?
        };
        return Ok((mesh.into(), unit, warnings));
    }
    if has_polylines(path) {
        let format = context.input_format.as_deref();
        let model = exchange::read_model_as(path, format).map_err(|e| refused(&e))?;
        let lines = model.meshes.iter().flat_map(|m| (0..m.lines.len()).map(|k| m.polyline(k)));
        let polylines: Vec<Vec<geom_core::DVec3>> = lines.map(Iterator::collect).collect();
        if polylines.is_empty() {
            return Err(refused(&"no polylines in this file; a quad mesh needs --from-net"));
        }
        return Ok((polylines.into(), model.unit, model.warnings));
    }
    let file: DataFile = exchange::read_ron(path).map_err(|e| refused(&e))?;
    let unit = match &file.unit {
        None => LengthUnit::default(),
        Some(symbol) => LengthUnit::from_symbol(symbol)
            .ok_or_else(|| refused(&format!("unknown unit `{symbol}`; use mm, cm, m or in")))?,
    };
    Ok((file.input().map_err(|e| refused(&e))?, unit, Vec::new()))
}

/// Whether the format of a file has polylines.
fn has_polylines(path: &Path) -> bool {
    matches!(exchange::extension_of(path).as_str(), "obj" | "3dm")
}

/// The patches as clamped B-splines of one span.
fn surfaces(result: &Solution) -> Result<Vec<NamedSurface>, Failure> {
    let mut surfaces = Vec::with_capacity(result.result.patches.len());
    for (f, filled) in result.result.patches.iter().enumerate() {
        let patch = &filled.patch;
        let degree = Degree::new(patch.degree()).map_err(Failure::other)?;
        let knots =
            KnotVector::clamped_uniform(degree, patch.degree() + 1).map_err(Failure::other)?;
        let surface = BsplineSurface::new(knots.clone(), knots, patch.points().to_vec(), None)
            .map_err(Failure::other)?;
        surfaces.push(NamedSurface::new(format!("patch {f}"), surface));
    }
    Ok(surfaces)
}

/// Surfaces for every format, and the curves as polylines where the format has them.
fn model_for(path: &Path, result: &Solution, unit: &LengthUnit) -> Result<Model, Failure> {
    let mut model = Model { unit: unit.clone(), surfaces: surfaces(result)?, ..Model::default() };
    if has_polylines(path) {
        model.meshes.push(curves_mesh(result));
    }
    Ok(model)
}

fn curves_mesh(result: &Solution) -> Mesh {
    let mut mesh = Mesh { name: "asymptotic curves".into(), ..Mesh::default() };
    for curve in &result.result.boundary.curves {
        let first = mesh.positions.len() as u32;
        mesh.positions.extend(curve.polyline(32));
        mesh.lines.push(&(first..mesh.positions.len() as u32).collect::<Vec<u32>>());
    }
    mesh
}

fn summary(result: &Solution, unit: &LengthUnit) -> Vec<String> {
    let m = &result.metrics;
    let mut lines = vec![
        format!(
            "{} patches of degree {}, {} curves",
            m.patches,
            m.degree,
            result.net.curves().len()
        ),
        format!(
            "boundary: normal curvature at most {:.1e} (times size), |K + tau^2| at most {:.1e} per square {unit}",
            m.normal_curvature_max, m.torsion_defect_max
        ),
        format!(
            "energies: strain {:.6}, thin plate {:.6}; least sine of the parameter lines {:.3}",
            m.strain_energy, m.thin_plate_energy, m.min_sine
        ),
    ];
    if !result.check.joins.is_empty() {
        lines.push(format!("largest kink across a shared curve: {:.1e} degrees", m.kink_max_deg));
        let before = match result.mean_jump_before {
            Some(before) => format!(" (with G1 joins {before:.3e})"),
            None => String::new(),
        };
        lines.push(format!(
            "largest jump of the mean curvature: {:.3e} per {unit}{before}",
            m.mean_jump_max
        ));
    }
    if let Some(relaxed) = &result.relaxed {
        lines.push(format!(
            "relaxed: data moved by {:.2} % RMS, {:.2} % at most",
            100.0 * relaxed.rms_move(),
            100.0 * relaxed.max_move()
        ));
    }
    lines
}
