//! The crate's blocks: derivatives, agreement with the evaluator, problems made of them.

use curvature_variation::blocks::{FamilyBlock, PinnedLimits, PulledPoints, SurfaceBlock};
use curvature_variation::{
    CONTROL_POINTS, Constraints, Energy, Input, Options, Quadrature, SHARES, SurfaceEnergy,
    Symmetry, Workspace, problem, solve,
};
use fixtures::quad_graphs;
use geom_core::{DVec3, PolyMesh};
use gp_solver::{
    EnergyBlock, Group, Options as SolverOptions, ResidualBlock, Variables, check_gradient,
    check_jacobian,
};
use subdiv_catmull_clark::{Blend, Creases, SubdivisionSurface};

fn flat(mesh: &PolyMesh) -> Vec<f64> {
    mesh.positions().iter().flat_map(|p| p.to_array()).collect()
}

fn points(mesh: &PolyMesh) -> Group {
    Variables::new().add(CONTROL_POINTS, mesh.vertex_count(), 3)
}

/// A regular mesh and one with blends of several rings.
fn cases() -> [(PolyMesh, SubdivisionSurface); 2] {
    [quad_graphs::torus(6, 5, 1.0, 0.5), quad_graphs::ellipsoid(4, DVec3::new(1.0, 1.2, 1.6))].map(
        |mesh| {
            let surface = SubdivisionSurface::new(&mesh, &Creases::none(), Blend::Smooth)
                .expect("regular rings");
            (mesh, surface)
        },
    )
}

const ENERGIES: [&str; 5] = [
    "bending",
    "mehlum_tarrou",
    "0.3*mvs_cross + 2*area",
    "sqrt + 0.1*f3",
    "bending - 0.25*gaussian + 0.01*mvs",
];

#[test]
fn gradients_of_surface_blocks_match_differences() {
    for (mesh, surface) in cases() {
        for text in ENERGIES {
            let energy: Energy = text.parse().expect("an energy");
            let mut block = SurfaceBlock::new(&surface, points(&mesh), &energy, Quadrature::COARSE);
            let x = flat(&mesh);
            block.refresh(&x);
            let worst = check_gradient(&block, &x).expect("finite").expect("it has unknowns");
            assert!(worst.error < 2e-5, "{text}, {} vertices: {worst:?}", mesh.vertex_count());
        }
    }
}

#[test]
fn surface_blocks_are_the_evaluator_element_by_element() {
    for (mesh, surface) in cases() {
        let evaluator = SurfaceEnergy::new(&surface, mesh.vertex_count(), Quadrature::NORMAL);
        for text in ENERGIES {
            let energy: Energy = text.parse().expect("an energy");
            let mut block = SurfaceBlock::new(&surface, points(&mesh), &energy, Quadrature::NORMAL);
            let x = flat(&mesh);
            block.refresh(&x);
            let mut want = vec![0.0; x.len()];
            let mut work = Workspace::default();
            let value = evaluator.gradient(&energy, &x, None, &mut work, &mut want);
            let elements = block.elements();
            let mut gradients = vec![f64::NAN; elements.rows_total()];
            let mut hessians = vec![f64::NAN; elements.jacobian_len()];
            let got = block.quadratic_model(&x, &mut gradients, &mut hessians);
            assert_eq!(got, value, "{text}");
            assert_eq!(block.energy(&x), value, "{text}");
            let mut sum = vec![0.0; x.len()];
            for e in 0..elements.len() {
                for (&c, g) in elements.columns(e).iter().zip(&gradients[elements.rows(e)]) {
                    sum[c] += g;
                }
                // Positive semidefinite and symmetric.
                let n = elements.columns(e).len();
                let hessian = &hessians[elements.jacobian_range(e)];
                let along: Vec<f64> = (0..n).map(|k| (1.3 * k as f64).sin()).collect();
                let mut bend = 0.0;
                for i in 0..n {
                    for j in 0..n {
                        assert_eq!(hessian[i * n + j], hessian[j * n + i]);
                        bend += along[i] * hessian[i * n + j] * along[j];
                    }
                }
                assert!(bend > -1e-9, "{text}: {bend}");
            }
            assert_eq!(sum, want, "{text}");
        }
    }
}

#[test]
fn gauss_newton_hessians_are_those_of_quadratic_energies() {
    // Bending of a nearly flat sheet is quadratic in the heights.
    let n = 7_u32;
    let at = |k: u32| DVec3::new(f64::from(k % n), f64::from(k / n), 0.0);
    let faces: Vec<[u32; 4]> = (0..(n - 1) * (n - 1))
        .map(|k| {
            let v = k / (n - 1) * n + k % (n - 1);
            [v, v + 1, v + n + 1, v + n]
        })
        .collect();
    let mesh = PolyMesh::new((0..n * n).map(at).collect(), &faces).expect("a sheet");
    let surface = SubdivisionSurface::new(&mesh, &Creases::none(), Blend::Smooth).expect("regular");
    let energy: Energy = "bending".parse().expect("an energy");
    let block = SurfaceBlock::new(&surface, points(&mesh), &energy, Quadrature::NORMAL);
    let lift: Vec<f64> = (0..n * n).map(|k| (0.9 * f64::from(k)).sin()).collect();
    let mut x = flat(&mesh);
    x.iter_mut().skip(2).step_by(3).zip(&lift).for_each(|(z, l)| *z = 1e-5 * l);
    let elements = block.elements();
    let mut gradients = vec![0.0; elements.rows_total()];
    let mut hessians = vec![0.0; elements.jacobian_len()];
    let value = block.quadratic_model(&x, &mut gradients, &mut hessians);
    let mut bend = 0.0;
    for e in 0..elements.len() {
        let columns = elements.columns(e);
        let hessian = &hessians[elements.jacobian_range(e)];
        for (i, &a) in columns.iter().enumerate() {
            for (j, &b) in columns.iter().enumerate() {
                if a % 3 == 2 && b % 3 == 2 {
                    bend += 0.5 * x[a] * hessian[i * columns.len() + j] * x[b];
                }
            }
        }
    }
    assert!((bend / value - 1.0).abs() < 1e-3, "{bend} against {value}");
}

#[test]
fn jacobians_of_pulls_and_pins_match_differences() {
    let mesh = quad_graphs::torus(6, 5, 1.0, 0.5);
    let x = flat(&mesh);
    let mut pulls = PulledPoints::new(points(&mesh));
    pulls.pull(&[(0, 0.5), (3, 0.25), (7, 0.25)], DVec3::new(1.0, 2.0, 3.0), 0.7);
    pulls.pull(&[(2, 1.0)], DVec3::ZERO, 1.5);
    let mut pins = PinnedLimits::new(points(&mesh));
    pins.pin(&[(0, 0.5), (3, 0.5)], DVec3::new(0.6, 0.0, 0.8), 0.1);
    let blocks: [&dyn ResidualBlock; 2] = [&pulls, &pins];
    for block in blocks {
        let worst = check_jacobian(block, &x).expect("finite").expect("it has derivatives");
        assert!(worst.error < 1e-8, "{worst:?}");
    }
}

#[test]
fn gradients_of_family_blocks_match_differences() {
    let member = |rho: f64| quad_graphs::torus(8, 8, 1.0, rho);
    let family = Input { members: vec![member(0.6), member(0.5)], ..Input::from(member(0.3)) };
    let problem = problem(&family, &Options { levels: 0, ..Options::default() });
    let group = problem.expect("a family").variables().group(SHARES).expect("shares");
    assert_eq!(group.len(), 2);
    let base = flat(&family.mesh);
    let surface = SubdivisionSurface::new(&family.mesh, &Creases::none(), Blend::Smooth);
    let surface = surface.expect("regular");
    let directions: Vec<Vec<f64>> = family
        .members
        .iter()
        .map(|m| flat(m).iter().zip(&base).map(|(y, x)| y - x).collect())
        .collect();
    let energy = Energy::mehlum_tarrou();
    let inner = SurfaceBlock::new(&surface, points(&family.mesh), &energy, Quadrature::NORMAL);
    let block = FamilyBlock::new(inner, group, base, directions);
    let worst = check_gradient(&block, &[0.2, 0.1]).expect("finite").expect("it has unknowns");
    assert!(worst.error < 1e-6, "{worst:?}");
}

#[test]
fn the_problem_of_blocks_has_the_minimum_that_solve_finds() {
    let torus = quad_graphs::torus(10, 8, 1.0, 0.5);
    let options = Options {
        energy: "bending".parse().expect("an energy"),
        levels: 0,
        symmetry: Symmetry::None,
        ..Options::default()
    };
    let far = (0..2).map(|v| (v, 1e-3)).collect();
    let constraints = Constraints { weights: far, ..Constraints::default() };
    let input = Input { constraints, ..Input::from(torus.clone()) };
    let problem = problem(&input, &options).expect("a torus");
    let names: Vec<String> = problem.blocks().map(|(_, name)| name.to_owned()).collect();
    assert_eq!(names, ["surface energy", "pulled limit points"]);
    let mut x = flat(&torus);
    let settings = SolverOptions { max_iterations: 60, ..SolverOptions::default() };
    let report = gp_solver::solve(problem, &mut x, &settings).expect("it can be attempted");
    let want = solve(&input, &options, &mut ()).expect("a torus");
    let want = want.report.stages[0].solver.final_energy;
    let got = report.final_energy;
    assert!((got / want - 1.0).abs() < 1e-3, "{got} against {want}");
}
