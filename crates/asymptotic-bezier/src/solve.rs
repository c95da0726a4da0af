//! The whole run: relax, solve the curves, fill, measure.

use std::collections::BTreeMap;

use geom_core::DVec3;
use gp_solver::{Extra, Fingerprint, Observer, Problem, RunReport, Status, Variables};

use crate::boundary::options::{BoundaryOptions, TorsionHandle};
use crate::boundary::quad::{Quadrilateral, doubt_of, quadrilateral_of};
use crate::boundary::quartic::solve_quartic_quadrilateral;
use crate::boundary::solve::{boundary_of, boundary_problem};
use crate::boundary::solved::Boundary;
use crate::data::corners::{AsymptoticNet, CURVE_CORNERS, CornerData};
use crate::error::{Error, Place};
use crate::input::{Input, NetData};
use crate::kept::{entry_of, patches_of};
use crate::lamella::strip::{Lamella, LamellaOptions, lamellas};
use crate::metrics::Metrics;
use crate::options::Options;
use crate::patch::solve::{FilledPatch, patch_problem};
use crate::place::Moved;
use crate::relax::model::MovableNet;
use crate::relax::relaxed::{RelaxOptions, Relaxed, relaxed_of, relaxed_patch_of};
use crate::shell::gridshell::{
    Gridshell, GridshellCheck, fill_solved, filled_patches, filling, outlined, shell_of,
};
use crate::shell::joins::Joins;
use crate::shell::joint_solve::joint_problem;
use crate::stages::{BOUNDARY, Phase};
use crate::warning::Warning;
use crate::watch::{Entry, Watch};
use crate::wishes::{TorsionWish, torsion_handles};

/// A solved, filled and measured net; one patch is a net of one face.
///
/// # Example
/// ```
/// use asymptotic_bezier::{Options, Status, solve};
/// # use geom_core::{DVec3, PolyMesh};
/// # let point = |k: usize| {
/// #     let (p, q) = (0.2 + 0.3 * (k / 4) as f64, 0.1 + 0.3 * (k % 4) as f64);
/// #     let (u, v) = (0.5 * (p + q), 0.5 * (p - q));
/// #     DVec3::new(u - u.powi(3) / 3.0 + u * v * v, v - v.powi(3) / 3.0 + v * u * u, u * u - v * v)
/// # };
/// # let corner = |k: u32| 4 * (k / 3) + k % 3;
/// # let faces: Vec<[u32; 4]> = (0..9).map(corner).map(|a| [a, a + 4, a + 5, a + 1]).collect();
/// // Nine quads along asymptotic lines of Enneper's surface.
/// let mesh = PolyMesh::new((0..16).map(point).collect(), &faces)?;
/// let solution = solve(&mesh.into(), &Options::default(), &mut ())?;
/// assert_eq!(solution.report.status, Status::Converged);
/// assert_eq!((solution.result.patches.len(), solution.check.joins.len()), (9, 12));
/// assert!(solution.metrics.normal_curvature_max < 1e-9);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct Solution {
    /// Curves and patches.
    pub result: Gridshell,
    /// The net, after a relaxation with the moved data.
    pub net: AsymptoticNet,
    /// Measurements patch by patch and join by join.
    pub check: GridshellCheck,
    /// The numbers to report.
    pub metrics: Metrics,
    /// What was built although the user should know something about it.
    pub warnings: Vec<Warning>,
    /// With C1 and G2 joins, the largest jump of the mean curvature that G1 joins would leave.
    pub mean_jump_before: Option<f64>,
    /// What the relaxed mode did, when asked for.
    pub relaxed: Option<Relaxed>,
    /// What the solver did: [`Status::Partial`] or [`Status::Failed`] if patches cross themselves, by
    /// [`Status::checked`]; [`Status::Stalled`] if a relaxation found no acceptable data, else
    /// [`Status::Converged`]; steps and stages are those of the least-squares solves, the others end
    /// at once.
    pub report: RunReport,
}

impl Solution {
    /// The straight strips along the curves, with the sizes in force.
    #[must_use]
    pub fn lamellas(&self, options: &Options) -> (LamellaOptions, Vec<Lamella>) {
        let boundary = &self.result.boundary;
        let mut settings = LamellaOptions { width: 1.0, thickness: 0.05, moduli: None };
        settings.width = options.lamella_width.unwrap_or_else(|| {
            let strips = lamellas(&self.net, boundary, &settings);
            strips.iter().map(|l| l.length).fold(0.0, f64::max) / 20.0
        });
        settings.thickness = options.lamella_thickness.unwrap_or(settings.width / 20.0);
        settings.moduli = options.youngs_modulus.zip(options.shear_modulus).map(|(e, g)| [e, g]);
        let strips = lamellas(&self.net, boundary, &settings);
        (settings, strips)
    }
}

/// Solves, fills and measures.
///
/// # Errors
/// The hard faults of [`Error`]; [`Error::Interrupted`] if the observer stops the run. Its checkpoints
/// hold what was solved by then.
///
/// # Example
/// A net from positions: a grid of points of Enneper's surface along its asymptotic lines.
/// ```
/// use asymptotic_bezier::{Input, Joins, Options, solve};
/// use geom_core::{DVec3, PolyMesh};
/// let point = |k: usize| {
///     let (p, q) = (0.2 + 0.3 * (k / 4) as f64, 0.1 + 0.3 * (k % 4) as f64);
///     let (u, v) = (0.5 * (p + q), 0.5 * (p - q));
///     DVec3::new(u - u.powi(3) / 3.0 + u * v * v, v - v.powi(3) / 3.0 + v * u * u, u * u - v * v)
/// };
/// let faces: Vec<[u32; 4]> =
///     (0..9).map(|k| 4 * (k / 3) + k % 3).map(|a| [a, a + 4, a + 5, a + 1]).collect();
/// let mesh = PolyMesh::new((0..16).map(point).collect(), &faces)?;
/// let options = Options { joins: Joins::G2, ..Options::default() };
/// let solution = solve(&mesh.into(), &options, &mut ())?;
/// assert_eq!(solution.metrics.patches, 9);
/// assert!(solution.metrics.kink_max_deg < 1e-8);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn solve(
    input: &Input,
    options: &Options,
    observer: &mut dyn Observer,
) -> Result<Solution, Error> {
    run(input, options, None, observer)
}

/// As [`solve`], with blocks of one's own: `extra` is called whenever a stage has built its problem
/// ([`RELAXATION`](crate::RELAXATION), [`BOUNDARY`], [`PATCH`](crate::PATCH),
/// [`JOINT`](crate::JOINT)) and may add to it, weigh its blocks, take some out or fix unknowns.
///
/// Stages that are solved exactly take linear rows, as squares or as equations
/// ([`is_equation`](gp_solver::ResidualBlock::is_equation)), and quadratic energies; anything else is
/// refused with [`gp_solver::SolverError::NotQuadratic`]. What is fixed there keeps the value it has
/// without additions.
///
/// # Errors
/// As [`solve`], and whatever `extra` returns.
///
/// # Example
/// The middle of a patch is to lie at a given height:
/// ```
/// use asymptotic_bezier::{CONTROL_POINTS, DataFile, Options, solve_with};
/// use gp_solver::{Problem, QuadraticBuilder, Stage, Variables};
/// # let text = std::fs::read_to_string("../../fixtures/asymptotic/catenoid.ron").unwrap();
/// # let options = ron::Options::default()
/// #     .with_default_extension(ron::extensions::Extensions::IMPLICIT_SOME);
/// # let file: DataFile = options.from_str(&text)?;
/// let mut lift = |stage: &Stage, variables: &Variables, problem: &mut Problem<'_>| {
///     if stage.name == "patch 0" {
///         let points = variables.group(CONTROL_POINTS)?;
///         let [n, _] = points.shape();
///         let mut height = QuadraticBuilder::new("height");
///         let goal = stage.place([0.0, 0.0, 0.62])[2];
///         let inner = points.column(n * (n / 2) + n / 2, 2);
///         height.equation(1.0).linear(inner, 1.0).constant(-goal);
///         problem.add(height.build_exact());
///     }
///     Ok(())
/// };
/// let solution = solve_with(&file.input()?, &Options::default(), &mut lift, &mut ())?;
/// let patch = &solution.result.patches[0].patch;
/// let middle = patch.degree().div_ceil(2);
/// assert!((patch.point(middle, middle).z - 0.62).abs() < 1e-9);
/// assert!(solution.metrics.normal_curvature_max < 1e-9);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn solve_with(
    input: &Input,
    options: &Options,
    extra: &mut Extra<'_, Error>,
    observer: &mut dyn Observer,
) -> Result<Solution, Error> {
    run(input, options, Some(extra), observer)
}

/// The problem of a stage before anything is added: the first one, where a stage has several.
///
/// # Errors
/// As [`solve`]; [`Error::NoSuchStage`] for quartics and joins that have none.
///
/// # Example
/// ```
/// use asymptotic_bezier::{Options, Phase, problem};
/// # use geom_core::{DVec3, PolyMesh};
/// # let point = |k: usize| {
/// #     let (p, q) = (0.2 + 0.3 * (k / 4) as f64, 0.1 + 0.3 * (k % 4) as f64);
/// #     let (u, v) = (0.5 * (p + q), 0.5 * (p - q));
/// #     DVec3::new(u - u.powi(3) / 3.0 + u * v * v, v - v.powi(3) / 3.0 + v * u * u, u * u - v * v)
/// # };
/// # let corner = |k: u32| 4 * (k / 3) + k % 3;
/// # let faces: Vec<[u32; 4]> = (0..9).map(corner).map(|a| [a, a + 4, a + 5, a + 1]).collect();
/// // Nine quads along asymptotic lines of Enneper's surface.
/// let mesh = PolyMesh::new((0..16).map(point).collect(), &faces)?;
/// let problem = problem(&mesh.into(), &Options::default(), Phase::Joint)?;
/// assert!(problem.unknowns() > 0);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn problem(input: &Input, options: &Options, phase: Phase) -> Result<Problem<'static>, Error> {
    let prepared = Prepared::new(input, -input.center()?, options)?;
    let (boundary, patch) = (&prepared.boundary, options.patch());
    let mut nobody = ();
    let watch = &mut Watch::quiet(&mut nobody);
    let net = match &prepared.data {
        NetData::Net(net) => net.clone(),
        NetData::Patch(data) => {
            if options.wants_quartics() {
                let remedy = "quartics of a single patch have no problem to add to";
                return Err(Error::NoSuchStage { stage: BOUNDARY, remedy });
            }
            data.to_net(&quadrilateral_of(data, boundary, watch)?.curvatures)
        }
    };
    match phase {
        Phase::Relaxation => {
            let default = RelaxOptions::default();
            let weight = default.weights.first().copied().unwrap_or(1.0);
            Ok(std::sync::Arc::new(MovableNet::new(&net)?).problem(weight, false))
        }
        Phase::Boundary => boundary_problem(&net, boundary),
        Phase::Patch | Phase::Joint => {
            let solved = boundary_of(&net, boundary, watch)?;
            let outlines = outlined(&net, &solved)?.outlines;
            if phase == Phase::Joint {
                return joint_problem(&net, &solved, &outlines, options.degree);
            }
            patch_problem(&outlines[0], &patch, Place::Patch(0))
        }
    }
}

/// The named unknowns of a stage, those fixed that stay.
///
/// # Errors
/// As [`problem`].
///
/// # Example
/// ```
/// use asymptotic_bezier::{CONTROL_POINTS, DataFile, Options, Phase, variables};
/// # let text = std::fs::read_to_string("../../fixtures/asymptotic/catenoid.ron").unwrap();
/// # let options = ron::Options::default()
/// #     .with_default_extension(ron::extensions::Extensions::IMPLICIT_SOME);
/// # let file: DataFile = options.from_str(&text)?;
/// let unknowns = variables(&file.input()?, &Options::default(), Phase::Patch)?;
/// let points = unknowns.group(CONTROL_POINTS)?;
/// // A square net of points.
/// let [u, v] = points.shape();
/// assert_eq!((u, u * v), (v, points.len()));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn variables(input: &Input, options: &Options, phase: Phase) -> Result<Variables, Error> {
    Ok(problem(input, options, phase)?.variables().clone())
}

/// What is known before anything is solved.
struct Prepared {
    data: NetData,
    boundary: BoundaryOptions,
}

impl Prepared {
    /// The data moved by a vector, and how their curves are to be solved.
    fn new(input: &Input, by: DVec3, options: &Options) -> Result<Self, Error> {
        options.check()?;
        let data = input.data.clone().moved(by).resolve()?;
        let mut wishes: BTreeMap<String, TorsionWish> = input.torsions.clone();
        for w in options.torsion.iter() {
            wishes.insert(w.corner.clone(), TorsionWish::Between(w.min, w.max));
        }
        for w in options.gauss.iter() {
            wishes.insert(w.corner.clone(), TorsionWish::GaussianBetween(w.min, w.max, 0.0));
        }
        let torsions: Vec<TorsionHandle> = match &data {
            NetData::Patch(data) => {
                torsion_handles(&data.to_net(data.curvatures.values()), &wishes)
            }
            NetData::Net(net) => torsion_handles(net, &wishes),
        }?;
        Ok(Self { data, boundary: BoundaryOptions { torsions, ..options.boundary() } })
    }
}

fn run(
    input: &Input,
    options: &Options,
    extra: Option<&mut Extra<'_, Error>>,
    observer: &mut dyn Observer,
) -> Result<Solution, Error> {
    let center = input.center()?;
    let prepared = Prepared::new(input, -center, options)?;
    let fingerprint = Fingerprint::new().text(&format!("{input:?} {options:?}")).finish();
    let stages = 2 + usize::from(options.relaxed);
    let mut watch = Watch::new(observer, extra, fingerprint, stages, center)?;
    let filled = match &prepared.data {
        NetData::Patch(data) => fill_one(data, prepared.boundary, options, &mut watch)?,
        NetData::Net(net) => fill_all(net, prepared.boundary, options, &mut watch)?,
    };
    let Filled { net, shell, relaxed, mean_jump_before, doubt } = filled;
    let mut check = shell.verified(&net, &options.patch(), &mut watch)?;
    check.warnings.extend(doubt);
    let mut warnings = check.warnings.clone();
    if shell.boundary.is_from_normals() {
        let unused = options.for_curvatures().into_iter();
        warnings.extend(unused.map(|option| Warning::NotUsed { option }));
    }
    let acceptable = relaxed.as_ref().is_none_or(|r| r.acceptable);
    let status = if acceptable { Status::Converged } else { Status::Stalled };
    let crossing = check.patches.iter().filter(|patch| patch.self_intersections > 0).count();
    let status = status.checked(crossing, check.patches.len());
    let (iterations, stages) = watch.into_reports();
    Ok(Solution {
        metrics: Metrics::new(&shell, &check),
        result: shell.moved(center),
        net: net.moved(center),
        check,
        warnings,
        mean_jump_before,
        relaxed: relaxed.map(|relaxed| relaxed.moved(center)),
        report: RunReport { status, iterations, stages },
    })
}

/// What is solved but not measured.
struct Filled {
    net: AsymptoticNet,
    shell: Gridshell,
    relaxed: Option<Relaxed>,
    mean_jump_before: Option<f64>,
    doubt: Option<Warning>,
}

fn fill_all(
    net: &AsymptoticNet,
    mut boundary: BoundaryOptions,
    options: &Options,
    watch: &mut Watch<'_, '_>,
) -> Result<Filled, Error> {
    let default = RelaxOptions::default();
    let relaxed = options.relaxed.then(|| relaxed_of(net, &default, watch)).transpose()?;
    let mut net = net.clone();
    if let Some(relaxed) = &relaxed {
        net = relaxed.net.clone();
        boundary.torsions = relaxed.torsions.clone();
    }
    let number = usize::from(options.relaxed);
    watch.enter(BOUNDARY, number);
    watch.show(0, 0.0)?;
    let solved = boundary_of(&net, &boundary, watch)?;
    watch.show(1, solved.strain_energy)?;
    watch.enter(filling(options.joins), number + 1);
    watch.show(0, 0.0)?;
    let mean_jump_before = match options.joins {
        Joins::G1 => None,
        _ => watch.unextended(|watch| mean_jump(&net, &solved, options, watch))?,
    };
    let outlined = outlined(&net, &solved)?;
    let (patches, continuous) = recorded(watch, |watch| {
        let patch = options.patch();
        filled_patches(&net, &solved, &outlined.outlines, &patch, options.joins, watch)
    })?;
    let shell = shell_of(solved, outlined, patches, continuous);
    watch.show(1, shell.thin_plate_energy())?;
    Ok(Filled { net, shell, relaxed, mean_jump_before, doubt: None })
}

/// The largest jump of the mean curvature that G1 joins leave.
fn mean_jump(
    net: &AsymptoticNet,
    boundary: &Boundary,
    options: &Options,
    watch: &mut Watch<'_, '_>,
) -> Result<Option<f64>, Error> {
    if let Some(entry) = watch.recall() {
        return Ok(entry.numbers.first().copied());
    }
    let jump = match fill_solved(net, boundary.clone(), &options.patch(), Joins::G1, watch) {
        Ok(shell) => Some(shell.check_joins(net).iter().map(|j| j.mean_jump).fold(0.0, f64::max)),
        Err(error @ Error::Interrupted { .. }) => return Err(error),
        // Where G1 patches fold there is nothing to compare with.
        Err(_) => None,
    };
    watch.record(Entry { numbers: jump.into_iter().collect(), counts: Vec::new() });
    Ok(jump)
}

/// Fills, or takes what an interrupted run has filled.
fn recorded(
    watch: &mut Watch<'_, '_>,
    fill: impl FnOnce(&mut Watch<'_, '_>) -> Result<(Vec<FilledPatch>, Vec<bool>), Error>,
) -> Result<(Vec<FilledPatch>, Vec<bool>), Error> {
    if let Some(entry) = watch.recall() {
        return patches_of(&entry);
    }
    let (patches, continuous) = fill(watch)?;
    watch.record(entry_of(&patches, &continuous));
    Ok((patches, continuous))
}

fn fill_one(
    data: &CornerData,
    mut boundary: BoundaryOptions,
    options: &Options,
    watch: &mut Watch<'_, '_>,
) -> Result<Filled, Error> {
    let (mut data, mut relaxed) = (data.clone(), None);
    if options.relaxed {
        let (moved, what) = relaxed_patch_of(&data, &RelaxOptions::default(), watch)?;
        boundary.torsions = what.torsions.clone();
        (data, relaxed) = (moved, Some(what));
    }
    let number = usize::from(options.relaxed);
    watch.enter(BOUNDARY, number);
    watch.show(0, 0.0)?;
    let quad = if options.wants_quartics() && !options.relaxed {
        solve_quartic_quadrilateral(&data)?
    } else {
        quadrilateral_of(&data, &boundary, watch)?
    };
    watch.show(1, quad.strain_energy)?;
    let net = data.to_net(&quad.curvatures);
    let doubt = match options.wants_quartics() {
        true => None,
        false => watch.unextended(|watch| doubt_of(&data, &quad, &boundary, watch))?,
    };
    watch.enter(filling(Joins::G1), number + 1);
    watch.show(0, 0.0)?;
    let outline = [quad.boundary.clone()];
    let solved = boundary_of_one(&net, &quad);
    let (patches, _) = recorded(watch, |watch| {
        filled_patches(&net, &solved, &outline, &options.patch(), Joins::G1, watch)
    })?;
    let shell = shell_of_one(solved, quad, patches);
    watch.show(1, shell.thin_plate_energy())?;
    Ok(Filled { net, shell, relaxed, mean_jump_before: None, doubt })
}

/// The boundary of one patch as that of a net.
fn boundary_of_one(net: &AsymptoticNet, quad: &Quadrilateral) -> Boundary {
    let normals = (0..4).map(|c| {
        // Counter-clockwise: the u-curve leads at 00 and 11, the v-curve at the others.
        let at = |i: usize| {
            let end = usize::from(CURVE_CORNERS[i][1] == c);
            net.curves()[i].arms[end]
        };
        let (u, v) = (if c < 2 { 0 } else { 2 }, if c % 2 == 0 { 1 } else { 3 });
        let n = at(u).cross(at(v)).normalize();
        if c == 0 || c == 3 { n } else { -n }
    });
    Boundary {
        curves: quad.boundary.curves.to_vec(),
        torsions: quad.torsions.to_vec(),
        strain_energy: quad.strain_energy,
        freedoms: quad.freedoms,
        warnings: Vec::new(),
        inflections: quad.boundary.inflections.to_vec(),
        signs: vec![[1.0; 2], [-1.0; 2], [1.0; 2], [-1.0; 2]],
        normals: normals.collect(),
    }
}

fn shell_of_one(boundary: Boundary, quad: Quadrilateral, patches: Vec<FilledPatch>) -> Gridshell {
    let mut warnings = quad.warnings;
    warnings.extend(patches.iter().flat_map(|p| p.warnings.iter().cloned()));
    Gridshell {
        boundary,
        qualities: quad.qualities.to_vec(),
        patches,
        outlines: vec![quad.boundary],
        continuous: vec![false; 4],
        warnings,
    }
}
