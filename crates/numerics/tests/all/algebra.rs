//! Decompositions against what defines them, on random matrices.

use numerics::{
    Cholesky, Matrix, add_normal_row, affine_space, cholesky, dot, factor_semidefinite,
    gauss_jordan, gauss_jordan_rows, householder, least_squares, lu_solve, minimize_quadratic,
    minimizers, norm, right_singular_vectors, smallest_eigenvector, solve_semidefinite,
};
use proptest::prelude::*;

fn entries(count: usize) -> impl Strategy<Value = Vec<f64>> {
    proptest::collection::vec(-1.0..1.0_f64, count)
}

/// `B Bᵀ + shift I` of the `n × n` matrix `B`.
fn definite(b: &[f64], n: usize, shift: f64) -> Matrix {
    let mut a = Matrix::zeros(n, n);
    for i in 0..n {
        for j in 0..n {
            a[(i, j)] = dot(&b[i * n..(i + 1) * n], &b[j * n..(j + 1) * n]);
        }
        a[(i, i)] += shift;
    }
    a
}

fn flat(a: &Matrix) -> Vec<f64> {
    (0..a.rows()).flat_map(|i| a.row(i).to_vec()).collect()
}

fn largest_difference(a: &[f64], b: &[f64]) -> f64 {
    assert_eq!(a.len(), b.len());
    a.iter().zip(b).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
}

proptest! {
    #[test]
    fn cholesky_factors_multiply_to_the_matrix(b in entries(36), shift in 0.0..2.0_f64) {
        let a = definite(&b, 6, 0.1);
        let lower = cholesky(&flat(&a), 6, shift, 1e-13).unwrap();
        for i in 0..6 {
            for j in 0..=i {
                let want = a[(i, j)] + if i == j { shift } else { 0.0 };
                prop_assert!((dot(lower.row(i), lower.row(j)) - want).abs() < 1e-14);
            }
            prop_assert!(lower.row(i)[i + 1..].iter().all(|&above| above == 0.0));
        }
    }

    #[test]
    fn scaled_cholesky_does_not_feel_units(b in entries(36), x in entries(6), exponents in proptest::collection::vec(-30..30_i32, 6)) {
        // Powers of two change no bit, so rows in millimetres and kilometres give the same factor.
        let a = definite(&b, 6, 0.1);
        let solution = Cholesky::new(&a, 1e-14).unwrap().solve(&x);
        let image = a.apply(&solution);
        prop_assert!(largest_difference(&image, &x) < 1e-11);
        let unit: Vec<f64> = exponents.iter().map(|&e| 2.0_f64.powi(e)).collect();
        let mut scaled = a.clone();
        for i in 0..6 {
            for j in 0..6 {
                scaled[(i, j)] *= unit[i] * unit[j];
            }
        }
        let right: Vec<f64> = x.iter().zip(&unit).map(|(x, u)| x * u).collect();
        let other = Cholesky::new(&scaled, 1e-14).unwrap().solve(&right);
        for i in 0..6 {
            prop_assert!((other[i] * unit[i] - solution[i]).abs() <= 1e-11 * (1.0 + solution[i].abs()));
        }
    }

    #[test]
    fn both_cholesky_orders_agree(b in entries(25), right in entries(5)) {
        let a = definite(&b, 5, 0.1);
        let mut rows: [[f64; 5]; 5] = std::array::from_fn(|i| std::array::from_fn(|j| a[(i, j)]));
        let mut x = right.clone();
        factor_semidefinite(&mut rows, 1e-14);
        solve_semidefinite(&rows, &mut x);
        let other = Cholesky::new(&a, 1e-14).unwrap().solve(&right);
        prop_assert!(largest_difference(&x, &other) < 1e-11);
        let lower = cholesky(&flat(&a), 5, 0.0, 1e-14).unwrap();
        for i in 0..5 {
            prop_assert!(largest_difference(&rows[i][..=i], &lower.row(i)[..=i]) < 1e-12);
        }
    }

    #[test]
    fn repeated_rows_are_skipped_and_the_system_still_solved(b in entries(16), x in entries(4)) {
        // The last two unknowns enter alike: A = P B Bᵀ Pᵀ with a repeated row.
        let small = definite(&b, 4, 0.1);
        let place = [0, 1, 2, 3, 3];
        let entry = |i: usize, j: usize| small[(place[i], place[j])];
        let mut rows: Vec<Vec<f64>> =
            (0..5).map(|i| (0..5).map(|j| entry(i, j)).collect()).collect();
        let image = small.apply(&x);
        let mut y: Vec<f64> = place.iter().map(|&p| image[p]).collect();
        factor_semidefinite(&mut rows, 1e-12);
        solve_semidefinite(&rows, &mut y);
        prop_assert_eq!(y[4], 0.0);
        prop_assert!(largest_difference(&y[..4], &x) < 1e-11);
    }

    #[test]
    fn normal_rows_give_the_least_squares_solution(a in entries(24), b in entries(8)) {
        let (mut rows, mut x) = (a.clone(), b.clone());
        prop_assume!(least_squares(&mut rows, 3, &mut x, 1).is_ok());
        let (mut normal, mut right) = ([[0.0; 3]; 3], [0.0; 3]);
        for (row, value) in a.as_chunks::<3>().0.iter().zip(&b) {
            add_normal_row(&mut normal, &mut right, row, *value);
        }
        factor_semidefinite(&mut normal, 1e-14);
        // The squared condition of the rows must leave digits to compare.
        prop_assume!((0..3).all(|i| (0.1..1e3).contains(&normal[i][i])));
        solve_semidefinite(&normal, &mut right);
        prop_assert!(largest_difference(&right, &x[..3]) < 1e-10);
    }

    #[test]
    fn least_squares_residuals_are_orthogonal_to_the_columns(
        a in entries(40), b in entries(20), zeros in proptest::collection::vec(any::<bool>(), 40),
    ) {
        let a: Vec<f64> = a.iter().zip(&zeros).map(|(a, z)| if *z { 0.0 } else { *a }).collect();
        let (mut rows, mut x) = (a.clone(), b.clone());
        prop_assume!(least_squares(&mut rows, 4, &mut x, 2).is_ok());
        let size = x[..8].iter().fold(1.0_f64, |m, x| m.max(x.abs()));
        for k in 0..2 {
            for j in 0..4 {
                let slope: f64 = (0..10)
                    .map(|i| {
                        let image: f64 = (0..4).map(|c| a[i * 4 + c] * x[c * 2 + k]).sum();
                        a[i * 4 + j] * (image - b[i * 2 + k])
                    })
                    .sum();
                prop_assert!(slope.abs() < 1e-13 * size);
            }
        }
    }

    #[test]
    fn householder_keeps_the_products_of_columns(a in entries(50)) {
        let mut triangle = a.clone();
        householder(&mut triangle, 5, 5);
        for p in 0..5 {
            for q in 0..5 {
                let want: f64 = (0..10).map(|i| a[i * 5 + p] * a[i * 5 + q]).sum();
                let got: f64 =
                    (0..=p.min(q)).map(|i| triangle[i * 5 + p] * triangle[i * 5 + q]).sum();
                prop_assert!((got - want).abs() < 1e-13);
            }
        }
    }

    #[test]
    fn minimizers_are_stationary(a in entries(60)) {
        let map = minimizers(&mut a.clone(), 6, 4);
        let size = map.iter().fold(1.0_f64, |m, x| m.max(x.abs()));
        prop_assume!(size < 1e4);
        for c in 0..2 {
            for j in 0..4 {
                let slope: f64 = (0..10)
                    .map(|i| {
                        let row = &a[i * 6..(i + 1) * 6];
                        let inner: f64 = (0..4).map(|k| row[k] * map[k * 2 + c]).sum();
                        row[j] * (inner + row[4 + c])
                    })
                    .sum();
                prop_assert!(slope.abs() < 1e-12 * size);
            }
        }
    }

    #[test]
    fn all_eliminations_solve_the_system(a in entries(16), x in entries(8)) {
        let system: [[f64; 4]; 4] = std::array::from_fn(|i| std::array::from_fn(|j| a[i * 4 + j]));
        let image = |i: usize, c: usize| -> f64 { (0..4).map(|j| system[i][j] * x[j * 2 + c]).sum() };
        let mut b: Vec<f64> = (0..8).map(|k| image(k / 2, k % 2)).collect();
        let mut columns: [[f64; 4]; 2] = std::array::from_fn(|c| std::array::from_fn(|i| image(i, c)));
        let mut rows: [[f64; 6]; 4] = std::array::from_fn(|i| {
            std::array::from_fn(|j| if j < 4 { system[i][j] } else { image(i, j - 4) })
        });
        let singular = right_singular_vectors(&system.map(Vec::from));
        let condition = singular[0].0 / singular[3].0;
        prop_assume!(condition < 1e4);
        prop_assert!(lu_solve(&mut a.clone(), &mut b, 4));
        gauss_jordan(&mut system.clone(), &mut columns);
        gauss_jordan_rows(&mut rows);
        for k in 0..4 {
            for c in 0..2 {
                for got in [b[k * 2 + c], columns[c][k], rows[k][4 + c]] {
                    prop_assert!((got - x[k * 2 + c]).abs() < 1e-13 * condition);
                }
            }
        }
    }

    #[test]
    fn affine_spaces_hold_exactly_the_solutions(c in entries(18), x in entries(6), mix in entries(3)) {
        // The fourth equation follows from the first three.
        let mut system = Matrix::zeros(4, 6);
        for i in 0..3 {
            system.row_mut(i).copy_from_slice(&c[i * 6..(i + 1) * 6]);
            for j in 0..6 {
                system[(3, j)] += mix[i] * c[i * 6 + j];
            }
        }
        let singular = right_singular_vectors(&(0..3).map(|i| system.row(i).to_vec()).collect::<Vec<_>>());
        prop_assume!(singular[2].0 > 1e-2);
        let b = system.apply(&x);
        let space = affine_space(&system, &b, &[1.0; 6], 1e-9);
        prop_assert_eq!(space.null.cols(), 3);
        prop_assert!(space.residual < 1e-12);
        let gram = space.null.transpose_product(&space.null);
        prop_assert!(largest_difference(&flat(&gram), &flat(&Matrix::identity(3))) < 1e-14);
        prop_assert!(flat(&system.product(&space.null)).iter().all(|v| v.abs() < 1e-13));
        // Least length: no part along the null space; and x is the particular one plus such a part.
        let along = space.null.apply_transpose(&space.particular);
        prop_assert!(norm(&along) < 1e-12);
        let shift: Vec<f64> = x.iter().zip(&space.particular).map(|(x, p)| x - p).collect();
        let back = space.null.apply(&space.null.apply_transpose(&shift));
        prop_assert!(largest_difference(&back, &shift) < 1e-11);
    }

    #[test]
    fn singular_vectors_are_orthonormal_and_stretched_by_their_values(a in entries(28)) {
        let rows: Vec<Vec<f64>> = a.chunks(4).map(<[f64]>::to_vec).collect();
        let all = right_singular_vectors(&rows);
        let squares: f64 = all.iter().map(|(s, _)| s * s).sum();
        prop_assert!((squares - dot(&a, &a)).abs() < 1e-13);
        prop_assert!(all.windows(2).all(|pair| pair[0].0 >= pair[1].0));
        for (i, (s, v)) in all.iter().enumerate() {
            let image: Vec<f64> = rows.iter().map(|row| dot(row, v)).collect();
            prop_assert!((norm(&image) - s).abs() < 1e-14);
            for (j, (_, w)) in all.iter().enumerate() {
                prop_assert!((dot(v, w) - f64::from(u8::from(i == j))).abs() < 1e-14);
            }
        }
    }

    #[test]
    fn no_direction_is_below_the_smallest_eigenvector(b in entries(9), direction in entries(3)) {
        let a = definite(&b, 3, 0.0);
        let v = smallest_eigenvector(std::array::from_fn(|i| std::array::from_fn(|j| a[(i, j)])));
        let image = a.apply(&v);
        let value = dot(&image, &v);
        prop_assert!((norm(&v) - 1.0).abs() < 1e-14);
        for i in 0..3 {
            prop_assert!((image[i] - value * v[i]).abs() < 1e-14);
        }
        let quotient = dot(&a.apply(&direction), &direction) / dot(&direction, &direction);
        prop_assert!(!(quotient < value - 1e-14));
    }

    #[test]
    fn quadratic_minima_are_stationary_even_on_singular_hessians(b in entries(36), x in entries(6), dead in 0..6_usize) {
        let mut b = b;
        b[dead * 6..(dead + 1) * 6].fill(0.0);
        // Positive semidefinite with an empty row; the right-hand side is in its range.
        let hessian = definite(&b, 6, 0.0);
        let gradient = hessian.apply(&x);
        let found = minimize_quadratic(&hessian, &gradient);
        let left: Vec<f64> =
            hessian.apply(&found).iter().zip(&gradient).map(|(a, b)| a + b).collect();
        prop_assert!(norm(&left) < 1e-7, "{left:?}");
    }

    #[test]
    fn products_of_matrices_associate(a in entries(12), b in entries(20), x in entries(4)) {
        let mut left = Matrix::zeros(5, 3);
        let mut right = Matrix::zeros(5, 4);
        (0..5).for_each(|i| right.row_mut(i).copy_from_slice(&b[i * 4..(i + 1) * 4]));
        (0..4).for_each(|i| left.row_mut(i).copy_from_slice(&a[i * 3..(i + 1) * 3]));
        let once = left.transpose_product(&right).apply(&x);
        let twice = left.apply_transpose(&right.apply(&x));
        prop_assert!(largest_difference(&once, &twice) < 1e-14);
    }
}

#[test]
fn a_pivot_that_is_not_positive_is_named() {
    let error = cholesky(&[1.0, 0.0, 0.0, -1.0], 2, 0.0, 0.0).unwrap_err();
    assert_eq!(
        error.to_string(),
        "the matrix is not positive definite at row 1; add a shift or drop dependent unknowns"
    );
    assert_eq!(cholesky(&[f64::NAN], 1, 0.0, 0.0).unwrap_err().row, 0);
}
