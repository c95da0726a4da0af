//! Positions and Lelieuvre normals together: an exact hyperbolic net on any topology.

use crate::blocks::{Combinations, Proximity, Target, Weight, Weighted, second_differences};
use crate::boundary::{Boundary, targets};
use crate::descend::{Damping, Descent, StepRecord};
use crate::lelieuvre::{LelieuvreStart, NORMAL, POSITION, constraints, shape_parameters};
use crate::{HyperbolicNet, NetError, QuadNet, best_log_factor};
use geom_core::{ClosestPoint, DVec3};
use gp_solver::{
    Factorization, MinNormProjection, Problem, ProjectionOptions, ProjectionReport,
    QuadraticConstraints, SolverError, Status, System,
};
use std::ops::ControlFlow;

/// Settings of [`solve_joint`]. Lengths are counted in mean edge lengths and normals in their mean
/// length, so that weights do not depend on the size of the model.
#[derive(Clone, Debug, PartialEq)]
pub struct JointOptions {
    /// Weight of the constraints in every stage.
    pub constraint_weights: Vec<f64>,
    /// Gauss-Newton steps per stage; a stage ends early once a step lowers the energy by
    /// `≤ 1e-6` of it.
    pub steps_per_stage: usize,
    /// Weight of second differences of positions in the first stage.
    pub fairness: f64,
    /// Its factor from stage to stage.
    pub fairness_decay: f64,
    /// Its least value.
    pub fairness_floor: f64,
    /// Weight of second differences of normals.
    pub normal_fairness: f64,
    /// Weight of `ν₀ + ν₂ − ν₁ − ν₃`, which pulls the shape parameters to 1.
    pub shape: f64,
    /// Weight of the distance to the tangent plane of the reference surface.
    pub proximity: f64,
    /// Weight of the distance to the nearest point, as a share of `proximity`.
    pub point_share: f64,
    /// What happens at the boundary.
    pub boundary: Boundary,
    /// Vertices (one flag each) where the surface is not negatively curved: proximity counts
    /// `relaxed_share` there. Empty for none.
    pub relaxed: Vec<bool>,
    /// See `relaxed`.
    pub relaxed_share: f64,
    /// Largest number of Newton steps onto the constraints at the end.
    pub polish_steps: usize,
    /// The result is exact, and the status [`Status::Converged`], if no constraint is violated by
    /// more than `polish_tol` mean edge lengths.
    pub polish_tol: f64,
}

impl Default for JointOptions {
    fn default() -> Self {
        Self {
            constraint_weights: vec![10.0, 100.0, 1000.0],
            steps_per_stage: 2,
            fairness: 0.3,
            fairness_decay: 0.2,
            fairness_floor: 0.002,
            normal_fairness: 0.05,
            shape: 0.3,
            proximity: 1.0,
            point_share: 0.02,
            boundary: Boundary::Anchored,
            relaxed: Vec::new(),
            relaxed_share: 0.02,
            polish_steps: 30,
            polish_tol: 1e-13,
        }
    }
}

/// What a solver of this crate did.
#[derive(Clone, Debug, PartialEq)]
pub struct NetReport {
    /// How it ended.
    pub status: Status,
    /// Gauss-Newton and polishing steps taken.
    pub iterations: usize,
    /// Every Gauss-Newton step.
    pub history: Vec<StepRecord>,
    /// Largest violation of the constraints before the polishing and at the end, in mean edge
    /// lengths; `None` without a polishing.
    pub constraint_max: Option<[f64; 2]>,
    /// Edges of the input that twist against their family.
    pub wrong_twists: usize,
}

/// Optimises positions and Lelieuvre normals `ν` of a net so that `x_j − x_i = ± ν_i × ν_j` on
/// every edge, plus for one family and minus for the other.
///
/// Vertex stars are then planar (both ends of an edge are orthogonal to it), and with
/// `W = |ν₁ + ν₃| / |ν₀ + ν₂|` all patches join smoothly. Because the normals are single-valued
/// this includes the closing conditions around holes and handles, which alternating between
/// vertices and shape parameters (see [`crate::solve_published`]) cannot meet.
///
/// `observer` sees every step and can stop the solve; the polishing is then skipped.
///
/// # Errors
/// [`NetError`] for nets that cannot be started from, such as vertices without a tangent plane.
pub fn solve_joint(
    net: &QuadNet,
    reference: &dyn ClosestPoint,
    options: &JointOptions,
    mut observer: impl FnMut(&StepRecord) -> ControlFlow<()>,
) -> Result<(HyperbolicNet, NetReport), NetError> {
    let start = LelieuvreStart::new(net, net.positions())?;
    let h = net.mesh().mean_edge_length();
    let vertices = net.positions().len();
    let size = start.normals.iter().map(|n| n.length()).sum::<f64>() / vertices as f64;
    let constraint_block = constraints(net, &start.signs, h);
    let fixed = options.boundary.fixed_vertices(net);
    let mut x = vec![0.0; 6 * vertices];
    for v in 0..vertices {
        x[6 * v..6 * v + 3].copy_from_slice(&net.positions()[v].to_array());
        x[6 * v + 3..6 * v + 6].copy_from_slice(&start.normals[v].to_array());
    }
    let weights = [Weight::new(1.0), Weight::new(1.0)];
    let problem = problem(net, reference, options, &constraint_block, [h, size], &weights, &fixed);
    let linear = |e: SolverError| NetError::Linear { what: "a joint step", message: e.to_string() };
    let mut system = System::new(problem, Factorization::Auto).map_err(linear)?;
    let mut history = Vec::new();
    let mut fairness = options.fairness;
    let mut interrupted = false;
    for (stage, &weight) in options.constraint_weights.iter().enumerate() {
        weights[0].set(weight);
        weights[1].set(fairness / (h * h));
        fairness = (fairness * options.fairness_decay).max(options.fairness_floor);
        let mut descent = Descent {
            stage,
            steps: options.steps_per_stage,
            energy_tol: 1e-6,
            damping: Damping::Diagonal(1e-9),
            observer: &mut observer,
        };
        if descent.run(&mut system, &mut x, &mut history).map_err(linear)? == Status::Interrupted {
            interrupted = true;
            break;
        }
    }
    drop(system);
    let (mut status, mut constraint_max, mut polish_steps) = (Status::Interrupted, None, 0);
    if !interrupted {
        let mut polish = Polish {
            projection: MinNormProjection::new(&constraint_block, 6 * vertices, 3)
                .map_err(linear)?,
            constraints: &constraint_block,
            fixed: &fixed,
            sizes: [h, size],
            options,
        };
        let before = x.clone();
        let mut report = polish.run(&mut x, 0.0).map_err(linear)?;
        if report.final_violation > options.polish_tol && fixed.contains(&true) {
            // No exact net has this boundary polygon, or none that is near.
            x = before;
            report = polish.run(&mut x, FIXED_SHARE).map_err(linear)?;
        }
        let exact = report.final_violation <= options.polish_tol;
        status = if exact { Status::Converged } else { Status::Stalled };
        constraint_max = Some([report.initial_violation, report.final_violation]);
        polish_steps = report.iterations;
    }
    let positions: Vec<DVec3> = (0..vertices).map(|v| POSITION.get(&x, v)).collect();
    let mut normals: Vec<DVec3> = (0..vertices).map(|v| NORMAL.get(&x, v)).collect();
    let net = net.clone().with_positions(&positions);
    balance(&net, &mut normals);
    let shape = shape_parameters(&net, &normals);
    let iterations = history.len() + polish_steps;
    let report =
        NetReport { status, iterations, history, constraint_max, wrong_twists: start.wrong };
    Ok((HyperbolicNet::new(net, Some(normals), shape)?, report))
}

fn problem<'a>(
    net: &QuadNet,
    reference: &'a dyn ClosestPoint,
    options: &JointOptions,
    constraints: &QuadraticConstraints,
    [h, size]: [f64; 2],
    [constraint_weight, fairness_weight]: &[Weight; 2],
    fixed: &[bool],
) -> Problem<'a> {
    let vertices = net.positions().len();
    let mut problem = Problem::new(6 * vertices);
    problem.variables_mut().set_runs(6);
    problem.add(Weighted { block: constraints.clone(), weight: constraint_weight.clone() });
    let curves = second_differences(net);
    let curves = || curves.iter().map(Vec::as_slice);
    let fixed_weight = |w: f64| Weight::new(w / (size * size));
    problem.add(Combinations::new("fairness", POSITION, curves(), fairness_weight.clone(), false));
    let normal_weight = fixed_weight(options.normal_fairness);
    problem.add(Combinations::new("normal fairness", NORMAL, curves(), normal_weight, true));
    let faces: Vec<[(usize, f64); 4]> = net
        .quads()
        .iter()
        .map(|q| [0, 1, 2, 3].map(|k| (q[k] as usize, if k % 2 == 0 { 1.0 } else { -1.0 })))
        .collect();
    let faces = faces.iter().map(<[_; 4]>::as_slice);
    problem.add(Combinations::new("shape", NORMAL, faces, fixed_weight(options.shape), true));
    let share = |v: usize| match options.relaxed.get(v) {
        Some(true) => options.relaxed_share,
        _ => 1.0,
    };
    let plane: Vec<f64> =
        (0..vertices).map(|v| (options.proximity * share(v)).sqrt() / h).collect();
    let root = options.point_share.sqrt();
    let (targets, curves) = targets(net, options.boundary);
    let point = (0..vertices)
        .map(|v| match &targets[v] {
            // An anchor is not loosened: only the surface is untrustworthy there.
            Target::Anchor(_) => (options.proximity * options.point_share).sqrt() / h,
            _ => root * plane[v],
        })
        .collect();
    problem.add(Proximity {
        layout: POSITION,
        reference,
        targets,
        curves,
        plane,
        point,
        curve: (10.0 * options.proximity).sqrt() / h,
        elements: Proximity::elements_for(POSITION, vertices),
        feet: Vec::new(),
        unit: 1.0,
    });
    for v in 0..vertices {
        if fixed[v] {
            (0..3).for_each(|c| {
                problem.variables_mut().fix_unknown(POSITION.column(v, c));
            });
        }
        let variables = problem.variables_mut();
        variables.set_range_size(6 * v..6 * v + 3, h);
        variables.set_range_size(6 * v + 3..6 * v + 6, size);
    }
    problem
}

/// Newton steps onto the constraints.
struct Polish<'a> {
    projection: MinNormProjection,
    constraints: &'a QuadraticConstraints,
    fixed: &'a [bool],
    /// Mean edge length and mean length of the normals.
    sizes: [f64; 2],
    options: &'a JointOptions,
}

impl Polish<'_> {
    /// Positions of fixed vertices move `willing` times as easily as others.
    fn run(&mut self, x: &mut [f64], willing: f64) -> Result<ProjectionReport, SolverError> {
        let [h, size] = self.sizes;
        let mut scale = vec![size; x.len()];
        for (v, &fixed) in self.fixed.iter().enumerate() {
            scale[6 * v..6 * v + 3].fill(if fixed { willing * h } else { h });
        }
        // Aimed below what counts as exact; round-off may end it before that.
        let options = ProjectionOptions {
            shift: POLISH_SHIFT,
            tolerance: 0.1 * self.options.polish_tol,
            max_iterations: self.options.polish_steps,
        };
        self.projection.project(self.constraints, x, &scale, &options)
    }
}

/// How much more reluctantly than the others fixed vertices move where they must.
const FIXED_SHARE: f64 = 0.1;

/// Shift of `J S Sᵀ Jᵀ` relative to its diagonal. Its rows depend on one another, since a net has
/// an equation too many for every face.
const POLISH_SHIFT: f64 = 1e-9;

/// Uses the freedom that a 2-colouring leaves, `ν → t ν` at one colour and `ν / t` at the other, to
/// bring the shape parameters nearest to 1 (Shi et al. 2014, Eq. 11). Edges do not change.
fn balance(net: &QuadNet, normals: &mut [DVec3]) {
    let Some(colours) = net.colours() else { return };
    let shape = shape_parameters(net, normals);
    let components = net.components().iter().max().map_or(0, |c| c + 1);
    for component in 0..components {
        let sign = |q: &[u32; 4]| if colours[q[0] as usize] { 1.0 } else { -1.0 };
        let pairs: Vec<(f64, f64)> = net
            .quads()
            .iter()
            .zip(&shape)
            .filter(|(q, _)| net.components()[q[0] as usize] == component)
            .map(|(q, w)| (w.ln(), sign(q)))
            .collect();
        // W falls by t² where the diagonal's ends are multiplied by t.
        let t = (-0.5 * best_log_factor(&pairs)).exp();
        for v in (0..normals.len()).filter(|&v| net.components()[v] == component) {
            normals[v] *= if colours[v] { t } else { 1.0 / t };
        }
    }
}
