//! Fills a boundary: the freedoms of least energy, bounds where the patch would fold, higher degrees
//! where bounds do not help.

use numerics::minimize_quadratic;

use crate::boundary::four_curves::PatchBoundary;
use crate::error::{AsymptoticError, AsymptoticWarning, Place};
use crate::patch::bounds;
use crate::patch::family::PatchFamily;
use crate::patch::mask::masked;
use crate::patch::options::{Ansatz, PatchOptions};
use crate::patch::surface::Patch;
use crate::patch::thin_plate::MAX_SURFACE_DEGREE;

/// A filled patch.
#[derive(Clone, Debug, PartialEq)]
pub struct FilledPatch {
    /// The surface.
    pub patch: Patch,
    /// `∫∫ |R_uu|² + 2 |R_uv|² + |R_vv|²`.
    pub thin_plate_energy: f64,
    /// Freedoms of the tangent fields.
    pub freedoms: usize,
    /// Least transversality along the boundary, relative to the interpolated corner values.
    pub transversality: f64,
    /// Bounds that were needed, degrees that were raised.
    pub warnings: Vec<AsymptoticWarning>,
}

/// Fills one boundary; `place` names the patch in messages.
///
/// # Errors
/// [`AsymptoticError::Degree`], [`AsymptoticError::CornerEquations`], and
/// [`AsymptoticError::Folded`] when no degree gives a regular boundary.
pub fn fill_patch(
    boundary: &PatchBoundary,
    options: &PatchOptions,
    place: Place,
) -> Result<FilledPatch, AsymptoticError> {
    let p = boundary.curves[0].degree();
    let paper = 3 * p - 4;
    let tried: &[usize] = match (options.ansatz, options.degree) {
        (Ansatz::Module, Some(n)) => &[n],
        // Curves made from normals leave their patches as much freedom as quintics do.
        (Ansatz::Module, None) if boundary.curves.iter().all(|c| c.normals().is_some()) => {
            &[7, 8, 11]
        }
        (Ansatz::Module, None) => match p {
            ..=5 => &[7, 8, 11],
            6 => &[8, 9, 12],
            7 => &[9, 10, 13],
            8 => &[10, 11, 14],
            _ => &[11, 12, 15],
        },
        _ => &[paper],
    };
    let first = tried[0];
    let mut best: Option<FilledPatch> = None;
    let mut failure = None;
    for &n in tried {
        let min = if p == 4 { 5 } else { p };
        if !(min..=MAX_SURFACE_DEGREE).contains(&n) {
            let (degree, max) = (n, MAX_SURFACE_DEGREE);
            return Err(AsymptoticError::Degree { what: "surface", degree, min, max });
        }
        match fill_degree(boundary, n, options, place) {
            Ok(mut filled) => {
                if n != first {
                    filled.warnings.push(AsymptoticWarning::DegreeRaised {
                        place,
                        from: first,
                        to: n,
                    });
                }
                if tried.len() == 1 || filled.patch.least_sine(16) >= options.min_sine {
                    return Ok(filled);
                }
                best.get_or_insert(filled);
            }
            Err(error @ AsymptoticError::Folded { .. }) => {
                failure.get_or_insert(error);
            }
            Err(error) => return Err(error),
        }
    }
    // None has the sine asked for: the lowest regular degree is as good as any.
    best.ok_or_else(|| {
        failure.unwrap_or(AsymptoticError::CornerEquations { place, residual: f64::NAN })
    })
}

fn fill_degree(
    boundary: &PatchBoundary,
    n: usize,
    options: &PatchOptions,
    place: Place,
) -> Result<FilledPatch, AsymptoticError> {
    let family = PatchFamily::new(boundary, n, options.ansatz, place)?;
    let mut y = minimize_quadratic(&family.hessian, &family.gradient);
    let mut warnings = Vec::new();
    let strips = bounds::strips(&family, boundary);
    let mut transversality = strips.worst(&family, &y);
    // The fidelity mode shows what the paper's fields do, so nothing is added to it.
    if let (Some(theta), Ansatz::Module) = (options.bound, options.ansatz)
        && transversality.value < theta - 1e-12
    {
        if let Some(bounded) = strips.minimize(&family, theta) {
            y = bounded;
            transversality = strips.worst(&family, &y);
            warnings.push(AsymptoticWarning::BoundsActive { place });
        }
        if !(transversality.value > 0.0) {
            return Err(AsymptoticError::Folded {
                place,
                curve: Place::PatchCurve(transversality.curve),
                worst: transversality.value,
                t: transversality.t,
                degree: n,
            });
        }
    }
    let thin_plate = family.patch(&y);
    let (patch, thin_plate_energy) = masked(&thin_plate.0, options.interior).unwrap_or(thin_plate);
    Ok(FilledPatch {
        patch,
        thin_plate_energy,
        freedoms: y.len(),
        transversality: transversality.value,
        warnings,
    })
}
