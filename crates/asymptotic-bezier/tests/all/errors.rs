//! Every refusal with its message, and that hopeless input is refused rather than computed.

use crate::common;
use crate::common::{reference_set, reference_sets};
use asymptotic_bezier::{
    AsymptoticNet, BoundaryOptions, CornerData, Curvatures, CurveForm, DataFile, Error, NetCurve,
    PatchOptions, Place, TorsionHandle, Warning, fill_patch, solve_boundary, solve_quadrilateral,
};
use geom_core::DVec3;

fn refusal(change: impl FnOnce(&mut CornerData)) -> Error {
    let mut data = reference_set("B").data;
    change(&mut data);
    solve_quadrilateral(&data, &BoundaryOptions::default()).unwrap_err()
}

fn signed(data: &mut CornerData) -> &mut [[f64; 2]; 4] {
    match &mut data.curvatures {
        Curvatures::Signed(k) | Curvatures::Unsigned(k) => k,
    }
}

#[test]
fn faulty_corner_data_are_refused_with_place_and_remedy() {
    let cases: Vec<(Error, &str)> = vec![
        (refusal(|d| d.corners[1].x = f64::NAN), "corner 10: the position is not finite"),
        (
            refusal(|d| d.start_points[2].y = f64::INFINITY),
            "curve 3: a tangent point is not finite",
        ),
        (refusal(|d| signed(d)[3][1] = f64::NAN), "curve 4: a curvature is not finite"),
        (
            refusal(|d| d.end_points[0] = d.corners[1]),
            "curve 1: the tangent point at the end coincides",
        ),
        (
            refusal(|d| {
                d.start_points[1] = d.corners[0] + 2.0 * (d.start_points[0] - d.corners[0])
            }),
            "corner 00: boundary tangents are parallel (sine 0.000e0, at least 1e-6 needed)",
        ),
        (refusal(|d| signed(d)[0][0] = 0.0), "curve 1: zero curvature at the start"),
        (
            refusal(|d| d.lines[1] = true),
            "curve 2: declared a line but its tangents leave the chord",
        ),
        (
            refusal(|d| {
                d.lines[0] = true;
                d.start_points[0] = d.corners[0].lerp(d.corners[1], 0.2);
                d.end_points[0] = d.corners[0].lerp(d.corners[1], 0.8);
            }),
            "curve 1: declared a line but curvature",
        ),
        (
            refusal(|d| signed(d)[2][1] *= -1.0),
            "curve 3: the end curvatures bend to opposite sides",
        ),
        (
            refusal(|d| {
                signed(d)[2][1] *= -1.0;
                d.inflections[2] = 3;
            }),
            "curve 3: no curve with the declared inflections found",
        ),
    ];
    for (error, start) in cases {
        let message = error.to_string();
        assert!(message.starts_with(start), "{message}");
    }
}

/// All far tangents in the corner plane at 00, with heights that contradict one another.
#[test]
fn vacuous_torsion_equations_are_told_from_impossible_ones() {
    let v = DVec3::new;
    let mut data = CornerData {
        corners: [v(0., 0., 0.), v(1., 0., 0.), v(0., 1., 0.), v(1., 1., 0.5)],
        start_points: [v(0.2, 0.02, 0.), v(0.02, 0.2, 0.), v(0.2, 1., 0.1), v(1., 0.2, 0.1)],
        end_points: [v(0.8, 0.03, 0.), v(0.03, 0.8, 0.), v(0.8, 1., 0.4), v(1., 0.8, 0.4)],
        curvatures: Curvatures::Signed([[0.3; 2]; 4]),
        lines: [false; 4],
        inflections: [0; 4],
    };
    let quad = solve_quadrilateral(&data, &BoundaryOptions::default()).unwrap();
    let place = Place::PatchCorner(0);
    assert!(quad.warnings.contains(&Warning::VacuousTorsion { place }));
    // Lifting the end of r1 without tilting its tangent leaves nothing to answer with.
    for p in [&mut data.corners[1], &mut data.end_points[0], &mut data.start_points[3]] {
        p.z += 0.1;
    }
    let error = solve_quadrilateral(&data, &BoundaryOptions::default()).unwrap_err();
    let message = error.to_string();
    assert!(message.starts_with("corner 00: the torsion equation has no solution"), "{message}");
}

#[test]
fn contradictory_bounds_and_degrees_are_refused() {
    let data = reference_set("B").data;
    let bounds =
        BoundaryOptions { torsions: vec![TorsionHandle::Between(1.0, 0.5)], ..Default::default() };
    let error = solve_quadrilateral(&data, &bounds).unwrap_err().to_string();
    assert!(error.starts_with("corner 00: torsion is bounded below by 1 and above by 0.5"));
    let degree = BoundaryOptions { degree: 4, ..Default::default() };
    let error = solve_quadrilateral(&data, &degree).unwrap_err().to_string();
    assert_eq!(error, "degree 4 of the boundary is outside 5..=9");
    let quad = solve_quadrilateral(&data, &BoundaryOptions::default()).unwrap();
    let options = PatchOptions { degree: Some(16), ..Default::default() };
    let error = fill_patch(&quad.boundary, &options, Place::Patch(3)).unwrap_err().to_string();
    assert_eq!(error, "degree 16 of the surface is outside 5..=15");
}

#[test]
fn curves_from_normals_have_degree_seven_and_need_two_families() {
    let net = common::exact_net(common::enneper, [-0.6, 0.9, 0.2, 1.3], [2, 2]);
    let normals = BoundaryOptions { form: CurveForm::Normals, ..Default::default() };
    let six = BoundaryOptions { degree: 6, ..normals.clone() };
    let error = solve_boundary(&net, &six).unwrap_err().to_string();
    assert_eq!(error, "degree 6 of the boundary is outside 7..=7");
    let odd = common::star::star(3);
    let error = solve_boundary(&odd, &normals).unwrap_err().to_string();
    assert!(error.starts_with("the curves do not fall into two families"), "{error}");
}

#[test]
fn a_boundary_that_violates_the_torsion_condition_is_refused() {
    let data = reference_set("B").data;
    let mut quad = solve_quadrilateral(&data, &BoundaryOptions::default()).unwrap();
    let mut points = quad.boundary.curves[0].points().to_vec();
    points[3] += DVec3::Z * 0.01;
    quad.boundary.curves[0] = asymptotic_bezier::BezierCurve::new(points);
    let options = PatchOptions { degree: Some(7), ..Default::default() };
    let error = fill_patch(&quad.boundary, &options, Place::Patch(0)).unwrap_err().to_string();
    assert!(error.starts_with("patch 0: corner and twist equations contradict"), "{error}");
}

#[test]
fn cusps_are_refused() {
    // Equal corner data on a curve that turns back on itself: both arms outward of the chord.
    let mut data = reference_set("Eplus").data;
    let (a, b) = (data.corners[0], data.corners[1]);
    data.start_points[0] = a + (b - a) * 1e-9;
    data.end_points[0] = b + (a - b) * 1e-9;
    let error = solve_quadrilateral(&data, &BoundaryOptions::default()).map(|q| q.qualities[0]);
    let message = error.unwrap_err().to_string();
    assert!(message.contains("cusp"), "{message}");
}

#[test]
fn faulty_nets_are_refused() {
    let square: Vec<DVec3> =
        [[0., 0.], [1., 0.], [1., 1.], [0., 1.]].map(|[x, y]| DVec3::new(x, y, 0.0)).to_vec();
    let curve = |a: usize, b: usize| {
        let chord = square[b] - square[a];
        NetCurve {
            ends: [a, b],
            arms: [chord * 0.2, chord * -0.2],
            curvatures: [0.0; 2],
            line: true,
            inflections: 0,
        }
    };
    let all = vec![curve(0, 1), curve(1, 2), curve(3, 2), curve(0, 3)];
    let net = |quads: &[[usize; 4]], curves: Vec<NetCurve>| {
        AsymptoticNet::new(square.clone(), quads, curves).map_err(|e| e.to_string())
    };
    assert!(net(&[[0, 1, 2, 3]], all.clone()).is_ok());
    let missing = net(&[[0, 1, 2, 3]], all[..3].to_vec()).unwrap_err();
    assert_eq!(missing, "net: face 0 has no curve between vertices 0 and 3; add it");
    let twice = net(&[[0, 1, 2, 3], [0, 1, 2, 3]], all.clone()).unwrap_err();
    assert!(twice.contains("same side of the curve between vertices 0 and 1"), "{twice}");
    let doubled = [all.clone(), vec![curve(1, 0)]].concat();
    let double = net(&[[0, 1, 2, 3]], doubled).unwrap_err();
    assert!(double.contains("two curves join vertices 1 and 0"), "{double}");
    assert!(net(&[], all.clone()).unwrap_err().contains("no faces"));

    // Four arms at the middle vertex, one of them lifted out of the plane.
    let net = common::exact_net(common::enneper, [-0.6, 0.9, 0.2, 1.3], [2, 2]);
    assert!(solve_boundary(&net, &BoundaryOptions::default()).is_ok());
    let quads: Vec<[usize; 4]> =
        net.faces().iter().map(|f| [0, 1, 3, 2].map(|c| net.face_corner(f, c))).collect();
    let mut curves = net.curves().to_vec();
    let at = |ends: [usize; 2]| curves.iter().position(|c| c.ends == ends).unwrap();
    let (along, across) = (at([4, 7]), at([4, 5]));
    let normal = curves[along].arms[0].cross(curves[across].arms[0]).normalize();
    let size = curves[along].arms[0].length();
    curves[along].arms[0] += normal * 0.1 * size;
    let net = AsymptoticNet::new(net.positions().to_vec(), &quads, curves).unwrap();
    let error = solve_boundary(&net, &BoundaryOptions::default()).unwrap_err().to_string();
    assert!(error.starts_with("vertex 4: the tangents leave their common plane"), "{error}");
}

#[test]
fn files_tell_what_they_lack() {
    let full = DataFile::from_patch(&reference_set("A").data);
    assert!(full.input().is_ok());
    let message = |change: fn(&mut DataFile)| {
        let mut file = full.clone();
        change(&mut file);
        file.input().unwrap_err().to_string()
    };
    assert_eq!(message(|f| f.start_points = None), "field `P_i1` is missing; add it");
    assert!(message(|f| f.signed_k = None).contains("`signed_k` or `unsigned_k`"));
    assert!(message(|f| f.unsigned_k = f.signed_k).contains("keep one"));
    assert!(message(|f| f.corners = None).contains("neither `X` nor `vertices`"));
    assert!(message(|f| f.vertices = Some(vec![])).contains("both `X` and `vertices`"));
    assert!(
        message(|f| {
            f.corners.as_mut().unwrap().remove("10");
        })
        .contains("no corner \"10\"")
    );
}

#[test]
fn unsigned_curvatures_find_the_signs_of_the_exact_nets() {
    for set in reference_sets() {
        if !["A", "B", "C", "G", "H", "Ep"].iter().any(|p| set.name.starts_with(p)) {
            continue;
        }
        let Curvatures::Signed(k) = set.data.curvatures else { unreachable!() };
        let mut data = set.data.clone();
        data.curvatures = Curvatures::Unsigned(k.map(|k| k.map(f64::abs)));
        let quad = solve_quadrilateral(&data, &BoundaryOptions::default()).unwrap();
        assert_eq!(quad.curvatures, k, "{}", set.name);
    }
}
