//! The layout of geomdl 5: `{"shape": {"type": "surface", "data": [...]}}`.

use super::fault::{fault, refused};
use crate::error::ReadError;
use crate::model::{Model, NamedSurface};
use crate::wrapped::{Direction, unwrap, wrapped};
use bspline::{BsplineSurface, Degree, SplineError};
use geom_core::DVec3;
use serde::{Deserialize, Serialize};

#[derive(Deserialize, Serialize)]
struct File {
    shape: Shape,
}

#[derive(Deserialize, Serialize)]
struct Shape {
    #[serde(rename = "type")]
    kind: String,
    count: usize,
    data: Vec<Surface>,
}

#[derive(Deserialize, Serialize)]
struct Surface {
    #[serde(default, skip_serializing_if = "String::is_empty")]
    name: String,
    #[serde(default)]
    rational: bool,
    #[serde(default = "three")]
    dimension: usize,
    degree_u: usize,
    degree_v: usize,
    knotvector_u: Vec<f64>,
    knotvector_v: Vec<f64>,
    size_u: usize,
    size_v: usize,
    control_points: ControlPoints,
    #[serde(default = "default_delta", skip_deserializing)]
    delta: [f64; 2],
}

fn three() -> usize {
    3
}

/// How densely geomdl evaluates the surface.
fn default_delta() -> [f64; 2] {
    [0.02, 0.02]
}

#[derive(Deserialize, Serialize)]
struct ControlPoints {
    points: Vec<[f64; 3]>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    weights: Option<Vec<f64>>,
}

pub(super) fn read(text: &str) -> Result<Model, ReadError> {
    let file: File = serde_json::from_str(text).map_err(|e| fault(&e))?;
    if file.shape.kind != "surface" {
        let what = format!("a geomdl file of type `{}`", crate::error::clip(&file.shape.kind));
        return Err(ReadError::content(what, "only surfaces are read"));
    }
    let mut model = Model::default();
    for (k, surface) in file.shape.data.into_iter().enumerate() {
        let title = format!("surface {}", k + 1);
        let name = surface.name.clone();
        let surface = build(surface).map_err(|e| refused(&title, &e.to_string()))?;
        model.surfaces.push(NamedSurface::new(name, surface));
    }
    if model.surfaces.is_empty() {
        return Err(ReadError::content("the file has no surface", "export one"));
    }
    Ok(model)
}

fn build(surface: Surface) -> Result<BsplineSurface, SplineError> {
    let direction = |degree, knots, n| -> Result<Direction, SplineError> {
        let direction = Direction::new(Degree::new(degree)?, knots, true, n)?;
        let needed = direction.control_count();
        if needed == n {
            Ok(direction)
        } else {
            Err(SplineError::ControlPointCount { needed, found: n })
        }
    };
    let u = direction(surface.degree_u, surface.knotvector_u, surface.size_u)?;
    let v = direction(surface.degree_v, surface.knotvector_v, surface.size_v)?;
    let points: Vec<DVec3> = surface.control_points.points.into_iter().map(DVec3::from).collect();
    let weights = surface.control_points.weights.filter(|_| surface.rational);
    unwrap(&u, &v, &points, weights.as_deref())
}

/// Surfaces as geomdl's `import_json` reads them.
#[must_use]
pub fn write_geomdl(surfaces: &[NamedSurface]) -> String {
    let data: Vec<Surface> = surfaces.iter().map(text).collect();
    let file = File { shape: Shape { kind: "surface".into(), count: data.len(), data } };
    // Plain structs of numbers: this cannot fail.
    serde_json::to_string(&file).unwrap_or_default() + "\n"
}

fn text(named: &NamedSurface) -> Surface {
    let surface = &named.surface;
    let (u, v) = (wrapped(surface.knots_u()), wrapped(surface.knots_v()));
    let n_v = surface.n_v();
    let order = || u.iter().flat_map(|i| v.iter().map(move |j| i * n_v + j));
    Surface {
        name: named.name.clone(),
        rational: surface.is_rational(),
        dimension: 3,
        degree_u: surface.degree_u().get(),
        degree_v: surface.degree_v().get(),
        knotvector_u: surface.knots_u().knots().to_vec(),
        knotvector_v: surface.knots_v().knots().to_vec(),
        size_u: u.len(),
        size_v: v.len(),
        control_points: ControlPoints {
            points: order().map(|k| surface.control_points()[k].to_array()).collect(),
            weights: surface.weights().map(|w| order().map(|k| w[k]).collect()),
        },
        delta: default_delta(),
    }
}
