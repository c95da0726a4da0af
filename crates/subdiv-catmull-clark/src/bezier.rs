//! Regular patches in Bezier form.

use crate::surface::{Patch, SubdivisionSurface};
use geom_core::DVec3;

impl SubdivisionSurface {
    /// Control points of a patch as a bi-cubic Bezier patch, `points[i][j]` for the `i`-th column
    /// in `u`; `None` if the patch is not a B-spline patch.
    ///
    /// # Example
    /// ```
    /// use geom_core::{DVec3, PolyMesh};
    /// use subdiv_catmull_clark::{Blend, Creases, SubdivisionSurface};
    /// # let xy = |k: u32| (f64::from(k / 5), f64::from(k % 5));
    /// # let points = (0..25).map(xy).map(|(x, y)| DVec3::new(x, y, x * x)).collect();
    /// # let quad = |k: u32| {
    /// #     let at = 5 * (k / 4) + k % 4;
    /// #     [at, at + 5, at + 6, at + 1]
    /// # };
    /// # let mesh = PolyMesh::new(points, &(0..16).map(quad).collect::<Vec<_>>())?;
    /// // On a grid of five by five vertices with z = x².
    /// let surface = SubdivisionSurface::new(&mesh, &Creases::none(), Blend::Smooth)?;
    /// let patch = surface.bezier(mesh.positions(), &surface.patches()[5]).expect("a B-spline");
    /// assert!(patch[0][0].distance(DVec3::new(1.0, 1.0, 1.0 + 1.0 / 3.0)) < 1e-14);
    /// assert!(patch[3][0].distance(DVec3::new(2.0, 1.0, 4.0 + 1.0 / 3.0)) < 1e-14);
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    #[must_use]
    pub fn bezier(&self, positions: &[DVec3], patch: &Patch) -> Option<[[DVec3; 4]; 4]> {
        // Rows: Bezier points from uniform B-spline points, times six.
        const CHANGE: [[f64; 4]; 4] = [
            [1.0, 4.0, 1.0, 0.0],
            [0.0, 4.0, 2.0, 0.0],
            [0.0, 2.0, 4.0, 0.0],
            [0.0, 1.0, 4.0, 1.0],
        ];
        let grid = self.b_spline_grid(patch.basis)?;
        let at = |i: usize, j: usize| -> DVec3 {
            grid[4 * i + j].iter().map(|&(k, w)| w * positions[patch.controls[k] as usize]).sum()
        };
        let mut out = [[DVec3::ZERO; 4]; 4];
        for (i, row) in out.iter_mut().enumerate() {
            for (j, point) in row.iter_mut().enumerate() {
                for p in 0..4 {
                    for q in 0..4 {
                        *point += CHANGE[i][p] * CHANGE[j][q] / 36.0 * at(p, q);
                    }
                }
            }
        }
        Some(out)
    }
}
