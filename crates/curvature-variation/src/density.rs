//! The energy of one surface sample and its derivative by the nine parameter derivatives.

use numerics::{Lanes, Real, Triple};
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

    /// Whether a term depends on the second fundamental form alone.
    #[inline(always)]
    fn has_second_order(&self) -> bool {
        self.square != 0.0
            || self.product != 0.0
            || self.twist != 0.0
            || self.mean != 0.0
            || self.absolute != 0.0
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
pub(crate) type Derivatives<S> = [Triple<Lanes<S>>; 9];

/// Everything the densities and their adjoints share.
pub(crate) struct Shape<S: Simd> {
    pub(crate) area: Lanes<S>,
    pub(crate) inv_area: Lanes<S>,
    al: Lanes<S>,
    be: Lanes<S>,
    ga: Lanes<S>,
    /// `al², al be, al ga, be², 2 be ga, ga²`.
    products: [Lanes<S>; 6],
    pub(crate) n: Triple<Lanes<S>>,
    e1: Triple<Lanes<S>>,
    e2: Triple<Lanes<S>>,
    /// `D³S · n` in the frame.
    third: [Lanes<S>; 4],
    /// `D²S · e1` and `D²S · e2` in the frame.
    tangential: [[Lanes<S>; 3]; 2],
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

/// Quadratic form on `(u, v)` in the frame `e1 = al S_u`, `e2 = be S_u + ga S_v`, from the products
/// of `al`, `be` and `ga`.
#[inline(always)]
fn to_frame<S: Simd>(products: &[Lanes<S>; 6], r: &[Lanes<S>; 3]) -> [Lanes<S>; 3] {
    let [aa, ab, ag, bb, bg, gg] = *products;
    [aa * r[0], ab.fma(r[0], ag * r[1]), bb.fma(r[0], bg.fma(r[1], gg * r[2]))]
}

/// Adjoint of [`to_frame`].
#[inline(always)]
fn from_frame<S: Simd>(products: &[Lanes<S>; 6], o: &[Lanes<S>; 3]) -> [Lanes<S>; 3] {
    let [aa, ab, ag, bb, bg, gg] = *products;
    [aa.fma(o[0], ab.fma(o[1], bb * o[2])), ag.fma(o[1], bg * o[2]), gg * o[2]]
}

/// `Σ a_k b_k`.
#[inline(always)]
fn pair<S: Simd>(a: &[Lanes<S>; 3], b: &[Lanes<S>; 3], sum: Lanes<S>) -> Lanes<S> {
    a[0].fma(b[0], a[1].fma(b[1], a[2].fma(b[2], sum)))
}

// Closures and the adaptors of arrays are compiled without the caller's instruction set and then
// not inlined, which makes every operation in them a call; the kernels spell such loops out.
impl<S: Simd> Shape<S> {
    #[inline(always)]
    pub(crate) fn new(d: &Derivatives<S>) -> Self {
        let normal = d[0].cross_fused(d[1]);
        // Divided by the squares, which does not have to wait for the roots.
        let (e, f) = (d[0].dot(d[0]), d[0].dot(d[1]));
        let square = normal.dot(normal);
        let (area, length) = (square.sqrt(), e.sqrt());
        let (inv_area, al) = (area * square.recip(), length * e.recip());
        let ga = length * inv_area;
        let be = -(f * al * inv_area);
        let products = [al * al, al * be, al * ga, be * be, be * ga * 2.0, ga * ga];
        let n = normal.scale(inv_area);
        let e1 = d[0].scale(al);
        let e2 = d[1].scale(ga).plus(be, d[0]);
        let h = [d[5].dot(n), d[6].dot(n), d[7].dot(n), d[8].dot(n)];
        let p = [d[2].dot(n), d[3].dot(n), d[4].dot(n)];
        let x = [d[2].dot(e1), d[3].dot(e1), d[4].dot(e1)];
        let y = [d[2].dot(e2), d[3].dot(e2), d[4].dot(e2)];
        let second = to_frame(&products, &p);
        let xf = to_frame(&products, &x);
        let yf = to_frame(&products, &y);
        let [l, m, q] = second;
        let [aa, ab, ag, bb, bg, gg] = products;
        let along_u = bb.fma(h[0], bg.fma(h[1], gg * h[2]));
        let along_v = bb.fma(h[1], bg.fma(h[2], gg * h[3]));
        let third = [
            al * aa * h[0],
            al * ab.fma(h[0], ag * h[1]),
            al * along_u,
            be.fma(along_u, ga * along_v),
        ];
        // C = D³S·n − the symmetrised II(tangential D²S, ·).
        let a = xf[0].fma(l, yf[0] * m).fnma(3.0, third[0]);
        let b = xf[0].fma(m, yf[0] * q);
        let b = third[1] - xf[1].fma(l, yf[1] * m).fma_by(2.0, b);
        let c = xf[2].fma(l, yf[2] * m);
        let c = third[2] - xf[1].fma(m, yf[1] * q).fma_by(2.0, c);
        let d0 = xf[2].fma(m, yf[2] * q).fnma(3.0, third[3]);
        let (a4, d4) = (a * 0.25, d0 * 0.25);
        let harmonics = [(a + c) * 0.75, (b + d0) * 0.75, c.fnma(0.75, a4), b.fma_by(0.75, -d4)];
        let tangential = [xf, yf];
        Self {
            area,
            inv_area,
            al,
            be,
            ga,
            products,
            n,
            e1,
            e2,
            third,
            tangential,
            second,
            harmonics,
        }
    }

    /// Pulls adjoints of the frame quantities back to the nine derivatives.
    ///
    /// A change `(δS_u, δS_v)` is expressed in the frame: `w_ij = e_i · δ_j` and `ω_j = n · δ_j` with
    /// `δ_1 = al δS_u` and `δ_2 = be δS_u + ga δS_v`. To stay orthonormal the frame's coefficients
    /// change by `(al, 0; be, ga) ↦ (1 + M)(al, 0; be, ga)` with
    /// `M = −(w_11, 0; w_12 + w_21, w_22)`; beside that the frame turns about `n` by `w_21` and leaves
    /// the plane by `ω_1` and `ω_2`. So the adjoints of `w` and `ω` are sums over forms in the frame,
    /// and only `D³S · n` asks for another vector.
    #[inline(always)]
    pub(crate) fn pull_back(&self, d: &Derivatives<S>, g: &FrameAdjoint<S>) -> Derivatives<S> {
        let (al, be, ga) = (self.al, self.be, self.ga);
        let [aa, ab, ag, bb, bg, gg] = self.products;
        let [l, m, q] = self.second;
        let [x, y] = &self.tangential;
        let [g1c, g1s, g3c, g3s] = g.harmonics;
        let a = g1c.fma_by(0.75, g3c * 0.25);
        let b = (g1s + g3s) * 0.75;
        let c = (g1c - g3c) * 0.75;
        let w = g1s.fma_by(0.75, -(g3s * 0.25));
        let (a3, b2, c2, w3) = (a * 3.0, b + b, c + c, w * 3.0);
        // Of D³S·n, on (u, v); its normals' adjoint is the only one that needs vectors.
        let (along_u, along_v, b1) = (al.fma(c, be * w), ga * w, al * b);
        let hb = [
            (al * aa).fma(a, ab.fma(b1, bb * along_u)),
            ag.fma(b1, bg.fma(along_u, bb * along_v)),
            gg.fma(along_u, bg * along_v),
            gg * along_v,
        ];
        let mut nb = d[5].scale(hb[0]);
        for k in 1..4 {
            nb = nb.plus(hb[k], d[5 + k]);
        }
        // Of the forms in the frame; those of the tangential parts with the opposite sign.
        let xb = [a3.fma(l, b * m), b2.fma(l, c2 * m), c.fma(l, w3 * m)];
        let yb = [a3.fma(m, b * q), b2.fma(m, c2 * q), c.fma(m, w3 * q)];
        let ob = [
            g.second[0] - a3.fma(x[0], b2.fma(x[1], c * x[2])),
            g.second[1]
                - a3.fma(y[0], b2.fma(y[1], b.fma(x[0], c2.fma(x[1], c.fma(y[2], w3 * x[2]))))),
            g.second[2] - b.fma(y[0], c2.fma(y[1], w3 * y[2])),
        ];
        // M in every form.
        let t = &self.third;
        let across = x[1].fma(xb[1], y[1].fma(yb[1], -(m * ob[1])));
        let m11 = x[0].fma(xb[0], y[0].fma(yb[0], -(l * ob[0])));
        let m22 = x[2].fma(xb[2], y[2].fma(yb[2], -(q * ob[2])));
        let turned = x[1].fma(xb[2], y[1].fma(yb[2], -(m * ob[2])));
        let m21 = x[0].fma(xb[1], y[0].fma(yb[1], -(l * ob[1])));
        let m11 = m11.fma_by(2.0, across) - t[0].fma(a3, t[1].fma(b2, t[2] * c));
        let m22 = m22.fma_by(2.0, across) - t[1].fma(b, t[2].fma(c2, t[3] * w3));
        let m21 = turned.fma_by(2.0, m21) - t[0].fma(b, t[1].fma(c2, t[2] * w3));
        let stretch = self.area * g.area;
        let (w11, w22, w12) = (m11 + stretch, m22 + stretch, m21);
        let w21 = m21 + (pair(&yb, x, -(xb[0] * y[0])) - xb[1].fma(y[1], xb[2] * y[2]));
        let o1 = -pair(&xb, &self.second, pair(&ob, x, nb.dot(self.e1)));
        let o2 = -pair(&yb, &self.second, pair(&ob, y, nb.dot(self.e2)));
        let pb = from_frame(&self.products, &ob);
        let xb = from_frame(&self.products, &xb);
        let yb = from_frame(&self.products, &yb);
        let (n, e1, e2) = (self.n, self.e1, self.e2);
        let mut out = *d;
        for k in 0..3 {
            let (p, x, y) = (pb[k], -xb[k], -yb[k]);
            out[2 + k] = e2.scale(y).plus(x, e1).plus(p, n);
        }
        for k in 0..4 {
            out[5 + k] = n.scale(hb[k]);
        }
        let (u1, u2, un) = (al.fma(w11, be * w12), al.fma(w21, be * w22), al.fma(o1, be * o2));
        out[0] = n.scale(un).plus(u2, e2).plus(u1, e1);
        out[1] = n.scale(ga * o2).plus(ga * w22, e2).plus(ga * w12, e1);
        out
    }

    /// The density times the area element and `weight`, and the adjoints of that product.
    #[inline(always)]
    pub(crate) fn density(&self, w: &Density, weight: Lanes<S>) -> (Lanes<S>, FrameAdjoint<S>) {
        let simd = self.area.simd;
        let j = self.area * weight;
        let [l, m, q] = self.second;
        let [f1c, f1s, f3c, f3s] = self.harmonics;
        let first = f1c.fma(f1c, f1s * f1s);
        let third = f3c.fma(f3c, f3s * f3s);
        let mut e = first.fma_by(w.f1, third * w.f3);
        let mut k1 = j * (2.0 * w.f1);
        let mut k3 = j * (2.0 * w.f3);
        if w.root != 0.0 {
            let root = (first + third + Lanes::splat(simd, w.root_epsilon * w.root_epsilon)).sqrt();
            e = e + root * w.root;
            let slope = root.recip() * j * w.root;
            k1 = k1 + slope;
            k3 = k3 + slope;
        }
        let mut harmonics = [k1 * f1c, k1 * f1s, k3 * f3c, k3 * f3s];
        let mut second = [Lanes::splat(simd, 0.0); 3];
        if w.has_second_order() {
            let twist = m * m;
            e = e
                + l.fma(l, q * q) * w.square
                + (l * q) * w.product
                + twist * w.twist
                + (l + q) * (0.5 * w.mean);
            if w.absolute != 0.0 {
                e = e + (l * q - twist).abs() * w.absolute;
            }
            let mean = Lanes::splat(simd, 0.5 * w.mean);
            second = [
                (l * (2.0 * w.square) + q * w.product + mean) * j,
                m * (2.0 * w.twist) * j,
                (q * (2.0 * w.square) + l * w.product + mean) * j,
            ];
        }
        if w.coupling != 0.0 {
            let half = (l - q) * 0.5;
            let twist = m * m;
            let cos = half.fma(half, -twist);
            let sin = half * m * 2.0;
            // The last summand keeps a flat point, where all vanishes, from dividing by zero.
            let size = half.fma(half, twist)
                + (l.fma(l, q * q) + twist * 2.0) * GUARD
                + Lanes::splat(simd, 1e-200);
            let inverse = size.recip();
            let scale = inverse * w.coupling;
            let zr = f1c.fma(f3c, -(f1s * f3s));
            let zi = -(f1c.fma(f3s, f1s * f3c));
            let value = zr.fma(cos, -(zi * sin)) * scale;
            e = e + value;
            let scale = scale * j;
            let (zrb, zib) = (scale * cos, -(scale * sin));
            let (cosb, sinb) = (scale * zr, -(scale * zi));
            let sizeb = -(value * inverse * j);
            harmonics[0] = harmonics[0] + zrb * f3c - zib * f3s;
            harmonics[1] = harmonics[1] - zrb * f3s - zib * f3c;
            harmonics[2] = harmonics[2] + zrb * f1c - zib * f1s;
            harmonics[3] = harmonics[3] - zrb * f1s - zib * f1c;
            let halfb = (cosb * half + sinb * m + sizeb * half) * 2.0;
            let guard = sizeb * (2.0 * GUARD);
            second[0] = second[0] + halfb * 0.5 + guard * l;
            second[2] = second[2] - halfb * 0.5 + guard * q;
            second[1] = second[1] + (sinb * half - cosb * m + sizeb * m) * 2.0 + guard * m * 2.0;
        }
        let (mut value, mut area) = (e * j, e * weight);
        if w.barrier != 0.0 {
            let barrier = self.inv_area * weight * w.barrier;
            value = value + barrier;
            area = area - barrier * self.inv_area;
        }
        (value, FrameAdjoint { harmonics, second, area })
    }

    /// Adjoints by `S_u` and `S_v` of the area element times `weight`.
    #[inline(always)]
    pub(crate) fn area_adjoint(&self, weight: Lanes<S>) -> [Triple<Lanes<S>>; 2] {
        // The element grows with the part of δS_u and δS_v that lies in the tangent plane.
        let j = self.area * weight;
        let along = self.e2.scale(j * self.be);
        [along.plus(j * self.al, self.e1), self.e2.scale(j * self.ga)]
    }
}
