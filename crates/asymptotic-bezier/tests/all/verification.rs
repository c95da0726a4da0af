//! What verification says of good data, bad data, and nets.

use crate::common::{catenoid, enneper, exact_net, reference_set, sampled_net};
use asymptotic_bezier::{
    AsymptoticNet, BoundaryOptions, CurveForm, Gridshell, GridshellCheck, GridshellOptions, Joins,
    PatchCheck, PatchOptions, Place, TorsionHandle, Warning, fill_net, fill_patch, solve_boundary,
    solve_quadrilateral,
};
use geom_core::{DMat3, DVec3, PolyMesh};

#[test]
fn good_sets_have_asymptotic_boundaries_and_no_warnings() {
    for name in ["A", "B", "C", "Eplus", "G", "H"] {
        let set = reference_set(name);
        let quad = solve_quadrilateral(&set.data, &BoundaryOptions::default()).unwrap();
        let filled = fill_patch(&quad.boundary, &PatchOptions::default(), Place::Patch(0)).unwrap();
        let check = PatchCheck::new(&filled.patch, &quad.boundary);
        println!("{name} {check:?} {:?}", quad.warnings);
        assert!(check.normal_curvature <= 1e-10, "{name}: {:e}", check.normal_curvature);
        assert!(check.torsion_defect <= 1e-8, "{name}: {:e}", check.torsion_defect);
        assert!(check.sine > 0.4, "{name}: {}", check.sine);
        assert_eq!(check.self_intersections, 0);
        assert_eq!(check.positive_gauss, 0.0);
        assert!(check.warnings(Place::Patch(0), 0.1).is_empty());
    }
}

#[test]
fn hand_made_and_random_sets_are_warned_about() {
    for name in ["D", "E_", "F"] {
        let set = reference_set(name);
        let quad = solve_quadrilateral(&set.data, &BoundaryOptions::default()).unwrap();
        let turning = |w: &Warning| matches!(w, Warning::BinormalTurning { .. });
        assert!(quad.warnings.iter().any(turning), "{name}");
        println!("{name} {:?}", quad.warnings);
        let options = PatchOptions { degree: Some(7), ..Default::default() };
        let filled = fill_patch(&quad.boundary, &options, Place::Patch(0)).unwrap();
        let check = PatchCheck::new(&filled.patch, &quad.boundary);
        println!("{name} energy {} {check:?}", filled.thin_plate_energy);
        let warnings = check.warnings(Place::Patch(0), 0.1);
        let crossing = |w: &Warning| matches!(w, Warning::SelfIntersection { .. });
        assert!(warnings.iter().any(crossing), "{name}");
    }
}

#[test]
fn transversality_bounds_reproduce_the_recorded_energies() {
    for (name, degree, want) in [("D", 7, 209.15), ("E_", 7, 359.28), ("C", 6, 40.889)] {
        let set = reference_set(name);
        let quad = solve_quadrilateral(&set.data, &BoundaryOptions::default()).unwrap();
        let options = PatchOptions { degree: Some(degree), ..Default::default() };
        let filled = fill_patch(&quad.boundary, &options, Place::Patch(0)).unwrap();
        let energy = filled.thin_plate_energy;
        assert!((energy - want).abs() < 1e-4 * want, "{name}: {energy} against {want}");
        assert!(filled.transversality >= 0.25 - 1e-8);
    }
}

#[test]
fn nets_of_minimal_surfaces_join_without_kinks() {
    let window = [-0.6, 0.9, 0.2, 1.3];
    let sampled = |mesh| AsymptoticNet::from_mesh(&mesh).unwrap();
    let cases: [(&str, AsymptoticNet); 6] = [
        ("Enneper 2x2", exact_net(enneper, window, [2, 2])),
        ("Enneper 3x3", exact_net(enneper, window, [3, 3])),
        ("catenoid 2x2", exact_net(catenoid, [0.2, 1.4, -0.1, 0.9], [2, 2])),
        ("Enneper 3x3 from its vertices", sampled(sampled_net(enneper, window, [3, 3]))),
        ("Enneper 30x30", sampled(sampled_net(enneper, window, [30, 30]))),
        ("catenoid 8x8", sampled(sampled_net(catenoid, [0.5, 1.5, 0.1, 0.9], [8, 8]))),
    ];
    for (name, net) in cases {
        let options = GridshellOptions::default();
        let start = std::time::Instant::now();
        let shell = fill_net(&net, &options).unwrap();
        let solved = start.elapsed();
        let check = shell.verify(&net, &options.patch);
        let verified = start.elapsed() - solved;
        let least = check.patches.iter().map(|p| p.sine).fold(1.0, f64::min);
        let gauss = check.joins.iter().map(|j| j.gaussian_jump).fold(0.0, f64::max);
        let mean = check.joins.iter().map(|j| j.mean_jump).fold(0.0, f64::max);
        let kink = check.kink().to_degrees();
        println!(
            "{name}: kink {kink:e} deg, dK {gauss:e}, dH {mean:e}, sine {least}, {} warnings, {solved:?} {verified:?}",
            check.warnings.len()
        );
        println!("{:?}", check.warnings.first());
        assert!(kink <= 1e-8 && gauss < 1e-6 && least > 0.5, "{name}");
        let normal = check.patches.iter().map(|p| p.normal_curvature).fold(0.0, f64::max);
        let defect = check.patches.iter().map(|p| p.torsion_defect).fold(0.0, f64::max);
        println!("{name}: normal curvature {normal:e}, torsion defect {defect:e}");
        assert!(normal <= 1e-10, "{name}: {normal:e}");
        assert!(defect <= 1e-8, "{name}: {defect:e}");
    }
}

#[test]
fn four_straight_lines_give_the_bilinear_patch_or_a_plane() {
    let v = geom_core::DVec3::new;
    for (z, plane) in [(0.6, false), (0.0, true)] {
        let corners = [v(-1., -1., z), v(1., -1., -z), v(-1.2, 1., -z), v(1.3, 1.1, z)];
        let ends = [[0, 1], [0, 2], [2, 3], [1, 3]];
        let along = |i: usize, t: f64| {
            let [a, b]: [usize; 2] = ends[i];
            corners[a].lerp(corners[b], t)
        };
        let data = asymptotic_bezier::CornerData {
            corners,
            start_points: std::array::from_fn(|i| along(i, 0.2)),
            end_points: std::array::from_fn(|i| along(i, 0.8)),
            curvatures: asymptotic_bezier::Curvatures::Signed([[0.0; 2]; 4]),
            lines: [true; 4],
            inflections: [0; 4],
        };
        let quad = solve_quadrilateral(&data, &BoundaryOptions::default()).unwrap();
        assert!(quad.strain_energy < 1e-20 && quad.warnings.is_empty(), "{:?}", quad.warnings);
        let filled = fill_patch(&quad.boundary, &PatchOptions::default(), Place::Patch(0)).unwrap();
        for k in 0..=100 {
            let (s, t) = (f64::from(k % 10) / 9.0, f64::from(k / 10) / 10.0);
            let want = corners[0].lerp(corners[1], s).lerp(corners[2].lerp(corners[3], s), t);
            let error = (filled.patch.position(s, t) - want).length();
            assert!(error < 1e-12, "{error:e} at {s} {t}");
            assert!(!plane || filled.patch.position(s, t).z.abs() < 1e-13);
        }
    }
}

/// A net across the neck of the catenoid, where every mesh line has an inflection, and its check.
fn neck(form: CurveForm, joins: Joins) -> (AsymptoticNet, Gridshell, GridshellCheck) {
    let mesh = sampled_net(catenoid, [-0.7, 0.8, -0.4, 0.5], [5, 5]);
    let net = AsymptoticNet::from_mesh(&mesh).expect("an asymptotic net");
    assert!(net.curves().iter().any(|c| c.inflections == 1));
    let boundary = BoundaryOptions { form, ..Default::default() };
    let options = GridshellOptions { boundary, joins, ..Default::default() };
    let shell = fill_net(&net, &options).expect("a net that can be filled");
    let check = shell.verify(&net, &options.patch);
    let sine = check.patches.iter().map(|p| p.sine).fold(1.0, f64::min);
    assert!(check.kink().to_degrees() <= 1e-8 && sine > 0.5, "{check:?}");
    assert!(check.patches.iter().all(|p| p.normal_curvature <= 1e-10));
    (net, shell, check)
}

#[test]
fn nets_across_inflections_join_without_kinks() {
    neck(CurveForm::Curvatures, Joins::G1);
    let (net, shell, check) = neck(CurveForm::Normals, Joins::G1);
    assert_eq!(shell.patches[0].patch.degree(), 7);
    assert!(check.warnings.is_empty(), "{:?}", check.warnings);
    for patch in &check.patches {
        assert!(patch.torsion_defect <= 1e-8 && patch.positive_gauss == 0.0, "{patch:?}");
    }
    // K = −1/cosh⁴ on the unit catenoid; the torsions were found from positions alone.
    for (p, tau) in net.positions().iter().zip(&shell.boundary.torsions) {
        let exact = p.truncate().length_squared().recip();
        assert!((tau.abs() / exact - 1.0).abs() < 0.02, "{tau} for {exact}");
    }
    // Normals are chosen without being asked for, because of the inflections.
    let (_, auto, _) = neck(CurveForm::Auto, Joins::G1);
    assert_eq!(auto, shell);
}

/// Moved, scaled, numbered backwards, faces turned over and listed from another corner: the same
/// curves, some the other way round and the families swapped.
#[test]
fn curves_from_normals_depend_on_nothing_but_the_shape() {
    check_invariance(&sampled_net(catenoid, [-0.7, 0.8, -0.4, 0.5], [4, 4]));
    // Across the inflections of Enneper's surface.
    check_invariance(&sampled_net(enneper, [-0.5, 0.6, -0.7, 0.5], [4, 5]));
}

fn check_invariance(mesh: &PolyMesh) {
    let options = BoundaryOptions { form: CurveForm::Normals, ..Default::default() };
    let turn = DMat3::from_axis_angle(DVec3::new(1.0, 2.0, -0.5).normalize(), 0.7);
    let map = |p: DVec3| turn * p * 37.0 + DVec3::new(5.0, -3.0, 8.0);
    let faces: Vec<Vec<u32>> =
        mesh.faces().map(|f| mesh.face_vertices(f).map(|v| v.index() as u32).collect()).collect();
    let last = mesh.positions().len() as u32 - 1;
    let curves = |positions: Vec<DVec3>, faces: &[Vec<u32>]| {
        let moved = PolyMesh::new(positions, faces).expect("the mesh moved");
        let net = AsymptoticNet::from_mesh(&moved).expect("quads");
        let curves = solve_boundary(&net, &options).expect("curves").curves;
        let ends = net.curves().iter().map(|c| c.ends);
        ends.zip(curves.iter().map(|c| c.points().to_vec())).collect::<Vec<_>>()
    };
    let before = curves(mesh.positions().to_vec(), &faces);
    let after = curves(mesh.positions().iter().map(|p| map(*p)).collect(), &faces);
    for ((ends, p), (others, q)) in before.iter().zip(&after) {
        assert_eq!(ends, others);
        let far = p.iter().zip(q).map(|(p, q)| map(*p).distance(*q)).fold(0.0, f64::max);
        assert!(far < 37.0 * 1e-10, "moved: {far}");
    }
    let backwards: Vec<Vec<u32>> = faces
        .iter()
        .rev()
        .map(|f| [3, 2, 1, 0].iter().map(|k| last - f[(*k + 1) % 4]).collect())
        .collect();
    let after = curves(mesh.positions().iter().rev().copied().collect(), &backwards);
    for (ends, p) in &before {
        let there = ends.map(|v| last as usize - v);
        let (others, q) = after
            .iter()
            .find(|(others, _)| *others == there || *others == [there[1], there[0]])
            .expect("every curve is in both nets");
        let mut q = q.clone();
        if *others != there {
            q.reverse();
        }
        let far = p.iter().zip(q).map(|(p, q)| p.distance(q)).fold(0.0, f64::max);
        assert!(far < 1e-10, "renumbered: {far}");
    }
}

/// Curves from normals have continuous curvature and derivatives of torsion, all that G2 joins need.
#[test]
fn patches_on_curves_from_normals_join_with_continuous_mean_curvature() {
    let (_, shell, check) = neck(CurveForm::Normals, Joins::G2);
    assert_eq!(shell.continuous.iter().filter(|c| **c).count(), 40);
    assert!(check.mean_jump() < 1e-4, "{}", check.mean_jump());
}

#[test]
fn torsions_of_curves_from_normals_can_be_prescribed() {
    let mesh = sampled_net(catenoid, [-0.7, 0.8, -0.4, 0.5], [3, 3]);
    let net = AsymptoticNet::from_mesh(&mesh).unwrap();
    let solve = |torsions: Vec<TorsionHandle>| {
        let options = BoundaryOptions { form: CurveForm::Normals, torsions, ..Default::default() };
        solve_boundary(&net, &options)
    };
    let free = solve(Vec::new()).unwrap().torsions;
    let sign = free[5].signum();
    let mut handles = vec![TorsionHandle::Free; 16];
    handles[5] = TorsionHandle::Fixed(1.1 * free[5]);
    handles[6] = TorsionHandle::Between(-9.0, 9.0);
    let bound = 0.95 * free[10];
    handles[10] = TorsionHandle::Between(bound.min(0.1 * bound), bound.max(0.1 * bound));
    let found = solve(handles).unwrap();
    assert!((found.torsions[5] / (1.1 * free[5]) - 1.0).abs() < 1e-12);
    assert!((found.torsions[10] / bound - 1.0).abs() < 1e-12, "{} {bound}", found.torsions[10]);
    let wrong = vec![TorsionHandle::Fixed(-sign)];
    let error = solve(wrong).unwrap_err().to_string();
    assert!(error.starts_with("vertex 0: the torsion equation has no solution"), "{error}");
}

#[test]
fn results_do_not_depend_on_the_number_of_threads() {
    let net = exact_net(catenoid, [0.2, 1.4, -0.1, 0.9], [4, 3]);
    let run = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| {
            let options = GridshellOptions::default();
            let shell = fill_net(&net, &options).unwrap();
            let check = shell.verify(&net, &options.patch);
            (shell, check)
        })
    };
    assert_eq!(run(1), run(3));
}
