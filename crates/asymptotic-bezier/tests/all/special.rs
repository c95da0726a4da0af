//! Inflections, lines next to curves, irregular vertices, handles, other energies and degrees.

use crate::common::star::star;
use crate::common::{catenoid, corner_data, enneper, exact_net, reference_set, wave};
use asymptotic_bezier::{
    AsymptoticNet, BoundaryEnergy, BoundaryOptions, CornerData, Curvatures, GridshellOptions,
    Input, Interior, Options, PatchCheck, PatchOptions, Place, Quadrilateral, TorsionHandle,
    TorsionWish, fill_net, fill_patch, solve, solve_boundary, solve_quadrilateral,
    solve_quartic_quadrilateral,
};
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

/// Two inflections on r1: the torsions at its ends are those of an exact solution.
#[test]
fn two_inflections_on_one_curve_give_a_regular_patch() {
    let (data, torsions, roots) = wave();
    let options = BoundaryOptions {
        torsions: vec![TorsionHandle::Fixed(torsions[0]), TorsionHandle::Fixed(torsions[1])],
        ..Default::default()
    };
    let quad = solve_quadrilateral(&data, &options).unwrap();
    println!("{:?} {:?} {:?}", quad.boundary.inflections, quad.torsions, quad.warnings);
    for (got, want) in quad.boundary.inflections[0].iter().zip(roots) {
        // Shifting both alike hardly changes the equations, so they are not known better.
        assert!((got - want).abs() < 1e-4, "{got} {want}");
        let jet = quad.boundary.curves[0].jet(*got);
        assert!(jet.first.cross(jet.second).length() < 1e-10);
    }
    let (energy, check) = filled(&quad);
    println!("{energy} {check:?}");
    assert!(check.sine > 0.5 && check.normal_curvature < 1e-10 && check.torsion_defect < 1e-8);
    assert!(check.self_intersections == 0);
    // Left to the corners' twist the torsions differ a little, and the curvatures give way.
    let quad = solve_quadrilateral(&data, &BoundaryOptions::default()).unwrap();
    assert_eq!(quad.boundary.inflections[0].len(), 2);
    let (_, check) = filled(&quad);
    assert!(check.sine > 0.5 && check.normal_curvature < 1e-10 && check.torsion_defect < 1e-8);
    // Without the saturated fields the normal of the plain ones dies at both inflections.
    let mut plain = quad.boundary.clone();
    plain.inflections[0].clear();
    let options = PatchOptions { degree: Some(7), bound: None, ..Default::default() };
    let folded = fill_patch(&plain, &options, Place::Patch(0)).unwrap();
    let check = PatchCheck::new(&folded.patch, &plain);
    println!("{check:?}");
    assert!(check.normal_step < 0.0 && check.boundary_sine < 0.1);
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

/// `CORNER=K` of the command line: the sign is that of the twist of the corners.
#[test]
fn gaussian_curvatures_are_wished_for_without_a_sign() {
    use std::collections::BTreeMap;
    for mirrored in [false, true] {
        let flip = if mirrored { -1.0 } else { 1.0 };
        let data = reference_set("B").data;
        let data = data.map_points(|p| DVec3::new(p.x, p.y, flip * p.z));
        let wished = |wishes: BTreeMap<String, TorsionWish>| {
            let input = Input { torsions: wishes, ..data.clone().into() };
            solve(&input, &Options::default(), &mut ())
        };
        let solution = wished(BTreeMap::from([
            ("11".to_owned(), TorsionWish::GaussianBetween(-0.25, -0.16, 0.0)),
            ("00".to_owned(), TorsionWish::Gaussian(-1.0, 0.0)),
        ]));
        let torsions = solution.unwrap().result.boundary.torsions;
        assert!((torsions[0] - flip).abs() < 1e-12, "{torsions:?}");
        assert!((torsions[3] - 0.4 * flip).abs() < 1e-12, "{torsions:?}");
        let refused = |name: &str, wish| {
            wished(BTreeMap::from([(name.to_owned(), wish)])).unwrap_err().to_string()
        };
        let error = refused("12", TorsionWish::Fixed(1.0));
        assert_eq!(error, "`torsions` has \"12\"; use 00, 10, 01 or 11");
        let error = refused("10", TorsionWish::Gaussian(0.5, 1.0));
        assert!(error.contains("the Gaussian curvature 0.5 is above zero"), "{error}");
    }
}

/// The curves of a solved net, sampled as an OBJ file has them, give the net back.
#[test]
fn sampled_curves_give_their_net_back() {
    let net = exact_net(enneper, [-0.6, 0.9, 0.2, 1.3], [2, 2]);
    let boundary = solve_boundary(&net, &BoundaryOptions::default()).unwrap();
    let polylines: Vec<Vec<DVec3>> = boundary.curves.iter().map(|c| c.polyline(64)).collect();
    let again = AsymptoticNet::from_polylines(&polylines).unwrap();
    assert_eq!((again.faces().len(), again.curves().len()), (4, 12));
    for (a, b) in net.curves().iter().zip(again.curves()) {
        for e in 0..2 {
            let turn = a.arms[e].normalize().cross(b.arms[e].normalize()).length();
            assert!(turn < 1e-4, "tangents differ by {turn}");
            // The faces may have turned over, and with them what is left.
            let (k, l) = (a.curvatures[e].abs(), b.curvatures[e].abs());
            assert!((k - l).abs() < 0.02 * k, "{k} {l}");
        }
    }
    let options = GridshellOptions::default();
    let shell = fill_net(&again, &options).unwrap();
    let check = shell.verify(&again, &options.patch);
    assert!(check.kink().to_degrees() < 1e-8);
    assert!(check.patches.iter().all(|p| p.sine > 0.5 && p.normal_curvature < 1e-10));
    let error = AsymptoticNet::from_polylines(&polylines[1..]).unwrap_err().to_string();
    assert!(error.contains("lies on 0 rings of four"), "{error}");
    let error = AsymptoticNet::from_polylines(&[polylines[0][..2].to_vec()]).unwrap_err();
    assert_eq!(error.to_string(), "net: polyline 0 has 2 points; three are needed for a curvature");
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

/// Odd vertices are flat, sixfold ones alternate (the fixtures of the same names are these nets).
#[test]
fn odd_vertices_are_flat_and_sixfold_vertices_alternate() {
    for valence in [6, 5, 3] {
        let net = star(valence);
        let options = GridshellOptions::default();
        let shell = fill_net(&net, &options).unwrap();
        let check = shell.verify(&net, &options.patch);
        let kink = check.kink().to_degrees();
        let sine = check.patches.iter().map(|p| p.sine).fold(1.0, f64::min);
        let normal = check.patches.iter().map(|p| p.normal_curvature).fold(0.0, f64::max);
        println!("valence {valence}: kink {kink:e} sine {sine} {:?}", check.warnings);
        assert!(kink < 1e-8 && sine > 0.5 && normal < 1e-10);
        let torsions: Vec<f64> = (0..net.curves().len())
            .filter(|i| net.curves()[*i].ends[0] == 0)
            .map(|i| shell.boundary.curves[i].jet(0.0).torsion())
            .collect();
        // The middle vertex is corner 00 of every patch.
        let gauss: Vec<f64> =
            shell.patches.iter().map(|p| p.patch.jet(0.0, 0.0).gaussian_curvature()).collect();
        let told: Vec<String> = check.warnings.iter().map(ToString::to_string).collect();
        let words = format!(
            "vertex 0: interior vertex of odd valence {valence}; torsion and Gaussian curvature are zero there"
        );
        if valence % 2 == 1 {
            assert!(torsions.iter().all(|t| t.abs() < 1e-10));
            assert!(gauss.iter().all(|k| k.abs() < 1e-10), "{gauss:?}");
            assert!(told.contains(&words), "{told:?}");
        } else {
            assert!(torsions.windows(2).all(|w| (w[0] + w[1]).abs() < 1e-9));
            assert!(torsions[0].abs() > 1e-4);
            let want = -torsions[0] * torsions[0];
            assert!(gauss.iter().all(|k| (k - want).abs() < 1e-9), "{gauss:?}");
            assert!(!told.contains(&words));
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
