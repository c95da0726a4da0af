//! Fairing from raw inputs: known minimisers, constraints, refusals.

use curvature_variation::{
    Constraints, Error, Functional, Input, Method, Options, Solution, Symmetry, solve,
};
use fixtures::quad_graphs;
use geom_core::{DVec3, PolyMesh};
use std::f64::consts::{PI, TAU};
use subdiv_catmull_clark::{Creases, limit_frames};

fn options(energy: &str, levels: usize) -> Options {
    Options { energy: energy.parse().expect("an energy"), levels, ..Options::default() }
}

fn input(mesh: &PolyMesh, constraints: &Constraints) -> Input {
    Input { constraints: constraints.clone(), ..Input::from(mesh.clone()) }
}

fn run(mesh: &PolyMesh, constraints: &Constraints, options: &Options) -> Solution {
    solve(&input(mesh, constraints), options, &mut ()).expect("a surface that can be faired")
}

fn refusal(mesh: &PolyMesh, constraints: &Constraints, options: &Options) -> Error {
    solve(&input(mesh, constraints), options, &mut ()).expect_err("a refusal")
}

#[test]
fn an_ellipsoid_becomes_a_sphere() {
    let mesh = quad_graphs::ellipsoid(4, DVec3::new(1.0, 1.2, 1.6));
    let result = run(&mesh, &Constraints::default(), &options("mehlum_tarrou", 2));
    let table = &result.after;
    assert!((table.get(Functional::Bending) / (8.0 * PI) - 1.0).abs() < 1e-4);
    assert!(result.metrics.gauss_bonnet_residual.expect("a closed surface") < 2e-4);
    let frames = limit_frames(&result.result, &result.surface);
    let points: Vec<DVec3> =
        frames.iter().flatten().map(|f| f.point(result.result.positions())).collect();
    let centre = points.iter().copied().sum::<DVec3>() / points.len() as f64;
    let radii = points.iter().map(|p| p.distance(centre));
    let (least, most) = radii.fold((f64::INFINITY, 0.0_f64), |(a, b), r| (a.min(r), b.max(r)));
    assert!(most / least - 1.0 < 2e-3, "radii from {least} to {most}");
    // What is left of the third-order energies, a few thousandths of those of the ellipsoid or of
    // a surface of genus 2, sits at the eight vertices of valence 3.
    for (functional, bound) in [
        (Functional::F1, 3.2),
        (Functional::F3, 0.4),
        (Functional::MvsCross, 9.0),
        (Functional::Mvs, 8.0),
    ] {
        assert!(table.get(functional) < bound, "{functional}: {}", table.get(functional));
    }
    assert!(result.metrics.energy_final < 3.5, "{}", result.metrics.energy_final);
}

#[test]
fn genus_two_reaches_the_published_energy_on_a_coarse_mesh() {
    let result = run(&quad_graphs::theta_graph(3), &Constraints::default(), &Options::default());
    assert_eq!(result.result.vertex_count(), 382);
    assert!(result.metrics.energy_final < 1903.0, "{}", result.metrics.energy_final);
    assert!(result.metrics.quadrature_gap < 3e-3);
    assert!(result.metrics.gauss_bonnet_residual.expect("a closed surface") < 2e-4);
}

#[test]
fn methods_and_symmetry_agree_on_the_minimum() {
    let mesh = quad_graphs::theta_graph(3);
    let base = options("bending", 1);
    let reference = run(&mesh, &Constraints::default(), &base).metrics.energy_final;
    for method in [Method::GaussNewton, Method::Sobolev] {
        let options = Options { method, iterations: 300, ..base.clone() };
        let got = run(&mesh, &Constraints::default(), &options).metrics.energy_final;
        assert!((got / reference - 1.0).abs() < 2e-3, "{method:?}: {got} against {reference}");
    }
    let free = Options { symmetry: Symmetry::None, ..base };
    let got = run(&mesh, &Constraints::default(), &free).metrics.energy_final;
    // Without the symmetry there are more unknowns, never a higher minimum.
    assert!(got < reference * (1.0 + 1e-3), "{got} against {reference}");
}

#[test]
fn clamped_boundaries_stay() {
    let mesh = quad_graphs::lamp_shade(8);
    let constraints = Constraints { clamp_boundary: true, ..Constraints::default() };
    let result = run(&mesh, &constraints, &options("bending", 0));
    assert!(result.metrics.energy_final < result.metrics.energy_initial);
    let rows = mesh.vertex_count() / 8;
    for (v, (p, q)) in mesh.positions().iter().zip(result.result.positions()).enumerate() {
        if v % rows < 3 || v % rows >= rows - 3 {
            assert!(p.distance(*q) < 1e-12, "vertex {v}");
        }
    }
}

#[test]
fn rows_of_vertices_do_not_collide_while_bending_is_minimised() {
    // Without the barrier two rows in the middle met and the energy between the quadrature points
    // grew to 1600.
    let mut profile = vec![(1.6, -2.4), (1.4, -2.2), (1.2, -2.0)];
    profile.extend((0..=12).map(|k| (1.0, -1.8 + 0.3 * f64::from(k))));
    profile.extend([(1.2, 2.0), (1.4, 2.2), (1.6, 2.4)]);
    let constraints = Constraints { clamp_boundary: true, ..Constraints::default() };
    let mesh = quad_graphs::revolution(&profile, 12);
    let report = run(&mesh, &constraints, &options("bending", 1)).metrics;
    assert!(report.quadrature_gap < 1e-3, "{}", report.quadrature_gap);
    assert!(report.energy_final < 33.3, "{}", report.energy_final);
}

#[test]
fn area_is_minimised_where_the_boundary_holds_it() {
    // The catenoid z = acosh(r) between two rings, found from a cylinder.
    let height = 0.5_f64;
    let ring = height.cosh();
    let profile: Vec<(f64, f64)> =
        (0..=12).map(|k| (ring, height * (f64::from(k) / 6.0 - 1.0))).collect();
    let mesh = quad_graphs::revolution(&profile, 24);
    let rows = profile.len();
    let held = mesh.vertices().filter(|v| v.index() % rows == 0 || v.index() % rows == rows - 1);
    let constraints =
        Constraints { vertices: held.map(|v| v.0).collect(), ..Constraints::default() };
    let result = run(&mesh, &constraints, &options("area", 0));
    let positions = result.result.positions();
    let waist = positions[rows / 2].x.hypot(positions[rows / 2].y);
    // The rings of 24 control points stand for circles 1.1 % smaller.
    assert!((waist - 1.0).abs() < 0.02, "{waist}");
    let area = TAU * (height + 0.5 * (2.0 * height).sinh());
    let got = result.metrics.energy_final;
    assert!((0.97..1.0).contains(&(got / area)), "{got} against {area}");
}

#[test]
fn pinned_limit_points_and_tangent_planes_are_met() {
    let mesh = quad_graphs::ellipsoid(3, DVec3::new(1.0, 1.2, 1.4));
    let constraints = Constraints {
        limit_points: vec![(0, Some([-1.0, -1.0, -1.0])), (7, None)],
        tangent_planes: vec![(0, Some([-1.0, -1.0, -1.5]))],
        ..Constraints::default()
    };
    let result = run(&mesh, &constraints, &options("bending", 1));
    let frames = limit_frames(&result.result, &result.surface);
    let frame = frames[0].as_ref().expect("a used vertex");
    let positions = result.result.positions();
    assert!(frame.point(positions).distance(DVec3::splat(-1.0)) < 1e-8);
    let want = DVec3::new(-1.0, -1.0, -1.5).normalize();
    assert!(frame.normal(positions).dot(want).abs() > 1.0 - 1e-10);
}

#[test]
fn weights_pull_limit_points_to_their_places() {
    let mesh = quad_graphs::ellipsoid(3, DVec3::new(1.0, 1.4, 2.0));
    // The point farthest out, which bending draws inwards.
    let far = mesh.vertices().max_by(|&a, &b| {
        let z = |v: geom_core::VertexId| mesh.positions()[v.index()].z;
        z(a).total_cmp(&z(b))
    });
    let far = far.expect("a vertex");
    let distance = |weight: f64| {
        let constraints =
            Constraints { weights: vec![(far.0, weight), (0, 1.0)], ..Constraints::default() };
        let result = run(&mesh, &constraints, &options("bending", 0));
        let point = |mesh: &PolyMesh, surface| {
            let frames = limit_frames(mesh, surface);
            frames[far.index()].as_ref().expect("a used vertex").point(mesh.positions())
        };
        point(&result.result, &result.surface)
            .distance(point(&result.initial, &result.initial_surface))
    };
    let distances = [1.0, 100.0, 1e4].map(distance);
    assert!(
        distances[0] > 3.0 * distances[1] && distances[1] > 10.0 * distances[2],
        "{distances:?}"
    );
    let constraints = Constraints { weights: vec![(0, -1.0)], ..Constraints::default() };
    assert!(matches!(
        refusal(&mesh, &constraints, &options("bending", 0)),
        Error::Weight { vertex: 0, .. }
    ));
}

#[test]
fn creases_stay_and_keep_the_symmetries_that_keep_them() {
    let mesh = quad_graphs::ellipsoid(4, DVec3::new(1.0, 1.0, 0.6));
    let flat = |v: geom_core::VertexId| mesh.positions()[v.index()].z.abs() < 1e-9;
    for sharpness in [f64::INFINITY, 1.5] {
        let mut creases = Creases::none();
        for h in mesh.edges().filter(|&h| flat(mesh.origin(h)) && flat(mesh.target(h))) {
            creases.set(mesh.origin(h), mesh.target(h), sharpness);
        }
        let options = Options { iterations: 40, ..options("bending", 1) };
        let creased = Input { creases, ..Input::from(mesh.clone()) };
        let result = solve(&creased, &options, &mut ()).expect("a surface that can be faired");
        assert!(result.metrics.energy_final < result.metrics.energy_initial, "{sharpness}");
        assert_eq!(result.levels[0].symmetries, 16, "{sharpness}");
    }
}

#[test]
fn refusals_say_what_and_how_to_mend() {
    let mesh = quad_graphs::theta_graph(3);
    let none = Constraints::default();
    let error = refusal(&mesh, &none, &options("area", 0));
    assert!(error.to_string().starts_with("area changes with the size"), "{error}");
    let error = refusal(&mesh, &none, &options("0*bending", 0));
    assert_eq!(error, Error::NoEnergy);
    let all = Constraints {
        vertices: (0..mesh.vertex_count() as u32).collect(),
        ..Constraints::default()
    };
    assert!(matches!(refusal(&mesh, &all, &options("bending", 0)), Error::NothingFree { .. }));
    let beyond = Constraints { vertices: vec![999], ..Constraints::default() };
    assert!(matches!(
        refusal(&mesh, &beyond, &options("bending", 0)),
        Error::NoSuchVertex { vertex: 999, .. }
    ));
    let triangle =
        PolyMesh::new(vec![DVec3::X, DVec3::Y, DVec3::Z], &[[0, 1, 2]]).expect("a triangle");
    assert!(matches!(
        refusal(&triangle, &none, &options("bending", 0)),
        Error::Triangles { faces: 1 }
    ));
    assert!(matches!(refusal(&mesh, &none, &options("bending", 12)), Error::TooManyLevels { .. }));
    let mut positions = mesh.positions().to_vec();
    let mut faces: Vec<Vec<u32>> =
        mesh.faces().map(|f| mesh.face_vertices(f).map(|v| v.0).collect()).collect();
    positions.push(DVec3::splat(9.0));
    let loose = PolyMesh::new(positions.clone(), &faces).expect("a mesh and a point");
    let error = refusal(&loose, &none, &options("bending", 0));
    assert_eq!(error.to_string(), "vertex 22 belongs to no face; remove it");
    positions.pop();
    let count = positions.len() as u32;
    positions.extend(mesh.positions().iter().map(|p| *p + 9.0 * DVec3::X));
    let copies: Vec<Vec<u32>> =
        faces.iter().map(|f| f.iter().map(|v| v + count).collect()).collect();
    faces.extend(copies);
    let two = PolyMesh::new(positions, &faces).expect("two meshes");
    let error = refusal(&two, &none, &options("bending", 0));
    assert_eq!(error.to_string(), "the mesh has 2 separate parts; fair each of them on its own");
    // Its first variation is K, so that a clamped tube tears.
    let tube = quad_graphs::lamp_shade(12);
    let clamped = Constraints { clamp_boundary: true, ..Constraints::default() };
    let error = refusal(&tube, &clamped, &options("mean_curvature", 0)).to_string();
    assert!(error.starts_with("mean_curvature has no minimum"), "{error}");
}
