//! Runs that are interrupted and resumed end with the same bytes.

use std::ops::ControlFlow;

use fixtures::asymptotic_nets;
use geom_core::PolyMesh;
use gp_solver::{Checkpoint, Observer, Progress, Status};
use hyperbolic_nets::{Boundary, Input, Options, QuadNet, Solution, solve};

/// Stops a run when it has been asked, or shown something, so many times.
#[derive(Default)]
struct Moments {
    asked: usize,
    stop_at: Option<usize>,
    kept: Option<Checkpoint>,
    resume: Option<Checkpoint>,
}

impl Moments {
    fn stops(&mut self) -> bool {
        self.asked += 1;
        self.stop_at.is_some_and(|at| self.asked >= at)
    }
}

impl Observer for Moments {
    fn step(&mut self, _: &Progress<'_>) -> ControlFlow<()> {
        if self.stops() { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
    }

    fn stop_requested(&mut self) -> bool {
        self.stops()
    }

    fn checkpoint(&mut self, state: &dyn Fn() -> Checkpoint) {
        self.kept = Some(state());
    }

    fn resume(&mut self) -> Option<Checkpoint> {
        self.resume.take()
    }
}

fn bits(solution: &Solution) -> Vec<u64> {
    let net = solution.result.net();
    let vectors = net.positions().iter().chain(solution.result.normals().into_iter().flatten());
    let numbers = vectors.flat_map(|p| p.to_array()).chain(solution.result.shape().iter().copied());
    numbers.map(f64::to_bits).collect()
}

fn check(options: &Options) {
    let model = asymptotic_nets::catenoid(12, 8).jittered(0.05, 3);
    let net = QuadNet::new(&PolyMesh::new(model.positions, &model.quads).unwrap()).unwrap();
    let input = Input::new(&net);
    let mut whole = Moments::default();
    let want = solve(&input, options, &mut whole).unwrap();
    assert_ne!(want.report.status, Status::Interrupted);
    for moment in 1..=10 {
        let at = (moment * whole.asked).div_ceil(10);
        let mut stopped = Moments { stop_at: Some(at), ..Moments::default() };
        let half = solve(&input, options, &mut stopped).unwrap();
        assert_eq!(half.report.status, Status::Interrupted, "moment {moment}");
        // As the command line writes it.
        let text = serde_json::to_string(&stopped.kept).unwrap();
        let resume = serde_json::from_str(&text).unwrap();
        let mut resumed = Moments { resume, ..Moments::default() };
        let got = solve(&input, options, &mut resumed).unwrap();
        assert_eq!(got.report.status, want.report.status, "moment {moment}");
        assert_eq!(got.report.iterations, want.report.iterations, "moment {moment}");
        assert_eq!(bits(&got), bits(&want), "moment {moment} of {}", whole.asked);
    }
}

#[test]
fn the_joint_method_resumes_with_the_same_bytes() {
    check(&Options::default());
    check(&Options { boundary: Boundary::Fixed, steps_per_stage: 6, ..Options::default() });
    check(&Options { boundary: Boundary::Glide, ..Options::default() });
}

#[test]
fn the_published_method_resumes_with_the_same_bytes() {
    check(&Options::published());
}

#[test]
fn checkpoints_of_another_run_are_refused() {
    let model = asymptotic_nets::scherk(8);
    let net = QuadNet::new(&PolyMesh::new(model.positions, &model.quads).unwrap()).unwrap();
    let mut first = Moments::default();
    solve(&Input::new(&net), &Options::default(), &mut first).unwrap();
    let mut second = Moments { resume: first.kept, ..Moments::default() };
    let options = Options { fairness: Some(0.2), ..Options::default() };
    let error = solve(&Input::new(&net), &options, &mut second).unwrap_err().to_string();
    assert!(error.contains("other options"), "{error}");
}
