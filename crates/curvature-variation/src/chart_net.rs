//! The control points around an extraordinary vertex, and what a step of subdivision makes of them.
//!
//! Sector `i` lies between the edges `i` and `i + 1`, counter-clockwise; its control point `(a, b)`
//! is `a` steps along the first and `b` along the second. A net of reach `r` holds all points with
//! `a, b <= r`, each once: the vertex, then for every sector those on its first edge and those
//! inside, `b` fastest.

use numerics::Matrix;

/// Reach of the net that one step of subdivision starts from.
pub(crate) const COARSE: usize = 2;
/// Reach of what it gives.
pub(crate) const FINE: usize = 3;

/// Number of control points of a net.
pub(crate) const fn count(valence: usize, reach: usize) -> usize {
    1 + valence * reach * (reach + 1)
}

/// Place of a control point; negative steps lead into the neighbouring sectors.
pub(crate) fn place(valence: usize, sector: usize, [a, b]: [isize; 2], reach: usize) -> usize {
    let (before, after) = ((sector + valence - 1) % valence, (sector + 1) % valence);
    match (a, b) {
        (0, 0) => 0,
        (_, ..0) => place(valence, before, [-b, a], reach),
        (..0, _) => place(valence, after, [b, -a], reach),
        (0, _) => place(valence, after, [b, 0], reach),
        (_, 0) => 1 + sector * reach * (reach + 1) + (a as usize - 1),
        _ => 1 + sector * reach * (reach + 1) + reach * a as usize + (b as usize - 1),
    }
}

/// Rows of a net of reach [`FINE`] after one Catmull-Clark step, from the points of one of reach
/// [`COARSE`] (Catmull and Clark 1978).
pub(crate) fn refinement(valence: usize) -> Matrix {
    let n = count(valence, COARSE);
    let mut rows = Matrix::zeros(count(valence, FINE), n);
    let add = |row: &mut [f64], sector: usize, at: [isize; 2], weight: f64| {
        row[place(valence, sector, at, COARSE)] += weight;
    };
    // The face with the corner `at` nearest to the vertex, also of a neighbouring sector.
    let add_face = |row: &mut [f64], sector: usize, [a, b]: [isize; 2], weight: f64| {
        for corner in [[a, b], [a + 1, b], [a, b + 1], [a + 1, b + 1]] {
            add(row, sector, corner, 0.25 * weight);
        }
    };
    let share = 1.0 / valence as f64;
    for sector in 0..valence {
        let row = rows.row_mut(0);
        add_face(row, sector, [0, 0], share * share);
        add(row, sector, [1, 0], share * share);
    }
    // 2 R / n with the midpoints of the edges, and (n − 3) / n.
    rows[(0, 0)] += share + (valence as f64 - 3.0) * share;
    for sector in 0..valence {
        for a in 1..=FINE as isize {
            for b in 0..=FINE as isize {
                let row = rows.row_mut(place(valence, sector, [a, b], FINE));
                let (i, j) = (a.div_euclid(2), b.div_euclid(2));
                match (a % 2, b % 2) {
                    (1, 1) => add_face(row, sector, [i, j], 1.0),
                    (1, _) => {
                        add(row, sector, [i, j], 0.25);
                        add(row, sector, [i + 1, j], 0.25);
                        add_face(row, sector, [i, j], 0.25);
                        add_face(row, sector, [i, j - 1], 0.25);
                    }
                    (_, 1) => {
                        add(row, sector, [i, j], 0.25);
                        add(row, sector, [i, j + 1], 0.25);
                        add_face(row, sector, [i, j], 0.25);
                        add_face(row, sector, [i - 1, j], 0.25);
                    }
                    _ => {
                        // A regular vertex: (Q + 2 R + v) / 4.
                        add(row, sector, [i, j], 0.5);
                        for [p, q] in [[1, 0], [-1, 0], [0, 1], [0, -1]] {
                            add(row, sector, [i + p, j + q], 0.0625);
                        }
                        for [p, q] in [[0, 0], [-1, 0], [0, -1], [-1, -1]] {
                            add_face(row, sector, [i + p, j + q], 0.0625);
                        }
                    }
                }
            }
        }
    }
    rows
}

/// Places of the points of reach [`COARSE`] in a net of reach [`FINE`].
pub(crate) fn inner(valence: usize) -> Vec<usize> {
    let mut places = vec![0; count(valence, COARSE)];
    for sector in 0..valence {
        for a in 1..=COARSE as isize {
            for b in 0..=COARSE as isize {
                let at = place(valence, sector, [a, b], COARSE);
                places[at] = place(valence, sector, [a, b], FINE);
            }
        }
    }
    places
}

/// The same net, sectors counted from another.
pub(crate) fn turned<T: Copy>(net: &[T], valence: usize, sector: usize) -> Vec<T> {
    let per_sector = (net.len() - 1) / valence;
    let mut out = net.to_vec();
    out[1..].rotate_left(sector * per_sector);
    out
}

/// Weights of the uniform cubic B-splines over a span, and their derivatives.
pub(crate) fn cubic(t: f64) -> [[f64; 4]; 2] {
    let s = 1.0 - t;
    [
        [
            s * s * s / 6.0,
            (3.0 * t * t * t - 6.0 * t * t + 4.0) / 6.0,
            (3.0 * s * s * s - 6.0 * s * s + 4.0) / 6.0,
            t * t * t / 6.0,
        ],
        [-0.5 * s * s, 1.5 * t * t - 2.0 * t, -1.5 * s * s + 2.0 * s, 0.5 * t * t],
    ]
}

/// The cell of a net of reach [`FINE`] that parameters in `[0, 2]²` outside of `[0, 1)²` lie in.
pub(crate) fn cell([x, y]: [f64; 2]) -> [isize; 2] {
    [x, y].map(|t| isize::from(t >= 1.0))
}

#[cfg(test)]
mod tests {
    use super::*;
    use geom_core::assert_close;
    use subdiv_catmull_clark::subdominant_eigenvalue;

    #[test]
    fn rows_sum_to_one_and_the_plane_of_the_chart_shrinks_by_the_eigenvalue() {
        for valence in [3, 5, 6, 9] {
            let rows = refinement(valence);
            for i in 0..rows.rows() {
                assert_close(rows.row(i).iter().sum::<f64>(), 1.0, 1e-14);
            }
            let chart = crate::chart::Chart::new(valence, &rows);
            assert_close(chart.ratio, subdominant_eigenvalue(valence), 1e-12);
        }
    }

    #[test]
    fn a_regular_net_is_refined_like_a_grid() {
        // Linear functions of a grid are kept by every cubic scheme.
        let rows = refinement(4);
        let turns = [[1.0, 0.0], [0.0, 1.0], [-1.0, 0.0], [0.0, -1.0]];
        let at = |sector: usize, a: isize, b: isize| {
            let ([x, y], [p, q]) = (turns[sector], turns[(sector + 1) % 4]);
            let (a, b) = (a as f64, b as f64);
            3.0 * (a * x + b * p) - 2.0 * (a * y + b * q) + 1.0
        };
        let mut coarse = vec![1.0; count(4, COARSE)];
        for sector in 0..4 {
            for (a, b) in [(1, 0), (2, 0), (1, 1), (1, 2), (2, 1), (2, 2)] {
                coarse[place(4, sector, [a, b], COARSE)] = at(sector, a, b);
            }
        }
        let fine = rows.apply(&coarse);
        for sector in 0..4 {
            for (a, b) in [(1, 0), (3, 0), (3, 3), (2, 1), (1, 2)] {
                let want = 0.5 * (at(sector, a, b) - 1.0) + 1.0;
                assert_close(fine[place(4, sector, [a, b], FINE)], want, 1e-13);
            }
        }
        // Sectors overlap in steps that are negative.
        assert_eq!(place(4, 1, [2, -1], FINE), place(4, 0, [1, 2], FINE));
        assert_eq!(place(4, 0, [-1, 2], FINE), place(4, 1, [2, 1], FINE));
    }
}
