//! The whole run: look at the input, solve, measure.

use geom_core::{DVec3, Normalization};
use gp_solver::{Extra, Fingerprint, Observer, Problem, RunReport, Status};

use crate::error::Error;
use crate::gates::{GateReport, inspect};
use crate::input::Input;
use crate::methods::joint::Joint;
use crate::methods::published::Published;
use crate::methods::{Solved, Watch};
use crate::metrics::Metrics;
use crate::net::{AsymptoticField, HyperbolicNet, PlacedNet};
use crate::options::{Boundary, Method, Options};
use crate::warning::Warning;

/// A hyperbolic net with what is to be said about it.
///
/// # Example
/// ```
/// use geom_core::PolyMesh;
/// use hyperbolic_nets::{Input, Options, QuadNet, Status, solve};
/// let model = fixtures::asymptotic_nets::scherk(6);
/// let net = QuadNet::new(&PolyMesh::new(model.positions, &model.quads)?)?;
/// let solution = solve(&Input::new(&net), &Options::default(), &mut ())?;
/// assert_eq!(solution.report.status, Status::Converged);
/// assert_eq!(solution.result.shape().len(), 36);
/// assert!(solution.metrics.kink_max_deg < 1e-9 && solution.metrics.folds == 0);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Debug)]
pub struct Solution {
    /// The net with its shape parameters, and its Lelieuvre normals from the joint method.
    pub result: HyperbolicNet,
    /// The same in the coordinates it was solved in, where nothing has been rounded.
    pub placed: PlacedNet,
    /// Its measures.
    pub metrics: Metrics,
    /// What the solver did. A net that folds is [`Status::Partial`] or [`Status::Failed`], by
    /// [`Status::checked`] on its inner edges. Else the joint method has converged if no exact equation is violated by more
    /// than [`Options::polish_tol`] and has stalled otherwise; the published one has converged if
    /// its last round hardly changed the largest kink.
    pub report: RunReport,
    /// Measures of the input.
    pub gates: GateReport,
    /// What the user should know.
    pub warnings: Vec<Warning>,
    /// Largest violation of the exact equations, those of the caller included, before the polishing
    /// of the joint method and at the end; in mean edge lengths.
    pub violation: Option<[f64; 2]>,
}

/// Makes a net along the asymptotic directions of a surface a hyperbolic net near that surface.
///
/// # Errors
/// [`Error`] for nets that no method here can make smooth, and for what cannot be attempted. Not
/// converging is a [`Status`] of the report.
///
/// # Example
/// ```
/// use geom_core::{DVec3, PolyMesh};
/// use hyperbolic_nets::{Input, Options, QuadNet, solve};
/// // Sixty-four quads near the rulings of z = xy.
/// let at = |k: u32| f64::from(k) / 8.0 - 0.5;
/// let points = (0..81).map(|k| (at(k / 9), at(k % 9)));
/// let points = points.map(|(x, y)| DVec3::new(x, y, x * y + 0.003 * (9.0 * x).sin())).collect();
/// let corner = |k: u32| [k, k + 9, k + 10, k + 1];
/// let quads: Vec<[u32; 4]> = (0..71).filter(|k| k % 9 < 8).map(corner).collect();
/// let net = QuadNet::new(&PolyMesh::new(points, &quads)?)?;
/// let solution = solve(&Input::new(&net), &Options::default(), &mut ())?;
/// assert!(solution.metrics.kink_max_deg < 1e-9);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn solve(
    input: &Input<'_>,
    options: &Options,
    observer: &mut dyn Observer,
) -> Result<Solution, Error> {
    solve_with(input, options, &mut |_, _, _| Ok(()), observer)
}

/// As [`solve`], with blocks of one's own: `extra` is called whenever a problem has been built and
/// may add to it, weigh its blocks, take some out, or fix unknowns (groups [`crate::POSITIONS`] and
/// [`crate::NORMALS`]).
///
/// The joint method calls it twice. First for its weighted stages, which share one problem (the
/// [`Stage`](gp_solver::Stage) is the first of them): there blocks are terms of the energy beside
/// the others, and a weight of one's own says how much they count; unknowns have the coordinates of
/// the [`Stage`](gp_solver::Stage), which says where a point of the model stands there. Then for the stage [`crate::POLISH`], in which every row of every block is an
/// **equation**: the net is moved by as little as possible onto the Lelieuvre equations and these
/// rows together, to [`Options::polish_tol`] each, counted in mean edge lengths of movement whatever
/// unit and weight a row has. So a closure that adds the same block both times gets rows that hold
/// exactly in the result, together with smooth joins; a mere wish, such as nearness to something, is
/// left out where `stage.name == POLISH`, and the polishing then moves the net off it a little.
/// Equations that no net near by can meet end with the status [`Status::Stalled`] and
/// [`Solution::violation`] says by how much.
///
/// The published method calls it for its first stage and once more when frame points join; rows are
/// terms of the energy in both, and unknown positions are those of the model times the stage's
/// `unit`. Nothing is exact there.
///
/// # Errors
/// As [`solve`], and whatever `extra` returns.
///
/// # Example
/// One vertex stays where it is:
/// ```
/// use geom_core::PolyMesh;
/// use gp_solver::{Problem, Stage, Variables};
/// use hyperbolic_nets::{Input, Options, POSITIONS, QuadNet, solve_with};
/// let model = fixtures::asymptotic_nets::scherk(8).jittered(0.05, 1);
/// let net = QuadNet::new(&PolyMesh::new(model.positions, &model.quads)?)?;
/// let mut hold = |_: &Stage, variables: &Variables, problem: &mut Problem<'_>| {
///     problem.variables_mut().fix(variables.group(POSITIONS)?, 40);
///     Ok(())
/// };
/// let solution = solve_with(&Input::new(&net), &Options::default(), &mut hold, &mut ())?;
/// assert_eq!(solution.result.net().positions()[40], net.positions()[40]);
/// assert!(solution.metrics.kink_max_deg < 1e-9);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn solve_with(
    input: &Input<'_>,
    options: &Options,
    extra: &mut Extra<'_, Error>,
    observer: &mut dyn Observer,
) -> Result<Solution, Error> {
    options.check()?;
    let place = input.place()?;
    let field = AsymptoticField::new(input.mesh());
    let gates = inspect(input.net(), &field);
    let mut warnings = gates.check()?;
    let mut watch = Watch::new(observer, fingerprint(input, options));
    let Solved { result, report, violation } = match options.method {
        Method::Joint => Joint::new(input, options, &field)?.solve(extra, &mut watch)?,
        Method::Published => Published::new(input, options).solve(extra, &mut watch)?,
    };
    let metrics = Metrics::new(&result, input, &field, &gates);
    let edges = input.net().inner_edges().len();
    let report = RunReport { status: report.status.checked(metrics.folds, edges), ..report };
    if metrics.folds > 0 {
        warnings.push(Warning::ResultFolds { edges: metrics.folds });
    }
    let moved = metrics.boundary_deviation_max_edges;
    if options.boundary == Boundary::Fixed && moved > 0.0 {
        warnings.push(Warning::boundary(input.net(), moved));
    }
    if report.status == Status::Stalled {
        warnings.push(Warning::NotExact);
    }
    let placed = PlacedNet::solved(result, place);
    let result = restored(placed.net(), input, &place)?;
    Ok(Solution { result, placed, metrics, report, gates, warnings, violation })
}

/// A net in normalised coordinates back where the model stands; Lelieuvre normals are roots of
/// lengths.
fn restored(
    net: &HyperbolicNet,
    input: &Input<'_>,
    place: &Normalization,
) -> Result<HyperbolicNet, Error> {
    let pairs = net.net().positions().iter().zip(input.given().positions());
    let positions: Vec<DVec3> = pairs.map(|(&p, &given)| place.restore_given(p, given)).collect();
    let root = place.scale().sqrt();
    let normals = net.normals().map(|normals| normals.iter().map(|&n| n / root).collect());
    HyperbolicNet::new(net.net().clone().with_positions(&positions), normals, net.shape().to_vec())
}

/// The problem of the first stage, weighed for it.
///
/// # Errors
/// As [`solve`]; the input is not inspected.
///
/// # Example
/// ```
/// use geom_core::PolyMesh;
/// use hyperbolic_nets::{Input, Options, POSITIONS, QuadNet, problem};
/// let model = fixtures::asymptotic_nets::scherk(6);
/// let net = QuadNet::new(&PolyMesh::new(model.positions, &model.quads)?)?;
/// let (input, options) = (Input::new(&net), Options::default());
/// let problem = problem(&input, &options)?;
/// assert_eq!(problem.variables().group(POSITIONS)?.len(), 49);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn problem<'i>(input: &'i Input<'i>, options: &'i Options) -> Result<Problem<'i>, Error> {
    options.check()?;
    input.place()?;
    let field = AsymptoticField::new(input.mesh());
    match options.method {
        Method::Joint => Joint::new(input, options, &field)?.problem(),
        Method::Published => Published::new(input, options).problem(),
    }
}

/// Of everything a run depends on but a reference surface that is no mesh.
fn fingerprint(input: &Input<'_>, options: &Options) -> u64 {
    let mut of = Fingerprint::new();
    for point in input.given().positions().iter().chain(input.mesh().positions()) {
        of = of.numbers(&point.to_array());
    }
    let corners = input.net().quads().iter().flatten();
    of = of.counts(corners.map(|&v| u64::from(v)));
    let corners = input.mesh().triangles().iter().flatten();
    of = of.counts(corners.map(|&v| u64::from(v)));
    of.text(&format!("{options:?}")).finish()
}
