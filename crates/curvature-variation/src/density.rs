//! The energy of one surface sample and its derivative by the nine parameter derivatives.

use crate::lanes::{Lanes, Vec3, axpy, cross, dot, scaled};
use pulp::Simd;

/// Umbilic guard: `r²`, the squared half-difference of the principal curvatures, is replaced by
/// `r² + GUARD |II|²` where the principal directions enter. At an umbilic the energy is then the
/// mean over all directions.
pub(crate) const GUARD: f64 = 1e-6;

/// Coefficients of an energy density in the orthonormal tangent frame.
///
/// `mean (l+q)/2 + square (l²+q²) + product l q + twist m² + f1 F1² + f3 F3²
///  + coupling Re(Z1 Z3 e^{4iφ}) + root √(F1² + F3² + ε²)`
///
/// with the second fundamental form `l, m, q`, `Z1 = F1c − i F1s`, `Z3 = F3c − i F3s` and `φ` the
/// angle of the first principal direction.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Density {
    pub(crate) mean: f64,
    pub(crate) square: f64,
    pub(crate) product: f64,
    pub(crate) twist: f64,
    pub(crate) f1: f64,
    pub(crate) f3: f64,
    pub(crate) coupling: f64,
    pub(crate) root: f64,
    pub(crate) root_epsilon: f64,
    /// Of `|l q − m²|`, in energy passes only.
    pub(crate) absolute: f64,
    /// Of `1/J²`, `J` the area element: a barrier against parameter lines that run into one
    /// another, see `Level::set_barrier`.
    pub(crate) barrier: f64,
}

impl Density {
    pub(crate) fn is_zero(&self) -> bool {
        let Self {
            mean,
            square,
            product,
            twist,
            f1,
            f3,
            coupling,
            root,
            root_epsilon: _,
            absolute: _,
            barrier,
        } = *self;
        [mean, square, product, twist, f1, f3, coupling, root, barrier].iter().all(|&c| c == 0.0)
    }

    /// `self + factor · other`.
    pub(crate) fn plus(&self, factor: f64, other: &Self) -> Self {
        Self {
            mean: self.mean + factor * other.mean,
            square: self.square + factor * other.square,
            product: self.product + factor * other.product,
            twist: self.twist + factor * other.twist,
            f1: self.f1 + factor * other.f1,
            f3: self.f3 + factor * other.f3,
            coupling: self.coupling + factor * other.coupling,
            root: self.root + factor * other.root,
            root_epsilon: self.root_epsilon.max(other.root_epsilon),
            absolute: self.absolute + factor * other.absolute,
            barrier: self.barrier + factor * other.barrier,
        }
    }
}

/// The nine derivatives `S_u, S_v, S_uu, S_uv, S_vv, S_uuu, S_uuv, S_uvv, S_vvv` of some samples,
/// or the adjoints of all of them.
pub(crate) type Derivatives<S> = [Vec3<S>; 9];

/// Everything the densities and their adjoints share.
pub(crate) struct Shape<S: Simd> {
    e: Lanes<S>,
    f: Lanes<S>,
    pub(crate) area: Lanes<S>,
    pub(crate) inv_area: Lanes<S>,
    al: Lanes<S>,
    be: Lanes<S>,
    ga: Lanes<S>,
    pub(crate) n: Vec3<S>,
    e1: Vec3<S>,
    e2: Vec3<S>,
    h: [Lanes<S>; 4],
    p: [Lanes<S>; 3],
    x: [Lanes<S>; 3],
    y: [Lanes<S>; 3],
    xf: [Lanes<S>; 3],
    yf: [Lanes<S>; 3],
    /// Second fundamental form in the frame.
    pub(crate) second: [Lanes<S>; 3],
    /// `F1c, F1s, F3c, F3s`.
    pub(crate) harmonics: [Lanes<S>; 4],
}

/// Adjoints of the frame quantities a density depends on.
#[derive(Clone, Copy)]
pub(crate) struct FrameAdjoint<S: Simd> {
    pub(crate) harmonics: [Lanes<S>; 4],
    pub(crate) second: [Lanes<S>; 3],
    pub(crate) area: Lanes<S>,
}

impl<S: Simd> FrameAdjoint<S> {
    /// All adjoints times one factor.
    #[inline(always)]
    pub(crate) fn scaled(&self, factor: Lanes<S>) -> Self {
        let ([a, b, c, d], [l, m, q]) = (self.harmonics, self.second);
        Self {
            harmonics: [a * factor, b * factor, c * factor, d * factor],
            second: [l * factor, m * factor, q * factor],
            area: self.area * factor,
        }
    }
}

/// Quadratic form on `(u, v)` in the frame `e1 = al S_u`, `e2 = be S_u + ga S_v`.
#[inline(always)]
fn to_frame<S: Simd>(al: Lanes<S>, be: Lanes<S>, ga: Lanes<S>, r: &[Lanes<S>; 3]) -> [Lanes<S>; 3] {
    let first = be.fma(r[0], ga * r[1]);
    let second = be.fma(r[1], ga * r[2]);
    [al * al * r[0], al * first, be.fma(first, ga * second)]
}

/// Adjoint of [`to_frame`]: adjoints of `r`, and what is added to those of `al`, `be`, `ga`.
#[inline(always)]
fn to_frame_adjoint<S: Simd>(
    [al, be, ga]: [Lanes<S>; 3],
    r: &[Lanes<S>; 3],
    o: &[Lanes<S>; 3],
    sums: &mut [Lanes<S>; 3],
) -> [Lanes<S>; 3] {
    let first = be.fma(r[0], ga * r[1]);
    let second = be.fma(r[1], ga * r[2]);
    let twice = o[2] * 2.0;
    let (a0, a1) = (al * r[0], al * r[1]);
    sums[0] = sums[0] + (a0 * o[0]) * 2.0 + first * o[1];
    sums[1] = sums[1] + a0.fma(o[1], twice * first);
    sums[2] = sums[2] + a1.fma(o[1], twice * second);
    [
        (al * al).fma(o[0], (al * be).fma(o[1], be * be * o[2])),
        ga * al.fma(o[1], be * twice),
        ga * ga * o[2],
    ]
}

// Closures and the adaptors of arrays are compiled without the caller's instruction set and then
// not inlined, which makes every operation in them a call; the kernels spell such loops out.
impl<S: Simd> Shape<S> {
    #[inline(always)]
    pub(crate) fn new(d: &Derivatives<S>) -> Self {
        let normal = cross(&d[0], &d[1]);
        let area = dot(&normal, &normal).sqrt();
        let inv_area = area.recip();
        let (e, f) = (dot(&d[0], &d[0]), dot(&d[0], &d[1]));
        let length = e.sqrt();
        let al = length.recip();
        let ga = length * inv_area;
        let be = -(f * al * inv_area);
        let n = scaled(&normal, inv_area);
        let e1 = scaled(&d[0], al);
        let e2 = axpy(&d[0], be, &scaled(&d[1], ga));
        let h = [dot(&d[5], &n), dot(&d[6], &n), dot(&d[7], &n), dot(&d[8], &n)];
        let p = [dot(&d[2], &n), dot(&d[3], &n), dot(&d[4], &n)];
        let x = [dot(&d[2], &e1), dot(&d[3], &e1), dot(&d[4], &e1)];
        let y = [dot(&d[2], &e2), dot(&d[3], &e2), dot(&d[4], &e2)];
        let second = to_frame(al, be, ga, &p);
        let xf = to_frame(al, be, ga, &x);
        let yf = to_frame(al, be, ga, &y);
        let [l, m, q] = second;
        // C = D³S·n − the symmetrised II(tangential D²S, ·).
        let b1 = be.fma(h[0], ga * h[1]);
        let b2 = be.fma(h[1], ga * h[2]);
        let b3 = be.fma(h[2], ga * h[3]);
        let c1 = be.fma(b1, ga * b2);
        let c2 = be.fma(b2, ga * b3);
        let d1 = be.fma(c1, ga * c2);
        let a = al * al * al * h[0] - (xf[0].fma(l, yf[0] * m)) * 3.0;
        let b = al * al * b1 - (xf[1].fma(l, yf[1] * m)) * 2.0 - xf[0].fma(m, yf[0] * q);
        let c = al * c1 - (xf[1].fma(m, yf[1] * q)) * 2.0 - xf[2].fma(l, yf[2] * m);
        let d0 = d1 - (xf[2].fma(m, yf[2] * q)) * 3.0;
        let harmonics =
            [(a + c) * 0.75, (b + d0) * 0.75, (a - c * 3.0) * 0.25, (b * 3.0 - d0) * 0.25];
        Self { e, f, area, inv_area, al, be, ga, n, e1, e2, h, p, x, y, xf, yf, second, harmonics }
    }

    /// Pulls adjoints of the frame quantities back to the nine derivatives.
    #[inline(always)]
    pub(crate) fn pull_back(&self, d: &Derivatives<S>, g: &FrameAdjoint<S>) -> Derivatives<S> {
        let (al, be, ga) = (self.al, self.be, self.ga);
        let [l, m, q] = self.second;
        let (xf, yf, h) = (&self.xf, &self.yf, &self.h);
        let [g1c, g1s, g3c, g3s] = g.harmonics;
        let a = g1c * 0.75 + g3c * 0.25;
        let b = (g1s + g3s) * 0.75;
        let c = (g1c - g3c) * 0.75;
        let w = g1s * 0.75 - g3s * 0.25;
        let (a3, b2, c2, w3) = (a * 3.0, b * 2.0, c * 2.0, w * 3.0);
        let xb = [-(a3.fma(l, b * m)), -(b2.fma(l, c2 * m)), -(c.fma(l, w3 * m))];
        let yb = [-(a3.fma(m, b * q)), -(b2.fma(m, c2 * q)), -(c.fma(m, w3 * q))];
        let ob = [
            g.second[0] - a3.fma(xf[0], b2.fma(xf[1], c * xf[2])),
            g.second[1]
                - a3.fma(
                    yf[0],
                    b2.fma(yf[1], b.fma(xf[0], c2.fma(xf[1], c.fma(yf[2], w3 * xf[2])))),
                ),
            g.second[2] - b.fma(yf[0], c2.fma(yf[1], w3 * yf[2])),
        ];
        let (al2, be2, ga2) = (al * al, be * be, ga * ga);
        let hb = [
            al2.fma(al.fma(a, be * b), be2.fma(al * c, be2 * be * w)),
            ga * al2.fma(b, be * (al.fma(c2, be * w3))),
            ga2 * al.fma(c, be * w3),
            ga2 * ga * w,
        ];
        let t1 = be.fma(h[0], ga * h[1]);
        let t2 = be.fma(h[1], ga * h[2]);
        let t3 = be.fma(h[2], ga * h[3]);
        let s1 = be.fma(t1, ga * t2);
        let s2 = be.fma(t2, ga * t3);
        let mut frame = [
            al2.fma(h[0] * a3, al.fma(t1 * b2, s1 * c)),
            al2.fma(h[0] * b, al.fma(t1 * c2, s1 * w3)),
            al2.fma(h[1] * b, al.fma(t2 * c2, s2 * w3)),
        ];
        let pb = to_frame_adjoint([al, be, ga], &self.p, &ob, &mut frame);
        let xb = to_frame_adjoint([al, be, ga], &self.x, &xb, &mut frame);
        let yb = to_frame_adjoint([al, be, ga], &self.y, &yb, &mut frame);
        let [mut alb, mut beb, mut gab] = frame;
        let mut out = *d;
        let mut nb = scaled(&d[5], hb[0]);
        let mut e1b = scaled(&d[2], xb[0]);
        let mut e2b = scaled(&d[2], yb[0]);
        for k in 1..4 {
            nb = axpy(&d[5 + k], hb[k], &nb);
        }
        for k in 0..3 {
            nb = axpy(&d[2 + k], pb[k], &nb);
            if k > 0 {
                e1b = axpy(&d[2 + k], xb[k], &e1b);
                e2b = axpy(&d[2 + k], yb[k], &e2b);
            }
            out[2 + k] = axpy(&self.n, pb[k], &axpy(&self.e1, xb[k], &scaled(&self.e2, yb[k])));
        }
        for k in 0..4 {
            out[5 + k] = scaled(&self.n, hb[k]);
        }
        alb = alb + dot(&e1b, &d[0]);
        beb = beb + dot(&e2b, &d[0]);
        gab = gab + dot(&e2b, &d[1]);
        // al = E^(−1/2), ga = E^(1/2)/J, be = −F al/J.
        let fb = -(beb * al * self.inv_area);
        alb = alb - beb * self.f * self.inv_area;
        let mut inv_b = -(beb * self.f * al) + gab * (self.e * al);
        let eb2 = gab * self.inv_area * al - alb * al * al2;
        inv_b = inv_b + dot(&nb, &self.n) * self.area;
        let area_b = g.area - inv_b * self.inv_area * self.inv_area;
        let normal_b = axpy(&nb, self.inv_area, &scaled(&self.n, area_b));
        out[0] = axpy(
            &e1b,
            al,
            &axpy(&e2b, be, &axpy(&d[0], eb2, &axpy(&d[1], fb, &cross(&d[1], &normal_b)))),
        );
        out[1] = axpy(&e2b, ga, &axpy(&d[0], fb, &cross(&normal_b, &d[0])));
        out
    }

    /// The density times the area element, and the adjoints of that product.
    #[inline(always)]
    pub(crate) fn density(&self, w: &Density) -> (Lanes<S>, FrameAdjoint<S>) {
        let simd = self.area.0;
        let j = self.area;
        let [l, m, q] = self.second;
        let [f1c, f1s, f3c, f3s] = self.harmonics;
        let first = f1c.fma(f1c, f1s * f1s);
        let third = f3c.fma(f3c, f3s * f3s);
        let bending = l.fma(l, q * q);
        let twist = m * m;
        let mut e = bending * w.square
            + (l * q) * w.product
            + twist * w.twist
            + (l + q) * (0.5 * w.mean)
            + first * w.f1
            + third * w.f3;
        if w.absolute != 0.0 {
            e = e + (l * q - twist).abs() * w.absolute;
        }
        let mut k1 = Lanes::splat(simd, 2.0 * w.f1);
        let mut k3 = Lanes::splat(simd, 2.0 * w.f3);
        if w.root != 0.0 {
            let root = (first + third + Lanes::splat(simd, w.root_epsilon * w.root_epsilon)).sqrt();
            e = e + root * w.root;
            let slope = root.recip() * w.root;
            k1 = k1 + slope;
            k3 = k3 + slope;
        }
        let mut harmonics = [k1 * f1c, k1 * f1s, k3 * f3c, k3 * f3s];
        let mut lb = l * (2.0 * w.square) + q * w.product + Lanes::splat(simd, 0.5 * w.mean);
        let mut qb = q * (2.0 * w.square) + l * w.product + Lanes::splat(simd, 0.5 * w.mean);
        let mut mb = m * (2.0 * w.twist);
        if w.coupling != 0.0 {
            let half = (l - q) * 0.5;
            let cos = half.fma(half, -twist);
            let sin = half * m * 2.0;
            // The last summand keeps a flat point, where all vanishes, from dividing by zero.
            let size = half.fma(half, twist)
                + (bending + twist * 2.0) * GUARD
                + Lanes::splat(simd, 1e-200);
            let scale = size.recip() * w.coupling;
            let zr = f1c.fma(f3c, -(f1s * f3s));
            let zi = -(f1c.fma(f3s, f1s * f3c));
            let value = zr.fma(cos, -(zi * sin)) * scale;
            e = e + value;
            let (zrb, zib) = (scale * cos, -(scale * sin));
            let (cosb, sinb) = (scale * zr, -(scale * zi));
            let sizeb = -(value * size.recip());
            harmonics[0] = harmonics[0] + zrb * f3c - zib * f3s;
            harmonics[1] = harmonics[1] - zrb * f3s - zib * f3c;
            harmonics[2] = harmonics[2] + zrb * f1c - zib * f1s;
            harmonics[3] = harmonics[3] - zrb * f1s - zib * f1c;
            let halfb = (cosb * half + sinb * m + sizeb * half) * 2.0;
            let guard = sizeb * (2.0 * GUARD);
            lb = lb + halfb * 0.5 + guard * l;
            qb = qb - halfb * 0.5 + guard * q;
            mb = mb + (sinb * half - cosb * m + sizeb * m) * 2.0 + guard * m * 2.0;
        }
        let (mut value, mut area) = (e * j, e);
        if w.barrier != 0.0 {
            let barrier = self.inv_area * w.barrier;
            value = value + barrier;
            area = area - barrier * self.inv_area;
        }
        let adjoint = FrameAdjoint {
            harmonics: [harmonics[0] * j, harmonics[1] * j, harmonics[2] * j, harmonics[3] * j],
            second: [lb * j, mb * j, qb * j],
            area,
        };
        (value, adjoint)
    }

    /// Adjoints of the area element by `S_u` and `S_v`.
    #[inline(always)]
    pub(crate) fn area_adjoint(&self, d: &Derivatives<S>) -> [Vec3<S>; 2] {
        [cross(&d[1], &self.n), cross(&self.n, &d[0])]
    }
}
