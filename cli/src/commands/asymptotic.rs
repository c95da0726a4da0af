//! `umbilic asymptotic DATA -o OUT`.

use crate::args::{ConfigArgs, OutputArgs, ReportArgs, check_output_path};
use crate::context::Context;
use crate::failure::Failure;
use crate::outcome::{Outcome, Status};
use crate::report_support;
use asymptotic_bezier::{
    Ansatz, AsymptoticNet, BoundaryEnergy, DataFile, Design, DesignOptions, Input, Interior,
    Lamella, LamellaOptions, RelaxOptions, TorsionHandle, design, lamellas, strip_layout,
};
use bspline::{BsplineSurface, Degree, KnotVector};
use exchange::{Drawing, DrawnLine, Label, LengthUnit, Mesh, Model, NamedSurface};
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
    /// Degree of the boundary curves, 5 to 9; 4 for exact data of one patch, curvatures unused
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
    boundary_energy,
    from_net,
    relaxed,
    lamellas,
    lamella_width,
    lamella_thickness,
    youngs_modulus,
    shear_modulus,
});

#[derive(Clone, Copy, Debug, clap::ValueEnum, Deserialize)]
#[serde(rename_all = "snake_case")]
enum AnsatzName {
    Module,
    Paper,
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
        check_sizes(&options)?;
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
        if let Some(folder) = &options.lamellas {
            outcome.files.extend(lamella_files(folder, &result, &options, &unit));
        }
        outcome.summary = summary(&result, &unit);
        outcome.warnings = result.check.warnings.iter().map(ToString::to_string).collect();
        if self.report.wanted() {
            let mut report = report_support::new("Asymptotic patches");
            let model = Model { surfaces: surfaces(&result)?, unit, ..Model::default() };
            report_support::add_model(&mut report, &model)?;
            report.histograms.extend(kinks(&result));
            report_support::add_files(&mut outcome, &self.report, context, report)?;
        }
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
    settings.patch.interior = match options.interior {
        None | Some(InteriorName::ThinPlate) => Interior::ThinPlate,
        Some(InteriorName::Harmonic) => Interior::Harmonic,
        Some(InteriorName::QuasiHarmonic) => Interior::QuasiHarmonic,
        Some(InteriorName::Dirichlet) => Interior::Dirichlet,
        Some(InteriorName::Bending) => Interior::Bending,
        Some(InteriorName::Coons) => Interior::Coons,
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

/// Kinks and jumps of the mean curvature across the shared curves.
fn kinks(result: &Design) -> Vec<report::Histogram> {
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

/// Refuses sizes and moduli that no strip can have.
fn check_sizes(options: &Options) -> Result<(), Failure> {
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
    Ok(())
}

/// Drawings and tables of the strips.
fn lamella_files(
    folder: &Path,
    result: &Design,
    options: &Options,
    unit: &LengthUnit,
) -> Vec<(PathBuf, Vec<u8>)> {
    let boundary = &result.shell.boundary;
    let mut settings = LamellaOptions { width: 1.0, thickness: 0.05, moduli: None };
    settings.width = options.lamella_width.unwrap_or_else(|| {
        let strips = lamellas(&result.net, boundary, &settings);
        strips.iter().map(|l| l.length).fold(0.0, f64::max) / 20.0
    });
    settings.thickness = options.lamella_thickness.unwrap_or(settings.width / 20.0);
    settings.moduli = options.youngs_modulus.zip(options.shear_modulus).map(|(e, g)| [e, g]);
    let strips = lamellas(&result.net, boundary, &settings);
    let drawing = strip_drawing(&strips, &settings);
    vec![
        (folder.join("lamellas.svg"), exchange::write_svg(&drawing, unit).into_bytes()),
        (folder.join("lamellas.dxf"), exchange::write_dxf(&drawing, unit).into_bytes()),
        (folder.join("lamellas.csv"), lamella_table(&strips).into_bytes()),
        (folder.join("nodes.csv"), node_table(&strips).into_bytes()),
    ]
}

fn strip_drawing(strips: &[Lamella], settings: &LamellaOptions) -> Drawing {
    let mut drawing = Drawing::default();
    let height = 0.2 * settings.width;
    for layout in strip_layout(strips, settings, 0.5 * settings.width) {
        let corner = layout.outline[0];
        drawing.lines.push(DrawnLine { layer: "cut".into(), points: layout.outline, closed: true });
        for mark in layout.marks {
            let points = mark.to_vec();
            drawing.lines.push(DrawnLine { layer: "engrave".into(), points, closed: false });
        }
        let mut label = |at, text| {
            let layer = "label".into();
            drawing.labels.push(Label { layer, at, height, angle: 0.0, text });
        };
        let left = geom_core::DVec3::new(-settings.width, 0.0, 0.0);
        label(corner + left, format!("L{}", layout.lamella));
        for (at, vertex) in layout.labels {
            label(at, format!("{vertex}"));
        }
    }
    drawing
}

fn lamella_table(strips: &[Lamella]) -> String {
    let header = [
        "lamella",
        "family",
        "curves",
        "length",
        "curvature_max",
        "radius_min",
        "torsion_max",
        "twist_deg",
        "width_bound",
        "bending_stress",
        "shear_stress",
        "edge_stress",
        "elastic_energy",
    ];
    let optional = |value: Option<f64>| value.map_or_else(String::new, |v| v.to_string());
    let rows = strips.iter().enumerate().map(|(k, l)| {
        let curves: Vec<String> = l.curves.iter().map(|(i, _)| i.to_string()).collect();
        vec![
            format!("L{k}"),
            if l.family > 0.0 { "u".into() } else { "v".into() },
            curves.join(" "),
            l.length.to_string(),
            l.curvature.to_string(),
            l.curvature.recip().to_string(),
            l.torsion.to_string(),
            l.twist.to_degrees().to_string(),
            l.width_bound.to_string(),
            optional(l.bending_stress),
            optional(l.shear_stress),
            optional(l.edge_stress),
            optional(l.elastic_energy),
        ]
    });
    exchange::write_csv(&header, rows)
}

fn node_table(strips: &[Lamella]) -> String {
    let header = [
        "lamella",
        "vertex",
        "arc",
        "angle_deg",
        "slot_width",
        "slot_depth",
        "normal_x",
        "normal_y",
        "normal_z",
        "direction_x",
        "direction_y",
        "direction_z",
    ];
    let rows = strips.iter().enumerate().flat_map(|(k, l)| {
        l.nodes.iter().map(move |n| {
            let mut row = vec![format!("L{k}"), n.vertex.to_string()];
            let numbers = [n.arc, n.angle.to_degrees(), n.slot_width, n.slot_depth];
            let frame = n.normal.to_array().into_iter().chain(n.direction.to_array());
            row.extend(numbers.into_iter().chain(frame).map(|v| v.to_string()));
            row
        })
    });
    exchange::write_csv(&header, rows)
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
