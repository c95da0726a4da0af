//! Both functions as exact numbers, with an exact test of every triangle.

use crate::cut::Cut;
use crate::foliation::{Foliation, Ground};
use crate::surface::{NONE, Surface};

/// Coordinates are whole multiples of `2⁻²⁸` of a cell. With up to `2³⁰` cells differences take 59
/// bits and products fit into 128.
const BITS: u32 = 28;
/// One cell.
pub(crate) const CELL: i64 = 1 << BITS;

/// A place in the plane of both functions.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub(crate) struct Place {
    pub(crate) u: i64,
    pub(crate) v: i64,
}

/// What takes places of one triangle to those of its neighbour.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Step {
    sign: i64,
    by: Place,
}

impl Step {
    pub(crate) const NONE: Self = Self { sign: 1, by: Place { u: 0, v: 0 } };

    pub(crate) fn apply(self, p: Place) -> Place {
        Place { u: self.sign * p.u + self.by.u, v: self.sign * p.v + self.by.v }
    }

    fn inverse(self) -> Self {
        let by = Place { u: -self.sign * self.by.u, v: -self.sign * self.by.v };
        Self { sign: self.sign, by }
    }
}

/// Twice the area of a triangle in the plane; positive if it is counter-clockwise.
pub(crate) fn twice_area(a: Place, b: Place, c: Place) -> i128 {
    let d = |p: i64, q: i64| i128::from(p - q);
    d(b.u, a.u) * d(c.v, a.v) - d(b.v, a.v) * d(c.u, a.u)
}

/// The surface laid out in the plane, in which the net is the grid of whole numbers.
#[derive(Clone, Debug)]
pub(crate) struct Parameters {
    pub(crate) corners: Vec<[Place; 3]>,
    pub(crate) steps: Vec<[Step; 3]>,
}

impl Parameters {
    pub(crate) fn new(ground: &Ground<'_>, cut: &Cut, u: &Foliation, v: &Foliation) -> Self {
        let sheet = |s: usize| {
            let value = &ground.unknowns.values[s];
            let snapped = |f: &Foliation| -> i64 {
                let real = value.real.map_or(0, |(i, sign)| {
                    sign as i64 * (f.reals[i as usize] * CELL as f64).round() as i64
                });
                let whole = value
                    .whole
                    .iter()
                    .map(|&(k, c)| c as i64 * f.wholes[k as usize].round() as i64 * CELL);
                real + whole.sum::<i64>()
            };
            Place { u: snapped(u), v: snapped(v) }
        };
        let places: Vec<Place> = (0..cut.sheet_count).map(sheet).collect();
        let corners = cut.sheets.iter().map(|t| t.map(|s| places[s as usize])).collect();
        let mut steps = vec![[Step::NONE; 3]; ground.surface.triangles.len()];
        for (segment, step) in cut.segments.iter().zip(&ground.unknowns.steps) {
            let by = |f: &Foliation| -> i64 {
                let whole =
                    step.iter().map(|&(k, c)| c as i64 * f.wholes[k as usize].round() as i64);
                whole.sum::<i64>() * CELL
            };
            let step = Step { sign: i64::from(segment.sign), by: Place { u: by(u), v: by(v) } };
            for &(f, k) in &segment.sides {
                let (f, k) = (f as usize, k as usize);
                let g = ground.surface.across[f][k] as usize;
                steps[f][k] = step;
                steps[g][ground.surface.same_side(f, k, g)] = step.inverse();
            }
        }
        Self { corners, steps }
    }

    /// Triangles that are not counter-clockwise.
    pub(crate) fn folded(&self) -> impl Iterator<Item = usize> + '_ {
        let is_folded = |&f: &usize| {
            let [a, b, c] = self.corners[f];
            twice_area(a, b, c) <= 0
        };
        (0..self.corners.len()).filter(is_folded)
    }

    /// Sum of the corner angles at a vertex in the plane, in quarter turns, rounded.
    pub(crate) fn quarters(&self, surface: &Surface, v: usize) -> i32 {
        let angle = |&(f, k): &(u32, u8)| {
            let c = self.corners[f as usize];
            let k = k as usize;
            let to = |p: Place| ((p.u - c[k].u) as f64, (p.v - c[k].v) as f64);
            let (a, b) = (to(c[(k + 1) % 3]), to(c[(k + 2) % 3]));
            (a.0 * b.1 - a.1 * b.0).atan2(a.0 * b.0 + a.1 * b.1)
        };
        let sum: f64 = surface.star(v).iter().map(angle).sum();
        (sum / std::f64::consts::FRAC_PI_2).round() as i32
    }

    /// Whether every inner side of a triangle is the same segment for both of its triangles.
    pub(crate) fn fits(&self, surface: &Surface) -> bool {
        (0..self.corners.len()).all(|f| {
            (0..3).all(|k| {
                let g = surface.across[f][k];
                if g == NONE {
                    return true;
                }
                let (g, c) = (g as usize, self.corners[f]);
                let l = surface.same_side(f, k, g);
                let step = self.steps[f][k];
                step.apply(c[k]) == self.corners[g][(l + 1) % 3]
                    && step.apply(c[(k + 1) % 3]) == self.corners[g][l]
            })
        })
    }
}
