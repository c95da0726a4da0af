//! Limit points, tangents and normals at the vertices.

use crate::characteristic::limit_masks;
use crate::surface::SubdivisionSurface;
use geom_core::{DVec3, PolyMesh, VertexId};

/// Limit position of a vertex and two tangents there, as linear functions of the control points,
/// each a list of `(vertex, weight)`.
#[derive(Clone, Debug, PartialEq)]
pub struct LimitFrame {
    /// Limit position; the weights sum to one.
    pub position: Vec<(u32, f64)>,
    /// Two independent tangents whose cross product points along the normal.
    pub tangents: [Vec<(u32, f64)>; 2],
}

impl LimitFrame {
    /// The limit point.
    #[must_use]
    pub fn point(&self, positions: &[DVec3]) -> DVec3 {
        combine(&self.position, positions)
    }

    /// The unit normal; NaN where the surface is singular.
    #[must_use]
    pub fn normal(&self, positions: &[DVec3]) -> DVec3 {
        let [a, b] = &self.tangents;
        let normal = combine(a, positions).cross(combine(b, positions));
        normal / normal.length()
    }
}

fn combine(weights: &[(u32, f64)], positions: &[DVec3]) -> DVec3 {
    weights.iter().map(|&(v, w)| w * positions[v as usize]).sum()
}

/// Limit frames of all vertices (`None` for a vertex without a face).
///
/// Interior vertices off the creases use the closed-form masks of Halstead, Kass and DeRose 1993,
/// which the blend at extraordinary vertices keeps to leading order only: a blended vertex uses
/// the blended patch. All others take the jet of a patch at its corner.
///
/// # Example
/// ```
/// use geom_core::{DVec3, PolyMesh};
/// use subdiv_catmull_clark::{Blend, Creases, SubdivisionSurface, limit_frames};
/// # let xy = |k: u32| (f64::from(k / 5), f64::from(k % 5));
/// # let points = (0..25).map(xy).map(|(x, y)| DVec3::new(x, y, x * x)).collect();
/// # let quad = |k: u32| {
/// #     let at = 5 * (k / 4) + k % 4;
/// #     [at, at + 5, at + 6, at + 1]
/// # };
/// # let mesh = PolyMesh::new(points, &(0..16).map(quad).collect::<Vec<_>>())?;
/// // On a grid of five by five vertices with z = x², whose limit inside is x² + 1/3.
/// let surface = SubdivisionSurface::new(&mesh, &Creases::none(), Blend::Smooth)?;
/// let frames = limit_frames(&mesh, &surface);
/// let middle = frames[12].as_ref().expect("it has faces");
/// let point = middle.point(mesh.positions());
/// assert!(point.distance(DVec3::new(2.0, 2.0, 4.0 + 1.0 / 3.0)) < 1e-14);
/// let normal = DVec3::new(-4.0, 0.0, 1.0).normalize();
/// assert!(middle.normal(mesh.positions()).distance(normal) < 1e-14);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[must_use]
pub fn limit_frames(mesh: &PolyMesh, surface: &SubdivisionSurface) -> Vec<Option<LimitFrame>> {
    mesh.vertices().map(|v| frame(mesh, surface, v)).collect()
}

fn frame(mesh: &PolyMesh, surface: &SubdivisionSurface, v: VertexId) -> Option<LimitFrame> {
    let h = mesh.outgoing_half_edges(v).find(|&h| mesh.face(h).is_some())?;
    let face = mesh.face(h)?;
    let patch = &surface.patches()[face.index()];
    if surface.regular_basis() == Some(patch.basis) {
        // All four corners of such a patch are regular.
        let masks = limit_masks(4);
        let mut ring = vec![v.0];
        let mut at = h;
        for _ in 0..4 {
            ring.push(mesh.target(at).0);
            ring.push(mesh.target(mesh.next(at)).0);
            at = mesh.twin(mesh.prev(at));
        }
        let list = |mask: &[f64]| ring.iter().copied().zip(mask.iter().copied()).collect();
        return Some(LimitFrame {
            position: list(&masks.position),
            tangents: [list(&masks.tangents[0]), list(&masks.tangents[1])],
        });
    }
    let mut at = patch.corner;
    let mut slot = 0;
    while mesh.origin(at) != v {
        at = mesh.next(at);
        slot += 1;
    }
    let (u, v) = [(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0)][slot];
    let mut weights = surface.weights(patch.basis, u, v);
    // Next to an extraordinary corner the derivatives by u and v tend to zero or infinity, but
    // their directions settle; bring them to a common size.
    for d in 1..3 {
        let size: f64 = weights.row(d).iter().map(|w| w.abs()).sum();
        if size > 0.0 {
            weights.row_mut(d).iter_mut().for_each(|w| *w /= size);
        }
    }
    let list = |d: usize| surface.on_vertices(patch, weights.row(d));
    Some(LimitFrame { position: list(0), tangents: [list(1), list(2)] })
}
