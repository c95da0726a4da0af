//! The fairest member of a family of shapes given by a few meshes.

use crate::constraints::Constraints;
use crate::evaluator::{SurfaceEnergy, Workspace, flatten, unflatten};
use crate::fair::{
    FairError, FairOptions, FairProgress, FairReport, Fairing, LevelReport, check_input, energies,
    finished,
};
use crate::functional::Energy;
use geom_core::PolyMesh;
use gp_solver::{Euclidean, LbfgsOptions, Progress, Stage, lbfgs};
use std::ops::ControlFlow;
use std::time::Instant;
use subdiv_catmull_clark::{Creases, refine, refinements_needed};

/// Converged once 3 steps together lower the energy by at most this share, or the gradient has
/// fallen to the second; with a handful of unknowns that is a matter of a dozen steps.
const ENERGY_TOLERANCE: f64 = 1e-12;
const WINDOW: usize = 3;
const GRADIENT_TOLERANCE: f64 = 1e-7;

/// Minimises a functional among the control meshes `X + Σ cₖ (Yₖ − X)`, with `X` the given mesh and
/// `Yₖ` the other `members`, which have the same faces.
///
/// This is how Joshi 2008, sec. 8.1, compares functionals on simple shapes with a few shape
/// parameters: two tori of one mesh and one major radius span all tori of that major radius. The
/// meshes are refined `options.levels` times first; method, symmetry and tolerance of the options
/// do not matter.
///
/// # Errors
/// [`FairError`], for instance [`FairError::OtherFaces`] if a member has other faces.
pub fn fair_in_family(
    mesh: &PolyMesh,
    members: &[PolyMesh],
    options: &FairOptions,
    mut observer: impl FnMut(&FairProgress) -> ControlFlow<()>,
) -> Result<Fairing, FairError> {
    let begin = Instant::now();
    let constraints = Constraints::default();
    check_input(mesh, &constraints, options)?;
    for (member, other) in members.iter().enumerate() {
        if !same_faces(mesh, other) {
            return Err(FairError::OtherFaces { member: member + 1 });
        }
    }
    let levels = refinements_needed(mesh, &Creases::none()) + options.levels;
    let mesh = refined(mesh, levels)?;
    let base = flatten(mesh.positions());
    let directions: Vec<Vec<f64>> = members
        .iter()
        .map(|m| {
            let positions = flatten(refined(m, levels)?.positions());
            Ok(positions.iter().zip(&base).map(|(y, x)| y - x).collect())
        })
        .collect::<Result<_, FairError>>()?;
    let creases = Creases::none();
    let surface = options.surface_of(&mesh, &creases)?;
    let evaluator = SurfaceEnergy::new(&surface, mesh.vertex_count(), options.quadrature);
    let mut objective = FamilyEnergy {
        evaluator: &evaluator,
        energy: &options.energy,
        epsilon_area: evaluator.area(&base, &mut Workspace::default()),
        base: &base,
        directions: &directions,
        x: base.clone(),
        gradient: vec![0.0; base.len()],
        work: Workspace::default(),
    };
    let settings = LbfgsOptions {
        memory: members.len() + 2,
        max_iterations: options.iterations,
        energy_tol: ENERGY_TOLERANCE,
        window: WINDOW,
        gradient_tol: GRADIENT_TOLERANCE,
        ..LbfgsOptions::default()
    };
    let vertices = mesh.vertex_count();
    let mut unknowns = vec![0.0; members.len()];
    let solved = lbfgs(
        &mut |y: &[f64], g: &mut [f64]| objective.value_and_gradient(y, g),
        &mut Euclidean,
        &mut unknowns,
        &settings,
        &Stage::only("family"),
        &mut |step: &Progress<'_>| {
            let (iteration, energy) = (step.iteration, step.energy);
            observer(&FairProgress { level: 0, levels: 1, vertices, iteration, energy })
        },
    )?;
    objective.place(&unknowns);
    let positions = unflatten(&objective.x);
    let before = energies(&mesh, &surface, &constraints, options.quadrature);
    let mut result = mesh.clone();
    result.positions_mut().copy_from_slice(&positions);
    let level = LevelReport {
        vertices,
        patches: mesh.face_count(),
        evaluated_patches: evaluator.patch_count(),
        unknowns: members.len(),
        symmetries: 1,
        status: solved.status,
        iterations: solved.iterations,
        evaluations: solved.evaluations,
        factorizations: 0,
        factor_len: 0,
        initial_energy: solved.initial_energy,
        final_energy: solved.final_energy,
        history: solved.history.iter().map(|h| h.energy).collect(),
        seconds: begin.elapsed().as_secs_f64(),
    };
    let report: FairReport = finished(
        &result,
        &surface,
        &constraints,
        options,
        before,
        vec![level],
        solved.gradient_norm,
    );
    let initial_surface = surface.clone();
    Ok(Fairing { initial: mesh, initial_surface, mesh: result, creases, surface, report })
}

/// The energy as a function of the members' shares.
struct FamilyEnergy<'a> {
    evaluator: &'a SurfaceEnergy,
    energy: &'a Energy,
    epsilon_area: f64,
    base: &'a [f64],
    directions: &'a [Vec<f64>],
    x: Vec<f64>,
    gradient: Vec<f64>,
    work: Workspace,
}

impl FamilyEnergy<'_> {
    fn place(&mut self, shares: &[f64]) {
        self.x.copy_from_slice(self.base);
        for (direction, share) in self.directions.iter().zip(shares) {
            self.x.iter_mut().zip(direction).for_each(|(x, d)| *x += share * d);
        }
    }

    fn value_and_gradient(&mut self, shares: &[f64], out: &mut [f64]) -> f64 {
        self.place(shares);
        let area = Some(self.epsilon_area);
        let value =
            self.evaluator.gradient(self.energy, &self.x, area, &mut self.work, &mut self.gradient);
        for (to, direction) in out.iter_mut().zip(self.directions) {
            *to = direction.iter().zip(&self.gradient).map(|(d, g)| d * g).sum();
        }
        value
    }
}

fn same_faces(a: &PolyMesh, b: &PolyMesh) -> bool {
    a.vertex_count() == b.vertex_count()
        && a.face_count() == b.face_count()
        && a.faces().all(|f| a.face_vertices(f).eq(b.face_vertices(f)))
}

fn refined(mesh: &PolyMesh, levels: usize) -> Result<PolyMesh, FairError> {
    let mut mesh = mesh.clone();
    for _ in 0..levels {
        mesh = refine(&mesh, &Creases::none())?.mesh;
    }
    Ok(mesh)
}
