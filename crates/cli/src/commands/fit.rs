//! `umbilic fit MESH|POINTS -o SURFACE`.

use crate::args::{ConfigArgs, OutputArgs, ReportArgs};
use crate::context::Context;
use crate::failure::Failure;
use crate::input_file::{self, PartArgs, SurfaceArgs};
use crate::option_flags::OptionFlags;
use crate::outcome::{Outcome, Status};
use crate::report_support::{self, jets::spline_view};
use bspline::{Degree, GridFit, GridFitOptions, fit_grid};
use exchange::Model;
use geom_core::{BoundingBox, DVec3, QuadGrid};
use gp_solver::Counts;
use serde::{Deserialize, Serialize};
use std::path::{Path, PathBuf};

/// Arguments of `fit`.
#[derive(Debug, clap::Args)]
#[command(after_help = "Example: umbilic fit fixtures/grid.obj -o fitted.step --tolerance 0.001")]
pub(crate) struct Fit {
    /// Quad mesh like a grid or a tube, or a RON scene with a point grid
    input: PathBuf,
    #[command(flatten)]
    part: PartArgs,
    #[command(flatten)]
    output: OutputArgs,
    #[command(flatten)]
    config: ConfigArgs,
    #[command(flatten)]
    options: OptionFlags<Options>,
    #[command(flatten)]
    report: ReportArgs,
}

gp_solver::options! {
    /// Options of the fit.
    #[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
    #[serde(default, deny_unknown_fields)]
    struct Options {
        /// Numbers of control points; without them as few as meet the tolerance.
        ctrl: Option<Counts> = None;
        /// Degree in both directions, 1 to 15; 4 if not given.
        degree: Option<usize> = None;
        /// Largest distance of a point to the surface; 0.1 % of the size if not given.
        tolerance: Option<f64> = None;
    }
}

/// The points to fit, row by row.
struct Points {
    points: Vec<DVec3>,
    n_u: usize,
    n_v: usize,
    closed_u: bool,
}

impl Fit {
    pub(crate) fn run(self, context: &Context) -> Result<Outcome, Failure> {
        self.output.check()?;
        self.report.check()?;
        let options = self.options.options(&self.config)?;
        let settings = settings(&options).map_err(|e| self.options.refused(&self.config, e))?;
        let model = input_file::read(context, &self.input, &SurfaceArgs::default(), &self.part)?;
        let data = points(&self.input, &model)?;
        let fit = fit_grid(&data.points, data.n_u, data.n_v, data.closed_u, &settings)
            .map_err(|e| Failure::input(&self.input, e))?;
        let within = fit.distance_max <= fit.tolerance;
        let status = if within { Status::Converged } else { Status::Infeasible };
        let metrics = FitMetrics::new(&fit, &data.points);
        let mut outcome = Outcome::new(status, 0).with_input(&self.input).with_metrics(&metrics)?;
        let unit = &model.unit;
        outcome.summary = vec![
            format!(
                "{}: {} x {} control points of degree {} through {} x {} points",
                self.input.display(),
                fit.surface.n_u(),
                fit.surface.n_v(),
                fit.surface.degree_u(),
                data.n_u,
                data.n_v
            ),
            format!(
                "  distance mean {:.3e}, rms {:.3e}, max {:.3e} {unit} ({:.4} % of the size)",
                fit.distance_mean, fit.distance_rms, fit.distance_max, metrics.distance_max_percent
            ),
        ];
        outcome.warnings.clone_from(&model.warnings);
        if !within {
            let tolerance = fit.tolerance;
            outcome.warnings.push(format!(
                "the distance exceeds the tolerance of {tolerance:.3e} {unit}; ask for more control points"
            ));
        }
        if self.report.wanted() {
            let mut report = report_support::new("Fit of a surface");
            report_support::add_model(&mut report, &model)?;
            report.stages.push(spline_view("fitted", &[&fit.surface], None, &unit.to_string())?);
            report.option("degree", fit.surface.degree_u());
            report.option("tolerance", fit.tolerance);
            report_support::add_files(&mut outcome, &self.report, context, report)?;
        }
        let name = self.input.file_stem().map(|s| s.to_string_lossy().into_owned());
        let fitted = Model::of_surface(&name.unwrap_or_default(), fit.surface, model.unit);
        for path in self.output.output {
            outcome.add_model(path, &fitted)?;
        }
        Ok(outcome)
    }
}

fn settings(options: &Options) -> Result<GridFitOptions, String> {
    let degree = options.degree.map(Degree::new).transpose();
    if let Some(tolerance) = options.tolerance.filter(|t| !(t.is_finite() && *t > 0.0)) {
        return Err(format!("`tolerance` is {tolerance}; give a positive length"));
    }
    Ok(GridFitOptions {
        degree: degree.map_err(|e| format!("`degree`: {e}"))?,
        control_points: options.ctrl.map(|counts| (counts.u, counts.v)),
        tolerance: options.tolerance,
    })
}

fn points(path: &Path, model: &Model) -> Result<Points, Failure> {
    let refused = |e: &dyn std::fmt::Display| Failure::input(path, e);
    if let Some(grid) = model.grids.first() {
        let (points, n_u, n_v) = (grid.points.clone(), grid.n_u, grid.n_v);
        if n_u < 2 || n_v < 2 {
            let what = format!("the grid has {n_u} x {n_v} points; a surface needs 2 x 2");
            return Err(refused(&what));
        }
        return Ok(Points { points, n_u, n_v, closed_u: false });
    }
    if model.meshes.iter().all(|m| m.faces.is_empty()) {
        return Err(refused(&"the file has no faces and no point grid; give it one of them"));
    }
    let mesh = input_file::only_mesh(path, model)?;
    let mesh = mesh.to_poly_mesh().map_err(|e| refused(&e))?;
    let grid = QuadGrid::of(&mesh).map_err(|e| refused(&e))?;
    let points = grid.vertices.iter().map(|v| mesh.position(*v)).collect();
    Ok(Points { points, n_u: grid.n_u, n_v: grid.n_v, closed_u: grid.closed_u })
}

/// The `metrics` object; distances from the points to their foot points, in the model's unit.
#[derive(Serialize)]
struct FitMetrics {
    points: usize,
    control_points: usize,
    control_points_u: usize,
    control_points_v: usize,
    degree: usize,
    tolerance: f64,
    distance_mean: f64,
    distance_rms: f64,
    distance_max: f64,
    distance_max_percent: f64,
    /// Of the diagonal of the box of the points, as releases before gave it.
    distance_max_percent_box: f64,
}

impl FitMetrics {
    fn new(fit: &GridFit, points: &[DVec3]) -> Self {
        let diagonal = BoundingBox::of(points.iter().copied()).map_or(0.0, BoundingBox::diagonal);
        let (n_u, n_v) = (fit.surface.n_u(), fit.surface.n_v());
        Self {
            points: points.len(),
            control_points: n_u * n_v,
            control_points_u: n_u,
            control_points_v: n_v,
            degree: fit.surface.degree_u().get(),
            tolerance: fit.tolerance,
            distance_mean: fit.distance_mean,
            distance_rms: fit.distance_rms,
            distance_max: fit.distance_max,
            distance_max_percent: 100.0 * fit.distance_max / fit.size,
            distance_max_percent_box: 100.0 * fit.distance_max / diagonal,
        }
    }
}
