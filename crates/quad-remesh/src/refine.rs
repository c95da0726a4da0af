//! Smaller triangles where the directions turn fast.

use std::collections::BTreeMap;

use geom_core::DVec2;

use crate::field::{Field, times, unit};
use crate::surface::Surface;

/// Halves the given sides `(triangle, side)` and cuts the triangles at them into two, three or four;
/// the surface and its field stay what they are.
pub(crate) fn refine(surface: &mut Surface, field: &mut Field, sides: &[(u32, u8)]) {
    let mut positions = surface.positions.clone();
    let mut middles: BTreeMap<(u32, u32), u32> = BTreeMap::new();
    for &(f, k) in sides {
        let t = surface.triangles[f as usize];
        let (a, b) = (t[k as usize], t[(k as usize + 1) % 3]);
        middles.entry((a.min(b), a.max(b))).or_insert_with(|| {
            positions.push(0.5 * (positions[a as usize] + positions[b as usize]));
            positions.len() as u32 - 1
        });
    }
    let (mut triangles, mut sources) = (Vec::new(), Vec::new());
    for (f, t) in surface.triangles.iter().enumerate() {
        let middle = |k: usize| {
            let (a, b) = (t[k], t[(k + 1) % 3]);
            middles.get(&(a.min(b), a.max(b))).copied()
        };
        let before = triangles.len();
        match [middle(0), middle(1), middle(2)] {
            [None, None, None] => triangles.push(*t),
            [Some(c), Some(a), Some(b)] => {
                triangles.extend([[t[0], c, b], [t[1], a, c], [t[2], b, a], [c, a, b]]);
            }
            some => {
                // Turned so that the first side is cut, and the last is not.
                let first = (0..3).find(|&k| some[k].is_some() && some[(k + 2) % 3].is_none());
                let first = first.unwrap_or(0);
                let [a, b, c] = [0, 1, 2].map(|j| t[(first + j) % 3]);
                let m = some[first].unwrap_or(a);
                match some[(first + 1) % 3] {
                    None => triangles.extend([[a, m, c], [m, b, c]]),
                    Some(n) => {
                        triangles.push([m, b, n]);
                        let at = |v: u32| positions[v as usize];
                        if at(a).distance(at(n)) < at(m).distance(at(c)) {
                            triangles.extend([[a, m, n], [a, n, c]]);
                        } else {
                            triangles.extend([[a, m, c], [m, n, c]]);
                        }
                    }
                }
            }
        }
        sources.resize(sources.len() + triangles.len() - before, f);
    }
    let old = std::mem::replace(surface, Surface::new(positions, triangles));
    let turned = |(piece, &source): (usize, &usize)| -> DVec2 {
        // A piece lies in the plane of its source; only the frame may differ.
        let axis = surface.local(piece, old.x_axes[source]);
        times(field.deviator[source], unit(2.0 * axis.y.atan2(axis.x)))
    };
    let deviator = sources.iter().enumerate().map(turned).collect();
    let mean = sources.iter().map(|&source| field.mean[source]).collect();
    *field = Field { mean, deviator };
}

#[cfg(test)]
mod tests {
    use super::*;
    use geom_core::DVec3;

    #[test]
    fn pieces_keep_area_orientation_and_direction() {
        let n = 4_u32;
        let at = |k: u32| DVec3::new(f64::from(k / (n + 1)), f64::from(k % (n + 1)), 0.0);
        let points = (0..(n + 1) * (n + 1)).map(at).collect();
        let cells = (0..n * n).map(|k| (n + 1) * (k / n) + k % n);
        let triangles =
            cells.flat_map(|a| [[a, a + n + 1, a + n + 2], [a, a + n + 2, a + 1]]).collect();
        let mut surface = Surface::new(points, triangles);
        let direction = DVec3::new(0.8, 0.6, 0.0);
        let local = |surface: &Surface, f: usize| {
            let d = surface.local(f, direction);
            times(d, d)
        };
        let count = surface.triangles.len();
        let deviator = (0..count).map(|f| local(&surface, f)).collect();
        let mut field = Field { mean: vec![1.0; count], deviator };
        refine(&mut surface, &mut field, &[(0, 0), (0, 1), (9, 2), (12, 0), (12, 1), (12, 2)]);
        assert!((surface.area() - 16.0).abs() < 1e-12 && surface.euler_characteristic() == 1);
        for f in 0..surface.triangles.len() {
            assert!(surface.normals[f].z > 0.99);
            assert!((field.deviator[f] - local(&surface, f)).length() < 1e-12);
        }
    }
}
