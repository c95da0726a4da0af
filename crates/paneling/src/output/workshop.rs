//! What a workshop needs: a table of the panels, the molds as surfaces, the panels as meshes.

use crate::fit::residuals::foot;
use crate::layout::panels::PanelSet;
use crate::mold::shape::{Mold, MoldType};
use crate::paneling::Paneling;
use bspline::{BsplineSurface, Degree, FitError, KnotVector, fit_surface};
use glam::DVec3;
use serde::{Deserialize, Serialize};

/// One panel in the table; lengths in model units.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct PanelRow {
    /// Index of the panel.
    pub panel: usize,
    /// Index of its mold.
    pub mold: usize,
    /// Type of its mold.
    pub mold_type: MoldType,
    /// Place of the panel's middle in the domain of the surface.
    pub parameters: [f64; 2],
    /// Corners of the panel in the domain of the surface, counterclockwise.
    #[serde(default)]
    pub corners: Vec<[f64; 2]>,
    /// Origin of the mold's frame.
    pub origin: [f64; 3],
    /// First axis of the mold's frame.
    pub x_axis: [f64; 3],
    /// Third axis of the mold's frame, along the surface normal.
    pub z_axis: [f64; 3],
    /// Where the panel lies on its mold: smallest x, largest x, smallest y, largest y.
    pub extent: [f64; 4],
    /// Largest kink at its seams, in degrees.
    pub worst_kink_deg: f64,
    /// Largest gap at its seams.
    pub worst_gap: f64,
    /// Largest distance from the design.
    pub deviation: f64,
}

/// A panel as triangles on its mold.
#[derive(Clone, Debug, PartialEq)]
pub struct PanelMesh {
    /// Points on the mold.
    pub positions: Vec<DVec3>,
    /// Unit normals of the mold.
    pub normals: Vec<DVec3>,
    /// Corners of the triangles, counterclockwise seen against the normals.
    pub triangles: Vec<[u32; 3]>,
}

impl Paneling {
    /// One row per panel.
    #[must_use]
    pub fn table(&self, set: &PanelSet) -> Vec<PanelRow> {
        let worst = self.measures.worst_of_panels();
        (0..set.len())
            .map(|p| {
                let (mold, pose) = (self.labels[p], &self.poses[p]);
                PanelRow {
                    panel: p,
                    mold,
                    mold_type: self.molds[mold].kind,
                    parameters: set.middles()[p],
                    corners: set.corners(p).to_vec(),
                    origin: pose.origin.to_array(),
                    x_axis: pose.rotation.x_axis.to_array(),
                    z_axis: pose.rotation.z_axis.to_array(),
                    extent: self.extent(set, p),
                    worst_kink_deg: worst[p][0].to_degrees(),
                    worst_gap: worst[p][1],
                    deviation: self.measures.deviations[p],
                }
            })
            .collect()
    }

    /// Bounds of a panel in the frame of its mold: smallest x, largest x, smallest y, largest y.
    fn extent(&self, set: &PanelSet, p: usize) -> [f64; 4] {
        let start = [f64::INFINITY, f64::NEG_INFINITY, f64::INFINITY, f64::NEG_INFINITY];
        set.border(p).iter().fold(start, |e, x| {
            let l = self.poses[p].to_local(*x);
            [e[0].min(l.x), e[1].max(l.x), e[2].min(l.y), e[3].max(l.y)]
        })
    }

    /// The part of mold `m` that its panels use, as a surface in the mold's frame.
    ///
    /// Polynomial molds are exact. Round ones are degree-five splines fitted through points of the
    /// mold, within about 1e-9 of their size as long as a panel spans less than half a radius.
    ///
    /// # Errors
    /// [`FitError`] if a round mold does not reach over the rectangle around its panels.
    pub fn mold_surface(&self, set: &PanelSet, m: usize) -> Result<BsplineSurface, FitError> {
        let mut extent = [f64::INFINITY, f64::NEG_INFINITY, f64::INFINITY, f64::NEG_INFINITY];
        for p in (0..set.len()).filter(|&p| self.labels[p] == m) {
            let own = self.extent(set, p);
            for k in [0, 2] {
                extent[k] = extent[k].min(own[k]);
                extent[k + 1] = extent[k + 1].max(own[k + 1]);
            }
        }
        surface_over(&self.molds[m], extent)
    }

    /// The panel as triangles on its mold, over the samples it was fitted with.
    #[must_use]
    pub fn panel_mesh(&self, set: &PanelSet, p: usize) -> PanelMesh {
        let (points, normals) = set.panel_samples(p);
        let (mold, pose) = (&self.molds[self.labels[p]], &self.poses[p]);
        let to_local = pose.rotation.transpose();
        let mut mesh =
            PanelMesh { positions: Vec::new(), normals: Vec::new(), triangles: Vec::new() };
        for (x, n) in points.iter().zip(normals) {
            let (t, m) = foot(mold, to_local * (*x - pose.origin), to_local * *n);
            mesh.positions.push(*x + t * *n);
            mesh.normals.push(pose.rotation * m);
        }
        // Border samples run around in quarters of an edge, inner ones in halves, then the middle.
        let outer = set.border(p).len() as u32;
        let inner = outer / 2;
        for j in 0..inner {
            let next = (j + 1) % inner;
            let (a, b, c) = (2 * j, 2 * j + 1, (2 * j + 2) % outer);
            let (i, k) = (outer + j, outer + next);
            mesh.triangles.extend([[a, b, i], [b, k, i], [b, c, k], [i, k, outer + inner]]);
        }
        mesh
    }
}

/// The mold over the rectangle `x₀, x₁, y₀, y₁` of its frame.
fn surface_over(mold: &Mold, [x0, x1, y0, y1]: [f64; 4]) -> Result<BsplineSurface, FitError> {
    let is_polynomial =
        matches!(mold.kind, MoldType::Plane | MoldType::Paraboloid | MoldType::Cubic);
    let (degree, n) = if is_polynomial { (3, 4) } else { (5, 13) };
    let knots = Degree::new(degree)
        .and_then(|d| KnotVector::clamped_uniform(d, n))
        .map_err(bspline::SplineError::from)?;
    let t = knots.greville_points();
    let point = |u: f64, v: f64| {
        let (x, y) = (x0 + u * (x1 - x0), y0 + v * (y1 - y0));
        DVec3::new(x, y, mold.height(x, y))
    };
    let points: Vec<DVec3> = t.iter().flat_map(|&u| t.iter().map(move |&v| point(u, v))).collect();
    fit_surface(&knots, &knots, &t, &t, &points)
}

#[cfg(test)]
mod tests {
    use super::*;
    use geom_core::assert_close;

    #[test]
    fn mold_surfaces_follow_their_molds() {
        for kind in MoldType::ALL {
            let mut mold = Mold::flat(kind);
            for i in 0..kind.parameter_count() {
                mold.parameters[i] = 0.5 * (1.0 + i as f64).sin();
            }
            let surface = surface_over(&mold, [-0.5, 0.6, -0.4, 0.3]).unwrap();
            for (u, v) in [(0.0, 0.0), (0.21, 0.77), (0.5, 0.35), (1.0, 0.9)] {
                let p = surface.point(u, v);
                assert_close(p.z, mold.height(p.x, p.y), 1e-8);
                assert_close(p.x, -0.5 + 1.1 * u, 1e-12);
            }
        }
    }
}
