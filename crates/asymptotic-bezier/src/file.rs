//! The input file: corner data of one patch, or a net of curves (see `docs/formats.md`).

use std::collections::BTreeMap;

use geom_core::DVec3;
use serde::{Deserialize, Serialize};

use crate::boundary::options::TorsionHandle;
use crate::data::corners::{AsymptoticNet, CornerData, Curvatures, NetCurve};
use crate::data::vertex::{arm_signs, bilinear_torsions, vertex_frames};
use crate::design::Input;
use crate::error::AsymptoticError;

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

/// A wish for the torsion at a corner.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub enum TorsionWish {
    /// This value, in 1/length.
    Fixed(f64),
    /// Between two values.
    Between(f64, f64),
    /// The Gaussian curvature (at most zero) and the sign of the torsion; zero takes the twist of
    /// the vertices around.
    Gaussian(f64, f64),
    /// The Gaussian curvature between two values, and the sign.
    GaussianBetween(f64, f64, f64),
}

impl TorsionWish {
    /// What no vertex can have.
    fn fault(self) -> Option<String> {
        let numbers: &[f64] = match &self {
            Self::Fixed(tau) => &[*tau],
            Self::Between(min, max) => &[*min, *max],
            Self::Gaussian(k, sign) => &[*k, *sign],
            Self::GaussianBetween(min, max, sign) => &[*min, *max, *sign],
        };
        if numbers.iter().any(|n| n.is_nan()) {
            return Some("a number is NaN; give numbers".into());
        }
        match self {
            Self::Gaussian(k, _) | Self::GaussianBetween(_, k, _) if k > 0.0 => Some(format!(
                "the Gaussian curvature {k} is above zero, but it is minus the torsion squared; give at most 0"
            )),
            _ => None,
        }
    }

    /// The handle; `sign` is that of the torsion where the wish leaves it open.
    fn handle(self, sign: f64) -> TorsionHandle {
        let open = |wished: f64| if wished == 0.0 { sign } else { wished };
        match self {
            Self::Fixed(tau) => TorsionHandle::Fixed(tau),
            Self::Between(min, max) => TorsionHandle::Between(min, max),
            Self::Gaussian(k, wished) => TorsionHandle::gaussian(k, open(wished)),
            Self::GaussianBetween(min, max, wished) => {
                TorsionHandle::gaussian_between(min, max, open(wished))
            }
        }
    }
}

/// The torsion handles per corner or vertex that wishes by corner name or vertex number stand for.
///
/// Wishes for the Gaussian curvature that leave the sign of the torsion open (zero) get that of
/// the bilinear patches over the vertices.
///
/// # Errors
/// [`AsymptoticError::Data`] names the wish without a corner or vertex.
pub fn torsion_handles(
    input: &Input,
    wishes: &BTreeMap<String, TorsionWish>,
) -> Result<Vec<TorsionHandle>, AsymptoticError> {
    if wishes.is_empty() {
        return Ok(Vec::new());
    }
    let twists = match input {
        Input::Patch(data) => twist_signs(&data.to_net(data.curvatures.values())),
        Input::Net(net) => twist_signs(net),
    };
    let mut handles = vec![TorsionHandle::Free; twists.len()];
    for (name, wish) in wishes {
        let found = match input {
            Input::Patch(_) => CORNERS.iter().position(|c| c == name),
            Input::Net(_) => name.parse::<usize>().ok().filter(|v| *v < handles.len()),
        };
        let Some(v) = found else {
            let names = if matches!(input, Input::Patch(_)) {
                "use 00, 10, 01 or 11".to_owned()
            } else {
                format!("use a vertex number below {}", handles.len())
            };
            return refuse(&format!("`torsions` has \"{name}\"; {names}"));
        };
        if let Some(message) = wish.fault() {
            return refuse(&format!("`torsions` of \"{name}\": {message}"));
        }
        handles[v] = wish.handle(twists[v]);
    }
    Ok(handles)
}

/// Signs of the torsions that the bilinear patches of a net have; data at fault give `+1`, the
/// solver names the fault.
fn twist_signs(net: &AsymptoticNet) -> Vec<f64> {
    let mut projected = net.clone();
    match vertex_frames(&mut projected, f64::INFINITY) {
        Ok(frames) => {
            let torsions = bilinear_torsions(net, &arm_signs(net, &frames), &frames);
            torsions.into_iter().map(f64::signum).collect()
        }
        Err(_) => vec![1.0; net.positions().len()],
    }
}

const CORNERS: [&str; 4] = ["00", "10", "01", "11"];

impl DataFile {
    /// The input this file describes, and the torsion handles per corner or vertex.
    ///
    /// # Errors
    /// [`AsymptoticError::Data`] names the field that is missing or contradictory; nets are
    /// checked as by [`AsymptoticNet::new`].
    pub fn input(&self) -> Result<(Input, Vec<TorsionHandle>), AsymptoticError> {
        let is_net = self.vertices.is_some() || self.quads.is_some() || self.curves.is_some();
        let is_patch = self.corners.is_some();
        let input = match (is_net, is_patch) {
            (true, true) => refuse("both `X` and `vertices` are given; keep one of patch and net"),
            (false, false) => {
                refuse("neither `X` nor `vertices` is given; one of patch and net is needed")
            }
            (true, false) => self.net(),
            (false, true) => self.patch(),
        }?;
        let handles = torsion_handles(&input, &self.torsions)?;
        Ok((input, handles))
    }

    fn patch(&self) -> Result<Input, AsymptoticError> {
        let corners = self.corners.as_ref().ok_or_else(|| missing("X"))?;
        let mut x = [DVec3::ZERO; 4];
        for (c, name) in CORNERS.iter().enumerate() {
            let Some(point) = corners.get(*name) else {
                return refuse(&format!("`X` has no corner \"{name}\"; 00, 10, 01, 11 are needed"));
            };
            x[c] = DVec3::from_array(*point);
        }
        if corners.len() > 4 {
            return refuse("`X` has more than the corners 00, 10, 01, 11; drop the others");
        }
        let points = |p: Option<[[f64; 3]; 4]>, name: &str| {
            p.map(|p| p.map(DVec3::from_array)).ok_or_else(|| missing(name))
        };
        let curvatures = match (self.signed_k, self.unsigned_k) {
            (Some(k), None) => Curvatures::Signed(k),
            (None, Some(k)) => Curvatures::Unsigned(k),
            (None, None) => return Err(missing("signed_k` or `unsigned_k")),
            (Some(_), Some(_)) => {
                return refuse("both `signed_k` and `unsigned_k` are given; keep one");
            }
        };
        let data = CornerData {
            corners: x,
            start_points: points(self.start_points, "P_i1")?,
            end_points: points(self.end_points, "P_i4")?,
            curvatures,
            lines: self.lines.unwrap_or_default(),
            inflections: self.inflections.unwrap_or_default(),
        };
        Ok(Input::Patch(Box::new(data)))
    }

    fn net(&self) -> Result<Input, AsymptoticError> {
        let vertices = self.vertices.as_ref().ok_or_else(|| missing("vertices"))?;
        let quads = self.quads.as_ref().ok_or_else(|| missing("quads"))?;
        let curves = self.curves.as_ref().ok_or_else(|| missing("curves"))?;
        let positions: Vec<DVec3> = vertices.iter().map(|p| DVec3::from_array(*p)).collect();
        for (i, v) in curves.iter().enumerate().flat_map(|(i, c)| c.ends.map(|v| (i, v))) {
            if v >= positions.len() {
                return refuse(&format!(
                    "curve {i} ends at vertex {v}, but there are {} vertices",
                    positions.len()
                ));
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
        Ok(Input::Net(AsymptoticNet::new(positions, quads, curves)?))
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

fn refuse<T>(message: &str) -> Result<T, AsymptoticError> {
    Err(AsymptoticError::Data { message: message.to_owned() })
}

fn missing(field: &str) -> AsymptoticError {
    AsymptoticError::Data { message: format!("field `{field}` is missing; add it") }
}
