//! The published pipeline: planar vertex stars, then shape parameters and vertices in turn
//! (Shi et al. 2014, §3.2). Kept to compare with; [`crate::solve_joint`] is exact.

use crate::blocks::{
    Combinations, Layout, Proximity, Target, Weight, second_differences, third_differences,
};
use crate::boundary::{Boundary, targets};
use crate::descend::{Damping, Descent, StepRecord};
use crate::hyperbolic_net::kinks;
use crate::joint::NetReport;
use crate::lelieuvre::signs;
use crate::quad_distance::{Mix, QuadDistances};
use crate::{HyperbolicNet, NetError, QuadNet, Spread, fit_shape_parameters};
use geom_core::{ClosestPoint, DVec3};
use gp_solver::{
    Elements, Factorization, Problem, QuadraticBuilder, ResidualBlock, SolverError, Status, System,
};
use std::ops::ControlFlow;
use std::sync::{Arc, Mutex, PoisonError};

/// How the planarity of vertex stars is written.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum StarPlanarity {
    /// Distances of the diagonals of valence − 2 quads per star, the paper's choice.
    #[default]
    Quads,
    /// A unit normal per vertex as further unknowns, orthogonal to the edges (Deng et al. 2011).
    Normals,
}

/// Which differences along the curves of the net are to be small.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum FairnessOrder {
    /// Second differences.
    #[default]
    Second,
    /// Third differences: allows constant curvature.
    Third,
}

/// Settings of [`solve_published`]; lengths are counted in mean edge lengths.
#[derive(Clone, Debug, PartialEq)]
pub struct PublishedOptions {
    /// How star planarity is written.
    pub planarity: StarPlanarity,
    /// Order of fairness.
    pub fairness_order: FairnessOrder,
    /// Weight of fairness, the paper's λ₁.
    pub fairness: f64,
    /// Weight of proximity, the paper's λ₂.
    pub proximity: f64,
    /// Weight of the distance to the nearest point, as a share of `proximity`; the rest is the
    /// distance to the tangent plane.
    pub point_share: f64,
    /// Weight of the frame points' planarity, the paper's λ₃.
    pub frame: f64,
    /// What happens at the boundary.
    pub boundary: Boundary,
    /// How shape parameters are found.
    pub spread: Spread,
    /// Largest number of Gauss-Newton steps towards planar stars; they end early once a step
    /// lowers the energy by `≤ 1e-9` of it.
    pub first_steps: usize,
    /// Rounds of shape parameters and vertices in turn.
    pub rounds: usize,
    /// Largest number of steps in each round.
    pub steps_per_round: usize,
    /// The status is [`Status::Converged`] if the last round changes the largest kink by
    /// `≤ kink_tol` of it.
    pub kink_tol: f64,
}

impl Default for PublishedOptions {
    fn default() -> Self {
        Self {
            planarity: StarPlanarity::default(),
            fairness_order: FairnessOrder::default(),
            fairness: 0.6,
            proximity: 0.04,
            point_share: 0.09,
            frame: 0.6,
            boundary: Boundary::Anchored,
            spread: Spread::LeastSquares,
            first_steps: 15,
            rounds: 6,
            steps_per_round: 5,
            kink_tol: 0.02,
        }
    }
}

/// Flattens the vertex stars of a net, extends it by shape parameters, and improves both in turn.
///
/// Kinks remain: alternating meets the closing conditions around holes only by least squares, and
/// fairness pulls on the stars as strongly as planarity.
///
/// # Errors
/// [`NetError`] if a linear system cannot be solved.
pub fn solve_published(
    net: &QuadNet,
    reference: &dyn ClosestPoint,
    options: &PublishedOptions,
    mut observer: impl FnMut(&StepRecord) -> ControlFlow<()>,
) -> Result<(HyperbolicNet, NetReport), NetError> {
    let linear =
        |e: SolverError| NetError::Linear { what: "a published step", message: e.to_string() };
    let h = net.mesh().mean_edge_length();
    let vertices = net.positions().len();
    let layout = match options.planarity {
        StarPlanarity::Quads => Layout { stride: 3, offset: 0 },
        StarPlanarity::Normals => Layout { stride: 6, offset: 0 },
    };
    let normals = net.vertex_normals(net.positions());
    let (_, wrong_twists) = signs(net, net.positions(), &normals);
    let mut x = vec![0.0; layout.stride * vertices];
    for v in 0..vertices {
        let at = layout.column(v, 0);
        x[at..at + 3].copy_from_slice(&(net.positions()[v] / h).to_array());
        if options.planarity == StarPlanarity::Normals {
            x[at + 3..at + 6].copy_from_slice(&normals[v].to_array());
        }
    }
    let mut history = Vec::new();
    let mut largest = Vec::new();
    let mut status = Status::IterationLimit;
    let positions =
        |x: &[f64]| -> Vec<DVec3> { (0..vertices).map(|v| layout.get(x, v) * h).collect() };
    let mut shape = Vec::new();
    // Topology changes only once, when the frame points join: two symbolic factorisations.
    let frame_shape = Arc::new(Mutex::new(Vec::new()));
    let mut system = None;
    for round in 0..=options.rounds {
        if round <= 1 {
            let mut problem = base_problem(net, reference, options, layout, h);
            if round == 1 {
                let shared = Arc::clone(&frame_shape);
                problem.add(FramePoints::new(net, layout, options.frame, shared));
            }
            system = Some(System::new(problem, Factorization::Auto).map_err(linear)?);
        }
        let Some(system) = &mut system else { break };
        let mut descent = Descent {
            stage: round,
            steps: if round == 0 { options.first_steps } else { options.steps_per_round },
            energy_tol: 1e-9,
            damping: Damping::Constant(1e-3),
            observer: &mut observer,
        };
        let end = descent.run(system, &mut x, &mut history).map_err(linear)?;
        let at = positions(&x);
        shape = fit_shape_parameters(net, &at, options.spread)?.shape;
        frame_shape.lock().unwrap_or_else(PoisonError::into_inner).clone_from(&shape);
        largest.push(kinks(net, &at, &shape).into_iter().fold(0.0, f64::max));
        if end == Status::Interrupted {
            status = end;
            break;
        }
    }
    if let [.., before, last] = largest[..]
        && status != Status::Interrupted
        && (before - last).abs() <= options.kink_tol * before
    {
        status = Status::Converged;
    }
    let net = net.clone().with_positions(&positions(&x));
    let iterations = history.len();
    let report = NetReport { status, iterations, history, constraint_max: None, wrong_twists };
    Ok((HyperbolicNet::new(net, None, shape)?, report))
}

/// Star planarity, fairness and proximity (ibid., Eq. 10), positions in mean edge lengths.
fn base_problem<'a>(
    net: &'a QuadNet,
    reference: &'a dyn ClosestPoint,
    options: &PublishedOptions,
    layout: Layout,
    h: f64,
) -> Problem<'a> {
    let vertices = net.positions().len();
    let mut problem = Problem::new(layout.stride * vertices);
    problem.variables_mut().set_runs(layout.stride);
    match options.planarity {
        StarPlanarity::Quads => {
            let plain = |v| [(v, 1.0), (v, 0.0)];
            let quads = net.star_quads().into_iter().map(|q| q.map(plain));
            problem.add(QuadDistances::new("planar stars", layout, quads, Weight::new(1.0)));
        }
        StarPlanarity::Normals => {
            problem.add(star_normals(net, layout));
        }
    }
    let rows = match options.fairness_order {
        FairnessOrder::Second => second_differences(net),
        FairnessOrder::Third => third_differences(net),
    };
    let rows = rows.iter().map(Vec::as_slice);
    let weight = Weight::new(options.fairness);
    problem.add(Combinations::new("fairness", layout, rows, weight, true));
    let (targets, curves) = targets(net, options.boundary);
    let plane = options.proximity.sqrt();
    let point = (options.proximity * options.point_share).sqrt();
    let fixed: Vec<usize> = options
        .boundary
        .fixed_vertices(net)
        .iter()
        .enumerate()
        .filter_map(|(v, &f)| (f && matches!(targets[v], Target::Anchor(_))).then_some(v))
        .collect();
    problem.add(Proximity {
        layout,
        reference,
        targets,
        curves,
        plane: vec![plane; vertices],
        point: vec![point; vertices],
        curve: 1.0,
        elements: Proximity::elements_for(layout, vertices),
        feet: Vec::new(),
        unit: h,
    });
    for v in fixed {
        for c in 0..3 {
            problem.variables_mut().fix_unknown(layout.column(v, c));
        }
    }
    problem
}

/// `n_i · (x_j − x_i) = 0` for all neighbours and `n_i · n_i = 1`.
fn star_normals(net: &QuadNet, layout: Layout) -> gp_solver::QuadraticConstraints {
    let normal = Layout { stride: layout.stride, offset: 3 };
    let mut builder = QuadraticBuilder::new("planar stars");
    for v in 0..net.positions().len() {
        for w in net.ring(v) {
            let equation = builder.equation(1.0);
            for c in 0..3 {
                equation.product(normal.column(v, c), layout.column(w, c), 1.0).product(
                    normal.column(v, c),
                    layout.column(v, c),
                    -1.0,
                );
            }
        }
        let unit = builder.equation(1.0);
        for c in 0..3 {
            unit.product(normal.column(v, c), normal.column(v, c), 1.0);
        }
        unit.constant(-1.0);
    }
    builder.build()
}

/// Distances of the diagonals of the frame points of both patches at every inner edge, with the
/// ends of the edge (ibid., §3.2, step 3). Shape parameters are those of the last round.
struct FramePoints<'a> {
    net: &'a QuadNet,
    quads: QuadDistances,
    shape: Arc<Mutex<Vec<f64>>>,
}

impl<'a> FramePoints<'a> {
    fn new(net: &'a QuadNet, layout: Layout, weight: f64, shape: Arc<Mutex<Vec<f64>>>) -> Self {
        let equal = vec![1.0; net.quads().len()];
        let quads = frame_quads(net, &equal);
        let quads = QuadDistances::new("frame points", layout, quads, Weight::new(weight));
        Self { net, quads, shape }
    }
}

impl ResidualBlock for FramePoints<'_> {
    fn name(&self) -> &str {
        self.quads.name()
    }

    fn elements(&self) -> &Elements {
        self.quads.elements()
    }

    fn refresh(&mut self, _: &[f64]) {
        let shape = self.shape.lock().unwrap_or_else(PoisonError::into_inner);
        self.quads.set_mixes(frame_quads(self.net, &shape));
    }

    fn residuals(&self, x: &[f64], residuals: &mut [f64]) {
        self.quads.residuals(x, residuals);
    }

    fn linearize(&self, x: &[f64], residuals: &mut [f64], jacobian: &mut [f64]) {
        self.quads.linearize(x, residuals, jacobian);
    }
}

/// The frame points of both patches at every inner edge, with the ends of the edge.
fn frame_quads<'a>(net: &'a QuadNet, shape: &'a [f64]) -> impl Iterator<Item = [Mix; 4]> + 'a {
    net.inner_edges().iter().map(move |e| {
        let through = |side: usize| shape[e.faces[side]].powf(e.exponents[side]);
        let (l, r) = (through(0), through(1));
        let b = e.b;
        [
            [(b[0], 1.0), (b[0], 0.0)],
            [(b[1], 1.0 / (1.0 + l)), (b[2], l / (1.0 + l))],
            [(b[3], 1.0), (b[3], 0.0)],
            [(b[5], 1.0 / (1.0 + r)), (b[4], r / (1.0 + r))],
        ]
    })
}
