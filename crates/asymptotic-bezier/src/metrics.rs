//! Numbers of a run as they are reported.

use crate::patch::verify::PatchCheck;
use crate::shell::gridshell::{Gridshell, GridshellCheck};

/// Numbers of a filled net as they are reported; one patch is a net of one face.
///
/// # Example
/// ```
/// use asymptotic_bezier::{Options, solve};
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
/// let metrics = solve(&mesh.into(), &Options::default(), &mut ())?.metrics;
/// assert_eq!((metrics.patches, metrics.positive_gauss_fraction), (9, 0.0));
/// assert!(metrics.kink_max_deg < 1e-6 && metrics.min_sine > 0.5);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
pub struct Metrics {
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
    /// Number of warnings of solve and check.
    pub warnings: usize,
}

impl Metrics {
    /// The numbers of a measured net.
    #[must_use]
    pub fn new(shell: &Gridshell, check: &GridshellCheck) -> Self {
        let checks = &check.patches;
        let most = |f: fn(&PatchCheck) -> f64| {
            checks.iter().map(f).fold(0.0, |a, b| if b.is_nan() { b } else { f64::max(a, b) })
        };
        Self {
            patches: checks.len(),
            normal_curvature_max: most(|c| c.normal_curvature),
            torsion_defect_max: most(|c| c.torsion_defect),
            strain_energy: shell.boundary.strain_energy,
            thin_plate_energy: shell.thin_plate_energy(),
            kink_max_deg: check.kink().to_degrees(),
            gaussian_jump_max: check.joins.iter().map(|j| j.gaussian_jump).fold(0.0, f64::max),
            mean_jump_max: check.mean_jump(),
            continuous_joins: shell.continuous.iter().filter(|c| **c).count(),
            min_sine: checks.iter().map(|c| c.sine).fold(1.0, f64::min),
            positive_gauss_fraction: checks.iter().map(|c| c.positive_gauss).sum::<f64>()
                / checks.len().max(1) as f64,
            self_intersections: checks.iter().map(|c| c.self_intersections).sum(),
            degree: shell.patches.iter().map(|p| p.patch.degree()).max().unwrap_or(0),
            warnings: check.warnings.len(),
        }
    }
}
