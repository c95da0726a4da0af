//! Nets of asymptotic curves from faces and curves, and from asymptotic quad meshes.

use std::collections::HashMap;

use geom_core::{DVec3, HalfEdgeId, PolyMesh, VertexId};

use crate::data::corners::{AsymptoticNet, DATA_DEGREE, NetCurve, NetFace};
use crate::error::Error;
use crate::faults::NetFault;

/// Most points of a polyline that a stencil for tangent and curvature uses.
const STENCIL: usize = 5;

/// Mesh edges this straight (curvature times length, sine to the chord) are lines.
const STRAIGHT_TOL: f64 = 1e-8;

impl AsymptoticNet {
    /// A net of quadrilateral faces (corners counter-clockwise) with one curve along every edge.
    ///
    /// # Errors
    /// [`Error::Net`] when a face has no curve along an edge, a curve bounds more than
    /// two faces, faces are not consistently oriented, or an index is out of range; then the
    /// faults of [`AsymptoticNet::check`].
    pub fn new(
        positions: Vec<DVec3>,
        quads: &[[usize; 4]],
        curves: Vec<NetCurve>,
    ) -> Result<Self, Error> {
        let vertices = positions.len();
        let mut index = HashMap::with_capacity(curves.len());
        for (i, curve) in curves.iter().enumerate() {
            let [a, b] = curve.ends;
            if a >= positions.len() || b >= positions.len() || a == b {
                return Err(NetFault::Ends { curve: i, a, b, vertices }.into());
            }
            if index.insert((a.min(b), a.max(b)), i).is_some() {
                return Err(NetFault::Doubled { a, b }.into());
            }
        }
        if quads.is_empty() {
            return Err(NetFault::NoFaces.into());
        }
        // Each side of a curve takes one face.
        let mut taken = vec![[None::<usize>; 2]; curves.len()];
        let mut faces = Vec::with_capacity(quads.len());
        for (f, corners) in quads.iter().enumerate() {
            let [v00, v10, v11, v01] = *corners;
            let mut face = NetFace { curves: [0; 4], reversed: [false; 4] };
            // Direction of r1..r4, and whether that is the counter-clockwise one.
            let sides = [(v00, v10, true), (v00, v01, false), (v01, v11, false), (v10, v11, true)];
            for (k, (a, b, forward)) in sides.into_iter().enumerate() {
                let Some(&i) = index.get(&(a.min(b), a.max(b))) else {
                    return Err(NetFault::NoCurve { face: f, a, b }.into());
                };
                face.curves[k] = i;
                face.reversed[k] = curves[i].ends[0] != a;
                let side = usize::from(face.reversed[k] == forward);
                if let Some(g) = taken[i][side].replace(f) {
                    return Err(NetFault::SameSide { first: g, second: f, a, b }.into());
                }
            }
            faces.push(face);
        }
        let net = Self { positions, curves, faces, single: false, estimated: false };
        net.check()?;
        Ok(net)
    }

    /// A net of curves along the edges of an asymptotic quad mesh (an A-net: the star of every
    /// vertex nearly planar).
    ///
    /// Tangents and curvatures are those of the polynomials of degree up to four through the
    /// vertices of each mesh polyline, so a net sampled from a smooth parametrisation gives them
    /// to fourth order. Lines through a vertex are continued across it when its valence is even.
    /// A curve whose curvature changes sign between its ends gets one inflection.
    ///
    /// # Errors
    /// [`Error::Net`] when a face is not a quad, and the faults of
    /// [`AsymptoticNet::check`].
    pub fn from_mesh(mesh: &PolyMesh) -> Result<Self, Error> {
        let mut quads = Vec::with_capacity(mesh.face_count());
        for face in mesh.faces() {
            let corners: Vec<usize> = mesh.face_vertices(face).map(VertexId::index).collect();
            let Ok(quad) = <[usize; 4]>::try_from(corners.as_slice()) else {
                let (face, corners) = (face.index(), corners.len());
                return Err(NetFault::NotQuad { face, corners }.into());
            };
            quads.push(quad);
        }
        let normals = vertex_normals(mesh);
        let curves = mesh
            .edges()
            .map(|h| {
                let back = mesh.twin(h);
                let ends = [mesh.origin(h), mesh.target(h)];
                let derivatives = [h, back].map(|h| arm_derivatives(mesh, h));
                let chord = mesh.position(ends[1]) - mesh.position(ends[0]);
                let normals = ends.map(|v| normals[v.index()]);
                net_curve(ends.map(VertexId::index), chord, derivatives, normals)
            })
            .collect();
        let net = Self::new(mesh.positions().to_vec(), &quads, curves)?;
        Ok(Self { estimated: true, ..net })
    }
}

/// The curve with these first and second derivatives, by a parameter that runs over it once from
/// each end, laid into the tangent planes.
pub(crate) fn net_curve(
    ends: [usize; 2],
    chord: DVec3,
    derivatives: [(DVec3, DVec3); 2],
    normals: [DVec3; 2],
) -> NetCurve {
    let mut arms = [DVec3::ZERO; 2];
    let mut curvatures = [0.0; 2];
    for e in 0..2 {
        let normal = normals[e];
        // Everything happens in the tangent plane, which the arms must share.
        let flat = |v: DVec3| v - normal * v.dot(normal);
        let (first, second) = (flat(derivatives[e].0), flat(derivatives[e].1));
        arms[e] = first / DATA_DEGREE as f64;
        curvatures[e] = first.cross(second).dot(normal) / first.length().powi(3);
    }
    let line = (0..2).all(|e| {
        curvatures[e].abs() * chord.length() <= STRAIGHT_TOL
            && arms[e].cross(chord).length() <= STRAIGHT_TOL * arms[e].length() * chord.length()
    });
    if line {
        curvatures = [0.0; 2];
        for (arm, sign) in arms.iter_mut().zip([1.0, -1.0]) {
            *arm = chord * (sign * arm.length() / chord.length());
        }
    }
    // Equal signs mean opposite sides, because the arms point at one another.
    let inflections = usize::from(!line && curvatures[0] * curvatures[1] > 0.0);
    NetCurve { ends, arms, curvatures, line, inflections }
}

/// Normals from the derivatives along the arms, on the side of counter-clockwise faces.
fn vertex_normals(mesh: &PolyMesh) -> Vec<DVec3> {
    mesh.vertices()
        .map(|v| {
            let arms: Vec<DVec3> =
                mesh.outgoing_half_edges(v).map(|h| arm_derivatives(mesh, h).0).collect();
            let mut sum = DVec3::ZERO;
            for (h, arm) in mesh.outgoing_half_edges(v).zip(&arms) {
                // The face to the left of h lies between h and its clockwise-previous twin.
                if mesh.face(h).is_some() {
                    let other = mesh.twin(mesh.prev(h));
                    sum += arm.normalize().cross(arm_derivatives(mesh, other).0.normalize());
                }
            }
            sum.normalize_or_zero()
        })
        .collect()
}

/// First and second derivative, at its origin, of the polyline through the half-edge `h` by the
/// index along it.
fn arm_derivatives(mesh: &PolyMesh, h: HalfEdgeId) -> (DVec3, DVec3) {
    // Vertices ahead of the origin and behind it.
    let walk = |start: Option<HalfEdgeId>| {
        let mut points = Vec::with_capacity(STENCIL);
        let mut here = start;
        while let Some(g) = here
            && points.len() + 1 < STENCIL
        {
            points.push(mesh.position(mesh.target(g)));
            here = straight_on(mesh, g);
        }
        points
    };
    let mut ahead = walk(Some(h));
    let mut behind = walk(straight_back(mesh, h));
    // As central as the polyline allows.
    let half = (STENCIL - 1) / 2;
    let from_ahead = ahead.len().min(half.max(STENCIL - 1 - behind.len().min(half)));
    ahead.truncate(from_ahead);
    behind.truncate(STENCIL - 1 - from_ahead);
    let mut offsets: Vec<f64> = vec![0.0];
    let mut points = vec![mesh.position(mesh.origin(h))];
    for (k, p) in ahead.iter().enumerate() {
        offsets.push((k + 1) as f64);
        points.push(*p);
    }
    for (k, p) in behind.iter().enumerate() {
        offsets.push(-((k + 1) as f64));
        points.push(*p);
    }
    lagrange_derivatives(&offsets, &points)
}

/// The half-edge that continues `h` beyond its target, where there is one.
fn straight_on(mesh: &PolyMesh, h: HalfEdgeId) -> Option<HalfEdgeId> {
    let v = mesh.target(h);
    let back = mesh.twin(h);
    if mesh.is_boundary_vertex(v) {
        // Only the border itself goes on, and only where it has no corner.
        let along = mesh.is_boundary_edge(h) && mesh.valence(v) == 3;
        return along
            .then(|| mesh.outgoing_half_edges(v).find(|g| mesh.is_boundary_edge(*g) && *g != back))
            .flatten();
    }
    opposite(mesh, v, back)
}

/// The half-edge that leaves the origin of `h` the other way.
fn straight_back(mesh: &PolyMesh, h: HalfEdgeId) -> Option<HalfEdgeId> {
    straight_on(mesh, mesh.twin(h))
}

/// The arm opposite to `arm` around an interior vertex of even valence.
fn opposite(mesh: &PolyMesh, v: VertexId, arm: HalfEdgeId) -> Option<HalfEdgeId> {
    let ring: Vec<HalfEdgeId> = mesh.outgoing_half_edges(v).collect();
    let at = ring.iter().position(|g| *g == arm)?;
    ring.len().is_multiple_of(2).then(|| ring[(at + ring.len() / 2) % ring.len()])
}

/// Derivatives at offset 0 of the polynomial through `points` at `offsets` (Newton form).
fn lagrange_derivatives(offsets: &[f64], points: &[DVec3]) -> (DVec3, DVec3) {
    let n = points.len();
    let mut differences = points.to_vec();
    for order in 1..n {
        for k in (order..n).rev() {
            differences[k] =
                (differences[k] - differences[k - 1]) / (offsets[k] - offsets[k - order]);
        }
    }
    // Horner with two derivatives.
    let (mut value, mut first, mut second) = (DVec3::ZERO, DVec3::ZERO, DVec3::ZERO);
    for k in (0..n).rev() {
        let step = -offsets[k];
        second = second * step + first * 2.0;
        first = first * step + value;
        value = value * step + differences[k];
    }
    (first, second)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn polynomial_stencils_are_exact_for_quartics() {
        let f = |t: f64| DVec3::new(t, t * t - 3.0 * t, t.powi(4) + 2.0 * t * t);
        let offsets = [0.0, 1.0, 2.0, -1.0, -2.0];
        let points = offsets.map(f);
        let (first, second) = lagrange_derivatives(&offsets, &points);
        assert!((first - DVec3::new(1.0, -3.0, 0.0)).length() < 1e-13);
        assert!((second - DVec3::new(0.0, 2.0, 4.0)).length() < 1e-13);
    }
}
