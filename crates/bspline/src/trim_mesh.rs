//! Triangles over the part of the parameter plane that a trim bounds.

use crate::trim::{Trim, TrimLoop};
use glam::DVec2;
use std::collections::HashMap;

/// Levels and places nearer than this share of the extent are one.
const SAME: f64 = 1e-12;

/// Triangles over parameter pairs.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct TrimMesh {
    /// Corners of the triangles.
    pub parameters: Vec<[f64; 2]>,
    /// Counter-clockwise in the parameter plane.
    pub triangles: Vec<[u32; 3]>,
}

/// An edge of the polygon around the face, from its lower to its upper end.
struct Side {
    low: DVec2,
    high: DVec2,
}

impl Side {
    fn at(&self, v: f64) -> f64 {
        // The ends themselves, whatever the interpolation rounds to.
        if v <= self.low.y {
            self.low.x
        } else if v >= self.high.y {
            self.high.x
        } else {
            let s = (v - self.low.y) / (self.high.y - self.low.y);
            self.low.x + s * (self.high.x - self.low.x)
        }
    }
}

impl Trim {
    /// Triangles over the face, with corners on the lines `u` and `v` (rising) inside it and on a
    /// polygon around it: between every two levels of corners the face falls into strips, and
    /// neighbours share all their corners.
    #[must_use]
    pub fn triangles(&self, u: &[f64], v: &[f64]) -> TrimMesh {
        let polygons: Vec<Vec<DVec2>> = self.loops().iter().map(TrimLoop::polygon).collect();
        let all = || polygons.iter().flatten();
        let (low, high) =
            all().fold((DVec2::INFINITY, DVec2::NEG_INFINITY), |(a, b), p| (a.min(*p), b.max(*p)));
        let same = SAME * (high - low);
        let inner = v.iter().copied().filter(|t| *t > low.y && *t < high.y);
        let mut levels: Vec<f64> = all().map(|p| p.y).chain(inner).collect();
        unique(&mut levels, same.y);
        // Corners exactly on their levels.
        let snap = |p: DVec2| DVec2::new(p.x, levels[nearest(&levels, p.y)]);
        let mut sides = Vec::new();
        let mut places: Vec<Vec<f64>> = vec![u.to_vec(); levels.len()];
        for polygon in &polygons {
            for (k, a) in polygon.iter().enumerate() {
                let (a, b) = (snap(*a), snap(polygon[(k + 1) % polygon.len()]));
                places[nearest(&levels, a.y)].push(a.x);
                if a.y != b.y {
                    let (low, high) = if a.y < b.y { (a, b) } else { (b, a) };
                    sides.push(Side { low, high });
                }
            }
        }
        // Sides by the first level they reach.
        sides.sort_by(|a, b| a.low.y.total_cmp(&b.low.y));
        let mut strips: Vec<Vec<[f64; 2]>> = vec![Vec::new(); levels.len().saturating_sub(1)];
        for side in &sides {
            let (first, last) = (nearest(&levels, side.low.y), nearest(&levels, side.high.y));
            for k in first..last {
                let ends = [side.at(levels[k]), side.at(levels[k + 1])];
                strips[k].push(ends);
                places[k].push(ends[0]);
                places[k + 1].push(ends[1]);
            }
        }
        places.iter_mut().for_each(|row| unique(row, same.x));
        let mut made = Builder { levels: &levels, places: &places, ..Builder::default() };
        for (k, strip) in strips.iter_mut().enumerate() {
            strip.sort_by(|a, b| (a[0] + a[1]).total_cmp(&(b[0] + b[1])));
            for pair in strip.chunks_exact(2) {
                made.fill(k, [pair[0][0], pair[1][0]], [pair[0][1], pair[1][1]]);
            }
        }
        made.mesh
    }
}

fn unique(values: &mut Vec<f64>, same: f64) {
    values.sort_by(f64::total_cmp);
    values.dedup_by(|b, a| *b - *a <= same);
}

/// Index of the value nearest to `t` in a rising list.
fn nearest(values: &[f64], t: f64) -> usize {
    let after = values.partition_point(|x| *x < t);
    match (after.checked_sub(1), values.get(after)) {
        (Some(before), Some(x)) if t - values[before] <= x - t => before,
        (Some(before), None) => before,
        _ => after,
    }
}

#[derive(Default)]
struct Builder<'a> {
    levels: &'a [f64],
    places: &'a [Vec<f64>],
    ids: HashMap<(usize, usize), u32>,
    mesh: TrimMesh,
}

impl Builder<'_> {
    /// The corner at place `i` of level `k`.
    fn id(&mut self, k: usize, i: usize) -> u32 {
        let (u, v) = (self.places[k][i], self.levels[k]);
        *self.ids.entry((k, i)).or_insert_with(|| {
            self.mesh.parameters.push([u, v]);
            self.mesh.parameters.len() as u32 - 1
        })
    }

    /// Triangles between the places from `bottom` on level `k` and those from `top` on the next.
    fn fill(&mut self, k: usize, bottom: [f64; 2], top: [f64; 2]) {
        let range = |row: &[f64], ends: [f64; 2]| ends.map(|t| nearest(row, t));
        let ([mut i, i_end], [mut j, j_end]) =
            (range(&self.places[k], bottom), range(&self.places[k + 1], top));
        while i < i_end || j < j_end {
            let below =
                j >= j_end || (i < i_end && self.places[k][i + 1] <= self.places[k + 1][j + 1]);
            let (a, b) = (self.id(k, i), self.id(k + 1, j));
            let c = if below { self.id(k, i + 1) } else { self.id(k + 1, j + 1) };
            self.mesh.triangles.push([a, c, b]);
            if below { i += 1 } else { j += 1 }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{ArcSpans, BsplineCurve, TrimCurve};
    use geom_core::{DVec3, assert_close};
    use std::f64::consts::{PI, TAU};

    fn ring(center: DVec2, radius: f64) -> TrimLoop {
        let spans = ArcSpans::new(0.3, 0.3 + TAU);
        let center = DVec3::new(center.x, center.y, 0.0);
        let arc = BsplineCurve::arc(center, radius * DVec3::X, radius * DVec3::Y, spans);
        TrimLoop::new(vec![TrimCurve { parameters: arc.unwrap(), edge: None }], 1e-12).unwrap()
    }

    #[test]
    fn a_disc_with_a_hole_is_covered_once_without_cracks() {
        let middle = DVec2::new(0.5, 0.5);
        let loops = vec![ring(middle, 0.4), ring(middle + DVec2::new(0.1, 0.05), 0.15)];
        let trim = Trim::new(loops).unwrap();
        let lines: Vec<f64> = (0..=10).map(|k| f64::from(k) / 10.0).collect();
        let mesh = trim.triangles(&lines, &lines);
        let at = |i: u32| DVec2::from_array(mesh.parameters[i as usize]);
        let (mut area, mut edges) = (0.0, HashMap::new());
        for [a, b, c] in &mesh.triangles {
            let twice = (at(*b) - at(*a)).perp_dot(at(*c) - at(*a));
            assert!(twice > -1e-15, "{twice}");
            area += 0.5 * twice;
            for (a, b) in [(a, b), (b, c), (c, a)] {
                *edges.entry((a.min(b), a.max(b))).or_insert(0) += if a < b { 1 } else { -1 };
            }
        }
        assert_close(area, PI * (0.16 - 0.0225), 2e-3);
        // Edges with one triangle lie on the border only: as many as there are polygon sides.
        let open: f64 = edges
            .iter()
            .filter(|(_, n)| **n != 0)
            .map(|((a, b), _)| at(**a).distance(at(**b)))
            .sum();
        assert_close(open, TAU * 0.55, 5e-3);
    }
}
