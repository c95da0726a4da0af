//! Solving and verifying: one patch by degree, nets by size.
#![allow(missing_docs, reason = "criterion's macros make undocumented items")]

use asymptotic_bezier::{
    AsymptoticNet, BoundaryOptions, DataFile, GridshellOptions, InputData, PatchCheck,
    PatchOptions, Place, fill_net, fill_patch, solve_quadrilateral,
};
use criterion::{BenchmarkId, Criterion, criterion_group, criterion_main};
use geom_core::{DVec3, PolyMesh};
use std::hint::black_box;

fn corner_data() -> asymptotic_bezier::CornerData {
    let text = include_str!("../../../fixtures/asymptotic/catenoid.ron");
    let options =
        ron::Options::default().with_default_extension(ron::extensions::Extensions::IMPLICIT_SOME);
    let file: DataFile = options.from_str(text).expect("a valid example");
    match file.input().expect("a valid example").data {
        InputData::Patch(data) => *data,
        _ => unreachable!("the example is one patch"),
    }
}

/// Enneper's surface over a square of its asymptotic parameters.
fn net(n: usize) -> AsymptoticNet {
    let point = |i: usize, j: usize| {
        let (p, q) = (0.1 + 0.8 * i as f64 / n as f64, 0.2 + 0.8 * j as f64 / n as f64);
        let (u, v) = (0.5 * (p + q), 0.5 * (p - q));
        DVec3::new(u - u.powi(3) / 3.0 + u * v * v, v - v.powi(3) / 3.0 + v * u * u, u * u - v * v)
    };
    let positions = (0..=n).flat_map(|i| (0..=n).map(move |j| point(i, j))).collect();
    let at = |i: usize, j: usize| (i * (n + 1) + j) as u32;
    let faces: Vec<[u32; 4]> = (0..n * n)
        .map(|k| (k / n, k % n))
        .map(|(i, j)| [at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)])
        .collect();
    let mesh = PolyMesh::new(positions, &faces).expect("a grid is a manifold");
    AsymptoticNet::from_mesh(&mesh).expect("an asymptotic net")
}

fn patches(criterion: &mut Criterion) {
    let data = corner_data();
    let boundary = BoundaryOptions::default();
    let mut group = criterion.benchmark_group("asymptotic patch");
    group.bench_function("boundary", |b| {
        b.iter(|| solve_quadrilateral(black_box(&data), &boundary));
    });
    let quad = solve_quadrilateral(&data, &boundary).expect("good data");
    for degree in [6, 7, 8, 11] {
        let options = PatchOptions { degree: Some(degree), ..Default::default() };
        group.bench_with_input(BenchmarkId::new("fill", degree), &options, |b, options| {
            b.iter(|| fill_patch(black_box(&quad.boundary), options, Place::Patch(0)));
        });
    }
    let filled = fill_patch(&quad.boundary, &PatchOptions::default(), Place::Patch(0));
    let filled = filled.expect("good data");
    group.bench_function("verify", |b| {
        b.iter(|| PatchCheck::new(black_box(&filled.patch), &quad.boundary));
    });
    group.finish();
}

fn gridshells(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("asymptotic gridshell");
    group.sample_size(10);
    for n in [8, 16, 32] {
        let net = net(n);
        let options = GridshellOptions::default();
        group.bench_with_input(BenchmarkId::new("solve", n * n), &net, |b, net| {
            b.iter(|| fill_net(black_box(net), &options));
        });
        if n == 16 {
            let shell = fill_net(&net, &options).expect("a good net");
            group.bench_function(BenchmarkId::new("verify", n * n), |b| {
                b.iter(|| shell.verify(black_box(&net), &options.patch));
            });
        }
    }
    group.finish();
}

criterion_group!(benches, patches, gridshells);
criterion_main!(benches);
