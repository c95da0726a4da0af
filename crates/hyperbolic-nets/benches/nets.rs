//! Both solvers on jittered nets: a ring of 1,320 faces, discs of 900 and 10,000.
#![allow(missing_docs, reason = "criterion writes the functions")]

use criterion::{Criterion, criterion_group, criterion_main};
use fixtures::asymptotic_nets::{self, AsymptoticNet};
use geom_core::PolyMesh;
use hyperbolic_nets::{Input, Options, QuadNet, solve};
use std::time::{Duration, Instant};

fn quad_net(model: &AsymptoticNet) -> QuadNet {
    let mesh = PolyMesh::new(model.positions.clone(), &model.quads).expect("a mesh");
    QuadNet::new(&mesh).expect("a net")
}

fn joint(model: &AsymptoticNet, net: &QuadNet) -> f64 {
    let input = Input::near_surface(net, &*model.surface);
    solve(&input, &Options::default(), &mut ()).expect("solved").metrics.kink_max_deg
}

fn nets(c: &mut Criterion) {
    let mut group = c.benchmark_group("hyperbolic_nets");
    group.sample_size(10);

    let ring = asymptotic_nets::catenoid(44, 32).jittered(0.05, 1);
    let net = quad_net(&ring);
    group.bench_function(format!("joint/{}", net.quads().len()), |b| b.iter(|| joint(&ring, &net)));

    let disc = asymptotic_nets::scherk(30).jittered(0.05, 1);
    let net = quad_net(&disc);
    // Time per Gauss-Newton step: the pipeline as a whole ends when its kinks settle.
    group.bench_function(format!("published step/{}", net.quads().len()), |b| {
        b.iter_custom(|repeats| {
            let mut total = Duration::ZERO;
            for _ in 0..repeats {
                let start = Instant::now();
                let input = Input::near_surface(&net, &*disc.surface);
                let solution = solve(&input, &Options::published(), &mut ()).expect("solved");
                total += start.elapsed() / solution.report.iterations.max(1) as u32;
            }
            total
        });
    });
    group.finish();

    // Too long to repeat.
    if std::env::args().any(|a| a == "--bench") {
        let disc = asymptotic_nets::scherk(100).jittered(0.05, 1);
        let net = quad_net(&disc);
        let start = Instant::now();
        let kink = joint(&disc, &net);
        let (faces, seconds) = (net.quads().len(), start.elapsed().as_secs_f64());
        eprintln!(
            "hyperbolic_nets/joint/{faces}: {seconds:.2} s, once; kinks max {kink:.1e} degrees"
        );
    }
}

criterion_group!(benches, nets);
criterion_main!(benches);
