//! Runs that are stopped: at once, and resumed to the same bytes.

use std::ops::ControlFlow;
use std::time::{Duration, Instant};

use crate::common::{Gauss, catenoid, enneper, exact_net, noisy, reference_set, sampled_net};
use asymptotic_bezier::{
    AsymptoticNet, CurveForm, Error, Input, Joins, NetCurve, Options, Solution, solve,
};
use gp_solver::{Checkpoint, Observer, Progress};

/// Stops at a step, or at a question, and keeps the last checkpoint.
#[derive(Default)]
struct Stopping {
    steps: usize,
    stop_at: usize,
    questions: usize,
    stop_at_question: Option<usize>,
    checkpoints: usize,
    kept: Option<Checkpoint>,
    resume: Option<Checkpoint>,
}

impl Observer for Stopping {
    fn step(&mut self, _: &Progress<'_>) -> ControlFlow<()> {
        self.steps += 1;
        if self.steps == self.stop_at { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
    }

    fn stop_requested(&mut self) -> bool {
        self.questions += 1;
        self.stop_at_question.is_some_and(|last| self.questions > last)
    }

    fn checkpoint(&mut self, state: &dyn Fn() -> Checkpoint) {
        self.checkpoints += 1;
        self.kept = Some(state());
    }

    fn resume(&mut self) -> Option<Checkpoint> {
        self.resume.take()
    }
}

fn bits(solution: &Solution) -> Vec<u64> {
    let patches = &solution.result.patches;
    let points = patches.iter().flat_map(|p| p.patch.points()).flat_map(|q| q.to_array());
    let energies = patches.iter().flat_map(|p| [p.thin_plate_energy, p.transversality]);
    points.chain(energies).map(f64::to_bits).collect()
}

/// Interrupts, writes and reads the checkpoint, resumes, compares; whether there was something to
/// interrupt.
fn resumes(input: &Input, options: &Options, mut first: Stopping, expected: &Solution) -> bool {
    let case = format!("step {}, question {:?}", first.stop_at, first.stop_at_question);
    match solve(input, options, &mut first) {
        Err(Error::Interrupted { .. }) => {}
        // How many questions there are depends on the time it takes.
        Ok(_) if first.stop_at_question.is_some() => return false,
        other => panic!("{case}: {other:?}"),
    }
    // A run stopped before its first checkpoint starts over.
    let text = serde_json::to_string(&first.kept).unwrap();
    let resume: Option<Checkpoint> = serde_json::from_str(&text).unwrap();
    let mut second = Stopping { resume, ..Default::default() };
    let resumed = solve(input, options, &mut second).unwrap();
    assert!(bits(&resumed) == bits(expected), "{case}");
    assert_eq!(resumed.metrics, expected.metrics, "{case}");
    assert_eq!(resumed.warnings, expected.warnings, "{case}");
    assert_eq!(resumed.report.iterations, expected.report.iterations, "{case}");
    true
}

/// Interrupts at ten steps.
fn resumes_to_the_same_bytes(input: &Input, options: &Options) {
    let mut whole = Stopping::default();
    let expected = solve(input, options, &mut whole).unwrap();
    assert!(whole.steps > 10, "{} steps", whole.steps);
    for k in 1..=10 {
        let stop_at = 1 + (whole.steps - 1) * k / 10;
        let first = Stopping { stop_at, ..Default::default() };
        assert!(resumes(input, options, first, &expected));
    }
}

/// Interrupts at ten questions, for stages that are solved at once.
fn resumes_anywhere_to_the_same_bytes(input: &Input, options: &Options) {
    let mut whole = Stopping::default();
    let expected = solve(input, options, &mut whole).unwrap();
    let interrupted = (0..10).filter(|k| {
        let stop_at_question = Some(k * whole.questions / 10);
        resumes(input, options, Stopping { stop_at_question, ..Default::default() }, &expected)
    });
    let interrupted = interrupted.count();
    assert!(interrupted >= 5, "{interrupted} of {} questions came", whole.questions);
}

/// A net whose tangents and curvatures have one percent of noise.
fn noisy_net() -> AsymptoticNet {
    let net = exact_net(catenoid, [0.2, 1.4, -0.1, 0.9], [2, 2]);
    let mut gauss = Gauss::new(3);
    let mut noisy = |x: f64| x * (1.0 + 0.01 * gauss.next());
    let curves: Vec<NetCurve> = net
        .curves()
        .iter()
        .map(|c| NetCurve {
            arms: c.arms.map(|a| geom_core::DVec3::new(noisy(a.x), noisy(a.y), noisy(a.z))),
            curvatures: c.curvatures.map(&mut noisy),
            ..*c
        })
        .collect();
    let quads: Vec<[usize; 4]> =
        net.faces().iter().map(|f| [0, 1, 3, 2].map(|c| net.face_corner(f, c))).collect();
    AsymptoticNet::new(net.positions().to_vec(), &quads, curves).unwrap()
}

#[test]
fn a_net_with_all_stages_ends_with_the_same_bytes() {
    let options = Options { relaxed: true, joins: Joins::G2, ..Options::default() };
    resumes_to_the_same_bytes(&noisy_net().into(), &options);
}

#[test]
fn curves_from_normals_end_with_the_same_bytes() {
    let mesh = sampled_net(enneper, [-0.5, 0.6, -0.7, 0.5], [4, 4]);
    let options = Options { curves: CurveForm::Normals, joins: Joins::C1, ..Options::default() };
    resumes_to_the_same_bytes(&mesh.into(), &options);
}

#[test]
fn corner_data_ends_with_the_same_bytes() {
    let data = noisy(&reference_set("A").data, 0.01, 2);
    let relaxed = Options { relaxed: true, ..Options::default() };
    resumes_anywhere_to_the_same_bytes(&data.into(), &relaxed);
    let exact = reference_set("B").data;
    resumes_anywhere_to_the_same_bytes(&exact.into(), &Options::default());
}

#[test]
fn nets_by_default_end_with_the_same_bytes() {
    let mesh = sampled_net(enneper, [-0.5, 0.6, -0.7, 0.5], [5, 5]);
    resumes_anywhere_to_the_same_bytes(&mesh.into(), &Options::default());
}

#[test]
fn checkpoints_of_other_runs_are_refused() {
    let input: Input = noisy_net().into();
    let options = Options { relaxed: true, ..Options::default() };
    let mut first = Stopping { stop_at: 4, ..Default::default() };
    solve(&input, &options, &mut first).unwrap_err();
    let mut second = Stopping { resume: first.kept, ..Default::default() };
    let other = Options { joins: Joins::C1, ..options };
    let message = solve(&input, &other, &mut second).unwrap_err().to_string();
    assert!(message.contains("other options"), "{message}");
}

/// Wants to stop some time after it was first asked.
struct Late {
    begin: Instant,
    after: Duration,
}

impl Observer for Late {
    fn stop_requested(&mut self) -> bool {
        self.begin.elapsed() > self.after
    }
}

#[test]
fn big_shells_stop_within_a_second() {
    let mesh = sampled_net(enneper, [-0.9, 0.8, -0.7, 0.9], [24, 24]);
    let input: Input = mesh.into();
    for after in [0, 20, 100, 300] {
        let after = Duration::from_millis(after);
        let mut late = Late { begin: Instant::now(), after };
        let stopped = solve(&input, &Options::default(), &mut late);
        // A fast machine may be done before it is asked.
        if stopped.is_err() {
            let beyond = late.begin.elapsed().saturating_sub(after);
            assert!(beyond < Duration::from_secs(1), "{beyond:?} after {after:?}");
        }
    }
}
