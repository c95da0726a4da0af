//! Functionals against the closed forms of the torus and the sphere, gradients against central
//! differences.

use curvature_variation::{Energy, Functional, Quadrature, SurfaceEnergy, Workspace};
use fixtures::quad_graphs;
use geom_core::{DVec3, PolyMesh};
use std::f64::consts::PI;
use subdiv_catmull_clark::{Blend, Creases, SubdivisionSurface, refine};

fn flat(points: &[DVec3]) -> Vec<f64> {
    points.iter().flat_map(|p| p.to_array()).collect()
}

fn evaluator(mesh: &PolyMesh, quadrature: Quadrature) -> SurfaceEnergy {
    let surface =
        SubdivisionSurface::new(mesh, &Creases::none(), Blend::Smooth).expect("an isolated mesh");
    SurfaceEnergy::new(&surface, mesh.vertex_count(), quadrature)
}

fn refined(mesh: &PolyMesh, levels: usize) -> PolyMesh {
    let mut mesh = mesh.clone();
    for _ in 0..levels {
        mesh = refine(&mesh, &Creases::none()).expect("a small mesh").mesh;
    }
    mesh
}

/// `A ∫ c² dA`, the only third-order invariant of a torus of ratio `rho`.
fn torus_c(rho: f64) -> f64 {
    8.0 * PI.powi(4) * (1.0 - rho * rho).powf(-1.5)
}

#[test]
fn torus_energies_are_the_closed_forms() {
    let mesh = quad_graphs::torus(64, 32, 1.0, 0.5);
    let table = evaluator(&mesh, Quadrature::NORMAL)
        .table(&flat(mesh.positions()), &mut Workspace::default());
    let rho: f64 = 0.5;
    let willmore = PI * PI / (rho * (1.0 - rho * rho).sqrt());
    let c = torus_c(rho);
    let check = |functional: Functional, want: f64, tolerance: f64| {
        let got = table.get(functional);
        assert!((got / want - 1.0).abs() < tolerance, "{functional}: {got} against {want}");
    };
    check(Functional::Area, 4.0 * PI * PI * rho, 1e-4);
    check(Functional::Willmore, willmore, 5e-4);
    check(Functional::Bending, 4.0 * willmore, 5e-4);
    check(Functional::UmbilicDeviation, 4.0 * willmore, 5e-4);
    // The spline's error sits in F1, which counts fully here.
    check(Functional::MvsCross, c, 1.8e-2);
    check(Functional::MehlumTarrou { w1: 1.0, w3: 1.0 }, 9.0 / 16.0 * c, 1.1e-2);
    check(Functional::F1, 9.0 / 32.0 * c, 1.8e-2);
    check(Functional::F3, 9.0 / 32.0 * c, 1.1e-2);
    check(Functional::CrossCurvature, 9.0 / 32.0 * c * (1.0 / 9.0 + 1.0), 1.1e-2);
    let sqrt = 3.0 * 2_f64.sqrt() * PI / rho * ((1.0 + rho) / (1.0 - rho)).ln();
    check(Functional::Sqrt, sqrt, 1.8e-2);
    assert!(table.get(Functional::Gaussian).abs() < 1e-6);
    // The spline itself is not quite a cyclide.
    assert!(table.get(Functional::Mvs) < 0.02 * c, "{}", table.get(Functional::Mvs));
}

#[test]
fn torus_errors_fall_with_the_square_of_the_mesh_size() {
    let error = |n: usize| {
        let mesh = quad_graphs::torus(2 * n, n, 1.0, 0.5);
        let table = evaluator(&mesh, Quadrature::NORMAL)
            .table(&flat(mesh.positions()), &mut Workspace::default());
        table.get(Functional::MvsCross) / torus_c(0.5) - 1.0
    };
    let (coarse, fine) = (error(16), error(32));
    assert!((3.4..4.6).contains(&(coarse / fine)), "{coarse} {fine}");
}

#[test]
fn sphere_like_mesh_approaches_the_sphere() {
    let mesh = quad_graphs::ellipsoid(8, DVec3::ONE);
    let table = evaluator(&refined(&mesh, 1), Quadrature::NORMAL)
        .table(&flat(refined(&mesh, 1).positions()), &mut Workspace::default());
    assert!((table.get(Functional::Bending) / (8.0 * PI) - 1.0).abs() < 0.02);
    assert!((table.get(Functional::Gaussian) / (4.0 * PI) - 1.0).abs() < 2e-4);
    assert!((table.get(Functional::MeanCurvature)) < 0.0);
}

#[test]
fn gauss_bonnet_holds_on_every_closed_surface() {
    for mesh in [
        quad_graphs::theta_graph(3),
        quad_graphs::theta_graph(4),
        quad_graphs::tetrahedron_graph(),
        quad_graphs::prism_graph(),
        quad_graphs::cube_graph(),
        quad_graphs::ellipsoid(3, DVec3::new(1.0, 1.3, 2.0)),
    ] {
        let chi = mesh.euler_characteristic() as f64;
        let mesh = refined(&mesh, 1);
        let energy = evaluator(&mesh, Quadrature::NORMAL);
        let positions = flat(mesh.positions());
        let got = energy.table(&positions, &mut Workspace::default()).get(Functional::Gaussian);
        let total = energy.absolute_gaussian(&positions, &mut Workspace::default());
        let residual = (got - 2.0 * PI * chi).abs() / total;
        assert!(residual < 2e-4, "Euler characteristic {chi}: {residual}");
    }
}

fn check_gradient(mesh: &PolyMesh, energy: &Energy, quadrature: Quadrature) {
    let evaluator = evaluator(mesh, quadrature);
    let x = flat(mesh.positions());
    let mut work = Workspace::default();
    let mut gradient = vec![0.0; x.len()];
    let area = evaluator.area(&x, &mut work);
    let value = evaluator.gradient(energy, &x, Some(area), &mut work, &mut gradient);
    let again = evaluator.energy(energy, &x, &mut work);
    assert!((value / again - 1.0).abs() < 1e-10, "{energy}: {value} against {again}");
    // Along a few smooth directions, where differences are accurate.
    for seed in 0..3 {
        let s = f64::from(seed);
        let direction: Vec<f64> =
            x.iter().enumerate().map(|(k, &p)| (1.3 * p + s + k as f64 * 2.1).sin()).collect();
        let at = |h: f64, work: &mut Workspace| {
            let y: Vec<f64> = x.iter().zip(&direction).map(|(p, d)| p + h * d).collect();
            let mut unused = vec![0.0; x.len()];
            evaluator.gradient(energy, &y, Some(area), work, &mut unused)
        };
        // Fourth-order differences.
        let h = 2e-5;
        let slope = (8.0 * (at(h, &mut work) - at(-h, &mut work))
            - (at(2.0 * h, &mut work) - at(-2.0 * h, &mut work)))
            / (12.0 * h);
        let want: f64 = gradient.iter().zip(&direction).map(|(g, d)| g * d).sum();
        assert!(
            (slope - want).abs() < 1e-8 * want.abs().max(1e-2 * value.abs()),
            "{energy}: {slope} against {want} of {value}"
        );
    }
}

#[test]
fn gradients_match_central_differences() {
    let mesh = refined(&quad_graphs::theta_graph(3), 1);
    for text in [
        "area",
        "mean_curvature",
        "bending",
        "willmore",
        "umbilic_deviation",
        "mvs",
        "mvs_cross",
        "f1",
        "f3",
        "mehlum_tarrou(1,0.3)",
        "cross_curvature",
        "average_derivative",
        "sqrt",
        "0.92*bending + 0.08*mehlum_tarrou",
        "2*area + 0.5*mvs_cross + sqrt",
    ] {
        let energy: Energy = text.parse().expect("an energy");
        check_gradient(&mesh, &energy, Quadrature::COARSE);
    }
    check_gradient(&quad_graphs::lamp_shade(8), &Energy::mehlum_tarrou(), Quadrature::NORMAL);
}

#[test]
fn energies_are_invariant_under_similarity_and_orientation_blind() {
    let mesh = refined(&quad_graphs::theta_graph(3), 1);
    let evaluator = evaluator(&mesh, Quadrature::COARSE);
    let before = evaluator.table(&flat(mesh.positions()), &mut Workspace::default());
    let turn = geom_core::DMat3::from_axis_angle(DVec3::new(1.0, 2.0, -1.0).normalize(), 0.8);
    let moved: Vec<DVec3> =
        mesh.positions().iter().map(|&p| 7.0 * (turn * p) + DVec3::new(3.0, -1.0, 2.0)).collect();
    let after = evaluator.table(&flat(&moved), &mut Workspace::default());
    for (functional, value) in before.iter() {
        let factor = match functional {
            Functional::Area => 49.0,
            Functional::MeanCurvature => 7.0,
            _ => 1.0,
        };
        let error = (after.get(functional) - factor * value).abs();
        assert!(error < 1e-9 * (1.0 + (factor * value).abs()), "{functional}");
    }
}

#[test]
fn results_do_not_depend_on_the_number_of_threads() {
    let mesh = refined(&quad_graphs::theta_graph(3), 2);
    let energy: Energy = "0.5*bending + mvs_cross".parse().expect("an energy");
    let x = flat(mesh.positions());
    let run = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("a pool");
        pool.install(|| {
            let mut gradient = vec![0.0; x.len()];
            let value = evaluator(&mesh, Quadrature::COARSE).gradient(
                &energy,
                &x,
                None,
                &mut Workspace::default(),
                &mut gradient,
            );
            (value.to_bits(), gradient.iter().map(|g| g.to_bits()).collect::<Vec<_>>())
        })
    };
    assert_eq!(run(1), run(3));
}
