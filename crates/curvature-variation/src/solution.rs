//! What a fairing hands back.

use geom_core::PolyMesh;
use gp_solver::RunReport;
use subdiv_catmull_clark::{Creases, SubdivisionSurface};

use crate::evaluator::EnergyTable;
use crate::level::LevelNumbers;
use crate::metrics::{Metrics, Warning};

/// A faired surface with what is to be said about it.
///
/// # Example
/// ```
/// use curvature_variation::{Functional, Input, Options, solve};
/// let torus = Input::from(fixtures::quad_graphs::torus(6, 5, 1.0, 0.3));
/// let energy = "bending".parse()?;
/// let options = Options { energy, levels: 0, iterations: 5, ..Options::default() };
/// let solution = solve(&torus, &options, &mut ())?;
/// let bending = Functional::Bending;
/// assert!(solution.after.get(bending) < solution.before.get(bending));
/// assert_eq!(solution.result.vertex_count(), 30);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Debug)]
pub struct Solution {
    /// The control mesh of the result.
    pub result: PolyMesh,
    /// The creases of the result.
    pub creases: Creases,
    /// The surface of the result.
    pub surface: SubdivisionSurface,
    /// The first level's control mesh before anything moved: quads, refined as far as needed.
    pub initial: PolyMesh,
    /// Its surface.
    pub initial_surface: SubdivisionSurface,
    /// All functionals of the first level's surface before anything moved.
    pub before: EnergyTable,
    /// All functionals of the result, by the fine quadrature; NaN if the run was stopped at once.
    pub after: EnergyTable,
    /// The numbers of the metrics file.
    pub metrics: Metrics,
    /// Limit of the energy for vanishing mesh size by Richardson's extrapolation of the last two
    /// levels, whose errors are in ratio 4.
    pub extrapolated: Option<f64>,
    /// What the user should know.
    pub warnings: Vec<Warning>,
    /// What the solver did: a stage per level, named after its number of vertices; energies with the
    /// pulls of [`crate::Constraints::weights`]. The status is `Stalled` in place of `Converged` if
    /// the quadrature gap is above 1 %.
    pub report: RunReport,
    /// Whether the quads at the boundary are left out of the energies.
    pub(crate) clamps: bool,
    /// What every level was made of.
    pub levels: Vec<LevelNumbers>,
}
