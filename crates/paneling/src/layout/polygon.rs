//! Panels as polygons in the plane, and checks of them.

use crate::error::Error;
use std::collections::HashMap;

/// A corner of a panel.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Corner {
    /// The same for all panels that meet there.
    pub(crate) vertex: usize,
    /// Place in the unit square; beyond 1 in a panel that crosses the seam of a closed surface.
    pub(crate) uv: [f64; 2],
}

/// Signed area, positive if counterclockwise.
pub(crate) fn area(polygon: &[Corner]) -> f64 {
    let n = polygon.len();
    let cross = |k: usize| {
        let (a, b) = (polygon[k].uv, polygon[(k + 1) % n].uv);
        a[0] * b[1] - a[1] * b[0]
    };
    0.5 * (0..n).map(cross).sum::<f64>()
}

/// Refuses polygons that are not simple or turned over, or that overlap.
pub(crate) fn check(panels: &[Vec<Corner>]) -> Result<(), Error> {
    let mut edges: HashMap<(usize, usize), usize> = HashMap::new();
    for (face, panel) in panels.iter().enumerate() {
        let n = panel.len();
        let crosses_itself = || {
            (0..n).any(|i| {
                (i + 2..n).any(|j| (i > 0 || j + 1 < n) && crosses(edge(panel, i), edge(panel, j)))
            })
        };
        let repeats = || (0..n).any(|i| (i + 1..n).any(|j| panel[i].vertex == panel[j].vertex));
        if n < 3 || !(area(panel) > 0.0) || repeats() || crosses_itself() {
            return Err(Error::BadFace { face });
        }
        for k in 0..n {
            let (from, to) = (panel[k].vertex, panel[(k + 1) % n].vertex);
            // Both lie to the left of the edge they share.
            if let Some(first) = edges.insert((from, to), face) {
                return Err(Error::Overlap { first, second: face });
            }
        }
    }
    overlaps(panels)
}

/// Compares panels that share a cell of a grid about as fine as the panels.
fn overlaps(panels: &[Vec<Corner>]) -> Result<(), Error> {
    let cells = (panels.len() as f64).sqrt().ceil().clamp(1.0, 2000.0) as usize;
    let mut buckets: HashMap<(usize, usize), Vec<usize>> = HashMap::new();
    let cell = |x: f64| ((x * cells as f64).max(0.0) as usize).min(cells - 1);
    for (face, panel) in panels.iter().enumerate() {
        let bound = |k: usize, f: fn(f64, f64) -> f64| {
            panel.iter().map(|c| c.uv[k]).fold(panel[0].uv[k], f)
        };
        for i in cell(bound(0, f64::min))..=cell(bound(0, f64::max)) {
            for j in cell(bound(1, f64::min))..=cell(bound(1, f64::max)) {
                let bucket = buckets.entry((i, j)).or_default();
                for &other in bucket.iter() {
                    if overlap(&panels[other], panel) {
                        return Err(Error::Overlap { first: other, second: face });
                    }
                }
                bucket.push(face);
            }
        }
    }
    Ok(())
}

fn overlap(a: &[Corner], b: &[Corner]) -> bool {
    let cross = (0..a.len()).any(|i| (0..b.len()).any(|j| crosses(edge(a, i), edge(b, j))));
    // Without crossing edges one could lie inside the other, or both be the same.
    cross
        || a.iter().any(|c| inside(c.uv, b))
        || b.iter().any(|c| inside(c.uv, a))
        || inside(middle(a), b)
}

fn edge(polygon: &[Corner], k: usize) -> [[f64; 2]; 2] {
    [polygon[k].uv, polygon[(k + 1) % polygon.len()].uv]
}

fn middle(polygon: &[Corner]) -> [f64; 2] {
    let n = polygon.len() as f64;
    [0, 1].map(|k| polygon.iter().map(|c| c.uv[k]).sum::<f64>() / n)
}

/// Twice the area of a triangle.
fn turn(a: [f64; 2], b: [f64; 2], c: [f64; 2]) -> f64 {
    (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
}

/// Whether two segments cross in their insides; touching within rounding does not count.
fn crosses([a, b]: [[f64; 2]; 2], [c, d]: [[f64; 2]; 2]) -> bool {
    const TOUCH: f64 = 1e-12;
    let apart = |x: f64, y: f64| (x > TOUCH && y < -TOUCH) || (x < -TOUCH && y > TOUCH);
    apart(turn(a, b, c), turn(a, b, d)) && apart(turn(c, d, a), turn(c, d, b))
}

/// Whether a point is inside a polygon and not within rounding of its edges.
fn inside(p: [f64; 2], polygon: &[Corner]) -> bool {
    let mut is_inside = false;
    for k in 0..polygon.len() {
        let [a, b] = edge(polygon, k);
        let (ab, ap) = ([b[0] - a[0], b[1] - a[1]], [p[0] - a[0], p[1] - a[1]]);
        let length_squared = ab[0] * ab[0] + ab[1] * ab[1];
        let t = ((ab[0] * ap[0] + ab[1] * ap[1]) / length_squared.max(1e-300)).clamp(0.0, 1.0);
        if (ap[0] - t * ab[0]).hypot(ap[1] - t * ab[1]) < 1e-9 {
            return false;
        }
        if (a[1] > p[1]) != (b[1] > p[1]) {
            let x = a[0] + (p[1] - a[1]) / (b[1] - a[1]) * (b[0] - a[0]);
            is_inside ^= p[0] < x;
        }
    }
    is_inside
}
