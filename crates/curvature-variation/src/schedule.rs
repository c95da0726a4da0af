//! The control meshes of a run: the input refined as far as needed, then once per level.

use subdiv_catmull_clark::{Creases, check_valences, refine, refinements_needed};

use crate::constraints::refine_fixed;
use crate::error::Error;
use crate::input::Input;
use crate::options::Options;
use geom_core::PolyMesh;

/// Vertices a level may have.
const MAX_VERTICES: usize = 400_000;
/// Gauss-Newton steps that open a level: the first, and the later ones.
const FIRST_NEWTON_STEPS: usize = 25;
const LATER_NEWTON_STEPS: usize = 4;
/// How much larger the tolerance of the levels before the last two is.
const COARSE_TOLERANCE: f64 = 100.0;

/// A control mesh, its creases and its fixed vertices.
#[derive(Clone, Debug)]
pub(crate) struct Control {
    pub(crate) mesh: PolyMesh,
    pub(crate) creases: Creases,
    pub(crate) fixed: Vec<bool>,
}

impl Control {
    /// That of the first level.
    pub(crate) fn first(input: &Input, options: &Options) -> Result<Self, Error> {
        let mut fixed = vec![false; input.mesh.vertex_count()];
        input.constraints.vertices.iter().for_each(|&v| fixed[v as usize] = true);
        check_valences(&input.mesh)?;
        let (mesh, creases) = (input.mesh.clone(), input.creases.clone());
        let mut this = Self { mesh, creases, fixed };
        for _ in 0..refinements_needed(&this.mesh, &this.creases) {
            this.refine()?;
        }
        let estimate = this.mesh.vertex_count() << (2 * options.levels.min(16));
        if estimate > MAX_VERTICES {
            let (levels, vertices, limit) = (options.levels, estimate, MAX_VERTICES);
            return Err(Error::TooManyLevels { levels, vertices, limit });
        }
        Ok(this)
    }

    /// Goes on to the next level.
    pub(crate) fn refine(&mut self) -> Result<(), Error> {
        let fine = refine(&self.mesh, &self.creases)?;
        self.fixed = refine_fixed(&self.fixed, &fine.stencils);
        (self.mesh, self.creases) = (fine.mesh, fine.creases);
        Ok(())
    }
}

/// Gauss-Newton steps that open a level, and its tolerance.
pub(crate) fn effort(level: usize, options: &Options) -> (usize, f64) {
    let newton_steps = if level == 0 { FIRST_NEWTON_STEPS } else { LATER_NEWTON_STEPS };
    // The next level moves the surface more than the last steps here would. The one before the last
    // is driven on: Richardson's extrapolation stands on its energy.
    let coarse = level + 1 < options.levels;
    (newton_steps, if coarse { COARSE_TOLERANCE } else { 1.0 } * options.tolerance)
}
