//! Quartic quadrilaterals, for data that allow them.
//!
//! The middle point of a quartic lies in the corner planes at both ends, so on one line, and the
//! end curvatures follow instead of being given. The torsion equation at a corner,
//! `h_p |a_q|² m_q + h_q |a_p|² m_p = 0`, is linear: `h` is the height of the far tangent point and
//! `m`, affine in the unknown, the side coefficient. Four equations in four unknowns: generic data
//! have one solution, usually a useless one; exact nets have a family, whose member of least
//! strain is taken. The paper's count of one free parameter (Wang et al. 2019, §5.3) holds for
//! these only.

use geom_core::DVec3;

use crate::boundary::quad::{Quadrilateral, finish};
use crate::curve::bernstein;
use crate::curve::bezier::BezierCurve;
use crate::data::corners::{CURVE_CORNERS, CornerData, DATA_DEGREE, INTO_IS_LEFT};
use crate::error::{Error, Place};
use numerics::{Matrix, affine_space, minimize_quadratic, norm};

/// Sine between the corner planes below which they have no common line.
const PLANE_TOL: f64 = 1e-9;
/// Rank tolerance: the rounding of exact nets, not of measured ones.
const RANK_TOL: f64 = 1e-8;
/// Largest residual of the torsion equations.
const RESIDUAL_TOL: f64 = 1e-8;

/// Solves the boundary with quartics; the curvatures of `data` are not used.
///
/// # Errors
/// [`Error::QuarticPlanes`], [`Error::QuarticInfeasible`], parallel tangents,
/// inflections, and the faults of the solved curves.
pub fn solve_quartic_quadrilateral(data: &CornerData) -> Result<Quadrilateral, Error> {
    let scale = DATA_DEGREE as f64 / 4.0;
    let arm = |i: usize, e: usize| data.arm(i, e) * scale;
    // Corners with their u-curve and v-curve; the normal is that of counter-clockwise faces.
    let corners = [[(0, 0), (1, 0)], [(0, 1), (3, 0)], [(2, 0), (1, 1)], [(2, 1), (3, 1)]];
    let mut normals = [DVec3::ZERO; 4];
    for (c, [(p, pe), (q, qe)]) in corners.into_iter().enumerate() {
        let n = arm(p, pe).normalize().cross(arm(q, qe).normalize());
        if !(n.length() > crate::data::corners::MIN_CORNER_SINE) {
            let place = Place::PatchCorner(c);
            return Err(Error::ParallelTangents { place, sine: n.length() });
        }
        normals[c] = n.normalize() * if c == 0 || c == 3 { 1.0 } else { -1.0 };
    }
    // Middle points: nearest point of the common line to the middle of the chord, and direction.
    let (mut base, mut along) = ([DVec3::ZERO; 4], [DVec3::ZERO; 4]);
    for i in 0..4 {
        let [s, t] = CURVE_CORNERS[i];
        let (x, y) = (data.corners[s], data.corners[t]);
        let line = normals[s].cross(normals[t]);
        let sine = line.length();
        if !(sine > PLANE_TOL) {
            return Err(Error::QuarticPlanes { place: Place::PatchCurve(i), sine });
        }
        along[i] = line / sine * (y - x).length();
        let middle = x.midpoint(y);
        let (d0, d1) = (normals[s].dot(x - middle), normals[t].dot(y - middle));
        let offset = (normals[t].cross(line) * d0 + line.cross(normals[s]) * d1) / (sine * sine);
        base[i] = middle + offset;
    }
    // Side coefficient of curve i at end e: constant and slope.
    let side = |i: usize, e: usize| {
        let c = CURVE_CORNERS[i][e];
        let a = arm(i, e);
        let across = normals[c].cross(a) / a.length_squared();
        [across.dot(base[i] - data.corners[c]), across.dot(along[i])]
    };
    let height = |i: usize, e: usize| {
        let [c, far] = [CURVE_CORNERS[i][e], CURVE_CORNERS[i][1 - e]];
        normals[c].dot(data.corners[far] + arm(i, 1 - e) - data.corners[c])
    };
    let mut matrix = Matrix::zeros(4, 4);
    let mut right = vec![0.0; 4];
    for (c, [(p, pe), (q, qe)]) in corners.into_iter().enumerate() {
        let (wp, wq) = (
            height(q, qe) * arm(p, pe).length_squared(),
            height(p, pe) * arm(q, qe).length_squared(),
        );
        let (mp, mq) = (side(p, pe), side(q, qe));
        matrix[(c, p)] += wp * mp[1];
        matrix[(c, q)] += wq * mq[1];
        right[c] = -(wp * mp[0] + wq * mq[0]);
        let size = norm(matrix.row(c)).max(right[c].abs());
        if size > 0.0 {
            matrix.row_mut(c).iter_mut().for_each(|a| *a /= size);
            right[c] /= size;
        }
    }
    let space = affine_space(&matrix, &right, &[1.0; 4], RANK_TOL);
    if !(space.residual <= RESIDUAL_TOL) {
        return Err(Error::QuarticInfeasible { residual: space.residual });
    }
    let curve = |i: usize, s: f64| {
        let [x, y] = CURVE_CORNERS[i].map(|c| data.corners[c]);
        BezierCurve::new(vec![x, x + arm(i, 0), base[i] + along[i] * s, y + arm(i, 1), y])
    };
    let shares = least_strain(&space.particular, &space.null, |i| curve(i, 0.0), &along);
    let curves: [BezierCurve; 4] = std::array::from_fn(|i| curve(i, shares[i]));
    let mut curvatures = [[0.0; 2]; 4];
    for i in 0..4 {
        for e in 0..2 {
            let [constant, slope] = side(i, e);
            let left = 0.75 * (constant + slope * shares[i]) / arm(i, e).length();
            curvatures[i][e] = left * INTO_IS_LEFT[i][e];
        }
        if curvatures[i][0] * curvatures[i][1] <= 0.0 {
            let place = Place::PatchCurve(i);
            return Err(Error::InflectionParity { place, declared: 0 });
        }
    }
    let torsions = corners.map(|[(p, pe), _]| curves[p].jet(pe as f64).torsion());
    let freedoms = space.null.cols();
    finish(data, curvatures, curves, torsions, [const { Vec::new() }; 4], freedoms, Vec::new())
}

/// The member of the family with the least strain energy.
fn least_strain(
    particular: &[f64],
    null: &Matrix,
    at_zero: impl Fn(usize) -> BezierCurve,
    along: &[DVec3; 4],
) -> Vec<f64> {
    let gram = bernstein::gram(4, 2);
    // Strain of curve i: a s² + 2 b s + …
    let terms: Vec<[f64; 2]> = (0..4)
        .map(|i| {
            let points = at_zero(i).points().to_vec();
            let b: f64 = (0..5).map(|k| gram[(2, k)] * along[i].dot(points[k] - points[0])).sum();
            [gram[(2, 2)] * along[i].length_squared(), b]
        })
        .collect();
    let n = null.cols();
    let mut hessian = Matrix::zeros(n, n);
    let mut gradient = vec![0.0; n];
    for i in 0..4 {
        let force = terms[i][0] * particular[i] + terms[i][1];
        for a in 0..n {
            gradient[a] += null[(i, a)] * force;
            for b in 0..n {
                hessian[(a, b)] += null[(i, a)] * terms[i][0] * null[(i, b)];
            }
        }
    }
    let y = minimize_quadratic(&hessian, &gradient);
    particular.iter().zip(null.apply(&y)).map(|(p, s)| p + s).collect()
}
