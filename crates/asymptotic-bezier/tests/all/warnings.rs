//! What is built with a warning, the warning's words, and the refusals of solved curves.

use crate::common::{Gauss, catenoid, enneper, exact_net, reference_set, sampled_net};
use asymptotic_bezier::{
    AsymptoticNet, BoundaryOptions, CornerData, Curvatures, CurveForm, Joins, Options, PatchCheck,
    PatchOptions, Place, TorsionHandle, Warning, doubt_signs, fill_patch, solve, solve_boundary,
    solve_quadrilateral, solve_quartic_quadrilateral,
};
use geom_core::{DVec3, PolyMesh};

fn said(warnings: &[Warning], words: &str) -> bool {
    warnings.iter().any(|w| w.to_string().contains(words))
}

#[test]
fn random_data_are_warned_about_in_words() {
    let quad = solve_quadrilateral(&reference_set("F").data, &BoundaryOptions::default()).unwrap();
    for words in [
        "curve 1: the binormal turns by 443 degrees (more than 180)",
        "curve 2: torsion changes sign",
        "a near-inflection",
        "patch 0: corner torsions of different sign",
    ] {
        assert!(said(&quad.warnings, words), "{words}: {:?}", quad.warnings);
    }
    let options = PatchOptions { degree: Some(7), ..Default::default() };
    let filled = fill_patch(&quad.boundary, &options, Place::Patch(2)).unwrap();
    assert!(said(&filled.warnings, "patch 2: transversality bounds were needed"));
    let check = PatchCheck::new(&filled.patch, &quad.boundary);
    let warnings = check.warnings(Place::Patch(2), 0.1);
    for words in [
        "patch 2: Gaussian curvature is positive on 4",
        "patch 2: the patch intersects itself (",
        "patch 2: neighbouring normals turn by",
        "patch 2: parameter lines meet at a sine of only 0.0",
    ] {
        assert!(said(&warnings, words), "{words}: {warnings:?}");
    }
}

#[test]
fn doubtful_signs_and_raised_degrees_are_told() {
    let outward = reference_set("E_").data;
    let quad = solve_quadrilateral(&outward, &BoundaryOptions::default()).unwrap();
    let words = "patch 0: with curvature signs r1 ++, r2 ++, r3 ++, r4 ++ the binormals turn by at most 59 degrees instead of 418";
    let doubt = doubt_signs(&outward, &quad, &BoundaryOptions::default()).unwrap();
    assert!(said(std::slice::from_ref(&doubt), words), "{doubt}");
    for name in ["A", "B", "C", "Eplus", "G", "H"] {
        let data = reference_set(name).data;
        let quad = solve_quadrilateral(&data, &BoundaryOptions::default()).unwrap();
        assert_eq!(doubt_signs(&data, &quad, &BoundaryOptions::default()), None);
    }

    let skew = reference_set("C").data;
    let quad = solve_quadrilateral(&skew, &BoundaryOptions::default()).unwrap();
    let options = PatchOptions { min_sine: 0.5, ..Default::default() };
    let filled = fill_patch(&quad.boundary, &options, Place::Patch(0)).unwrap();
    assert!(filled.patch.degree() > 7);
    assert!(said(&filled.warnings, "patch 0: bi-7 was not regular, bi-"));
}

#[test]
fn a_line_between_torsions_of_opposite_sign_is_told() {
    let mut data = reference_set("Eplus").data;
    data.lines[0] = true;
    data.start_points[0] = data.corners[0].lerp(data.corners[1], 0.2);
    data.end_points[0] = data.corners[0].lerp(data.corners[1], 0.8);
    if let Curvatures::Signed(k) = &mut data.curvatures {
        k[0] = [0.0; 2];
    }
    let torsions = vec![TorsionHandle::Fixed(0.3), TorsionHandle::Fixed(-0.3)];
    let options = BoundaryOptions { torsions, ..Default::default() };
    let quad = solve_quadrilateral(&data, &options).unwrap();
    let words = "curve 1: the neighbours give the ends of this line torsions of opposite sign";
    assert!(said(&quad.warnings, words), "{:?}", quad.warnings);
}

#[test]
fn planar_waves_have_undeclared_inflections() {
    // A bump into the patch whose ends are told to bend the other way.
    let mut data = reference_set("Eplus").data.map_points(|p| DVec3::new(p.x, p.y, 0.0));
    data.start_points[0] = DVec3::new(-0.6, -0.6, 0.0);
    data.end_points[0] = DVec3::new(0.6, -0.6, 0.0);
    let error = solve_quadrilateral(&data, &BoundaryOptions::default()).unwrap_err().to_string();
    assert!(
        error.starts_with("curve 1: undeclared inflection, the binormal reverses at t = 0."),
        "{error}"
    );
}

#[test]
fn patches_without_freedom_to_unfold_are_refused() {
    let quad = solve_quadrilateral(&reference_set("A").data, &BoundaryOptions::default()).unwrap();
    let options = PatchOptions { degree: Some(5), ..Default::default() };
    let error = fill_patch(&quad.boundary, &options, Place::Patch(0)).unwrap_err().to_string();
    assert!(error.starts_with("patch 0: the patch folds along curve"), "{error}");
    assert!(error.ends_with("cannot be met at bi-5; raise the degree or mend the corner data"));
}

#[test]
fn quartics_need_exact_data() {
    let rounded: CornerData = reference_set("A").data;
    let error = solve_quartic_quadrilateral(&rounded).unwrap_err().to_string();
    assert!(error.starts_with("the four torsion equations of the quartic quadrilateral have no"));
    let flat = rounded.map_points(|p| DVec3::new(p.x, p.y, 0.0));
    let error = solve_quartic_quadrilateral(&flat).unwrap_err().to_string();
    assert!(error.starts_with("curve 1: the corner planes at both ends are parallel"), "{error}");
}

/// Curvatures that no one surface has, twice too large at one end of each curve and half at the
/// other: patches that join C1 have no freedom left to unfold.
#[test]
fn joint_patches_that_fold_are_told() {
    let net = exact_net(catenoid, [0.1, 0.9, 0.1, 0.9], [2, 2]);
    let mut curves = net.curves().to_vec();
    for (i, curve) in curves.iter_mut().enumerate() {
        for (e, k) in curve.curvatures.iter_mut().enumerate() {
            *k *= [2.0, 0.5][(i + e) % 2];
        }
    }
    let quads = [0, 1, 3, 4].map(|k| [k, k + 3, k + 4, k + 1]);
    let net = AsymptoticNet::new(net.positions().to_vec(), &quads, curves).unwrap();
    let options = Options { joins: Joins::C1, ..Default::default() };
    let folded = solve(&net.into(), &options, &mut ()).unwrap();
    let words = "patch 1: with 2 of its joins C1 the patch folds; use G1 joins or a higher degree";
    assert!(said(&folded.check.warnings, words), "{:?}", folded.check.warnings);
}

/// Noise on the vertices of an asymptotic mesh: curves from normals are found, rough ones, or not.
#[test]
fn nets_that_are_only_roughly_asymptotic_are_told() {
    let mesh = sampled_net(enneper, [-0.5, 0.6, -0.7, 0.5], [5, 5]);
    let curves = |noise: f64| {
        let mut gauss = Gauss::new(7);
        let moved = |p: &DVec3| *p + noise * DVec3::new(gauss.next(), gauss.next(), gauss.next());
        let positions = mesh.positions().iter().map(moved).collect();
        let faces: Vec<Vec<u32>> = mesh
            .faces()
            .map(|f| mesh.face_vertices(f).map(|v| v.index() as u32).collect())
            .collect();
        let net = AsymptoticNet::from_mesh(&PolyMesh::new(positions, &faces).unwrap()).unwrap();
        let options = BoundaryOptions { form: CurveForm::Normals, ..Default::default() };
        solve_boundary(&net, &options)
    };
    assert!(curves(0.0).unwrap().warnings.is_empty());
    let rough = curves(0.003).unwrap().warnings;
    let words = "vertex 0: a curve had to turn by 24 degrees from what the edges let expect";
    assert!(said(&rough, words), "{rough:?}");
    let error = curves(0.01).unwrap_err().to_string();
    assert!(error.contains(": no curve from normals reaches its end (gap "), "{error}");
    assert!(error.ends_with("with planar vertex stars, or refine it"), "{error}");
}
