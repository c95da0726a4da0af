//! Corner data of one quadrilateral and of nets of curves.

use geom_core::DVec3;
use serde::{Deserialize, Serialize};

use crate::error::{Error, Place};

/// Tangent control points are those of a curve of this degree: `r′ = 5 · arm` whatever the
/// degree the boundary is solved in.
pub const DATA_DEGREE: usize = 5;

/// Least sine between two curves at a corner.
pub(crate) const MIN_CORNER_SINE: f64 = 1e-6;

/// End curvatures of the four curves, `[start, end]` each, in 1/length.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub enum Curvatures {
    /// Positive where the curve bends towards the other boundary curve at that corner, that is
    /// into the patch.
    Signed([[f64; 2]; 4]),
    /// Only the sizes are known; one sign per curve is found by enumeration.
    Unsigned([[f64; 2]; 4]),
}

impl Curvatures {
    /// The values, whatever their meaning.
    #[must_use]
    pub fn values(&self) -> &[[f64; 2]; 4] {
        match self {
            Self::Signed(k) | Self::Unsigned(k) => k,
        }
    }
}

/// Corner data of an asymptotic quadrilateral (Wang et al. 2019, §3.2).
///
/// `r1(u) = R(u, 0)`, `r2(v) = R(0, v)`, `r3(u) = R(u, 1)`, `r4(v) = R(1, v)`; index 0..3 here.
#[derive(Clone, Debug, PartialEq)]
pub struct CornerData {
    /// Corners `00`, `10`, `01`, `11`.
    pub corners: [DVec3; 4],
    /// Second control point of each quintic, next to its start.
    pub start_points: [DVec3; 4],
    /// Last but one control point of each quintic, next to its end.
    pub end_points: [DVec3; 4],
    /// End curvatures.
    pub curvatures: Curvatures,
    /// Which curves are straight.
    pub lines: [bool; 4],
    /// Number of inflections of each curve (0, 1 or 2).
    pub inflections: [usize; 4],
}

/// Corner indices at which curve `r1..r4` starts and ends.
pub(crate) const CURVE_CORNERS: [[usize; 2]; 4] = [[0, 1], [0, 2], [2, 3], [1, 3]];

/// `+1` where "into the patch" is to the left of the arm seen against the normal, per curve end.
pub(crate) const INTO_IS_LEFT: [[f64; 2]; 4] = [[1.0, -1.0], [-1.0, 1.0], [-1.0, 1.0], [1.0, -1.0]];

impl CornerData {
    /// Vector from the corner to the neighbouring control point, inward at both ends.
    #[must_use]
    pub fn arm(&self, curve: usize, end: usize) -> DVec3 {
        let tip = if end == 0 { self.start_points[curve] } else { self.end_points[curve] };
        tip - self.corners[CURVE_CORNERS[curve][end]]
    }

    /// The longer diagonal, the length that defects are compared with.
    #[must_use]
    pub fn size(&self) -> f64 {
        let c = &self.corners;
        (c[3] - c[0]).length().max((c[1] - c[2]).length())
    }

    /// The net of one face that these data describe, with `k` as signed curvatures.
    pub(crate) fn to_net(&self, signed: &[[f64; 2]; 4]) -> AsymptoticNet {
        let curves = (0..4)
            .map(|i| NetCurve {
                ends: CURVE_CORNERS[i],
                arms: [self.arm(i, 0), self.arm(i, 1)],
                curvatures: [signed[i][0] * INTO_IS_LEFT[i][0], signed[i][1] * INTO_IS_LEFT[i][1]],
                line: self.lines[i],
                inflections: self.inflections[i],
            })
            .collect();
        AsymptoticNet {
            positions: self.corners.to_vec(),
            curves,
            faces: vec![NetFace { curves: [0, 1, 2, 3], reversed: [false; 4] }],
            single: true,
            estimated: false,
        }
    }

    /// Maps the data rigidly or by any other affine map of the points; curvatures stay.
    #[must_use]
    pub fn map_points(&self, map: impl Fn(DVec3) -> DVec3) -> Self {
        Self {
            corners: self.corners.map(&map),
            start_points: self.start_points.map(&map),
            end_points: self.end_points.map(&map),
            ..self.clone()
        }
    }

    /// The same data with the roles of `u` and `v` exchanged.
    #[must_use]
    pub fn swapped(&self) -> Self {
        let curve = [1, 0, 3, 2];
        let corner = [0, 2, 1, 3];
        let k = self.curvatures.values();
        let swapped = curve.map(|i| k[i]);
        Self {
            corners: corner.map(|c| self.corners[c]),
            start_points: curve.map(|i| self.start_points[i]),
            end_points: curve.map(|i| self.end_points[i]),
            curvatures: match self.curvatures {
                Curvatures::Signed(_) => Curvatures::Signed(swapped),
                Curvatures::Unsigned(_) => Curvatures::Unsigned(swapped),
            },
            lines: curve.map(|i| self.lines[i]),
            inflections: curve.map(|i| self.inflections[i]),
        }
    }

    /// The same data with `u` running the other way.
    #[must_use]
    pub fn reversed_u(&self) -> Self {
        let curve = [0, 3, 2, 1];
        let corner = [1, 0, 3, 2];
        let k = self.curvatures.values();
        let flip = |i: usize| i == 0 || i == 2;
        let mut turned = curve.map(|i| k[i]);
        let mut start = curve.map(|i| self.start_points[i]);
        let mut end = curve.map(|i| self.end_points[i]);
        for i in (0..4).filter(|i| flip(*i)) {
            turned[i].reverse();
            std::mem::swap(&mut start[i], &mut end[i]);
        }
        Self {
            corners: corner.map(|c| self.corners[c]),
            start_points: start,
            end_points: end,
            curvatures: match self.curvatures {
                Curvatures::Signed(_) => Curvatures::Signed(turned),
                Curvatures::Unsigned(_) => Curvatures::Unsigned(turned),
            },
            lines: curve.map(|i| self.lines[i]),
            inflections: curve.map(|i| self.inflections[i]),
        }
    }
}

/// One curve of a net.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct NetCurve {
    /// Vertices at its start and end.
    pub ends: [usize; 2],
    /// `r′/5` at the start and `−r′/5` at the end: both point into the curve.
    pub arms: [DVec3; 2],
    /// Curvature at the start and the end, positive where the curve bends to the left of the arm
    /// seen against the vertex normal (the normal of counter-clockwise faces).
    pub curvatures: [f64; 2],
    /// Whether the curve is straight.
    pub line: bool,
    /// Declared number of inflections.
    pub inflections: usize,
}

/// One face of a net: `r1..r4` in the numbering of [`CornerData`], counter-clockwise as
/// `r1, r4, r3, r2`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct NetFace {
    /// Index of the curve at v = 0, u = 0, v = 1, u = 1.
    pub curves: [usize; 4],
    /// Whether that curve runs against the parameter of the face.
    pub reversed: [bool; 4],
}

/// A net of asymptotic curves: vertices, curves along its edges, quadrilateral faces.
///
/// Built from a quad mesh or out of [`CornerData`]; the constructors check the
/// incidence, so that every face closes and every curve has its two vertices.
#[derive(Clone, Debug, PartialEq)]
pub struct AsymptoticNet {
    pub(crate) positions: Vec<DVec3>,
    pub(crate) curves: Vec<NetCurve>,
    pub(crate) faces: Vec<NetFace>,
    // Messages name curves and corners as the paper does when the net is one patch.
    pub(crate) single: bool,
    // Whether tangents and curvatures were estimated from positions.
    pub(crate) estimated: bool,
}

/// End curvatures are weak below this share of the larger one: quintics become wild there.
const WEAK_CURVATURE: f64 = 0.1;

impl AsymptoticNet {
    /// Vertex positions.
    #[must_use]
    pub fn positions(&self) -> &[DVec3] {
        &self.positions
    }

    /// Curves along the edges.
    #[must_use]
    pub fn curves(&self) -> &[NetCurve] {
        &self.curves
    }

    /// Faces.
    #[must_use]
    pub fn faces(&self) -> &[NetFace] {
        &self.faces
    }

    /// From the start to the end of `curve`.
    pub(crate) fn chord(&self, curve: &NetCurve) -> DVec3 {
        self.positions[curve.ends[1]] - self.positions[curve.ends[0]]
    }

    /// Vertex of `face` at the corner `00`, `10`, `01`, `11` (0..3).
    #[must_use]
    pub fn face_corner(&self, face: &NetFace, corner: usize) -> usize {
        let (curve, end) = [(0, 0), (0, 1), (2, 0), (2, 1)][corner];
        let end = if face.reversed[curve] { 1 - end } else { end };
        self.curves[face.curves[curve]].ends[end]
    }

    /// How messages call curve `i`.
    pub(crate) fn curve_place(&self, i: usize) -> Place {
        if self.single { Place::PatchCurve(i) } else { Place::NetCurve(i) }
    }

    /// How messages call vertex `v`.
    pub(crate) fn vertex_place(&self, v: usize) -> Place {
        if self.single { Place::PatchCorner(v) } else { Place::NetVertex(v) }
    }

    /// Whether a curve has an inflection, or an end nearly without curvature.
    pub(crate) fn has_weak_curvature(&self) -> bool {
        self.curves.iter().filter(|c| !c.line).any(|c| {
            let [a, b] = c.curvatures.map(f64::abs);
            c.inflections > 0 || a.min(b) <= WEAK_CURVATURE * a.max(b)
        })
    }

    /// Refuses NaN, coincident tangents and crooked lines.
    ///
    /// # Errors
    /// The first fault found, by curve.
    pub fn check(&self) -> Result<(), Error> {
        for (v, p) in self.positions.iter().enumerate() {
            if !p.is_finite() {
                return Err(Error::NotFinite { place: self.vertex_place(v), what: "the position" });
            }
        }
        for (i, curve) in self.curves.iter().enumerate() {
            self.check_curve(self.curve_place(i), curve)?;
        }
        Ok(())
    }

    fn check_curve(&self, place: Place, curve: &NetCurve) -> Result<(), Error> {
        let chord = self.chord(curve);
        let name = ["start", "end"];
        for e in 0..2 {
            if !curve.arms[e].is_finite() {
                return Err(Error::NotFinite { place, what: "a tangent point" });
            }
            if !curve.curvatures[e].is_finite() {
                return Err(Error::NotFinite { place, what: "a curvature" });
            }
            let length = curve.arms[e].length();
            if length <= 1e-12 * chord.length().max(self.positions[curve.ends[e]].length()) {
                return Err(Error::CoincidentTangent { place, end: name[e], length });
            }
            if curve.line {
                let sine = chord.cross(curve.arms[e]).length() / (chord.length() * length);
                // Rounded input carries about twelve good digits of direction.
                if !(sine <= 1e-10) {
                    return Err(Error::LineNotStraight { place, sine });
                }
                if curve.curvatures[e] != 0.0 {
                    return Err(Error::LineWithCurvature {
                        place,
                        end: name[e],
                        curvature: curve.curvatures[e],
                    });
                }
            }
        }
        Ok(())
    }

    /// Refuses zero curvatures, and curvatures that contradict the declared inflections.
    pub(crate) fn check_curvatures(&self) -> Result<(), Error> {
        for (i, curve) in self.curves.iter().enumerate().filter(|(_, c)| !c.line) {
            let place = self.curve_place(i);
            for e in 0..2 {
                if curve.curvatures[e] == 0.0 {
                    let end = ["start", "end"][e];
                    return Err(Error::ZeroCurvature { place, end });
                }
            }
            // At the end the arm runs against the curve, so equal sides have opposite signs.
            let same_side = curve.curvatures[0] * curve.curvatures[1] < 0.0;
            if same_side != curve.inflections.is_multiple_of(2) {
                let declared = curve.inflections;
                return Err(Error::InflectionParity { place, declared });
            }
        }
        Ok(())
    }
}
