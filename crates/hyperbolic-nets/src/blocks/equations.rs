//! Quadratic equations of nets.

use gp_solver::{Group, QuadraticBuilder, QuadraticConstraints};

use crate::QuadNet;

/// The Lelieuvre equations of all edges `i → j` with their signs `s = ±1`, in lengths `h`:
///
/// ```text
/// residual[3 e + c] = (x_j − x_i − s ν_i × ν_j)_c / h
/// ∂/∂x_j = e_c / h,   ∂/∂x_i = −e_c / h,   ∂/∂ν_i,a = −s ν_j,b / h,   ∂/∂ν_i,b = s ν_j,a / h, …
/// ```
///
/// with `(a, b)` the two components after `c`. A net with such normals `ν` is asymptotic (both
/// ends of an edge are orthogonal to it, so vertex stars are planar) and its patches join smoothly
/// with the shape parameters [`crate::shape_parameters`] (discrete Lelieuvre normals: Bobenko and
/// Suris 2008, §2.4). Signs: [`crate::LelieuvreStart`].
///
/// # Panics
/// If there is not one sign for every edge.
#[must_use]
pub fn edge_equations(
    net: &QuadNet,
    signs: &[f64],
    positions: Group,
    normals: Group,
    h: f64,
) -> QuadraticConstraints {
    assert_eq!(signs.len(), net.edges().len(), "one sign for every edge");
    let mut builder = QuadraticBuilder::new("asymptotic and smooth");
    for (e, &sign) in net.edges().iter().zip(signs) {
        let [i, j] = e.ends;
        for c in 0..3 {
            let (a, b) = ((c + 1) % 3, (c + 2) % 3);
            builder
                .equation(1.0)
                .linear(positions.column(j, c), 1.0 / h)
                .linear(positions.column(i, c), -1.0 / h)
                .product(normals.column(i, a), normals.column(j, b), -sign / h)
                .product(normals.column(i, b), normals.column(j, a), sign / h);
        }
    }
    builder.build()
}

/// Planar vertex stars by a unit normal per vertex (Deng et al. 2011). For every vertex `i`, for
/// each of its neighbours `j` in order and then once:
///
/// ```text
/// residual = n_i·(x_j − x_i)      ∂/∂n_i = x_j − x_i,  ∂/∂x_j = n_i,  ∂/∂x_i = −n_i
/// residual = n_i·n_i − 1          ∂/∂n_i = 2 n_i
/// ```
///
/// in units of the positions.
#[must_use]
pub fn star_equations(net: &QuadNet, positions: Group, normals: Group) -> QuadraticConstraints {
    let mut builder = QuadraticBuilder::new("planar stars");
    for v in 0..net.positions().len() {
        for w in net.ring(v) {
            let equation = builder.equation(1.0);
            for c in 0..3 {
                let normal = normals.column(v, c);
                equation.product(normal, positions.column(w, c), 1.0).product(
                    normal,
                    positions.column(v, c),
                    -1.0,
                );
            }
        }
        let unit = builder.equation(1.0);
        for c in 0..3 {
            unit.product(normals.column(v, c), normals.column(v, c), 1.0);
        }
        unit.constant(-1.0);
    }
    builder.build()
}
