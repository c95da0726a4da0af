//! A torus with exact normals and curvatures, as a view and in a report.
#![allow(dead_code, reason = "each user takes what it needs")]

use std::f64::consts::TAU;

use glam::DVec3;
use report::{FaceGroups, LineSet, Report, ScalarField, SurfaceView};

/// A torus of radii `big` and `small`, oriented outwards, on a grid of `n` x `n` vertices.
pub(crate) fn torus(name: &str, big: f64, small: f64, n: usize) -> SurfaceView {
    let (mut positions, mut normals) = (Vec::new(), Vec::new());
    let (mut h, mut k) = (Vec::new(), Vec::new());
    for index in 0..n * n {
        let angle = |i: usize| TAU * i as f64 / (n - 1) as f64;
        let (u, v) = (angle(index / n), angle(index % n));
        let normal = DVec3::new(u.cos() * v.cos(), u.sin() * v.cos(), v.sin());
        let ring = big + small * v.cos();
        positions.push(DVec3::new(big * u.cos(), big * u.sin(), 0.0) + normal * small);
        normals.push(normal);
        h.push(-0.5 * (1.0 / small + v.cos() / ring));
        k.push(v.cos() / (small * ring));
    }
    let net: Vec<DVec3> = positions.iter().map(|p| *p * 1.05).collect();
    let triangles = SurfaceView::grid_triangles(n, n);
    let quarters = (0..triangles.len()).map(|t| (4 * t / triangles.len()) as u32).collect();
    SurfaceView::new(name, positions, normals, triangles)
        .and_then(|view| view.with_field(ScalarField::mean_curvature(h, "m")))
        .and_then(|view| view.with_field(ScalarField::gaussian_curvature(k, "m")))
        .and_then(|view| view.with_groups(FaceGroups::numbered("quarters", "quarter", quarters)))
        .and_then(|view| view.with_lines(LineSet::control_net(&net, n, n)))
        .expect("a sound torus")
}

/// A report of two tori.
pub(crate) fn tori() -> Report {
    let mut report = Report::new("Two tori", "umbilic analyze torus.ron --threads 2");
    report.length_unit = "m".into();
    report.stages.push(torus("before", 3.0, 1.4, 48));
    report.stages.push(torus("after", 3.0, 0.9, 48));
    report.metrics.insert("area".into(), 106.6.into());
    report.metrics.insert("seconds".into(), 0.25.into());
    report.run.insert("threads".into(), 2.into());
    report
}
