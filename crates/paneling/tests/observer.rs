//! Runs that are watched, stopped and resumed.

#![allow(clippy::unwrap_used, reason = "a test stops at the first fault")]

use fixtures::surfaces::Shape;
use gp_solver::{Checkpoint, Closeness, Observer, Problem, Progress, Stage, Status, Variables};
use paneling::blocks::MOLDS;
use paneling::{Clustering, Counts, Error, List, MoldType, Options, Solution, solve, solve_with};
use std::ops::ControlFlow;
use std::time::{Duration, Instant};

/// Stops after some steps, or at some question, and keeps the last checkpoint.
#[derive(Default)]
struct Keeper {
    steps: usize,
    questions: usize,
    stop_after: Option<usize>,
    stop_at_question: Option<usize>,
    state: Option<Checkpoint>,
    resume: Option<Checkpoint>,
    is_resumed: bool,
    stages: Vec<(String, usize, usize)>,
}

impl Observer for Keeper {
    fn step(&mut self, progress: &Progress<'_>) -> ControlFlow<()> {
        self.steps += 1;
        assert!(progress.share() <= 1.0 && progress.energy >= 0.0);
        let stage = progress.stage;
        if self.stages.last().is_none_or(|s| s.0 != stage.name) {
            assert!(self.is_resumed || progress.iteration == 0, "{}", stage.name);
            self.stages.push((stage.name.clone(), stage.number, stage.count));
        }
        let is_last = self.stop_after.is_some_and(|last| self.steps > last);
        if is_last { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
    }

    fn stop_requested(&mut self) -> bool {
        self.questions += 1;
        self.stop_at_question.is_some_and(|last| self.questions > last)
    }

    fn checkpoint(&mut self, state: &dyn Fn() -> Checkpoint) {
        self.state = Some(state());
    }

    fn resume(&mut self) -> Option<Checkpoint> {
        self.is_resumed = self.resume.is_some();
        self.resume.take()
    }
}

fn by_rule() -> Options {
    let panels = Some(Counts { u: 7, v: 6 });
    Options { panels, molds: Some(6), ..Options::default() }
}

fn search() -> Options {
    Options {
        panels: Some(Counts { u: 5, v: 5 }),
        max_kink_deg: Some(1.5),
        mold_types: List(vec![MoldType::Plane, MoldType::Sphere, MoldType::Cubic]),
        ..Options::default()
    }
}

type Solve<'s> = &'s dyn Fn(&mut Keeper) -> Result<Solution, Error>;

/// Interrupts at ten moments and compares what the resumed runs end with.
fn resumes_with_the_same_bytes(run: Solve<'_>) {
    let mut whole = Keeper::default();
    let want = run(&mut whole).unwrap();
    assert!(whole.steps >= 10, "{} steps", whole.steps);
    for moment in 0..10 {
        let stop_after = Some(moment * whole.steps / 10);
        let mut first = Keeper { stop_after, ..Keeper::default() };
        assert_eq!(run(&mut first).unwrap().report.status, Status::Interrupted, "{moment}");
        // As it stands in a file; none before the first step: the run starts over.
        let text = first.state.map(|state| serde_json::to_string(&state).unwrap());
        let resume = text.map(|text| serde_json::from_str(&text).unwrap());
        let got = run(&mut Keeper { resume, ..Keeper::default() }).unwrap();
        assert!(got.result == want.result, "moment {moment}");
        assert_eq!(got.grid, want.grid);
        assert_eq!((got.metrics, got.fits), (want.metrics, want.fits), "moment {moment}");
        assert_eq!(got.report.status, want.report.status);
        assert_eq!(got.report.iterations, want.report.iterations);
    }
}

#[test]
fn a_resumed_run_ends_with_the_same_bytes() {
    let surface = Shape::Roof.surface(10, 10, 4, 4);
    resumes_with_the_same_bytes(&|watch| solve(&surface, &by_rule(), watch));
}

#[test]
fn a_resumed_search_ends_with_the_same_bytes() {
    let surface = Shape::Roof.surface(10, 10, 4, 4);
    resumes_with_the_same_bytes(&|watch| solve(&surface, &search(), watch));
}

#[test]
fn a_resumed_run_of_every_clustering_ends_with_the_same_bytes() {
    let surface = Shape::Roof.surface(10, 10, 4, 4);
    for clustering in [Clustering::Cover, Clustering::Grid] {
        let options = Options { clustering, mold_types: List(vec![MoldType::Torus]), ..by_rule() };
        resumes_with_the_same_bytes(&|watch| solve(&surface, &options, watch));
    }
}

#[test]
fn a_resumed_run_with_blocks_of_ones_own_ends_with_the_same_bytes() {
    let surface = Shape::Roof.surface(10, 10, 4, 4);
    resumes_with_the_same_bytes(&|watch| {
        let mut straight = |_: &Stage, variables: &Variables, problem: &mut Problem<'_>| {
            let molds = variables.group(MOLDS)?;
            let mut weights = vec![0.0; variables.len()];
            (0..molds.len()).for_each(|m| weights[molds.column(m, 1)] = 10.0);
            problem.add(Closeness::new("no twist", vec![0.0; variables.len()], weights));
            Ok(())
        };
        solve_with(&surface, &by_rule(), &mut straight, watch)
    });
}

#[test]
fn stages_have_names_and_numbers() {
    let surface = Shape::Roof.surface(10, 10, 4, 4);
    let mut watch = Keeper::default();
    let solution = solve(&surface, &by_rule(), &mut watch).unwrap();
    let stages: Vec<_> = watch.stages.iter().map(|(n, k, c)| (n.as_str(), *k, *c)).collect();
    assert_eq!(stages, [("fit", 0, 3), ("seams", 1, 3), ("grid", 2, 3)]);
    let report = solution.report;
    assert_eq!(report.stages.len(), 2);
    assert_eq!(report.iterations, solution.result.iterations());
    assert!(report.stages[0].solver.final_energy <= report.stages[0].solver.initial_energy);
}

#[test]
fn a_run_stops_at_any_question_with_something_to_show() {
    let surface = Shape::Roof.surface(10, 10, 4, 4);
    for options in [by_rule(), search()] {
        let mut whole = Keeper::default();
        solve(&surface, &options, &mut whole).unwrap();
        for share in [0, 1, 3, 10, 30, 60, 95] {
            let stop_at_question = Some(share * whole.questions / 100);
            let mut watch = Keeper { stop_at_question, ..Keeper::default() };
            let solution = solve(&surface, &options, &mut watch).unwrap();
            assert_eq!(solution.report.status, Status::Interrupted);
            // Not asked again once it has said so.
            assert_eq!(watch.questions, share * whole.questions / 100 + 1);
            let molds = solution.result.molds.len();
            assert!(solution.result.labels.iter().all(|&m| m < molds));
            assert_eq!(solution.result.labels.len(), solution.panels.len());
        }
    }
}

#[test]
fn a_foreign_checkpoint_is_refused() {
    let surface = Shape::Roof.surface(10, 10, 4, 4);
    let mut first = Keeper { stop_after: Some(4), ..Keeper::default() };
    solve(&surface, &by_rule(), &mut first).unwrap();
    let options = Options { slope_weight: 0.4, ..by_rule() };
    let mut second = Keeper { resume: first.state, ..Keeper::default() };
    let error = solve(&surface, &options, &mut second).unwrap_err();
    assert!(error.to_string().contains("another input or other options"), "{error}");
}

/// Notes the longest time between two questions.
struct Clock {
    last: Instant,
    longest: Duration,
    end: Instant,
}

impl Observer for Clock {
    fn step(&mut self, _: &Progress<'_>) -> ControlFlow<()> {
        let _ = self.stop_requested();
        ControlFlow::Continue(())
    }

    fn stop_requested(&mut self) -> bool {
        self.longest = self.longest.max(self.last.elapsed());
        self.last = Instant::now();
        Instant::now() > self.end
    }
}

#[test]
#[ignore = "measures time: wants a machine of its own"]
fn a_search_of_ten_thousand_panels_is_asked_often() {
    let surface = Shape::Roof.surface(14, 14, 4, 4);
    for types in [vec![MoldType::Cubic], vec![MoldType::Torus]] {
        let options = Options {
            panels: Some(Counts { u: 100, v: 100 }),
            max_kink_deg: Some(0.01),
            mold_types: List(types.clone()),
            ..Options::default()
        };
        let now = Instant::now();
        let end = now + Duration::from_secs(60);
        let mut clock = Clock { last: now, longest: Duration::ZERO, end };
        let solution = solve(&surface, &options, &mut clock).unwrap();
        let after = end.elapsed();
        assert_eq!(solution.report.status, Status::Interrupted);
        assert!(clock.longest < Duration::from_secs(1), "{types:?}: {:?}", clock.longest);
        assert!(after < Duration::from_secs(1), "{types:?}: ended after {after:?}");
    }
}
