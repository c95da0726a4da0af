//! The asymptotic directions of every triangle, and where they have none.

use geom_core::{DMat3, DVec2, DVec3, vertex_forms};
use rayon::prelude::*;

use crate::error::Error;
use crate::surface::{NONE, Surface};

/// Strength of the smoothing against one neighbour, and its sweeps. A triangle then averages about
/// its neighbours' neighbours.
const SMOOTHING: f64 = 2.0;
const SMOOTHING_SWEEPS: usize = 40;
/// Sweeps of a harmonic fill per ring of triangles of its disc.
const FILL_SWEEPS: usize = 60;

/// Curvature of every triangle: the mean one, and the deviator as a complex number `R e^{2iφ}`, where
/// the larger principal curvature `H + R` belongs to the direction `φ` of the triangle's frame.
#[derive(Clone, Debug)]
pub(crate) struct Field {
    pub(crate) mean: Vec<f64>,
    pub(crate) deviator: Vec<DVec2>,
}

/// `e^{iφ}`
pub(crate) fn unit(angle: f64) -> DVec2 {
    DVec2::new(angle.cos(), angle.sin())
}

/// Product of complex numbers.
pub(crate) fn times(a: DVec2, b: DVec2) -> DVec2 {
    DVec2::new(a.x * b.x - a.y * b.y, a.x * b.y + a.y * b.x)
}

impl Field {
    /// Fits the curvatures within `radius` of every vertex, and smooths them a little.
    pub(crate) fn fitted(surface: &Surface, radius: f64) -> Result<Self, Error> {
        let coarse = || Error::TooCoarse { triangles: surface.triangles.len() };
        let mesh = surface.to_tri_mesh().map_err(|_| coarse())?;
        let forms = vertex_forms(&mesh, radius);
        let tensors: Vec<Option<DMat3>> = forms.iter().map(|f| f.map(|f| f.tensor)).collect();
        let mut this = Self::of_tensors(surface, &tensors)?;
        this.smooth(surface);
        Ok(this)
    }

    /// The mean over the corners of every triangle of second forms as tensors.
    pub(crate) fn of_tensors(surface: &Surface, tensors: &[Option<DMat3>]) -> Result<Self, Error> {
        let coarse = || Error::TooCoarse { triangles: surface.triangles.len() };
        let (mut mean, mut deviator) = (Vec::new(), Vec::new());
        for (f, t) in surface.triangles.iter().enumerate() {
            let known: Vec<DMat3> = t.iter().filter_map(|&v| tensors[v as usize]).collect();
            if known.is_empty() {
                return Err(coarse());
            }
            let sum =
                known.iter().fold(DMat3::ZERO, |sum, t| sum + *t) * (1.0 / known.len() as f64);
            let (x, y) = (surface.x_axes[f], surface.y_axis(f));
            let (a, b, c) = (x.dot(sum * x), x.dot(sum * y), y.dot(sum * y));
            mean.push(0.5 * (a + c));
            deviator.push(DVec2::new(0.5 * (a - c), b));
        }
        Ok(Self { mean, deviator })
    }

    /// One implicit step of diffusion, by Jacobi's iteration.
    fn smooth(&mut self, surface: &Surface) {
        let transport = transports(surface);
        let (mean, deviator) = (self.mean.clone(), self.deviator.clone());
        for _ in 0..SMOOTHING_SWEEPS {
            let old = &*self;
            let next = |f: usize| {
                let (mut h, mut q, mut weight) = (mean[f], deviator[f], 1.0);
                for k in 0..3 {
                    let g = surface.across[f][k];
                    if g != NONE {
                        h += SMOOTHING * old.mean[g as usize];
                        q += SMOOTHING * times(old.deviator[g as usize], transport[f][k]);
                        weight += SMOOTHING;
                    }
                }
                (h / weight, q / weight)
            };
            let values: Vec<(f64, DVec2)> =
                (0..mean.len()).into_par_iter().with_min_len(256).map(next).collect();
            (self.mean, self.deviator) = values.into_iter().unzip();
        }
    }

    /// Direction of the larger principal curvature in the triangle's frame.
    pub(crate) fn principal_angle(&self, f: usize) -> f64 {
        0.5 * self.deviator[f].y.atan2(self.deviator[f].x)
    }

    /// Angle of the asymptotic directions with that direction: `cos 2α = −H / R`, the cosine at most
    /// `limit`; and whether it was more.
    pub(crate) fn asymptotic_angle(&self, f: usize, limit: f64) -> (f64, bool) {
        let size = self.deviator[f].length();
        let cosine = if size > 0.0 { -self.mean[f] / size } else { 0.0 };
        (0.5 * cosine.clamp(-limit, limit).acos(), cosine.abs() > limit)
    }

    /// Whether the Gaussian curvature `H² − R²` is negative.
    pub(crate) fn is_negative(&self, f: usize) -> bool {
        self.mean[f].abs() < self.deviator[f].length()
    }

    /// Share of the area that is negatively curved.
    pub(crate) fn negative_share(&self, surface: &Surface) -> f64 {
        let negative = (0..self.mean.len()).filter(|&f| self.is_negative(f));
        // A sum of nothing is −0.
        (0.0 + negative.map(|f| surface.areas[f]).sum::<f64>()) / surface.area()
    }

    /// Replaces the field in the triangles of a disc by a harmonic one with a single singular point
    /// at the vertex `centre`, around which the deviator turns `−turns` times against the surface.
    ///
    /// Directions of the disc are compared in the tangent plane of its centre. `false`, and no
    /// change, if the disc bends away from it too far.
    pub(crate) fn fill(
        &mut self,
        surface: &Surface,
        disc: &[u32],
        centre: usize,
        turns: i32,
    ) -> bool {
        let star = surface.star(centre);
        let normal = star.iter().map(|&(f, _)| surface.normals[f as usize]).sum::<DVec3>();
        let normal = normal.normalize_or_zero();
        let bends = |f: &u32| surface.normals[*f as usize].dot(normal) < LEAST_COSINE;
        if normal == DVec3::ZERO || disc.iter().any(bends) {
            return false;
        }
        let (x, y) = normal.any_orthonormal_pair();
        let (x, y) = if x.cross(y).dot(normal) > 0.0 { (x, y) } else { (y, x) };
        // To the plane's frame, where the turns about the centre are taken off.
        let into = |f: usize| {
            let axis = surface.x_axes[f];
            let frame = axis.dot(y).atan2(axis.dot(x));
            let from = surface.centre(f) - surface.positions[centre];
            let polar = from.dot(y).atan2(from.dot(x));
            unit(2.0 * frame + f64::from(turns) * polar)
        };
        let inside: std::collections::BTreeMap<u32, usize> =
            disc.iter().enumerate().map(|(at, &f)| (f, at)).collect();
        let mut rim = Vec::new();
        let around: Vec<[Option<(bool, usize)>; 3]> = disc
            .iter()
            .map(|&f| {
                surface.across[f as usize].map(|g| {
                    if g == NONE {
                        return None;
                    }
                    Some(match inside.get(&g) {
                        Some(&at) => (true, at),
                        None => {
                            let q = self.deviator[g as usize];
                            rim.push((
                                times(q.normalize_or_zero(), into(g as usize)),
                                self.mean[g as usize],
                                q.length(),
                            ));
                            (false, rim.len() - 1)
                        }
                    })
                })
            })
            .collect();
        if rim.is_empty() {
            return false;
        }
        let mut values = vec![(DVec2::ZERO, 0.0, 0.0); disc.len()];
        let rings = (disc.len() as f64).sqrt().ceil() as usize;
        for _ in 0..FILL_SWEEPS + 4 * rings * rings / 3 {
            for at in 0..disc.len() {
                let (mut sum, mut mean, mut size, mut count) = (DVec2::ZERO, 0.0, 0.0, 0.0);
                for (is_inside, k) in around[at].into_iter().flatten() {
                    let (q, h, r) = if is_inside { values[k] } else { rim[k] };
                    sum += q;
                    mean += h;
                    size += r;
                    count += 1.0;
                }
                values[at] = (sum / count, mean / count, size / count);
            }
        }
        if values.iter().any(|(q, ..)| q.length() == 0.0) {
            return false;
        }
        for (&f, (q, h, r)) in disc.iter().zip(values) {
            let f = f as usize;
            let back = into(f);
            self.deviator[f] = times(q.normalize(), DVec2::new(back.x, -back.y)) * r;
            self.mean[f] = h;
        }
        true
    }
}

/// Cosine of the largest angle between a disc's triangles and its tangent plane.
const LEAST_COSINE: f64 = 0.3;

/// What takes the deviator across each side into the triangle's own frame.
fn transports(surface: &Surface) -> Vec<[DVec2; 3]> {
    let one = |f: usize| {
        [0, 1, 2].map(|k| match surface.across[f][k] {
            NONE => DVec2::X,
            // Directions turn by `turn` on the way to the neighbour, so back by as much.
            _ => unit(-2.0 * surface.turn(f, k)),
        })
    };
    (0..surface.triangles.len()).into_par_iter().with_min_len(256).map(one).collect()
}
