//! What all levels of a run share, and the problem of a level made of blocks.

use geom_core::{DVec3, PolyMesh, VertexId};
use gp_solver::{BlockId, Group, Problem, Variables};
use subdiv_catmull_clark::SubdivisionSurface;

use crate::blocks::{PinnedLimits, PulledPoints, SurfaceBlock};
use crate::constraints::Constraints;
use crate::error::Error;
use crate::limits::{Condition, Pull};
use crate::options::Options;

/// Weight of the rows of pinned limits in a problem of blocks, with lengths in units of the square
/// root of the area.
const PIN_WEIGHT: f64 = 1e4;

/// What all levels share.
#[derive(Clone, Debug)]
pub(crate) struct Grounds<'i> {
    pub(crate) options: &'i Options,
    pub(crate) constraints: Constraints,
    pub(crate) symmetries: Option<&'i [[[f64; 3]; 3]]>,
    /// Area of the first level's surface before anything moved.
    pub(crate) area: f64,
    /// Limit points that are pulled: vertex, place, weight over area.
    pub(crate) places: Vec<(u32, DVec3, f64)>,
}

/// The crate's own blocks of a level's problem.
pub(crate) struct OwnBlocks {
    energy: BlockId,
    pulls: Option<BlockId>,
    pins: Option<BlockId>,
}

/// What weights a caller has given the crate's own blocks: 0 where one was taken out.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct OwnWeights {
    pub(crate) energy: f64,
    pub(crate) pulls: f64,
    pub(crate) pins: f64,
}

impl OwnWeights {
    /// Nothing has been changed.
    pub(crate) const UNCHANGED: Self = Self { energy: 1.0, pulls: 1.0, pins: 1.0 };
}

impl OwnBlocks {
    /// Takes the own blocks out of a problem and tells their weights: what is left is the caller's.
    pub(crate) fn take_out(&self, problem: &mut Problem<'_>) -> Result<OwnWeights, Error> {
        let mut taken = |block: Option<BlockId>, usual: f64| -> Result<f64, Error> {
            let Some(block) = block else { return Ok(1.0) };
            let Ok(weight) = problem.weight(block) else { return Ok(0.0) };
            problem.remove(block)?;
            Ok(weight / usual)
        };
        Ok(OwnWeights {
            energy: taken(Some(self.energy), 1.0)?,
            pulls: taken(self.pulls, 1.0)?,
            pins: taken(self.pins, PIN_WEIGHT)?,
        })
    }
}

impl Grounds<'_> {
    /// The problem of a level: the energy of the surface, the pulls, and the pinned limits as
    /// penalties.
    pub(crate) fn problem(
        &self,
        mesh: &PolyMesh,
        surface: &SubdivisionSurface,
        (variables, points): (Variables, Group),
        pulls: &[Pull],
        conditions: &[Condition],
    ) -> Result<(Problem<'static>, OwnBlocks), Error> {
        let Options { energy, quadrature, .. } = self.options;
        let mut counts = vec![1; mesh.face_count()];
        if self.constraints.clamp_boundary {
            skip_boundary(mesh, &mut counts);
        }
        let mut problem = Problem::new(variables);
        let block = SurfaceBlock::of_patches(surface, points, energy, *quadrature, &counts);
        let energy = problem.add_energy(block);
        let mut own = OwnBlocks { energy, pulls: None, pins: None };
        if !pulls.is_empty() {
            let mut block = PulledPoints::new(points);
            for pull in pulls {
                block.pull(&pull.stencil, pull.place, pull.factor);
            }
            own.pulls = Some(problem.add(block));
        }
        if !conditions.is_empty() {
            let per_length = self.area.sqrt().recip();
            let mut block = PinnedLimits::new(points);
            for Condition { weights, direction, target } in conditions {
                block.pin(weights, per_length * *direction, per_length * target);
            }
            let pins = problem.add(block);
            problem.set_weight(pins, PIN_WEIGHT)?;
            own.pins = Some(pins);
        }
        Ok((problem, own))
    }
}

/// Leaves the patches at the boundary out.
pub(crate) fn skip_boundary(mesh: &PolyMesh, multiplicities: &mut [u32]) {
    for f in mesh.faces() {
        if mesh.face_vertices(f).any(|v: VertexId| mesh.is_boundary_vertex(v)) {
            multiplicities[f.index()] = 0;
        }
    }
}
