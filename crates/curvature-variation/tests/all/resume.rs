//! Stopping and going on: the same bytes, and soon.

use curvature_variation::{Constraints, Input, Method, Options, Solution, solve};
use fixtures::quad_graphs;
use geom_core::DVec3;
use gp_solver::{Checkpoint, Observer, Progress, Status};
use std::ops::ControlFlow;
use std::time::{Duration, Instant};

/// Stops after so many steps and keeps the last checkpoint.
#[derive(Default)]
struct Keeper {
    steps_left: Option<usize>,
    last: Option<Checkpoint>,
    from: Option<Checkpoint>,
    steps: usize,
}

impl Observer for Keeper {
    fn step(&mut self, progress: &Progress<'_>) -> ControlFlow<()> {
        if let Ok(vertices) = progress.stage.name.parse::<usize>() {
            assert_eq!(progress.x.len(), 3 * vertices);
        }
        self.steps += 1;
        if self.steps_left.is_some_and(|left| self.steps > left) {
            return ControlFlow::Break(());
        }
        ControlFlow::Continue(())
    }

    fn checkpoint(&mut self, state: &dyn Fn() -> Checkpoint) {
        // As a file would keep it.
        let text = serde_json::to_string(&state()).expect("plain numbers");
        self.last = Some(serde_json::from_str(&text).expect("what was written"));
    }

    fn resume(&mut self) -> Option<Checkpoint> {
        self.from.take()
    }
}

fn bits(solution: &Solution) -> Vec<[u64; 3]> {
    solution.result.positions().iter().map(|p| p.to_array().map(f64::to_bits)).collect()
}

fn ends_with_the_same_bytes(input: &Input, options: &Options) {
    let mut whole = Keeper::default();
    let want = solve(input, options, &mut whole).expect("it can be faired");
    assert!(whole.steps > 4, "{} steps", whole.steps);
    for moment in 0..10 {
        let steps = moment * whole.steps / 10;
        let mut first = Keeper { steps_left: Some(steps), ..Keeper::default() };
        let stopped = solve(input, options, &mut first).expect("it can be faired");
        assert_eq!(stopped.report.status, Status::Interrupted, "after {steps}");
        let mut second = Keeper { from: first.last, ..Keeper::default() };
        let got = solve(input, options, &mut second).expect("it can be faired");
        assert_eq!(bits(&got), bits(&want), "after {steps} of {}", whole.steps);
        assert_eq!(got.report.status, want.report.status);
        assert_eq!(got.report.iterations, want.report.iterations, "after {steps}");
        assert_eq!(got.levels, want.levels);
        let same = |s: &Solution| {
            let m = &s.metrics;
            (m.energies.clone(), m.energy_initial, m.gradient_norm, s.extrapolated)
        };
        assert_eq!(same(&got), same(&want), "after {steps}");
    }
}

#[test]
fn lagged_gauss_newton_is_resumed_to_the_bit() {
    let options = Options { levels: 2, iterations: 70, ..Options::default() };
    ends_with_the_same_bytes(&Input::from(quad_graphs::theta_graph(3)), &options);
}

#[test]
fn other_methods_and_constraints_are_resumed_to_the_bit() {
    let mesh = quad_graphs::ellipsoid(3, DVec3::new(1.0, 1.2, 1.4));
    for method in [Method::GaussNewton, Method::Sobolev, Method::Lbfgs] {
        let options = Options {
            energy: "bending".parse().expect("an energy"),
            levels: 1,
            iterations: 50,
            method,
            ..Options::default()
        };
        ends_with_the_same_bytes(&Input::from(mesh.clone()), &options);
        let constraints = Constraints {
            limit_points: vec![(0, Some([-1.0, -1.0, -1.0])), (7, None)],
            tangent_planes: vec![(0, Some([-1.0, -1.0, -1.5]))],
            weights: vec![(9, 10.0)],
            ..Constraints::default()
        };
        let pinned = Input { constraints, ..Input::from(mesh.clone()) };
        ends_with_the_same_bytes(&pinned, &Options { iterations: 20, levels: 0, ..options });
    }
}

#[test]
fn families_are_resumed_to_the_bit() {
    let member = |small| quad_graphs::torus(12, 8, 1.0, small);
    let members = vec![member(0.6), quad_graphs::torus(12, 8, 1.3, 0.4)];
    let family = Input { members, ..Input::from(member(0.3)) };
    let options = Options { levels: 1, ..Options::default() };
    ends_with_the_same_bytes(&family, &options);
    let mut first = Keeper { steps_left: Some(3), ..Keeper::default() };
    solve(&family, &options, &mut first).expect("it can be faired");
    let mut second = Keeper { from: first.last, ..Keeper::default() };
    let other = Options { levels: 0, ..options };
    let error = solve(&family, &other, &mut second).expect_err("other options").to_string();
    assert!(error.contains("another input or other options"), "{error}");
}

#[test]
fn checkpoints_of_other_runs_are_refused() {
    let input = Input::from(quad_graphs::torus(10, 8, 1.0, 0.4));
    let options = Options { levels: 0, iterations: 5, ..Options::default() };
    let mut keeper = Keeper::default();
    solve(&input, &options, &mut keeper).expect("a torus");
    let last = keeper.last;
    let other = Options { energy: "bending".parse().expect("an energy"), ..options.clone() };
    let mut again = Keeper { from: last.clone(), ..Keeper::default() };
    let error = solve(&input, &other, &mut again).expect_err("other options").to_string();
    assert!(error.contains("another input or other options"), "{error}");
    // More steps are no other run.
    let more = Options { iterations: 12, ..options };
    let mut longer = Keeper { from: last, ..Keeper::default() };
    let got = solve(&input, &more, &mut longer).expect("a torus");
    assert!(got.report.iterations > 5 && got.report.iterations <= 12);
}

/// Asks to stop from the `left`-th question on.
struct Stop {
    left: usize,
    asked: usize,
    since: Option<Instant>,
}

impl Observer for Stop {
    fn stop_requested(&mut self) -> bool {
        self.asked += 1;
        if self.asked <= self.left {
            return false;
        }
        self.since.get_or_insert_with(Instant::now);
        true
    }
}

#[test]
fn a_request_to_stop_is_heeded_anywhere_within_a_second() {
    let input = Input::from(quad_graphs::ellipsoid(5, DVec3::new(1.0, 1.3, 1.7)));
    let options = Options { levels: 1, iterations: 6, ..Options::default() };
    let mut whole = Stop { left: usize::MAX, asked: 0, since: None };
    solve(&input, &options, &mut whole).expect("an ellipsoid");
    // The last questions are those of the measures after the last step.
    let asked = whole.asked;
    let moments = (0..8).map(|k| k * asked / 8).chain(asked - 12..asked);
    for left in moments {
        let mut stop = Stop { left, asked: 0, since: None };
        let solution = solve(&input, &options, &mut stop).expect("an ellipsoid");
        assert_eq!(solution.report.status, Status::Interrupted, "question {left} of {asked}");
        let took = stop.since.expect("it was asked").elapsed();
        assert!(took < Duration::from_secs(1), "{took:?} after question {left} of {asked}");
    }
}
