//! The torus a surface comes near to.

use geom_core::{DVec3, PolyMesh, Torus};
use subdiv_catmull_clark::{SubdivisionSurface, limit_frames};

/// The torus nearest to the limit points of a closed surface of genus 1, with the root mean square
/// of the distances; `None` for any other surface.
#[must_use]
pub fn fitted_torus(mesh: &PolyMesh, surface: &SubdivisionSurface) -> Option<(Torus, f64)> {
    if mesh.euler_characteristic() != 0 || !mesh.boundary_loops().is_empty() {
        return None;
    }
    let frames = limit_frames(mesh, surface);
    let points: Vec<DVec3> = frames.iter().flatten().map(|f| f.point(mesh.positions())).collect();
    Torus::fit(&points)
}
