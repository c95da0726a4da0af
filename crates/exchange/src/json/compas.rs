//! The layout of COMPAS 2: `{"dtype": "compas.datastructures/Mesh", "data": {...}}`, or a list of
//! such objects. Rows of a NURBS surface run along u: `points[j][i]`.

use super::fault::{fault, refused};
use crate::error::{ReadError, clip};
use crate::mesh::Mesh;
use crate::model::{Model, NamedSurface};
use crate::wrapped::{Direction, unwrap, wrapped};
use bspline::{BsplineSurface, Degree, KnotVector, SplineError};
use geom_core::DVec3;
use serde::de::{Error, Visitor};
use serde::{Deserialize, Deserializer};
use serde_json::{Value, json};
use std::collections::BTreeMap;
use std::fmt;

#[derive(Deserialize)]
struct Item {
    dtype: String,
    #[serde(default)]
    name: Option<String>,
    /// COMPAS 1 called it `value`.
    #[serde(alias = "value")]
    data: Data,
}

/// The data of a mesh or of a NURBS surface; their keys do not overlap.
#[derive(Default, Deserialize)]
#[serde(default)]
struct Data {
    attributes: Attributes,
    vertex: BTreeMap<Key, Vertex>,
    face: BTreeMap<Key, Vec<Key>>,
    points: Vec<Vec<[f64; 3]>>,
    weights: Option<Vec<Vec<f64>>>,
    knots_u: Vec<f64>,
    knots_v: Vec<f64>,
    mults_u: Vec<usize>,
    mults_v: Vec<usize>,
    degree_u: usize,
    degree_v: usize,
    is_periodic_u: bool,
    is_periodic_v: bool,
}

#[derive(Default, Deserialize)]
#[serde(default)]
struct Attributes {
    name: Option<String>,
}

#[derive(Default, Deserialize)]
#[serde(default)]
struct Vertex {
    x: f64,
    y: f64,
    z: f64,
}

/// The number of a vertex or face, which is a text where JSON allows nothing else.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
struct Key(u64);

impl<'de> Deserialize<'de> for Key {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct KeyVisitor;
        impl Visitor<'_> for KeyVisitor {
            type Value = Key;

            fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.write_str("the number of a vertex or face")
            }

            fn visit_u64<E: Error>(self, number: u64) -> Result<Key, E> {
                Ok(Key(number))
            }

            fn visit_str<E: Error>(self, text: &str) -> Result<Key, E> {
                let wrong = || E::custom(format!("`{}` is not a number", clip(text)));
                text.parse().map(Key).map_err(|_| wrong())
            }
        }
        deserializer.deserialize_any(KeyVisitor)
    }
}

pub(super) fn read(text: &str) -> Result<Model, ReadError> {
    let items: Vec<Item> = if text.trim_start().starts_with('[') {
        serde_json::from_str(text).map_err(|e| fault(&e))?
    } else {
        vec![serde_json::from_str(text).map_err(|e| fault(&e))?]
    };
    let mut model = Model::default();
    for (k, item) in items.into_iter().enumerate() {
        let title = format!("item {}", k + 1);
        let kind = item.dtype.rsplit('/').next().unwrap_or_default();
        match kind {
            "Mesh" => model.meshes.push(mesh(item, &title)?),
            // Plug-ins put their own names before it, as in OCCNurbsSurface.
            _ if kind.ends_with("NurbsSurface") => {
                let name = item.name.clone().unwrap_or_default();
                let surface = surface(item.data, &title)?;
                model.surfaces.push(NamedSurface::new(name, surface));
            }
            other => model.warnings.push(format!("{title} is a {} and left out", clip(other))),
        }
    }
    if model.meshes.is_empty() && model.surfaces.is_empty() {
        let what = "the file has neither a Mesh nor a NurbsSurface";
        return Err(ReadError::content(what, "export one of them"));
    }
    Ok(model)
}

/// Vertices and faces in the order of their numbers.
fn mesh(item: Item, title: &str) -> Result<Mesh, ReadError> {
    let (keys, vertices): (Vec<Key>, Vec<Vertex>) = item.data.vertex.into_iter().unzip();
    let mut mesh = Mesh {
        name: item.name.or(item.data.attributes.name).unwrap_or_default(),
        positions: vertices.iter().map(|v| DVec3::new(v.x, v.y, v.z)).collect(),
        ..Mesh::default()
    };
    if mesh.positions.is_empty() {
        return Err(ReadError::content(
            format!("{title}: the mesh has no vertex"),
            "export it again",
        ));
    }
    let mut corners = Vec::new();
    for (f, face) in item.data.face.into_values().enumerate() {
        corners.clear();
        for key in face {
            let Ok(index) = keys.binary_search(&key) else {
                let what = format!("{title}: face {f} names vertex {}, which is not there", key.0);
                return Err(ReadError::content(what, "export the mesh again"));
            };
            corners.push(index as u32);
        }
        if corners.len() < 3 {
            let what = format!("{title}: face {f} has {} corners", corners.len());
            return Err(ReadError::content(what, "a face needs at least 3"));
        }
        mesh.faces.push(&corners);
    }
    Ok(mesh)
}

fn surface(data: Data, title: &str) -> Result<BsplineSurface, ReadError> {
    let fail = |what: &str, mend: &str| Err(ReadError::content(format!("{title}: {what}"), mend));
    if data.is_periodic_u || data.is_periodic_v {
        return fail("the surface is stored as periodic", "store it with open knots");
    }
    let rows = data.points.len();
    let columns = data.points.first().map_or(0, Vec::len);
    if columns == 0 || data.points.iter().any(|row| row.len() != columns) {
        return fail("the rows of points are empty or of unequal length", "make them equal");
    }
    let weights = data.weights.unwrap_or_else(|| vec![vec![1.0; columns]; rows]);
    if weights.len() != rows || weights.iter().any(|row| row.len() != columns) {
        return fail("the weights do not fit the points", "give one weight for each point");
    }
    let sums = |m: &[usize]| m.iter().fold(0_usize, |sum, m| sum.saturating_add(*m));
    let count = |m: &[usize], degree: usize| sums(m).checked_sub(degree.saturating_add(1));
    let (n_u, n_v) = (count(&data.mults_u, data.degree_u), count(&data.mults_v, data.degree_v));
    // COMPAS stores rows along u; some of its plug-ins store rows along v.
    let (n_u, n_v, along_u) = match (n_u, n_v) {
        (Some(u), Some(v)) if (u, v) == (columns, rows) => (u, v, true),
        (Some(u), Some(v)) if (u, v) == (rows, columns) => (u, v, false),
        _ => return fail("the multiplicities do not fit the points", "export it again"),
    };
    let knots = |knots: &[f64], mults: &[usize]| -> Option<Vec<f64>> {
        let pairs = knots.iter().zip(mults);
        (knots.len() == mults.len())
            .then(|| pairs.flat_map(|(t, m)| std::iter::repeat_n(*t, *m)).collect())
    };
    let (Some(knots_u), Some(knots_v)) =
        (knots(&data.knots_u, &data.mults_u), knots(&data.knots_v, &data.mults_v))
    else {
        return fail("there is not one multiplicity for each knot", "export it again");
    };
    let at = |i: usize, j: usize| if along_u { (j, i) } else { (i, j) };
    let order = || (0..n_u).flat_map(|i| (0..n_v).map(move |j| (i, j)));
    let pick = |(i, j)| -> DVec3 {
        let (row, column) = at(i, j);
        data.points[row][column].into()
    };
    let points: Vec<DVec3> = order().map(pick).collect();
    let weight = |(i, j)| {
        let (row, column) = at(i, j);
        weights[row][column]
    };
    let weights: Vec<f64> = order().map(weight).collect();
    // COMPAS has weights on every surface.
    let rational = weights.iter().any(|w| *w != 1.0);
    let build = || -> Result<BsplineSurface, SplineError> {
        let u = Direction::new(Degree::new(data.degree_u)?, knots_u, true, n_u)?;
        let v = Direction::new(Degree::new(data.degree_v)?, knots_v, true, n_v)?;
        unwrap(&u, &v, &points, rational.then_some(weights.as_slice()))
    };
    build().map_err(|e| refused(title, &e.to_string()))
}

/// Meshes and surfaces as `compas.json_load` reads them: one object, or a list of several.
#[must_use]
pub fn write_compas(model: &Model) -> String {
    let meshes = model.meshes.iter().map(mesh_text);
    let mut items: Vec<Value> = meshes.chain(model.surfaces.iter().map(surface_text)).collect();
    let file = if items.len() == 1 { items.remove(0) } else { Value::Array(items) };
    file.to_string() + "\n"
}

fn mesh_text(mesh: &Mesh) -> Value {
    let vertices = mesh.positions.iter().enumerate();
    let vertex: serde_json::Map<String, Value> =
        vertices.map(|(k, p)| (k.to_string(), json!({ "x": p.x, "y": p.y, "z": p.z }))).collect();
    let face: serde_json::Map<String, Value> =
        mesh.faces.iter().enumerate().map(|(k, f)| (k.to_string(), json!(f))).collect();
    json!({
        "dtype": "compas.datastructures/Mesh",
        "name": mesh.name,
        "data": {
            "attributes": {},
            "default_vertex_attributes": { "x": 0.0, "y": 0.0, "z": 0.0 },
            "default_edge_attributes": {},
            "default_face_attributes": {},
            "vertex": vertex,
            "face": face,
            "facedata": {},
            "edgedata": {},
            "max_vertex": mesh.positions.len() as i64 - 1,
            "max_face": mesh.faces.len() as i64 - 1,
        }
    })
}

fn surface_text(named: &NamedSurface) -> Value {
    let surface = &named.surface;
    let (u, v) = (wrapped(surface.knots_u()), wrapped(surface.knots_v()));
    let n_v = surface.n_v();
    let points: Vec<Vec<[f64; 3]>> = v
        .iter()
        .map(|j| u.iter().map(|i| surface.control_points()[i * n_v + j].to_array()).collect())
        .collect();
    let weight = |k: usize| surface.weights().map_or(1.0, |w| w[k]);
    let weights: Vec<Vec<f64>> =
        v.iter().map(|j| u.iter().map(|i| weight(i * n_v + j)).collect()).collect();
    let split = |knots: &KnotVector| -> (Vec<f64>, Vec<usize>) {
        knots.multiplicities().into_iter().unzip()
    };
    let ((knots_u, mults_u), (knots_v, mults_v)) =
        (split(surface.knots_u()), split(surface.knots_v()));
    json!({
        "dtype": "compas.geometry/NurbsSurface",
        "name": named.name,
        "data": {
            "points": points, "weights": weights,
            "knots_u": knots_u, "knots_v": knots_v, "mults_u": mults_u, "mults_v": mults_v,
            "degree_u": surface.degree_u().get(), "degree_v": surface.degree_v().get(),
            "is_periodic_u": false, "is_periodic_v": false,
        }
    })
}
