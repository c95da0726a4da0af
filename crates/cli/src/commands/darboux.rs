//! `umbilic darboux NET -o OUT`.

use crate::args::{ConvergedArgs, OutputArgs, ReportArgs};
use crate::context::Context;
use crate::failure::Failure;
use crate::net_files::{self, NetInput};
use crate::net_report;
use crate::outcome::{Outcome, Status};
use crate::report_support;
use exchange::Model;
use geom_core::{BoundingBox, DVec3, TriMesh};
use hyperbolic_nets::{
    Branch, CAGE_EDGES, CageFit, DarbouxError, DarbouxMap, Freedom, HyperbolicNet, JointOptions,
    QuadNet, TransformedNet,
};
use report::{LineRole, LineSet};
use serde::{Deserialize, Serialize};
use std::ops::ControlFlow;
use std::path::{Path, PathBuf};
use std::str::FromStr;

/// Arguments of `darboux`.
#[derive(Debug, clap::Args)]
#[command(
    after_help = "Example: umbilic darboux fixtures/nets/enneper.obj --c -0.6 -o image.glb --metrics image.json\n\nWith --c, coordinates are counted from the middle of the net's bounding box in lengths of its diagonal. With --corner or --cage, the corners of that box, enlarged by 5 % of the diagonal, move: corner i is at the high end in x, y, z where bit 0, 1, 2 of i is set."
)]
pub(crate) struct Darboux {
    /// Net file, or quads along asymptotic directions (solved first)
    input: PathBuf,
    #[command(flatten)]
    output: OutputArgs,
    /// Centre of the transformation, not 1
    #[arg(long, value_name = "C", allow_negative_numbers = true, conflicts_with_all = ["corner", "cage"])]
    c: Option<f64>,
    /// Where a corner of the cage goes (repeatable); the others stay
    #[arg(long, value_name = "I=X,Y,Z")]
    corner: Vec<Corner>,
    /// Cage in a RON file
    #[arg(long, value_name = "FILE.ron")]
    cage: Option<PathBuf>,
    /// Which of the two images
    #[arg(long, value_enum, default_value = "regular")]
    branch: BranchChoice,
    #[command(flatten)]
    report: ReportArgs,
    #[command(flatten)]
    converged: ConvergedArgs,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
enum BranchChoice {
    /// Regular at the middle of the box, or the one through the cage's corners
    Regular,
    /// The other one
    Other,
}

/// `i=x,y,z`.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Corner {
    index: usize,
    point: DVec3,
}

impl FromStr for Corner {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let parse = || {
            let (index, point) = text.split_once('=')?;
            let numbers: Vec<f64> =
                point.split(',').map(|x| x.trim().parse().ok()).collect::<Option<_>>()?;
            let index = index.trim().parse().ok().filter(|i| *i < 8)?;
            match numbers[..] {
                [x, y, z] if [x, y, z].iter().all(|v: &f64| v.is_finite()) => {
                    Some(Self { index, point: DVec3::new(x, y, z) })
                }
                _ => None,
            }
        };
        parse().ok_or_else(|| {
            format!(
                "`{text}` is not of the form i=x,y,z with a corner number 0 to 7, as in 7=1.5,2,0.3"
            )
        })
    }
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

/// The `metrics` object.
#[derive(Debug, Serialize)]
struct DarbouxMetrics {
    faces: usize,
    c: Option<f64>,
    kink_max_deg: f64,
    kink_mean_deg: f64,
    gaussian_curvature_min: f64,
    gaussian_curvature_max: f64,
    mean_curvature_min: f64,
    mean_curvature_max: f64,
    cage_error_max: Option<f64>,
    sampling_error_max: f64,
    samples: usize,
}

/// Accuracy of the sampled image as a share of its bounding-box diagonal.
const ACCURACY: f64 = 1e-4;
/// Growth of the box on every side, as a share of its diagonal.
const CAGE_MARGIN: f64 = 0.05;

impl Darboux {
    pub(crate) fn run(self, context: &Context) -> Result<Outcome, Failure> {
        self.report.check()?;
        net_files::check_outputs(&self.output.output, &["glb", "obj", "ply", "stl"])?;
        let (input, unit, mut warnings) = net_files::read(&self.input)?;
        let (surface, status, steps) = match input {
            NetInput::Net(surface) => (*surface, Status::Converged, 0),
            NetInput::Mesh(mesh) => self.solve(&mesh, context, &mut warnings)?,
        };
        let bounds = BoundingBox::of(surface.net().positions().iter().copied())
            .ok_or_else(|| Failure::input(&self.input, "the net has no vertex"))?;
        let corners = hyperbolic_nets::cage_corners(bounds, CAGE_MARGIN);
        let (map, c, fit) = self.map(bounds, &corners)?;
        let branch = match self.branch {
            BranchChoice::Regular => Branch::Regular,
            BranchChoice::Other => Branch::Other,
        };
        let image = TransformedNet::new(&surface, &map, branch).map_err(Failure::usage)?;
        let extent = BoundingBox::of(image.positions().map_err(Failure::usage)?)
            .map_or(1.0, BoundingBox::diagonal);
        let (sampled, error) = image.sample_within(ACCURACY * extent).map_err(Failure::usage)?;
        if error > ACCURACY * extent {
            warnings.push(format!(
                "the sampled image is {error:.2e} {unit} off in places; parts of it are strongly curved"
            ));
        }
        let kinks = image.kinks().map_err(Failure::usage)?;
        let (gauss_min, gauss_max) = sampled.range(|s| s.gaussian_curvature);
        let (mean_min, mean_max) = sampled.range(|s| s.mean_curvature);
        let metrics = DarbouxMetrics {
            faces: surface.shape().len(),
            c,
            kink_max_deg: kinks.iter().copied().fold(0.0, f64::max).to_degrees(),
            kink_mean_deg: (kinks.iter().sum::<f64>() / kinks.len().max(1) as f64).to_degrees(),
            gaussian_curvature_min: gauss_min,
            gaussian_curvature_max: gauss_max,
            mean_curvature_min: mean_min,
            mean_curvature_max: mean_max,
            cage_error_max: fit.as_ref().map(|f| f.errors.iter().copied().fold(0.0, f64::max)),
            sampling_error_max: error,
            samples: sampled.samples.len(),
        };
        let mut outcome =
            Outcome::new(status, steps).with_input(&self.input).with_metrics(&metrics)?;
        outcome.require_converged = self.converged.require_converged;
        for path in self.output.output {
            let mesh = net_files::sampled_mesh("Darboux transform", &sampled);
            let model = Model::of_mesh(mesh, unit.clone());
            let bytes =
                exchange::encode_model(&path, &model).map_err(|e| Failure::input(&path, e))?;
            outcome.files.push((path, bytes));
        }
        outcome.summary = summary(&metrics, &unit.to_string());
        outcome.warnings = warnings;
        if self.report.wanted() {
            let mut page = net_report::page("Darboux transform", &self.input, &unit);
            net_report::add_net(&mut page, &surface, &unit.to_string())?;
            let chosen = branch;
            let other = if chosen == Branch::Regular { Branch::Other } else { Branch::Regular };
            // The last stage is shown first.
            for branch in [other, chosen] {
                match add_image(&mut page, &surface, &map, branch, &corners, &unit.to_string()) {
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
        context: &Context,
        warnings: &mut Vec<String>,
    ) -> Result<(HyperbolicNet, Status, usize), Failure> {
        let refused = |e: hyperbolic_nets::NetError| Failure::input(&self.input, e);
        let net = QuadNet::new(mesh).map_err(refused)?;
        let reference = TriMesh::from_poly_mesh(net.mesh());
        let field = hyperbolic_nets::AsymptoticField::new(&reference);
        let gates = hyperbolic_nets::inspect(&net, &field).check().map_err(refused)?;
        warnings.extend(gates.iter().map(ToString::to_string));
        let watch = |_: &_| {
            if context.interrupted() { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
        };
        let (surface, report) =
            hyperbolic_nets::solve_joint(&net, &reference, &JointOptions::default(), watch)
                .map_err(refused)?;
        Ok((surface, report.status, report.iterations))
    }

    /// The transformation that the flags ask for.
    fn map(
        &self,
        bounds: BoundingBox,
        corners: &[DVec3; 8],
    ) -> Result<(DarbouxMap, Option<f64>, Option<CageFit>), Failure> {
        if let Some(c) = self.c {
            let map = DarbouxMap::new(c)
                .and_then(|m| m.in_frame(bounds.center(), bounds.diagonal()))
                .map_err(Failure::usage)?;
            return Ok((map, Some(c), None));
        }
        let (mut images, mut freedom) = (*corners, Freedom::Nineteen);
        if let Some(path) = &self.cage {
            read_cage(path, &mut images, &mut freedom)?;
        } else if self.corner.is_empty() {
            return Err(Failure::usage(
                "say how to transform: --c C, --corner i=x,y,z or --cage FILE.ron",
            ));
        }
        for corner in &self.corner {
            images[corner.index] = corner.point;
        }
        let fit = hyperbolic_nets::fit_cage(corners, &images, freedom).map_err(Failure::usage)?;
        Ok((fit.map.clone(), fit.c, Some(fit)))
    }
}

fn read_cage(path: &Path, images: &mut [DVec3; 8], freedom: &mut Freedom) -> Result<(), Failure> {
    let file: CageFile = exchange::read_ron(path).map_err(|e| Failure::input(path, e))?;
    *freedom = match file.freedom {
        None | Some(19) => Freedom::Nineteen,
        Some(16) => Freedom::Sixteen,
        Some(n) => {
            return Err(Failure::input(path, format!("freedom is {n}; it must be 16 or 19")));
        }
    };
    match file.images.len() {
        0 => {}
        8 => images.iter_mut().zip(file.images).for_each(|(to, p)| *to = p.into()),
        n => {
            return Err(Failure::input(
                path,
                format!("{n} images for 8 corners; give all of them"),
            ));
        }
    }
    Ok(())
}

/// One image with its transformed cage.
fn add_image(
    page: &mut report::Report,
    surface: &HyperbolicNet,
    map: &DarbouxMap,
    branch: Branch,
    corners: &[DVec3; 8],
    unit: &str,
) -> Result<(), String> {
    let text = |e: DarbouxError| e.to_string();
    let image = TransformedNet::new(surface, map, branch).map_err(text)?;
    let sampled = image.sample(net_files::PICTURE_CELLS).map_err(text)?;
    let name = if branch == Branch::Regular { "regular image" } else { "other image" };
    let view = net_report::view(name, &sampled, unit).map_err(|e| e.to_string())?;
    // An edge of the cage outside the real domain, or through infinity, is left out.
    let arc = |ends: [DVec3; 2]| hyperbolic_nets::image_of_segment(map, branch, ends, 24).ok();
    let edges = CAGE_EDGES.iter().filter_map(|e| arc(e.map(|k| corners[k])));
    let mut cage = LineSet::new("cage", "transformed cage", LineRole::ControlNet, edges.collect());
    cage.visible = true;
    let faces = hyperbolic_nets::cage_face_lines(corners, 3).into_iter().filter_map(arc);
    let title = "spherical faces of the cage";
    let faces = LineSet::new("cage-faces", title, LineRole::ControlNet, faces.collect());
    let arcs = surface.net().edges().iter().map(|e| {
        let ends = e.ends.map(|v| surface.net().positions()[v]);
        hyperbolic_nets::image_of_segment(map, branch, ends, 6)
    });
    let arcs = arcs.collect::<Result<Vec<_>, _>>().map_err(text)?;
    let mut panels = LineSet::new("panels", "panel edges (circular arcs)", LineRole::Curves, arcs);
    panels.visible = true;
    let view =
        view.with_lines(cage).and_then(|v| v.with_lines(faces)).and_then(|v| v.with_lines(panels));
    page.stages.push(view.map_err(|e| e.to_string())?);
    Ok(())
}

fn summary(m: &DarbouxMetrics, unit: &str) -> Vec<String> {
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn corners_are_a_number_and_a_point() {
        let want = Corner { index: 7, point: DVec3::new(1.5, -2.0, 0.3) };
        assert_eq!("7=1.5,-2,0.3".parse(), Ok(want));
        for bad in ["8=0,0,0", "1=2,3", "1", "x=1,2,3", "1=a,2,3", "1=nan,0,0"] {
            assert!(bad.parse::<Corner>().is_err(), "{bad}");
        }
    }
}
