//! `umbilic panel SURFACE -o OUT`.

use crate::args::{ConfigArgs, ConvergedArgs, Counts, ReportArgs, SheetSize, check_output_path};
use crate::context::Context;
use crate::failure::Failure;
use crate::layered;
use crate::outcome::{Outcome, Status};
use crate::panel_files::{PANEL_OUTPUTS, encode};
use crate::report_support;
use crate::report_support::panels::paneling_report;
use crate::surface_file::read_surface;
use crate::watch::Watch;
use bspline::BsplineSurface;
use exchange::LengthUnit;
use gp_solver::List;
use paneling::{
    Clustering, Error, Input, Layout, MoldType, Options, Paneling, Pattern, PriceList, Solution,
    solve,
};
use report::Report;
use serde::{Deserialize, Serialize};
use std::path::{Path, PathBuf};

/// Arguments of `panel`.
#[derive(Debug, clap::Args)]
#[command(
    after_help = "Example: umbilic panel fixtures/roof.ron --panels 30x30 --k 3 -o panels.glb -o panels.csv -o molds.step"
)]
pub(crate) struct Panel {
    /// File with one B-spline surface
    surface: PathBuf,
    /// Where to write (repeatable): panels as glb or obj, their table as csv or ron, molds as step,
    /// flat outlines of panels on planar and cylindrical molds as svg or dxf
    #[arg(short, long = "output", value_name = "FILE", required = true)]
    output: Vec<PathBuf>,
    #[command(flatten)]
    options: PanelOptions,
    #[command(flatten)]
    config: ConfigArgs,
    #[command(flatten)]
    converged: ConvergedArgs,
    #[command(flatten)]
    report: ReportArgs,
}

/// Options that may also stand in the configuration file.
#[derive(Debug, Default, clap::Args, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub(crate) struct PanelOptions {
    /// Number of panels in u and v (default 30x30)
    #[arg(long, value_name = "UxV")]
    panels: Option<Counts>,
    /// quad (default), staggered, triangle, hexagon, diagonal, or an OBJ file over the unit square
    #[arg(long, value_name = "LAYOUT")]
    layout: Option<String>,
    /// Equal steps of mean arc length instead of equal parameter steps
    #[arg(long, num_args = 0, default_missing_value = "true")]
    equal_arc_length: Option<bool>,
    /// own (default): by panel shape; grid: the published grid over the curvature diagram;
    /// cover: greedy covering by cost
    #[arg(long, value_name = "NAME")]
    clustering: Option<String>,
    /// k √N molds for N panels (default 3)
    #[arg(long)]
    k: Option<f64>,
    /// Number of molds
    #[arg(long, value_name = "M")]
    molds: Option<usize>,
    /// Find the cheapest molds with every kink at most this
    #[arg(long, value_name = "X")]
    max_kink_deg: Option<f64>,
    /// Find the cheapest molds with every gap at most this, in model units
    #[arg(long, value_name = "L")]
    max_gap: Option<f64>,
    /// Types of molds: plane, cylinder, sphere, paraboloid, torus, cubic (default cubic); several
    /// only together with bounds
    #[arg(long, value_name = "TYPES", value_delimiter = ',')]
    mold_types: Option<Vec<MoldType>>,
    /// Prices of molds and panels by type (RON)
    #[arg(long, value_name = "FILE.ron")]
    prices: Option<PathBuf>,
    /// Most steps of the joint seam step (default 40); 0 leaves it out
    #[arg(long, value_name = "N")]
    seam_steps: Option<usize>,
    /// Width and height of the sheets for flat outlines, in model units (default: one large sheet)
    #[arg(long, value_name = "WxH")]
    sheet: Option<SheetSize>,
}

layered!(PanelOptions {
    panels,
    layout,
    equal_arc_length,
    clustering,
    k,
    molds,
    max_kink_deg,
    max_gap,
    mold_types,
    prices,
    seam_steps,
    sheet,
});

impl PanelOptions {
    /// Whether there is a rule for the number of molds; refuses several.
    fn has_rule(&self) -> Result<bool, Failure> {
        let has_bounds = self.max_kink_deg.is_some() || self.max_gap.is_some();
        let rules = [self.k.is_some(), self.molds.is_some(), has_bounds];
        match rules.iter().filter(|r| **r).count() {
            2.. => Err(Failure::usage(Error::SeveralRules)),
            count => Ok(count == 1),
        }
    }

    /// The options of the library.
    fn settings(&self) -> Result<Options, Failure> {
        let defaults = Options::default();
        Ok(Options {
            clustering: self.clustering()?,
            k: self.k,
            molds: self.molds,
            max_kink_deg: self.max_kink_deg,
            max_gap: self.max_gap,
            mold_types: self.mold_types.clone().map_or(defaults.mold_types, List),
            seam_steps: self.seam_steps.unwrap_or(defaults.seam_steps),
            ..Options::default()
        })
    }

    /// The options in force, for the report.
    fn list(&self, report: &mut Report, paneling: &Paneling) {
        report.option("panels", paneling.labels.len());
        report.option("molds", paneling.molds.len());
        report.option("layout", self.layout.as_deref().unwrap_or("quad"));
        report.option("equal arc length", self.equal_arc_length.unwrap_or(false));
        report.option("clustering", self.clustering.as_deref().unwrap_or("own"));
        if let Some(kink) = self.max_kink_deg {
            report.option("largest kink", format!("{kink}°"));
        }
        if let Some(gap) = self.max_gap {
            report.option("largest gap", format!("{gap} {}", report.length_unit).trim_end());
        }
        let types = self.mold_types.as_deref().unwrap_or(&[MoldType::Cubic]);
        report.option("mold types", types.iter().map(|t| t.name()).collect::<Vec<_>>().join(", "));
        if let Some(path) = &self.prices {
            report.option("prices", path.display());
        }
        let most = self.seam_steps.unwrap_or_else(|| Options::default().seam_steps);
        report.option("most seam steps", most);
    }

    fn clustering(&self) -> Result<Clustering, Failure> {
        match self.clustering.as_deref() {
            None | Some("own") => Ok(Clustering::Own),
            Some("grid") => Ok(Clustering::Grid),
            Some("cover") => Ok(Clustering::Cover),
            Some(other) => {
                Err(Failure::usage(format!("unknown clustering `{other}`; use own, grid or cover")))
            }
        }
    }

    fn layout(&self, surface: &BsplineSurface) -> Result<Layout, Failure> {
        let name = self.layout.as_deref().unwrap_or("quad");
        let layout = if let Some(pattern) = Pattern::from_name(name) {
            let Counts { u, v } = self.panels.unwrap_or(Counts { u: 30, v: 30 });
            let closed = [surface.knots_u().is_periodic(), surface.knots_v().is_periodic()];
            Layout::generate(pattern, u, v, closed).map_err(Failure::usage)?
        } else if name.to_lowercase().ends_with(".obj") {
            if self.panels.is_some() {
                let message = "panels has no meaning with a layout file; drop one of the two";
                return Err(Failure::usage(message));
            }
            layout_file(Path::new(name))?
        } else {
            return Err(Failure::usage(format!(
                "unknown layout `{name}`; use quad, staggered, triangle, hexagon, diagonal or an OBJ file"
            )));
        };
        let even = self.equal_arc_length.unwrap_or(false);
        Ok(if even { layout.with_equal_arc_length(surface) } else { layout })
    }
}

fn layout_file(path: &Path) -> Result<Layout, Failure> {
    let model = exchange::read_model(path).map_err(|e| Failure::input(path, e))?;
    let mesh = model.meshes.iter().find(|m| !m.faces.is_empty()).ok_or_else(|| {
        Failure::input(path, "no faces; a layout is a polygon mesh over the unit square")
    })?;
    let vertices: Vec<[f64; 3]> = mesh.positions.iter().map(|p| p.to_array()).collect();
    let faces: Vec<Vec<usize>> =
        mesh.faces.iter().map(|f| f.iter().map(|v| *v as usize).collect()).collect();
    Layout::from_polygons(&vertices, &faces).map_err(|e| Failure::input(path, e))
}

impl Panel {
    pub(crate) fn run(self, context: &Context) -> Result<Outcome, Failure> {
        self.check_outputs()?;
        self.report.check()?;
        let mut config: PanelOptions = self.config.load()?;
        if self.options.has_rule()? {
            // A rule on the command line replaces whatever rule the file has.
            config =
                PanelOptions { k: None, molds: None, max_kink_deg: None, max_gap: None, ..config };
        }
        let options = self.options.over(config);
        let settings = options.settings()?;
        let (model, named) = read_surface(&self.surface)?;
        let unit = model.unit;
        let layout = options.layout(&named.surface)?;
        let prices = match &options.prices {
            None => PriceList::counting_molds(),
            Some(path) => exchange::read_ron(path).map_err(|e| Failure::input(path, e))?,
        };
        let input = Input::from(&named.surface).with_layout(&layout).with_prices(prices);
        let solution = solve(input, &settings, &mut Watch::new(context, "panelling")).map_err(
            |e| match e {
                Error::Singular { .. } => Failure::input(&self.surface, e),
                Error::NoPrice { .. } | Error::BadPrice { .. } => match &options.prices {
                    Some(path) => Failure::input(path, e),
                    None => Failure::usage(e),
                },
                _ => Failure::usage(e),
            },
        )?;
        let (paneling, set) = (&solution.result, &solution.panels);
        let mut outcome = Outcome::new(solution.report.status, paneling.iterations())
            .with_input(&self.surface)
            .with_metrics(&solution.metrics)?;
        outcome.warnings = model.warnings;
        outcome.require_converged = self.converged.require_converged;
        outcome.summary = summary(&solution, &unit);
        for path in self.output {
            let sheet = options.sheet.map(|s| s.0);
            let files = encode(&path, set, paneling, &unit, sheet)?;
            if ["svg", "dxf"].contains(&exchange::extension_of(&path).as_str()) {
                outcome.warnings.extend(not_unrolled(paneling, &path));
            }
            outcome.files.extend(files);
        }
        if self.report.wanted() {
            let bounds = [options.max_kink_deg, options.max_gap];
            let mut report = paneling_report(set, paneling, bounds, &unit.to_string())?;
            options.list(&mut report, paneling);
            report_support::add_files(&mut outcome, &self.report, context, report)?;
        }
        Ok(outcome)
    }

    fn check_outputs(&self) -> Result<(), Failure> {
        for (k, path) in self.output.iter().enumerate() {
            if self.output[..k].contains(path) {
                let message = format!("{}: named twice as an output; drop one", path.display());
                return Err(Failure::usage(message));
            }
            let extension = exchange::extension_of(path);
            if !PANEL_OUTPUTS.contains(&extension.as_str()) {
                return Err(Failure::input(
                    path,
                    "panels are written as glb or obj, their table as csv or ron, molds as step, flat outlines as svg or dxf",
                ));
            }
            check_output_path(path)?;
        }
        Ok(())
    }
}

/// What to say if some panels are not in a drawing of flat outlines.
fn not_unrolled(paneling: &Paneling, path: &Path) -> Option<String> {
    let is_curved = |m: &&usize| !paneling.molds[**m].kind.is_developable();
    let missing = paneling.labels.iter().filter(is_curved).count();
    (missing > 0).then(|| {
        format!(
            "{}: {missing} of {} panels are on molds that cannot be unrolled and are not drawn",
            path.display(),
            paneling.labels.len()
        )
    })
}

fn summary(solution: &Solution, unit: &LengthUnit) -> Vec<String> {
    let (paneling, metrics) = (&solution.result, &solution.metrics);
    let quality = &metrics.quality;
    let mut lines = vec![
        format!("{} panels on {} molds, cost {:.2}", quality.panels, quality.molds, metrics.cost),
        format!(
            "  kinks: median {:.4}°, 95 % below {:.4}°, largest {:.4}°",
            quality.kink_median_deg, quality.kink_p95_deg, quality.kink_max_deg
        ),
        format!(
            "  gaps: median {:.3e}, 95 % below {:.3e}, largest {:.3e} {unit}",
            quality.gap_median, quality.gap_p95, quality.gap_max
        ),
        format!("  design met within {:.5} % of the diagonal", quality.deviation_max_percent),
    ];
    let counts = MoldType::ALL.map(|t| (t, paneling.molds.iter().filter(|m| m.kind == t).count()));
    let used: Vec<String> = counts
        .iter()
        .filter(|(_, n)| *n > 0)
        .map(|(kind, n)| format!("{n} {}", kind.name()))
        .collect();
    lines.push(format!("  molds by type: {}", used.join(", ")));
    if solution.report.status == Status::Infeasible {
        let excess = metrics.worst_excess.unwrap_or(f64::INFINITY);
        lines.push(format!(
            "  the bounds are not met: the worst seam is {excess:.2} times beyond them"
        ));
    }
    for s in paneling.measures.worst_kinks(3) {
        let seam = &paneling.measures.seams[s];
        let ([a, b], kink) = (seam.panels, seam.max_kink().to_degrees());
        lines.push(format!("  worst seam: panels {a} and {b}, kink {kink:.4}°"));
    }
    lines
}
