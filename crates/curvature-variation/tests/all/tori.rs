//! Tori: closed forms of all functionals, the size of the splines' error, the fairest tori and the
//! fairest rings of any section.

use curvature_variation::{
    EnergyTable, Error, Functional, Input, Options, Quadrature, Solution, SurfaceEnergy,
    SurfaceSamples, Workspace, fitted_torus, solve,
};
use fixtures::quad_graphs;
use geom_core::PolyMesh;
use std::f64::consts::{FRAC_1_SQRT_2, PI, TAU};
use subdiv_catmull_clark::{Blend, Creases, SubdivisionSurface};

const MEHLUM_TARROU: Functional = Functional::MehlumTarrou { w1: 1.0, w3: 1.0 };

fn table(mesh: &PolyMesh) -> EnergyTable {
    let surface = SubdivisionSurface::new(mesh, &Creases::none(), Blend::Smooth).expect("regular");
    let positions: Vec<f64> = mesh.positions().iter().flat_map(|p| p.to_array()).collect();
    SurfaceEnergy::new(&surface, mesh.vertex_count(), Quadrature::NORMAL)
        .table(&positions, &mut Workspace::default())
}

/// `A ∫ c² dA`, the only third-order invariant of a torus of ratio `rho`.
fn torus_c(rho: f64) -> f64 {
    8.0 * PI.powi(4) * (1.0 - rho * rho).powf(-1.5)
}

/// The third-order functionals on a torus; those of `c` alone.
fn third_order(rho: f64) -> [(Functional, f64); 6] {
    let c = torus_c(rho);
    [
        (Functional::MvsCross, c),
        (MEHLUM_TARROU, 9.0 / 16.0 * c),
        (Functional::F1, 9.0 / 32.0 * c),
        (Functional::F3, 9.0 / 32.0 * c),
        (Functional::CrossCurvature, 9.0 / 32.0 * (1.0 / 9.0 + 1.0) * c),
        (Functional::AverageDerivative, 9.0 / 64.0 * (1.0 / 9.0 + 3.0) * c),
    ]
}

#[test]
fn torus_energies_are_the_closed_forms() {
    // The vertices' limit points lie on the torus. The splines' third derivatives are least
    // accurate around the tube, which therefore gets the 64 quads.
    let rho: f64 = 0.5;
    let found = table(&quad_graphs::torus(32, 64, 1.0, rho));
    let willmore = PI * PI / (rho * (1.0 - rho * rho).sqrt());
    let check = |functional: Functional, want: f64, tolerance: f64| {
        let got = found.get(functional);
        assert!((got / want - 1.0).abs() < tolerance, "{functional}: {got} against {want}");
    };
    check(Functional::Area, 4.0 * PI * PI * rho, 1e-4);
    check(Functional::Willmore, willmore, 5e-4);
    check(Functional::Bending, 4.0 * willmore, 5e-4);
    check(Functional::UmbilicDeviation, 4.0 * willmore, 5e-4);
    // ∫ H dA = −2π² R for outward normals.
    check(Functional::MeanCurvature, -2.0 * PI * PI, 1e-4);
    for (functional, want) in third_order(rho) {
        check(functional, want, 1.1e-2);
    }
    let sqrt = 3.0 * 2_f64.sqrt() * PI / rho * ((1.0 + rho) / (1.0 - rho)).ln();
    check(Functional::Sqrt, sqrt, 1.1e-2);
    assert!(found.get(Functional::Gaussian).abs() < 1e-6);
    assert!(found.get(Functional::Mvs) < 1.1e-2 * torus_c(rho));
}

#[test]
fn torus_errors_fall_with_the_square_of_the_mesh_size() {
    let rho = 0.5;
    let (coarse, fine) = (
        table(&quad_graphs::torus(32, 64, 1.0, rho)),
        table(&quad_graphs::torus(64, 128, 1.0, rho)),
    );
    // CrossCurvature and MvsCross as well: every one but the root, whose density has a corner.
    for (functional, want) in third_order(rho) {
        let ratio = (coarse.get(functional) / want - 1.0) / (fine.get(functional) / want - 1.0);
        assert!((3.8..4.2).contains(&ratio), "{functional}: {ratio}");
    }
    let ratio = coarse.get(Functional::Mvs) / fine.get(Functional::Mvs);
    assert!((3.8..4.2).contains(&ratio), "mvs: {ratio}");
}

/// A cubic spline's third derivative is constant between knots. On a circle of radius `r` in `n`
/// pieces the curvature's derivative is therefore off by a saw-tooth of mean square
/// `(2π/n)²/12 / r⁴`, and a torus with `n` quads around the tube gets
/// `A ∫ (dk2/de2)² = 4π⁴ (2π/n)² / (3 ρ²)` where there should be nothing. That is the whole error
/// of `mvs`, `mvs_cross` and `f1`, and 1.7 % of `c` for 32 quads around the tube.
#[test]
fn the_error_is_the_saw_tooth_of_cubic_splines() {
    for (rho, n) in [(0.5, 32), (0.3, 32), (0.3, 64)] {
        // Many quads around the axis leave the tube's share alone.
        let found = table(&quad_graphs::torus(128, n, 1.0, rho));
        let step = TAU / n as f64;
        let want = 4.0 * PI.powi(4) * step * step / (3.0 * rho * rho);
        let got = found.get(Functional::Mvs);
        assert!((got / want - 1.0).abs() < 0.03, "{rho}, {n}: {got} against {want}");
        let cross = found.get(Functional::MvsCross) - torus_c(rho);
        assert!((cross / got - 1.0).abs() < 0.03, "{rho}, {n}: {cross} against {got}");
        let first = found.get(Functional::F1) - 9.0 / 32.0 * torus_c(rho);
        assert!((first / (9.0 / 32.0 * got) - 1.0).abs() < 0.05, "{rho}, {n}: {first}");
    }
}

fn options(energy: &str) -> Options {
    Options { energy: energy.parse().expect("an energy"), levels: 0, ..Options::default() }
}

fn fairest_torus(nu: usize, nv: usize, energy: &str) -> Solution {
    let member = |rho: f64| quad_graphs::torus(nu, nv, 1.0, rho);
    let family = Input { members: vec![member(0.6)], ..Input::from(member(0.3)) };
    solve(&family, &options(energy), &mut ()).expect("a fair torus")
}

fn ratio(result: &Solution) -> f64 {
    fitted_torus(&result.result, &result.surface).expect("a torus").0.ratio()
}

#[test]
fn fairest_tori_have_the_published_ratios() {
    // Joshi 2008, sec. 8.1, looks among tori of revolution.
    for (energy, want, tolerance) in [
        ("bending", FRAC_1_SQRT_2, 2e-3),
        ("willmore", FRAC_1_SQRT_2, 2e-3),
        ("bending + mehlum_tarrou", 0.285, 3e-3),
        ("0.92*bending + 0.08*mehlum_tarrou", 0.503, 5e-3),
        ("0.85*bending + 0.15*f1", 0.502, 5e-3),
        ("0.85*bending + 0.15*f3", 0.502, 5e-3),
        ("0.95*bending + 0.05*mvs_cross", 0.497, 5e-3),
    ] {
        let got = ratio(&fairest_torus(16, 96, energy));
        assert!((got - want).abs() < tolerance, "{energy}: {got}");
    }
}

#[test]
fn ratio_of_the_fairest_torus_tends_to_the_closed_form() {
    // Stationarity of bending + k C: (1 − 2ρ²)(1 − ρ²) = 6π² k ρ³, with k = 9/16. The saw-tooth
    // of the splines weighs on thin tubes, so that coarse meshes prefer thicker ones.
    let root = 0.284_836_5_f64;
    let square = root * root;
    let equation =
        (1.0 - 2.0 * square) * (1.0 - square) - 6.0 * PI * PI * 9.0 / 16.0 * root * square;
    assert!(equation.abs() < 1e-6);
    let error = |nu, nv| ratio(&fairest_torus(nu, nv, "bending + mehlum_tarrou")) - root;
    let (coarse, fine) = (error(32, 32), error(64, 64));
    assert!((0.01..0.03).contains(&coarse), "{coarse}");
    assert!((3.4..4.6).contains(&(coarse / fine)), "{coarse} {fine}");
}

#[test]
fn fairest_rings_of_any_section_are_not_tori() {
    // A ring of revolution whose section is free has less energy than any torus. The values are
    // those of an independent minimisation over sections given by ten Fourier modes.
    for (energy, want_energy, want_ratio, torus_energy) in [
        ("bending + mehlum_tarrou", 636.866, 0.2911, 642.249),
        ("0.85*bending + 0.15*f1", 123.240, 0.5219, 128.109),
        ("0.85*bending + 0.15*f3", 126.779, 0.5205, 128.109),
        ("0.92*bending + 0.08*mehlum_tarrou", 136.950, 0.5017, 137.861),
    ] {
        let mesh = quad_graphs::torus(24, 96, 1.0, 0.4);
        let result = solve(&Input::from(mesh), &options(energy), &mut ()).expect("a fair ring");
        let (got, got_ratio) = (result.metrics.energy_final, ratio(&result));
        assert!((got / want_energy - 1.0).abs() < 4e-3, "{energy}: {got}");
        assert!(got < torus_energy, "{energy}: {got}");
        assert!((got_ratio - want_ratio).abs() < 4e-3, "{energy}: {got_ratio}");
    }
}

#[test]
fn bending_minimiser_of_genus_one_is_the_clifford_torus() {
    let mesh = quad_graphs::torus(16, 8, 1.0, 0.4);
    let refined = Options { levels: 1, ..options("bending") };
    let result = solve(&Input::from(mesh), &refined, &mut ()).expect("a torus");
    assert!((result.metrics.energy_final / (8.0 * PI * PI) - 1.0).abs() < 2e-4);
    // Dense samples: the vertices slide freely along the torus and need not meet its top.
    let points = SurfaceSamples::new(&result.result, &result.surface, 9).positions;
    let (mut inner, mut outer, mut height) = (f64::INFINITY, 0.0_f64, 0.0_f64);
    for p in &points {
        let reach = p.x.hypot(p.y);
        inner = inner.min(reach);
        outer = outer.max(reach);
        height = height.max(p.z.abs());
    }
    let (tube, axis) = (0.5 * (outer - inner), 0.5 * (outer + inner));
    assert!((tube / axis - FRAC_1_SQRT_2).abs() < 2e-3, "{}", tube / axis);
    assert!((ratio(&result) - FRAC_1_SQRT_2).abs() < 2e-3, "{}", ratio(&result));
    // The section is as high as it is wide, and the points stand on circles.
    assert!((height / tube - 1.0).abs() < 2e-3, "{height} against {tube}");
    for p in &points {
        let distance = (p.x.hypot(p.y) - axis).hypot(p.z);
        assert!((distance / tube - 1.0).abs() < 3e-3, "{distance} against {tube}");
    }
}

#[test]
fn members_of_a_family_share_their_faces() {
    let (mesh, other) = (quad_graphs::torus(12, 8, 1.0, 0.5), quad_graphs::torus(8, 12, 1.0, 0.5));
    let family = Input { members: vec![other], ..Input::from(mesh) };
    let error = solve(&family, &options("bending"), &mut ()).expect_err("other faces");
    assert_eq!(error, Error::OtherFaces { member: 1 });
    let text = "mesh 1 of the family has other faces than the input; move its vertices only";
    assert_eq!(error.to_string(), text);
}
