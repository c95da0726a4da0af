//! The published pipeline: planar vertex stars, then shape parameters and vertices in turn
//! (Shi et al. 2014, §3.2). Kept to compare with; the joint method is exact.

use geom_core::DVec3;
use gp_solver::{
    BlockId, Extra, Factorization, Group, Method as StepMethod, Options as SolverOptions, Problem,
    Regularization, Run, SolverError, Stage, StageReport, Status, System, Variables,
};

use super::solved::{Solved, run_report};
use super::watch::Watch;
use crate::blocks::{
    Combinations, FramePoints, Proximity, ProximityWeights, QuadDistances, Targets, star_equations,
};
use crate::error::Error;
use crate::input::Input;
use crate::net::{
    HyperbolicNet, fit_shape_parameters, kinks, second_differences, third_differences,
};
use crate::options::{FairnessOrder, Options};
use crate::vectors::{fix_boundary, unknowns, vectors};

/// A round ends when a step lowers the energy by less than this share of it.
const ENERGY_TOL: f64 = 1e-9;
/// Weight of the distance to the last iterate, in mean edge lengths.
const LAST_ITERATE: f64 = 1e-3;

/// A net with everything its problems are made of. Unknown positions are those of the model divided
/// by the mean edge length.
pub(crate) struct Published<'i> {
    input: &'i Input<'i>,
    options: &'i Options,
    /// Mean edge length.
    h: f64,
    variables: Variables,
    positions: Group,
    normals: Option<Group>,
}

impl<'i> Published<'i> {
    pub(crate) fn new(input: &'i Input<'i>, options: &'i Options) -> Self {
        let h = input.net().mesh().mean_edge_length();
        let (mut variables, positions, normals) = unknowns(input.net(), options);
        fix_boundary(&mut variables, positions, input.net(), options.boundary);
        Self { input, options, h, variables, positions, normals }
    }

    fn stage(&self, round: usize) -> Stage {
        let name = match round {
            0 => "planar stars".to_owned(),
            _ => format!("round {round}"),
        };
        let stage = Stage::new(name, round, self.options.rounds + 1);
        let (center, scale) = self
            .input
            .place()
            .map_or(([0.0; 3], 1.0), |place| (place.center().to_array(), place.scale()));
        stage.at(center, scale / self.h)
    }

    fn first_x(&self) -> Vec<f64> {
        let net = self.input.net();
        let mut x = vec![0.0; self.variables.len()];
        for (v, p) in net.positions().iter().enumerate() {
            self.positions.set(&mut x, v, (*p / self.h).to_array());
        }
        if let Some(group) = self.normals {
            for (v, n) in net.vertex_normals(net.positions()).iter().enumerate() {
                group.set(&mut x, v, n.to_array());
            }
        }
        x
    }

    /// Star planarity, fairness and proximity (ibid., Eq. 10).
    pub(crate) fn problem(&self) -> Result<Problem<'i>, Error> {
        let (net, options) = (self.input.net(), self.options);
        let mut problem = Problem::new(self.variables.clone());
        match self.normals {
            None => {
                let plain = |v| [(v, 1.0), (v, 0.0)];
                let quads = net.star_quads().into_iter().map(|q| q.map(plain));
                problem.add(QuadDistances::new("planar stars", self.positions, quads));
            }
            Some(normals) => {
                problem.add(star_equations(net, self.positions, normals));
            }
        }
        let rows = match options.fairness_order {
            FairnessOrder::Second => second_differences(net),
            FairnessOrder::Third => third_differences(net),
        };
        let rows = rows.iter().map(Vec::as_slice);
        let fairness = problem.add(Combinations::new("fairness", self.positions, rows));
        problem.set_weight(fairness, options.fairness_weight().sqrt())?;
        let (proximity, share) = (options.proximity_weight(), options.point_weight());
        let vertices = net.positions().len();
        let weights = ProximityWeights {
            plane: vec![proximity.sqrt(); vertices],
            point: vec![(proximity * share).sqrt(); vertices],
            curve: 1.0,
        };
        let targets = Targets::new(net, options.boundary);
        let reference = self.input.reference();
        problem.add(Proximity::new(self.positions, self.h, reference, targets, weights));
        Ok(problem)
    }

    fn frame_points(&self, shape: &[f64]) -> FramePoints {
        FramePoints::new(self.input.net(), self.positions, shape)
    }

    /// The problem of a round as it is planned, with the frame points if there are some.
    fn planned(
        &self,
        round: usize,
        shape: &[f64],
        extra: &mut Extra<'_, Error>,
    ) -> Result<(System<'i>, Option<BlockId>), Error> {
        let mut problem = self.problem()?;
        let mut frame = None;
        if round > 0 {
            let id = problem.add(self.frame_points(shape));
            problem.set_weight(id, self.options.frame_weight().sqrt())?;
            frame = Some(id);
        }
        extra(&self.stage(round.min(1)), &self.variables, &mut problem)?;
        Ok((self.linear(System::new(problem, Factorization::Auto))?, frame))
    }

    /// Runs all rounds.
    pub(crate) fn solve(
        &self,
        extra: &mut Extra<'_, Error>,
        watch: &mut Watch<'_>,
    ) -> Result<Solved, Error> {
        let (net, options) = (self.input.net(), self.options);
        let resume = watch.begin()?;
        let mut first = 0;
        let mut x = self.first_x();
        // Largest kink after every round, and the shape parameters of the last one.
        let (mut largest, mut shape) = (Vec::new(), Vec::new());
        if let Some(state) = &resume {
            first = state.stage;
            x = state.numbers("x", x.len())?.to_vec();
            if first > 0 {
                largest = state.numbers("kinks", first)?.to_vec();
                shape = state.numbers("shape", net.quads().len())?.to_vec();
                watch.keep("kinks", &largest);
                watch.keep("shape", &shape);
            }
        }
        let before = watch.steps();
        let mut stages = Vec::new();
        let mut status = Status::IterationLimit;
        // The topology changes only once, when the frame points join: two symbolic factorisations.
        let mut planned: Option<(System<'i>, Option<BlockId>)> = None;
        for round in first..=options.rounds {
            let (system, frame) = match planned.take() {
                Some((mut system, frame)) if round != 1 => {
                    if let Some(id) = frame.filter(|id| system.problem().weight(*id).is_ok()) {
                        system.replace(id, self.frame_points(&shape))?;
                    }
                    (system, frame)
                }
                _ => self.planned(round, &shape, extra)?,
            };
            let mut run = self.linear(Run::new(system, &x, &self.solver_options(round)))?;
            if let Some(state) = resume.as_ref().filter(|_| round == first) {
                run.resume(state)?;
            }
            let stage = self.stage(round);
            let end = self.linear(run.go_on(&stage, watch))?;
            watch.add_steps(run.iterations());
            stages.push(StageReport { stage, solver: run.report(end) });
            let (system, now) = run.into_parts();
            (planned, x) = (Some((system, frame)), now);
            let at = self.model_positions(&x);
            shape = fit_shape_parameters(net, &at, options.spread)?.shape;
            largest.push(kinks(net, &at, &shape).into_iter().fold(0.0, f64::max));
            watch.keep("kinks", &largest);
            watch.keep("shape", &shape);
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
        let result = net.clone().with_positions(&self.model_positions(&x));
        let result = HyperbolicNet::new(result, None, shape)?;
        Ok(Solved { result, report: run_report(status, before, stages), violation: None })
    }

    fn model_positions(&self, x: &[f64]) -> Vec<DVec3> {
        vectors(self.positions, x).into_iter().map(|p| p * self.h).collect()
    }

    fn solver_options(&self, round: usize) -> SolverOptions {
        let Options { first_steps, steps_per_round, .. } = *self.options;
        let regularization = Regularization::Constant(LAST_ITERATE);
        SolverOptions {
            method: StepMethod::GaussNewton { regularization },
            max_iterations: if round == 0 { first_steps } else { steps_per_round },
            gradient_tol: 0.0,
            step_tol: 0.0,
            energy_tol: ENERGY_TOL,
            ..SolverOptions::default()
        }
    }

    fn linear<T>(&self, result: Result<T, SolverError>) -> Result<T, Error> {
        result.map_err(|source| Error::Linear { what: "a published step", source })
    }
}
