//! Polygons as triangles, for formats that know nothing else.

use geom_core::DVec3;

/// Largest polygon that is cut by ears, which takes quadratic time; larger ones are fanned.
const MOST_EARS: usize = 1000;

/// Appends triangles that cover a polygon: quads along the shorter diagonal, larger polygons by
/// cutting ears of their projection along the mean normal, so that concave ones come out right.
pub(crate) fn triangulate(positions: &[DVec3], corners: &[u32], triangles: &mut Vec<u32>) {
    let p = |i: u32| positions[i as usize];
    match *corners {
        [a, b, c] => triangles.extend([a, b, c]),
        [a, b, c, d] => {
            let (n_ac, n_bd) = (
                (p(b) - p(a)).cross(p(c) - p(a)).dot((p(c) - p(a)).cross(p(d) - p(a))),
                (p(c) - p(b)).cross(p(d) - p(b)).dot((p(d) - p(b)).cross(p(a) - p(b))),
            );
            // A diagonal outside a concave quad turns one of its triangles over.
            let shorter_ac = p(a).distance_squared(p(c)) <= p(b).distance_squared(p(d));
            if if (n_ac > 0.0) == (n_bd > 0.0) { shorter_ac } else { n_ac > 0.0 } {
                triangles.extend([a, b, c, a, c, d]);
            } else {
                triangles.extend([b, c, d, b, d, a]);
            }
        }
        _ if corners.len() > MOST_EARS => {
            triangles.extend(corners.windows(2).skip(1).flat_map(|e| [corners[0], e[0], e[1]]));
        }
        _ => cut_ears(positions, corners.to_vec(), triangles),
    }
}

fn cut_ears(positions: &[DVec3], mut left: Vec<u32>, triangles: &mut Vec<u32>) {
    let p = |i: u32| positions[i as usize];
    let origin = left.first().map_or(DVec3::ZERO, |&i| p(i));
    let area = |a: u32, b: u32| (p(a) - origin).cross(p(b) - origin);
    let normal: DVec3 = (0..left.len()).map(|k| area(left[k], left[(k + 1) % left.len()])).sum();
    let side = |a: u32, b: u32, c: u32| (p(b) - p(a)).cross(p(c) - p(a)).dot(normal);
    while left.len() > 3 {
        let n = left.len();
        let is_ear = |k: usize| {
            let (a, b, c) = (left[(k + n - 1) % n], left[k], left[(k + 1) % n]);
            let inside = |&q: &u32| {
                ![a, b, c].contains(&q)
                    && side(a, b, q) >= 0.0
                    && side(b, c, q) >= 0.0
                    && side(c, a, q) >= 0.0
            };
            side(a, b, c) > 0.0 && !left.iter().any(inside)
        };
        // A polygon that crosses itself may have no ear; any corner will do then.
        let k = (0..n).find(|&k| is_ear(k)).unwrap_or(0);
        triangles.extend([left[(k + n - 1) % n], left[k], left[(k + 1) % n]]);
        left.remove(k);
    }
    triangles.extend(left);
}

#[cfg(test)]
mod tests {
    use super::*;

    fn area(points: &[DVec3], triangles: &[u32]) -> f64 {
        let p = |i: u32| points[i as usize];
        triangles
            .chunks(3)
            .map(|t| 0.5 * (p(t[1]) - p(t[0])).cross(p(t[2]) - p(t[0])).z)
            .inspect(|a| assert!(*a > 0.0))
            .sum()
    }

    #[test]
    fn concave_polygons_keep_their_area() {
        let arrow =
            [(0.0, 0.0), (2.0, -1.0), (0.5, 0.0), (2.0, 1.0)].map(|(x, y)| DVec3::new(x, y, 0.0));
        for shift in 0..4 {
            let mut triangles = Vec::new();
            let corners: Vec<u32> = (0..4).map(|k| (k + shift) % 4).collect();
            triangulate(&arrow, &corners, &mut triangles);
            assert!((area(&arrow, &triangles) - 0.5).abs() < 1e-15);
        }
        // A comb with three teeth.
        let comb = [
            (0.0, 0.0),
            (5.0, 0.0),
            (5.0, 2.0),
            (4.0, 2.0),
            (4.0, 1.0),
            (3.0, 1.0),
            (3.0, 2.0),
            (2.0, 2.0),
            (2.0, 1.0),
            (1.0, 1.0),
            (1.0, 2.0),
            (0.0, 2.0),
        ]
        .map(|(x, y)| DVec3::new(x, y, 0.0));
        let mut triangles = Vec::new();
        triangulate(&comb, &(0..12).collect::<Vec<u32>>(), &mut triangles);
        assert_eq!(triangles.len(), 30);
        assert!((area(&comb, &triangles) - 8.0).abs() < 1e-14);
    }
}
