//! Dense matrices of a few rows.

/// Determinant of a 4 × 4 matrix.
pub(crate) fn determinant4(m: [[f64; 4]; 4]) -> f64 {
    let glam = glam::DMat4::from_cols_array_2d(&m);
    glam.determinant()
}

/// Inverse of a 4 × 4 matrix, `None` if it is singular to rounding.
pub(crate) fn inverse4(m: [[f64; 4]; 4]) -> Option<[[f64; 4]; 4]> {
    let inverse = glam::DMat4::from_cols_array_2d(&m).inverse();
    inverse.is_finite().then(|| inverse.to_cols_array_2d())
}

/// Right singular vectors of a matrix by one-sided Jacobi rotations: singular values in falling
/// order, each with its unit vector. Small ones come out with their full relative accuracy,
/// unlike those from `AᵀA`.
pub(crate) fn right_singular_vectors(rows: &[Vec<f64>]) -> Vec<(f64, Vec<f64>)> {
    let n = rows.first().map_or(0, Vec::len);
    let mut columns: Vec<Vec<f64>> =
        (0..n).map(|j| rows.iter().map(|row| row[j]).collect()).collect();
    let mut vectors: Vec<Vec<f64>> =
        (0..n).map(|j| (0..n).map(|i| f64::from(u8::from(i == j))).collect()).collect();
    let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(x, y)| x * y).sum::<f64>();
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

    #[test]
    fn inverse_and_determinant() {
        let m = [
            [2.0, 0.0, 0.0, 1.0],
            [0.0, 1.0, 0.0, 0.0],
            [0.0, 0.0, 3.0, 0.0],
            [1.0, 0.0, 0.0, 1.0],
        ];
        assert!((determinant4(m) - 3.0).abs() < 1e-14);
        let i = inverse4(m).unwrap();
        for a in 0..4 {
            for b in 0..4 {
                let sum: f64 = (0..4).map(|k| m[a][k] * i[k][b]).sum();
                assert!((sum - f64::from(u8::from(a == b))).abs() < 1e-14);
            }
        }
        assert!(inverse4([[0.0; 4]; 4]).is_none());
    }
}
