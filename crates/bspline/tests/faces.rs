//! Faces from loops of edges: areas in closed form, whichever way the loops are told.

#![allow(clippy::unwrap_used, reason = "a test may stop at the first surprise")]

use bspline::{
    ArcSpans, BsplineCurve, Carrier, Elementary, ElementaryKind, Face, FaceEdge, FaceError, Frame,
};
use geom_core::{DVec3, assert_close};
use std::f64::consts::{FRAC_PI_2, PI, TAU};

const TOLERANCE: f64 = 1e-8;

fn frame() -> Frame {
    Frame::new(DVec3::new(3.0, -1.0, 2.0), DVec3::new(1.0, 2.0, -0.5), Some(DVec3::X))
}

fn edge(curve: BsplineCurve) -> FaceEdge {
    FaceEdge { curve, parameters: Vec::new() }
}

/// An arc in the frame about a center, from one angle to another, in either direction.
fn arc(center: DVec3, x: DVec3, y: DVec3, from: f64, to: f64) -> FaceEdge {
    let f = frame();
    let vector = |v: DVec3| f.point(v) - f.origin;
    let spans = ArcSpans::new(from.min(to), from.max(to));
    let made = BsplineCurve::arc(f.point(center), vector(x), vector(y), spans).unwrap();
    edge(if from < to { made } else { made.reversed() })
}

fn line(a: DVec3, b: DVec3) -> FaceEdge {
    let f = frame();
    edge(BsplineCurve::segment(f.point(a), f.point(b), 0.0, a.distance(b)).unwrap())
}

fn on(kind: ElementaryKind) -> Carrier {
    Carrier::Elementary(Elementary { frame: frame(), kind })
}

fn area(face: &Face) -> f64 {
    match &face.trim {
        None => face.surface.curvature_statistics().area,
        Some(trim) => face.surface.curvature_statistics_within(trim).area,
    }
}

#[track_caller]
fn face(carrier: &Carrier, loops: &[Vec<FaceEdge>]) -> Face {
    carrier.face(loops, TOLERANCE).unwrap()
}

/// A circle of radius 2 about the third axis.
fn ring(z: f64, from: f64, to: f64) -> FaceEdge {
    arc(z * DVec3::Z, 2.0 * DVec3::X, 2.0 * DVec3::Y, from, to)
}

#[test]
fn a_wall_between_two_circles_is_whole_with_and_without_a_seam() {
    let carrier = on(ElementaryKind::Cylinder { radius: 2.0 });
    let (up, down) = (0.7_f64, 0.7 + TAU);
    let foot = |z: f64| DVec3::new(2.0 * up.cos(), 2.0 * up.sin(), z);
    let seam = vec![
        ring(1.0, up, down),
        line(foot(1.0), foot(4.0)),
        ring(4.0, down, up),
        line(foot(4.0), foot(1.0)),
    ];
    let bare = vec![vec![ring(1.0, up, down)], vec![ring(4.0, 2.0 + TAU, 2.0)]];
    for loops in [vec![seam], bare] {
        let wall = face(&carrier, &loops);
        assert!(wall.trim.is_none());
        assert_close(area(&wall), 2.0 * TAU * 3.0, 1e-10);
        assert_eq!((wall.surface.n_u(), wall.surface.n_v()), (9, 2));
        assert_eq!(wall.surface.control_point(0, 1), wall.surface.control_point(8, 1));
        // Outward, as the carrier.
        assert!(wall.surface.jet(1.0, 2.0, 2).mean_curvature().unwrap() < 0.0);
    }
}

#[test]
fn a_wall_cut_aslant_has_the_area_of_its_mean_height() {
    let carrier = on(ElementaryKind::Cylinder { radius: 2.0 });
    // The upper border is z = 4 + 0.5 x.
    let upper = arc(4.0 * DVec3::Z, DVec3::new(2.0, 0.0, 1.0), 2.0 * DVec3::Y, TAU, 0.0);
    let wall = face(&carrier, &[vec![upper], vec![ring(1.0, -1.0, -1.0 + TAU)]]);
    assert!(wall.trim.is_some());
    assert_close(area(&wall), 2.0 * TAU * 3.0, 1e-7);
}

#[test]
fn a_cone_closes_at_its_apex() {
    let carrier = on(ElementaryKind::Cone { radius: 3.0, slope: -0.75 });
    let base = |from: f64, to: f64| arc(DVec3::ZERO, 3.0 * DVec3::X, 3.0 * DVec3::Y, from, to);
    let at = |t: f64| DVec3::new(3.0 * t.cos(), 3.0 * t.sin(), 0.0);
    let apex = 4.0 * DVec3::Z;
    for extra in [vec![], vec![line(at(0.4), apex), line(apex, at(0.4))]] {
        let mut edges = vec![base(0.4, 0.4 + TAU)];
        edges.extend(extra);
        let cone = face(&carrier, &[edges, vec![]]);
        assert!(cone.trim.is_none());
        assert_close(area(&cone), PI * 3.0 * 5.0, 1e-9);
        // The apex is one point.
        assert_eq!(cone.surface.control_point(0, 1), cone.surface.control_point(5, 1));
    }
    let part = vec![base(0.4, 1.9), line(at(1.9), apex), line(apex, at(0.4))];
    let sector = face(&carrier, &[part]);
    assert!(sector.trim.is_none());
    assert_close(area(&sector), 1.5 / TAU * PI * 15.0, 1e-9);
}

#[test]
fn parts_of_a_sphere() {
    let carrier = on(ElementaryKind::Sphere { radius: 2.0 });
    let (x, y, z) = (2.0 * DVec3::X, 2.0 * DVec3::Y, 2.0 * DVec3::Z);
    let whole = face(&carrier, &[vec![]]);
    assert_close(area(&whole), 16.0 * PI, 1e-8);
    // The seam up and down, as Open CASCADE tells a whole sphere.
    let meridian = arc(DVec3::ZERO, x, z, -FRAC_PI_2, FRAC_PI_2);
    let back = arc(DVec3::ZERO, x, z, FRAC_PI_2, -FRAC_PI_2);
    let seam = face(&carrier, &[vec![meridian, back]]);
    assert!(seam.trim.is_none());
    assert_close(area(&seam), 16.0 * PI, 1e-8);
    let half = face(&carrier, &[vec![ring(0.0, 0.3, 0.3 + TAU)]]);
    assert!(half.trim.is_none());
    assert_close(area(&half), 8.0 * PI, 1e-9);
    // A half beside a great circle that passes through both poles.
    let side = face(&carrier, &[vec![arc(DVec3::ZERO, z, x, 0.2, 0.2 + TAU)]]);
    assert_close(area(&side), 8.0 * PI, 1e-8);
    let octant = vec![
        arc(DVec3::ZERO, x, y, 0.0, FRAC_PI_2),
        arc(DVec3::ZERO, y, z, 0.0, FRAC_PI_2),
        arc(DVec3::ZERO, z, x, 0.0, FRAC_PI_2),
    ];
    let octant = face(&carrier, &[octant]);
    assert!(octant.trim.is_none());
    assert_close(area(&octant), 2.0 * PI, 1e-10);
}

#[test]
fn a_cap_of_any_direction_and_what_is_left_of_the_sphere() {
    let carrier = on(ElementaryKind::Sphere { radius: 2.0 });
    for axis in [DVec3::new(1.0, 0.4, 0.3), DVec3::new(-1.0, -0.1, 0.2), DVec3::new(0.1, 0.2, 1.0)]
    {
        let axis = axis.normalize();
        let x = axis.any_orthonormal_vector();
        let y = axis.cross(x);
        // A circle at height 1.2 along the axis: radius 1.6, cap of height 0.8.
        let circle = |from: f64, to: f64| arc(1.2 * axis, 1.6 * x, 1.6 * y, from, to);
        let cap = face(&carrier, &[vec![circle(0.0, TAU)]]);
        assert_close(area(&cap), TAU * 2.0 * 0.8, 2e-7);
        let rest = face(&carrier, &[vec![circle(TAU, 0.0)]]);
        assert_close(area(&rest), 16.0 * PI - TAU * 2.0 * 0.8, 2e-7);
    }
}

#[test]
fn bands_of_a_torus_in_both_directions() {
    let (major, minor) = (5.0, 2.0);
    let carrier = on(ElementaryKind::Torus { major, minor });
    let whole = face(&carrier, &[]);
    assert_close(area(&whole) / (4.0 * PI * PI * 10.0), 1.0, 1e-12);
    let parallel = |v: f64, from: f64, to: f64| {
        let r = major + minor * v.cos();
        arc(minor * v.sin() * DVec3::Z, r * DVec3::X, r * DVec3::Y, from, to)
    };
    let band = |a: f64, b: f64| TAU * minor * (major * (b - a) + minor * (b.sin() - a.sin()));
    let outer = face(&carrier, &[vec![parallel(-1.0, 0.0, TAU)], vec![parallel(1.0, TAU, 0.0)]]);
    assert!(outer.trim.is_none());
    assert_close(area(&outer), band(-1.0, 1.0), 1e-9);
    let loops = [vec![parallel(1.0, 0.5, 0.5 + TAU)], vec![parallel(-1.0, TAU, 0.0)]];
    assert_close(area(&face(&carrier, &loops)), band(1.0, TAU - 1.0), 1e-9);
    let meridian = |u: f64, from: f64, to: f64| {
        let out = DVec3::new(u.cos(), u.sin(), 0.0);
        arc(major * out, minor * out, minor * DVec3::Z, from, to)
    };
    let bend = face(&carrier, &[vec![meridian(0.2, TAU, 0.0)], vec![meridian(1.5, 0.0, TAU)]]);
    assert!(bend.trim.is_none());
    assert_close(area(&bend), 1.3 * TAU * minor * major, 1e-9);
}

#[test]
fn a_plate_with_a_hole_keeps_its_edges_exactly() {
    let carrier = on(ElementaryKind::Plane);
    let polygon = |corners: &[(f64, f64)]| -> (Vec<FaceEdge>, f64) {
        let at = |k: usize| {
            let (x, y) = corners[k % corners.len()];
            DVec3::new(x, y, 0.0)
        };
        let n = corners.len();
        let twice: f64 = (0..n).map(|k| at(k).truncate().perp_dot(at(k + 1).truncate())).sum();
        ((0..n).map(|k| line(at(k), at(k + 1))).collect(), 0.5 * twice)
    };
    let (outer, whole) = polygon(&[(0.0, 0.0), (6.0, 1.0), (5.0, 5.0), (-1.0, 4.0)]);
    let hole = vec![arc(DVec3::new(3.0, 2.5, 0.0), DVec3::X, DVec3::Y, TAU, 0.0)];
    let plate = face(&carrier, &[outer, hole.clone()]);
    let trim = plate.trim.as_ref().unwrap();
    assert_eq!(trim.loops().len(), 2);
    assert_eq!(trim.loops()[1].curves()[0].edge.as_ref(), Some(&hole[0].curve));
    assert_close(area(&plate), whole - PI, 1e-9);
    // A rectangle along the axes is whole.
    let (rectangle, _) = polygon(&[(0.0, 0.0), (6.0, 0.0), (6.0, 2.0), (0.0, 2.0)]);
    let rectangle = face(&carrier, &[rectangle]);
    assert!(rectangle.trim.is_none());
    assert_close(area(&rectangle), 12.0, 1e-13);
}

#[test]
fn a_hole_across_the_seam_moves_the_seam() {
    let cylinder = Elementary { frame: frame(), kind: ElementaryKind::Cylinder { radius: 2.0 } };
    let tube = cylinder.surface([0.0, TAU], [0.0, 5.0]).unwrap();
    // A window u in [-0.5, 0.5], v in [2, 3].
    let at = |u: f64, v: f64| DVec3::new(2.0 * u.cos(), 2.0 * u.sin(), v);
    let window = vec![
        line(at(-0.5, 2.0), at(-0.5, 3.0)),
        ring(3.0, -0.5, 0.5),
        line(at(0.5, 3.0), at(0.5, 2.0)),
        ring(2.0, 0.5, -0.5),
    ];
    for carrier in [Carrier::Elementary(cylinder), Carrier::Spline(tube)] {
        let loops = [vec![ring(0.0, 0.0, TAU)], vec![ring(5.0, TAU, 0.0)], window.clone()];
        let made = face(&carrier, &loops);
        assert_eq!(made.trim.as_ref().unwrap().loops().len(), 2);
        assert_close(area(&made), 2.0 * TAU * 5.0 - 2.0, 1e-7);
    }
}

#[test]
fn faces_that_make_no_sense_say_why() {
    let carrier = on(ElementaryKind::Cylinder { radius: 2.0 });
    assert_eq!(carrier.face(&[], TOLERANCE), Err(FaceError::Unbounded));
    let one = [vec![ring(0.0, 0.0, TAU)]];
    assert_eq!(carrier.face(&one, TOLERANCE), Err(FaceError::Winding));
    let small = arc(DVec3::ZERO, DVec3::X, DVec3::Y, 0.0, TAU);
    let off = carrier.face(&[vec![small]], TOLERANCE).unwrap_err();
    assert!(matches!(off, FaceError::OffSurface { distance } if (distance - 1.0).abs() < 1e-12));
    let up = |z: f64| DVec3::new(2.0, 0.0, z);
    let gap = vec![line(up(0.0), up(1.0)), line(up(2.0), up(3.0))];
    assert_eq!(
        carrier.face(&[gap], TOLERANCE).unwrap_err().to_string(),
        "edges 0 and 1 of a loop do not meet; give the loop all of its edges"
    );
}
