//! What is built with a warning, the warning's words, and the refusals of solved curves.

#![allow(clippy::unwrap_used, reason = "a refusal should stop the test")]

mod common;

use asymptotic_bezier::{
    AsymptoticError, AsymptoticWarning, BoundaryOptions, CornerData, Curvatures, PatchCheck,
    PatchOptions, Place, TorsionHandle, doubt_signs, fill_patch, solve_quadrilateral,
    solve_quartic_quadrilateral,
};
use common::reference_set;
use geom_core::DVec3;

fn said(warnings: &[AsymptoticWarning], words: &str) -> bool {
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

/// Data that no run of ours has reached, but whose sentences a user may meet.
#[test]
fn rare_messages_name_the_place_and_the_remedy() {
    let fold = AsymptoticWarning::JointFold { place: Place::Patch(3), shared: 2 }.to_string();
    assert!(fold.starts_with("patch 3: ") && fold.contains("G1"), "{fold}");
    let gap = AsymptoticError::NotClosed { place: Place::NetCurve(7), gap: 2e-3 }.to_string();
    assert!(gap.starts_with("net curve 7: ") && gap.contains("umbilic hnet"), "{gap}");
}
