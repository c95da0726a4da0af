//! Clustering, fit and measures of a roof, by number of panels; once with the joint seam step.
#![allow(missing_docs, clippy::unwrap_used, reason = "a benchmark")]

use criterion::{BenchmarkId, Criterion, criterion_group, criterion_main};
use fixtures::surfaces::{Shape, plane};
use paneling::{Layout, MoldType, Options, PanelSet, Pattern, mold_count, solve};

fn options(molds: usize) -> Options {
    Options { compare_grid: false, ..Options::with_molds(molds, MoldType::Cubic) }
}

fn panels(c: &mut Criterion) {
    let mut group = c.benchmark_group("panels");
    group.sample_size(10);
    let roof = Shape::Roof.surface(14, 14, 4, 4);
    for (side, seam_steps) in [(30, 0), (30, 8), (100, 0), (100, 8)] {
        let id = BenchmarkId::new(format!("roof, {seam_steps} seam steps"), side * side);
        group.bench_function(id, |b| {
            b.iter(|| {
                let layout = Layout::generate(Pattern::Quad, side, side, [false; 2]).unwrap();
                let set = PanelSet::new(&roof, &layout).unwrap();
                let molds = mold_count(3.0, set.len());
                solve(&set, &Options { seam_steps, ..options(molds) }, &mut ()).unwrap()
            });
        });
    }
    // Degenerate: all panels are alike, so that every cluster but one is surplus.
    let flat = plane(6, 6, 4);
    group.bench_function("plane/900", |b| {
        b.iter(|| {
            let layout = Layout::generate(Pattern::Quad, 30, 30, [false; 2]).unwrap();
            let set = PanelSet::new(&flat, &layout).unwrap();
            solve(&set, &options(90), &mut ()).unwrap()
        });
    });
    group.finish();
}

criterion_group!(benches, panels);
criterion_main!(benches);
