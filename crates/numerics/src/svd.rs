//! Singular value decomposition and symmetric eigenvectors by Jacobi rotations.

use crate::vector::dot;

/// Right singular vectors of a matrix by one-sided Jacobi rotations: singular values in falling
/// order, each with its unit vector. Small ones come out with their full relative accuracy,
/// unlike those from `AᵀA`.
///
/// # Example
/// ```
/// // The second column is twice the first: (2, −1)/√5 is in the null space.
/// let all = numerics::right_singular_vectors(&[vec![1.0, 2.0], vec![3.0, 6.0]]);
/// assert!(all[1].0 < 1e-15);
/// assert!((all[1].1[0] + 2.0 * all[1].1[1]).abs() < 1e-15);
/// ```
#[must_use]
pub fn right_singular_vectors(rows: &[Vec<f64>]) -> Vec<(f64, Vec<f64>)> {
    let n = rows.first().map_or(0, Vec::len);
    let mut columns: Vec<Vec<f64>> =
        (0..n).map(|j| rows.iter().map(|row| row[j]).collect()).collect();
    let mut vectors: Vec<Vec<f64>> =
        (0..n).map(|j| (0..n).map(|i| f64::from(u8::from(i == j))).collect()).collect();
    for _ in 0..60 {
        let mut turned = false;
        for p in 0..n {
            for q in p + 1..n {
                let (a, b) = (dot(&columns[p], &columns[p]), dot(&columns[q], &columns[q]));
                let c = dot(&columns[p], &columns[q]);
                if !(c.abs() > 1e-15 * (a * b).sqrt()) {
                    continue;
                }
                turned = true;
                let zeta = (b - a) / (2.0 * c);
                let t = zeta.signum() / (zeta.abs() + zeta.hypot(1.0));
                let cos = 1.0 / t.hypot(1.0);
                let sin = cos * t;
                for list in [&mut columns, &mut vectors] {
                    let (left, right) = list.split_at_mut(q);
                    for (x, y) in left[p].iter_mut().zip(&mut right[0]) {
                        (*x, *y) = (cos * *x - sin * *y, sin * *x + cos * *y);
                    }
                }
            }
        }
        if !turned {
            break;
        }
    }
    let mut all: Vec<(f64, Vec<f64>)> =
        columns.iter().map(|c| dot(c, c).sqrt()).zip(vectors).collect();
    all.sort_by(|a, b| b.0.total_cmp(&a.0));
    all
}

/// Unit eigenvector of the smallest eigenvalue of a symmetric matrix, by two-sided Jacobi
/// rotations.
///
/// # Example
/// ```
/// // Eigenvalues 1, 3 and 5.
/// let v = numerics::smallest_eigenvector([[2.0, 1.0, 0.0], [1.0, 2.0, 0.0], [0.0, 0.0, 5.0]]);
/// assert!((v[0] + v[1]).abs() < 1e-15 && v[2] == 0.0);
/// ```
#[must_use]
pub fn smallest_eigenvector(mut a: [[f64; 3]; 3]) -> [f64; 3] {
    let mut vectors = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
    for _ in 0..30 {
        let off = a[0][1].abs() + a[0][2].abs() + a[1][2].abs();
        if off <= 1e-300 {
            break;
        }
        for (p, q) in [(0, 1), (0, 2), (1, 2)] {
            if a[p][q] == 0.0 {
                continue;
            }
            let theta = (a[q][q] - a[p][p]) / (2.0 * a[p][q]);
            let t = theta.signum() / (theta.abs() + (theta * theta + 1.0).sqrt());
            let c = 1.0 / (t * t + 1.0).sqrt();
            let s = t * c;
            for k in 0..3 {
                (a[k][p], a[k][q]) = (c * a[k][p] - s * a[k][q], s * a[k][p] + c * a[k][q]);
            }
            for k in 0..3 {
                (a[p][k], a[q][k]) = (c * a[p][k] - s * a[q][k], s * a[p][k] + c * a[q][k]);
            }
            let (v, w) = (vectors[p], vectors[q]);
            vectors[p] = std::array::from_fn(|k| v[k] * c - w[k] * s);
            vectors[q] = std::array::from_fn(|k| v[k] * s + w[k] * c);
        }
    }
    let smallest = (0..3).min_by(|&i, &j| a[i][i].total_cmp(&a[j][j])).unwrap_or(0);
    vectors[smallest]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn null_vector_of_a_rank_deficient_matrix() {
        // Third column is the sum of the first two.
        let rows: Vec<Vec<f64>> = (0..5)
            .map(|k| {
                let (a, b) = (f64::from(k), (1.3 * f64::from(k)).cos());
                vec![a, b, a + b]
            })
            .collect();
        let all = right_singular_vectors(&rows);
        assert!(all[2].0 < 1e-15 * all[0].0);
        let v = &all[2].1;
        assert!((v[0] - v[1]).abs() < 1e-14 && (v[0] + v[2]).abs() < 1e-14);
    }
}
