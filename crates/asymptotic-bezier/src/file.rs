//! The input file: corner data of one patch, or a net of curves (see `docs/formats.md`).

use std::collections::BTreeMap;

use geom_core::DVec3;
use serde::{Deserialize, Serialize};

use crate::data::corners::{AsymptoticNet, CornerData, Curvatures, NetCurve};
use crate::error::Error;
use crate::faults::DataFault;
use crate::input::{Input, InputData};
use crate::wishes::{CORNERS, TorsionWish};

/// Content of an input file. Either the fields of a patch (`X`, `P_i1`, `P_i4` and `signed_k` or
/// `unsigned_k`) or those of a net (`vertices`, `quads`, `curves`) are there.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct DataFile {
    /// A name for people.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub name: Option<String>,
    /// Symbol of the length unit (`mm` when absent).
    #[serde(skip_serializing_if = "Option::is_none")]
    pub unit: Option<String>,
    /// Corners by name, `"00"`, `"10"`, `"01"`, `"11"`.
    #[serde(rename = "X", skip_serializing_if = "Option::is_none")]
    pub corners: Option<BTreeMap<String, [f64; 3]>>,
    /// Second control point of `r1..r4`.
    #[serde(rename = "P_i1", skip_serializing_if = "Option::is_none")]
    pub start_points: Option<[[f64; 3]; 4]>,
    /// Last but one control point of `r1..r4`.
    #[serde(rename = "P_i4", skip_serializing_if = "Option::is_none")]
    pub end_points: Option<[[f64; 3]; 4]>,
    /// Curvatures at start and end, positive into the patch.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub signed_k: Option<[[f64; 2]; 4]>,
    /// Curvatures without signs.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub unsigned_k: Option<[[f64; 2]; 4]>,
    /// Which of `r1..r4` are straight.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub lines: Option<[bool; 4]>,
    /// Number of inflections of `r1..r4`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub inflections: Option<[usize; 4]>,
    /// Wishes for the torsion of the u-curves, by corner name or vertex number.
    #[serde(skip_serializing_if = "BTreeMap::is_empty")]
    pub torsions: BTreeMap<String, TorsionWish>,
    /// Vertices of a net.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub vertices: Option<Vec<[f64; 3]>>,
    /// Faces of a net, counter-clockwise.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub quads: Option<Vec<[usize; 4]>>,
    /// Curves of a net.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub curves: Option<Vec<FileCurve>>,
}

/// One curve of a net.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct FileCurve {
    /// Vertices at its start and end.
    pub ends: [usize; 2],
    /// Second control point of the quintic.
    #[serde(rename = "P_1")]
    pub start_point: [f64; 3],
    /// Last but one control point.
    #[serde(rename = "P_4")]
    pub end_point: [f64; 3],
    /// Curvature at both ends, positive to the left of the tangent that points into the curve,
    /// seen against the normal of counter-clockwise faces.
    #[serde(default)]
    pub k: [f64; 2],
    /// Whether the curve is straight.
    #[serde(default)]
    pub line: bool,
    /// Number of inflections.
    #[serde(default)]
    pub inflections: usize,
}

impl DataFile {
    /// The input this file describes, with its wishes.
    ///
    /// # Errors
    /// [`Error::Data`] names the field that is missing or contradictory; nets are checked as by
    /// [`AsymptoticNet::new`].
    pub fn input(&self) -> Result<Input, Error> {
        let is_net = self.vertices.is_some() || self.quads.is_some() || self.curves.is_some();
        let is_patch = self.corners.is_some();
        let data = match (is_net, is_patch) {
            (true, true) => Err(DataFault::PatchAndNet.into()),
            (false, false) => Err(DataFault::Empty.into()),
            (true, false) => self.net(),
            (false, true) => self.patch(),
        }?;
        Ok(Input { data, torsions: self.torsions.clone() })
    }

    fn patch(&self) -> Result<InputData, Error> {
        let corners = self.corners.as_ref().ok_or_else(|| missing("X"))?;
        let mut x = [DVec3::ZERO; 4];
        for (c, name) in CORNERS.iter().enumerate() {
            let Some(point) = corners.get(*name) else {
                return Err(DataFault::NoCorner { name }.into());
            };
            x[c] = DVec3::from_array(*point);
        }
        if corners.len() > 4 {
            return Err(DataFault::MoreCorners.into());
        }
        let points = |p: Option<[[f64; 3]; 4]>, name: &'static str| {
            p.map(|p| p.map(DVec3::from_array)).ok_or_else(|| missing(name))
        };
        let curvatures = match (self.signed_k, self.unsigned_k) {
            (Some(k), None) => Curvatures::Signed(k),
            (None, Some(k)) => Curvatures::Unsigned(k),
            (None, None) => return Err(DataFault::NoCurvatures.into()),
            (Some(_), Some(_)) => return Err(DataFault::TwoCurvatures.into()),
        };
        let data = CornerData {
            corners: x,
            start_points: points(self.start_points, "P_i1")?,
            end_points: points(self.end_points, "P_i4")?,
            curvatures,
            lines: self.lines.unwrap_or_default(),
            inflections: self.inflections.unwrap_or_default(),
        };
        Ok(InputData::Patch(Box::new(data)))
    }

    fn net(&self) -> Result<InputData, Error> {
        let vertices = self.vertices.as_ref().ok_or_else(|| missing("vertices"))?;
        let quads = self.quads.as_ref().ok_or_else(|| missing("quads"))?;
        let curves = self.curves.as_ref().ok_or_else(|| missing("curves"))?;
        let positions: Vec<DVec3> = vertices.iter().map(|p| DVec3::from_array(*p)).collect();
        for (i, v) in curves.iter().enumerate().flat_map(|(i, c)| c.ends.map(|v| (i, v))) {
            if v >= positions.len() {
                let vertices = positions.len();
                return Err(DataFault::NoVertex { curve: i, vertex: v, vertices }.into());
            }
        }
        let curves = curves
            .iter()
            .map(|c| NetCurve {
                ends: c.ends,
                arms: [
                    DVec3::from_array(c.start_point) - positions[c.ends[0]],
                    DVec3::from_array(c.end_point) - positions[c.ends[1]],
                ],
                curvatures: c.k,
                line: c.line,
                inflections: c.inflections,
            })
            .collect();
        Ok(InputData::Net(AsymptoticNet::new(positions, quads, curves)?))
    }

    /// The file that describes `data`.
    #[must_use]
    pub fn from_patch(data: &CornerData) -> Self {
        let corners = CORNERS.iter().zip(data.corners);
        let (signed_k, unsigned_k) = match data.curvatures {
            Curvatures::Signed(k) => (Some(k), None),
            Curvatures::Unsigned(k) => (None, Some(k)),
        };
        Self {
            corners: Some(corners.map(|(c, x)| ((*c).to_owned(), x.to_array())).collect()),
            start_points: Some(data.start_points.map(|p| p.to_array())),
            end_points: Some(data.end_points.map(|p| p.to_array())),
            signed_k,
            unsigned_k,
            lines: data.lines.contains(&true).then_some(data.lines),
            inflections: (data.inflections != [0; 4]).then_some(data.inflections),
            ..Self::default()
        }
    }

    /// The file that describes `net`.
    #[must_use]
    pub fn from_net(net: &AsymptoticNet) -> Self {
        let tip = |c: &NetCurve, e: usize| (net.positions()[c.ends[e]] + c.arms[e]).to_array();
        Self {
            vertices: Some(net.positions().iter().map(|p| p.to_array()).collect()),
            quads: Some(
                net.faces()
                    .iter()
                    .map(|f| [0, 1, 3, 2].map(|corner| net.face_corner(f, corner)))
                    .collect(),
            ),
            curves: Some(
                net.curves()
                    .iter()
                    .map(|c| FileCurve {
                        ends: c.ends,
                        start_point: tip(c, 0),
                        end_point: tip(c, 1),
                        k: c.curvatures,
                        line: c.line,
                        inflections: c.inflections,
                    })
                    .collect(),
            ),
            ..Self::default()
        }
    }
}

fn missing(field: &'static str) -> Error {
    DataFault::Missing { field }.into()
}
