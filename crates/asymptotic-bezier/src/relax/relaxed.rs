//! Relaxed mode: moves tangents and curvatures as little as needed to make bad data good.
//!
//! Corner data are third-order data: one percent of noise on a tangent tilts the corner plane,
//! and where the curvature is small the torsion answers by spikes. The data are therefore taken
//! as measurements: unknowns are the tangent planes and torsions of the vertices, the arms in
//! these planes and the logarithms of the curvatures; the torsion equations are solved for the
//! own-arm coefficients, so every iterate is an exact asymptotic net. Levenberg-Marquardt
//! minimises the squared moves, in percent, plus a fairness of the curves: fourth differences of
//! the polygons (zero for the cubics of an Enneper net) and the variation of the torsion. The
//! weight of the fairness is raised from small values until the result is acceptable, so data
//! that are nearly good are hardly touched. One patch is a net of one face.

use std::sync::Arc;

use gp_solver::Options as SolverOptions;

use crate::boundary::options::{BoundaryOptions, TorsionHandle};
use crate::boundary::quad::{TURNING_LIMIT, quadrilateral_of};
use crate::boundary::solve::boundary_of;
use crate::boundary::solved::Boundary;
use crate::data::corners::{AsymptoticNet, CURVE_CORNERS, CornerData, Curvatures, INTO_IS_LEFT};
use crate::error::Error;
use crate::patch::options::PatchOptions;
use crate::relax::model::MovableNet;
use crate::shell::gridshell::fill_solved;
use crate::shell::joins::Joins;
use crate::stages::RELAXATION;
use crate::watch::Watch;

/// Fairness weight of the first solve without poles.
const TAMING_WEIGHT: f64 = 3.0;

/// Settings of the relaxed mode.
#[derive(Clone, Debug, PartialEq)]
pub struct RelaxOptions {
    /// Largest move of one tangent, `|Δt|/|t|`, or of one curvature, `|Δ log k|`.
    pub max_move: f64,
    /// Largest root mean square of all sixteen moves.
    pub rms_move: f64,
    /// Largest binormal turning of a curve, radians.
    pub max_turning: f64,
    /// Least sine between the parameter lines of the filled patch.
    pub min_sine: f64,
    /// Fairness weights, tried in this order until the result is acceptable.
    pub weights: Vec<f64>,
    /// Steps of each solve.
    pub max_iterations: usize,
}

impl Default for RelaxOptions {
    fn default() -> Self {
        Self {
            max_move: 0.05,
            rms_move: 0.02,
            max_turning: TURNING_LIMIT,
            min_sine: 0.1,
            weights: vec![0.03, 0.1, 0.3, 1.0, 3.0, 10.0],
            max_iterations: 60,
        }
    }
}

/// Result of the relaxed mode.
#[derive(Clone, Debug, PartialEq)]
pub struct Relaxed {
    /// The net with the moved data.
    pub net: AsymptoticNet,
    /// Torsion found for each vertex, to be prescribed when the net is solved.
    pub torsions: Vec<TorsionHandle>,
    /// Moves `|Δt|/|t|` of the tangents at both ends of all curves, then `|Δ log k|` of the
    /// curvatures.
    pub moves: Vec<f64>,
    /// Whether turning, torsion signs, regularity and moves are all within their limits.
    pub acceptable: bool,
    /// Solver steps of all weights tried.
    pub iterations: usize,
}

impl Relaxed {
    /// Root mean square of the moves.
    #[must_use]
    pub fn rms_move(&self) -> f64 {
        (self.moves.iter().map(|m| m * m).sum::<f64>() / self.moves.len().max(1) as f64).sqrt()
    }

    /// Largest move.
    #[must_use]
    pub fn max_move(&self) -> f64 {
        self.moves.iter().copied().fold(0.0, f64::max)
    }
}

/// Moves tangents and curvatures of `net` until its curves and patches are acceptable: turning
/// below the limit, no torsion sign change, regular. Curves that end at a vertex of odd valence or
/// have inflections need not keep the sign of their torsion.
///
/// Data that are acceptable already come back untouched. When no weight succeeds, the result
/// with the least turning within the tolerances is returned with `acceptable` false.
///
/// # Errors
/// The hard faults of the data themselves, which no small move can mend.
pub fn relax(net: &AsymptoticNet, options: &RelaxOptions) -> Result<Relaxed, Error> {
    relaxed_of(net, options, &mut Watch::quiet(&mut ()))
}

/// [`relax`], watched.
pub(crate) fn relaxed_of(
    net: &AsymptoticNet,
    options: &RelaxOptions,
    watch: &mut Watch<'_, '_>,
) -> Result<Relaxed, Error> {
    let model = Arc::new(MovableNet::new(net)?);
    watch.enter(RELAXATION, 0);
    let mut tries = Tries { net, options, model: &model, best: None, failure: None };
    let mut iterations = 0;
    let free = vec![TorsionHandle::Free; net.positions().len()];
    // Data that are good already stay, unless the caller adds something to the problem.
    let good = tries.judge(net.clone(), free, 0, watch)?;
    if !good || watch.is_extended() {
        // From the data first; where that ends in spikes, from curves that were made fair without
        // the poles of the torsion.
        'start: for tamed in [false, true] {
            let mut x = model.start();
            if tamed {
                iterations += moved(&model, TAMING_WEIGHT, true, &mut x, options, watch)?;
            }
            for &weight in &options.weights {
                iterations += moved(&model, weight, false, &mut x, options, watch)?;
                let (moved, torsions) = model.unpack(&x);
                let torsions = torsions.into_iter().map(TorsionHandle::Fixed).collect();
                if tries.judge(moved, torsions, iterations, watch)? {
                    break 'start;
                }
            }
        }
    }
    match (tries.best, tries.failure) {
        (Some((_, relaxed)), _) => Ok(Relaxed { iterations, ..relaxed }),
        (None, Some(error)) => Err(error),
        (None, None) => Ok(Relaxed {
            net: net.clone(),
            torsions: Vec::new(),
            moves: moves(net, net),
            acceptable: false,
            iterations,
        }),
    }
}

/// Levenberg-Marquardt from `x`; returns the number of steps.
fn moved(
    model: &Arc<MovableNet>,
    weight: f64,
    tame: bool,
    x: &mut [f64],
    options: &RelaxOptions,
    watch: &mut Watch<'_, '_>,
) -> Result<usize, Error> {
    let mut problem = model.problem(weight, tame);
    let stage = watch.stage().clone();
    watch.extend(&stage, &mut problem)?;
    let solver = SolverOptions {
        max_iterations: options.max_iterations,
        energy_tol: 1e-6,
        step_tol: 1e-8,
        ..SolverOptions::default()
    };
    watch.improve(problem, x, &solver)
}

/// The moved nets tried so far.
struct Tries<'t> {
    net: &'t AsymptoticNet,
    options: &'t RelaxOptions,
    model: &'t MovableNet,
    /// With its largest turning.
    best: Option<(f64, Relaxed)>,
    failure: Option<Error>,
}

impl Tries<'_> {
    /// Whether the net is acceptable.
    fn judge(
        &mut self,
        moved: AsymptoticNet,
        torsions: Vec<TorsionHandle>,
        iterations: usize,
        watch: &mut Watch<'_, '_>,
    ) -> Result<bool, Error> {
        let moves = moves(self.net, &moved);
        let mut relaxed = Relaxed { net: moved, torsions, moves, acceptable: false, iterations };
        let judged =
            watch.unextended(|watch| judge(&mut relaxed, self.model.odd(), self.options, watch));
        match judged {
            Ok(turning) => {
                let within = relaxed.max_move() <= self.options.max_move;
                let acceptable = relaxed.acceptable;
                let better = self.best.as_ref().is_none_or(|(least, _)| turning < *least);
                if acceptable || within && better {
                    self.best = Some((turning, relaxed));
                }
                Ok(acceptable)
            }
            Err(error @ Error::Interrupted { .. }) => Err(error),
            Err(error) => {
                self.failure.get_or_insert(error);
                Ok(false)
            }
        }
    }
}

/// [`relax`] for the corner data of one patch; the signs of unsigned curvatures are found first.
///
/// # Errors
/// As [`relax`].
pub fn relax_patch(
    data: &CornerData,
    options: &RelaxOptions,
) -> Result<(CornerData, Relaxed), Error> {
    relaxed_patch_of(data, options, &mut Watch::quiet(&mut ()))
}

/// [`relax_patch`], watched.
pub(crate) fn relaxed_patch_of(
    data: &CornerData,
    options: &RelaxOptions,
    watch: &mut Watch<'_, '_>,
) -> Result<(CornerData, Relaxed), Error> {
    watch.enter(RELAXATION, 0);
    let signed = match data.curvatures {
        Curvatures::Signed(k) => k,
        Curvatures::Unsigned(_) => {
            let default = BoundaryOptions::default();
            watch.unextended(|watch| quadrilateral_of(data, &default, watch))?.curvatures
        }
    };
    let relaxed = relaxed_of(&data.to_net(&signed), options, watch)?;
    let mut moved = data.clone();
    let mut k = signed;
    for (i, curve) in relaxed.net.curves().iter().enumerate() {
        for e in 0..2 {
            // Untouched points keep their last bit.
            if curve.arms[e] != data.arm(i, e) {
                let tip = data.corners[CURVE_CORNERS[i][e]] + curve.arms[e];
                *(if e == 0 { &mut moved.start_points[i] } else { &mut moved.end_points[i] }) = tip;
            }
            k[i][e] = curve.curvatures[e] * INTO_IS_LEFT[i][e];
        }
    }
    moved.curvatures = Curvatures::Signed(k);
    Ok((moved, relaxed))
}

/// Solves and, where the curves are good, fills; returns the largest turning.
fn judge(
    relaxed: &mut Relaxed,
    odd: &[bool],
    options: &RelaxOptions,
    watch: &mut Watch<'_, '_>,
) -> Result<f64, Error> {
    let net = &relaxed.net;
    let settings = BoundaryOptions { torsions: relaxed.torsions.clone(), ..Default::default() };
    let boundary: Boundary = boundary_of(net, &settings, watch)?;
    let qualities: Vec<_> = boundary.curves.iter().map(|c| c.quality()).collect();
    let curved = |i: &usize| !net.curves()[*i].line && net.curves()[*i].inflections == 0;
    let good = (0..qualities.len()).filter(curved).all(|i| {
        let q = &qualities[i];
        let free = net.curves()[i].ends.iter().any(|v| odd[*v]);
        q.turning < options.max_turning && (free || q.torsion[0] * q.torsion[1] > 0.0)
    });
    let turning = (0..qualities.len()).filter(curved).map(|i| qualities[i].turning);
    let turning = turning.filter(|t| t.is_finite()).fold(0.0, f64::max);
    let small = relaxed.rms_move() <= options.rms_move && relaxed.max_move() <= options.max_move;
    if good && small {
        relaxed.acceptable =
            match fill_solved(net, boundary, &PatchOptions::default(), Joins::G1, watch) {
                Ok(shell) => {
                    shell.patches.iter().all(|p| p.patch.least_sine(32) >= options.min_sine)
                }
                Err(error @ Error::Interrupted { .. }) => return Err(error),
                Err(_) => false,
            };
    }
    Ok(turning)
}

fn moves(from: &AsymptoticNet, to: &AsymptoticNet) -> Vec<f64> {
    let ends = || from.curves().iter().zip(to.curves()).flat_map(|(a, b)| [(a, b, 0), (a, b, 1)]);
    let arms = ends().map(|(a, b, e)| (b.arms[e] - a.arms[e]).length() / a.arms[e].length());
    let curvatures = ends().map(|(a, b, e)| {
        let (k, l) = (a.curvatures[e], b.curvatures[e]);
        if k == 0.0 { 0.0 } else { (l / k).ln().abs() }
    });
    arms.chain(curvatures).collect()
}
