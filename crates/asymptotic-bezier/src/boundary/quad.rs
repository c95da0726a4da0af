//! One asymptotic quadrilateral: the boundary of a single patch, with its sign branches.

use crate::boundary::four_curves::PatchBoundary;
use crate::boundary::options::BoundaryOptions;
use crate::boundary::solve::boundary_of;
use crate::curve::bezier::{BezierCurve, CurveQuality};
use crate::data::corners::{CURVE_CORNERS, CornerData, Curvatures, DATA_DEGREE};
use crate::error::{Error, Place};
use crate::warning::Warning;
use crate::watch::Watch;

/// Binormal turning above which a curve is warned about, in radians.
pub(crate) const TURNING_LIMIT: f64 = std::f64::consts::PI;

/// Slowest speed relative to the mean before a curve counts as cusped.
pub(crate) const CUSP_TOL: f64 = 1e-6;

/// Least curvature over greatest below which a curve is nearly inflected.
const NEAR_ZERO_CURVATURE: f64 = 0.02;

/// How much less another branch must turn before the given signs are doubted.
const BRANCH_RATIO: f64 = 2.0;

/// A solved asymptotic quadrilateral.
#[derive(Clone, Debug, PartialEq)]
pub struct Quadrilateral {
    /// Curves `r1..r4`, lines and inflections, ready to be filled.
    pub boundary: PatchBoundary,
    /// Torsion of the u-curves at the corners `00`, `10`, `01`, `11`; `K = −τ²` there.
    pub torsions: [f64; 4],
    /// `Σ ∫ |r″|² dt` (Wang et al. 2019, Eq. 3.4).
    pub strain_energy: f64,
    /// Signed curvatures used, positive into the patch.
    pub curvatures: [[f64; 2]; 4],
    /// Sampled quality of each curve.
    pub qualities: [CurveQuality; 4],
    /// Number of unknowns the energy decided.
    pub freedoms: usize,
    /// What should be looked at.
    pub warnings: Vec<Warning>,
}

impl Quadrilateral {
    /// Largest binormal turning of the four curves, in radians.
    #[must_use]
    pub fn turning(&self) -> f64 {
        self.qualities.iter().map(|q| q.turning).filter(|t| t.is_finite()).fold(0.0, f64::max)
    }

    /// The paper's coefficients of the third points along their own arms, start and end of
    /// `r1..r4`, in the oblique frame of the two arms (quintics only; zero-padded otherwise).
    #[must_use]
    pub fn own_arm_coefficients(&self, data: &CornerData) -> [f64; 8] {
        let mut out = [0.0; 8];
        for i in 0..4 {
            let points = self.boundary.curves[i].points();
            let n = points.len() - 1;
            for e in 0..2 {
                let corner = CURVE_CORNERS[i][e];
                let third = if e == 0 { points[2] } else { points[n - 2] };
                let own = data.arm(i, e) * (DATA_DEGREE as f64 / n as f64);
                // The other curve at this corner.
                let (j, f) = (0..4)
                    .flat_map(|j| [(j, 0), (j, 1)])
                    .find(|(j, f)| *j != i && CURVE_CORNERS[*j][*f] == corner)
                    .unwrap_or((i, e));
                let other = data.arm(j, f);
                let normal = own.cross(other);
                // P − X = x own + m other: cross with other removes m.
                let d = third - data.corners[corner];
                out[2 * i + e] = d.cross(other).dot(normal) / normal.length_squared();
            }
        }
        out
    }
}

/// Solves the boundary of one patch.
///
/// With unsigned curvatures all sign branches (one sign per curve, 16 for four curved sides) are
/// solved and the one whose binormals turn least is taken, ties by strain energy. With signed
/// curvatures the signs are kept; [`doubt_signs`] tells whether others would be better.
///
/// # Errors
/// The hard faults of [`Error`].
///
/// # Example
/// ```
/// use asymptotic_bezier::{BoundaryOptions, CornerData, Curvatures, solve_quadrilateral};
/// use geom_core::DVec3;
/// let v = |x: f64, y: f64, z: f64| DVec3::new(x, y, z);
/// let data = CornerData {
///     corners: [v(-1., -1., 0.6), v(1., -1., -0.6), v(-1., 1., -0.6), v(1., 1., 0.6)],
///     start_points: [
///         v(-0.6, -1.08, 0.384), v(-1.08, -0.6, 0.384),
///         v(-0.6, 1.08, -0.384), v(1.08, -0.6, -0.384),
///     ],
///     end_points: [
///         v(0.6, -1.08, -0.384), v(-1.08, 0.6, -0.384),
///         v(0.6, 1.08, 0.384), v(1.08, 0.6, 0.384),
///     ],
///     curvatures: Curvatures::Unsigned([[0.3; 2]; 4]),
///     lines: [false; 4],
///     inflections: [0; 4],
/// };
/// let quad = solve_quadrilateral(&data, &BoundaryOptions::default())?;
/// assert!((quad.torsions[0] - 0.2766541628).abs() < 1e-9);
/// # Ok::<(), asymptotic_bezier::Error>(())
/// ```
pub fn solve_quadrilateral(
    data: &CornerData,
    options: &BoundaryOptions,
) -> Result<Quadrilateral, Error> {
    quadrilateral_of(data, options, &mut Watch::quiet(&mut ()))
}

/// [`solve_quadrilateral`], watched.
pub(crate) fn quadrilateral_of(
    data: &CornerData,
    options: &BoundaryOptions,
    watch: &mut Watch<'_, '_>,
) -> Result<Quadrilateral, Error> {
    match data.curvatures {
        Curvatures::Signed(k) => solve_signed(data, &k, options, watch),
        Curvatures::Unsigned(k) => match best_branch(data, &k, options, watch)? {
            Some(quad) => Ok(quad),
            // No branch can be solved: the first one tells why.
            None => solve_signed(data, &branch(&k, data, 0), options, watch),
        },
    }
}

/// A warning when other curvature signs make the binormals turn by less than half; solves all
/// sign branches, so it belongs to the verification of a patch.
#[must_use]
pub fn doubt_signs(
    data: &CornerData,
    quad: &Quadrilateral,
    options: &BoundaryOptions,
) -> Option<Warning> {
    // Nobody stops it.
    doubt_of(data, quad, options, &mut Watch::quiet(&mut ())).ok().flatten()
}

/// [`doubt_signs`], watched.
pub(crate) fn doubt_of(
    data: &CornerData,
    quad: &Quadrilateral,
    options: &BoundaryOptions,
    watch: &mut Watch<'_, '_>,
) -> Result<Option<Warning>, Error> {
    Ok(best_branch(data, &quad.curvatures, options, watch)?
        .and_then(|best| better_branch(data, quad, &best)))
}

fn better_branch(data: &CornerData, quad: &Quadrilateral, best: &Quadrilateral) -> Option<Warning> {
    if best.turning() * BRANCH_RATIO >= quad.turning() {
        return None;
    }
    let signs: Vec<String> = (0..4)
        .filter(|i| !data.lines[*i])
        .map(|i| {
            let sign = |x: f64| if x > 0.0 { '+' } else { '-' };
            let [start, end] = best.curvatures[i].map(sign);
            format!("r{} {start}{end}", i + 1)
        })
        .collect();
    Some(Warning::BetterBranch {
        place: Place::Patch(0),
        signs: signs.join(", "),
        best_degrees: best.turning().to_degrees(),
        degrees: quad.turning().to_degrees(),
    })
}

/// Curvatures of branch `b`: bit `i` makes curve `i` bend out of the patch at its start.
fn branch(k: &[[f64; 2]; 4], data: &CornerData, b: usize) -> [[f64; 2]; 4] {
    std::array::from_fn(|i| {
        let sign = if b >> i & 1 == 1 { -1.0 } else { 1.0 };
        let parity = if data.inflections[i] % 2 == 1 { -1.0 } else { 1.0 };
        [sign * k[i][0].abs(), sign * parity * k[i][1].abs()]
    })
}

fn best_branch(
    data: &CornerData,
    k: &[[f64; 2]; 4],
    options: &BoundaryOptions,
    watch: &mut Watch<'_, '_>,
) -> Result<Option<Quadrilateral>, Error> {
    let mut best: Option<Quadrilateral> = None;
    for b in 0..16 {
        // A line has no sign to choose.
        if (0..4).any(|i| data.lines[i] && b >> i & 1 == 1) {
            continue;
        }
        watch.check()?;
        let quad = match solve_signed(data, &branch(k, data, b), options, watch) {
            Ok(quad) => quad,
            Err(error @ Error::Interrupted { .. }) => return Err(error),
            Err(_) => continue,
        };
        let better = best.as_ref().is_none_or(|best| {
            let (a, b) = (quad.turning(), best.turning());
            a < b * (1.0 - 1e-9)
                || (a < b * (1.0 + 1e-9) && quad.strain_energy < best.strain_energy)
        });
        if better {
            best = Some(quad);
        }
    }
    Ok(best)
}

/// Solves with the curvature signs as they are.
pub(crate) fn solve_signed(
    data: &CornerData,
    signed: &[[f64; 2]; 4],
    options: &BoundaryOptions,
    watch: &mut Watch<'_, '_>,
) -> Result<Quadrilateral, Error> {
    let net = data.to_net(signed);
    let solved = boundary_of(&net, options, watch)?;
    let curves: [BezierCurve; 4] = std::array::from_fn(|i| solved.curves[i].clone());
    let torsions: [f64; 4] = std::array::from_fn(|c| solved.torsions[c]);
    let inflections = std::array::from_fn(|i| solved.inflections[i].clone());
    finish(data, *signed, curves, torsions, inflections, solved.freedoms, solved.warnings)
}

/// Qualities, hard faults of the curves and warnings.
pub(crate) fn finish(
    data: &CornerData,
    curvatures: [[f64; 2]; 4],
    curves: [BezierCurve; 4],
    torsions: [f64; 4],
    inflections: [Vec<f64>; 4],
    freedoms: usize,
    mut warnings: Vec<Warning>,
) -> Result<Quadrilateral, Error> {
    let qualities: [CurveQuality; 4] = std::array::from_fn(|i| curves[i].quality());
    for i in 0..4 {
        check_curve(
            Place::PatchCurve(i),
            &curves[i],
            &qualities[i],
            data.lines[i],
            &inflections[i],
            &mut warnings,
        )?;
        if data.lines[i] {
            // The families alternate around a face, so a line sees the same family at both ends.
            let [a, b] = CURVE_CORNERS[i];
            if torsions[a] * torsions[b] < 0.0 {
                warnings.push(Warning::LineTorsionSigns {
                    place: Place::PatchCurve(i),
                    start: torsions[a],
                    end: torsions[b],
                });
            }
        }
    }
    // A corner between two lines has no torsion to compare.
    let known = |c: usize| (0..4).any(|i| !data.lines[i] && CURVE_CORNERS[i].contains(&c));
    let positive = (0..4).any(|c| known(c) && torsions[c] > 0.0);
    let negative = (0..4).any(|c| known(c) && torsions[c] < 0.0);
    if positive && negative {
        warnings.push(Warning::CornerTorsionSigns { place: Place::Patch(0), values: torsions });
    }
    Ok(Quadrilateral {
        strain_energy: curves.iter().map(|c| c.derivative_energy(2)).sum(),
        boundary: PatchBoundary { curves, lines: data.lines, inflections, ribbons: [None; 4] },
        torsions,
        curvatures,
        qualities,
        freedoms,
        warnings,
    })
}

/// Hard faults and warnings of one solved curve.
pub(crate) fn check_curve(
    place: Place,
    curve: &BezierCurve,
    quality: &CurveQuality,
    line: bool,
    inflections: &[f64],
    warnings: &mut Vec<Warning>,
) -> Result<(), Error> {
    let relative_speed = quality.relative_speed;
    if !(relative_speed > CUSP_TOL) {
        return Err(Error::Cusp { place, relative_speed });
    }
    if line {
        return Ok(());
    }
    // Inflections are harmless where they are declared, or the normals are known beforehand.
    if inflections.is_empty() && curve.normals().is_none() {
        if let Some(t) = quality.reversal {
            return Err(Error::UndeclaredInflection { place, t });
        }
        let ratio = quality.curvature[0] / quality.curvature[1];
        if !(ratio >= NEAR_ZERO_CURVATURE) {
            warnings.push(Warning::NearZeroCurvature { place, ratio });
        }
    }
    if !(quality.turning <= TURNING_LIMIT) {
        let degrees = quality.turning.to_degrees();
        warnings.push(Warning::BinormalTurning { place, degrees });
    }
    let [min, max] = quality.torsion;
    if min < 0.0 && max > 0.0 {
        warnings.push(Warning::TorsionSignChange { place, min, max });
    }
    Ok(())
}
