//! Positions and Lelieuvre normals together: an exact hyperbolic net on any topology.
//!
//! Optimises positions and Lelieuvre normals `ν` of a net so that `x_j − x_i = ± ν_i × ν_j` on
//! every edge, plus for one family and minus for the other. Vertex stars are then planar (both ends
//! of an edge are orthogonal to it), and with `W = |ν₁ + ν₃| / |ν₀ + ν₂|` all patches join smoothly.
//! Because the normals are single-valued this includes the closing conditions around holes and
//! handles, which alternating between vertices and shape parameters cannot meet.

use gp_solver::{
    BlockId, Extra, Factorization, Group, Method as StepMethod, Options as SolverOptions, Problem,
    Regularization, Run, SolverError, Stage, StageReport, Status, System, Variables,
};

use super::polish::Polish;
use super::solved::{Solved, run_report};
use super::watch::Watch;
use crate::blocks::{Combinations, Proximity, ProximityWeights, Target, Targets, edge_equations};
use crate::error::Error;
use crate::input::Input;
use crate::net::{
    AsymptoticField, HyperbolicNet, LelieuvreStart, QuadNet, best_log_factor, second_differences,
    shape_parameters,
};
use crate::options::Options;
use crate::vectors::{fix_boundary, unknowns, vectors};
use geom_core::DVec3;

/// Name of the last stage of the joint method, in which the exact equations are met.
pub const POLISH: &str = "polish";

/// A stage ends when a step lowers the energy by less than this share of it.
const ENERGY_TOL: f64 = 1e-6;
/// What makes the normal equations regular, as a share of their diagonal.
const REGULARIZATION: f64 = 1e-9;

/// A net with everything its problems are made of.
pub(crate) struct Joint<'i> {
    input: &'i Input<'i>,
    options: &'i Options,
    start: LelieuvreStart,
    relaxed: Vec<bool>,
    /// Mean edge length, and mean length of the normals.
    sizes: [f64; 2],
    variables: Variables,
    positions: Group,
    normals: Group,
}

/// The blocks that every stage weighs anew.
struct Weighed {
    equations: BlockId,
    fairness: BlockId,
}

impl<'i> Joint<'i> {
    pub(crate) fn new(
        input: &'i Input<'i>,
        options: &'i Options,
        field: &AsymptoticField<'_>,
    ) -> Result<Self, Error> {
        let net = input.net();
        let start = LelieuvreStart::new(net)?;
        let vertices = net.positions().len() as f64;
        let h = net.mesh().mean_edge_length();
        let size = start.normals.iter().map(|n| n.length()).sum::<f64>() / vertices;
        let (mut variables, positions, normals) = unknowns(net, options);
        let normals = normals.map_or_else(|| variables.group(crate::NORMALS), Ok)?;
        variables.set_size(positions, h).set_size(normals, size);
        let relaxed = input.relaxed(field);
        Ok(Self { input, options, start, relaxed, sizes: [h, size], variables, positions, normals })
    }

    /// Number of the polishing, after the weighted stages.
    fn last(&self) -> usize {
        self.options.constraint_weights.len()
    }

    fn stage(&self, number: usize) -> Stage {
        let name = match self.options.constraint_weights.get(number) {
            Some(weight) => format!("weight {weight}"),
            None => POLISH.to_owned(),
        };
        let stage = Stage::new(name, number, self.last() + 1);
        self.input
            .place()
            .map_or(stage.clone(), |place| stage.at(place.center().to_array(), place.scale()))
    }

    fn first_x(&self) -> Vec<f64> {
        let mut x = vec![0.0; self.variables.len()];
        for (v, (p, n)) in self.input.net().positions().iter().zip(&self.start.normals).enumerate()
        {
            self.positions.set(&mut x, v, p.to_array());
            self.normals.set(&mut x, v, n.to_array());
        }
        x
    }

    /// Weight of the fairness in a stage.
    fn fairness(&self, stage: usize) -> f64 {
        let Options { fairness_decay, fairness_floor, .. } = *self.options;
        let decayed = |w: f64, _| (w * fairness_decay).max(fairness_floor);
        (0..stage).fold(self.options.fairness_weight(), decayed)
    }

    fn equations(&self) -> gp_solver::QuadraticConstraints {
        let [h, _] = self.sizes;
        let (net, signs) = (self.input.net(), &self.start.signs);
        edge_equations(net, signs, self.positions, self.normals, h)
    }

    /// The problem of the weighted stages, weighed for the first.
    pub(crate) fn problem(&self) -> Result<Problem<'i>, Error> {
        let (mut problem, weighed) = self.weighted_problem()?;
        let (equations, fairness) = self.weights(0);
        problem.set_weight(weighed.equations, equations)?;
        problem.set_weight(weighed.fairness, fairness)?;
        Ok(problem)
    }

    /// What multiplies the rows of the equations and of the fairness in a stage.
    fn weights(&self, stage: usize) -> (f64, f64) {
        let [h, _] = self.sizes;
        let equations = self.options.constraint_weights.get(stage).copied().unwrap_or(1.0);
        (equations.sqrt(), (self.fairness(stage) / (h * h)).sqrt())
    }

    fn weighted_problem(&self) -> Result<(Problem<'i>, Weighed), Error> {
        let (net, options, [_, size]) = (self.input.net(), self.options, self.sizes);
        let mut variables = self.variables.clone();
        fix_boundary(&mut variables, self.positions, net, options.boundary);
        let mut problem = Problem::new(variables);
        let equations = problem.add(self.equations());
        let curves = second_differences(net);
        let curves = || curves.iter().map(Vec::as_slice);
        let fair = Combinations::new("fairness", self.positions, curves());
        let fairness = problem.add(fair.with_changing_weight());
        let scaled = |w: f64| (w / (size * size)).sqrt();
        let id = problem.add(Combinations::new("normal fairness", self.normals, curves()));
        problem.set_weight(id, scaled(options.normal_fairness))?;
        let faces: Vec<[(usize, f64); 4]> = net
            .quads()
            .iter()
            .map(|q| [0, 1, 2, 3].map(|k| (q[k] as usize, if k % 2 == 0 { 1.0 } else { -1.0 })))
            .collect();
        let faces = faces.iter().map(<[_; 4]>::as_slice);
        let id = problem.add(Combinations::new("shape", self.normals, faces));
        problem.set_weight(id, scaled(options.shape_weight()))?;
        problem.add(self.proximity());
        Ok((problem, Weighed { equations, fairness }))
    }

    fn proximity(&self) -> Proximity<'i> {
        let (net, options, [h, _]) = (self.input.net(), self.options, self.sizes);
        let (proximity, point_share) = (options.proximity_weight(), options.point_weight());
        let share = |relaxed: &bool| if *relaxed { options.relaxed_share } else { 1.0 };
        let plane: Vec<f64> =
            self.relaxed.iter().map(|r| (proximity * share(r)).sqrt() / h).collect();
        let root = point_share.sqrt();
        let targets = Targets::new(net, options.boundary);
        let point = |(target, plane): (&Target, &f64)| match target {
            // An anchor is not loosened: only the surface is untrustworthy there.
            Target::Anchor(_) => (proximity * point_share).sqrt() / h,
            _ => root * plane,
        };
        let point = targets.of_vertices.iter().zip(&plane).map(point).collect();
        let weights = ProximityWeights { plane, point, curve: (10.0 * proximity).sqrt() / h };
        Proximity::new(self.positions, 1.0, self.input.reference(), targets, weights)
    }

    /// Runs all stages.
    pub(crate) fn solve(
        &self,
        extra: &mut Extra<'_, Error>,
        watch: &mut Watch<'_>,
    ) -> Result<Solved, Error> {
        let resume = watch.begin()?;
        let (first, mut x) = match &resume {
            Some(state) => (state.stage, state.numbers("x", self.variables.len())?.to_vec()),
            None => (0, self.first_x()),
        };
        if first > self.last() {
            let what = "a run with more stages".to_owned();
            return Err(SolverError::ForeignCheckpoint { what }.into());
        }
        let before = watch.steps();
        let mut stages = Vec::new();
        if first < self.last() {
            let (mut problem, weighed) = self.weighted_problem()?;
            let variables = problem.variables().clone();
            extra(&self.stage(0), &variables, &mut problem)?;
            let mut system = self.linear(System::new(problem, Factorization::Auto))?;
            for number in first..self.last() {
                let (equations, fairness) = self.weights(number);
                weigh(&mut system, weighed.equations, equations)?;
                weigh(&mut system, weighed.fairness, fairness)?;
                let mut run = self.linear(Run::new(system, &x, &self.solver_options()))?;
                if let Some(state) = resume.as_ref().filter(|_| number == first) {
                    run.resume(state)?;
                }
                let stage = self.stage(number);
                let status = self.linear(run.go_on(&stage, watch))?;
                watch.add_steps(run.iterations());
                stages.push(StageReport { stage, solver: run.report(status) });
                (system, x) = run.into_parts();
                if status == Status::Interrupted {
                    return self.finish(&x, run_report(status, before, stages), None);
                }
            }
        }
        let stage = self.stage(self.last());
        watch.offer(&stage, &x);
        let polish = self.polish(&stage, extra)?;
        let (report, violation) = self.linear(polish.run(&mut x, &stage, watch))?;
        let status = match report.status {
            Status::Interrupted => Status::Interrupted,
            _ if violation[1] <= self.options.polish_tol => Status::Converged,
            _ => Status::Stalled,
        };
        stages.push(StageReport { stage, solver: report });
        self.finish(&x, run_report(status, before, stages), Some(violation))
    }

    fn polish(&self, stage: &Stage, extra: &mut Extra<'_, Error>) -> Result<Polish<'i>, Error> {
        let mut problem = Problem::new(self.variables.clone());
        problem.add(self.equations());
        extra(stage, &self.variables, &mut problem)?;
        let mut boundary = self.variables.clone();
        fix_boundary(&mut boundary, self.positions, self.input.net(), self.options.boundary);
        Ok(Polish {
            problem,
            reluctant: boundary.fixed().to_vec(),
            steps: self.options.polish_steps,
            tolerance: self.options.polish_tol,
        })
    }

    fn solver_options(&self) -> SolverOptions {
        let regularization = Regularization::Diagonal(REGULARIZATION);
        SolverOptions {
            method: StepMethod::GaussNewton { regularization },
            max_iterations: self.options.steps_per_stage,
            gradient_tol: 0.0,
            step_tol: 0.0,
            energy_tol: ENERGY_TOL,
            ..SolverOptions::default()
        }
    }

    fn linear<T>(&self, result: Result<T, SolverError>) -> Result<T, Error> {
        result.map_err(|source| Error::Linear { what: "a joint step", source })
    }

    fn finish(
        &self,
        x: &[f64],
        report: gp_solver::RunReport,
        violation: Option<[f64; 2]>,
    ) -> Result<Solved, Error> {
        let net = self.input.net().clone().with_positions(&vectors(self.positions, x));
        let mut normals = vectors(self.normals, x);
        balance(&net, &mut normals);
        let shape = shape_parameters(&net, &normals);
        Ok(Solved { result: HyperbolicNet::new(net, Some(normals), shape)?, report, violation })
    }
}

/// Weighs a block, unless the caller has taken it out.
fn weigh(system: &mut System<'_>, block: BlockId, weight: f64) -> Result<(), SolverError> {
    if system.problem().weight(block).is_ok() {
        system.set_weight(block, weight)?;
    }
    Ok(())
}

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
