//! `umbilic asymptotic DATA -o OUT`.

mod lamellas;
mod page;

use crate::args::{ConfigArgs, OutputArgs, ReportArgs, check_output_path};
use crate::context::Context;
use crate::failure::Failure;
use crate::outcome::{Outcome, Status};
use asymptotic_bezier::{
    Ansatz, AsymptoticNet, BoundaryEnergy, CurveForm, DataFile, Design, DesignOptions, Input,
    Interior, Joins, RelaxOptions, TorsionHandle, TorsionWish, design, torsion_handles,
};
use bspline::{BsplineSurface, Degree, KnotVector};
use exchange::{LengthUnit, Mesh, Model, NamedSurface};
use serde::Deserialize;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::str::FromStr;

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
    output: OutputArgs,
    #[command(flatten)]
    config: ConfigArgs,
    #[command(flatten)]
    report: ReportArgs,
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
    /// How the inner control points are found: with the tangent fields, or by a mask
    #[arg(long, value_enum)]
    interior: Option<InteriorName>,
    /// Degree of boundary curves made from curvatures, 5 to 9; 4 for exact data of one patch,
    /// curvatures unused
    #[arg(long, value_name = "N")]
    boundary_degree: Option<usize>,
    /// What the boundary curves are made from: tangents and curvatures as given, or normals (of
    /// degree 7), which inflections do not disturb (default: normals if a net made from positions
    /// needs them)
    #[arg(long, value_enum)]
    curves: Option<CurvesName>,
    /// What the freedom of boundary curves made from curvatures minimises
    #[arg(long, value_enum)]
    boundary_energy: Option<EnergyName>,
    /// Take the input for a quad mesh along asymptotic lines and estimate its curves
    #[arg(long, num_args = 0, default_missing_value = "true")]
    from_net: Option<bool>,
    /// How patches of a net join: common tangent planes, common cross derivatives where the curves
    /// allow it, or besides the least jump of the mean curvature
    #[arg(long, value_enum)]
    joins: Option<JoinsName>,
    /// Torsion of the curves in the u-direction at a corner (00, 10, 01, 11) or vertex (its
    /// number), as 00=1.2 or 00=0.5..2 (repeatable)
    #[arg(long, value_name = "CORNER=T", allow_hyphen_values = true)]
    torsion: Option<Vec<Wish>>,
    /// Gaussian curvature at a corner or vertex, as 00=-0.4 or 00=-1..-0.2 (repeatable)
    #[arg(long, value_name = "CORNER=K", allow_hyphen_values = true)]
    gauss: Option<Vec<Wish>>,
    /// Move tangents and curvatures of bad data, a little and within limits
    #[arg(long, num_args = 0, default_missing_value = "true")]
    relaxed: Option<bool>,
    /// Write the unrolled strips (lamellas.svg, lamellas.dxf) and tables (lamellas.csv, nodes.csv)
    /// into this existing folder
    #[arg(long, value_name = "DIR")]
    lamellas: Option<PathBuf>,
    /// Width of the lamellas across the surface (default: 1/20 of the longest one)
    #[arg(long, value_name = "L")]
    lamella_width: Option<f64>,
    /// Thickness of the lamellas (default: 1/20 of their width)
    #[arg(long, value_name = "L")]
    lamella_thickness: Option<f64>,
    /// Young's modulus of the lamellas, for stresses and energies in the table
    #[arg(long, value_name = "E", requires = "shear_modulus")]
    youngs_modulus: Option<f64>,
    /// Shear modulus of the lamellas
    #[arg(long, value_name = "G", requires = "youngs_modulus")]
    shear_modulus: Option<f64>,
}

crate::layered!(Options {
    degree,
    ansatz,
    interior,
    boundary_degree,
    curves,
    boundary_energy,
    from_net,
    joins,
    torsion,
    gauss,
    relaxed,
    lamellas,
    lamella_width,
    lamella_thickness,
    youngs_modulus,
    shear_modulus,
});

impl Options {
    /// The given flags that curves made from normals have no use for.
    fn for_curvatures(&self) -> Vec<&'static str> {
        let degree = self.boundary_degree.map(|_| "--boundary-degree");
        let energy = self.boundary_energy.map(|_| "--boundary-energy");
        degree.into_iter().chain(energy).collect()
    }
}

#[derive(Clone, Copy, Debug, clap::ValueEnum, Deserialize)]
#[serde(rename_all = "snake_case")]
enum AnsatzName {
    Module,
    Paper,
}

#[derive(Clone, Copy, Debug, clap::ValueEnum, Deserialize)]
#[serde(rename_all = "snake_case")]
enum JoinsName {
    G1,
    C1,
    G2,
}

/// One number or a range for a corner or vertex, `00=1.2` or `00=0.5..2`.
#[derive(Clone, Debug, PartialEq)]
struct Wish {
    corner: String,
    min: f64,
    max: f64,
}

impl FromStr for Wish {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let number = |t: &str| t.trim().parse::<f64>().ok();
        let wish = text.split_once('=').and_then(|(corner, value)| {
            let (min, max) = value.split_once("..").unwrap_or((value, value));
            Some(Self { corner: corner.trim().to_owned(), min: number(min)?, max: number(max)? })
        });
        wish.ok_or_else(|| {
            format!("`{text}` is not of the form CORNER=NUMBER or CORNER=MIN..MAX, as in 00=0.5..2")
        })
    }
}

impl<'de> Deserialize<'de> for Wish {
    fn deserialize<D: serde::Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        String::deserialize(deserializer)?.parse().map_err(serde::de::Error::custom)
    }
}

#[derive(Clone, Copy, Debug, clap::ValueEnum, Deserialize)]
#[serde(rename_all = "snake_case")]
enum InteriorName {
    ThinPlate,
    Harmonic,
    QuasiHarmonic,
    Dirichlet,
    Bending,
    Coons,
}

#[derive(Clone, Copy, Debug, clap::ValueEnum, Deserialize)]
#[serde(rename_all = "snake_case")]
enum CurvesName {
    Curvatures,
    Normals,
}

#[derive(Clone, Copy, Debug, clap::ValueEnum, Deserialize)]
#[serde(rename_all = "snake_case")]
enum EnergyName {
    Strain,
    Jerk,
    Torsion,
}

impl Asymptotic {
    pub(crate) fn run(self, context: &Context) -> Result<Outcome, Failure> {
        self.output.check()?;
        for path in &self.output.output {
            exchange::check_format(path).map_err(|e| Failure::input(path, e))?;
        }
        self.report.check()?;
        let config = self.config.load()?;
        let options = self.options.over(config);
        if let Some(folder) = &options.lamellas {
            check_output_path(&folder.join("lamellas.svg"))?;
        }
        check_options(&options)?;
        let (input, handles, unit) = read_input(&self.data, &options)?;
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
        if let Some(folder) = &options.lamellas {
            outcome.files.extend(lamellas::files(folder, &result, &options, &unit));
        }
        outcome.summary = summary(&result, &unit);
        outcome.warnings = result.check.warnings.iter().map(ToString::to_string).collect();
        if result.shell.boundary.is_from_normals() {
            outcome.warnings.extend(options.for_curvatures().into_iter().map(|flag| {
                format!("{flag} was not used: this net needs curves made from normals")
            }));
        }
        if self.report.wanted() {
            page::add(&mut outcome, &self.report, context, &result, unit)?;
        }
        Ok(outcome)
    }
}

fn read_input(
    path: &Path,
    options: &Options,
) -> Result<(Input, Vec<TorsionHandle>, LengthUnit), Failure> {
    let refused = |e: &dyn std::fmt::Display| Failure::input(path, e);
    let wishes = wishes(options);
    let handles = |input: &Input| torsion_handles(input, &wishes).map_err(|e| refused(&e));
    if options.from_net.unwrap_or(false) {
        let (mesh, unit) = if exchange::extension_of(path) == "ron" {
            let text = exchange::read_text(path).map_err(|e| refused(&e))?;
            let net = exchange::read_net(&text).map_err(|e| refused(&e))?;
            (net.to_poly_mesh().map_err(|e| refused(&e))?, LengthUnit::default())
        } else {
            let (mesh, unit, _) = crate::net_files::read_mesh(path)?;
            (mesh, unit)
        };
        let input = Input::Net(AsymptoticNet::from_mesh(&mesh).map_err(|e| refused(&e))?);
        let handles = handles(&input)?;
        return Ok((input, handles, unit));
    }
    if exchange::extension_of(path) == "obj" {
        let model = exchange::read_model(path).map_err(|e| refused(&e))?;
        let lines = model.meshes.iter().flat_map(|m| (0..m.lines.len()).map(|k| m.polyline(k)));
        let polylines: Vec<Vec<geom_core::DVec3>> = lines.map(Iterator::collect).collect();
        if polylines.is_empty() {
            return Err(refused(&"no polylines in this file; a quad mesh needs --from-net"));
        }
        let net = AsymptoticNet::from_polylines(&polylines).map_err(|e| refused(&e))?;
        let input = Input::Net(net);
        let handles = handles(&input)?;
        return Ok((input, handles, model.unit));
    }
    let mut file: DataFile = exchange::read_ron(path).map_err(|e| refused(&e))?;
    let unit = match &file.unit {
        None => LengthUnit::default(),
        Some(symbol) => LengthUnit::from_symbol(symbol)
            .ok_or_else(|| refused(&format!("unknown unit `{symbol}`; use mm, cm, m or in")))?,
    };
    file.torsions.extend(wishes);
    let (input, handles) = file.input().map_err(|e| refused(&e))?;
    Ok((input, handles, unit))
}

/// What the flags wish of torsions and Gaussian curvatures.
fn wishes(options: &Options) -> BTreeMap<String, TorsionWish> {
    let mut out = BTreeMap::new();
    for w in options.torsion.iter().flatten() {
        out.insert(w.corner.clone(), TorsionWish::Between(w.min, w.max));
    }
    for w in options.gauss.iter().flatten() {
        out.insert(w.corner.clone(), TorsionWish::GaussianBetween(w.min, w.max, 0.0));
    }
    out
}

fn design_options(options: &Options, handles: Vec<TorsionHandle>) -> DesignOptions {
    let mut settings = DesignOptions::default();
    settings.boundary.torsions = handles;
    if let Some(degree) = options.boundary_degree {
        settings.boundary.degree = degree;
    }
    settings.boundary.form = match options.curves {
        None => CurveForm::Auto,
        Some(CurvesName::Curvatures) => CurveForm::Curvatures,
        Some(CurvesName::Normals) => CurveForm::Normals,
    };
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
    settings.patch.interior = match options.interior {
        None | Some(InteriorName::ThinPlate) => Interior::ThinPlate,
        Some(InteriorName::Harmonic) => Interior::Harmonic,
        Some(InteriorName::QuasiHarmonic) => Interior::QuasiHarmonic,
        Some(InteriorName::Dirichlet) => Interior::Dirichlet,
        Some(InteriorName::Bending) => Interior::Bending,
        Some(InteriorName::Coons) => Interior::Coons,
    };
    settings.joins = match options.joins {
        None | Some(JoinsName::G1) => Joins::G1,
        Some(JoinsName::C1) => Joins::C1,
        Some(JoinsName::G2) => Joins::G2,
    };
    settings.relax = options.relaxed.unwrap_or(false).then(RelaxOptions::default);
    settings
}

/// The patches as clamped B-splines of one span.
fn surfaces(result: &Design) -> Result<Vec<NamedSurface>, Failure> {
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
    Ok(surfaces)
}

/// Surfaces for every format, and the curves as polylines where the format has them.
fn model_for(path: &Path, result: &Design, unit: &LengthUnit) -> Result<Model, Failure> {
    let mut model = Model { unit: unit.clone(), surfaces: surfaces(result)?, ..Model::default() };
    if exchange::extension_of(path) == "obj" {
        model.meshes.push(curves_mesh(result));
    }
    Ok(model)
}

/// Refuses sizes and moduli that no strip can have.
fn check_options(options: &Options) -> Result<(), Failure> {
    let sizes = [
        ("--lamella-width", options.lamella_width),
        ("--lamella-thickness", options.lamella_thickness),
        ("--youngs-modulus", options.youngs_modulus),
        ("--shear-modulus", options.shear_modulus),
    ];
    for (name, value) in sizes {
        if let Some(value) = value
            && !(value > 0.0 && value.is_finite())
        {
            return Err(Failure::usage(format!("{name} is {value}; give a positive number")));
        }
    }
    if let (Some(CurvesName::Normals), Some(flag)) =
        (options.curves, options.for_curvatures().first())
    {
        let text =
            format!("{flag} is for curves made from curvatures; drop it or --curves normals");
        return Err(Failure::usage(text));
    }
    Ok(())
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
