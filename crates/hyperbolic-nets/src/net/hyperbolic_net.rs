//! A net with a shape parameter for every face: the finished surface, and how smooth it is.

use super::patch::BilinearPatch;
use super::quad_net::{InnerEdge, QuadNet};
use crate::{Error, PatchError};
use geom_core::{ClosestPoint, DVec3};
use numerics::smallest_eigenvector;
use rayon::prelude::*;

/// Points at which tangent planes are compared along every inner edge.
pub const KINK_SAMPLES: usize = 11;

/// Quads with one rational bilinear patch each.
///
/// # Example
/// ```
/// use geom_core::{DVec3, PolyMesh};
/// use hyperbolic_nets::{HyperbolicNet, QuadNet};
/// // Two quads of z = xy: with equal weights their patches are pieces of that surface.
/// let points = [(0, 0), (1, 0), (2, 0), (0, 1), (1, 1), (2, 1)];
/// let points = points.map(|(x, y)| (f64::from(x), f64::from(y)));
/// let points = points.iter().map(|(x, y)| DVec3::new(*x, *y, x * y)).collect();
/// let net = QuadNet::new(&PolyMesh::new(points, &[[0, 1, 4, 3], [1, 2, 5, 4]])?)?;
/// let surface = HyperbolicNet::new(net, None, vec![1.0, 1.0])?;
/// assert!(surface.kinks().iter().all(|kink| *kink < 1e-7));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Debug)]
pub struct HyperbolicNet {
    net: QuadNet,
    normals: Option<Vec<DVec3>>,
    shape: Vec<f64>,
}

/// Largest and mean kink over the inner edges.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct KinkStatistics {
    /// Largest angle, in radians.
    pub max: f64,
    /// Mean over the edges of the largest angle of each, in radians.
    pub mean: f64,
    /// Edges at which the surface folds back on itself.
    pub folds: usize,
}

impl HyperbolicNet {
    /// Joins a net, its Lelieuvre normals if they are known, and the shape parameters of the
    /// diagonals 0–2.
    ///
    /// # Errors
    /// [`Error`] if counts do not match or a shape parameter is not positive.
    pub fn new(net: QuadNet, normals: Option<Vec<DVec3>>, shape: Vec<f64>) -> Result<Self, Error> {
        let (faces, vertices) = (net.quads().len(), net.positions().len());
        if shape.len() != faces {
            return Err(Error::WrongCount {
                what: "shape parameters",
                found: shape.len(),
                needed: faces,
            });
        }
        if let Some(found) = normals.as_ref().map(Vec::len).filter(|n| *n != vertices) {
            return Err(Error::WrongCount { what: "normals", found, needed: vertices });
        }
        if let Some(face) = shape.iter().position(|&w| !(w > 0.0 && w < f64::INFINITY)) {
            return Err(Error::BadShapeParameter { face, value: shape[face] });
        }
        Ok(Self { net, normals, shape })
    }

    /// The same patches on a net of the same faces that stands elsewhere; Lelieuvre normals, which
    /// depend on size, are left out.
    #[must_use]
    pub(crate) fn with_net(&self, net: QuadNet) -> Self {
        Self { net, normals: None, shape: self.shape.clone() }
    }

    /// The net.
    #[must_use]
    pub fn net(&self) -> &QuadNet {
        &self.net
    }

    /// Lelieuvre normals, if the net has them: `x_j − x_i = ± ν_i × ν_j` along its edges.
    #[must_use]
    pub fn normals(&self) -> Option<&[DVec3]> {
        self.normals.as_deref()
    }

    /// Shape parameters of the diagonals 0–2.
    #[must_use]
    pub fn shape(&self) -> &[f64] {
        &self.shape
    }

    /// The patch of a face, weights `(1, 1, W, 1)`.
    ///
    /// # Errors
    /// [`PatchError`] if a corner is not finite.
    pub fn patch(&self, face: usize) -> Result<BilinearPatch, PatchError> {
        let corners = self.net.quads()[face].map(|v| self.net.positions()[v as usize]);
        BilinearPatch::from_shape_parameter(corners, self.shape[face])
    }

    /// All patches, in the order of the faces.
    ///
    /// # Errors
    /// As [`Self::patch`].
    pub fn patches(&self) -> Result<Vec<BilinearPatch>, PatchError> {
        (0..self.shape.len()).map(|f| self.patch(f)).collect()
    }

    /// Largest angle between the tangent planes at [`KINK_SAMPLES`] points of every inner edge, in
    /// radians and in the order of [`QuadNet::inner_edges`].
    #[must_use]
    pub fn kinks(&self) -> Vec<f64> {
        kinks(&self.net, self.net.positions(), &self.shape)
    }

    /// Kinks in brief.
    #[must_use]
    pub fn kink_statistics(&self) -> KinkStatistics {
        let kinks = self.kinks();
        let positions = self.net.positions();
        let folded = |e: &&InnerEdge| self.net.join(e, positions).is_folded();
        KinkStatistics {
            max: kinks.iter().copied().fold(0.0, f64::max),
            mean: kinks.iter().sum::<f64>() / kinks.len().max(1) as f64,
            folds: self.net.inner_edges().iter().filter(folded).count(),
        }
    }
}

/// As [`HyperbolicNet::kinks`], for positions and shape parameters on their way.
pub(crate) fn kinks(net: &QuadNet, positions: &[DVec3], shape: &[f64]) -> Vec<f64> {
    net.inner_edges()
        .par_iter()
        .map(|e| {
            let [f, g] = e.faces;
            let power = |w: f64, e: f64| if e > 0.0 { w } else { 1.0 / w };
            let left = power(shape[f], e.exponents[0]);
            let right = power(shape[g], e.exponents[1]);
            net.join(e, positions).kink(left, right, KINK_SAMPLES)
        })
        .collect()
}

/// Largest distance of a vertex or one of its neighbours from the best plane of its star, as a
/// share of the mean edge length.
#[must_use]
pub fn star_planarity(net: &QuadNet) -> f64 {
    let h = net.mesh().mean_edge_length();
    let star = |v: usize| {
        let mut points: Vec<DVec3> = net.ring(v).map(|w| net.positions()[w]).collect();
        points.push(net.positions()[v]);
        if points.len() < 4 { 0.0 } else { distance_from_best_plane(&points) / h }
    };
    (0..net.positions().len()).map(star).fold(0.0, f64::max)
}

/// Largest distance of the points from the plane that minimises the sum of squares.
fn distance_from_best_plane(points: &[DVec3]) -> f64 {
    let centre = points.iter().sum::<DVec3>() / points.len() as f64;
    let mut covariance = [[0.0; 3]; 3];
    for p in points {
        let d = (*p - centre).to_array();
        for i in 0..3 {
            for j in 0..3 {
                covariance[i][j] += d[i] * d[j];
            }
        }
    }
    let normal = DVec3::from_array(smallest_eigenvector(covariance));
    points.iter().map(|p| (*p - centre).dot(normal).abs()).fold(0.0, f64::max)
}

/// Distances of all vertices from the tangent plane of a surface at their feet, in model units.
///
/// Where the foot is inside the surface this is the distance from it. A vertex beyond the border
/// of an open surface is measured against the plane in which the surface would go on, so that
/// sliding along the surface does not count.
#[must_use]
pub fn distances(positions: &[DVec3], reference: &dyn ClosestPoint) -> Vec<f64> {
    positions
        .par_iter()
        .map(|p| {
            let foot = reference.closest_point(*p);
            (*p - foot.point).dot(foot.normal).abs()
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Spread, fit_shape_parameters};
    use fixtures::asymptotic_nets;
    use geom_core::PolyMesh;

    #[test]
    fn best_plane_of_a_bent_star() {
        let bent = [DVec3::X, -DVec3::X, DVec3::Y, -DVec3::Y, DVec3::Z * 0.1];
        let flat = bent.map(|p| DVec3::new(p.x, p.y, 0.3 * p.x));
        assert!((distance_from_best_plane(&bent) - 0.08).abs() < 1e-12);
        assert!(distance_from_best_plane(&flat) < 1e-16);
    }

    #[test]
    fn exact_net_has_no_kink_and_planar_stars() {
        let model = asymptotic_nets::moutard(8, 7, 2);
        let net = QuadNet::new(&PolyMesh::new(model.positions, &model.quads).unwrap()).unwrap();
        assert!(star_planarity(&net) < 1e-13);
        let shape =
            fit_shape_parameters(&net, net.positions(), Spread::LeastSquares).unwrap().shape;
        let surface = HyperbolicNet::new(net, None, shape).unwrap();
        let kinks = surface.kink_statistics();
        assert!(kinks.max < 1e-9 && kinks.folds == 0, "{kinks:?}");
    }

    #[test]
    fn wrong_counts_and_parameters_are_refused() {
        let model = asymptotic_nets::moutard(2, 2, 2);
        let net = QuadNet::new(&PolyMesh::new(model.positions, &model.quads).unwrap()).unwrap();
        let error = HyperbolicNet::new(net.clone(), None, vec![1.0; 3]).unwrap_err();
        assert_eq!(error.to_string(), "shape parameters: 3 values for 4; give one for each");
        let error = HyperbolicNet::new(net.clone(), Some(vec![]), vec![1.0; 4]).unwrap_err();
        assert!(matches!(error, Error::WrongCount { what: "normals", .. }));
        let error = HyperbolicNet::new(net, None, vec![1.0, 1.0, 0.0, 1.0]).unwrap_err();
        assert_eq!(error, Error::BadShapeParameter { face: 2, value: 0.0 });
    }
}
