//! Lanes against single numbers, and vectors over both.

use numerics::{Dual, Lanes, Real, Triple};
use proptest::prelude::*;
use pulp::{Arch, Simd, WithSimd};

/// Most lanes of any instruction set.
const MOST: usize = 16;
/// Results per sample.
const RESULTS: usize = 10;

/// Every operation on registers of samples `a, b, c`.
struct Operations<'a> {
    samples: [&'a [f64; MOST]; 3],
    out: &'a mut [[f64; MOST]; RESULTS],
}

impl WithSimd for Operations<'_> {
    type Output = [f64; 2];

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) -> [f64; 2] {
        let mut sums = [0.0; 2];
        for at in (0..MOST).step_by(S::F64_LANES) {
            let load =
                |row: &[f64]| Lanes::new(simd, simd.partial_load_f64s(&row[at..at + S::F64_LANES]));
            let [a, b, c] = self.samples.map(|row| load(row));
            let dual = Dual { value: a, partials: [b, c] };
            let slopes = (dual * dual).sqrt().partials;
            let results = [
                a + b,
                a - b,
                a * b,
                a * 0.3,
                -a,
                a.abs(),
                b.recip(),
                b.sqrt(),
                a.fma(b, c),
                slopes[0] + slopes[1],
            ];
            for (row, result) in self.out.iter_mut().zip(results) {
                simd.partial_store_f64s(&mut row[at..at + S::F64_LANES], result.value);
            }
            sums[0] += a.sum();
            sums[1] += (a.fnma(2.0, b) - b.fma_by(-1.0, a.constant(1.0))).sum();
        }
        sums
    }
}

fn row(range: std::ops::Range<f64>) -> impl Strategy<Value = [f64; MOST]> {
    proptest::array::uniform16(range)
}

fn triple(v: [f64; 3]) -> Triple<f64> {
    Triple { x: v[0], y: v[1], z: v[2] }
}

proptest! {
    #[test]
    fn lanes_compute_what_single_numbers_do(a in row(-9.0..9.0), b in row(0.1..9.0), c in row(-9.0..9.0)) {
        let mut out = [[0.0; MOST]; RESULTS];
        let [sum, mixed] = Arch::new().dispatch(Operations { samples: [&a, &b, &c], out: &mut out });
        for k in 0..MOST {
            let (a, b, c) = (a[k], b[k], c[k]);
            let single = [a + b, a - b, a * b, a * 0.3, -a, a.abs(), 1.0 / b, b.sqrt()];
            for (got, want) in out.iter().zip(single) {
                prop_assert_eq!(got[k].to_bits(), want.to_bits());
            }
            // Fused or not, as the machine does.
            prop_assert!(out[8][k] == a.mul_add(b, c) || out[8][k] == a * b + c);
            // √(a²) = |a|.
            let slope = if a == 0.0 { out[9][k] } else { a.signum() * (b + c) };
            prop_assert!((out[9][k] - slope).abs() < 1e-14 * (1.0 + b + c.abs()));
        }
        prop_assert!((sum - a.iter().sum::<f64>()).abs() < 1e-13);
        let want: f64 = a.iter().zip(&b).map(|(a, b)| (b - 2.0 * a) - (1.0 - b)).sum();
        prop_assert!((mixed - want).abs() < 1e-12);
    }

    #[test]
    fn vector_products_are_orthogonal_and_obey_lagrange(
        a in proptest::array::uniform3(-2.0..2.0_f64),
        b in proptest::array::uniform3(-2.0..2.0_f64),
    ) {
        let (a, b) = (triple(a), triple(b));
        for n in [a.cross(b), a.cross_fused(b)] {
            prop_assert!(n.dot(a).abs() < 1e-14 && n.dot(b).abs() < 1e-14);
            let area = a.dot(a) * b.dot(b) - a.dot(b) * a.dot(b);
            prop_assert!((n.dot(n) - area).abs() < 1e-13);
        }
        prop_assert_eq!(a.cross(a), a.zero());
    }

    #[test]
    fn dual_vectors_carry_the_product_rule(
        a in proptest::array::uniform3(-2.0..2.0_f64),
        b in proptest::array::uniform3(-2.0..2.0_f64),
        da in proptest::array::uniform3(-2.0..2.0_f64),
        db in proptest::array::uniform3(-2.0..2.0_f64),
    ) {
        let (a, b, da, db) = (triple(a), triple(b), triple(da), triple(db));
        let (p, q) = (a.towards(da), b.towards(db));
        let got = p.cross(q).slope();
        let want = da.cross(b) + a.cross(db);
        for (got, want) in got.to_array().into_iter().zip(want.to_array()) {
            prop_assert!((got - want).abs() < 1e-14);
        }
        let scalar = p.plus(q.x, q).dot(p);
        let want = da.dot(a) * 2.0 + db.x * b.dot(a) + b.x * (db.dot(a) + b.dot(da));
        prop_assert!((scalar.partials[0] - want).abs() < 1e-13);
    }
}
