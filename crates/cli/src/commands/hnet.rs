//! `umbilic hnet QUADS -o OUT`.

use crate::args::{ConfigArgs, EndingArgs, OutputArgs, ReportArgs, SystemArgs};
use crate::checkpoints::CheckpointArgs;
use crate::context::Context;
use crate::failure::Failure;
use crate::input_file::{self, PartArgs};
use crate::net_files::{self, NetInput};
use crate::net_report;
use crate::option_flags::{self, OptionFlags};
use crate::outcome::Outcome;
use crate::report_support;
use crate::watch::Watch;
use geom_core::TriMesh;
use gp_solver::SolverError;
use hyperbolic_nets::{Error, Input, Options, QuadNet, Solution, solve};
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
    part: PartArgs,
    #[command(flatten)]
    output: OutputArgs,
    /// Mesh of the surface to stay near [default: the input itself]
    #[arg(long, value_name = "MESH")]
    reference: Option<PathBuf>,
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
        let (input, unit, mut warnings) = net_files::read(context, &self.input, &self.part)?;
        let net = match input {
            NetInput::Net(surface) => surface.net().clone(),
            NetInput::Mesh(mesh) => QuadNet::new(&mesh).map_err(refused)?,
        };
        let reference = match &self.reference {
            None => None,
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
