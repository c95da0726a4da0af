//! Inflections, lines next to curves, irregular vertices, handles, other energies and degrees.
#![allow(clippy::unwrap_used, reason = "a refusal should stop the test")]

mod common;

use asymptotic_bezier::{
    AsymptoticNet, BoundaryEnergy, BoundaryOptions, CornerData, Curvatures, GridshellOptions,
    Interior, NetCurve, PatchCheck, PatchOptions, Place, Quadrilateral, TorsionHandle, fill_net,
    fill_patch, solve_quadrilateral, solve_quartic_quadrilateral,
};
use common::{catenoid, corner_data, enneper, reference_set};
use geom_core::DVec3;

fn filled(quad: &Quadrilateral) -> (f64, PatchCheck) {
    let filled = fill_patch(&quad.boundary, &PatchOptions::default(), Place::Patch(0)).unwrap();
    (filled.thin_plate_energy, PatchCheck::new(&filled.patch, &quad.boundary))
}

/// Catenoid window across the neck: r1 and r3 inflect.
#[test]
fn inflected_boundaries_give_regular_patches() {
    let mut data = corner_data(catenoid, [-0.7, 0.8, -0.4, 0.5]);
    data.inflections = [1, 0, 1, 0];
    let quad = solve_quadrilateral(&data, &BoundaryOptions::default()).unwrap();
    let (energy, check) = filled(&quad);
    println!("{:?} {energy} {check:?}", quad.boundary.inflections);
    assert!((quad.boundary.inflections[0][0] - 0.733).abs() < 0.05);
    assert!((quad.boundary.inflections[2][0] - 0.133).abs() < 0.05);
    assert!(check.sine > 0.9 && check.normal_curvature < 1e-10 && check.torsion_defect < 1e-8);
    assert!(check.positive_gauss == 0.0 && check.self_intersections == 0);
    assert!(energy < 1.2, "{energy}");
}

/// E+ with sides straightened (energies of the independent solution).
#[test]
fn lines_beside_curves_match_the_reference_energies() {
    let base = reference_set("Eplus").data;
    let cases = [
        (vec![0], 2.632435692, 13.38355),
        (vec![0, 1], 1.753840208, 12.684175),
        (vec![0, 2], 1.759221576, 13.095356),
        (vec![0, 1, 2], 0.8796107882, 12.224457),
        (vec![0, 1, 2, 3], 0.0, 11.52),
    ];
    for (lines, strain, plate) in cases {
        let mut data = straightened(&base, &lines);
        data.curvatures = match data.curvatures {
            Curvatures::Signed(mut k) => {
                lines.iter().for_each(|i| k[*i] = [0.0; 2]);
                Curvatures::Signed(k)
            }
            other => other,
        };
        let quad = solve_quadrilateral(&data, &BoundaryOptions::default()).unwrap();
        let (energy, check) = filled(&quad);
        println!("{lines:?} {} {strain} {energy} {plate} {check:?}", quad.strain_energy);
        assert!((quad.strain_energy - strain).abs() < 1e-8, "{lines:?}");
        assert!((energy - plate).abs() < 1e-5 * plate, "{lines:?}: {energy}");
        assert!(check.normal_curvature < 1e-12 && check.sine > 0.84 && check.gaussian[1] < 0.0);
    }
}

fn straightened(data: &CornerData, lines: &[usize]) -> CornerData {
    let ends = [[0, 1], [0, 2], [2, 3], [1, 3]];
    let mut out = data.clone();
    for &i in lines {
        let [a, b]: [usize; 2] = ends[i];
        out.lines[i] = true;
        out.start_points[i] = data.corners[a].lerp(data.corners[b], 0.2);
        out.end_points[i] = data.corners[a].lerp(data.corners[b], 0.8);
    }
    out
}

#[test]
fn torsion_handles_are_met_exactly() {
    let data = reference_set("B").data;
    let options = BoundaryOptions {
        torsions: vec![
            TorsionHandle::Fixed(1.0),
            TorsionHandle::Between(0.7, f64::INFINITY),
            TorsionHandle::Free,
            TorsionHandle::gaussian(-0.16, 1.0),
        ],
        ..Default::default()
    };
    let quad = solve_quadrilateral(&data, &options).unwrap();
    assert_eq!(quad.torsions[0], 1.0);
    assert_eq!(quad.torsions[1], 0.7);
    assert!((quad.torsions[3] - 0.4).abs() < 1e-15);
    let tau = quad.boundary.curves[0].jet(0.0).torsion();
    assert!((tau - 1.0).abs() < 1e-10, "{tau}");
    let tau = quad.boundary.curves[1].jet(0.0).torsion();
    assert!((tau + 1.0).abs() < 1e-10, "{tau}");
    let (_, check) = filled(&quad);
    assert!(check.torsion_defect < 1e-8);
}

#[test]
fn other_energies_and_higher_degrees_lower_what_they_minimise() {
    let data = reference_set("B").data;
    let solve = |degree: usize, energy: BoundaryEnergy| {
        let options = BoundaryOptions { degree, energy, ..Default::default() };
        solve_quadrilateral(&data, &options).unwrap()
    };
    let energy = |quad: &Quadrilateral, order: usize| -> f64 {
        quad.boundary.curves.iter().map(|c| c.derivative_energy(order)).sum()
    };
    let torsion = |quad: &Quadrilateral| -> f64 {
        // L ∫ τ² ds with the chord L, by the midpoint rule.
        quad.boundary
            .curves
            .iter()
            .map(|c| {
                let chord = (c.position(1.0) - c.position(0.0)).length();
                let at = |k: usize| c.jet((k as f64 + 0.5) / 2000.0);
                let sum: f64 = (0..2000)
                    .map(|k| at(k).torsion().powi(2) * at(k).first.length() / 2000.0)
                    .sum();
                chord * sum
            })
            .sum()
    };
    let strain = solve(5, BoundaryEnergy::Strain);
    let jerk = solve(5, BoundaryEnergy::Jerk);
    let least = solve(5, BoundaryEnergy::Torsion);
    assert!(energy(&jerk, 3) < energy(&strain, 3));
    assert!(energy(&strain, 2) < energy(&jerk, 2));
    assert!(torsion(&least) < torsion(&strain), "{} {}", torsion(&least), torsion(&strain));
    // Perturbing a corner torsion of the minimum does not improve it.
    for corner in 0..4 {
        for step in [-0.02, 0.02] {
            let mut torsions: Vec<TorsionHandle> =
                least.torsions.iter().map(|t| TorsionHandle::Fixed(*t)).collect();
            torsions[corner] = TorsionHandle::Fixed(least.torsions[corner] + step);
            let options = BoundaryOptions { torsions, ..Default::default() };
            let moved = solve_quadrilateral(&data, &options).unwrap();
            assert!(torsion(&moved) > torsion(&least) * (1.0 - 1e-6), "corner {corner}");
        }
    }
    let mut before = energy(&strain, 2);
    for degree in 6..=9 {
        let quad = solve(degree, BoundaryEnergy::Strain);
        let now = energy(&quad, 2);
        assert!(now <= before * (1.0 + 1e-9), "degree {degree}: {now} {before}");
        before = now;
        let (_, check) = filled(&quad);
        println!("degree {degree}: strain {now} {check:?}");
        assert!(check.normal_curvature < 1e-10 && check.torsion_defect < 1e-7);
        assert!(check.sine > 0.3);
    }
}

/// `valence` quads around the origin with the tangent planes of the monkey saddle
/// `z = 0.02 (x³ − 3 x y²)`; arms turn alike, so that no curve has an inflection.
fn star(valence: usize) -> AsymptoticNet {
    let sector = std::f64::consts::TAU / valence as f64;
    // Along the straight lines of the saddle for six, beside them otherwise.
    let first = if valence == 6 { std::f64::consts::FRAC_PI_6 } else { 0.2 };
    let lift = |x: f64, y: f64| DVec3::new(x, y, 0.02 * (x.powi(3) - 3.0 * x * y * y));
    let at = |r: f64, a: f64| lift(r * a.cos(), r * a.sin());
    let mut positions = vec![DVec3::ZERO];
    positions.extend((0..valence).map(|k| at(1.0, first + sector * k as f64)));
    positions.extend((0..valence).map(|k| at(1.35, first + sector * (k as f64 + 0.5))));
    let mut curves = Vec::new();
    let mut add = |a: usize, b: usize, bend: f64| {
        let chord = positions[b] - positions[a];
        // Tangents turned off the chord and laid into the tangent planes, curvature to match.
        let arm = |v: usize, d: DVec3, angle: f64| {
            let (p, d) = (positions[v], geom_core::DMat3::from_rotation_z(angle).mul_vec3(d));
            let slope = 0.06 * ((p.x * p.x - p.y * p.y) * d.x - 2.0 * p.x * p.y * d.y);
            DVec3::new(d.x, d.y, slope) * 0.2
        };
        let k = 2.0 * bend / chord.length();
        curves.push(NetCurve {
            ends: [a, b],
            arms: [arm(a, chord, -bend), arm(b, -chord, bend)],
            curvatures: [k, -k],
            line: false,
            inflections: 0,
        });
    };
    for k in 0..valence {
        let next = (k + 1) % valence;
        add(0, 1 + k, 0.15);
        add(1 + k, 1 + valence + k, -0.12);
        add(1 + valence + k, 1 + next, -0.12);
    }
    let quads: Vec<[usize; 4]> =
        (0..valence).map(|k| [0, 1 + k, 1 + valence + k, 1 + (k + 1) % valence]).collect();
    AsymptoticNet::new(positions, &quads, curves).unwrap()
}

#[test]
fn odd_vertices_are_flat_and_sixfold_vertices_alternate() {
    for valence in [3, 6] {
        let net = star(valence);
        let options = GridshellOptions::default();
        match fill_net(&net, &options) {
            Ok(shell) => {
                let check = shell.verify(&net, &options.patch);
                let kink = check.kink().to_degrees();
                let sine = check.patches.iter().map(|p| p.sine).fold(1.0, f64::min);
                println!("valence {valence}: kink {kink:e} sine {sine} {:?}", check.warnings);
                let torsions: Vec<f64> = (0..net.curves().len())
                    .filter(|i| net.curves()[*i].ends[0] == 0)
                    .map(|i| shell.boundary.curves[i].jet(0.0).torsion())
                    .collect();
                println!("{torsions:?}");
                assert!(kink < 1e-8 && sine > 0.5);
                if valence % 2 == 1 {
                    assert!(torsions.iter().all(|t| t.abs() < 1e-10));
                } else {
                    assert!(torsions.windows(2).all(|w| (w[0] + w[1]).abs() < 1e-9));
                    assert!(torsions[0].abs() > 1e-4);
                }
            }
            Err(error) => panic!("valence {valence}: {error}"),
        }
    }
}

#[test]
fn masks_keep_the_boundary_and_cost_little() {
    let data = reference_set("B").data;
    let quad = solve_quadrilateral(&data, &BoundaryOptions::default()).unwrap();
    let (least, _) = filled(&quad);
    for interior in [
        Interior::Harmonic,
        Interior::QuasiHarmonic,
        Interior::Dirichlet,
        Interior::Bending,
        Interior::Coons,
    ] {
        let options = PatchOptions { interior, ..Default::default() };
        let masked = fill_patch(&quad.boundary, &options, Place::Patch(0)).unwrap();
        let check = PatchCheck::new(&masked.patch, &quad.boundary);
        let ratio = masked.thin_plate_energy / least;
        println!("{interior:?}: {ratio}");
        assert!((1.0 - 1e-12..2.3).contains(&ratio), "{interior:?}: {ratio}");
        assert!(check.normal_curvature < 1e-10 && check.self_intersections == 0);
    }
}

#[test]
fn exact_nets_have_quartic_boundaries() {
    let data = corner_data(enneper, [-0.6, 0.9, 0.2, 1.3]);
    let quad = solve_quartic_quadrilateral(&data).unwrap();
    assert_eq!(quad.freedoms, 1);
    for degree in [5, 6, 8] {
        let options = PatchOptions { degree: Some(degree), ..Default::default() };
        let filled = fill_patch(&quad.boundary, &options, Place::Patch(0)).unwrap();
        let check = PatchCheck::new(&filled.patch, &quad.boundary);
        println!("bi-{degree}: {} {check:?}", filled.thin_plate_energy);
        assert!(check.normal_curvature < 1e-10 && check.torsion_defect < 1e-8);
        assert!(check.sine > 0.9 && filled.thin_plate_energy < 10.5);
    }
    let options = PatchOptions { ansatz: asymptotic_bezier::Ansatz::Paper, ..Default::default() };
    let paper = fill_patch(&quad.boundary, &options, Place::Patch(0)).unwrap();
    assert_eq!(paper.patch.degree(), 8);
    assert!(PatchCheck::new(&paper.patch, &quad.boundary).normal_curvature < 1e-10);
}
