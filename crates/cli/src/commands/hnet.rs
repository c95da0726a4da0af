//! `umbilic hnet QUADS -o OUT`.

use crate::args::{ConfigArgs, ConvergedArgs, OutputArgs, ReportArgs};
use crate::context::Context;
use crate::failure::Failure;
use crate::net_files::{self, NetInput};
use crate::net_report;
use crate::outcome::{Outcome, Status};
use crate::report_support;
use geom_core::TriMesh;
use hyperbolic_nets::{
    AsymptoticField, Boundary, BoundaryPolygon, GateReport, HyperbolicNet, JointOptions,
    NetMeasures, NetReport, NetWarning, PublishedOptions, QuadNet, StepRecord,
};
use serde::{Deserialize, Serialize};
use std::ops::ControlFlow;
use std::path::PathBuf;

/// Arguments of `hnet`.
#[derive(Debug, clap::Args)]
#[command(
    after_help = "Example: umbilic hnet fixtures/nets/catenoid-ring.obj -o ring.step -o ring.glb -o ring.ron --metrics ring.json\n\nOutputs: ron (net file), step (exact rational patches), obj (the quads), glb, ply and stl (sampled; glb with curvatures), csv and dxf (wire positions for cutting molds)."
)]
pub(crate) struct Hnet {
    /// Quads that follow the asymptotic directions of a negatively curved surface, or a net file
    input: PathBuf,
    #[command(flatten)]
    output: OutputArgs,
    #[command(flatten)]
    options: HnetOptions,
    #[command(flatten)]
    config: ConfigArgs,
    #[command(flatten)]
    report: ReportArgs,
    #[command(flatten)]
    converged: ConvergedArgs,
}

/// Which solver.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, clap::ValueEnum, Deserialize)]
#[serde(rename_all = "snake_case")]
enum MethodChoice {
    /// Positions and normals together; exact on any topology
    #[default]
    Joint,
    /// Vertices and shape parameters in turn, as published; leaves kinks
    Published,
}

/// What happens at the boundary.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, clap::ValueEnum, Deserialize)]
#[serde(rename_all = "snake_case")]
enum BoundaryChoice {
    /// Drawn to where it starts
    #[default]
    Anchored,
    /// As the inside: near the surface
    Free,
    /// Where it starts, moved only if no exact net has this boundary
    Fixed,
    /// Along the boundary curve, corners held
    Glide,
}

/// Options of the method; those without a flag stand in the configuration file only.
#[derive(Debug, Default, clap::Args, Deserialize)]
#[serde(default, deny_unknown_fields)]
struct HnetOptions {
    /// Solver [default: joint]
    #[arg(long, value_enum)]
    method: Option<MethodChoice>,
    /// Boundary vertices [default: anchored]
    #[arg(long, value_enum)]
    boundary: Option<BoundaryChoice>,
    /// Mesh of the surface to stay near [default: the input itself]
    #[arg(long, value_name = "MESH")]
    reference: Option<PathBuf>,
    #[arg(skip)]
    fairness: Option<f64>,
    #[arg(skip)]
    proximity: Option<f64>,
    #[arg(skip)]
    shape: Option<f64>,
    #[arg(skip)]
    frame: Option<f64>,
    #[arg(skip)]
    wire_positions: Option<usize>,
}

crate::layered!(HnetOptions {
    method,
    boundary,
    reference,
    fairness,
    proximity,
    shape,
    frame,
    wire_positions,
});

/// The `metrics` object.
#[derive(Debug, Serialize)]
struct HnetMetrics {
    faces: usize,
    vertices: usize,
    irregular_vertices: usize,
    odd_valence_vertices: usize,
    star_planarity_max: f64,
    kink_max_deg: f64,
    kink_mean_deg: f64,
    folds: usize,
    shape_parameter_min: f64,
    shape_parameter_max: f64,
    shape_parameters_distinct: usize,
    deviation_mean_percent: f64,
    deviation_max_percent: f64,
    deviation_max_edges: f64,
    /// How far boundary vertices left the boundary polygon of the input, in mean edge lengths.
    boundary_deviation_max_edges: f64,
    asymptotic_deviation_mean_deg: f64,
    input_asymptotic_deviation_mean_deg: f64,
    negative_curvature_percent: f64,
}

/// Shape parameters this close count as one mold.
const SAME_SHAPE: f64 = 1e-3;

impl Hnet {
    pub(crate) fn run(self, context: &Context) -> Result<Outcome, Failure> {
        self.report.check()?;
        net_files::check_outputs(&self.output.output, &net_files::NET_OUTPUTS)?;
        let options = self.options.over(self.config.load()?);
        options.check()?;
        let (input, unit, mut warnings) = net_files::read(&self.input)?;
        let refused = |e: hyperbolic_nets::NetError| Failure::input(&self.input, e);
        let net = match input {
            NetInput::Net(surface) => surface.net().clone(),
            NetInput::Mesh(mesh) => QuadNet::new(&mesh).map_err(refused)?,
        };
        let reference = match &options.reference {
            None => TriMesh::from_poly_mesh(net.mesh()),
            Some(path) => TriMesh::from_poly_mesh(&net_files::read_mesh(path)?.0),
        };
        let field = AsymptoticField::new(&reference);
        let gates = hyperbolic_nets::inspect(&net, &field);
        warnings.extend(gates.check().map_err(refused)?.iter().map(ToString::to_string));
        let solved = options.solve(&net, &reference, &field, context);
        let (surface, report) = solved.map_err(refused)?;
        let measures = NetMeasures::new(&surface, &reference, &field);
        if measures.kinks.folds > 0 {
            warnings.push(format!(
                "the result folds back at {} edges; remesh the input there or raise `proximity`",
                measures.kinks.folds
            ));
        }
        let moved = BoundaryPolygon::deviation(&net, surface.net()) / measures.edge_length;
        if options.boundary == Some(BoundaryChoice::Fixed) && moved > 0.0 {
            warnings.push(NetWarning::boundary(&net, moved).to_string());
        }
        let metrics = metrics(&surface, &gates, &measures, moved);
        let mut outcome = Outcome::new(report.status, report.iterations)
            .with_input(&self.input)
            .with_metrics(&metrics)?;
        for path in self.output.output {
            let positions = options.wire_positions.unwrap_or(9);
            let bytes = net_files::encode(&path, &surface, &unit, positions)?;
            outcome.files.push((path, bytes));
        }
        outcome.summary = summary(&metrics, &report);
        if outcome.status == Status::Stalled {
            warnings.push(
                "the patches do not join exactly; free the boundary or use more faces".to_owned(),
            );
        }
        outcome.warnings = warnings;
        outcome.require_converged = self.converged.require_converged;
        if self.report.wanted() {
            let mut page = net_report::page("Hyperbolic net", &self.input, &unit);
            net_report::add_net(&mut page, &surface, &unit.to_string())?;
            net_report::add_energies(&mut page, &report);
            report_support::add_files(&mut outcome, &self.report, context, page)?;
        }
        Ok(outcome)
    }
}

impl HnetOptions {
    fn check(&self) -> Result<(), Failure> {
        let numbers = [
            ("fairness", self.fairness),
            ("proximity", self.proximity),
            ("shape", self.shape),
            ("frame", self.frame),
        ];
        for (name, value) in numbers {
            if value.is_some_and(|v| !(v > 0.0 && v.is_finite())) {
                return Err(Failure::usage(format!("`{name}` must be positive and finite")));
            }
        }
        if self.wire_positions.is_some_and(|n| !(2..=1000).contains(&n)) {
            return Err(Failure::usage("`wire_positions` must be between 2 and 1000"));
        }
        let joint = self.method.unwrap_or_default() == MethodChoice::Joint;
        match (joint, self.shape, self.frame) {
            (false, Some(_), _) => Err(Failure::usage("`shape` is a weight of the joint method")),
            (true, _, Some(_)) => {
                Err(Failure::usage("`frame` is a weight of the published method"))
            }
            _ => Ok(()),
        }
    }

    fn solve(
        &self,
        net: &QuadNet,
        reference: &TriMesh,
        field: &AsymptoticField<'_>,
        context: &Context,
    ) -> Result<(HyperbolicNet, NetReport), hyperbolic_nets::NetError> {
        let boundary = match self.boundary.unwrap_or_default() {
            BoundaryChoice::Anchored => Boundary::Anchored,
            BoundaryChoice::Free => Boundary::Free,
            BoundaryChoice::Fixed => Boundary::Fixed,
            BoundaryChoice::Glide => Boundary::Glide,
        };
        let mut taken = 0;
        match self.method.unwrap_or_default() {
            MethodChoice::Joint => {
                let d = JointOptions::default();
                let options = JointOptions {
                    boundary,
                    fairness: self.fairness.unwrap_or(d.fairness),
                    proximity: self.proximity.unwrap_or(d.proximity),
                    shape: self.shape.unwrap_or(d.shape),
                    relaxed: hyperbolic_nets::not_negatively_curved(net, field),
                    ..d
                };
                let steps = options.constraint_weights.len() * options.steps_per_stage;
                let progress = context.progress("net", steps);
                hyperbolic_nets::solve_joint(net, reference, &options, |step| {
                    watch(context, &progress, &mut taken, step)
                })
            }
            MethodChoice::Published => {
                let d = PublishedOptions::default();
                let options = PublishedOptions {
                    boundary,
                    fairness: self.fairness.unwrap_or(d.fairness),
                    proximity: self.proximity.unwrap_or(d.proximity),
                    frame: self.frame.unwrap_or(d.frame),
                    ..d
                };
                let steps = options.first_steps + options.rounds * options.steps_per_round;
                let progress = context.progress("net", steps);
                hyperbolic_nets::solve_published(net, reference, &options, |step| {
                    watch(context, &progress, &mut taken, step)
                })
            }
        }
    }
}

fn watch(
    context: &Context,
    progress: &crate::context::Progress,
    taken: &mut usize,
    step: &StepRecord,
) -> ControlFlow<()> {
    *taken += 1;
    progress.at(*taken, format!("energy {:.3e}", step.energy[1]));
    if context.interrupted() { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
}

fn metrics(
    surface: &HyperbolicNet,
    gates: &GateReport,
    measures: &NetMeasures,
    moved: f64,
) -> HnetMetrics {
    let [mean, max] = measures.deviation_percent();
    HnetMetrics {
        faces: surface.net().quads().len(),
        vertices: surface.net().positions().len(),
        irregular_vertices: surface.net().irregular_vertices().len(),
        // Nets with odd valences are refused.
        odd_valence_vertices: 0,
        star_planarity_max: measures.star_planarity,
        kink_max_deg: measures.kinks.max.to_degrees(),
        kink_mean_deg: measures.kinks.mean.to_degrees(),
        folds: measures.kinks.folds,
        shape_parameter_min: measures.shape_range[0],
        shape_parameter_max: measures.shape_range[1],
        shape_parameters_distinct: hyperbolic_nets::distinct_shape_parameters(
            surface.shape(),
            SAME_SHAPE,
        ),
        deviation_mean_percent: mean,
        deviation_max_percent: max,
        deviation_max_edges: measures.deviation_edges()[1],
        boundary_deviation_max_edges: moved,
        asymptotic_deviation_mean_deg: measures.misalignment.to_degrees(),
        input_asymptotic_deviation_mean_deg: gates.misalignment.to_degrees(),
        negative_curvature_percent: 100.0 * gates.negative_share,
    }
}

fn summary(m: &HnetMetrics, report: &NetReport) -> Vec<String> {
    vec![
        format!(
            "hyperbolic net of {} patches, {} vertices ({} irregular): {} after {} steps",
            m.faces, m.vertices, m.irregular_vertices, report.status, report.iterations
        ),
        format!(
            "  kinks max {:.2e}°, mean {:.2e}°; vertex stars planar to {:.1e} edges; {} folds",
            m.kink_max_deg, m.kink_mean_deg, m.star_planarity_max, m.folds
        ),
        format!(
            "  shape parameters {:.4} to {:.4}, {} different to 1e-3",
            m.shape_parameter_min, m.shape_parameter_max, m.shape_parameters_distinct
        ),
        format!(
            "  distance from the reference max {:.3} %, mean {:.3} % of its diagonal ({:.3} edges at most)",
            m.deviation_max_percent, m.deviation_mean_percent, m.deviation_max_edges
        ),
    ]
}
