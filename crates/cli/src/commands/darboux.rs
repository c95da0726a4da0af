//! `umbilic darboux NET -o OUT`.

use crate::args::{ConfigArgs, EndingArgs, OutputArgs, ReportArgs};
use crate::context::Context;
use crate::failure::Failure;
use crate::input_file::PartArgs;
use crate::net_files::{self, NetInput};
use crate::net_report;
use crate::option_flags::{self, OptionFlags, in_flags};
use crate::outcome::{Outcome, Status};
use crate::report_support;
use crate::watch::Watch;
use exchange::Model;
use geom_core::DVec3;
use gp_solver::RunReport;
use hyperbolic_nets::darboux::{
    self, Branch, CAGE_EDGES, Corner, Freedom, Metrics, Options, Solution,
};
use hyperbolic_nets::{HyperbolicNet, Input, PlacedNet, QuadNet};
use report::{LineRole, LineSet};
use serde::Deserialize;
use std::path::{Path, PathBuf};

/// Arguments of `darboux`.
#[derive(Debug, clap::Args)]
#[command(
    after_help = "Example: umbilic darboux fixtures/nets/enneper.obj --c -0.6 -o image.glb --metrics image.json\n\nWith --c, coordinates are counted from the middle of the smallest ball around the net in lengths of its diameter. With --corner or --cage, the corners of the net's bounding box, enlarged by 5 % of its diagonal, move: corner i is at the high end in x, y, z where bit 0, 1, 2 of i is set."
)]
pub(crate) struct Darboux {
    /// Net file, or quads along asymptotic directions (solved first)
    input: PathBuf,
    #[command(flatten)]
    part: PartArgs,
    #[command(flatten)]
    output: OutputArgs,
    #[command(flatten)]
    options: OptionFlags<Options>,
    /// Cage in a RON file
    #[arg(long, value_name = "FILE.ron", conflicts_with = "c")]
    cage: Option<PathBuf>,
    #[command(flatten)]
    report: ReportArgs,
    #[command(flatten)]
    ending: EndingArgs,
}

/// The cage file.
#[derive(Debug, Default, Deserialize)]
#[serde(default, deny_unknown_fields)]
struct CageFile {
    /// Where each corner goes, all eight; or empty.
    images: Vec<(f64, f64, f64)>,
    /// 16 or 19 degrees of freedom.
    freedom: Option<u32>,
}

impl Darboux {
    pub(crate) fn run(self, context: &Context) -> Result<Outcome, Failure> {
        self.report.check()?;
        net_files::check_outputs(&self.output.output, &["glb", "obj", "ply", "stl"])?;
        let options = self.options()?;
        let mut watch = Watch::new(context, "net").of(&self.input);
        let (input, unit, mut warnings) = net_files::read(context, &self.input, &self.part)?;
        let (surface, placed, status, steps) = match input {
            NetInput::Net(surface) => {
                let placed =
                    PlacedNet::new(&surface).map_err(|e| Failure::input(&self.input, e))?;
                (*surface, placed, Status::Converged, 0)
            }
            NetInput::Mesh(mesh) => {
                let solution = self.solve(&mesh, &mut watch)?;
                warnings.extend(solution.warnings.iter().map(ToString::to_string));
                let RunReport { status, iterations, .. } = solution.report;
                (solution.result, solution.placed, status, iterations)
            }
        };
        let image =
            darboux::solve_placed(placed, &options, &mut watch).map_err(|e| self.refused(&e))?;
        let status = match image.report.status {
            Status::Interrupted => Status::Interrupted,
            _ => status,
        };
        warnings.extend(image.warnings.iter().map(ToString::to_string));
        let (metrics, sampled) = (&image.metrics, &image.result);
        let mut outcome =
            Outcome::new(status, steps).with_input(&self.input).with_metrics(metrics)?;
        self.ending.apply(&mut outcome);
        outcome.summary = summary(metrics, &unit.to_string());
        outcome.warnings = warnings;
        if !watch.finish(&mut outcome) {
            return Ok(outcome);
        }
        for path in self.output.output {
            let mesh = net_files::sampled_mesh("Darboux transform", sampled);
            let model = Model::of_mesh(mesh, unit.clone());
            outcome.add_model(path, &model)?;
        }
        if self.report.wanted() {
            let mut page = net_report::page("Darboux transform", &self.input, &unit);
            net_report::add_net(&mut page, &surface, &unit.to_string())?;
            let chosen = options.branch;
            let other = if chosen == Branch::Regular { Branch::Other } else { Branch::Regular };
            // The last stage is shown first.
            for branch in [other, chosen] {
                match add_image(&mut page, &surface, &image, branch, &unit.to_string()) {
                    Ok(()) => {}
                    Err(error) if branch == other => {
                        page.warnings.push(format!("the other image is not shown: {error}"));
                    }
                    Err(error) => return Err(Failure::usage(error)),
                }
            }
            report_support::add_files(&mut outcome, &self.report, context, page)?;
        }
        Ok(outcome)
    }

    fn solve(
        &self,
        mesh: &geom_core::PolyMesh,
        watch: &mut Watch<'_>,
    ) -> Result<hyperbolic_nets::Solution, Failure> {
        let refused = |e: hyperbolic_nets::Error| Failure::input(&self.input, e);
        let net = QuadNet::new(mesh).map_err(refused)?;
        let options = hyperbolic_nets::Options::default();
        hyperbolic_nets::solve(&Input::new(&net), &options, watch).map_err(refused)
    }

    /// What the library says, of the file it speaks of.
    fn refused(&self, error: &darboux::Error) -> Failure {
        let file = match error {
            darboux::Error::BadCage(_) => self.cage.as_ref(),
            darboux::Error::OutsideRealDomain { .. }
            | darboux::Error::Infinite { .. }
            | darboux::Error::Collapsed
            | darboux::Error::NoVertex
            | darboux::Error::Patch(_) => Some(&self.input),
            _ => None,
        };
        match file {
            Some(file) => option_flags::refused::<Options>(file, error),
            None => refused(error),
        }
    }

    /// The transformation that the flags ask for; those of the file come first.
    fn options(&self) -> Result<Options, Failure> {
        let mut options = self.options.options(&ConfigArgs { config: None })?;
        if let Some(path) = &self.cage {
            let (mut corners, freedom) = read_cage(path)?;
            corners.append(&mut options.corners.0);
            (options.corners.0, options.freedom) = (corners, freedom);
        } else if options.c.is_none() && options.corners.is_empty() {
            return Err(Failure::usage(
                "say how to transform: --c C, --corner i=x,y,z or --cage FILE.ron",
            ));
        }
        options.check().map_err(|e| refused(&e))?;
        Ok(options)
    }
}

/// What the library says of fields, said of flags.
fn refused(error: &darboux::Error) -> Failure {
    Failure::usage(in_flags::<Options>(&error.to_string()))
}

/// Where corners go by a cage file, and with how many degrees of freedom.
fn read_cage(path: &Path) -> Result<(Vec<Corner>, Freedom), Failure> {
    let file: CageFile = exchange::read_ron(path).map_err(|e| Failure::input(path, e))?;
    let freedom = match file.freedom {
        None | Some(19) => Freedom::Nineteen,
        Some(16) => Freedom::Sixteen,
        Some(n) => {
            return Err(Failure::input(path, format!("freedom is {n}; it must be 16 or 19")));
        }
    };
    if !matches!(file.images.len(), 0 | 8) {
        let message = format!("{} images for 8 corners; give all of them", file.images.len());
        return Err(Failure::input(path, message));
    }
    let corner = |(index, p): (usize, (f64, f64, f64))| Corner { index, point: p.into() };
    Ok((file.images.into_iter().enumerate().map(corner).collect(), freedom))
}

/// One image with its transformed cage.
fn add_image(
    page: &mut report::Report,
    surface: &HyperbolicNet,
    solution: &Solution,
    branch: Branch,
    unit: &str,
) -> Result<(), String> {
    let text = |e: darboux::Error| e.to_string();
    let Solution { placed, map, corners, .. } = solution;
    let sampled = placed.sample_image(map, branch, net_files::PICTURE_CELLS).map_err(text)?;
    let name = if branch == Branch::Regular { "regular image" } else { "other image" };
    let view = net_report::view(name, &sampled, unit).map_err(|e| e.to_string())?;
    // An edge of the cage outside the real domain, or through infinity, is left out.
    let arc = |ends: [DVec3; 2]| placed.image_of_segment(map, branch, ends, 24).ok();
    let edges = CAGE_EDGES.iter().filter_map(|e| arc(e.map(|k| corners[k])));
    let mut cage = LineSet::new("cage", "transformed cage", LineRole::ControlNet, edges.collect());
    cage.visible = true;
    let faces = darboux::cage_face_lines(corners, 3).into_iter().filter_map(arc);
    let title = "spherical faces of the cage";
    let faces = LineSet::new("cage-faces", title, LineRole::ControlNet, faces.collect());
    let arcs = surface.net().edges().iter().map(|e| {
        let ends = e.ends.map(|v| surface.net().positions()[v]);
        placed.image_of_segment(map, branch, ends, 6)
    });
    let arcs = arcs.collect::<Result<Vec<_>, _>>().map_err(text)?;
    let mut panels = LineSet::new("panels", "panel edges (circular arcs)", LineRole::Curves, arcs);
    panels.visible = true;
    let view =
        view.with_lines(cage).and_then(|v| v.with_lines(faces)).and_then(|v| v.with_lines(panels));
    page.stages.push(view.map_err(|e| e.to_string())?);
    Ok(())
}

fn summary(m: &Metrics, unit: &str) -> Vec<String> {
    let mut lines = vec![format!("image of {} patches as Darboux cyclides", m.faces)];
    if let Some(c) = m.c {
        lines.push(format!("  c = {c:.6}"));
    }
    if let Some(error) = m.cage_error_max {
        lines.push(format!("  cage corners met to {error:.3e} {unit}"));
    }
    lines.push(format!("  kinks max {:.2e}°, mean {:.2e}°", m.kink_max_deg, m.kink_mean_deg));
    lines.push(format!(
        "  Gaussian curvature {:.4} to {:.4} 1/{unit}²",
        m.gaussian_curvature_min, m.gaussian_curvature_max
    ));
    lines.push(format!(
        "  sampled at {} points, at most {:.2e} {unit} off",
        m.samples, m.sampling_error_max
    ));
    lines
}
