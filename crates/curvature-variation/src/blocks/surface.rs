//! Curvature functionals of a subdivision surface.

use std::ops::Range;
use std::sync::{Mutex, MutexGuard, PoisonError};

use crate::element::Mixture;
use crate::evaluator::{SurfaceEnergy, Workspace};
use crate::functional::{Energy, ROOT_EPSILON};
use crate::rules::Quadrature;
use crate::surface_matrix::SurfaceMatrix;
use gp_solver::{Elements, EnergyBlock, Group};
use subdiv_catmull_clark::SubdivisionSurface;

/// A weighted sum of curvature functionals (Joshi 2008, Eqs. 4.1 to 4.22) of a Catmull-Clark surface,
/// by its control points.
///
/// One element per patch, of its 16 or more control vertices and three columns each; the patches of a
/// smooth blend of several rings together make one. The gradient is exact for the quadrature; the
/// Hessian is the Gauss-Newton matrix `Σ (∂r)ᵀ ∂r` of the density's squares `r²/2`, which leaves out
/// the coupling with principal directions and the change of the area in front of scale-invariant
/// functionals, and takes four Gauss points per side. `ε` of [`Functional::Sqrt`] is relative to the
/// area where the block was [refreshed](EnergyBlock::refresh) last.
///
/// [`Functional::Sqrt`]: crate::Functional::Sqrt
///
/// ```
/// use curvature_variation::blocks::SurfaceBlock;
/// use curvature_variation::{Energy, Quadrature};
/// use gp_solver::{EnergyBlock, Variables, check_gradient};
/// use subdiv_catmull_clark::{Blend, Creases, SubdivisionSurface};
/// let mesh = fixtures::quad_graphs::torus(6, 5, 1.0, 0.5);
/// let surface = SubdivisionSurface::new(&mesh, &Creases::none(), Blend::Smooth)?;
/// let mut variables = Variables::new();
/// let points = variables.add("control points", mesh.vertex_count(), 3);
/// let energy: Energy = "bending".parse()?;
/// let block = SurfaceBlock::new(&surface, points, &energy, Quadrature::COARSE);
/// let x: Vec<f64> = mesh.positions().iter().flat_map(|p| p.to_array()).collect();
/// let worst = check_gradient(&block, &x)?.expect("it has unknowns");
/// assert!(worst.error < 1e-6, "{worst:?}");
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub struct SurfaceBlock {
    points: Range<usize>,
    evaluator: SurfaceEnergy,
    matrix: SurfaceMatrix,
    energy: Energy,
    /// Area at the last refresh.
    epsilon_area: f64,
    elements: Elements,
    /// Place of every control point among the distinct ones of its element, element after element.
    places: Vec<u32>,
    /// For every distinct vertex of every element the vertex, and whether the element is the first
    /// one that has it: the gradient by a vertex is handed in once.
    vertices: Vec<(u32, bool)>,
    work: Mutex<Workspace>,
}

impl SurfaceBlock {
    /// All patches of a surface.
    ///
    /// # Panics
    /// If the group has not three components, or its unknowns do not follow one another.
    #[must_use]
    pub fn new(
        surface: &SubdivisionSurface,
        points: Group,
        energy: &Energy,
        quadrature: Quadrature,
    ) -> Self {
        Self::of_patches(surface, points, energy, quadrature, &[])
    }

    /// As [`new`](Self::new), but the patch of face `f` counts `counts[f]` times; those of a clamped
    /// boundary count zero times.
    ///
    /// # Panics
    /// As [`new`](Self::new).
    #[must_use]
    pub fn of_patches(
        surface: &SubdivisionSurface,
        points: Group,
        energy: &Energy,
        quadrature: Quadrature,
        counts: &[u32],
    ) -> Self {
        assert_eq!(points.width(), 3, "control points have three coordinates");
        let Some(range) = points.range() else { panic!("control points follow one another") };
        let evaluator =
            SurfaceEnergy::with_multiplicities(surface, points.len(), quadrature, counts);
        let matrix = SurfaceMatrix::new(surface, &evaluator);
        let mut elements = Elements::new();
        let (mut places, mut vertices) = (Vec::new(), Vec::new());
        let mut met = vec![false; points.len()];
        // The element that met a vertex last, and the vertex's place there.
        let mut last = vec![(u32::MAX, 0_u32); points.len()];
        for (e, controls) in matrix.cliques(&evaluator).enumerate() {
            let mut columns = Vec::with_capacity(3 * controls.len());
            for &v in controls {
                let (element, place) = &mut last[v as usize];
                if *element != e as u32 {
                    (*element, *place) = (e as u32, columns.len() as u32 / 3);
                    columns.extend((0..3).map(|c| points.column(v as usize, c)));
                    vertices.push((v, !std::mem::replace(&mut met[v as usize], true)));
                }
                places.push(*place);
            }
            elements.push(&columns, columns.len());
        }
        Self {
            points: range,
            evaluator,
            matrix,
            energy: energy.clone(),
            epsilon_area: f64::NAN,
            elements,
            places,
            vertices,
            work: Mutex::new(Workspace::default()),
        }
    }

    fn work(&self) -> MutexGuard<'_, Workspace> {
        self.work.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// The area that regularisations are relative to.
    fn epsilon_area(&self, positions: &[f64], work: &mut Workspace) -> f64 {
        if self.epsilon_area.is_finite() {
            return self.epsilon_area;
        }
        self.evaluator.area(positions, work)
    }
}

impl EnergyBlock for SurfaceBlock {
    fn name(&self) -> &str {
        "surface energy"
    }

    fn elements(&self) -> &Elements {
        &self.elements
    }

    fn refresh(&mut self, x: &[f64]) {
        let area = self.evaluator.area(&x[self.points.clone()], &mut self.work());
        self.epsilon_area = area;
    }

    fn energy(&self, x: &[f64]) -> f64 {
        let (positions, work) = (&x[self.points.clone()], &mut self.work());
        let area = self.epsilon_area(positions, work);
        self.evaluator.energy_of(self.energy.coefficients(), positions, area, work)
    }

    fn quadratic_model(&self, x: &[f64], gradients: &mut [f64], hessians: &mut [f64]) -> f64 {
        let (positions, work) = (&x[self.points.clone()], &mut self.work());
        let epsilon_area = self.epsilon_area(positions, work);
        let coefficients = self.energy.coefficients();
        let mut gradient = vec![0.0; positions.len()];
        let energy = self.evaluator.gradient_of(
            coefficients,
            positions,
            Some(epsilon_area),
            work,
            &mut gradient,
        );
        for (out, &(v, is_first)) in gradients.chunks_exact_mut(3).zip(&self.vertices) {
            let from = &gradient[3 * v as usize..3 * v as usize + 3];
            out.copy_from_slice(if is_first { from } else { &[0.0; 3] });
        }
        let area = self.evaluator.area(positions, work);
        let mut plain = coefficients.plain;
        plain.root_epsilon = ROOT_EPSILON / epsilon_area;
        let density = plain.plus(area, &coefficients.scaled);
        let mixture = Mixture { density, gauss_newton: true, sobolev: 0.0 };
        hessians.fill(0.0);
        let mut places = &self.places[..];
        let mut e = 0;
        self.matrix.visit(&self.evaluator, positions, area, &mixture, &mut || false, &mut |m| {
            let (own, rest) = places.split_at(m.controls.len());
            places = rest;
            let hessian = &mut hessians[self.elements.jacobian_range(e)];
            let n = self.elements.columns(e).len();
            let local = |row: usize| 3 * own[row / 3] as usize + row % 3;
            for r in 0..3 * own.len() {
                for s in r..3 * own.len() {
                    let value = m.factor * m.values[r * m.width + s];
                    hessian[local(r) * n + local(s)] += value;
                    if r != s {
                        hessian[local(s) * n + local(r)] += value;
                    }
                }
            }
            e += 1;
        });
        energy
    }
}
