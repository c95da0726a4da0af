//! Functionals on the sphere, Gauss-Bonnet, invariances; gradients against central differences.
//! The closed forms of the torus are in `tori.rs`.

use curvature_variation::{Energy, Functional, Quadrature, SurfaceEnergy, Workspace, analyze};
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
    let clifford = std::f64::consts::FRAC_1_SQRT_2;
    for (name, mesh) in [
        ("theta", quad_graphs::theta_graph(3)),
        ("four-way theta", quad_graphs::theta_graph(4)),
        ("theta of six arms", quad_graphs::theta_graph(6)),
        ("tetrahedron", quad_graphs::tetrahedron_graph()),
        ("prism", quad_graphs::prism_graph()),
        ("cube", quad_graphs::cube_graph()),
        ("ellipsoid", quad_graphs::ellipsoid(3, DVec3::new(1.0, 1.3, 2.0))),
        ("dense ellipsoid", quad_graphs::ellipsoid(8, DVec3::new(1.0, 1.5, 2.5))),
        ("torus", quad_graphs::torus(12, 8, 1.0, 0.5)),
        ("sheared torus", quad_graphs::sheared_torus(16, 12, 1.0, clifford, [1, 0], [1, 1])),
    ] {
        let found = analyze(&mesh, &Creases::none(), Blend::Smooth, None).expect("a surface");
        let residual = found.gauss_bonnet_residual.expect("a closed surface");
        assert!(residual < 2e-4, "{name}: {residual}");
        // The normal quadrature, which descents use, is as good.
        let energy = evaluator(&found.mesh, Quadrature::NORMAL);
        let positions = flat(found.mesh.positions());
        let got = energy.table(&positions, &mut Workspace::default()).get(Functional::Gaussian);
        let total = energy.absolute_gaussian(&positions, &mut Workspace::default());
        let want = 2.0 * PI * mesh.euler_characteristic() as f64;
        assert!((got - want).abs() < 2e-4 * total, "{name}: {got} against {want}");
    }
    for open in [quad_graphs::vase(12), quad_graphs::sheet_with_tube(6)] {
        let found = analyze(&open, &Creases::none(), Blend::Smooth, None).expect("a surface");
        assert_eq!(found.gauss_bonnet_residual, None);
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
