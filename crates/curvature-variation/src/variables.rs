//! The unknowns of a level: its control points.

use gp_solver::{Group, Variables};

use crate::constraints::boundary_band;
use crate::error::Error;
use crate::input::Input;
use crate::options::Options;
use crate::schedule::Control;
use geom_core::PolyMesh;

/// Name of the group of control points, three coordinates per vertex of the level's mesh.
pub const CONTROL_POINTS: &str = "control points";

/// The control points of the first level as unknowns: those of the input refined until all faces are
/// quads with regular rings around extraordinary vertices; fixed vertices are fixed.
///
/// # Errors
/// [`Error`] for inputs that cannot be faired.
///
/// ```
/// use curvature_variation::{Constraints, Input, Options, variables};
/// let constraints = Constraints { vertices: vec![4, 7], ..Constraints::default() };
/// let input =
///     Input { constraints, ..Input::from(fixtures::quad_graphs::torus(10, 8, 1.0, 0.5)) };
/// let variables = variables(&input, &Options::default())?;
/// assert_eq!(variables.group(curvature_variation::CONTROL_POINTS)?.len(), 80);
/// assert_eq!(variables.fixed().iter().filter(|f| **f).count(), 6);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn variables(input: &Input, options: &Options) -> Result<Variables, Error> {
    input.check(options)?;
    let control = Control::first(input, options)?;
    let clamps = input.constraints(options).clamp_boundary;
    let fixed = fixed_vertices(&control.mesh, &control.fixed, clamps);
    Ok(control_points(&fixed).0)
}

/// One group of control points, those marked fixed.
pub(crate) fn control_points(fixed: &[bool]) -> (Variables, Group) {
    let mut variables = Variables::new();
    let points = variables.add(CONTROL_POINTS, fixed.len(), 3);
    for (v, _) in fixed.iter().enumerate().filter(|(_, is_fixed)| **is_fixed) {
        variables.fix(points, v);
    }
    variables.set_runs(3);
    (variables, points)
}

/// The fixed vertices, those of a clamped boundary included.
pub(crate) fn fixed_vertices(mesh: &PolyMesh, fixed: &[bool], clamps: bool) -> Vec<bool> {
    let mut fixed = fixed.to_vec();
    if clamps {
        let band = boundary_band(mesh, 2);
        fixed.iter_mut().zip(band).for_each(|(f, b)| *f |= b);
    }
    fixed
}
