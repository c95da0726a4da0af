//! Flat outlines of panels on planar and cylindrical molds, to be cut from sheets and bent.

use crate::mold::{Mold, MoldType};
use crate::paneling::Paneling;
use crate::panels::PanelSet;
use glam::DVec2;

/// Free space between two outlines of a sheet, as a share of the larger one's size.
const SPACING: f64 = 0.1;

/// A panel unrolled into the plane, seen against the normals of the surface.
#[derive(Clone, Debug, PartialEq)]
pub struct FlatPanel {
    /// Index of the panel.
    pub panel: usize,
    /// The border, counterclockwise, at the samples of its seams; lengths in model units.
    pub outline: Vec<DVec2>,
    /// The middle of the outline's points: a place for the number of the panel.
    pub middle: DVec2,
    /// Smaller side of the outline's bounding box.
    pub breadth: f64,
}

impl MoldType {
    /// Whether sheets can be bent onto the mold without stretching.
    #[must_use]
    pub fn is_developable(self) -> bool {
        matches!(self, Self::Plane | Self::Cylinder)
    }
}

impl Mold {
    /// The point of the flat sheet that lies at `(x, y)` of a planar or cylindrical mold:
    /// `(asin(κ x) / κ, y)` for a cylinder of curvature `κ` with its axis along y.
    fn developed(&self, x: f64, y: f64) -> Option<DVec2> {
        let kx = match self.kind {
            MoldType::Plane => 0.0,
            MoldType::Cylinder => self.parameters[0] * x,
            _ => return None,
        };
        // The arc over a chord, by its series where the quotient would lose digits.
        let stretch = if kx.abs() < 1e-4 { 1.0 + kx * kx / 6.0 } else { kx.asin() / kx };
        Some(DVec2::new(x * stretch, y))
    }
}

impl Paneling {
    /// The border of panel `p` unrolled into the plane, in the frame of its mold, or `None` if the
    /// mold is neither planar nor cylindrical. Points are joined by straight lines, which are
    /// geodesics of the mold.
    #[must_use]
    pub fn flat_outline(&self, set: &PanelSet, p: usize) -> Option<Vec<DVec2>> {
        let (mold, pose) = (&self.molds[self.labels[p]], &self.poses[p]);
        if !mold.kind.is_developable() {
            return None;
        }
        let points = self.panel_mesh(set, p).positions;
        points[..set.border(p).len()]
            .iter()
            .map(|point| {
                let local = pose.to_local(*point);
                mold.developed(local.x, local.y)
            })
            .collect()
    }

    /// All panels that can be unrolled, side by side in rows without overlap.
    #[must_use]
    pub fn flat_panels(&self, set: &PanelSet) -> Vec<FlatPanel> {
        let mut flat = Vec::new();
        for panel in 0..set.len() {
            let Some(outline) = self.flat_outline(set, panel) else { continue };
            let (min, max) = bounds(&outline);
            let outline: Vec<DVec2> = outline.iter().map(|p| *p - min).collect();
            let middle = outline.iter().sum::<DVec2>() / outline.len() as f64;
            flat.push(FlatPanel { panel, outline, middle, breadth: (max - min).min_element() });
        }
        let largest = flat.iter().fold(DVec2::ZERO, |size, f| size.max(bounds(&f.outline).1));
        let cell = largest + DVec2::splat(SPACING * largest.max_element());
        // About as wide as high.
        let columns = ((flat.len() as f64 * cell.y / cell.x).sqrt().ceil() as usize).max(1);
        for (k, panel) in flat.iter_mut().enumerate() {
            // The first row is on top.
            let shift = cell * DVec2::new((k % columns) as f64, -((k / columns) as f64));
            panel.outline.iter_mut().for_each(|p| *p += shift);
            panel.middle += shift;
        }
        flat
    }
}

fn bounds(points: &[DVec2]) -> (DVec2, DVec2) {
    let start = (DVec2::INFINITY, DVec2::NEG_INFINITY);
    points.iter().fold(start, |(min, max), p| (min.min(*p), max.max(*p)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Layout, Options, Pattern, panel};
    use fixtures::surfaces::Shape;
    use geom_core::{DVec3, assert_close};

    fn paneling(kind: MoldType) -> (PanelSet, Paneling) {
        let roof = Shape::Roof.surface(10, 10, 4, 4);
        let layout = Layout::generate(Pattern::Hexagon, 5, 5, [false; 2]).unwrap();
        let set = PanelSet::new(&roof, &layout).unwrap();
        let options = Options { mold_type: kind, ..Options::with_molds(6) };
        let result = panel(&set, &options).unwrap();
        (set, result)
    }

    #[test]
    fn unrolling_keeps_the_lengths_of_edges() {
        for kind in [MoldType::Plane, MoldType::Cylinder] {
            let (set, result) = paneling(kind);
            for p in 0..set.len() {
                let outline = result.flat_outline(&set, p).unwrap();
                let border = &result.panel_mesh(&set, p).positions[..outline.len()];
                let curvature = result.molds[result.labels[p]].parameters[0];
                let pose = &result.poses[p];
                // Straight from point to point on the sheet, bent onto a cylinder of this radius
                // about its axis.
                let bent = |flat: DVec2| {
                    let angle = curvature * flat.x;
                    let local = if curvature == 0.0 {
                        DVec3::new(flat.x, flat.y, 0.0)
                    } else {
                        let (radius, half) = (1.0 / curvature, (0.5 * angle).sin());
                        DVec3::new(radius * angle.sin(), flat.y, 2.0 * radius * half * half)
                    };
                    pose.to_world(local)
                };
                for k in 0..outline.len() {
                    let (a, b) = (outline[k], outline[(k + 1) % outline.len()]);
                    assert!(bent(a).distance(border[k]) < 1e-9 * set.diagonal());
                    let n = 64;
                    let at = |i: usize| bent(a.lerp(b, i as f64 / n as f64));
                    let length: f64 = (0..n).map(|i| at(i).distance(at(i + 1))).sum();
                    assert_close(length, a.distance(b), 1e-6 * a.distance(b));
                }
            }
        }
    }

    #[test]
    fn the_arc_is_smooth_where_series_and_quotient_meet() {
        let mut mold = Mold::flat(MoldType::Cylinder);
        mold.parameters[0] = 1.0;
        for x in [0.999_999e-4, 1.000_001e-4] {
            let flat = mold.developed(x, 2.0).unwrap();
            assert_close(flat.x / x, 1.0 + x * x / 6.0, 1e-15);
            assert_eq!(flat.y, 2.0);
        }
        assert_eq!(Mold::flat(MoldType::Sphere).developed(0.1, 0.1), None);
    }

    #[test]
    fn outlines_lie_side_by_side() {
        let (set, result) = paneling(MoldType::Cylinder);
        let flat = result.flat_panels(&set);
        assert_eq!(flat.len(), set.len());
        for (k, a) in flat.iter().enumerate() {
            let area: f64 = (0..a.outline.len())
                .map(|i| a.outline[i].perp_dot(a.outline[(i + 1) % a.outline.len()]))
                .sum();
            assert!(area > 0.0, "panel {} is turned over", a.panel);
            let (min, max) = bounds(&a.outline);
            assert!(a.middle.cmpgt(min).all() && a.middle.cmplt(max).all());
            for b in &flat[..k] {
                let (other_min, other_max) = bounds(&b.outline);
                assert!(max.cmplt(other_min).any() || min.cmpgt(other_max).any());
            }
        }
        let (set, result) = paneling(MoldType::Sphere);
        assert!(result.flat_panels(&set).is_empty());
    }
}
