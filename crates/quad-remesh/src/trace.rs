//! The cells of the net: from the middle of each a straight walk to its four corners.
//!
//! All decisions are exact: coordinates are whole numbers, and a vertex on the line of a walk counts
//! as on its right, in every triangle alike.

use std::collections::HashMap;

use geom_core::DVec3;
use rayon::prelude::*;

use crate::parameters::{CELL, Parameters, Place, twice_area};
use crate::surface::{NONE, Surface};

/// Triangles a walk crosses at most.
const LONGEST_WALK: usize = 100_000;

/// A place on the surface, by one name only.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
enum Spot {
    Vertex(u32),
    Inside(u32, Place),
}

/// Where a walk ended, and the shares of the triangle's corners there.
#[derive(Clone, Copy, Debug)]
struct End {
    spot: Spot,
    triangle: u32,
    shares: [f64; 3],
}

/// Quads of the net and their corners on the surface.
#[derive(Clone, Debug)]
pub(crate) struct Cells {
    pub(crate) positions: Vec<DVec3>,
    pub(crate) quads: Vec<[u32; 4]>,
}

/// All cells that lie within the surface. Quads run counter-clockwise, the first side along the
/// direction in which the first function rises.
pub(crate) fn cells(surface: &Surface, parameters: &Parameters) -> Cells {
    let walker = Walker { surface, parameters };
    let found: Vec<Vec<[End; 4]>> = (0..surface.triangles.len())
        .into_par_iter()
        .with_min_len(64)
        .map(|f| walker.cells_of(f))
        .collect();
    let mut out = Cells { positions: Vec::new(), quads: Vec::new() };
    let mut numbers: HashMap<Spot, u32> = HashMap::new();
    for ends in found.into_iter().flatten() {
        out.quads.push(ends.map(|end| {
            *numbers.entry(end.spot).or_insert_with(|| {
                let corners = surface.corners(end.triangle as usize);
                out.positions.push(corners.iter().zip(end.shares).map(|(p, s)| *p * s).sum());
                out.positions.len() as u32 - 1
            })
        }));
    }
    out
}

struct Walker<'a> {
    surface: &'a Surface,
    parameters: &'a Parameters,
}

impl Walker<'_> {
    /// The corners of all cells whose middles belong to a triangle and whose corners lie within the
    /// surface.
    fn cells_of(&self, f: usize) -> Vec<[End; 4]> {
        let c = self.parameters.corners[f];
        let cells = |of: fn(&Place) -> i64| {
            let values = c.each_ref().map(of);
            let (low, high) = (values.iter().min(), values.iter().max());
            let cell = |x: Option<&i64>| x.map_or(0, |x| x.div_euclid(CELL));
            cell(low)..=cell(high)
        };
        let mut out = Vec::new();
        for i in cells(|p| p.u) {
            for j in cells(|p| p.v) {
                let middle = Place { u: i * CELL + CELL / 2, v: j * CELL + CELL / 2 };
                if self.owns(f, middle) {
                    let corner = |di: i64, dj: i64| {
                        let to = Place { u: (i + di) * CELL, v: (j + dj) * CELL };
                        self.walk(f, middle, to)
                    };
                    let corners = [corner(0, 0), corner(1, 0), corner(1, 1), corner(0, 1)];
                    if let [Some(a), Some(b), Some(c), Some(d)] = corners {
                        out.push([a, b, c, d]);
                    }
                }
            }
        }
        out
    }

    fn sides(&self, f: usize, p: Place) -> [i128; 3] {
        let c = self.parameters.corners[f];
        [0, 1, 2].map(|k| twice_area(c[k], c[(k + 1) % 3], p))
    }

    /// Whether a triangle has a place, and of several that have it the lowest number.
    fn owns(&self, f: usize, p: Place) -> bool {
        let sides = self.sides(f, p);
        if sides.iter().any(|s| *s < 0) {
            return false;
        }
        let on: Vec<usize> = (0..3).filter(|&k| sides[k] == 0).collect();
        match on[..] {
            [] => true,
            [k] => self.surface.across[f][k] == NONE || self.surface.across[f][k] as usize > f,
            _ => {
                let corner = (0..3).find(|&k| self.parameters.corners[f][k] == p).unwrap_or(0);
                let v = self.surface.triangles[f][corner] as usize;
                self.surface.star(v).iter().all(|&(g, _)| g as usize >= f)
            }
        }
    }

    /// Walks straight from a place of triangle `f` to another in its plane; `None` at the border.
    fn walk(&self, f: usize, from: Place, to: Place) -> Option<End> {
        // A place on a side or corner belongs to several triangles; the walk may start in any.
        let mut starts = vec![(f, from, to)];
        let sides = self.sides(f, from);
        if sides.contains(&0) {
            let zero = (0..3).filter(|&k| sides[k] == 0).count();
            if zero == 1 {
                let k = (0..3).find(|&k| sides[k] == 0).unwrap_or(0);
                starts.extend(self.across(f, k, from, to));
            } else {
                let corner = (0..3).find(|&k| self.parameters.corners[f][k] == from).unwrap_or(0);
                starts.extend(self.around(f, corner, from, to));
            }
        }
        starts.into_iter().find_map(|(f, from, to)| self.walk_from(f, from, to))
    }

    fn across(&self, f: usize, k: usize, from: Place, to: Place) -> Option<(usize, Place, Place)> {
        let g = self.surface.across[f][k];
        let step = self.parameters.steps[f][k];
        (g != NONE).then(|| (g as usize, step.apply(from), step.apply(to)))
    }

    /// The other triangles at a corner.
    fn around(
        &self,
        f: usize,
        corner: usize,
        from: Place,
        to: Place,
    ) -> Vec<(usize, Place, Place)> {
        let v = self.surface.triangles[f][corner];
        let mut out: Vec<(usize, Place, Place)> = Vec::new();
        for turn in [2, 0] {
            let (mut at, mut p, mut q) = (f, from, to);
            loop {
                let k = (self.surface.corner_of(at, v) + turn) % 3;
                let Some((g, a, b)) = self.across(at, k, p, q) else { break };
                if g == f || out.iter().any(|(h, ..)| *h == g) {
                    break;
                }
                out.push((g, a, b));
                (at, p, q) = (g, a, b);
            }
        }
        out
    }

    fn walk_from(&self, f: usize, from: Place, to: Place) -> Option<End> {
        let (mut f, mut from, mut to) = (f, from, to);
        let mut entered: Option<usize> = None;
        for _ in 0..LONGEST_WALK {
            let sides = self.sides(f, to);
            if sides.iter().all(|s| *s >= 0) {
                return Some(self.end(f, to, sides));
            }
            let corners = self.parameters.corners[f];
            let is_left = corners.map(|c| twice_area(from, to, c) > 0);
            // It leaves where a corner on its right is followed by one on its left.
            let exit = (0..3).find(|&k| {
                Some(k) != entered && !is_left[k] && is_left[(k + 1) % 3] && sides[k] < 0
            })?;
            let g = self.surface.across[f][exit];
            let (next, a, b) = self.across(f, exit, from, to)?;
            entered = Some(self.surface.same_side(f, exit, g as usize));
            (f, from, to) = (next, a, b);
        }
        None
    }

    fn end(&self, f: usize, p: Place, sides: [i128; 3]) -> End {
        let triangle = f as u32;
        let total: i128 = sides.iter().sum();
        // The share of a corner is the area opposite.
        let shares = [1, 2, 0].map(|k| sides[k] as f64 / total as f64);
        let zero: Vec<usize> = (0..3).filter(|&k| sides[k] == 0).collect();
        let spot = match zero[..] {
            [] => Spot::Inside(triangle, p),
            [k] => {
                // Named in the triangle with the lower number.
                let g = self.surface.across[f][k];
                if g < triangle {
                    Spot::Inside(g, self.parameters.steps[f][k].apply(p))
                } else {
                    Spot::Inside(triangle, p)
                }
            }
            _ => {
                let corner = (0..3).find(|&k| self.parameters.corners[f][k] == p).unwrap_or(0);
                Spot::Vertex(self.surface.triangles[f][corner])
            }
        };
        End { spot, triangle, shares }
    }
}
