//! What is faired.

use geom_core::{Cost, PolyMesh};
use subdiv_catmull_clark::{Creases, INFINITE_SHARPNESS, check_valences, refinements_needed};

use crate::constraints::Constraints;
use crate::error::Error;
use crate::functional::Energy;
use crate::options::Options;
use gp_solver::Fingerprint;

/// A control mesh with what is to be kept about it.
///
/// ```
/// use curvature_variation::{Constraints, Input};
/// let mesh = fixtures::quad_graphs::vase(10);
/// let input = Input {
///     constraints: Constraints { clamp_boundary: true, ..Constraints::default() },
///     ..Input::from(mesh)
/// };
/// assert!(input.members.is_empty());
/// ```
#[derive(Clone, Debug)]
pub struct Input {
    /// Control mesh of quads or n-gons.
    pub mesh: PolyMesh,
    /// Semi-sharp and sharp edges, corners.
    pub creases: Creases,
    /// What stays where it is.
    pub constraints: Constraints,
    /// Further meshes of the same faces: the result stays among the control meshes
    /// `X + Σ cₖ (Yₖ − X)`, with `X` the mesh and `Yₖ` these.
    ///
    /// This is how Joshi 2008, sec. 8.1, compares functionals on simple shapes with a few shape
    /// parameters: two tori of one mesh and one major radius span all tori of that major radius.
    /// The meshes are refined `levels` times first; method, symmetry and tolerance of the options
    /// do not matter, and nothing can be fixed.
    pub members: Vec<PolyMesh>,
    /// Matrices (row by row) of the symmetries to keep, among those of the mesh about its centre; in
    /// place of the option `symmetry`.
    pub symmetries: Option<Vec<[[f64; 3]; 3]>>,
}

/// The mesh alone, free to move.
impl From<PolyMesh> for Input {
    fn from(mesh: PolyMesh) -> Self {
        Self {
            mesh,
            creases: Creases::none(),
            constraints: Constraints::default(),
            members: Vec::new(),
            symmetries: None,
        }
    }
}

/// Bytes and microseconds per vertex of the last level and step, measured on tori of 1,536 to 24,576
/// vertices without symmetry.
const BYTES_PER_VERTEX: u64 = 30_000;
const EVALUATIONS_PER_VERTEX: u64 = 40;
/// Steps after which a run has mostly converged.
const USUAL_STEPS: usize = 100;
/// Floating-point operations of a microsecond.
const FLOPS_PER_EVALUATION: u64 = 8000;

impl Input {
    /// What a run would take, roughly: in proportion to the vertices of the last level, and what
    /// blends take in whose dense matrices all points around a vertex depend on one another.
    ///
    /// # Errors
    /// [`Error::Subdivision`] for a mesh that is not evaluated at any cost: a vertex with too many
    /// edges, or a face with too many corners.
    pub fn cost(&self, options: &Options) -> Result<Cost, Error> {
        let mesh = &self.mesh;
        check_valences(mesh)?;
        let steps = options.iterations.min(USUAL_STEPS) as u64;
        // Of the mesh refined once; every further refinement has about four times as many.
        let once = (mesh.vertex_count() + mesh.edge_count() + mesh.face_count()) as u64;
        let refinements = refinements_needed(mesh, &self.creases) + options.levels;
        let vertices = match refinements.checked_sub(1) {
            Some(further) => once.saturating_mul(4_u64.pow(further.min(16) as u32)),
            None => mesh.vertex_count() as u64,
        };
        let mut cost = Cost {
            bytes: vertices.saturating_mul(BYTES_PER_VERTEX),
            vertices,
            faces: vertices,
            evaluations: vertices.saturating_mul(EVALUATIONS_PER_VERTEX * steps),
        };
        let mut edges = vec![0_u64; mesh.vertex_count()];
        for h in mesh.edges() {
            edges[mesh.origin(h).index()] += 1;
            edges[mesh.target(h).index()] += 1;
        }
        let corners = mesh.faces().map(|f| mesh.face_degree(f) as u64);
        for valence in edges.into_iter().chain(corners).filter(|&n| n > 4) {
            let unknowns = (3 * (6 * valence + 1)).pow(2);
            let per_patch = (options.quadrature.extraordinary as u64).pow(2);
            let nodes = valence.saturating_mul(per_patch);
            let flops = unknowns.saturating_mul(nodes) / 2;
            cost.bytes = cost.bytes.saturating_add(24 * unknowns);
            cost.evaluations =
                cost.evaluations.saturating_add(flops / FLOPS_PER_EVALUATION * steps);
        }
        Ok(cost)
    }

    /// The constraints, with the boundary clamped if the options say so.
    pub(crate) fn constraints(&self, options: &Options) -> Constraints {
        let clamp_boundary = self.constraints.clamp_boundary || options.clamp_boundary;
        Constraints { clamp_boundary, ..self.constraints.clone() }
    }

    /// Whether some edge stays sharp on the limit surface.
    pub(crate) fn has_sharp_edges(mesh: &PolyMesh, creases: &Creases) -> bool {
        let is_sharp = |h| creases.sharpness(mesh.origin(h), mesh.target(h)) == INFINITE_SHARPNESS;
        mesh.edges().any(is_sharp)
    }

    /// Refuses what cannot be faired.
    pub(crate) fn check(&self, options: &Options) -> Result<(), Error> {
        options.check()?;
        let (mesh, constraints) = (&self.mesh, &self.constraints);
        if mesh.faces().all(|f| mesh.face_degree(f) == 3) {
            return Err(Error::Triangles { faces: mesh.face_count() });
        }
        if let Some(v) = mesh.vertices().find(|&v| mesh.outgoing(v).is_none()) {
            return Err(Error::IsolatedVertex { vertex: v.index() });
        }
        let (_, components) = mesh.components();
        if components > 1 {
            return Err(Error::Disconnected { components });
        }
        if let Some(v) = constraints.largest_vertex()
            && v as usize >= mesh.vertex_count()
        {
            let (vertex, count) = (v as usize, mesh.vertex_count());
            return Err(Error::NoSuchVertex { vertex, count });
        }
        if let Some(&(vertex, weight)) =
            constraints.weights.iter().find(|w| !(w.1 >= 0.0 && w.1.is_finite()))
        {
            return Err(Error::Weight { vertex, weight });
        }
        let is_held =
            !constraints.is_empty() || options.clamp_boundary || self.creases != Creases::none();
        if !self.members.is_empty() && is_held {
            return Err(Error::HeldFamily);
        }
        Ok(())
    }

    /// Refuses energies that would shrink the surface to a point or let it grow for ever; `extra`
    /// says whether blocks of the caller's hold it.
    pub(crate) fn check_scale(
        &self,
        energy: &Energy,
        clamps: bool,
        extra: bool,
    ) -> Result<(), Error> {
        let constraints = &self.constraints;
        let is_held = extra
            || !constraints.vertices.is_empty()
            || constraints.limit_points.len() + constraints.weights.len() > 1
            || (clamps && !self.mesh.boundary_loops().is_empty());
        if energy.is_scale_invariant() || is_held {
            return Ok(());
        }
        Err(Error::ScaleFree { energy: energy.to_string() })
    }

    /// Of everything a run depends on. More steps are no other run: a finished one may be taken
    /// further.
    pub(crate) fn fingerprint(&self, options: &Options) -> u64 {
        let mut of = Fingerprint::new();
        for mesh in std::iter::once(&self.mesh).chain(&self.members) {
            for point in mesh.positions() {
                of = of.numbers(&point.to_array());
            }
            for f in mesh.faces() {
                of = of.counts(mesh.face_vertices(f).map(|v| u64::from(v.0)));
            }
        }
        for h in self.mesh.edges() {
            let (a, b) = (self.mesh.origin(h), self.mesh.target(h));
            of = of.numbers(&[self.creases.sharpness(a, b)]);
        }
        for v in self.mesh.vertices() {
            of = of.counts([u64::from(self.creases.is_corner(v))]);
        }
        let options = Options { iterations: 0, ..options.clone() };
        of.text(&format!("{:?} {:?} {options:?}", self.constraints, self.symmetries)).finish()
    }
}
