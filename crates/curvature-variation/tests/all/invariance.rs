//! What energies do not depend on, and identities between them, on shaken meshes.

use curvature_variation::blocks::SurfaceBlock;
use curvature_variation::{
    CONTROL_POINTS, Energy, EnergyTable, Functional, Quadrature, SurfaceEnergy, Workspace,
};
use fixtures::quad_graphs;
use geom_core::{DMat3, DVec3, PolyMesh};
use gp_solver::{EnergyBlock, OptionValue, Variables};
use proptest::prelude::*;
use std::f64::consts::TAU;
use subdiv_catmull_clark::{Blend, Creases, SubdivisionSurface};

const MEHLUM_TARROU: Functional = Functional::MehlumTarrou { w1: 1.0, w3: 1.0 };

/// A torus or an ellipsoid, each vertex moved a little.
fn shaken() -> impl Strategy<Value = PolyMesh> {
    (any::<bool>(), 0.0..1.0_f64).prop_map(|(is_torus, seed)| {
        let mut mesh = if is_torus {
            quad_graphs::torus(8, 7, 1.0, 0.45)
        } else {
            quad_graphs::ellipsoid(3, DVec3::new(1.0, 1.2, 1.5))
        };
        for (k, p) in mesh.positions_mut().iter_mut().enumerate() {
            let angle = 100.0 * seed + 2.4 * k as f64;
            *p += 0.02 * DVec3::new(angle.sin(), (1.7 * angle).cos(), (0.6 * angle).sin());
        }
        mesh
    })
}

fn rotation() -> impl Strategy<Value = DMat3> {
    (0.0..TAU, 0.0..TAU, 0.0..TAU).prop_map(|(a, b, c)| {
        DMat3::from_rotation_x(a) * DMat3::from_rotation_y(b) * DMat3::from_rotation_z(c)
    })
}

fn functional() -> impl Strategy<Value = Functional> {
    (0..Functional::ALL.len()).prop_map(|k| Functional::ALL[k])
}

fn flat(mesh: &PolyMesh) -> Vec<f64> {
    mesh.positions().iter().flat_map(|p| p.to_array()).collect()
}

fn evaluator(mesh: &PolyMesh) -> SurfaceEnergy {
    let surface = SubdivisionSurface::new(mesh, &Creases::none(), Blend::Smooth).expect("regular");
    SurfaceEnergy::new(&surface, mesh.vertex_count(), Quadrature::COARSE)
}

fn table(mesh: &PolyMesh) -> EnergyTable {
    evaluator(mesh).table(&flat(mesh), &mut Workspace::default())
}

fn mapped(mesh: &PolyMesh, map: impl Fn(DVec3) -> DVec3) -> PolyMesh {
    let mut out = mesh.clone();
    out.positions_mut().iter_mut().for_each(|p| *p = map(*p));
    out
}

fn value_and_gradient(mesh: &PolyMesh, functional: Functional) -> (f64, Vec<DVec3>) {
    let x = flat(mesh);
    let mut gradient = vec![0.0; x.len()];
    let energy = Energy::from_functional(functional);
    let work = &mut Workspace::default();
    let value = evaluator(mesh).gradient(&energy, &x, None, work, &mut gradient);
    (value, gradient.chunks(3).map(DVec3::from_slice).collect())
}

fn close(a: f64, b: f64, tolerance: f64) -> bool {
    (a - b).abs() <= tolerance * (1.0 + a.abs().max(b.abs()))
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(12))]

    #[test]
    fn energies_do_not_depend_on_place(mesh in shaken(), turn in rotation(), x in -9.0..9.0_f64) {
        let moved = mapped(&mesh, |p| turn * p + DVec3::new(x, 2.0, -x));
        for ((f, a), (_, b)) in table(&mesh).iter().zip(table(&moved).iter()) {
            prop_assert!(close(a, b, 1e-9), "{f}: {a} {b}");
        }
    }

    #[test]
    fn energies_scale_with_their_power_of_length(mesh in shaken(), scale in 0.1..10.0_f64) {
        let scaled = mapped(&mesh, |p| scale * p);
        for ((f, a), (_, b)) in table(&mesh).iter().zip(table(&scaled).iter()) {
            let power = match f {
                Functional::Area => 2,
                Functional::MeanCurvature => 1,
                _ => 0,
            };
            prop_assert!(close(a * scale.powi(power), b, 1e-9), "{f}: {a} {b}");
        }
    }

    #[test]
    fn mirror_images_have_the_same_energies(mesh in shaken()) {
        // Mirrored positions in the same faces turn the surface inside out.
        let mirrored = mapped(&mesh, |p| DVec3::new(-p.x, p.y, p.z));
        for ((f, a), (_, b)) in table(&mesh).iter().zip(table(&mirrored).iter()) {
            let sign = if f == Functional::MeanCurvature { -1.0 } else { 1.0 };
            prop_assert!(close(sign * a, b, 1e-9), "{f}: {a} {b}");
        }
    }

    #[test]
    fn energies_do_not_depend_on_numbering(mesh in shaken(), step in 1..20_usize) {
        let n = mesh.vertex_count();
        let step = (step..).find(|s| (1..=*s).rev().find(|d| s % d == 0 && n % d == 0) == Some(1));
        let new = |v: usize| v * step.unwrap_or(1) % n;
        let mut positions = vec![DVec3::ZERO; n];
        mesh.positions().iter().enumerate().for_each(|(v, p)| positions[new(v)] = *p);
        let faces: Vec<Vec<u32>> = mesh
            .faces()
            .map(|f| mesh.face_vertices(f).map(|v| new(v.index()) as u32).collect())
            .collect();
        let renumbered = PolyMesh::new(positions, &faces).expect("the same mesh");
        for ((f, a), (_, b)) in table(&mesh).iter().zip(table(&renumbered).iter()) {
            prop_assert!(close(a, b, 1e-9), "{f}: {a} {b}");
        }
    }

    #[test]
    fn moving_everything_changes_nothing(mesh in shaken(), f in functional()) {
        let (_, gradient) = value_and_gradient(&mesh, f);
        let size: f64 = gradient.iter().map(|g| g.length()).sum();
        let sum: DVec3 = gradient.iter().copied().sum();
        prop_assert!(sum.length() <= 1e-9 * (1.0 + size), "{f}: {sum}");
    }

    #[test]
    fn turning_everything_changes_nothing(mesh in shaken(), f in functional()) {
        let (_, gradient) = value_and_gradient(&mesh, f);
        let turn: DVec3 = gradient.iter().zip(mesh.positions()).map(|(g, p)| p.cross(*g)).sum();
        let size: f64 = gradient.iter().map(|g| g.length()).sum();
        prop_assert!(turn.length() <= 1e-9 * (1.0 + size), "{f}: {turn}");
    }

    #[test]
    fn the_slope_along_growth_is_the_power_of_length(mesh in shaken(), f in functional()) {
        let (value, gradient) = value_and_gradient(&mesh, f);
        let slope: f64 = gradient.iter().zip(mesh.positions()).map(|(g, p)| p.dot(*g)).sum();
        let power = match f {
            Functional::Area => 2.0,
            Functional::MeanCurvature => 1.0,
            // Its regularisation is held fixed while differentiating.
            Functional::Sqrt => return Ok(()),
            _ => 0.0,
        };
        let size: f64 = gradient.iter().map(|g| g.length()).sum();
        prop_assert!((slope - power * value).abs() <= 1e-8 * (1.0 + size), "{f}: {slope} {value}");
    }

    #[test]
    fn sums_are_weighed_term_by_term(mesh in shaken(), a in -2.0..2.0_f64, b in 0.0..3.0_f64) {
        let energy = Energy { terms: vec![(a, Functional::Bending), (b, MEHLUM_TARROU)] };
        let got = evaluator(&mesh).energy(&energy, &flat(&mesh), &mut Workspace::default());
        let found = table(&mesh);
        let want = a * found.get(Functional::Bending) + b * found.get(MEHLUM_TARROU);
        prop_assert!(close(got, want, 1e-10), "{got} {want}");
        prop_assert!(close(found.total(&energy), want, 1e-12));
    }

    #[test]
    fn second_order_energies_are_combinations_of_two(mesh in shaken()) {
        let found = table(&mesh);
        let get = |f: Functional| found.get(f);
        let (bending, willmore) = (get(Functional::Bending), get(Functional::Willmore));
        // k1² + k2² = 4H² − 2K and (k1 − k2)² = 4H² − 4K, at every point.
        let gaussian = get(Functional::Gaussian);
        prop_assert!(close(bending, 4.0 * willmore - 2.0 * gaussian, 1e-10));
        prop_assert!(close(get(Functional::UmbilicDeviation), 4.0 * (willmore - gaussian), 1e-10));
    }

    #[test]
    fn third_order_energies_are_combinations_of_the_harmonics(mesh in shaken()) {
        let found = table(&mesh);
        let get = |f: Functional| found.get(f);
        let (f1, f3) = (get(Functional::F1), get(Functional::F3));
        prop_assert!(close(get(MEHLUM_TARROU), f1 + f3, 1e-10));
        prop_assert!(close(get(Functional::CrossCurvature), f1 / 9.0 + f3, 1e-10));
        let mean = 0.5 * (get(MEHLUM_TARROU) + get(Functional::CrossCurvature));
        prop_assert!(close(get(Functional::AverageDerivative), mean, 1e-10));
    }

    #[test]
    fn harmonics_and_squares_are_never_negative(mesh in shaken()) {
        let found = table(&mesh);
        for f in [Functional::F1, Functional::F3, Functional::Mvs, Functional::MvsCross,
                  Functional::Bending, Functional::UmbilicDeviation, Functional::Sqrt] {
            prop_assert!(found.get(f) >= 0.0, "{f}: {}", found.get(f));
        }
    }

    #[test]
    fn blocks_measure_what_the_evaluator_measures(mesh in shaken(), f in functional()) {
        let surface =
            SubdivisionSurface::new(&mesh, &Creases::none(), Blend::Smooth).expect("regular");
        let points = Variables::new().add(CONTROL_POINTS, mesh.vertex_count(), 3);
        let energy = Energy::from_functional(f);
        let mut block = SurfaceBlock::new(&surface, points, &energy, Quadrature::COARSE);
        block.refresh(&flat(&mesh));
        let (want, _) = value_and_gradient(&mesh, f);
        prop_assert_eq!(block.energy(&flat(&mesh)), want);
    }

    #[test]
    fn energies_read_what_they_print(weights in prop::collection::vec(-9.0..9.0_f64, 1..5)) {
        let terms = weights.iter().enumerate().map(|(k, &w)| match Functional::ALL[3 * k] {
            Functional::MehlumTarrou { .. } => (w, Functional::MehlumTarrou { w1: 0.5, w3: w }),
            other => (w, other),
        });
        let energy = Energy { terms: terms.collect() };
        let text = energy.print().expect("a sum");
        prop_assert_eq!(Energy::read(&text), Ok(energy), "{}", text);
    }
}
