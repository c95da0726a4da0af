//! `umbilic asymptotic DATA -o OUT`.

use crate::args::{ConfigArgs, OutputArgs};
use crate::context::Context;
use crate::failure::Failure;
use crate::outcome::{Outcome, Status};
use asymptotic_bezier::{
    Ansatz, AsymptoticNet, BoundaryEnergy, DataFile, Design, DesignOptions, Input, RelaxOptions,
    TorsionHandle, design,
};
use bspline::{BsplineSurface, Degree, KnotVector};
use exchange::{LengthUnit, Mesh, Model, NamedSurface};
use serde::Deserialize;
use std::path::{Path, PathBuf};

/// Arguments of `asymptotic`.
#[derive(Debug, clap::Args)]
#[command(
    after_help = "Example:\n  umbilic asymptotic fixtures/asymptotic/catenoid.ron -o patch.step -o patch.glb"
)]
pub(crate) struct Asymptotic {
    /// Corner data or a net of curves (RON), or with --from-net an asymptotic quad mesh
    data: PathBuf,
    #[command(flatten)]
    output: OutputArgs,
    #[command(flatten)]
    config: ConfigArgs,
    #[command(flatten)]
    options: Options,
}

/// Options of the method, as flags and in `--config`.
#[derive(Debug, Default, clap::Args, Deserialize)]
#[serde(default, deny_unknown_fields)]
struct Options {
    /// Degree of the patches, 5 to 15 (default 7, and 8 or 11 where 7 folds)
    #[arg(long, value_name = "N")]
    degree: Option<usize>,
    /// Tangent fields: all polynomial ones, or the published ansatz of degree eleven
    #[arg(long, value_enum)]
    ansatz: Option<AnsatzName>,
    /// Degree of the boundary curves, 5 to 9
    #[arg(long, value_name = "N")]
    boundary_degree: Option<usize>,
    /// What the freedom of the boundary curves minimises
    #[arg(long, value_enum)]
    boundary_energy: Option<EnergyName>,
    /// Take the input for a quad mesh along asymptotic lines and estimate its curves
    #[arg(long, num_args = 0, default_missing_value = "true")]
    from_net: Option<bool>,
    /// Move tangents and curvatures of bad data, a little and within limits
    #[arg(long, num_args = 0, default_missing_value = "true")]
    relaxed: Option<bool>,
}

crate::layered!(Options { degree, ansatz, boundary_degree, boundary_energy, from_net, relaxed });

#[derive(Clone, Copy, Debug, clap::ValueEnum, Deserialize)]
#[serde(rename_all = "snake_case")]
enum AnsatzName {
    Module,
    Paper,
}

#[derive(Clone, Copy, Debug, clap::ValueEnum, Deserialize)]
#[serde(rename_all = "snake_case")]
enum EnergyName {
    Strain,
    Jerk,
    Torsion,
}

impl Asymptotic {
    pub(crate) fn run(self, _context: &Context) -> Result<Outcome, Failure> {
        self.output.check()?;
        for path in &self.output.output {
            exchange::check_format(path).map_err(|e| Failure::input(path, e))?;
        }
        let config = self.config.load()?;
        let options = self.options.over(config);
        let (input, handles, unit) = read_input(&self.data, options.from_net.unwrap_or(false))?;
        let settings = design_options(&options, handles);
        let result = design(&input, &settings).map_err(|e| Failure::input(&self.data, e))?;
        let acceptable = result.relaxed.as_ref().is_none_or(|r| r.acceptable);
        let status = if acceptable { Status::Converged } else { Status::Stalled };
        let iterations = result.relaxed.as_ref().map_or(0, |r| r.iterations);
        let mut outcome = Outcome::new(status, iterations)
            .with_input(&self.data)
            .with_metrics(&result.metrics())?;
        for path in self.output.output {
            let model = model_for(&path, &result, &unit)?;
            let bytes =
                exchange::encode_model(&path, &model).map_err(|e| Failure::input(&path, e))?;
            outcome.files.push((path, bytes));
        }
        outcome.summary = summary(&result, &unit);
        outcome.warnings = result.check.warnings.iter().map(ToString::to_string).collect();
        Ok(outcome)
    }
}

fn read_input(
    path: &Path,
    from_net: bool,
) -> Result<(Input, Vec<TorsionHandle>, LengthUnit), Failure> {
    if from_net {
        let model = exchange::read_model(path).map_err(|e| Failure::input(path, e))?;
        let mesh = model
            .meshes
            .first()
            .ok_or_else(|| Failure::input(path, "no mesh in this file; give a quad mesh"))?;
        let mesh = mesh.to_poly_mesh().map_err(|e| Failure::input(path, e))?;
        let net = AsymptoticNet::from_mesh(&mesh).map_err(|e| Failure::input(path, e))?;
        return Ok((Input::Net(net), Vec::new(), model.unit));
    }
    let file: DataFile = exchange::read_ron(path).map_err(|e| Failure::input(path, e))?;
    let unit = match &file.unit {
        None => LengthUnit::default(),
        Some(symbol) => LengthUnit::from_symbol(symbol).ok_or_else(|| {
            Failure::input(path, format!("unknown unit `{symbol}`; use mm, cm, m or in"))
        })?,
    };
    let (input, handles) = file.input().map_err(|e| Failure::input(path, e))?;
    Ok((input, handles, unit))
}

fn design_options(options: &Options, handles: Vec<TorsionHandle>) -> DesignOptions {
    let mut settings = DesignOptions::default();
    settings.boundary.torsions = handles;
    if let Some(degree) = options.boundary_degree {
        settings.boundary.degree = degree;
    }
    settings.boundary.energy = match options.boundary_energy {
        None | Some(EnergyName::Strain) => BoundaryEnergy::Strain,
        Some(EnergyName::Jerk) => BoundaryEnergy::Jerk,
        Some(EnergyName::Torsion) => BoundaryEnergy::Torsion,
    };
    settings.patch.degree = options.degree;
    settings.patch.ansatz = match options.ansatz {
        None | Some(AnsatzName::Module) => Ansatz::Module,
        Some(AnsatzName::Paper) => Ansatz::Paper,
    };
    settings.relax = options.relaxed.unwrap_or(false).then(RelaxOptions::default);
    settings
}

/// Surfaces for every format, and the curves as polylines where the format has them.
fn model_for(path: &Path, result: &Design, unit: &LengthUnit) -> Result<Model, Failure> {
    let mut surfaces = Vec::with_capacity(result.shell.patches.len());
    for (f, filled) in result.shell.patches.iter().enumerate() {
        let patch = &filled.patch;
        let degree = Degree::new(patch.degree()).map_err(Failure::other)?;
        let knots =
            KnotVector::clamped_uniform(degree, patch.degree() + 1).map_err(Failure::other)?;
        let surface = BsplineSurface::new(knots.clone(), knots, patch.points().to_vec(), None)
            .map_err(Failure::other)?;
        surfaces.push(NamedSurface { name: format!("patch {f}"), surface });
    }
    let mut model = Model { unit: unit.clone(), surfaces, ..Model::default() };
    if exchange::extension_of(path) == "obj" {
        model.meshes.push(curves_mesh(result));
    }
    Ok(model)
}

fn curves_mesh(result: &Design) -> Mesh {
    let mut mesh = Mesh { name: "asymptotic curves".into(), ..Mesh::default() };
    for curve in &result.shell.boundary.curves {
        let first = mesh.positions.len() as u32;
        mesh.positions.extend(curve.polyline(32));
        mesh.lines.push(&(first..mesh.positions.len() as u32).collect::<Vec<u32>>());
    }
    mesh
}

fn summary(result: &Design, unit: &LengthUnit) -> Vec<String> {
    let m = result.metrics();
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
