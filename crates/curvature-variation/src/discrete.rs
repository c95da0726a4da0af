//! Bending energy by a discrete operator, to show why the method does not use one.

use geom_core::{DVec3, HalfEdgeId, PolyMesh};

/// Edge-based bending energy of a quad mesh (Grinspun et al. 2003, as Joshi 2008, sec. 7.1, takes
/// it to quads).
///
/// Every quad is seen as both of its triangulations. A hinge between two triangles of areas `A₁`
/// and `A₂` costs `θ² |e|² / (A₁ + A₂)` with the dihedral angle `θ`; an edge of the mesh takes the
/// mean over the triangles on either side, a quad the mean over its two diagonals. On a fine mesh
/// along the lines of curvature this is `∫ k1² + k2² dA`; on any other mesh it is not, however
/// fine the mesh, which is why the method has none. Faces with other than four corners are cut into fans.
#[must_use]
pub fn discrete_bending(mesh: &PolyMesh) -> f64 {
    let edges = mesh.edges().map(|h| edge_energy(mesh, h));
    let quads = mesh.faces().map(|f| {
        let p: Vec<DVec3> = mesh.face_vertices(f).map(|v| mesh.position(v)).collect();
        match p[..] {
            [a, b, c, d] => 0.5 * (hinge(a, c, b, d) + hinge(b, d, c, a)),
            _ => (2..p.len() - 1).map(|k| hinge(p[0], p[k], p[k - 1], p[k + 1])).sum(),
        }
    });
    edges.chain(quads).sum()
}

fn edge_energy(mesh: &PolyMesh, h: HalfEdgeId) -> f64 {
    if mesh.is_boundary_edge(h) {
        return 0.0;
    }
    let at = |h: HalfEdgeId| mesh.position(mesh.origin(h));
    // Of each side's corners the two that can be joined to both ends of the edge.
    let apexes = |h: HalfEdgeId| [at(mesh.next(mesh.next(h))), at(mesh.prev(h))];
    let (from, to) = (at(h), at(mesh.twin(h)));
    let mut sum = 0.0;
    for left in apexes(h) {
        for right in apexes(mesh.twin(h)) {
            sum += hinge(from, to, left, right);
        }
    }
    0.25 * sum
}

/// Energy of the hinge along `a b` between the triangles with apexes `c` and `d`.
fn hinge(a: DVec3, b: DVec3, c: DVec3, d: DVec3) -> f64 {
    let edge = b - a;
    let (left, right) = (edge.cross(c - a), (d - a).cross(edge));
    let areas = 0.5 * (left.length() + right.length());
    if areas == 0.0 {
        return 0.0;
    }
    let angle = left.cross(right).length().atan2(left.dot(right));
    angle * angle * edge.length_squared() / areas
}

#[cfg(test)]
mod tests {
    use super::*;
    use fixtures::quad_graphs;
    use std::f64::consts::{FRAC_1_SQRT_2, PI};

    const WANT: f64 = 8.0 * PI * PI;

    #[test]
    fn flat_sheets_have_none() {
        let sheet = quad_graphs::revolution(&[(1.0, 0.0), (2.0, 0.0), (3.0, 0.0)], 12);
        assert!(discrete_bending(&sheet) < 1e-25);
    }

    #[test]
    fn clifford_meshes_along_lines_of_curvature_converge() {
        let error = |n: usize| {
            let mesh = quad_graphs::torus(n, n, 1.0, FRAC_1_SQRT_2);
            (discrete_bending(&mesh) / WANT - 1.0).abs()
        };
        let (coarse, fine) = (error(32), error(64));
        assert!(fine < 0.01, "{fine}");
        assert!((3.0..5.0).contains(&(coarse / fine)), "{coarse} {fine}");
    }

    #[test]
    fn rhombic_clifford_meshes_report_too_much_at_any_size() {
        let excess = |n: usize| {
            let mesh = quad_graphs::sheared_torus(n, n, 1.0, FRAC_1_SQRT_2, [1, 0], [1, 1]);
            discrete_bending(&mesh) / WANT
        };
        assert!(excess(16) > 1.2, "{}", excess(16));
        assert!(excess(64) > 1.2, "{}", excess(64));
    }
}
