//! The unknowns of a net: positions, and in most methods a normal per vertex.

use geom_core::DVec3;
use gp_solver::{Group, Variables};

use crate::QuadNet;
use crate::options::{Boundary, Method, Options, StarPlanarity};

/// Name of the group of positions, three coordinates per vertex.
pub const POSITIONS: &str = "positions";
/// Name of the group of normals, three coordinates per vertex.
pub const NORMALS: &str = "normals";

/// The unknowns of a method: positions and normals vertex by vertex, six numbers each, or positions
/// alone (published method with [`StarPlanarity::Quads`]). Boundary vertices are fixed if they are
/// to stay.
///
/// ```
/// use geom_core::PolyMesh;
/// use hyperbolic_nets::{Options, POSITIONS, QuadNet, variables};
/// let model = fixtures::asymptotic_nets::scherk(4);
/// let net = QuadNet::new(&PolyMesh::new(model.positions, &model.quads)?)?;
/// let variables = variables(&net, &Options::default());
/// let positions = variables.group(POSITIONS)?;
/// assert_eq!(positions.len(), 25);
/// assert_eq!(positions.columns::<3>(2), [12, 13, 14]); // normals stand between
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[must_use]
pub fn variables(net: &QuadNet, options: &Options) -> Variables {
    let (mut variables, positions, _) = unknowns(net, options);
    fix_boundary(&mut variables, positions, net, options.boundary);
    variables
}

/// The unknowns with their groups, none of them fixed.
pub(crate) fn unknowns(net: &QuadNet, options: &Options) -> (Variables, Group, Option<Group>) {
    let vertices = net.positions().len();
    let mut variables = Variables::new();
    let alone = options.method == Method::Published && options.planarity == StarPlanarity::Quads;
    if alone {
        let positions = variables.add(POSITIONS, vertices, 3);
        variables.set_runs(3);
        variables.set_vectors(positions);
        return (variables, positions, None);
    }
    let [positions, normals] = variables.interleave(vertices, [(POSITIONS, 3), (NORMALS, 3)]);
    variables.set_runs(6);
    variables.set_vectors(positions).set_vectors(normals);
    (variables, positions, Some(normals))
}

/// Fixes the vertices that may not move.
pub(crate) fn fix_boundary(
    variables: &mut Variables,
    positions: Group,
    net: &QuadNet,
    boundary: Boundary,
) {
    if boundary == Boundary::Fixed {
        for v in (0..positions.len()).filter(|&v| net.boundary()[v]) {
            variables.fix(positions, v);
        }
    }
}

/// The vector of a vertex.
pub(crate) fn vector(group: Group, x: &[f64], vertex: usize) -> DVec3 {
    DVec3::from_array(group.get(x, vertex))
}

/// The vectors of all vertices.
pub(crate) fn vectors(group: Group, x: &[f64]) -> Vec<DVec3> {
    (0..group.len()).map(|v| vector(group, x, v)).collect()
}
