use super::*;
use fixtures::random::Random;

const CENTRES: [f64; 7] = [-3.0, -1.4, -0.5, 0.0, 0.4, 1.5, 3.0];

/// Radius of the real domain, or 1.5 where all is real.
fn reach(c: f64) -> f64 {
    if c.abs() > 1.0 { ((c - 1.0) / (c + 1.0)).sqrt() } else { 1.5 }
}

fn points(c: f64, count: usize) -> Vec<DVec3> {
    let mut random = Random::new(7);
    let mut direction =
        || DVec3::new(random.normal(), random.normal(), random.normal()).normalize();
    let step = 0.95 / count as f64;
    (1..=count).map(|k| direction() * reach(c) * step * k as f64).collect()
}

/// Eq. 12 of Shi et al. 2014 with the upper or lower sign.
fn published(x: DVec3, c: f64, sign: f64) -> DVec3 {
    let square = x.length_squared();
    let s = ((c - 1.0).powi(2) + (1.0 - c * c) * square).sqrt();
    x * ((c * c - c + sign * s) / (square + 1.0 - c - sign * s))
}

#[test]
fn both_branches_agree_with_the_published_formula_and_are_inverse_in_lambda() {
    for c in CENTRES {
        let map = DarbouxMap::new(c).unwrap();
        // The lower sign is the regular branch for c < 1, the upper one for c > 1.
        let sign = if c < 1.0 { -1.0 } else { 1.0 };
        for x in points(c, 60) {
            let regular = map.image(x, Branch::Regular).unwrap();
            let other = map.image(x, Branch::Other).unwrap();
            let near = |a: DVec3, b: DVec3| a.distance(b) < 1e-9 * (1.0 + b.length());
            assert!(near(regular, published(x, c, sign)), "c = {c}, x = {x}");
            assert!(near(other, published(x, c, -sign)), "c = {c}, x = {x}");
            assert!((regular.dot(other) - (c * c - 1.0)).abs() < 1e-11 * (1.0 + c * c));
            for y in [regular, other] {
                assert!(map.preimage(y).unwrap().distance(x) < 1e-12);
                let want = y * (2.0 * (1.0 - c) / (y.length_squared() + c * c - 1.0));
                assert!(want.distance(x) < 1e-12);
            }
        }
    }
}

#[test]
fn planes_become_spheres_and_lines_circles() {
    for c in CENTRES {
        let map = DarbouxMap::new(c).unwrap();
        let (p, q) =
            (DVec3::new(0.09, 0.06, 0.15) * reach(c), DVec3::new(0.4, -0.2, 0.25) * reach(c));
        let normal = DVec3::new(0.5, -0.3, 0.8).normalize();
        let (a, b, d) = map.sphere(normal, normal.dot(p));
        let circle = map.circle(p, q);
        for t in [-0.7, 0.0, 0.4, 1.0, 1.3] {
            let x = p.lerp(q, t);
            let in_plane = x - normal * normal.dot(x - p);
            for branch in [Branch::Regular, Branch::Other] {
                let y = map.image(in_plane, branch).unwrap();
                let size = a.length() * y.length() + b.abs() * y.length_squared() + d.abs();
                assert!((a.dot(y) + b * y.length_squared() + d).abs() < 1e-12 * size);
                let ImageCircle::Circle { center, normal, radius } = circle else {
                    panic!("a line off the origin becomes a circle");
                };
                let y = map.image(x, branch).unwrap();
                let size = radius + y.length();
                assert!(normal.dot(y - center).abs() < 1e-12 * size, "c = {c}");
                assert!((y.distance(center) - radius).abs() < 1e-12 * size, "c = {c}");
            }
        }
        let through_origin = map.circle(DVec3::ZERO, DVec3::new(0.1, 0.2, 0.3));
        let ImageCircle::Line { point, direction } = through_origin else {
            panic!("a line through the origin stays straight");
        };
        let want = DVec3::new(1.0, 2.0, 3.0).normalize();
        assert!(direction.cross(want).length() < 1e-12 && point.cross(want).length() < 1e-12);
    }
}

#[test]
fn derivative_matches_central_differences() {
    for c in CENTRES {
        let map = DarbouxMap::new(c).unwrap();
        for x in points(c, 12).into_iter().skip(1).take(9) {
            for branch in [Branch::Regular, Branch::Other] {
                let (_, forward) = map.derivative(x, branch).unwrap();
                let h = 1e-6;
                for axis in [DVec3::X, DVec3::Y, DVec3::Z] {
                    let up = map.image(x + axis * h, branch).unwrap();
                    let down = map.image(x - axis * h, branch).unwrap();
                    let (want, got) = ((up - down) / (2.0 * h), forward * axis);
                    assert!(got.distance(want) < 1e-6 * (1.0 + want.length()), "c = {c}");
                }
            }
        }
    }
}

fn patch() -> BilinearPatch {
    let corners = [
        DVec3::new(0.1, 0.1, 0.05),
        DVec3::new(0.35, 0.08, 0.0),
        DVec3::new(0.33, 0.37, 0.12),
        DVec3::new(0.08, 0.34, -0.02),
    ];
    BilinearPatch::from_shape_parameter(corners, 1.2).unwrap()
}

#[test]
fn images_of_a_patch_satisfy_the_cyclide_and_have_its_normals_and_curvatures() {
    for c in [-2.0, -0.5, 0.4, 3.0] {
        let map = DarbouxMap::new(c).unwrap();
        let cyclide = map.cyclide(&patch());
        for branch in [Branch::Regular, Branch::Other] {
            for (u, v) in [(0.1, 0.2), (0.5, 0.5), (0.9, 0.7)] {
                let jet = patch().jet(u, v);
                let (y, forward) = map.derivative(jet.point, branch).unwrap();
                let gradient = cyclide.gradient(y);
                let size = gradient.length() * (1.0 + y.length());
                assert!(cyclide.value(y).abs() < 1e-12 * size.max(1e-6));
                let normal = (forward * jet.du).cross(forward * jet.dv).normalize();
                assert!(normal.cross(gradient.normalize()).length() < 1e-10);
                // Gaussian curvature of the image against differences of its exact normals.
                let at = |u: f64, v: f64| {
                    let jet = patch().jet(u, v);
                    let (y, d) = map.derivative(jet.point, branch).unwrap();
                    (y, (d * jet.du).cross(d * jet.dv).normalize())
                };
                let h = 1e-5;
                let (pu, pv) = ((at(u + h, v), at(u - h, v)), (at(u, v + h), at(u, v - h)));
                let (nu, nv) = ((pu.0.1 - pu.1.1) / (2.0 * h), (pv.0.1 - pv.1.1) / (2.0 * h));
                let (su, sv) = ((pu.0.0 - pu.1.0) / (2.0 * h), (pv.0.0 - pv.1.0) / (2.0 * h));
                let area = su.cross(sv);
                let want = nu.cross(nv).dot(area) / area.length_squared();
                let (mean, gauss) = cyclide.curvatures(y);
                assert!((gauss - want).abs() < 1e-5 * (1.0 + want.abs()), "{gauss} {want}");
                // −2 H = div n = (n_u × s_v + s_u × n_v) · (s_u × s_v) / |s_u × s_v|².
                let along = area.dot(gradient).signum();
                let want =
                    -0.5 * along * (nu.cross(sv) + su.cross(nv)).dot(area) / area.length_squared();
                assert!((mean - want).abs() < 1e-5 * (1.0 + want.abs()), "{mean} {want}");
            }
        }
    }
}

#[test]
fn frames_shift_and_scale_model_and_image_alike() {
    let (origin, unit) = (DVec3::new(3.0, -2.0, 5.0), 40.0);
    for c in CENTRES {
        let plain = DarbouxMap::new(c).unwrap();
        let framed = plain.in_frame(origin, unit).unwrap();
        for x in points(c, 10) {
            for branch in [Branch::Regular, Branch::Other] {
                let want = origin + plain.image(x, branch).unwrap() * unit;
                let got = framed.image(origin + x * unit, branch).unwrap();
                assert!(got.distance(want) < 1e-8 * (unit + want.length()), "c = {c} {branch:?}");
            }
        }
    }
}

#[test]
fn what_has_no_image_is_named() {
    for c in [1.0, f64::NAN, f64::INFINITY] {
        assert!(matches!(DarbouxMap::new(c), Err(Error::BadCentre { .. })));
    }
    let map = DarbouxMap::new(3.0).unwrap();
    let outside = DVec3::new(0.8, 0.0, 0.0);
    let error = map.check(&[DVec3::ZERO, outside], Branch::Regular).unwrap_err();
    assert!(matches!(error, Error::OutsideRealDomain { x: 0.8, .. }), "{error}");
    let error = map.image(DVec3::ZERO, Branch::Other).unwrap_err();
    assert!(matches!(error, Error::Infinite { .. }), "{error}");
    // c = −1 is an inversion on one branch, and collapses on the other.
    let map = DarbouxMap::new(-1.0).unwrap();
    let x = DVec3::new(0.3, 0.2, 0.1);
    let images = [Branch::Regular, Branch::Other].map(|b| map.image(x, b));
    assert!(images.contains(&Err(Error::Collapsed)), "{images:?}");
    let inverted = x * (4.0 / x.length_squared());
    assert!(images.iter().flatten().any(|y| y.distance(inverted) < 1e-12), "{images:?}");
    assert!(matches!(DarbouxMap::from_matrix([[0.0; 5]; 4]), Err(Error::BadCage { .. })));
}
