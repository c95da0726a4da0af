//! `umbilic remesh INPUT -o QUADS`.

use crate::args::{ConfigArgs, EndingArgs, OutputArgs, ReportArgs};
use crate::context::Context;
use crate::failure::Failure;
use crate::input_file::{self, PartArgs, SurfaceArgs};
use crate::option_flags::{self, OptionFlags};
use crate::outcome::{Outcome, Status};
use crate::report_support::{self, mesh::mesh_view};
use crate::watch::Watch;
use exchange::{Mesh, Model};
use quad_remesh::{Error, Options, Solution, solve, solve_surface};
use report::{LineRole, LineSet};
use std::path::PathBuf;

/// Arguments of `remesh`.
#[derive(Debug, clap::Args)]
#[command(
    after_help = "Example: umbilic remesh fixtures/triangles/tower.obj -o quads.obj --faces 300\n\n`hnet` makes a skin of the quads; with --reference it stays near the mesh they were made from."
)]
pub(crate) struct Remesh {
    /// Triangles or polygons of a negatively curved surface, or a B-spline surface
    input: PathBuf,
    #[command(flatten)]
    surface: SurfaceArgs,
    #[command(flatten)]
    part: PartArgs,
    #[command(flatten)]
    output: OutputArgs,
    #[command(flatten)]
    options: OptionFlags<Options>,
    #[command(flatten)]
    config: ConfigArgs,
    #[command(flatten)]
    report: ReportArgs,
    #[command(flatten)]
    ending: EndingArgs,
}

impl Remesh {
    pub(crate) fn run(self, context: &Context) -> Result<Outcome, Failure> {
        self.output.check()?;
        self.report.check()?;
        let options = self.options.options(&self.config)?;
        options.check().map_err(|e| self.options.refused(&self.config, e))?;
        let mut watch = Watch::new(context, "net").of(&self.input);
        let model = input_file::read(context, &self.input, &self.surface, &self.part)?;
        let solution = match &model.surfaces[..] {
            // Curves of a trim would be lost, so what is trimmed is not taken.
            [named] if model.meshes.is_empty() && named.trim.is_none() => {
                solve_surface(&named.surface, &options, &mut watch)
            }
            _ => {
                let mesh = input_file::only_mesh(&self.input, &model)?;
                let faces: Vec<&[u32]> = mesh.faces.iter().collect();
                solve(&mesh.positions, &faces, &options, &mut watch)
            }
        };
        let solution = match solution {
            Err(Error::Interrupted) => {
                return Ok(Outcome::new(Status::Interrupted, 0).with_input(&self.input));
            }
            other => other.map_err(|e| option_flags::refused::<Options>(&self.input, e))?,
        };
        let mut outcome = Outcome::new(solution.status, 0)
            .with_input(&self.input)
            .with_metrics(&solution.metrics)?;
        outcome.summary = summary(&solution, &model.unit.to_string());
        outcome.warnings.clone_from(&model.warnings);
        outcome.warnings.extend(
            solution.warnings.iter().map(|w| option_flags::in_flags::<Options>(&w.to_string())),
        );
        self.ending.apply(&mut outcome);
        if !watch.finish(&mut outcome) {
            return Ok(outcome);
        }
        let quads = Mesh::from_poly_mesh(&solution.result);
        for path in self.output.output {
            outcome.add_model(path, &Model::of_mesh(quads.clone(), model.unit.clone()))?;
        }
        if self.report.wanted() {
            let mut page = report_support::new("Asymptotic net");
            page.length_unit = model.unit.to_string();
            option_flags::list(&mut page, &options, &[]);
            let net = &solution.result;
            let end = |v| net.position(v);
            let edges = net.edges().map(|h| vec![end(net.origin(h)), end(net.target(h))]).collect();
            let mut lines = LineSet::new("edges", "edges of the net", LineRole::Curves, edges);
            lines.visible = true;
            let view = mesh_view("net", &quads, &page.length_unit)?;
            page.stages.push(view.with_lines(lines).map_err(Failure::other)?);
            let surface = Mesh::from_poly_mesh(&solution.surface);
            page.stages.push(mesh_view("surface", &surface, &page.length_unit)?);
            report_support::add_files(&mut outcome, &self.report, context, page)?;
        }
        Ok(outcome)
    }
}

fn summary(Solution { metrics: m, .. }: &Solution, unit: &str) -> Vec<String> {
    vec![
        format!(
            "net of {} quads, {} vertices ({} irregular), edges of {:.4} {unit} in the mean",
            m.faces, m.vertices, m.irregular_vertices, m.edge_length_mean
        ),
        format!(
            "  Euler characteristic {} (surface {}), {} singular points with indices that add up to {}",
            m.euler_characteristic, m.surface_euler_characteristic, m.singular_points, m.index_sum
        ),
        format!(
            "  off the asymptotic directions by {:.2}° in the mean; face angles from {:.0}°",
            m.asymptotic_deviation_mean_deg, m.angle_min_deg
        ),
        format!(
            "  {:.1} % of the surface covered, {:.1} % of it negatively curved",
            100.0 * m.covered_share,
            100.0 * m.negative_share
        ),
    ]
}
