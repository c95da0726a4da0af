//! Boundary curves given by the normals of the surface along them.
//!
//! Lelieuvre's formula: along the asymptotic curves of one family `r′ = N × N′`, along those of
//! the other `r′ = −N × N′`, with the normal `N` of length `|K|^(−1/4) = |τ|^(−1/2)`. A polynomial
//! `N` of degree four gives curves of degree seven whose osculating planes are orthogonal to `N`
//! everywhere, wherever their curvature changes sign: `r′ × r″ = N det(N, N′, N″)`. So nothing
//! special happens at an inflection, at a vertex on one, or on a straight line.

use geom_core::DVec3;

use crate::curve::bezier::BezierCurve;

/// Degree of the normals, and of the curves they make.
const NORMAL_DEGREE: usize = 4;
pub(crate) const CURVE_DEGREE: usize = 2 * NORMAL_DEGREE - 1;

/// Unknowns of a curve: per end the normal (logarithm of its length, two tilts), per end the
/// tangent and the growth of the normal along it, and the middle control point of the normal.
pub(crate) const COLUMNS: usize = 15;
/// The first unknown of the line at an end.
pub(crate) const LINE: [usize; 2] = [6, 9];
/// The first unknown of its own.
pub(crate) const OWN: usize = 12;

/// Rows of [`NormalCurve::fairness`].
pub(crate) const FAIR_ROWS: usize = 18;

/// Weight of the third differences of the normals, in their length, against the fourth differences
/// of the control points, in chords.
const NORMAL_FAIRNESS: f64 = 0.1;

/// What is known of the surface at an end of a curve.
#[derive(Clone, Copy, Debug)]
pub(crate) struct CurveEnd {
    /// Orthonormal; the first vector is the normal that tilts of zero stand for.
    pub(crate) frame: [DVec3; 3],
    /// Length of the normal that its unknown stands for when zero.
    pub(crate) length: f64,
    /// `r′` is this times the tangent, which is an unknown.
    pub(crate) speed: f64,
    /// The same in units of the net, so that the growth of the normal has none.
    pub(crate) relative_speed: f64,
}

/// The data of one curve, measured from its start.
#[derive(Clone, Copy, Debug)]
pub(crate) struct NormalCurve {
    pub(crate) chord: DVec3,
    pub(crate) ends: [CurveEnd; 2],
    /// `+1` where `r′ = N × N′`, `−1` where `r′ = −N × N′`.
    pub(crate) sign: f64,
    /// Whether it has to be straight.
    pub(crate) line: bool,
    /// Orthonormal axes of its own unknowns: turning the net turns the result and nothing else.
    axes: [DVec3; 3],
}

/// Control points of the normal and of `r′`.
#[derive(Clone, Copy)]
struct Polygons {
    normal: [DVec3; NORMAL_DEGREE + 1],
    velocity: [DVec3; CURVE_DEGREE],
}

/// `(i, j, k, c)`: the product `Nᵢ × Nⱼ` has the share `c` in the `k`-th control point of
/// `N × N′`: `BᵢBⱼ′ − BⱼBᵢ′ = (j − i) C(m,i) C(m,j) / C(2m−2, i+j−1) · B_{i+j−1}`.
const PRODUCTS: [(usize, usize, usize, f64); 10] = [
    (0, 1, 0, 4.0),
    (0, 2, 1, 2.0),
    (0, 3, 2, 0.8),
    (1, 2, 2, 1.6),
    (0, 4, 3, 0.2),
    (1, 3, 3, 1.6),
    (1, 4, 4, 0.8),
    (2, 3, 4, 1.6),
    (2, 4, 5, 2.0),
    (3, 4, 6, 4.0),
];

impl NormalCurve {
    pub(crate) fn new(chord: DVec3, ends: [CurveEnd; 2], sign: f64, line: bool) -> Self {
        let along = chord.normalize();
        let normal = ends[0].frame[0] + ends[1].frame[0];
        let up = (normal - along * normal.dot(along)).try_normalize();
        let up = up.unwrap_or_else(|| along.any_orthonormal_vector());
        Self { chord, ends, sign, line, axes: [along, up, along.cross(up)] }
    }

    /// Mean of the lengths of the normals at the ends.
    pub(crate) fn length(&self) -> f64 {
        0.5 * (self.ends[0].length + self.ends[1].length)
    }

    /// The middle control point for which the normals have no fourth difference.
    pub(crate) fn start(&self, x: &mut [f64; COLUMNS]) {
        let n = self.polygons(x).normal;
        let middle = ((n[1] + n[3]) * 4.0 - n[0] - n[4]) / 6.0;
        x[OWN..].copy_from_slice(&self.axes.map(|axis| middle.dot(axis)));
    }

    /// Control points of the normal, and of their derivatives by the unknowns where `slopes` wants
    /// them.
    fn normal(
        &self,
        x: &[f64; COLUMNS],
        mut slopes: Option<&mut [Polygons; COLUMNS]>,
    ) -> [DVec3; NORMAL_DEGREE + 1] {
        let mut points = [DVec3::ZERO; NORMAL_DEGREE + 1];
        for (e, end) in self.ends.iter().enumerate() {
            let (outer, inner) = if e == 0 { (0, 1) } else { (4, 3) };
            let [up, right, left] = end.frame;
            let [tilt_x, tilt_y] = [x[3 * e + 1], x[3 * e + 2]];
            let [tangent_x, tangent_y, growth] = [0, 1, 2].map(|k| x[LINE[e] + k]);
            let tilted = up + right * tilt_x + left * tilt_y;
            let stretch = tilted.length().recip();
            let unit = tilted * stretch;
            let length = end.length * x[3 * e].exp();
            // Orthogonal to the normal whatever the unknowns.
            let basis = [right - up * tilt_x, left - up * tilt_y].map(|b| b * end.speed);
            let velocity = basis[0] * tangent_x + basis[1] * tangent_y;
            // N₁ − N₀ turns the tangent plane about the tangent: 4 N₀ × (N₁ − N₀) = ± r′.
            let factor = [0.25, -0.25][e] * self.sign / length;
            let turn = velocity.cross(unit) * factor;
            let grow = [0.25, -0.25][e] * end.relative_speed * end.length;
            let growth = grow * growth;
            points[outer] = unit * length;
            points[inner] = unit * (length + growth) + turn;
            let Some(slopes) = slopes.as_deref_mut() else { continue };
            slopes[3 * e].normal[outer] = unit * length;
            slopes[3 * e].normal[inner] = unit * length - turn;
            for (k, (axis, tangent)) in
                [(right, tangent_x), (left, tangent_y)].into_iter().enumerate()
            {
                let unit_slope = (axis - unit * unit.dot(axis)) * stretch;
                let velocity_slope = up * (-end.speed * tangent);
                let turned = velocity_slope.cross(unit) + velocity.cross(unit_slope);
                let column = &mut slopes[3 * e + 1 + k].normal;
                column[outer] = unit_slope * length;
                column[inner] = unit_slope * (length + growth) + turned * factor;
                slopes[LINE[e] + k].normal[inner] = basis[k].cross(unit) * factor;
            }
            slopes[LINE[e] + 2].normal[inner] = unit * grow;
        }
        let [along, up, across] = self.axes;
        points[2] = along * x[OWN] + up * x[OWN + 1] + across * x[OWN + 2];
        if let Some(slopes) = slopes {
            for (k, axis) in self.axes.into_iter().enumerate() {
                slopes[OWN + k].normal[2] = axis;
            }
        }
        points
    }

    fn polygons(&self, x: &[f64; COLUMNS]) -> Polygons {
        let normal = self.normal(x, None);
        let mut velocity = [DVec3::ZERO; CURVE_DEGREE];
        for (i, j, k, share) in PRODUCTS {
            velocity[k] += normal[i].cross(normal[j]) * (self.sign * share);
        }
        Polygons { normal, velocity }
    }

    fn polygons_and_slopes(&self, x: &[f64; COLUMNS]) -> (Polygons, [Polygons; COLUMNS]) {
        let none = Polygons { normal: Default::default(), velocity: Default::default() };
        let mut slopes = [none; COLUMNS];
        let n = self.normal(x, Some(&mut slopes));
        for slope in &mut slopes {
            let by = slope.normal;
            for (i, j, k, share) in PRODUCTS {
                slope.velocity[k] += (by[i].cross(n[j]) + n[i].cross(by[j])) * (self.sign * share);
            }
        }
        (self.polygons(x), slopes)
    }

    /// Applies `rows`, which is linear in the polygons but for constants times its last
    /// argument but one, to the curve and to its derivatives.
    fn evaluate(
        &self,
        x: &[f64; COLUMNS],
        out: &mut [f64],
        jacobian: Option<&mut [f64]>,
        rows: impl Fn(&Polygons, f64, &mut dyn FnMut(f64)),
    ) {
        let fill = |polygons: &Polygons, one: f64, put: &mut dyn FnMut(usize, f64)| {
            let mut row = 0;
            rows(polygons, one, &mut |value| {
                put(row, value);
                row += 1;
            });
        };
        let Some(jacobian) = jacobian else {
            return fill(&self.polygons(x), 1.0, &mut |row, value| out[row] = value);
        };
        let (polygons, slopes) = self.polygons_and_slopes(x);
        fill(&polygons, 1.0, &mut |row, value| out[row] = value);
        for (c, slope) in slopes.iter().enumerate() {
            fill(slope, 0.0, &mut |row, value| jacobian[row * COLUMNS + c] = value);
        }
    }

    /// Fourth differences of the control points and third differences of the normal.
    pub(crate) fn fairness(
        &self,
        x: &[f64; COLUMNS],
        out: &mut [f64],
        jacobian: Option<&mut [f64]>,
    ) {
        let size = self.chord.length();
        let length = self.length();
        self.evaluate(x, out, jacobian, |p, _, put| {
            for d in p.velocity.windows(4) {
                let third = d[3] - (d[2] - d[1]) * 3.0 - d[0];
                put_vector(third / (CURVE_DEGREE as f64 * size), put);
            }
            for d in p.normal.windows(4) {
                let third = d[3] - (d[2] - d[1]) * 3.0 - d[0];
                put_vector(third * (NORMAL_FAIRNESS / length), put);
            }
        });
    }

    /// Number of rows of [`Self::exactness`].
    pub(crate) fn exact_rows(&self) -> usize {
        if self.line { 6 } else { 3 }
    }

    /// What has to be zero: the gap at its end, in chords; on a line the gap along it and the
    /// normal's component along it.
    pub(crate) fn exactness(
        &self,
        x: &[f64; COLUMNS],
        out: &mut [f64],
        jacobian: Option<&mut [f64]>,
    ) {
        let size = self.chord.length();
        let (along, length) = (self.chord / size, self.length());
        self.evaluate(x, out, jacobian, |p, one, put| {
            let mean = p.velocity.iter().sum::<DVec3>() / CURVE_DEGREE as f64;
            let gap = (mean - self.chord * one) / size;
            if self.line {
                put(gap.dot(along));
                for n in &p.normal {
                    put(n.dot(along) / length);
                }
            } else {
                put_vector(gap, put);
            }
        });
    }

    /// At end `e`: `r″` over the square of the speed, and `N × r′`, the direction across the curve.
    fn bend(p: &Polygons, e: usize, speed: f64) -> [DVec3; 2] {
        let last = CURVE_DEGREE - 1;
        let (v, n) = (&p.velocity, &p.normal);
        let (change, across) = match e {
            0 => (v[1] - v[0], n[0].cross(v[0])),
            _ => (v[last] - v[last - 1], n[NORMAL_DEGREE].cross(v[last])),
        };
        [change * (last as f64 / (speed * speed)), across]
    }

    /// The curve between two positions.
    pub(crate) fn curve(&self, x: &[f64; COLUMNS], ends: [DVec3; 2]) -> BezierCurve {
        let p = self.polygons(x);
        let mut offsets = vec![DVec3::ZERO];
        let mut sum = DVec3::ZERO;
        for v in p.velocity {
            sum += v / CURVE_DEGREE as f64;
            offsets.push(sum);
        }
        BezierCurve::from_offsets(offsets, ends).with_normals(p.normal.to_vec())
    }

    /// Torsion of the surface at the ends, without the sign of the family.
    pub(crate) fn torsion(&self, e: usize, x: &[f64; COLUMNS]) -> f64 {
        (self.ends[e].length * x[3 * e].exp()).powi(-2)
    }
}

/// Two curves of one line at a vertex.
#[derive(Clone, Copy)]
pub(crate) struct Continuation<'a> {
    /// The curves, and which end of each is at the vertex.
    pub(crate) curves: [(&'a NormalCurve, usize); 2],
}

impl Continuation<'_> {
    /// The jump of the curvature at the vertex, times the mean of the chords, and its derivatives
    /// by the unknowns of both.
    pub(crate) fn jump(
        &self,
        x: [&[f64; COLUMNS]; 2],
        slopes: Option<&mut [[f64; COLUMNS]; 2]>,
    ) -> f64 {
        let [(first, e), (second, f)] = self.curves;
        let speed = [first.ends[e].speed, second.ends[f].speed];
        let chord = 0.5 * (first.chord.length() + second.chord.length());
        let scale = chord / (first.ends[e].length * speed[0]);
        let (p, q) = (first.polygons(x[0]), second.polygons(x[1]));
        let [bend, across] = NormalCurve::bend(&p, e, speed[0]);
        let [other, _] = NormalCurve::bend(&q, f, speed[1]);
        if let Some(slopes) = slopes {
            let (_, by_first) = first.polygons_and_slopes(x[0]);
            let outer = if e == 0 { 0 } else { NORMAL_DEGREE };
            let tip = if e == 0 { 0 } else { CURVE_DEGREE - 1 };
            for (out, by) in slopes[0].iter_mut().zip(&by_first) {
                let [bend_slope, _] = NormalCurve::bend(by, e, speed[0]);
                let across_slope = by.normal[outer].cross(p.velocity[tip])
                    + p.normal[outer].cross(by.velocity[tip]);
                *out = scale * (bend_slope.dot(across) + (bend - other).dot(across_slope));
            }
            let (_, by_second) = second.polygons_and_slopes(x[1]);
            for (out, by) in slopes[1].iter_mut().zip(&by_second) {
                *out = -scale * NormalCurve::bend(by, f, speed[1])[0].dot(across);
            }
        }
        scale * (bend - other).dot(across)
    }
}

fn put_vector(v: DVec3, put: &mut dyn FnMut(f64)) {
    v.to_array().into_iter().for_each(put);
}

#[cfg(test)]
mod tests {
    use super::*;
    use gp_solver::{Elements, ResidualBlock, check_jacobian};

    struct Block<F> {
        elements: Elements,
        rows: F,
    }

    impl<F: Fn(&[f64; COLUMNS], &mut [f64], Option<&mut [f64]>) + Send + Sync> ResidualBlock
        for Block<F>
    {
        fn name(&self) -> &str {
            "curve"
        }
        fn elements(&self) -> &Elements {
            &self.elements
        }
        fn residuals(&self, x: &[f64], residuals: &mut [f64]) {
            (self.rows)(x.try_into().unwrap(), residuals, None);
        }
        fn linearize(&self, x: &[f64], residuals: &mut [f64], jacobian: &mut [f64]) {
            (self.rows)(x.try_into().unwrap(), residuals, Some(jacobian));
        }
    }

    fn sample(line: bool) -> (NormalCurve, [f64; COLUMNS]) {
        let frame = |n: DVec3| {
            let up = n.normalize();
            let right = up.any_orthonormal_vector();
            [up, right, up.cross(right)]
        };
        let end = |n: DVec3, length: f64| CurveEnd {
            frame: frame(n),
            length,
            speed: 1.3,
            relative_speed: 0.7,
        };
        let ends = [end(DVec3::new(0.1, 0.0, 1.0), 0.9), end(DVec3::new(0.0, 0.6, 1.0), 1.2)];
        let curve = NormalCurve::new(DVec3::new(1.0, 0.2, 0.1), ends, -1.0, line);
        let mut x = [0.0; COLUMNS];
        for (k, x) in x.iter_mut().enumerate() {
            *x = 0.3 * (1.7 * k as f64 + 0.4).sin();
        }
        (curve, x)
    }

    #[test]
    fn derivatives_agree_with_differences() {
        for line in [false, true] {
            let (curve, x) = sample(line);
            let elements = |rows: usize| {
                let mut elements = Elements::new();
                elements.push(&std::array::from_fn::<usize, COLUMNS, _>(|k| k), rows);
                elements
            };
            let fair = Block {
                elements: elements(FAIR_ROWS),
                rows: |x: &[f64; COLUMNS], out: &mut [f64], j: Option<&mut [f64]>| {
                    curve.fairness(x, out, j);
                },
            };
            let worst = check_jacobian(&fair, &x).unwrap().unwrap();
            assert!(worst.error < 1e-7, "{worst:?}");
            let exact = Block {
                elements: elements(curve.exact_rows()),
                rows: |x: &[f64; COLUMNS], out: &mut [f64], j: Option<&mut [f64]>| {
                    curve.exactness(x, out, j);
                },
            };
            let worst = check_jacobian(&exact, &x).unwrap().unwrap();
            assert!(worst.error < 1e-7, "{worst:?}");
        }
    }

    #[test]
    fn the_curvature_of_a_curve_and_itself_turned_round_does_not_jump() {
        let (curve, x) = sample(false);
        let [start, end] = curve.ends;
        // The same curve the other way: velocities are opposite, so speeds and family change sign.
        let opposite =
            |e: CurveEnd| CurveEnd { speed: -e.speed, relative_speed: -e.relative_speed, ..e };
        let turned =
            NormalCurve::new(-curve.chord, [end, start].map(opposite), curve.sign, curve.line);
        let mut y = x;
        for k in 0..3 {
            (y[k], y[3 + k]) = (x[3 + k], x[k]);
            (y[6 + k], y[9 + k]) = (x[9 + k], x[6 + k]);
        }
        let middle = curve.polygons(&x).normal[2];
        y[OWN..].copy_from_slice(&turned.axes.map(|axis| middle.dot(axis)));
        let both = Continuation { curves: [(&curve, 0), (&turned, 1)] };
        let mut slopes = [[0.0; COLUMNS]; 2];
        assert!(both.jump([&x, &y], Some(&mut slopes)).abs() < 1e-12);
        // Derivatives, away from continuity.
        y[13] += 0.2;
        both.jump([&x, &y], Some(&mut slopes));
        for k in 0..COLUMNS {
            for side in 0..2 {
                let moved = |h: f64| {
                    let (mut x, mut y) = (x, y);
                    [&mut x, &mut y][side][k] += h;
                    both.jump([&x, &y], None)
                };
                let want = (moved(1e-5) - moved(-1e-5)) / 2e-5;
                assert!((slopes[side][k] - want).abs() < 1e-7, "{side} {k}");
            }
        }
    }

    /// Whatever the unknowns: `N ⟂ r′`, `N ⟂ r″`, the tangents at the ends as given, `|τ| = 1/|N|²`.
    #[test]
    fn normals_are_binormals_of_their_curve() {
        let (curve, mut x) = sample(false);
        curve.start(&mut x);
        let bezier = curve.curve(&x, [DVec3::ZERO, curve.chord]);
        let p = curve.polygons(&x);
        for k in 0..=20 {
            let t = f64::from(k) / 20.0;
            let jet = bezier.jet(t);
            let n = crate::curve::bernstein::eval(&p.normal, t);
            assert!(n.dot(jet.first).abs() < 1e-13);
            assert!(n.dot(jet.second).abs() < 1e-12);
            // τ |r′ × r″|² = det(r′, r″, r‴), without the quotient that fails near inflections.
            let b = jet.first.cross(jet.second);
            let defect = b.dot(jet.third).abs() * n.length_squared() - b.length_squared();
            let size = b.length() * jet.third.length() * n.length_squared();
            assert!(defect.abs() < 1e-12 * size, "{defect} at {t}");
        }
        assert!((curve.torsion(0, &x) * p.normal[0].length_squared() - 1.0).abs() < 1e-13);
        let [up, right, left] = curve.ends[0].frame;
        let tangent = right * x[6] + left * x[7] - up * (x[1] * x[6] + x[2] * x[7]);
        assert!((bezier.jet(0.0).first - tangent * 1.3).length() < 1e-13);
    }
}
