//! Whole nets filled with patches that join with a common tangent plane.
//!
//! Both patches at a curve have its osculating plane as tangent plane, so a join is G1 as soon as
//! neither folds over. Along the curve `II(r′, r′) = 0` and `II(r′, h)` is the torsion from both
//! sides, so the Gaussian curvature is continuous as well; what jumps is the mean curvature.

use geom_core::DVec3;
use rayon::prelude::*;

use crate::boundary::four_curves::PatchBoundary;
use crate::boundary::options::BoundaryOptions;
use crate::boundary::quad::check_curve;
use crate::boundary::solve::boundary_of;
use crate::boundary::solved::Boundary;
use crate::curve::bezier::CurveQuality;
use crate::data::corners::AsymptoticNet;
use crate::error::{Error, Place};
use crate::patch::mask::Interior;
use crate::patch::options::{Ansatz, PatchOptions};
use crate::patch::solve::{FilledPatch, extended_patch, fill_patch};
use crate::patch::surface::{BasisTable, Patch, PatchJet};
use crate::patch::verify::PatchCheck;
use crate::shell::joins::Joins;
use crate::shell::joint_solve::fill_joint;
use crate::stages::{JOINT, PATCH};
use crate::warning::Warning;
use crate::watch::Watch;

/// Samples along a shared curve.
const JOIN_SAMPLES: usize = 41;

/// Settings of a gridshell.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct GridshellOptions {
    /// How the curves are solved.
    pub boundary: BoundaryOptions,
    /// How the faces are filled; with C1 and G2 joins the tangent module, thin plates and one degree
    /// (two more than the curves unless given) for all.
    pub patch: PatchOptions,
    /// How the patches join.
    pub joins: Joins,
}

/// A filled net.
#[derive(Clone, Debug, PartialEq)]
pub struct Gridshell {
    /// The solved curves, one per curve of the net.
    pub boundary: Boundary,
    /// Sampled quality of each curve.
    pub qualities: Vec<CurveQuality>,
    /// One patch per face.
    pub patches: Vec<FilledPatch>,
    /// The boundary each patch was filled from.
    pub outlines: Vec<PatchBoundary>,
    /// Whether the patches at a curve were given a common cross derivative.
    pub continuous: Vec<bool>,
    /// Everything worth a word so far; [`Gridshell::verify`] adds what it finds.
    pub warnings: Vec<Warning>,
}

/// What happens across one shared curve.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct JoinCheck {
    /// The curve of the net.
    pub curve: usize,
    /// Largest angle between the normals of the two patches, radians.
    pub kink: f64,
    /// Largest difference of the cross derivatives over their length; zero for C1 joins.
    pub derivative_jump: f64,
    /// Largest jump of the Gaussian curvature.
    pub gaussian_jump: f64,
    /// Largest jump of the mean curvature, the quality left open by G1 joins.
    pub mean_jump: f64,
}

/// Measurements of a filled net.
#[derive(Clone, Debug, PartialEq)]
pub struct GridshellCheck {
    /// One per patch.
    pub patches: Vec<PatchCheck>,
    /// One per curve between two patches.
    pub joins: Vec<JoinCheck>,
    /// Warnings of solve and check together.
    pub warnings: Vec<Warning>,
}

/// Solves all curves of `net` at once and fills its faces in parallel.
///
/// # Errors
/// The first hard fault (see [`Error`]), with its curve, vertex or patch.
pub fn fill_net(net: &AsymptoticNet, options: &GridshellOptions) -> Result<Gridshell, Error> {
    let mut nobody = ();
    let watch = &mut Watch::quiet(&mut nobody);
    let boundary = boundary_of(net, &options.boundary, watch)?;
    fill_solved(net, boundary, &options.patch, options.joins, watch)
}

/// The boundary of every patch of a net, the quality of its curves, and warnings so far.
pub(crate) struct Outlined {
    pub(crate) outlines: Vec<PatchBoundary>,
    qualities: Vec<CurveQuality>,
    warnings: Vec<Warning>,
}

/// Checks the solved curves and puts them together face by face.
pub(crate) fn outlined(net: &AsymptoticNet, boundary: &Boundary) -> Result<Outlined, Error> {
    let inflections = &boundary.inflections;
    let mut warnings = boundary.warnings.clone();
    let qualities: Vec<CurveQuality> =
        boundary.curves.par_iter().map(crate::curve::bezier::BezierCurve::quality).collect();
    for (i, quality) in qualities.iter().enumerate() {
        let line = net.curves()[i].line;
        let (place, curve) = (net.curve_place(i), &boundary.curves[i]);
        check_curve(place, curve, quality, line, &inflections[i], &mut warnings)?;
    }
    let ribbons = line_ribbons(net, boundary);
    let outlines: Vec<PatchBoundary> = net
        .faces()
        .iter()
        .map(|face| PatchBoundary {
            curves: std::array::from_fn(|k| {
                let curve = &boundary.curves[face.curves[k]];
                if face.reversed[k] { curve.reversed() } else { curve.clone() }
            }),
            lines: face.curves.map(|c| net.curves()[c].line),
            inflections: std::array::from_fn(|k| {
                let list = &inflections[face.curves[k]];
                list.iter().map(|t| if face.reversed[k] { 1.0 - t } else { *t }).collect()
            }),
            ribbons: std::array::from_fn(|k| {
                let mut ribbon = ribbons[face.curves[k]]?;
                if face.reversed[k] {
                    ribbon.reverse();
                }
                Some(ribbon)
            }),
        })
        .collect();
    Ok(Outlined { outlines, qualities, warnings })
}

/// Fills a net whose curves are solved already.
pub(crate) fn fill_solved(
    net: &AsymptoticNet,
    boundary: Boundary,
    options: &PatchOptions,
    joins: Joins,
    watch: &mut Watch<'_, '_>,
) -> Result<Gridshell, Error> {
    let outlined = outlined(net, &boundary)?;
    let (patches, continuous) =
        filled_patches(net, &boundary, &outlined.outlines, options, joins, watch)?;
    Ok(shell_of(boundary, outlined, patches, continuous))
}

/// Curves and patches put together.
pub(crate) fn shell_of(
    boundary: Boundary,
    outlined: Outlined,
    patches: Vec<FilledPatch>,
    continuous: Vec<bool>,
) -> Gridshell {
    let Outlined { outlines, qualities, mut warnings } = outlined;
    warnings.extend(patches.iter().flat_map(|p| p.warnings.iter().cloned()));
    Gridshell { boundary, qualities, patches, outlines, continuous, warnings }
}

/// The patches, and which curves got a common cross derivative.
pub(crate) fn filled_patches(
    net: &AsymptoticNet,
    boundary: &Boundary,
    outlines: &[PatchBoundary],
    options: &PatchOptions,
    joins: Joins,
    watch: &mut Watch<'_, '_>,
) -> Result<(Vec<FilledPatch>, Vec<bool>), Error> {
    if joins != Joins::G1 {
        if options.ansatz != Ansatz::Module || options.interior != Interior::ThinPlate {
            return Err(Error::JoinsNeedModule);
        }
        return fill_joint(net, boundary, outlines, options.degree, joins, watch);
    }
    let patches: Vec<FilledPatch> = if watch.is_extended() {
        // One after the other, because the caller's function is one.
        let each = outlines.iter().enumerate();
        each.map(|(f, outline)| extended_patch(outline, options, f, watch))
            .collect::<Result<_, _>>()
    } else {
        let fill = |f: usize| fill_patch(&outlines[f], options, Place::Patch(f));
        watch.each(outlines.len(), |f, _| fill(f))?.into_iter().collect()
    }?;
    Ok((patches, vec![false; boundary.curves.len()]))
}

/// The name of the stage in which patches are filled.
pub(crate) fn filling(joins: Joins) -> &'static str {
    if joins == Joins::G1 { PATCH } else { JOINT }
}

/// Direction fields across the lines that two patches share.
///
/// Along a line the tangent plane turns about it at the rate of the torsion: with `h = N × e`,
/// `dh/ds = τ N`. The cubic with these directions and rates at both ends is the plane field both
/// patches take.
fn line_ribbons(net: &AsymptoticNet, boundary: &Boundary) -> Vec<Option<[DVec3; 4]>> {
    let mut faces = vec![0; net.curves().len()];
    for c in net.faces().iter().flat_map(|f| f.curves) {
        faces[c] += 1;
    }
    (0..faces.len())
        .map(|i| {
            let curve = &net.curves()[i];
            if !curve.line || faces[i] < 2 || boundary.curves[i].normals().is_some() {
                return None;
            }
            let points = boundary.curves[i].offsets();
            let last = points.len() - 1;
            let along = (points[last] - points[0]).normalize();
            let [start, end] = [0, 1].map(|e| {
                let v = curve.ends[e];
                let normal = boundary.normals[v];
                let tau = boundary.torsion_sign(i, e) * boundary.torsions[v];
                let speed = last as f64
                    * (points[if e == 0 { 1 } else { last - 1 }] - points[e * last]).length();
                (normal.cross(along), normal * (tau * speed))
            });
            Some([start.0, start.0 + start.1 / 3.0, end.0 - end.1 / 3.0, end.0])
        })
        .collect()
}

impl Gridshell {
    /// `Σ` of the thin-plate energies.
    #[must_use]
    pub fn thin_plate_energy(&self) -> f64 {
        self.patches.iter().map(|p| p.thin_plate_energy).sum()
    }

    /// Measures every patch and every join.
    #[must_use]
    pub fn verify(&self, net: &AsymptoticNet, options: &PatchOptions) -> GridshellCheck {
        let measured = |k: usize| PatchCheck::new(&self.patches[k].patch, &self.outlines[k]);
        self.check_of((0..self.patches.len()).into_par_iter().map(measured).collect(), net, options)
    }

    /// [`verify`](Self::verify), watched.
    pub(crate) fn verified(
        &self,
        net: &AsymptoticNet,
        options: &PatchOptions,
        watch: &mut Watch<'_, '_>,
    ) -> Result<GridshellCheck, Error> {
        let patches = watch.each(self.patches.len(), |k, stop| {
            PatchCheck::measured(&self.patches[k].patch, &self.outlines[k], stop)
        })?;
        let check = self.check_of(patches, net, options);
        watch.check()?;
        Ok(check)
    }

    fn check_of(
        &self,
        patches: Vec<PatchCheck>,
        net: &AsymptoticNet,
        options: &PatchOptions,
    ) -> GridshellCheck {
        let warnings_of =
            |f: usize, check: &PatchCheck| check.warnings(Place::Patch(f), options.min_sine);
        let mut warnings = self.warnings.clone();
        warnings.extend(patches.iter().enumerate().flat_map(|(f, c)| warnings_of(f, c)));
        GridshellCheck { patches, joins: self.check_joins(net), warnings }
    }

    /// Measures every join.
    #[must_use]
    pub fn check_joins(&self, net: &AsymptoticNet) -> Vec<JoinCheck> {
        let mut sides: Vec<Vec<(usize, usize)>> = vec![Vec::new(); net.curves().len()];
        for (f, face) in net.faces().iter().enumerate() {
            for (k, c) in face.curves.iter().enumerate() {
                sides[*c].push((f, k));
            }
        }
        sides
            .par_iter()
            .enumerate()
            .filter_map(|(curve, sides)| {
                let [a, b] = sides[..] else { return None };
                let side = |(f, k): (usize, usize)| {
                    let reversed = net.faces()[f].reversed[k];
                    side_jets(&self.patches[f].patch, k, reversed)
                };
                Some(check_join(curve, &side(a), &side(b)))
            })
            .collect()
    }
}

impl GridshellCheck {
    /// Largest kink over the shared curves, radians; zero when there are none.
    #[must_use]
    pub fn kink(&self) -> f64 {
        self.joins.iter().map(|j| j.kink).fold(0.0, f64::max)
    }

    /// Largest jump of the mean curvature over the shared curves; zero when there are none.
    #[must_use]
    pub fn mean_jump(&self) -> f64 {
        self.joins.iter().map(|j| j.mean_jump).fold(0.0, f64::max)
    }
}

/// Jets along side `k` (`r1..r4`) of a patch and its inward derivatives, in the direction of the
/// net curve.
fn side_jets(patch: &Patch, k: usize, reversed: bool) -> Vec<(PatchJet, DVec3)> {
    let along = BasisTable::uniform(patch.degree(), JOIN_SAMPLES);
    let ends = BasisTable::new(patch.degree(), &[0.0, 1.0]);
    let end = usize::from(k >= 2);
    (0..JOIN_SAMPLES)
        .map(|s| {
            let s = if reversed { JOIN_SAMPLES - 1 - s } else { s };
            let mut jet = PatchJet::default();
            if k == 0 || k == 2 {
                patch.jet_at(&along, s, &ends, end, &mut jet);
            } else {
                patch.jet_at(&ends, end, &along, s, &mut jet);
            }
            let inward = [jet.v, jet.u, -jet.v, -jet.u][k];
            (jet, inward)
        })
        .collect()
}

fn check_join(curve: usize, a: &[(PatchJet, DVec3)], b: &[(PatchJet, DVec3)]) -> JoinCheck {
    let mut out =
        JoinCheck { curve, kink: 0.0, derivative_jump: 0.0, gaussian_jump: 0.0, mean_jump: 0.0 };
    for ((a, inward), (b, other)) in a.iter().zip(b) {
        let jump = (*inward + *other).length() / inward.length();
        out.derivative_jump = out.derivative_jump.max(jump);
        let (m, n) = (a.normal(), b.normal());
        // The arc cosine would lose half the digits of small angles.
        let kink = m.cross(n).length().atan2(m.dot(n));
        out.kink = out.kink.max(if kink.is_nan() { std::f64::consts::PI } else { kink });
        let jump = (a.gaussian_curvature() - b.gaussian_curvature()).abs();
        out.gaussian_jump = out.gaussian_jump.max(jump);
        out.mean_jump = out.mean_jump.max((a.mean_curvature() - b.mean_curvature()).abs());
    }
    out
}
