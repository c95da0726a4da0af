//! From input to measured result in one call: what the command line runs.

use crate::boundary::options::BoundaryOptions;
use crate::boundary::quad::{Quadrilateral, doubt_signs, solve_quadrilateral};
use crate::boundary::quartic::solve_quartic_quadrilateral;
use crate::boundary::solve::solve_boundary;
use crate::boundary::solved::Boundary;
use crate::data::corners::{AsymptoticNet, CURVE_CORNERS, CornerData};
use crate::error::{AsymptoticError, Place};
use crate::patch::options::PatchOptions;
use crate::patch::solve::fill_patch;
use crate::relax::relaxed::{RelaxOptions, Relaxed, relax, relax_patch};
use crate::shell::gridshell::{Gridshell, GridshellCheck, fill_solved};
use crate::shell::joint::Joins;

/// What is to be bounded by asymptotic curves.
#[derive(Clone, Debug, PartialEq)]
pub enum Input {
    /// One patch from corner data.
    Patch(Box<CornerData>),
    /// A whole net of curves.
    Net(AsymptoticNet),
}

/// Settings of a design.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct DesignOptions {
    /// How the curves are solved; degree 4 takes the quartics of a single patch.
    pub boundary: BoundaryOptions,
    /// How the faces are filled.
    pub patch: PatchOptions,
    /// How the patches of a net join.
    pub joins: Joins,
    /// Moves tangents and curvatures where they are bad.
    pub relax: Option<RelaxOptions>,
}

/// A solved, filled and measured net; one patch is a net of one face.
#[derive(Clone, Debug, PartialEq)]
pub struct Design {
    /// The net, after a relaxation with the moved data.
    pub net: AsymptoticNet,
    /// Curves and patches.
    pub shell: Gridshell,
    /// Measurements and all warnings.
    pub check: GridshellCheck,
    /// With C1 and G2 joins, the largest jump of the mean curvature that G1 joins would leave.
    pub mean_jump_before: Option<f64>,
    /// What the relaxed mode did, when asked for.
    pub relaxed: Option<Relaxed>,
}

/// Solves, fills and measures.
///
/// # Errors
/// The hard faults of [`AsymptoticError`].
pub fn design(input: &Input, options: &DesignOptions) -> Result<Design, AsymptoticError> {
    match input {
        Input::Patch(data) => design_patch(data, options),
        Input::Net(net) => {
            let mut boundary = options.boundary.clone();
            let relaxed = options.relax.as_ref().map(|o| relax(net, o)).transpose()?;
            let mut net = net.clone();
            if let Some(relaxed) = &relaxed {
                net = relaxed.net.clone();
                boundary.torsions = relaxed.torsions.clone();
            }
            let boundary = solve_boundary(&net, &boundary)?;
            let mean_jump_before = match options.joins {
                Joins::G1 => None,
                // Where G1 patches fold there is nothing to compare with.
                _ => fill_solved(&net, boundary.clone(), &options.patch, Joins::G1).ok().map(
                    |shell| shell.check_joins(&net).iter().map(|j| j.mean_jump).fold(0.0, f64::max),
                ),
            };
            let shell = fill_solved(&net, boundary, &options.patch, options.joins)?;
            let check = shell.verify(&net, &options.patch);
            Ok(Design { net, shell, check, mean_jump_before, relaxed })
        }
    }
}

fn design_patch(data: &CornerData, options: &DesignOptions) -> Result<Design, AsymptoticError> {
    let (data, quad, relaxed) = match &options.relax {
        Some(relax_options) => {
            let (moved, relaxed) = relax_patch(data, relax_options)?;
            let mut boundary = options.boundary.clone();
            boundary.torsions = relaxed.torsions.clone();
            let quad = solve_quadrilateral(&moved, &boundary)?;
            (moved, quad, Some(relaxed))
        }
        None if options.boundary.degree == 4 => {
            (data.clone(), solve_quartic_quadrilateral(data)?, None)
        }
        None => (data.clone(), solve_quadrilateral(data, &options.boundary)?, None),
    };
    let net = data.to_net(&quad.curvatures);
    let doubt = (options.boundary.degree > 4)
        .then(|| doubt_signs(&data, &quad, &options.boundary))
        .flatten();
    let shell = shell_of_one(&net, quad, &options.patch)?;
    let mut check = shell.verify(&net, &options.patch);
    check.warnings.extend(doubt);
    Ok(Design { net, shell, check, mean_jump_before: None, relaxed })
}

fn shell_of_one(
    net: &AsymptoticNet,
    quad: Quadrilateral,
    options: &PatchOptions,
) -> Result<Gridshell, AsymptoticError> {
    let filled = fill_patch(&quad.boundary, options, Place::Patch(0))?;
    let mut warnings = quad.warnings;
    warnings.extend(filled.warnings.iter().cloned());
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
    let boundary = Boundary {
        curves: quad.boundary.curves.to_vec(),
        torsions: quad.torsions.to_vec(),
        strain_energy: quad.strain_energy,
        freedoms: quad.freedoms,
        warnings: Vec::new(),
        inflections: quad.boundary.inflections.to_vec(),
        signs: vec![[1.0; 2], [-1.0; 2], [1.0; 2], [-1.0; 2]],
        normals: normals.collect(),
    };
    Ok(Gridshell {
        boundary,
        qualities: quad.qualities.to_vec(),
        patches: vec![filled],
        outlines: vec![quad.boundary],
        continuous: vec![false; 4],
        warnings,
    })
}

/// Numbers of a design as they are reported.
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
pub struct DesignMetrics {
    /// Number of patches.
    pub patches: usize,
    /// Largest normal curvature on a boundary, times the patch size.
    pub normal_curvature_max: f64,
    /// Largest `|K + τ²|` on a boundary.
    pub torsion_defect_max: f64,
    /// `Σ ∫ |r″|² dt`.
    pub strain_energy: f64,
    /// `Σ ∫∫ |R_uu|² + 2 |R_uv|² + |R_vv|²`.
    pub thin_plate_energy: f64,
    /// Largest angle between normals across a shared curve.
    pub kink_max_deg: f64,
    /// Largest jump of the Gaussian curvature across a shared curve.
    pub gaussian_jump_max: f64,
    /// Largest jump of the mean curvature across a shared curve.
    pub mean_jump_max: f64,
    /// Shared curves whose patches have one cross derivative.
    pub continuous_joins: usize,
    /// Least sine between parameter lines.
    pub min_sine: f64,
    /// Share of the samples with `K > 0`.
    pub positive_gauss_fraction: f64,
    /// Crossing pairs of sampled triangles.
    pub self_intersections: usize,
    /// Highest degree of a patch.
    pub degree: usize,
    /// Number of warnings.
    pub warnings: usize,
}

impl Design {
    /// The numbers to report.
    #[must_use]
    pub fn metrics(&self) -> DesignMetrics {
        let checks = &self.check.patches;
        let most = |f: fn(&crate::patch::verify::PatchCheck) -> f64| {
            checks.iter().map(f).fold(0.0, |a, b| if b.is_nan() { b } else { f64::max(a, b) })
        };
        DesignMetrics {
            patches: checks.len(),
            normal_curvature_max: most(|c| c.normal_curvature),
            torsion_defect_max: most(|c| c.torsion_defect),
            strain_energy: self.shell.boundary.strain_energy,
            thin_plate_energy: self.shell.thin_plate_energy(),
            kink_max_deg: self.check.kink().to_degrees(),
            gaussian_jump_max: self.check.joins.iter().map(|j| j.gaussian_jump).fold(0.0, f64::max),
            mean_jump_max: self.check.mean_jump(),
            continuous_joins: self.shell.continuous.iter().filter(|c| **c).count(),
            min_sine: checks.iter().map(|c| c.sine).fold(1.0, f64::min),
            positive_gauss_fraction: checks.iter().map(|c| c.positive_gauss).sum::<f64>()
                / checks.len().max(1) as f64,
            self_intersections: checks.iter().map(|c| c.self_intersections).sum(),
            degree: self.shell.patches.iter().map(|p| p.patch.degree()).max().unwrap_or(0),
            warnings: self.check.warnings.len(),
        }
    }
}
