//! Mean and Gaussian curvature, isoline alignment and geodesic parallelism at one sample, with
//! exact gradients with respect to the derivative vectors of the surface.
//!
//! Derivative vectors stand in the order `s, s_u, s_v, s_uu, s_uv, s_vv, s_uuu, …`: derivative
//! `(a, b)` has index [`order_index`]. No derivative tensor is ever formed: every second-order
//! quantity is a Hessian–vector product, got by running the gradient on dual numbers.
//!
//! No closures here: one that is not inlined is compiled without the vector instructions of its
//! caller, and every operation in it becomes a call.

use numerics::{Dual, Real, Triple};

/// Number of derivative vectors up to first order, the position included.
pub(crate) const FIRST: usize = 3;
/// Number of derivative vectors up to second order, the position included.
pub(crate) const SECOND: usize = 6;
/// Number of derivative vectors up to third order, the position included.
pub(crate) const THIRD: usize = 10;
/// Number of derivative vectors up to fourth order, the position included.
pub(crate) const FOURTH: usize = 15;

/// Place of the derivative `∂^(a+b) s / ∂u^a ∂v^b` among the derivative vectors.
pub(crate) const fn order_index(a: usize, b: usize) -> usize {
    (a + b) * (a + b + 1) / 2 + b
}

/// The orders `(a, b)` in the order of the derivative vectors, up to the fourth.
pub(crate) const ORDERS: [(usize, usize); FOURTH] = {
    let mut orders = [(0, 0); FOURTH];
    let mut total = 0;
    while total <= 4 {
        let mut b = 0;
        while b <= total {
            orders[order_index(total - b, b)] = (total - b, b);
            b += 1;
        }
        total += 1;
    }
    orders
};

/// `s_u, s_v, s_uu, s_uv, s_vv`: all that curvature depends on.
pub(crate) type Second<T> = [Triple<T>; 5];

/// Mean and Gaussian curvature and their gradients.
#[derive(Clone, Copy)]
pub(crate) struct Curvature<T> {
    pub(crate) h: T,
    pub(crate) k: T,
    pub(crate) grad_h: Second<T>,
    pub(crate) grad_k: Second<T>,
}

/// The quantities both curvatures are made of.
struct Forms<T> {
    n: Triple<T>,
    e: T,
    f: T,
    g: T,
    /// `⟨s_uu, n⟩, ⟨s_uv, n⟩, ⟨s_vv, n⟩` with `n = s_u × s_v` not normalised.
    l: T,
    m: T,
    q: T,
    /// `1/Δ` with `Δ = ⟨n, n⟩`.
    inv: T,
}

#[inline(always)]
fn forms<T: Real>(p: &Second<T>) -> Forms<T> {
    let [a, b, c, d, w] = *p;
    let n = a.cross(b);
    Forms {
        n,
        e: a.dot(a),
        f: a.dot(b),
        g: b.dot(b),
        l: c.dot(n),
        m: d.dot(n),
        q: w.dot(n),
        inv: n.dot(n).recip(),
    }
}

/// Pulls the slopes with respect to `l, m, q, Δ` (and `E, F, G`) back to the derivative vectors.
#[inline(always)]
fn pull_back<T: Real>(p: &Second<T>, n: Triple<T>, lmq: [T; 3], delta: T) -> Second<T> {
    let [a, b, c, d, w] = *p;
    let [l, m, q] = lmq;
    let nb = n.scale(delta * 2.0).plus(l, c).plus(m, d).plus(q, w);
    [b.cross(nb), nb.cross(a), n.scale(l), n.scale(m), n.scale(q)]
}

/// `H = (l G − 2 m F + q E) / (2 Δ^1.5)` and its gradient.
#[inline(always)]
fn mean_with_gradient<T: Real>(p: &Second<T>) -> (T, Second<T>) {
    let Forms { n, e, f, g, l, m, q, inv } = forms(p);
    let factor = inv * inv.sqrt() * 0.5;
    let h = (l * g + q * e - m * f * 2.0) * factor;
    let lmq = [g * factor, -(f * factor) * 2.0, e * factor];
    let mut grad = pull_back(p, n, lmq, -(h * inv) * 1.5);
    let (fe, ff, fg) = (q * factor, -(m * factor) * 2.0, l * factor);
    grad[0] = grad[0].plus(fe * 2.0, p[0]).plus(ff, p[1]);
    grad[1] = grad[1].plus(fg * 2.0, p[1]).plus(ff, p[0]);
    (h, grad)
}

/// `K = (l q − m²) / Δ²` and its gradient.
#[inline(always)]
fn gauss_with_gradient<T: Real>(p: &Second<T>) -> (T, Second<T>) {
    let Forms { n, l, m, q, inv, .. } = forms(p);
    let inv2 = inv * inv;
    let k = (l * q - m * m) * inv2;
    let lmq = [q * inv2, -(m * inv2) * 2.0, l * inv2];
    (k, pull_back(p, n, lmq, -(k * inv) * 2.0))
}

/// Mean and Gaussian curvature with gradients.
#[inline(always)]
pub(crate) fn curvature<T: Real>(p: &Second<T>) -> Curvature<T> {
    let (h, grad_h) = mean_with_gradient(p);
    let (k, grad_k) = gauss_with_gradient(p);
    Curvature { h, k, grad_h, grad_k }
}

/// `s_u, …, s_vv` among the derivative vectors.
#[inline(always)]
pub(crate) fn second<T: Real, const N: usize>(d: &[Triple<T>; N]) -> Second<T> {
    [d[1], d[2], d[3], d[4], d[5]]
}

/// Their derivatives by `u`.
#[inline(always)]
fn second_u<T: Real, const N: usize>(d: &[Triple<T>; N]) -> Second<T> {
    [d[3], d[4], d[6], d[7], d[8]]
}

/// Their derivatives by `v`.
#[inline(always)]
fn second_v<T: Real, const N: usize>(d: &[Triple<T>; N]) -> Second<T> {
    [d[4], d[5], d[7], d[8], d[9]]
}

#[inline(always)]
fn inner<T: Real, const N: usize>(a: &[Triple<T>; N], b: &[Triple<T>; N]) -> T {
    let mut sum = a[0].dot(b[0]);
    for i in 1..N {
        sum = sum + a[i].dot(b[i]);
    }
    sum
}

/// `alpha · x + beta · y`, vector by vector.
#[inline(always)]
fn combine<T: Real, const N: usize>(
    alpha: T,
    x: &[Triple<T>; N],
    beta: T,
    y: &[Triple<T>; N],
) -> [Triple<T>; N] {
    let mut sum = *x;
    for i in 0..N {
        sum[i] = x[i].scale(alpha).plus(beta, y[i]);
    }
    sum
}

#[inline(always)]
fn dual_array<T: Real, const N: usize>(
    x: &[Triple<T>; N],
    direction: &[Triple<T>; N],
) -> [Triple<Dual<1, T>>; N] {
    let mut result = [x[0].towards(direction[0]); N];
    for i in 1..N {
        result[i] = x[i].towards(direction[i]);
    }
    result
}

/// Curvatures and their parameter derivatives at a sample.
#[derive(Clone, Copy, Debug)]
pub(crate) struct CurvatureJet<T> {
    pub(crate) h: T,
    pub(crate) k: T,
    pub(crate) h_u: T,
    pub(crate) h_v: T,
    pub(crate) k_u: T,
    pub(crate) k_v: T,
}

/// `H, K` and their exact first derivatives, from derivatives of the surface up to the third.
#[inline(always)]
pub(crate) fn curvature_jet<T: Real, const N: usize>(d: &[Triple<T>; N]) -> CurvatureJet<T> {
    let (p, pu, pv) = (second(d), second_u(d), second_v(d));
    let c = curvature(&p);
    CurvatureJet {
        h: c.h,
        k: c.k,
        h_u: inner(&c.grad_h, &pu),
        h_v: inner(&c.grad_h, &pv),
        k_u: inner(&c.grad_k, &pu),
        k_v: inner(&c.grad_k, &pv),
    }
}

/// `r = H_u K_v − H_v K_u` (Pellis et al. 2021, Eq. 5) and its gradient with respect to the ten
/// derivative vectors up to third order.
///
/// With `p` the five vectors curvature depends on and `p_u, p_v` their parameter derivatives,
/// `∂r/∂p = ∇²H (K_v p_u − K_u p_v) + ∇²K (H_u p_v − H_v p_u)`,
/// `∂r/∂p_u = K_v ∇H − H_v ∇K` and `∂r/∂p_v = H_u ∇K − K_u ∇H`.
#[inline(always)]
pub(crate) fn alignment<T: Real>(d: &[Triple<T>; THIRD]) -> (T, [Triple<T>; THIRD]) {
    let (p, pu, pv) = (second(d), second_u(d), second_v(d));
    let c = curvature(&p);
    let (h_u, h_v) = (inner(&c.grad_h, &pu), inner(&c.grad_h, &pv));
    let (k_u, k_v) = (inner(&c.grad_k, &pu), inner(&c.grad_k, &pv));
    let along_h = combine(k_v, &pu, -k_u, &pv);
    let along_k = combine(-h_v, &pu, h_u, &pv);
    let hess_h = mean_with_gradient(&dual_array(&p, &along_h)).1;
    let hess_k = gauss_with_gradient(&dual_array(&p, &along_k)).1;
    let by_u = combine(k_v, &c.grad_h, -h_v, &c.grad_k);
    let by_v = combine(h_u, &c.grad_k, -k_u, &c.grad_h);
    let mut grad = [d[0].zero(); THIRD];
    for i in 0..5 {
        grad[1 + i] = hess_h[i].slope() + hess_k[i].slope();
    }
    add_shifted(&mut grad, &by_u, &by_v);
    (h_u * k_v - h_v * k_u, grad)
}

/// Adds gradients with respect to `p_u` and `p_v` where those vectors stand.
#[inline(always)]
fn add_shifted<T: Real, const N: usize>(
    grad: &mut [Triple<T>; N],
    by_u: &Second<T>,
    by_v: &Second<T>,
) {
    for (slot, value) in [3, 4, 6, 7, 8].into_iter().zip(by_u) {
        grad[slot] = grad[slot] + *value;
    }
    for (slot, value) in [4, 5, 7, 8, 9].into_iter().zip(by_v) {
        grad[slot] = grad[slot] + *value;
    }
}

/// Which curvature the isolines belong to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Field {
    /// Mean curvature.
    Mean,
    /// Gaussian curvature.
    Gauss,
}

#[inline(always)]
fn field_with_gradient<T: Real>(field: Field, p: &Second<T>) -> (T, Second<T>) {
    match field {
        Field::Mean => mean_with_gradient(p),
        Field::Gauss => gauss_with_gradient(p),
    }
}

/// `ψ = |∇_s f|² = (G f_u² − 2 F f_u f_v + E f_v²) / Δ` and its gradient with respect to the nine
/// derivative vectors `s_u … s_vvv`.
///
/// The printed formula (Pellis et al. 2021, Sec. 3.2.1) has `E` and `G` exchanged and `√Δ`; this
/// is the form their Eq. 7 gives.
#[inline(always)]
fn gradient_norm<T: Real>(field: Field, d: &[Triple<T>; 9]) -> (T, [Triple<T>; 9]) {
    let p = [d[0], d[1], d[2], d[3], d[4]];
    let pu = [d[2], d[3], d[5], d[6], d[7]];
    let pv = [d[3], d[4], d[6], d[7], d[8]];
    let gradient = field_with_gradient(field, &p).1;
    let (fu, fv) = (inner(&gradient, &pu), inner(&gradient, &pv));
    let (e, f, g) = (p[0].dot(p[0]), p[0].dot(p[1]), p[1].dot(p[1]));
    let inv = (e * g - f * f).recip();
    let psi = (g * fu * fu - f * fu * fv * 2.0 + e * fv * fv) * inv;
    let alpha = (g * fu - f * fv) * inv * 2.0;
    let beta = (e * fv - f * fu) * inv * 2.0;
    let by_e = (fv * fv - psi * g) * inv;
    let by_f = (psi * f - fu * fv) * inv * 2.0;
    let by_g = (fu * fu - psi * e) * inv;
    let along = combine(alpha, &pu, beta, &pv);
    let hessian = field_with_gradient(field, &dual_array(&p, &along)).1;
    let mut grad = [d[0].zero(); 9];
    for i in 0..5 {
        grad[i] = hessian[i].slope();
    }
    grad[0] = grad[0].plus(by_e * 2.0, p[0]).plus(by_f, p[1]);
    grad[1] = grad[1].plus(by_g * 2.0, p[1]).plus(by_f, p[0]);
    for (slot, value) in [2, 3, 5, 6, 7].into_iter().zip(&gradient) {
        grad[slot] = grad[slot].plus(alpha, *value);
    }
    for (slot, value) in [3, 4, 6, 7, 8].into_iter().zip(&gradient) {
        grad[slot] = grad[slot].plus(beta, *value);
    }
    (psi, grad)
}

/// Parameter derivatives of a curvature `f` and of `ψ = |∇_s f|²` at a sample.
#[derive(Clone, Copy, Debug)]
pub(crate) struct ParallelJet<T> {
    pub(crate) f_u: T,
    pub(crate) f_v: T,
    pub(crate) psi_u: T,
    pub(crate) psi_v: T,
}

const UNSHIFTED: [usize; 9] = [1, 2, 3, 4, 5, 6, 7, 8, 9];
const SHIFT_U: [usize; 9] = [3, 4, 6, 7, 8, 10, 11, 12, 13];
const SHIFT_V: [usize; 9] = [4, 5, 7, 8, 9, 11, 12, 13, 14];

#[inline(always)]
fn pick<T: Real>(d: &[Triple<T>; FOURTH], places: [usize; 9]) -> [Triple<T>; 9] {
    let mut picked = [d[0]; 9];
    for i in 0..9 {
        picked[i] = d[places[i]];
    }
    picked
}

#[inline(always)]
fn parallel_parts<T: Real>(
    field: Field,
    d: &[Triple<T>; FOURTH],
) -> (ParallelJet<T>, [Triple<T>; 9], Second<T>) {
    let p = second(d);
    let gradient = field_with_gradient(field, &p).1;
    let (q, qu, qv) = (pick(d, UNSHIFTED), pick(d, SHIFT_U), pick(d, SHIFT_V));
    let grad_psi = gradient_norm(field, &q).1;
    let jet = ParallelJet {
        f_u: inner(&gradient, &second_u(d)),
        f_v: inner(&gradient, &second_v(d)),
        psi_u: inner(&grad_psi, &qu),
        psi_v: inner(&grad_psi, &qv),
    };
    (jet, grad_psi, gradient)
}

/// The jet whose residual is [`parallel`]'s.
#[inline(always)]
pub(crate) fn parallel_jet<T: Real>(field: Field, d: &[Triple<T>; FOURTH]) -> ParallelJet<T> {
    parallel_parts(field, d).0
}

/// `r = ψ_u f_v − ψ_v f_u` with `ψ = |∇_s f|²` (Pellis et al. 2021, Eq. 8): zero where the
/// isolines of `f` are geodesic parallels. With its gradient by the fifteen derivative vectors.
#[inline(always)]
pub(crate) fn parallel<T: Real>(field: Field, d: &[Triple<T>; FOURTH]) -> (T, [Triple<T>; FOURTH]) {
    let (jet, grad_psi, gradient) = parallel_parts(field, d);
    let ParallelJet { f_u, f_v, psi_u, psi_v } = jet;
    let p = second(d);
    let (q, qu, qv) = (pick(d, UNSHIFTED), pick(d, SHIFT_U), pick(d, SHIFT_V));
    let hess_psi = gradient_norm(field, &dual_array(&q, &combine(f_v, &qu, -f_u, &qv))).1;
    let along = combine(psi_u, &second_v(d), -psi_v, &second_u(d));
    let hess_f = field_with_gradient(field, &dual_array(&p, &along)).1;
    let mut grad = [d[0].zero(); FOURTH];
    for i in 0..9 {
        grad[1 + i] = hess_psi[i].slope();
    }
    for i in 0..5 {
        grad[1 + i] = grad[1 + i] + hess_f[i].slope();
    }
    for i in 0..9 {
        grad[SHIFT_U[i]] = grad[SHIFT_U[i]].plus(f_v, grad_psi[i]);
        grad[SHIFT_V[i]] = grad[SHIFT_V[i]].plus(-f_u, grad_psi[i]);
    }
    let (mut by_u, mut by_v) = (gradient, gradient);
    for i in 0..5 {
        by_u[i] = gradient[i].scale(-psi_v);
        by_v[i] = gradient[i].scale(psi_u);
    }
    add_shifted(&mut grad, &by_u, &by_v);
    (psi_u * f_v - psi_v * f_u, grad)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Deterministic numbers in [-1, 1].
    fn noise(seed: &mut u64) -> f64 {
        *seed = seed.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
        ((*seed >> 33) as f64) / f64::from(1u32 << 30) - 1.0
    }

    fn random<const N: usize>(seed: u64) -> [Triple<f64>; N] {
        let mut s = seed;
        let mut d: [Triple<f64>; N] = std::array::from_fn(|_| Triple {
            x: noise(&mut s),
            y: noise(&mut s),
            z: noise(&mut s),
        });
        // Keep the tangents well apart, so that differences are accurate.
        d[1].x += 2.0;
        d[2].y += 2.0;
        d
    }

    fn check<const N: usize>(
        d: &[Triple<f64>; N],
        grad: &[Triple<f64>; N],
        f: impl Fn(&[Triple<f64>; N]) -> f64,
    ) {
        let step = 1e-5;
        for i in 0..N {
            for axis in 0..3 {
                let bump = |s: f64| {
                    let mut e = *d;
                    match axis {
                        0 => e[i].x += s,
                        1 => e[i].y += s,
                        _ => e[i].z += s,
                    }
                    f(&e)
                };
                let got = [grad[i].x, grad[i].y, grad[i].z][axis];
                // Fourth-order central difference.
                let want = (8.0 * (bump(step) - bump(-step))
                    - (bump(2.0 * step) - bump(-2.0 * step)))
                    / (12.0 * step);
                assert!((got - want).abs() < 1e-7 * (1.0 + want.abs()), "{i} {axis}: {got} {want}");
            }
        }
    }

    #[test]
    fn orders_are_listed_where_the_index_says() {
        for (i, &(a, b)) in ORDERS.iter().enumerate() {
            assert_eq!(order_index(a, b), i);
        }
    }

    #[test]
    fn curvature_gradients_match_central_differences() {
        for seed in 1..6 {
            let d = random::<THIRD>(seed);
            let c = curvature(&second(&d));
            let wide = |g: Second<f64>| {
                let mut out = [d[0].zero(); THIRD];
                out[1..6].copy_from_slice(&g);
                out
            };
            check(&d, &wide(c.grad_h), |e| curvature(&second(e)).h);
            check(&d, &wide(c.grad_k), |e| curvature(&second(e)).k);
        }
    }

    #[test]
    fn alignment_gradient_matches_central_differences() {
        for seed in 1..6 {
            let d = random::<THIRD>(seed);
            let (r, grad) = alignment(&d);
            let residual = |e: &[Triple<f64>; THIRD]| {
                let j = curvature_jet(e);
                j.h_u * j.k_v - j.h_v * j.k_u
            };
            assert!((r - residual(&d)).abs() < 1e-12 * (1.0 + r.abs()));
            check(&d, &grad, residual);
        }
    }

    #[test]
    fn parallel_gradient_matches_central_differences() {
        for field in [Field::Mean, Field::Gauss] {
            for seed in 1..4 {
                let d = random::<FOURTH>(seed);
                let (r, grad) = parallel(field, &d);
                let residual = |e: &[Triple<f64>; FOURTH]| {
                    let j = parallel_jet(field, e);
                    j.psi_u * j.f_v - j.psi_v * j.f_u
                };
                assert!((r - residual(&d)).abs() < 1e-10 * (1.0 + r.abs()));
                check(&d, &grad, residual);
            }
        }
    }
}
