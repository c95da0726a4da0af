//! The net file: quads with shape parameters, as the hyperbolic net commands write and read it.

use crate::error::ReadError;
use crate::ron_text::{from_ron, to_ron};
use crate::unit::LengthUnit;
use geom_core::{DVec3, MeshError, PolyMesh};
use serde::{Deserialize, Serialize};

/// Quads, a rational bilinear patch over each, and the Lelieuvre normals if they are known.
///
/// Counts agree and every number is finite (checked by [`read_net`]).
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Net {
    /// What a coordinate of 1 means.
    pub unit: LengthUnit,
    /// Positions.
    pub vertices: Vec<DVec3>,
    /// Corners of each face, counter-clockwise seen from outside.
    pub quads: Vec<[u32; 4]>,
    /// One vector per vertex with `x_j − x_i = ± ν_i × ν_j` along edges; empty if unknown.
    pub normals: Vec<DVec3>,
    /// `W` of the diagonal 0–2 of each quad.
    pub shape_parameters: Vec<f64>,
}

impl Net {
    /// The quads as a mesh.
    ///
    /// # Errors
    /// [`MeshError`] names the first face, edge or vertex at fault.
    pub fn to_poly_mesh(&self) -> Result<PolyMesh, MeshError> {
        PolyMesh::new(self.vertices.clone(), &self.quads)
    }
}

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct NetText {
    #[serde(default = "millimetre")]
    unit: String,
    vertices: Vec<(f64, f64, f64)>,
    quads: Vec<(u32, u32, u32, u32)>,
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    normals: Vec<(f64, f64, f64)>,
    shape_parameters: Vec<f64>,
}

fn millimetre() -> String {
    "mm".to_owned()
}

/// Reads a net, see `docs/formats.md`.
///
/// # Errors
/// [`ReadError`] names the line, or the entry at fault.
pub fn read_net(text: &str) -> Result<Net, ReadError> {
    let net: NetText = from_ron(text)?;
    let Some(unit) = LengthUnit::from_symbol(&net.unit) else {
        let what = format!("`{}` is not a unit of length", crate::error::clip(&net.unit));
        return Err(ReadError::content(what, "use mm, cm, dm, m, km, in, ft, yd or mi"));
    };
    let vectors = |list: Vec<(f64, f64, f64)>, name: &str| {
        let list: Vec<DVec3> = list.into_iter().map(DVec3::from).collect();
        match list.iter().position(|p| !p.is_finite()) {
            Some(k) => Err(ReadError::content(
                format!("{name} {k} is {}", list[k]),
                "write three finite numbers",
            )),
            None => Ok(list),
        }
    };
    let (vertices, normals) = (vectors(net.vertices, "vertex")?, vectors(net.normals, "normal")?);
    crate::meaning::check_points("vertex", "vertices coincide, so the net", &vertices)?;
    let count = |name: &str, found: usize, needed: usize| {
        let what = format!("{found} {name} for {needed}");
        if found == needed { Ok(()) } else { Err(ReadError::content(what, "give one for each")) }
    };
    count("shape parameters of quads", net.shape_parameters.len(), net.quads.len())?;
    if !normals.is_empty() {
        count("normals of vertices", normals.len(), vertices.len())?;
    }
    let positive = |w: &f64| *w > 0.0 && *w < f64::INFINITY;
    if let Some(k) = net.shape_parameters.iter().position(|w| !positive(w)) {
        let what = format!("shape parameter {k} is {}", net.shape_parameters[k]);
        return Err(ReadError::content(what, "shape parameters are positive and finite"));
    }
    let quads = net.quads.into_iter().map(|(a, b, c, d)| [a, b, c, d]).collect();
    Ok(Net { unit, vertices, quads, normals, shape_parameters: net.shape_parameters })
}

/// The text [`read_net`] reads back to the same net, to the last bit.
///
/// # Errors
/// [`ron::Error`] does not occur for nets without NaN.
pub fn write_net(net: &Net) -> Result<String, ron::Error> {
    let tuples = |list: &[DVec3]| list.iter().map(|p| (p.x, p.y, p.z)).collect();
    to_ron(&NetText {
        unit: net.unit.to_string(),
        vertices: tuples(&net.vertices),
        quads: net.quads.iter().map(|&[a, b, c, d]| (a, b, c, d)).collect(),
        normals: tuples(&net.normals),
        shape_parameters: net.shape_parameters.clone(),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn square() -> Net {
        Net {
            vertices: vec![DVec3::ZERO, DVec3::X, DVec3::ONE, DVec3::Y / 3.0],
            quads: vec![[0, 1, 2, 3]],
            normals: vec![DVec3::Z; 4],
            shape_parameters: vec![1.1],
            ..Net::default()
        }
    }

    #[test]
    fn nets_come_back_bit_equal() {
        let net = square();
        assert_eq!(read_net(&write_net(&net).unwrap()).unwrap(), net);
        let plain = Net { normals: vec![], ..square() };
        assert_eq!(read_net(&write_net(&plain).unwrap()).unwrap(), plain);
        assert_eq!(net.to_poly_mesh().unwrap().face_count(), 1);
    }

    #[test]
    fn faults_are_named() {
        let mut net = square();
        net.shape_parameters.push(1.0);
        let error = read_net(&write_net(&net).unwrap()).unwrap_err();
        assert_eq!(error.to_string(), "2 shape parameters of quads for 1; give one for each");
        net.shape_parameters = vec![-1.0];
        let error = read_net(&write_net(&net).unwrap()).unwrap_err();
        assert!(error.to_string().starts_with("shape parameter 0 is -1"), "{error}");
        let error =
            read_net("(vertices: [(0, 0, inf)], quads: [], shape_parameters: [])").unwrap_err();
        assert!(error.to_string().starts_with("line 1: column 20: `inf`"), "{error}");
        let error = read_net("(unit: \"furlong\", vertices: [], quads: [], shape_parameters: [])");
        assert!(error.unwrap_err().to_string().contains("furlong"));
        let error = read_net("(points: [])").unwrap_err();
        assert!(error.to_string().starts_with("line 1"), "{error}");
    }
}
