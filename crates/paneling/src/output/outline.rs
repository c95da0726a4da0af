//! Flat outlines of panels on planar and cylindrical molds, to be cut from sheets and bent.

use crate::error::Error;
use crate::layout::panels::PanelSet;
use crate::mold::shape::{Mold, MoldType};
use crate::paneling::Paneling;
use glam::DVec2;

/// Free space between two outlines of a sheet, as a share of the larger one's size.
const SPACING: f64 = 0.1;
/// Half the length of the mark that shows the bending axis, as a share of the panel's breadth.
const AXIS_MARK: f64 = 0.3;

/// A panel unrolled into the plane, seen against the normals of the surface.
#[derive(Clone, Debug, PartialEq)]
pub struct FlatPanel {
    /// Index of the panel.
    pub panel: usize,
    /// Index of its mold.
    pub mold: usize,
    /// Index of the sheet it lies on.
    pub sheet: usize,
    /// The border, counterclockwise, at the samples of its seams; lengths in model units.
    pub outline: Vec<DVec2>,
    /// The middle of the outline's points: a place for the number of the panel.
    pub middle: DVec2,
    /// Smaller side of the outline's bounding box.
    pub breadth: f64,
    /// How a panel on a cylinder is bent.
    pub bend: Option<Bend>,
}

/// How a flat panel is bent to a cylinder.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Bend {
    /// Ends of a mark parallel to the axis of the cylinder.
    pub mark: [DVec2; 2],
    /// Radius of the cylinder; positive if the panel bends up, towards whoever looks at the sheet.
    pub radius: f64,
}

/// Flat panels on sheets that stand side by side.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct FlatSheets {
    /// The panels, those of one mold one after the other.
    pub panels: Vec<FlatPanel>,
    /// Lower left and upper right corner of every sheet.
    pub sheets: Vec<[DVec2; 2]>,
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

    /// All panels that can be unrolled, without overlap on sheets of this width and height, or on
    /// one sheet about as wide as high. The axes of all cylinders stand upright, so that a sheet
    /// with a grain can be used.
    ///
    /// # Errors
    /// [`Error::SheetTooSmall`] names the first panel that is larger than a sheet,
    /// [`Error::BadOption`] a sheet without area.
    pub fn flat_panels(
        &self,
        set: &PanelSet,
        sheet: Option<[f64; 2]>,
    ) -> Result<FlatSheets, Error> {
        if let Some(&value) = sheet.iter().flatten().find(|v| !(**v > 0.0 && v.is_finite())) {
            return Err(Error::BadOption { name: "sheet", value });
        }
        let mut order: Vec<usize> = (0..set.len()).collect();
        // A stable sort: panels of a mold keep their order.
        order.sort_by_key(|&p| self.labels[p]);
        let mut panels: Vec<FlatPanel> =
            order.into_iter().filter_map(|p| self.flat_panel(set, p)).collect();
        let sizes: Vec<DVec2> = panels.iter().map(|f| bounds(&f.outline).1).collect();
        let largest = sizes.iter().fold(DVec2::ZERO, |size, s| size.max(*s));
        let spacing = SPACING * largest.max_element();
        let [width, height] = sheet.unwrap_or_else(|| {
            let area: f64 = sizes.iter().map(|s| (s.x + spacing) * (s.y + spacing)).sum();
            [area.sqrt().max(largest.x) + 2.0 * spacing, f64::INFINITY]
        });
        let mut packer =
            Packer { width, height, spacing, at: DVec2::splat(spacing), ..Packer::default() };
        for (flat, size) in panels.iter_mut().zip(&sizes) {
            if !(size.x + 2.0 * spacing <= width && size.y + 2.0 * spacing <= height) {
                let size = [size.x + 2.0 * spacing, size.y + 2.0 * spacing];
                return Err(Error::SheetTooSmall {
                    panel: flat.panel,
                    size,
                    sheet: [width, height],
                });
            }
            let (sheet, corner) = packer.place(*size);
            flat.move_by(corner);
            flat.sheet = sheet;
        }
        let count = panels.last().map_or(0, |f| f.sheet + 1);
        let high = if height.is_finite() { height } else { packer.at.y + packer.row + spacing };
        let left = |k: usize| k as f64 * (width + spacing);
        let sheets = (0..count)
            .map(|k| [DVec2::new(left(k), 0.0), DVec2::new(left(k) + width, high)])
            .collect();
        for flat in &mut panels {
            flat.move_by(DVec2::new(left(flat.sheet), 0.0));
        }
        Ok(FlatSheets { panels, sheets })
    }

    /// A panel with the lower left corner of its bounding box at the origin.
    fn flat_panel(&self, set: &PanelSet, panel: usize) -> Option<FlatPanel> {
        let outline = self.flat_outline(set, panel)?;
        let (min, max) = bounds(&outline);
        let outline: Vec<DVec2> = outline.iter().map(|p| *p - min).collect();
        let middle = outline.iter().sum::<DVec2>() / outline.len() as f64;
        let breadth = (max - min).min_element();
        let mold = self.labels[panel];
        let curvature = self.molds[mold].parameters[0];
        let is_bent = self.molds[mold].kind == MoldType::Cylinder && curvature != 0.0;
        let up = DVec2::Y * (AXIS_MARK * breadth);
        let bend =
            is_bent.then(|| Bend { mark: [middle - up, middle + up], radius: 1.0 / curvature });
        Some(FlatPanel { panel, mold, sheet: 0, outline, middle, breadth, bend })
    }
}

impl FlatPanel {
    fn move_by(&mut self, shift: DVec2) {
        self.outline.iter_mut().for_each(|p| *p += shift);
        self.middle += shift;
        if let Some(bend) = &mut self.bend {
            bend.mark.iter_mut().for_each(|p| *p += shift);
        }
    }
}

/// Fills sheets row by row, from the bottom.
#[derive(Default)]
struct Packer {
    width: f64,
    height: f64,
    spacing: f64,
    /// Where the next outline goes, and the height of the row so far.
    at: DVec2,
    row: f64,
    sheet: usize,
}

impl Packer {
    /// Sheet and lower left corner for an outline of this size, which fits on a sheet.
    fn place(&mut self, size: DVec2) -> (usize, DVec2) {
        let gap = self.spacing;
        if self.at.x + size.x + gap > self.width {
            self.at = DVec2::new(gap, self.at.y + self.row + gap);
            self.row = 0.0;
        }
        if self.at.y + size.y + gap > self.height {
            self.at = DVec2::splat(gap);
            self.row = 0.0;
            self.sheet += 1;
        }
        let corner = self.at;
        self.at.x += size.x + gap;
        self.row = self.row.max(size.y);
        (self.sheet, corner)
    }
}

fn bounds(points: &[DVec2]) -> (DVec2, DVec2) {
    let start = (DVec2::INFINITY, DVec2::NEG_INFINITY);
    points.iter().fold(start, |(min, max), p| (min.min(*p), max.max(*p)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Layout, Options, Pattern, solve};
    use fixtures::surfaces::Shape;
    use geom_core::{DVec3, assert_close};

    fn paneling(kind: MoldType) -> (PanelSet, Paneling) {
        let roof = Shape::Roof.surface(10, 10, 4, 4);
        let layout = Layout::generate(Pattern::Hexagon, 5, 5, [false; 2]).unwrap();
        let set = PanelSet::new(&roof, &layout).unwrap();
        let result = solve(&set, &Options::with_molds(6, kind), &mut ()).unwrap().result;
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
    fn a_panel_of_a_cylinder_has_its_developed_area_and_edges() {
        use bspline::{BsplineSurface, Degree, KnotVector};
        // A quarter of a cylinder of radius 3 and length 5, exact as a rational quadratic.
        let knots =
            |degree, n| KnotVector::clamped_uniform(Degree::new(degree).unwrap(), n).unwrap();
        let (radius, length, w) = (3.0, 5.0, 0.5_f64.sqrt());
        let arc = [[radius, 0.0], [radius, radius], [0.0, radius]];
        let points = arc.iter().flat_map(|&[x, z]| [0.0, length].map(|y| DVec3::new(x, y, z)));
        let weights = Some(vec![1.0, 1.0, w, w, 1.0, 1.0]);
        let surface =
            BsplineSurface::new(knots(2, 3), knots(1, 2), points.collect(), weights).unwrap();
        let (m, n) = (4, 2);
        let layout = Layout::generate(Pattern::Quad, m, n, [false; 2]).unwrap();
        let set = PanelSet::new(&surface, &layout).unwrap();
        let options = Options::with_molds(1, MoldType::Cylinder);
        let result = solve(&set, &options, &mut ()).unwrap().result;
        let flat = result.flat_panels(&set, None).unwrap().panels;
        let mut total = 0.0;
        for panel in &flat {
            let outline = &panel.outline;
            let next = |i: usize| outline[(i + 1) % outline.len()];
            total += 0.5 * (0..outline.len()).map(|i| outline[i].perp_dot(next(i))).sum::<f64>();
            // The straight edges run along the axis, the others along the arc.
            let [from, to] = [set.corners(panel.panel)[0][0], set.corners(panel.panel)[1][0]];
            let angle = |u: f64| {
                let p = surface.point(u, 0.0);
                p.z.atan2(p.x)
            };
            let perimeter: f64 = (0..outline.len()).map(|i| outline[i].distance(next(i))).sum();
            let expected = 2.0 * (radius * (angle(to) - angle(from)).abs() + length / n as f64);
            assert_close(perimeter, expected, 1e-8 * expected);
            assert_close(panel.bend.unwrap().radius.abs(), radius, 1e-8 * radius);
        }
        let expected = radius * std::f64::consts::FRAC_PI_2 * length;
        assert_close(total, expected, 1e-8 * expected);
    }

    #[test]
    fn outlines_lie_side_by_side_on_their_sheets() {
        let (set, result) = paneling(MoldType::Cylinder);
        let size = 0.3 * set.diagonal();
        for sheet in [None, Some([2.0 * size, size])] {
            let FlatSheets { panels: flat, sheets } = result.flat_panels(&set, sheet).unwrap();
            assert_eq!(flat.len(), set.len());
            assert_eq!(sheet.is_none(), sheets.len() == 1);
            assert!(flat.windows(2).all(|f| f[0].mold <= f[1].mold));
            for (k, a) in flat.iter().enumerate() {
                let area: f64 = (0..a.outline.len())
                    .map(|i| a.outline[i].perp_dot(a.outline[(i + 1) % a.outline.len()]))
                    .sum();
                assert!(area > 0.0, "panel {} is turned over", a.panel);
                let (min, max) = bounds(&a.outline);
                assert!(a.middle.cmpgt(min).all() && a.middle.cmplt(max).all());
                let [low, high] = sheets[a.sheet];
                assert!(min.cmpge(low).all() && max.cmple(high).all());
                for b in &flat[..k] {
                    let (other_min, other_max) = bounds(&b.outline);
                    assert!(max.cmplt(other_min).any() || min.cmpgt(other_max).any());
                }
            }
        }
        let error = result.flat_panels(&set, Some([0.01 * size, size])).unwrap_err().to_string();
        assert!(error.starts_with("panel ") && error.contains("larger sheet"), "{error}");
        let error = result.flat_panels(&set, Some([-1.0, size])).unwrap_err();
        assert!(matches!(error, Error::BadOption { .. }));
        let (set, result) = paneling(MoldType::Sphere);
        assert_eq!(result.flat_panels(&set, None).unwrap(), FlatSheets::default());
    }
}
