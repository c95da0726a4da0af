//! Level lines of a function sampled on a grid.

use std::collections::HashMap;

/// A level line in grid coordinates: `[i, j]` is grid point `i` in the first, `j` in the second
/// direction, fractions lie between grid points.
#[derive(Clone, Debug, PartialEq)]
pub struct Isoline {
    /// Points in order; a closed line does not repeat its first point.
    pub points: Vec<[f64; 2]>,
    /// Whether the last point joins the first.
    pub is_closed: bool,
}

/// Lines where the function with the values `values[i * n_v + j]` crosses `level`, by marching
/// squares with linear interpolation along grid edges.
///
/// A value equal to the level counts as above it, so every crossing lies on one edge. In a cell
/// whose corners alternate the mean of the four decides which pairs are joined. Cells with a
/// value that is not finite have no lines. Lines keep values above the level on their left when
/// the grid is seen with the first direction to the right and the second upwards; open lines come
/// first, then closed ones, each kind in grid order.
///
/// # Panics
/// If the number of values is not `n_u * n_v`.
///
/// # Example
/// ```
/// // The function i + j on a 2 x 2 grid crosses 0.5 on one short line.
/// let lines = geom_core::isolines(&[0.0, 1.0, 1.0, 2.0], 2, 2, 0.5);
/// assert_eq!(lines[0].points, [[0.0, 0.5], [0.5, 0.0]]);
/// ```
#[must_use]
pub fn isolines(values: &[f64], n_u: usize, n_v: usize, level: f64) -> Vec<Isoline> {
    assert_eq!(values.len(), n_u * n_v, "one value per grid point");
    // A crossing is named by its grid edge: 2 * point for the edge along the first direction,
    // 2 * point + 1 for the one along the second. Segments lead from edge to edge; as each keeps
    // the high side on its left, an edge has at most one segment in and one out.
    let mut next: HashMap<usize, usize> = HashMap::new();
    let mut has_incoming: HashMap<usize, bool> = HashMap::new();
    let mut order: Vec<usize> = Vec::new();
    let mut add = |from: usize, to: usize| {
        next.insert(from, to);
        order.push(from);
        has_incoming.insert(to, true);
    };
    for i in 0..n_u.saturating_sub(1) {
        for j in 0..n_v.saturating_sub(1) {
            let at = i * n_v + j;
            // Corners and edges counterclockwise: south, east, north, west.
            let corners = [at, at + n_v, at + n_v + 1, at + 1];
            let edges = [2 * at, 2 * (at + n_v) + 1, 2 * (at + 1), 2 * at + 1];
            let f = corners.map(|c| values[c]);
            if !f.iter().all(|x| x.is_finite()) {
                continue;
            }
            let high = f.map(|x| x >= level);
            // Walking round the cell, a line enters where the corner behind is high and the one
            // ahead low (the high side stays on its left) and leaves in the opposite case.
            let changes = (0..4).filter(|&k| high[k] != high[(k + 1) % 4]).count();
            let joins_high = 0.25 * f.iter().sum::<f64>() >= level;
            for k in 0..4 {
                if !high[k] || high[(k + 1) % 4] {
                    continue;
                }
                let leaves = |k: usize| !high[k % 4] && high[(k + 1) % 4];
                // With two lines in the cell: cut off the low corner ahead if the middle is high,
                // else the high corner behind.
                let step = if changes == 4 && !joins_high { 3 } else { 1 };
                let mut out = k + step;
                while !leaves(out) {
                    out += 1;
                }
                add(edges[k], edges[out % 4]);
            }
        }
    }
    let point = |edge: usize| {
        let at = edge / 2;
        let other = if edge.is_multiple_of(2) { at + n_v } else { at + 1 };
        let t = (level - values[at]) / (values[other] - values[at]);
        let (i, j) = ((at / n_v) as f64, (at % n_v) as f64);
        if edge.is_multiple_of(2) { [i + t, j] } else { [i, j + t] }
    };
    let mut lines = Vec::new();
    let mut follow = |start: usize, next: &mut HashMap<usize, usize>| {
        let mut points = vec![point(start)];
        let mut here = start;
        let mut is_closed = false;
        while let Some(to) = next.remove(&here) {
            if to == start {
                is_closed = true;
                break;
            }
            points.push(point(to));
            here = to;
        }
        lines.push(Isoline { points, is_closed });
    };
    for &start in order.iter().filter(|e| !has_incoming.contains_key(e)) {
        follow(start, &mut next);
    }
    for &start in &order {
        if next.contains_key(&start) {
            follow(start, &mut next);
        }
    }
    lines
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::assert_close;

    fn sampled(n: usize, f: impl Fn(f64, f64) -> f64) -> Vec<f64> {
        let x = |i: usize| 2.0 * i as f64 / (n - 1) as f64 - 1.0;
        (0..n * n).map(|k| f(x(k / n), x(k % n))).collect()
    }

    #[test]
    fn circle_is_one_closed_line_of_the_right_length() {
        let n = 101;
        let values = sampled(n, |x, y| 0.25 - x * x - y * y);
        let lines = isolines(&values, n, n, 0.0);
        assert_eq!(lines.len(), 1);
        assert!(lines[0].is_closed);
        let p = &lines[0].points;
        let mut length = 0.0;
        let mut area = 0.0;
        for (a, b) in p.iter().zip(p.iter().cycle().skip(1)) {
            length += (b[0] - a[0]).hypot(b[1] - a[1]);
            area += 0.5 * (a[0] * b[1] - a[1] * b[0]);
        }
        let radius = 25.0;
        assert_close(length / (radius * std::f64::consts::TAU), 1.0, 1e-3);
        // The high inside is on the left: the line runs counterclockwise.
        assert_close(area / (radius * radius * std::f64::consts::PI), 1.0, 1e-3);
    }

    #[test]
    fn straight_lines_are_exact_and_open() {
        let values = sampled(11, |x, y| x + 0.3 * y);
        let lines = isolines(&values, 11, 11, 0.05);
        assert_eq!(lines.len(), 1);
        assert!(!lines[0].is_closed);
        for [i, j] in &lines[0].points {
            assert_close(i / 5.0 - 1.0 + 0.3 * (j / 5.0 - 1.0), 0.05, 1e-14);
        }
    }

    #[test]
    fn saddle_cells_follow_their_middle() {
        // High corners at (0,0) and (1,1); the middle decides whether they are joined.
        let high = isolines(&[1.0, -0.5, -0.5, 1.0], 2, 2, 0.0);
        let low = isolines(&[0.5, -1.0, -1.0, 0.5], 2, 2, 0.0);
        assert_eq!((high.len(), low.len()), (2, 2));
        // A joined middle leaves lines around the low corners (0, 1) and (1, 0).
        let around = |lines: &[Isoline], corner: [f64; 2]| {
            lines.iter().any(|l| {
                l.points.iter().all(|p| (p[0] - corner[0]).abs() + (p[1] - corner[1]).abs() < 0.5)
            })
        };
        assert!(around(&high, [0.0, 1.0]) && around(&high, [1.0, 0.0]));
        assert!(around(&low, [0.0, 0.0]) && around(&low, [1.0, 1.0]));
    }

    #[test]
    fn levels_on_grid_points_and_gaps_do_no_harm() {
        let mut values = sampled(5, |x, _| x);
        assert_eq!(isolines(&values, 5, 5, 0.0).len(), 1);
        assert!(isolines(&values, 5, 5, 7.0).is_empty());
        values[12] = f64::NAN;
        let lines = isolines(&values, 5, 5, 0.3);
        assert_eq!(lines.len(), 2, "the gap cuts the line in two");
    }
}
