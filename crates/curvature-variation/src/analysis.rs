//! A subdivision surface measured as it is: curvatures, energies, checks.

use crate::evaluator::EnergyTable;
use crate::functional::Functional;
use crate::metrics::{energies, gauss_bonnet_residual};
use crate::rules::{Quadrature, gauss_legendre};
use crate::samples::JetTable;
use geom_core::{CurvatureStatistics, DVec3, PolyMesh};
use rayon::prelude::*;
use subdiv_catmull_clark::{
    Blend, Creases, Patch, SubdivisionError, SubdivisionSurface, check_valences, refine,
    refinements_needed,
};

/// Gauss points per side of a patch for the mean sizes of curvatures.
const SAMPLES: usize = 6;

/// What [`analyze`] found.
#[derive(Clone, Debug)]
pub struct SurfaceAnalysis {
    /// The mesh refined to quads with regular rings around extraordinary vertices, if it needed
    /// that: the patches' control mesh.
    pub mesh: PolyMesh,
    /// Its surface.
    pub surface: SubdivisionSurface,
    /// Area, extent and curvatures of the limit surface.
    pub statistics: CurvatureStatistics,
    /// All functionals by the fine quadrature.
    pub energies: EnergyTable,
    /// Largest relative difference to the normal quadrature among bending and the Mehlum-Tarrou
    /// energy.
    pub quadrature_gap: f64,
    /// `|∫K − 2πχ| / ∫|K|`, `None` for an open surface.
    pub gauss_bonnet_residual: Option<f64>,
}

/// Measures the Catmull-Clark limit surface of a mesh of quads or n-gons.
///
/// `blend_rings` is as in [`SubdivisionSurface::with_rings`].
///
/// Curvatures are sampled at 6×6 Gauss points and the corners of every patch, so that extremes are
/// those of the samples.
///
/// # Errors
/// [`SubdivisionError`] if the surface cannot be evaluated.
///
/// # Example
/// ```
/// use curvature_variation::{Functional, analyze};
/// use subdiv_catmull_clark::{Blend, Creases};
/// let mesh = fixtures::quad_graphs::torus(64, 64, 1.0, 0.5);
/// let found = analyze(&mesh, &Creases::none(), Blend::Smooth, None)?;
/// // π² / (ρ √(1 − ρ²)) for the ratio ρ of the radii.
/// let willmore = std::f64::consts::PI.powi(2) / (0.5 * 0.75_f64.sqrt());
/// assert!((found.energies.get(Functional::Willmore) / willmore - 1.0).abs() < 1e-4);
/// let range = found.statistics.gaussian_curvature().unwrap();
/// assert!((range.min + 4.0).abs() < 0.02 && (range.max - 4.0 / 3.0).abs() < 0.02, "{range:?}");
/// # Ok::<(), subdiv_catmull_clark::SubdivisionError>(())
/// ```
pub fn analyze(
    mesh: &PolyMesh,
    creases: &Creases,
    blend: Blend,
    blend_rings: Option<usize>,
) -> Result<SurfaceAnalysis, SubdivisionError> {
    check_valences(mesh)?;
    let (mut mesh, mut creases) = (mesh.clone(), creases.clone());
    for _ in 0..refinements_needed(&mesh, &creases) {
        // Fails for meshes too large to count only, which the caller's mesh already passed.
        match refine(&mesh, &creases) {
            Ok(fine) => (mesh, creases) = (fine.mesh, fine.creases),
            Err(_) => break,
        }
    }
    let surface = SubdivisionSurface::with_rings(&mesh, &creases, blend, blend_rings)?;
    let table = |quadrature| {
        energies(&mesh, &surface, false, quadrature, &mut || false)
            .unwrap_or_else(EnergyTable::unknown)
    };
    let (fine, normal) = (table(Quadrature::FINE), table(Quadrature::NORMAL));
    let gap = [Functional::Bending, Functional::MehlumTarrou { w1: 1.0, w3: 1.0 }]
        .map(|f| (normal.get(f) - fine.get(f)).abs() / fine.get(f).abs().max(f64::MIN_POSITIVE));
    let residual = gauss_bonnet_residual(&mesh, &surface, &mut || false);
    Ok(SurfaceAnalysis {
        statistics: statistics(&mesh, &surface),
        energies: fine,
        quadrature_gap: gap[0].max(gap[1]),
        gauss_bonnet_residual: residual.filter(|r| r.is_finite()),
        mesh,
        surface,
    })
}

fn statistics(mesh: &PolyMesh, surface: &SubdivisionSurface) -> CurvatureStatistics {
    let rule = gauss_legendre(SAMPLES);
    let mut parameters: Vec<[f64; 2]> = Vec::new();
    let mut weights: Vec<f64> = Vec::new();
    for &(u, wu) in &rule {
        parameters.extend(rule.iter().map(|&(v, _)| [u, v]));
        weights.extend(rule.iter().map(|&(_, wv)| wu * wv));
    }
    parameters.extend([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]]);
    weights.extend([0.0; 4]);
    let positions = surface.control_points(mesh.positions());
    let table = JetTable::new(surface, parameters);
    let parts: Vec<CurvatureStatistics> = surface
        .patches()
        .par_iter()
        .with_min_len(16)
        .map(|patch| patch_statistics(&positions, &table, patch, &weights))
        .collect();
    let mut all = CurvatureStatistics::default();
    parts.iter().for_each(|part| all.merge(part));
    all
}

fn patch_statistics(
    positions: &[DVec3],
    table: &JetTable<'_>,
    patch: &Patch,
    weights: &[f64],
) -> CurvatureStatistics {
    let mut out = CurvatureStatistics::default();
    for (k, weight) in weights.iter().enumerate() {
        let jet = table.jet(positions, patch, k);
        let first = jet.first_form();
        let area = weight * (first.e * first.g - first.f * first.f).max(0.0).sqrt();
        out.add_area(area);
        let curvatures = jet.second_form().and_then(|second| {
            let mean = geom_core::mean_curvature(first, second)?;
            Ok((mean, geom_core::gaussian_curvature(first, second)?))
        });
        match curvatures {
            Ok((h, k)) => out.add(jet.position(), area, h, k),
            Err(_) => out.add_singular(jet.position(), area),
        }
    }
    out
}
