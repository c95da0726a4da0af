//! Polynomial fields tangent to the surface along an asymptotic boundary curve.
//!
//! Along a curve without inflection the tangent plane is the osculating plane, and *all*
//! polynomial fields in it are `f D₀ + g D₁`, where `D₀`, `D₁` have the first differences of the
//! control polygon, without the last and without the first one, as coefficients: they are a
//! basis of the syzygies of `r′ × r″ = p²(p−1) D₀ × D₁`. At an inflection the cross product has
//! a zero that the fields need not share, so the basis is saturated: a combination that vanishes
//! there is divided by `t − t₀`. Along a line every field will do. Along a curve made from the
//! normals of the surface the fields are those orthogonal to them.
//!
//! The ansatz of Wang et al. 2019, Eq. 4.1, `x r′ + y (r′ × r″) × r′`, is kept for comparison.

use geom_core::DVec3;
use numerics::{Matrix, affine_space};

use crate::curve::bernstein::{
    binomial, cross, derivative, divide_by_root, elevate, eval, times_basis,
};
use crate::curve::bezier::BezierCurve;

/// A linear space of fields along one curve.
#[derive(Clone, Debug)]
pub(crate) struct FieldSpace {
    /// Basis; each has degree `n`, that is `n + 1` coefficients.
    pub(crate) fields: Vec<Vec<DVec3>>,
    /// A polynomial normal of the tangent planes, without zeros and up to sign; absent on a line,
    /// where the planes are not known beforehand.
    pub(crate) normal: Option<Vec<DVec3>>,
}

/// The tangent fields of degree `n` along a boundary curve, by what is known of its tangent planes.
pub(crate) fn tangent_fields(
    curve: &BezierCurve,
    line: bool,
    inflections: &[f64],
    ribbon: Option<&[DVec3; 4]>,
    n: usize,
) -> FieldSpace {
    match (curve.normals(), ribbon) {
        (Some(normals), _) => normal_fields(normals, n),
        (None, Some(ribbon)) if line => ribbon_fields(curve, ribbon, n),
        (None, None) if line => line_fields(n),
        _ => tangent_module(curve, inflections, n),
    }
}

/// All fields `T` of degree `n` with `N · T = 0`, for a polynomial normal `N`: the null space of
/// the products of their control points.
///
/// Tangents and twists at the corners read two control points at either end. The basis is chosen
/// so that a field is zero at one end at least: first those that are zero at both, then those of
/// the start, then those of the end.
fn normal_fields(normals: &[DVec3], n: usize) -> FieldSpace {
    let m = normals.len() - 1;
    let unknowns = 3 * (n + 1);
    // Rows of the products stand beside rows of ones, so they must not grow with the model.
    let size = normals.iter().map(|n| n.abs().max_element()).fold(0.0, f64::max);
    let size = if size > 0.0 { size } else { 1.0 };
    let mut products = vec![vec![0.0; unknowns]; n + m + 1];
    for k in 0..=n {
        for (i, normal) in normals.iter().enumerate() {
            let share = binomial(n, k) * binomial(m, i) / binomial(n + m, k + i);
            for (axis, c) in normal.to_array().into_iter().enumerate() {
                products[k + i][3 * k + axis] = share * (c / size);
            }
        }
    }
    let zero_at = |points: [usize; 2]| {
        points.into_iter().flat_map(|k| 3 * k..3 * k + 3).map(move |c| {
            let mut row = vec![0.0; unknowns];
            row[c] = 1.0;
            row
        })
    };
    let [start, end] = [[0, 1], [n - 1, n]];
    // The fields orthogonal to all rows, as rows.
    let orthogonal = |rows: Vec<Vec<f64>>| -> Vec<Vec<f64>> {
        let mut matrix = Matrix::zeros(rows.len(), unknowns);
        for (r, row) in rows.iter().enumerate() {
            matrix.row_mut(r).copy_from_slice(row);
        }
        let none = vec![0.0; rows.len()];
        let null = affine_space(&matrix, &none, &vec![1.0; unknowns], 1e-12).null;
        (0..null.cols()).map(|f| (0..unknowns).map(|k| null[(k, f)]).collect()).collect()
    };
    let product_rows = || products.iter().cloned();
    let inner = orthogonal(product_rows().chain(zero_at(start)).chain(zero_at(end)).collect());
    let beside = |other| {
        orthogonal(product_rows().chain(zero_at(other)).chain(inner.iter().cloned()).collect())
    };
    let (of_start, of_end) = (beside(end), beside(start));
    let at_end = inner.len() + of_start.len();
    let basis = [&inner[..], &of_start, &of_end].concat();
    let fields = basis
        .iter()
        .enumerate()
        .map(|(f, row)| {
            let mut field: Vec<DVec3> = row.chunks_exact(3).map(DVec3::from_slice).collect();
            // Zeros to the last bit: corners tell their fields by them.
            if f < inner.len() || f >= at_end {
                field[..2].fill(DVec3::ZERO);
            }
            if f < at_end {
                field[n - 1..].fill(DVec3::ZERO);
            }
            field
        })
        .collect();
    FieldSpace { fields, normal: Some(normals.to_vec()) }
}

/// All polynomial tangent fields of degree `n` along `curve`, whose inflections are given.
fn tangent_module(curve: &BezierCurve, inflections: &[f64], n: usize) -> FieldSpace {
    let differences: Vec<DVec3> = curve.offsets().windows(2).map(|w| w[1] - w[0]).collect();
    let last = differences.len() - 1;
    let mut basis = [differences[..last].to_vec(), differences[1..].to_vec()];
    for &t0 in inflections {
        saturate(&mut basis, t0);
    }
    let normal = cross(&basis[0], &basis[1]);
    let mut fields = Vec::new();
    for generator in &basis {
        let degree = n + 1 - generator.len();
        fields.extend((0..=degree).map(|j| times_basis(degree, j, generator)));
    }
    FieldSpace { fields, normal: Some(normal) }
}

/// Replaces the generator of higher degree by the quotient of the combination that vanishes at
/// `t0`, unless its share in that combination is negligible.
fn saturate(basis: &mut [Vec<DVec3>; 2], t0: f64) {
    let (u, v) = (eval(&basis[0], t0), eval(&basis[1], t0));
    // Eigenvector of the smaller eigenvalue of the Gram matrix of (u, v).
    let (a, b, c) = (u.dot(u), u.dot(v), v.dot(v));
    let angle = 0.5 * (2.0 * b).atan2(a - c) + std::f64::consts::FRAC_PI_2;
    let share = [angle.cos(), angle.sin()];
    let higher = if basis[0].len() == basis[1].len() {
        usize::from(share[1].abs() > share[0].abs())
    } else {
        usize::from(basis[1].len() > basis[0].len())
    };
    let size = share[higher].abs() * [a, c][higher].sqrt();
    let other = share[1 - higher].abs() * [a, c][1 - higher].sqrt();
    let replaced =
        if size > 1e-8 * other || size > 1e-8 * (a + c).sqrt() { higher } else { 1 - higher };
    let degree = basis[0].len().max(basis[1].len()) - 1;
    let combination: Vec<DVec3> = if share[1 - replaced].abs() < 1e-14 {
        basis[replaced].clone()
    } else {
        elevate(&basis[0], degree)
            .iter()
            .zip(elevate(&basis[1], degree))
            .map(|(x, y)| *x * share[0] + y * share[1])
            .collect()
    };
    basis[replaced] = divide_by_root(&combination, t0);
}

/// Every field of degree `n`: along a line the tangent plane is free.
fn line_fields(n: usize) -> FieldSpace {
    let mut fields = Vec::with_capacity(3 * (n + 1));
    for k in 0..=n {
        for axis in [DVec3::X, DVec3::Y, DVec3::Z] {
            let mut field = vec![DVec3::ZERO; n + 1];
            field[k] = axis;
            fields.push(field);
        }
    }
    FieldSpace { fields, normal: None }
}

/// The fields in the planes of a line and a direction field across it: `f e + g W`.
fn ribbon_fields(curve: &BezierCurve, ribbon: &[DVec3; 4], n: usize) -> FieldSpace {
    let points = curve.offsets();
    let along = points[points.len() - 1] - points[0];
    let mut fields: Vec<Vec<DVec3>> = (0..=n).map(|j| times_basis(n, j, &[along])).collect();
    fields.extend((0..=n - 3).map(|j| times_basis(n - 3, j, ribbon)));
    FieldSpace { fields, normal: Some(cross(&[along], ribbon)) }
}

/// The paper's own ansatz of degree `3p − 4`: `x` of degree `2p − 3`, `y` linear.
///
/// With `free_alphas` false the coefficients of `x` besides the two at each end are zero, as the
/// paper sets them "without loss of generality" after its Eq. 4.2.
pub(crate) fn paper_ansatz(curve: &BezierCurve, free_alphas: bool) -> FieldSpace {
    let p = curve.degree();
    let first = derivative(curve.offsets());
    let second = derivative(&first);
    // r′ × r″ written in degree 2p − 3 has true degree 2p − 4: take one degree off.
    let lifted = cross(&first, &second);
    let m = lifted.len() - 1;
    let mut reduced: Vec<DVec3> = Vec::with_capacity(m);
    for j in 0..m {
        let before = if j > 0 { reduced[j - 1] } else { DVec3::ZERO };
        reduced.push((lifted[j] - before * (j as f64 / m as f64)) * (m as f64 / (m - j) as f64));
    }
    let across = cross(&reduced, &first);
    let degree_x = 2 * p - 3;
    let mut fields: Vec<Vec<DVec3>> = (0..=degree_x)
        .filter(|j| free_alphas || *j < 2 || *j + 2 > degree_x)
        .map(|j| times_basis(degree_x, j, &first))
        .collect();
    fields.extend((0..2).map(|j| times_basis(1, j, &across)));
    FieldSpace { fields, normal: Some(reduced) }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn quintic() -> BezierCurve {
        BezierCurve::new(vec![
            DVec3::ZERO,
            DVec3::new(1.0, 0.1, 0.0),
            DVec3::new(2.0, 0.5, 0.1),
            DVec3::new(2.8, 1.1, 0.4),
            DVec3::new(3.3, 1.9, 1.0),
            DVec3::new(3.5, 2.8, 1.9),
        ])
    }

    fn in_osculating_planes(curve: &BezierCurve, space: &FieldSpace) -> f64 {
        let mut worst = 0.0_f64;
        // The parameters avoid the inflections of the test curves.
        for t in (0..=20).map(|i| f64::from(i) / 20.1) {
            let jet = curve.jet(t);
            let b = jet.first.cross(jet.second);
            for field in &space.fields {
                let value = eval(field, t);
                let size = field.iter().map(|c| c.length()).fold(0.0, f64::max);
                worst = worst.max((value.dot(b) / (size * b.length())).abs());
            }
        }
        worst
    }

    #[test]
    fn module_fields_lie_in_the_osculating_planes() {
        let curve = quintic();
        for n in [5, 7, 11] {
            let space = tangent_module(&curve, &[], n);
            assert_eq!(space.fields.len(), 2 * (n - 5 + 3));
            assert!(space.fields.iter().all(|f| f.len() == n + 1));
            assert!(in_osculating_planes(&curve, &space) < 1e-13);
        }
    }

    /// `2n + 2 − m` fields of degree `n` are orthogonal to a normal of degree `m`.
    #[test]
    fn fields_along_a_normal_are_orthogonal_to_it_independent_and_zero_at_one_end() {
        let normal = [
            DVec3::new(0.1, 0.0, 1.0),
            DVec3::new(0.3, -0.1, 1.1),
            DVec3::new(0.4, 0.2, 0.9),
            DVec3::new(0.8, 0.1, 1.2),
            DVec3::new(1.0, 0.3, 1.0),
        ];
        for n in [7, 9] {
            let space = normal_fields(&normal, n);
            assert_eq!(space.fields.len(), 2 * n + 2 - 4);
            for field in &space.fields {
                for t in (0..=10).map(|k| f64::from(k) / 10.0) {
                    assert!(eval(field, t).dot(eval(&normal, t)).abs() < 1e-14);
                }
                let zero = |k: usize| field[k] == DVec3::ZERO;
                assert!(zero(0) && zero(1) || zero(n - 1) && zero(n));
            }
            let mut gram = Matrix::zeros(space.fields.len(), space.fields.len());
            for (i, a) in space.fields.iter().enumerate() {
                for (j, b) in space.fields.iter().enumerate() {
                    gram[(i, j)] = a.iter().zip(b).map(|(a, b)| a.dot(*b)).sum();
                }
            }
            assert!(numerics::Cholesky::new(&gram, 1e-6).is_some());
        }
    }

    #[test]
    fn paper_fields_lie_in_the_osculating_planes_and_have_degree_eleven() {
        let space = paper_ansatz(&quintic(), true);
        assert_eq!(space.fields.len(), 10);
        assert!(space.fields.iter().all(|f| f.len() == 12));
        assert!(in_osculating_planes(&quintic(), &space) < 1e-12);
        assert_eq!(paper_ansatz(&quintic(), false).fields.len(), 6);
    }

    #[test]
    fn saturation_adds_one_field_per_inflection_and_keeps_the_normal_alive() {
        // x = t, y = (t − 0.3)³ (t − c), z = (t − 0.3)⁴ has r″(0.3) = 0.
        for roots in [vec![0.3], vec![0.3, 0.8]] {
            let curve = curve_with_inflections(&roots);
            let space = tangent_module(&curve, &roots, 7);
            assert_eq!(space.fields.len(), 10 + roots.len());
            assert!(in_osculating_planes(&curve, &space) < 1e-9);
            let normal = space.normal.unwrap();
            let usual = eval(&normal, 0.0).length().max(eval(&normal, 1.0).length());
            for t in &roots {
                assert!(eval(&normal, *t).length() > 0.02 * usual, "normal dies at {t}");
            }
        }
    }

    /// A quintic `(t, y(t), z(t))` with `y″ = z″ = 0` at the given parameters.
    fn curve_with_inflections(roots: &[f64]) -> BezierCurve {
        // y″ = Π (t − t_i), z″ = t Π (t − t_i); both integrated twice in the power basis.
        let mut w = vec![1.0];
        for r in roots {
            let mut next = vec![0.0; w.len() + 1];
            for (i, c) in w.iter().enumerate() {
                next[i] -= r * c;
                next[i + 1] += c;
            }
            w = next;
        }
        let integrate = |shift: usize| -> [f64; 6] {
            let mut out = [0.0; 6];
            for (i, c) in w.iter().enumerate() {
                let k = (i + shift + 2) as f64;
                out[i + shift + 2] = c / (k * (k - 1.0));
            }
            out
        };
        let (y, z) = (integrate(0), integrate(1));
        let x = [0.0, 1.0, 0.0, 0.0, 0.0, 0.0];
        // Power basis to Bernstein: b_j = Σ_i C(j,i)/C(5,i) a_i.
        let points = (0..6)
            .map(|j| {
                let f = |a: &[f64; 6]| {
                    (0..=j).map(|i| binomial(j, i) / binomial(5, i) * a[i]).sum::<f64>()
                };
                DVec3::new(f(&x), f(&y), f(&z))
            })
            .collect();
        BezierCurve::new(points)
    }
}
