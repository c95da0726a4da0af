//! One accepted step at sizes of Table 2 of Pellis et al. 2021, and the whole roof over four levels.
//!
//! Run with one thread (`RAYON_NUM_THREADS=1`) to compare with the numbers in
//! `docs/benchmarks/weingarten.md`.

use std::hint::black_box;
use std::time::Duration;

use bspline::BsplineSurface;
use criterion::{Criterion, criterion_group, criterion_main};
use fixtures::surfaces::Shape;
use gp_solver::Counts;
use weingarten::{Formulation, Options, solve};

/// Row, control points, samples.
const ROWS: [(&str, [usize; 2], (usize, usize)); 5] = [
    ("row 1", [14, 14], (28, 28)),
    ("row 2", [18, 18], (36, 36)),
    ("row 3", [25, 25], (50, 50)),
    ("row 8c", [16, 20], (48, 60)),
    ("row 10c, open", [40, 15], (80, 30)),
];

fn counts((u, v): (usize, usize)) -> Counts {
    Counts { u, v }
}

fn roof([n_u, n_v]: [usize; 2]) -> BsplineSurface {
    Shape::Roof.surface(n_u, n_v, 4, 4)
}

/// Time of `iters` accepted steps as the solver reports it, planning excluded: one linearisation, one
/// factorisation and solve, one trial. Of a run of ten steps, because the first use of memory costs
/// more than the step; trials that are refused belong to the run, not to the step.
fn steps(
    surface: &BsplineSurface,
    samples: (usize, usize),
    formulation: Formulation,
    iters: u64,
) -> Duration {
    let iterations = if formulation == Formulation::Reduced { 10 } else { 2 };
    let options =
        Options { iterations, samples: Some(counts(samples)), formulation, ..Default::default() };
    (0..iters)
        .map(|_| {
            let result =
                solve(black_box(surface), &options, &mut ()).expect("a surface to optimise");
            let solver = &result.report.stages[0].solver;
            let t = solver.timings;
            let per_trial = (t.factor + t.solve + t.residuals).as_secs_f64();
            let per_iterate = (t.linearize + t.normal).as_secs_f64();
            Duration::from_secs_f64(
                per_trial / solver.factorizations.max(1) as f64
                    + per_iterate / (solver.iterations + 1) as f64,
            )
        })
        .sum()
}

fn step(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("reduced step");
    group.sample_size(20);
    for (row, net, samples) in ROWS {
        let start = Options { iterations: 3, samples: Some(counts(samples)), ..Default::default() };
        let surface = solve(&roof(net), &start, &mut ()).expect("a surface to optimise").result;
        group.bench_function(row, |b| {
            b.iter_custom(|iters| steps(&surface, samples, Formulation::Reduced, iters));
        });
    }
    group.finish();
    let mut group = criterion.benchmark_group("lifted step");
    group.sample_size(10);
    let surface = roof([25, 25]);
    group.bench_function("row 3", |b| {
        b.iter_custom(|iters| steps(&surface, (50, 50), Formulation::Lifted, iters));
    });
    group.finish();
}

fn levels(criterion: &mut Criterion) {
    let options = Options {
        levels: [(10, 8), (14, 10), (18, 14), (25, 18)].into_iter().map(counts).collect(),
        ..Default::default()
    };
    let surface = roof([14, 14]);
    let mut group = criterion.benchmark_group("roof over four levels");
    group.sample_size(10);
    group.bench_function("40 steps", |b| b.iter(|| solve(black_box(&surface), &options, &mut ())));
    group.finish();
}

criterion_group!(benches, step, levels);
criterion_main!(benches);
