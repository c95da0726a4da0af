//! A spline surface as triangles with the second forms of the surface itself.

use bspline::{BsplineSurface, KnotVector};
use geom_core::{DMat3, DVec3, SurfaceJet};

use crate::options::Options;

/// Triangles per edge of the net, along either side.
const PER_EDGE: f64 = 6.0;
/// Samples of either direction at least and at most.
const SAMPLES: [f64; 2] = [16.0, 600.0];
/// Samples of either direction by which the surface is measured first.
const MEASURED: usize = 40;

/// A grid of points on a surface, cut into triangles.
pub(crate) struct Sampled {
    pub(crate) points: Vec<DVec3>,
    pub(crate) triangles: Vec<[u32; 3]>,
    /// `κ₁ d₁d₁ᵀ + κ₂ d₂d₂ᵀ` at every point, `None` where the surface has no normal.
    pub(crate) tensors: Vec<Option<DMat3>>,
}

impl Sampled {
    /// Samples fine enough for the wanted edges. In a periodic direction the last points are those of
    /// the beginning again.
    pub(crate) fn new(surface: &BsplineSurface, options: &Options) -> Self {
        let (u, v) = (even(surface.knots_u(), MEASURED), even(surface.knots_v(), MEASURED));
        let coarse = surface.jet_grid(&u, &v, 0);
        let at = |i: usize, j: usize| coarse[i * v.len() + j].position();
        let (mut along_u, mut along_v, mut area) = (0.0_f64, 0.0_f64, 0.0);
        for j in 0..v.len() {
            along_u = along_u.max((1..u.len()).map(|i| at(i, j).distance(at(i - 1, j))).sum());
        }
        for i in 0..u.len() {
            along_v = along_v.max((1..v.len()).map(|j| at(i, j).distance(at(i, j - 1))).sum());
        }
        for (i, j) in (1..u.len()).flat_map(|i| (1..v.len()).map(move |j| (i, j))) {
            let (one, other) = (at(i, j) - at(i - 1, j - 1), at(i, j - 1) - at(i - 1, j));
            area += 0.5 * one.cross(other).length();
        }
        let faces = options.wanted_faces().map_or(1.0, |n| n as f64);
        let step = options.edge_length.unwrap_or((area / faces).sqrt()) / PER_EDGE;
        let count = |length: f64| (length / step).ceil().clamp(SAMPLES[0], SAMPLES[1]) as usize;
        let (u, v) =
            (even(surface.knots_u(), count(along_u)), even(surface.knots_v(), count(along_v)));
        let jets = surface.jet_grid(&u, &v, 2);
        let (n, m) = (u.len() as u32, v.len() as u32);
        let mut triangles = Vec::new();
        for (i, j) in (0..n - 1).flat_map(|i| (0..m - 1).map(move |j| (i, j))) {
            let [a, b, c, d] = [i * m + j, (i + 1) * m + j, (i + 1) * m + j + 1, i * m + j + 1];
            // Diagonals alternate, so that none of the two directions is preferred.
            triangles.extend(if (i + j) % 2 == 0 {
                [[a, b, c], [a, c, d]]
            } else {
                [[a, b, d], [b, c, d]]
            });
        }
        Self {
            points: jets.iter().map(SurfaceJet::position).collect(),
            tensors: jets.iter().map(tensor).collect(),
            triangles,
        }
    }
}

/// Parameters in equal steps from one end of the domain to the other.
fn even(knots: &KnotVector, count: usize) -> Vec<f64> {
    let (from, to) = knots.domain();
    (0..=count).map(|k| from + (to - from) * k as f64 / count as f64).collect()
}

/// The second form as a tensor that takes vectors by their parts in the tangent plane.
fn tensor(jet: &SurfaceJet) -> Option<DMat3> {
    let second = jet.second_form().ok()?;
    let first = jet.first_form();
    let determinant = first.e * first.g - first.f * first.f;
    let (du, dv) = (jet.d(1, 0), jet.d(0, 1));
    let dual_u = (first.g * du - first.f * dv) / determinant;
    let dual_v = (first.e * dv - first.f * du) / determinant;
    let outer = |p: DVec3, q: DVec3| DMat3::from_cols(p * q.x, p * q.y, p * q.z);
    Some(
        outer(dual_u, dual_u) * second.l
            + (outer(dual_u, dual_v) + outer(dual_v, dual_u)) * second.m
            + outer(dual_v, dual_v) * second.n,
    )
}
