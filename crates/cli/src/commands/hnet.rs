//! `umbilic hnet INPUT -o OUT`.

use crate::args::{ConfigArgs, EndingArgs, OutputArgs, ReportArgs, SystemArgs};
use crate::checkpoints::CheckpointArgs;
use crate::context::Context;
use crate::failure::Failure;
use crate::input_file::{self, PartArgs, SurfaceArgs};
use crate::net_files::{self, NetInput};
use crate::net_report;
use crate::option_flags::{self, OptionFlags};
use crate::outcome::{Outcome, Status};
use crate::report_support;
use crate::watch::Watch;
use exchange::LengthUnit;
use geom_core::TriMesh;
use gp_solver::{OptionValue, SolverError};
use hyperbolic_nets::{Error, Input, Options, QuadNet, Solution, solve};
use std::path::PathBuf;
use workflows::nets::{self, Did, InputEdges, Prepared, prepare, prepare_surface};

/// Arguments of `hnet`.
#[derive(Debug, clap::Args)]
#[command(
    after_help = "Example: umbilic hnet fixtures/nets/catenoid-ring.obj -o ring.step -o ring.glb -o ring.ron --metrics ring.json\n\nOutputs: ron (net file), step (exact rational patches), obj (the quads), glb, ply and stl (sampled; glb with curvatures), csv and dxf (wire positions for cutting molds)."
)]
pub(crate) struct Hnet {
    /// Any mesh of a negatively curved surface, best of quads along its asymptotic lines, a B-spline
    /// surface, or a net file
    input: PathBuf,
    #[command(flatten)]
    surface: SurfaceArgs,
    #[command(flatten)]
    part: PartArgs,
    #[command(flatten)]
    output: OutputArgs,
    /// Mesh of the surface to stay near [default: the input itself]
    #[arg(long, value_name = "MESH")]
    reference: Option<PathBuf>,
    /// What to do with the edges of a mesh: keep them, take the diagonals of its quads, or make new
    /// quads; auto does the first of these that follows the asymptotic directions
    #[arg(long, value_name = "auto|keep|diagonals|remesh", default_value = "auto",
          value_parser = <InputEdges as OptionValue>::read)]
    input_edges: InputEdges,
    #[command(flatten)]
    remesh: OptionFlags<quad_remesh::Options>,
    #[command(flatten)]
    options: OptionFlags<Options>,
    #[command(flatten)]
    config: ConfigArgs,
    #[command(flatten)]
    checkpoint: CheckpointArgs,
    #[command(flatten)]
    report: ReportArgs,
    #[command(flatten)]
    ending: EndingArgs,
    #[command(flatten)]
    system: SystemArgs,
}

impl Hnet {
    pub(crate) fn run(self, context: &Context) -> Result<Outcome, Failure> {
        self.report.check()?;
        net_files::check_outputs(&self.output.output, &net_files::NET_OUTPUTS)?;
        let options = self.options.options(&self.config)?;
        options.check().map_err(|e| self.options.refused(&self.config, e))?;
        let refused = |e: Error| option_flags::refused::<Options>(&self.input, e);
        let mut watch = Watch::new(context, "net")
            .of(&self.input)
            .with_checkpoints(&self.checkpoint)?
            .with_systems(self.system.dump_system.as_deref())?;
        let Some(given) = self.read(context, &mut watch)? else {
            return Ok(Outcome::new(Status::Interrupted, 0).with_input(&self.input));
        };
        let Given { net, surface, unit, mut warnings, did } = given;
        let reference = match &self.reference {
            None => surface,
            Some(path) => {
                let model = input_file::read_other(path, &self.part)?;
                let mesh = input_file::only_mesh(path, &model)?.to_poly_mesh();
                Some(TriMesh::from_poly_mesh(&mesh.map_err(|e| Failure::input(path, e))?))
            }
        };
        let input = match &reference {
            None => Input::new(&net),
            Some(mesh) => Input::near_mesh(&net, mesh),
        };
        let solution = solve(&input, &options, &mut watch).map_err(|e| match e {
            Error::Solver(e @ SolverError::ForeignCheckpoint { .. }) => watch.foreign(&e),
            e => refused(e),
        })?;
        warnings.extend(solution.warnings.iter().map(ToString::to_string));
        let Solution { result: surface, metrics, report, .. } = &solution;
        let mut outcome = Outcome::new(report.status, report.iterations)
            .with_input(&self.input)
            .with_metrics(metrics)?;
        outcome.summary = summary(&solution);
        outcome.summary.extend(did.filter(|did| *did != Did::Kept).map(|did| format!("  {did}")));
        outcome.warnings = warnings;
        self.ending.apply(&mut outcome);
        if !watch.finish(&mut outcome) {
            return Ok(outcome);
        }
        for path in self.output.output {
            let bytes = net_files::encode(&path, surface, &unit, options.wire_positions)?;
            outcome.files.push((path, bytes));
        }
        if self.report.wanted() {
            let mut page = net_report::page("Hyperbolic net", &self.input, &unit);
            option_flags::list(&mut page, &options, &[]);
            net_report::add_net(&mut page, surface, &unit.to_string())?;
            net_report::add_energies(&mut page, report);
            report_support::add_files(&mut outcome, &self.report, context, page)?;
        }
        Ok(outcome)
    }
}

/// A net with what it stands for.
struct Given {
    net: QuadNet,
    surface: Option<TriMesh>,
    unit: LengthUnit,
    warnings: Vec<String>,
    did: Option<Did>,
}

impl Hnet {
    /// None if it was interrupted while a net was made.
    fn read(&self, context: &Context, watch: &mut Watch<'_>) -> Result<Option<Given>, Failure> {
        if net_files::is_net(context, &self.input) {
            let (input, unit, warnings) = net_files::read(context, &self.input, &self.part)?;
            let net = match input {
                NetInput::Net(surface) => surface.net().clone(),
                NetInput::Mesh(mesh) => {
                    QuadNet::new(&mesh).map_err(|e| Failure::input(&self.input, e))?
                }
            };
            return Ok(Some(Given { net, surface: None, unit, warnings, did: None }));
        }
        let none = ConfigArgs { config: None };
        let options = self.remesh.options(&none)?;
        options.check().map_err(|e| self.remesh.refused(&none, e))?;
        let model = input_file::read(context, &self.input, &self.surface, &self.part)?;
        let prepared = match &model.surfaces[..] {
            [named] if model.meshes.is_empty() && named.trim.is_none() => {
                prepare_surface(&named.surface, &options, watch)
            }
            _ => {
                let mesh = input_file::only_mesh(&self.input, &model)?;
                let faces: Vec<&[u32]> = mesh.faces.iter().collect();
                prepare(&mesh.positions, &faces, self.input_edges, &options, watch)
            }
        };
        let Prepared { net, reference, did, warnings } = match prepared {
            Err(nets::Error::Remesh(quad_remesh::Error::Interrupted)) => return Ok(None),
            other => {
                other.map_err(|e| option_flags::refused::<quad_remesh::Options>(&self.input, e))?
            }
        };
        let told = warnings.iter().map(|w| option_flags::in_flags::<quad_remesh::Options>(w));
        let warnings = model.warnings.iter().cloned().chain(told).collect();
        Ok(Some(Given { net, surface: reference, unit: model.unit, warnings, did: Some(did) }))
    }
}

fn summary(Solution { metrics: m, report, .. }: &Solution) -> Vec<String> {
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
