//! The two meshes of a quad mesh's diagonals.

use crate::half_edges::MeshError;
use crate::poly_mesh::{PolyMesh, VertexId};

/// Why a mesh has no meshes of diagonals.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
#[expect(missing_docs, reason = "the messages spell out every field")]
pub enum DiagonalError {
    /// A face that is not a quad.
    #[error("face {face} has {corners} corners; only quads have two diagonals")]
    NotQuad { face: usize, corners: usize },
    /// A loop of an odd number of edges.
    #[error(
        "the vertices cannot be coloured alternately (found at edge {from}–{to}), so the diagonals are one mesh and not two; cut the mesh along a line that crosses the loop"
    )]
    NotTwoColourable { from: usize, to: usize },
    /// No inner vertex of the colour, or faces that hang together by corners only.
    #[error(transparent)]
    Mesh(#[from] MeshError),
}

/// The meshes of the diagonals of a mesh of quads.
///
/// Vertices are coloured alternately. Each inner vertex of one colour becomes a face whose corners
/// are its neighbours, which have the other: so faces have as many corners as these vertices have
/// edges, and their edges are the diagonals of the quads. The first mesh keeps vertices of the colour
/// of the first corner of the first face (of every part).
///
/// # Errors
/// [`DiagonalError`].
///
/// # Example
/// ```
/// use geom_core::{DVec3, PolyMesh, diagonal_meshes};
/// let points = (0..25).map(|k| DVec3::new(f64::from(k / 5), f64::from(k % 5), 0.0)).collect();
/// let corner = |k: u32| k / 4 * 5 + k % 4;
/// let quads: Vec<[u32; 4]> =
///     (0..16).map(corner).map(|a| [a, a + 5, a + 6, a + 1]).collect();
/// let [even, odd] = diagonal_meshes(&PolyMesh::new(points, &quads)?)?;
/// // Five and four of the nine inner vertices are faces of the other mesh.
/// assert_eq!((even.face_count(), odd.face_count()), (4, 5));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn diagonal_meshes(mesh: &PolyMesh) -> Result<[PolyMesh; 2], DiagonalError> {
    for f in mesh.faces() {
        let corners = mesh.face_degree(f);
        if corners != 4 {
            return Err(DiagonalError::NotQuad { face: f.index(), corners });
        }
    }
    let colours = colours(mesh)?;
    let of = |kept: bool| -> Result<PolyMesh, MeshError> {
        let mut numbers = vec![u32::MAX; mesh.vertex_count()];
        let (mut positions, mut faces) = (Vec::new(), Vec::new());
        for v in mesh.vertices() {
            let is_face = colours[v.index()] == Some(!kept) && !mesh.is_boundary_vertex(v);
            if !is_face {
                continue;
            }
            let mut corners: Vec<u32> = mesh
                .ring(v)
                .map(|w| {
                    let number = &mut numbers[w.index()];
                    if *number == u32::MAX {
                        *number = positions.len() as u32;
                        positions.push(mesh.position(w));
                    }
                    *number
                })
                .collect();
            // A walk around a vertex runs clockwise.
            corners.reverse();
            faces.push(corners);
        }
        PolyMesh::new(positions, &faces)
    };
    Ok([of(true)?, of(false)?])
}

/// Alternate colours, the first corner of every part `true`; `None` for vertices without a face.
fn colours(mesh: &PolyMesh) -> Result<Vec<Option<bool>>, DiagonalError> {
    let mut colours: Vec<Option<bool>> = vec![None; mesh.vertex_count()];
    for f in mesh.faces() {
        let Some(first) = mesh.face_vertices(f).next() else { continue };
        if colours[first.index()].is_some() {
            continue;
        }
        colours[first.index()] = Some(true);
        let mut open: Vec<VertexId> = vec![first];
        while let Some(v) = open.pop() {
            let own = colours[v.index()];
            for w in mesh.ring(v) {
                match colours[w.index()] {
                    None => {
                        colours[w.index()] = own.map(|c| !c);
                        open.push(w);
                    }
                    other if other == own => {
                        let (from, to) = (v.index(), w.index());
                        return Err(DiagonalError::NotTwoColourable { from, to });
                    }
                    _ => {}
                }
            }
        }
    }
    Ok(colours)
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::DVec3;

    #[test]
    fn faces_run_the_same_way_round() {
        let points = (0..49).map(|k| DVec3::new(f64::from(k / 7), f64::from(k % 7), 0.0));
        let corner = |k: u32| k / 6 * 7 + k % 6;
        let quads: Vec<[u32; 4]> = (0..36).map(corner).map(|a| [a, a + 7, a + 8, a + 1]).collect();
        let mesh = PolyMesh::new(points.collect(), &quads).unwrap();
        for net in diagonal_meshes(&mesh).unwrap() {
            for f in net.faces() {
                let [a, b, c, d]: [DVec3; 4] = net
                    .face_vertices(f)
                    .map(|v| net.position(v))
                    .collect::<Vec<_>>()
                    .try_into()
                    .unwrap();
                assert!((c - a).cross(d - b).z > 0.0);
                assert!((a.distance(b) - 2_f64.sqrt()).abs() < 1e-12);
            }
        }
    }

    #[test]
    fn triangles_and_odd_rings_are_refused() {
        let points = vec![DVec3::ZERO, DVec3::X, DVec3::Y];
        let triangle = PolyMesh::new(points, &[[0, 1, 2]]).unwrap();
        let error = diagonal_meshes(&triangle).unwrap_err();
        assert_eq!(error.to_string(), "face 0 has 3 corners; only quads have two diagonals");
        // Three quads around a tube.
        let point = |k: u32| {
            let angle = f64::from(k % 3) * 2.1;
            DVec3::new(angle.cos(), angle.sin(), f64::from(k / 3))
        };
        let quads: Vec<[u32; 4]> =
            (0..3).map(|k| [k, (k + 1) % 3, 3 + (k + 1) % 3, 3 + k]).collect();
        let tube = PolyMesh::new((0..6).map(point).collect(), &quads).unwrap();
        let error = diagonal_meshes(&tube).unwrap_err();
        assert!(matches!(error, DiagonalError::NotTwoColourable { .. }), "{error}");
    }
}
