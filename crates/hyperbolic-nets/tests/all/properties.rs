//! What must not change when models are moved, scaled, mirrored or renumbered, and identities.

use fixtures::asymptotic_nets;
use geom_core::{ClosestPoint, DMat3, DVec3, Foot, PolyMesh};
use gp_solver::{List, OptionValue};
use hyperbolic_nets::darboux::{Branch, Corner, DarbouxMap, ImageCircle};
use hyperbolic_nets::{
    BilinearPatch, EdgeJoin, Input, Options, QuadNet, best_log_factor, distinct_shape_parameters,
    solve,
};
use proptest::prelude::*;

/// A rotation, maybe with a reflection, a scaling and a shift.
#[derive(Clone, Copy, Debug)]
struct Similarity {
    turn: DMat3,
    scale: f64,
    shift: DVec3,
}

impl Similarity {
    fn of(self, p: DVec3) -> DVec3 {
        self.turn * p * self.scale + self.shift
    }

    fn back(self, p: DVec3) -> DVec3 {
        self.turn.transpose() * (p - self.shift) / self.scale
    }
}

/// A surface somewhere else.
struct Moved<'a> {
    surface: &'a dyn ClosestPoint,
    by: Similarity,
}

impl ClosestPoint for Moved<'_> {
    fn closest_point(&self, x: DVec3) -> Foot {
        let foot = self.surface.closest_point(self.by.back(x));
        Foot { point: self.by.of(foot.point), normal: self.by.turn * foot.normal }
    }
}

fn vector(size: f64) -> impl Strategy<Value = DVec3> {
    [-size..size, -size..size, -size..size].prop_map(DVec3::from_array)
}

fn similarity() -> impl Strategy<Value = Similarity> {
    let axis = vector(1.0).prop_filter("a direction", |a| a.length() > 0.1);
    (axis, 0.0..6.0_f64, -2.0..2.0_f64, vector(3.0)).prop_map(|(axis, angle, log, shift)| {
        let turn = DMat3::from_axis_angle(axis.normalize(), angle);
        Similarity { turn, scale: 10.0_f64.powf(log), shift }
    })
}

fn jittered(seed: u64) -> (Vec<DVec3>, Vec<[u32; 4]>) {
    let model = asymptotic_nets::scherk(5).jittered(0.05, seed);
    (model.positions, model.quads)
}

/// Positions of the hyperbolic net.
fn solved(positions: Vec<DVec3>, quads: &[[u32; 4]]) -> Vec<DVec3> {
    let net = QuadNet::new(&PolyMesh::new(positions, quads).unwrap()).unwrap();
    let result = solve(&Input::new(&net), &Options::default(), &mut ()).unwrap().result;
    result.net().positions().to_vec()
}

fn near(got: &[DVec3], want: impl Iterator<Item = DVec3>, size: f64) -> bool {
    got.iter().zip(want).all(|(a, b)| a.distance(b) < 1e-7 * size)
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 6, ..ProptestConfig::default() })]

    #[test]
    fn a_moved_and_scaled_net_becomes_the_moved_and_scaled_skin(by in similarity(), seed in 1..50_u64) {
        // Near the smooth surface: feet on a mesh may jump from facet to facet by rounding. Not
        // turned: damping by the diagonal knows the axes.
        let by = Similarity { turn: DMat3::IDENTITY, ..by };
        let model = asymptotic_nets::scherk(5).jittered(0.05, seed);
        let skin = |by: Similarity| {
            let positions = model.positions.iter().map(|p| by.of(*p)).collect();
            let net = QuadNet::new(&PolyMesh::new(positions, &model.quads).unwrap()).unwrap();
            let surface = Moved { surface: &*model.surface, by };
            let input = Input::near_surface(&net, &surface);
            solve(&input, &Options::default(), &mut ()).unwrap().result
        };
        let (still, moved) =
            (skin(Similarity { turn: DMat3::IDENTITY, scale: 1.0, shift: DVec3::ZERO }), skin(by));
        let want = still.net().positions().iter().map(|p| by.of(*p));
        prop_assert!(near(moved.net().positions(), want, by.scale));
        prop_assert!(still.shape().iter().zip(moved.shape()).all(|(a, b)| (a - b).abs() < 1e-7));
    }

    #[test]
    fn a_mirrored_net_becomes_the_mirrored_skin(seed in 1..50_u64) {
        let (positions, quads) = jittered(seed);
        let mirror = |p: &DVec3| DVec3::new(p.x, -p.y, p.z);
        let want = solved(positions.clone(), &quads);
        let got = solved(positions.iter().map(mirror).collect(), &quads);
        prop_assert!(near(&got, want.iter().map(mirror), 1.0));
    }

    #[test]
    fn the_skin_does_not_depend_on_numbers(seed in 1..50_u64, step in 1..36_usize) {
        let (positions, quads) = jittered(seed);
        let n = positions.len();
        // A turn of the numbers, and faces in the other order that begin at the opposite corner.
        let number = |v: usize| (v + step) % n;
        let mut renumbered = positions.clone();
        positions.iter().enumerate().for_each(|(v, p)| renumbered[number(v)] = *p);
        let turned = |q: &[u32; 4]| [2, 3, 0, 1].map(|k| number(q[k] as usize) as u32);
        let faces: Vec<[u32; 4]> = quads.iter().rev().map(turned).collect();
        let want = solved(positions, &quads);
        let got = solved(renumbered, &faces);
        prop_assert!(near(&want, (0..n).map(|v| got[number(v)]), 1.0));
    }
}

proptest! {
    #[test]
    fn kinks_and_ratios_are_those_of_the_moved_join(
        by in similarity(),
        b in prop::array::uniform6(vector(1.0)),
        w in 0.3..3.0_f64,
    ) {
        let (join, moved) = (EdgeJoin { b }, EdgeJoin { b: b.map(|p| by.of(p)) });
        prop_assume!(join.kink(1.0, w, 5) < 3.0);
        prop_assert!((join.kink(1.0, w, 5) - moved.kink(1.0, w, 5)).abs() < 1e-6);
        prop_assert_eq!(join.shape_ratio() > 0.0, moved.shape_ratio() > 0.0);
    }

    #[test]
    fn the_best_factor_takes_back_a_common_one(
        logs in prop::collection::vec((-1.0..1.0_f64, prop::bool::ANY), 1..40),
        t in -1.0..1.0_f64,
    ) {
        let pairs: Vec<(f64, f64)> =
            logs.iter().map(|&(y, s)| (y, if s { 1.0 } else { -1.0 })).collect();
        let shifted: Vec<(f64, f64)> = pairs.iter().map(|&(y, c)| (y + c * t, c)).collect();
        prop_assert!((best_log_factor(&shifted) - best_log_factor(&pairs) + t).abs() < 1e-9);
        let other: Vec<(f64, f64)> = pairs.iter().map(|&(y, c)| (-y, c)).collect();
        prop_assert!((best_log_factor(&other) + best_log_factor(&pairs)).abs() < 1e-9);
    }

    #[test]
    fn panels_are_the_same_seen_along_the_other_diagonal(
        logs in prop::collection::vec(-1.0..1.0_f64, 1..30),
    ) {
        let shape: Vec<f64> = logs.iter().map(|y| y.exp()).collect();
        let count = distinct_shape_parameters(&shape, 0.1);
        let mut other: Vec<f64> = logs.iter().map(|y| (-y).exp()).collect();
        other.reverse();
        prop_assert_eq!(distinct_shape_parameters(&other, 0.1), count);
        other.extend(&shape);
        prop_assert!(count >= 1 && distinct_shape_parameters(&other, 0.1) <= count + 1);
    }

    #[test]
    fn a_patch_turned_by_half_is_the_same_patch(
        b in prop::array::uniform4(vector(1.0)),
        w in prop::array::uniform4(0.2..5.0_f64),
        u in 0.0..1.0_f64,
        v in 0.0..1.0_f64,
    ) {
        let patch = BilinearPatch::new(b, w).unwrap();
        let turn = |k: usize| (k + 2) % 4;
        let turned =
            BilinearPatch::new([0, 1, 2, 3].map(|k| b[turn(k)]), [0, 1, 2, 3].map(|k| w[turn(k)]));
        prop_assert!(turned.unwrap().point(1.0 - u, 1.0 - v).distance(patch.point(u, v)) < 1e-12);
    }

    #[test]
    fn every_point_of_a_patch_lies_on_both_of_its_rulings(
        b in prop::array::uniform4(vector(1.0)),
        w in 0.2..5.0_f64,
        u in 0.0..1.0_f64,
        v in 0.0..1.0_f64,
    ) {
        let patch = BilinearPatch::from_shape_parameter(b, w).unwrap();
        let p = patch.point(u, v);
        for [a, c] in [patch.ruling_along_u(v), patch.ruling_along_v(u)] {
            let off = (p - a).cross(c - a).length();
            prop_assert!(off < 1e-9 && p.distance(a) + p.distance(c) < a.distance(c) + 1e-9);
        }
    }

    #[test]
    fn darboux_maps_have_their_rational_inverse(
        c in -0.95..0.95_f64,
        x in vector(0.8),
        shift in vector(1.0),
        unit in 0.1..10.0_f64,
    ) {
        // At the middle and for c = 0 two images meet, and half of the digits are lost.
        prop_assume!(x.length() > 0.1 && c.abs() > 0.05);
        let origin = shift * unit;
        let map = DarbouxMap::new(c).unwrap().in_frame(origin, unit).unwrap();
        let p = origin + x * unit;
        let y = map.image(p, Branch::Regular).unwrap();
        let accuracy = 1e-8 * unit;
        prop_assert!(map.preimage(y).unwrap().distance(p) < accuracy);
        // A frame only changes units.
        let plain = DarbouxMap::new(c).unwrap().image(x, Branch::Regular).unwrap();
        prop_assert!((origin + plain * unit).distance(y) < accuracy);
    }

    #[test]
    fn images_of_patches_satisfy_their_cyclide(
        c in -0.95..0.95_f64,
        b in prop::array::uniform4(vector(0.6)),
        w in 0.3..3.0_f64,
        u in 0.0..1.0_f64,
        v in 0.0..1.0_f64,
    ) {
        let map = DarbouxMap::new(c).unwrap();
        let patch = BilinearPatch::from_shape_parameter(b, w).unwrap();
        prop_assume!(patch.twist().abs() > 1e-2);
        let y = map.image(patch.point(u, v), Branch::Regular).unwrap();
        let cyclide = map.cyclide(&patch);
        let size = cyclide.matrix.iter().flatten().fold(0.0_f64, |m, a| m.max(a.abs()));
        prop_assert!(cyclide.value(y).abs() < 1e-10 * size * (1.0 + y.length_squared()).powi(2));
    }

    #[test]
    fn images_of_lines_lie_on_their_circle(
        c in -0.95..0.95_f64,
        p in vector(0.7),
        q in vector(0.7),
        t in 0.0..1.0_f64,
    ) {
        prop_assume!(p.distance(q) > 0.1);
        let map = DarbouxMap::new(c).unwrap();
        let y = map.image(p.lerp(q, t), Branch::Regular).unwrap();
        let (off, size) = match map.circle(p, q) {
            ImageCircle::Circle { center, normal, radius } => {
                let plane = normal.dot(y - center).abs();
                (plane.max((y.distance(center) - radius).abs()), 1.0 + radius)
            }
            ImageCircle::Line { point, direction } => {
                ((y - point).cross(direction).length(), 1.0)
            }
        };
        prop_assert!(off < 1e-7 * size * size, "{off} of {size}");
    }

    #[test]
    fn corners_are_read_as_they_are_printed(
        corners in prop::collection::vec((0..8_usize, vector(1e3)), 1..8),
    ) {
        let list: List<Corner> =
            corners.into_iter().map(|(index, point)| Corner { index, point }).collect();
        prop_assert_eq!(List::read(&list.print().unwrap()), Ok(list));
    }

    #[test]
    fn options_are_read_as_they_are_written(
        fairness in prop::option::of(1e-6..1e6_f64),
        weights in prop::collection::vec(1e-3..1e6_f64, 1..5),
        wires in 2..1000_usize,
    ) {
        let constraint_weights = List(weights);
        let options =
            Options { fairness, constraint_weights, wire_positions: wires, ..Options::default() };
        let text = serde_json::to_string(&options).unwrap();
        prop_assert_eq!(serde_json::from_str::<Options>(&text).unwrap(), options.clone());
        let mut read = Options::default();
        for field in Options::FIELDS {
            if let Some(value) = (field.get)(&options) {
                (field.set)(&mut read, &value).unwrap();
            }
        }
        prop_assert_eq!(read, options);
    }
}
