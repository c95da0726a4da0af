//! Faces that share curves become shells: edges and vertices once, orientations that agree, solids
//! where nothing is open.

use bspline::{BsplineSurface, Degree, KnotVector};
use exchange::{LengthUnit, Model, NamedSurface, read_step, write_step};
use geom_core::{DVec3, assert_close};

fn knots(d: usize) -> KnotVector {
    KnotVector::clamped_uniform(Degree::new(d).unwrap(), d + 1).unwrap()
}

fn quad(corners: [DVec3; 4]) -> BsplineSurface {
    let [a, b, c, d] = corners;
    BsplineSurface::new(knots(1), knots(1), vec![a, d, b, c], None).unwrap()
}

fn model(surfaces: Vec<BsplineSurface>) -> Model {
    let named = surfaces.into_iter().enumerate();
    Model {
        unit: LengthUnit::Metre,
        surfaces: named.map(|(k, s)| NamedSurface::new(format!("f{k}"), s)).collect(),
        ..Model::default()
    }
}

fn count(text: &str, what: &str) -> usize {
    text.matches(&format!("={what}(")).count()
}

/// The faces of the unit cube; the bits of `turned` say which lie the wrong way round.
fn cube(turned: u32) -> Model {
    let at = |k: usize| DVec3::new((k & 1) as f64, (k >> 1 & 1) as f64, (k >> 2 & 1) as f64);
    let faces =
        [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
    let turn = |k: usize, surface: BsplineSurface| {
        if turned >> k & 1 == 1 { surface.swapped() } else { surface }
    };
    model(faces.iter().enumerate().map(|(k, f)| turn(k, quad(f.map(at)))).collect())
}

fn volume(model: &Model) -> f64 {
    model.surfaces.iter().map(|s| s.surface.cone_volume(None, DVec3::splat(3.0))).sum()
}

#[test]
fn a_cube_is_one_solid_however_its_faces_lie() {
    for turned in [0, 0b1, 0b10_1100, 0b11_1111] {
        let text = write_step(&cube(turned)).unwrap();
        assert_eq!(count(&text, "EDGE_CURVE"), 12);
        assert_eq!(count(&text, "LINE"), 12);
        assert_eq!(count(&text, "VERTEX_POINT"), 8);
        assert_eq!(count(&text, "CLOSED_SHELL"), 1);
        assert_eq!(count(&text, "MANIFOLD_SOLID_BREP"), 1);
        // Every edge runs once in either direction.
        let oriented = |end: &str| {
            text.lines().filter(|l| l.contains("=ORIENTED_EDGE(") && l.ends_with(end)).count()
        };
        assert_eq!([oriented(".T.);"), oriented(".F.);")], [12, 12]);
        let again = read_step(text.as_bytes()).unwrap();
        assert!(again.warnings.is_empty() && again.surfaces.iter().all(|s| s.trim.is_none()));
        assert_close(volume(&again), 1.0, 1e-12);
    }
}

#[test]
fn an_open_box_is_one_open_shell_and_two_boxes_are_two_solids() {
    let mut open = cube(0b100);
    open.surfaces.pop();
    let text = write_step(&open).unwrap();
    assert_eq!((count(&text, "OPEN_SHELL"), count(&text, "CLOSED_SHELL")), (1, 0));
    assert_eq!(count(&text, "EDGE_CURVE"), 12);
    let mut two = cube(0);
    let far = |s: &NamedSurface| {
        let moved = s.surface.mapped(|p| p + DVec3::new(5.0, 0.0, 0.0)).unwrap();
        NamedSurface::new("far", moved)
    };
    let moved: Vec<NamedSurface> = two.surfaces.iter().map(far).collect();
    two.surfaces.extend(moved.into_iter().take(5));
    let text = write_step(&two).unwrap();
    assert_eq!((count(&text, "OPEN_SHELL"), count(&text, "CLOSED_SHELL")), (1, 1));
    assert_eq!(count(&text, "SHAPE_REPRESENTATION_RELATIONSHIP"), 2);
    let again = read_step(text.as_bytes()).unwrap();
    assert_eq!(again.surfaces.len(), 11);
    assert!(again.warnings.is_empty(), "{:?}", again.warnings);
}

#[test]
fn curved_sides_are_shared_when_they_are_the_same_curve() {
    // The two halves of a bi-quadratic surface, and a neighbour with its side run backwards and
    // of a higher degree.
    let points: Vec<DVec3> = (0..9)
        .map(|k| (f64::from(k / 3), f64::from(k % 3)))
        .map(|(x, y)| DVec3::new(x, y, 0.4 * x * (2.0 - x) + 0.3 * y * y))
        .collect();
    let whole = BsplineSurface::new(knots(2), knots(2), points, None).unwrap();
    let left = whole.subdomain([0.0, 0.5], [0.0, 1.0]).unwrap();
    let right = whole.subdomain([0.5, 1.0], [0.0, 1.0]).unwrap();
    let raised = right.reversed_u().elevated(Degree::new(3).unwrap(), Degree::new(4).unwrap());
    let backwards = raised.unwrap().swapped().reversed_u().swapped();
    for other in [right, backwards] {
        let text = write_step(&model(vec![left.clone(), other])).unwrap();
        assert_eq!(count(&text, "EDGE_CURVE"), 7);
        assert_eq!(count(&text, "VERTEX_POINT"), 6);
        assert_eq!(count(&text, "OPEN_SHELL"), 1);
    }
    // A neighbour whose side has the same ends and another course is not one.
    let bent = quad([
        whole.point(0.5, 0.0),
        DVec3::new(3.0, 0.0, 0.0),
        DVec3::new(3.0, 2.0, 0.0),
        whole.point(0.5, 1.0),
    ]);
    let text = write_step(&model(vec![left, bent])).unwrap();
    assert_eq!((count(&text, "EDGE_CURVE"), count(&text, "OPEN_SHELL")), (8, 2));
}

#[test]
fn three_faces_at_one_edge_share_it_two_and_one() {
    let (a, b) = (DVec3::ZERO, DVec3::Z);
    let wing = |out: DVec3| quad([a, out, out + DVec3::Z, b]);
    let book = vec![wing(DVec3::X), wing(DVec3::Y), wing(DVec3::new(-1.0, -1.0, 0.0))];
    let text = write_step(&model(book)).unwrap();
    assert_eq!((count(&text, "EDGE_CURVE"), count(&text, "OPEN_SHELL")), (11, 2));
}

#[test]
fn a_moebius_band_stays_open() {
    let n = 12;
    let at = |k: usize, side: f64| {
        let t = std::f64::consts::TAU * k as f64 / n as f64;
        let r = 3.0 + side * (0.5 * t).cos();
        DVec3::new(r * t.cos(), r * t.sin(), side * (0.5 * t).sin())
    };
    let face = |k: usize| {
        // The last joins the first upside down.
        let next = |side: f64| if k + 1 == n { at(0, -side) } else { at(k + 1, side) };
        quad([at(k, -1.0), next(-1.0), next(1.0), at(k, 1.0)])
    };
    let text = write_step(&model((0..n).map(face).collect())).unwrap();
    assert_eq!((count(&text, "EDGE_CURVE"), count(&text, "OPEN_SHELL")), (3 * n, 1));
    assert_eq!(count(&text, "CLOSED_SHELL"), 0);
}

#[test]
fn a_long_edge_beside_short_ones_is_cut() {
    // Two squares above one that is as wide as both.
    let at = |x: f64, y: f64| DVec3::new(x, y, 0.0);
    let square =
        |x: f64, y: f64, w: f64| quad([at(x, y), at(x + w, y), at(x + w, y + 1.0), at(x, y + 1.0)]);
    let faces = vec![square(0.0, 0.0, 2.0), square(0.0, 1.0, 1.0), square(1.0, 1.0, 1.0)];
    let text = write_step(&model(faces)).unwrap();
    assert_eq!((count(&text, "EDGE_CURVE"), count(&text, "OPEN_SHELL")), (10, 1));
    let again = read_step(text.as_bytes()).unwrap();
    assert!(again.surfaces.iter().all(|s| s.trim.is_none()));
    assert_eq!(again.surfaces[0].surface.point(1.0, 1.0), at(2.0, 1.0));
}
