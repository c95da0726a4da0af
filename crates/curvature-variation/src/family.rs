//! The fairest member of a family of shapes given by a few meshes.

use std::time::Instant;

use geom_core::PolyMesh;
use gp_solver::{
    Euclidean, Extra, LbfgsOptions, Objective, Observer, Problem, Report, RunReport, Stage,
    StageReport, Status, Variables, lbfgs,
};
use subdiv_catmull_clark::{
    Creases, SubdivisionSurface, check_valences, refine, refinements_needed,
};

use crate::blocks::{FamilyBlock, SurfaceBlock};
use crate::error::Error;
use crate::evaluator::{EnergyTable, SurfaceEnergy, Workspace, flatten, unflatten};
use crate::functional::Energy;
use crate::input::Input;
use crate::level::LevelNumbers;
use crate::metrics::{Measured, Meter};
use crate::options::Options;
use crate::placed::Placed;
use crate::replay::{Answers, Offering, Replayed};
use crate::solution::Solution;

/// Name of the group of the shares of a family's members.
pub const SHARES: &str = "shares";

/// Converged once 3 steps together lower the energy by at most this share, or the gradient has
/// fallen to the second; with a handful of unknowns that is a matter of a dozen steps.
const ENERGY_TOLERANCE: f64 = 1e-12;
const WINDOW: usize = 3;
const GRADIENT_TOLERANCE: f64 = 1e-7;

/// A family refined as often as asked for.
struct Family {
    mesh: PolyMesh,
    base: Vec<f64>,
    directions: Vec<Vec<f64>>,
    surface: SubdivisionSurface,
}

impl Family {
    fn new(input: &Input, options: &Options) -> Result<Self, Error> {
        for (member, other) in input.members.iter().enumerate() {
            if !same_faces(&input.mesh, other) {
                return Err(Error::OtherFaces { member: member + 1 });
            }
        }
        check_valences(&input.mesh)?;
        let levels = refinements_needed(&input.mesh, &Creases::none()) + options.levels;
        let mesh = refined(&input.mesh, levels)?;
        let base = flatten(mesh.positions());
        let directions = input
            .members
            .iter()
            .map(|m| {
                let positions = flatten(refined(m, levels)?.positions());
                Ok(positions.iter().zip(&base).map(|(y, x)| y - x).collect())
            })
            .collect::<Result<_, Error>>()?;
        let surface = options.surface_of(&mesh, &Creases::none())?;
        Ok(Self { mesh, base, directions, surface })
    }

    /// The problem of the shares.
    fn problem(&self, options: &Options) -> Problem<'static> {
        let mut variables = Variables::new();
        let shares = variables.add(SHARES, self.directions.len(), 1);
        let mut problem = Problem::new(variables);
        let points = Variables::new().add(crate::variables::CONTROL_POINTS, self.base.len() / 3, 3);
        let Options { energy, quadrature, .. } = options;
        let block = SurfaceBlock::new(&self.surface, points, energy, *quadrature);
        let (base, directions) = (self.base.clone(), self.directions.clone());
        problem.add_energy(FamilyBlock::new(block, shares, base, directions));
        problem
    }
}

/// The problem of a family's shares.
pub(crate) fn problem(input: &Input, options: &Options) -> Result<Problem<'static>, Error> {
    Ok(Family::new(input, options)?.problem(options))
}

/// Minimises a functional among the control meshes `X + Σ cₖ (Yₖ − X)`.
pub(crate) fn solve(
    placed: &Placed<'_>,
    extra: Option<&mut Extra<'_, Error>>,
    observer: &mut dyn Observer,
) -> Result<Solution, Error> {
    let begin = Instant::now();
    let Placed { input, options, .. } = placed;
    let family = Family::new(input, options)?;
    let Family { mesh, base, directions, surface } = &family;
    let (fingerprint, resume) = (input.fingerprint(options), observer.resume());
    let answers = Answers::resumed(fingerprint, resume.as_ref(), directions.len())?;
    let stage = placed.stage(Stage::only("family"));
    let (mut added, mut weight) = (None, 1.0);
    if let Some(extra) = extra {
        let mut problem = family.problem(options);
        let own = problem.blocks().next().map(|(id, _)| id);
        let variables = problem.variables().clone();
        extra(&stage, &variables, &mut problem)?;
        if let Some(own) = own {
            weight = problem.weight(own).unwrap_or(0.0);
            if weight > 0.0 {
                problem.remove(own)?;
            }
        }
        problem.check()?;
        let has_blocks = problem.blocks().next().is_some();
        added = has_blocks.then_some(problem);
    }
    input.check_scale(&options.energy, false, added.is_some())?;
    let terms = options.energy.terms.iter().map(|&(w, term)| (weight * w, term)).collect();
    let evaluator = SurfaceEnergy::new(surface, mesh.vertex_count(), options.quadrature);
    let mut objective = FamilyEnergy {
        evaluator: &evaluator,
        energy: Energy { terms },
        extra: added,
        epsilon_area: evaluator.area(base, &mut Workspace::default()),
        base,
        directions,
        x: base.clone(),
        gradient: vec![0.0; base.len()],
        work: Workspace::default(),
    };
    let settings = LbfgsOptions {
        memory: directions.len() + 2,
        max_iterations: options.iterations,
        energy_tol: ENERGY_TOLERANCE,
        window: WINDOW,
        gradient_tol: GRADIENT_TOLERANCE,
        ..LbfgsOptions::default()
    };
    let mut unknowns = vec![0.0; directions.len()];
    let solved = {
        let mut known = Replayed { objective: &mut objective, answers: &answers };
        let mut watch = Offering { observer: &mut *observer, answers: &answers };
        lbfgs(&mut known, &mut Euclidean, &mut unknowns, &settings, &stage, &mut watch)?
    };
    objective.place(&unknowns);
    let is_stopped = solved.status == Status::Interrupted;
    let meter = Meter { options, clamps: false, pulls: false };
    let stop = &mut || observer.stop_requested();
    let before = meter
        .energies(mesh, surface, options.quadrature, stop)
        .unwrap_or_else(EnergyTable::unknown);
    let mut result = mesh.clone();
    result.positions_mut().copy_from_slice(&unflatten(&objective.x));
    let timings = gp_solver::Timings { total: begin.elapsed(), ..solved.timings };
    let stages = vec![StageReport { stage, solver: Report { timings, ..solved } }];
    let creases = Creases::none();
    let measured = meter.measure(&result, &creases, surface, &before, &stages, observer);
    let Measured { mut status, after, metrics, extrapolated, warnings } = measured;
    if is_stopped {
        status = Status::Interrupted;
    }
    Ok(Solution {
        levels: vec![LevelNumbers {
            vertices: mesh.vertex_count(),
            patches: mesh.face_count(),
            evaluated_patches: evaluator.patch_count(),
            symmetries: 1,
            factor_len: 0,
        }],
        initial: mesh.clone(),
        initial_surface: surface.clone(),
        surface: surface.clone(),
        result,
        creases,
        before,
        after,
        metrics,
        extrapolated,
        warnings,
        clamps: meter.clamps,
        report: RunReport { status, ..RunReport::of_stages(stages) },
    })
}

/// The energy as a function of the members' shares.
struct FamilyEnergy<'a> {
    evaluator: &'a SurfaceEnergy,
    energy: Energy,
    extra: Option<Problem<'static>>,
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
}

impl Objective for FamilyEnergy<'_> {
    fn value_and_gradient(&mut self, shares: &[f64], out: &mut [f64]) -> f64 {
        self.place(shares);
        let (area, work) = (Some(self.epsilon_area), &mut self.work);
        let value = self.evaluator.gradient(&self.energy, &self.x, area, work, &mut self.gradient);
        for (to, direction) in out.iter_mut().zip(self.directions) {
            *to = direction.iter().zip(&self.gradient).map(|(d, g)| d * g).sum();
        }
        self.extra.as_ref().map_or(value, |extra| value + extra.add_gradient(shares, out))
    }
}

fn same_faces(a: &PolyMesh, b: &PolyMesh) -> bool {
    a.vertex_count() == b.vertex_count()
        && a.face_count() == b.face_count()
        && a.faces().all(|f| a.face_vertices(f).eq(b.face_vertices(f)))
}

fn refined(mesh: &PolyMesh, levels: usize) -> Result<PolyMesh, Error> {
    let mut mesh = mesh.clone();
    for _ in 0..levels {
        mesh = refine(&mesh, &Creases::none())?.mesh;
    }
    Ok(mesh)
}
