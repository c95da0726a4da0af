//! What exact formats promise: control points, knots, weights and trims come back to the last bit.

use bspline::{BsplineCurve, BsplineSurface, Degree, KnotVector, Trim, TrimCurve, TrimLoop};
use exchange::{LengthUnit, Mesh, Model, NamedSurface, decode_model, encode_model};
use geom_core::DVec3;
use proptest::prelude::*;
use std::path::Path;

/// Numbers of every size a model may have, with all their digits.
fn number() -> impl Strategy<Value = f64> {
    (-1.0..1.0_f64, -6..7_i32).prop_map(|(x, power)| x * 10.0_f64.powi(power))
}

fn point() -> impl Strategy<Value = DVec3> {
    [number(), number(), number()].prop_map(DVec3::from_array)
}

/// Knots with uneven spans, some of them double where the degree allows; clamped or periodic.
fn knots(may_close: bool) -> impl Strategy<Value = KnotVector> {
    let steps = prop::collection::vec((0.01..3.0_f64, 0..4_u8), 1..5);
    (1..5_usize, number(), steps, any::<bool>()).prop_map(move |(degree, start, steps, close)| {
        let degree = Degree::new(degree).unwrap();
        let mut breaks = vec![start];
        for (step, repeat) in &steps {
            let next = breaks[breaks.len() - 1] + step;
            breaks.push(next);
            if *repeat == 0 && degree.get() > 1 {
                breaks.push(next);
            }
        }
        let end = breaks[breaks.len() - 1];
        breaks.retain(|t| *t < end);
        breaks.push(end);
        if close && may_close && breaks.len() > degree.order() {
            return KnotVector::periodic(degree, &breaks).unwrap();
        }
        let mut knots = vec![start; degree.get()];
        knots.extend(&breaks);
        knots.extend(vec![end; degree.get()]);
        KnotVector::new(degree, knots).unwrap()
    })
}

fn surface(may_close: bool) -> impl Strategy<Value = BsplineSurface> {
    (knots(may_close), knots(may_close), any::<bool>()).prop_flat_map(|(u, v, rational)| {
        let count = u.control_count() * v.control_count();
        let points = prop::collection::vec(point(), count);
        let weights = prop::collection::vec(0.1..10.0_f64, count);
        (points, weights).prop_map(move |(points, weights)| {
            let weights = rational.then_some(weights);
            BsplineSurface::new(u.clone(), v.clone(), points, weights).unwrap()
        })
    })
}

/// A quadrilateral in the parameter plane with one curved side.
fn trim(surface: &BsplineSurface, bulge: f64) -> Trim {
    let ((u0, u1), (v0, v1)) = (surface.knots_u().domain(), surface.knots_v().domain());
    let at = |s: f64, t: f64| DVec3::new(u0 + s * (u1 - u0), v0 + t * (v1 - v0), 0.0);
    let curve = |points: Vec<DVec3>| {
        let degree = Degree::new(points.len() - 1).unwrap();
        let knots = KnotVector::clamped_uniform(degree, points.len()).unwrap();
        TrimCurve { parameters: BsplineCurve::new(knots, points, None).unwrap(), edge: None }
    };
    let corners = [at(0.2, 0.1), at(0.8, 0.25), at(0.75, 0.9), at(0.15, 0.7)];
    let mut curves: Vec<TrimCurve> =
        (0..3).map(|k| curve(vec![corners[k], corners[k + 1]])).collect();
    curves.push(curve(vec![corners[3], at(0.3 + bulge, 0.4), corners[0]]));
    Trim::new(vec![TrimLoop::new(curves, 0.0).unwrap()]).unwrap()
}

fn again(file: &str, model: &Model) -> Model {
    let bytes = encode_model(Path::new(file), model).unwrap();
    decode_model(&exchange::extension_of(Path::new(file)), bytes).unwrap()
}

/// Bits, so that a negative zero is not a zero.
fn bits(surface: &BsplineSurface) -> [Vec<u64>; 4] {
    let list = |numbers: &[f64]| numbers.iter().map(|x| x.to_bits()).collect();
    let points = surface.control_points().iter().flat_map(|p| p.to_array());
    [
        list(surface.knots_u().knots()),
        list(surface.knots_v().knots()),
        points.map(f64::to_bits).collect(),
        list(surface.weights().unwrap_or_default()),
    ]
}

fn parameters(trim: &Trim) -> Vec<Vec<BsplineCurve>> {
    let curves = |l: &TrimLoop| l.curves().iter().map(|c| c.parameters.clone()).collect();
    trim.loops().iter().map(curves).collect()
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(200))]

    #[test]
    fn surfaces_come_back_bit_for_bit(surface in surface(true), unit in 0..3_usize) {
        let unit = [LengthUnit::Metre, LengthUnit::Inch, LengthUnit::Millimetre][unit].clone();
        let model = Model::of_surface("roof", surface, unit);
        for file in ["a.ron", "a.step"] {
            let back = again(file, &model);
            prop_assert_eq!(&back.unit, &model.unit, "{}", file);
            let (found, wanted) = (bits(&back.surfaces[0].surface), &model.surfaces[0].surface);
            // STEP wants the normals of a closed shell outside: its parameters may be swapped.
            let closed = wanted.knots_u().is_periodic() && wanted.knots_v().is_periodic();
            let turned = closed && file == "a.step" && found == bits(&wanted.swapped());
            prop_assert!(turned || found == bits(wanted), "{}: {:?}", file, found);
            prop_assert_eq!(&back.surfaces[0].name, "roof");
        }
    }

    #[test]
    fn surfaces_come_back_bit_for_bit_from_json(surface in surface(true)) {
        let model = Model::of_surface("roof", surface, LengthUnit::Millimetre);
        for file in ["a.json", "a.compas.json"] {
            let back = again(file, &model);
            prop_assert_eq!(bits(&back.surfaces[0].surface), bits(&model.surfaces[0].surface), "{}", file);
        }
    }

    #[test]
    fn surfaces_come_back_from_rhino(surface in surface(true)) {
        // Rhino has no periodic polylines: the outer knots that make one are not in the file.
        let straight = |k: &KnotVector| k.is_periodic() && k.degree().get() == 1;
        prop_assume!(!straight(surface.knots_u()) && !straight(surface.knots_v()));
        let model = Model::of_surface("roof", surface, LengthUnit::Foot);
        let back = again("a.3dm", &model);
        prop_assert_eq!(&back.unit, &model.unit);
        let (got, wanted) = (&back.surfaces[0].surface, &model.surfaces[0].surface);
        if wanted.weights().is_none() {
            prop_assert_eq!(bits(got), bits(wanted));
        } else {
            // Control points are stored times their weights: all but the last bit.
            let ([u, v, _, w], [x, y, _, z]) = (bits(got), bits(wanted));
            prop_assert_eq!([u, v, w], [x, y, z]);
            for (p, q) in got.control_points().iter().zip(wanted.control_points()) {
                for (a, b) in p.to_array().into_iter().zip(q.to_array()) {
                    prop_assert!(a == b || a == b.next_up() || a == b.next_down());
                }
            }
        }
    }

    #[test]
    fn meshes_come_back_bit_for_bit(points in prop::collection::vec(point(), 5..40)) {
        let n = points.len() as u32;
        let mut faces: Vec<Vec<u32>> = (2..n).map(|k| vec![k - 2, k - 1, k]).collect();
        faces.push((0..5).collect());
        let model = Model::of_mesh(Mesh::new(points, faces), LengthUnit::Millimetre);
        for file in ["a.obj", "a.ply", "a.json", "a.3dm"] {
            let back = again(file, &model);
            let bits = |m: &Model| -> Vec<[u64; 3]> {
                m.meshes[0].positions.iter().map(|p| p.to_array().map(f64::to_bits)).collect()
            };
            prop_assert_eq!(bits(&back), bits(&model), "{}", file);
            prop_assert_eq!(&back.meshes[0].faces, &model.meshes[0].faces, "{}", file);
        }
    }
}

proptest! {
    // Edges in space are fitted, which takes a while on surfaces as wild as these.
    #![proptest_config(ProptestConfig::with_cases(24))]

    #[test]
    fn trims_come_back_bit_for_bit(surface in surface(false), bulge in -0.1..0.1_f64) {
        let trim = trim(&surface, bulge);
        let named = NamedSurface { trim: Some(trim.clone()), ..NamedSurface::new("", surface) };
        let model = Model { surfaces: vec![named], ..Model::default() };
        for file in ["a.ron", "a.3dm"] {
            let back = again(file, &model);
            let found = back.surfaces[0].trim.as_ref().unwrap();
            prop_assert_eq!(parameters(found), parameters(&trim), "{}", file);
        }
    }
}
