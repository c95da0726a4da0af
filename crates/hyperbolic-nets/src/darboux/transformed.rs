//! A whole net under a Darboux transformation: points, exact normals, curvatures and kinks.

use super::error::Error;
use super::map::{Branch, DarbouxMap};
use crate::net::{BilinearPatch, HyperbolicNet, KINK_SAMPLES, SampledPatches, SurfaceSample};
use geom_core::DVec3;
use gp_solver::{Observer, Status};
use rayon::prelude::*;

/// Patches sampled between two questions whether to stop.
const AT_ONCE: usize = 256;

/// The image of a hyperbolic net: a smooth surface of Darboux cyclide patches.
///
/// All corners have finite real images (kept by `new`).
#[derive(Clone, Copy, Debug)]
pub struct TransformedNet<'a> {
    surface: &'a HyperbolicNet,
    map: &'a DarbouxMap,
    branch: Branch,
}

impl<'a> TransformedNet<'a> {
    /// Checks that the whole net has an image.
    ///
    /// # Errors
    /// [`Error`] names the first vertex without one.
    pub fn new(
        surface: &'a HyperbolicNet,
        map: &'a DarbouxMap,
        branch: Branch,
    ) -> Result<Self, Error> {
        map.check(surface.net().positions(), branch)?;
        Ok(Self { surface, map, branch })
    }

    /// Images of the vertices.
    ///
    /// # Errors
    /// As [`DarbouxMap::image`].
    pub fn positions(&self) -> Result<Vec<DVec3>, Error> {
        self.surface.net().positions().iter().map(|p| self.map.image(*p, self.branch)).collect()
    }

    /// A grid of points on every patch with normals from the derivative of the map and curvatures
    /// from the implicit equation of the cyclide.
    ///
    /// # Errors
    /// As [`DarbouxMap::derivative`].
    pub fn sample(&self, cells: usize) -> Result<SampledPatches, Error> {
        let sampled = self.sample_observed(cells, &mut ())?;
        Ok(sampled.unwrap_or(SampledPatches { samples: Vec::new(), cells }))
    }

    /// As [`Self::sample`]; `None` once the observer, asked every few patches, wants to stop.
    fn sample_observed(
        &self,
        cells: usize,
        observer: &mut dyn Observer,
    ) -> Result<Option<SampledPatches>, Error> {
        let patches = self.surface.patches()?;
        let per_patch = (cells + 1) * (cells + 1);
        let at = |k: usize| k as f64 / cells as f64;
        let grid = |patch: &BilinearPatch| -> Result<Vec<SurfaceSample>, Error> {
            let patch = patch.balanced();
            let cyclide = self.map.cyclide(&patch);
            (0..per_patch)
                .map(|k| {
                    let jet = patch.jet(at(k / (cells + 1)), at(k % (cells + 1)));
                    let (point, forward) = self.map.derivative(jet.point, self.branch)?;
                    let normal = (forward * jet.du).cross(forward * jet.dv).normalize_or_zero();
                    let (mean, gaussian_curvature) = cyclide.curvatures(point);
                    // The implicit equation may have its normal on the other side.
                    let side = cyclide.gradient(point).dot(normal).signum();
                    let mean_curvature = mean * side;
                    Ok(SurfaceSample { point, normal, mean_curvature, gaussian_curvature })
                })
                .collect()
        };
        let mut samples = Vec::with_capacity(patches.len() * per_patch);
        for chunk in patches.chunks(AT_ONCE) {
            if observer.stop_requested() {
                return Ok(None);
            }
            let grids: Vec<Result<Vec<SurfaceSample>, Error>> =
                chunk.par_iter().map(grid).collect();
            for grid in grids {
                samples.extend(grid?);
            }
        }
        Ok(Some(SampledPatches { samples, cells }))
    }

    /// The coarsest sampling, out of those with up to 32 cells, whose cells are nowhere farther
    /// than `accuracy` (in model units) from the surface, and the distance it has: measured
    /// between the mean of the corners of every cell and the surface's point at its middle, half
    /// of which a triangulation misses at most. [`Status::Interrupted`] with what there is once the
    /// observer wants to stop.
    ///
    /// # Errors
    /// As [`Self::sample`].
    pub fn sample_within(
        &self,
        accuracy: f64,
        observer: &mut dyn Observer,
    ) -> Result<(SampledPatches, f64, Status), Error> {
        let mut cells = 2;
        let mut last = (SampledPatches { samples: Vec::new(), cells }, f64::INFINITY);
        loop {
            // Every second point of the finer grid is the coarse one, the others test it.
            let Some(fine) = self.sample_observed(2 * cells, observer)? else {
                return Ok((last.0, last.1, Status::Interrupted));
            };
            let (coarse, error) = halve(&fine);
            if error <= accuracy {
                return Ok((coarse, error, Status::Converged));
            }
            if cells >= 32 {
                return Ok((coarse, error, Status::IterationLimit));
            }
            last = (coarse, error);
            cells *= 2;
        }
    }

    /// Largest angle between the tangent planes at the image of every inner edge, from exact
    /// normals at [`KINK_SAMPLES`] points each; radians.
    ///
    /// # Errors
    /// As [`DarbouxMap::derivative`].
    pub fn kinks(&self) -> Result<Vec<f64>, Error> {
        let net = self.surface.net();
        net.inner_edges()
            .par_iter()
            .map(|e| {
                let join = net.join(e, net.positions());
                let [l, r] = [0, 1].map(|k| self.surface.shape()[e.faces[k]].powf(e.exponents[k]));
                let mut largest = 0.0_f64;
                for k in 0..KINK_SAMPLES {
                    let t = k as f64 / (KINK_SAMPLES - 1) as f64;
                    let (_, forward) =
                        self.map.derivative(join.b[0].lerp(join.b[3], t), self.branch)?;
                    // A linear map takes the normal of a plane to its inverse transpose's image.
                    let carry = forward.inverse().transpose();
                    let [m, n] = join.normals(l, r, t).map(|n| carry * n);
                    largest = largest.max(m.cross(n).length().atan2(m.dot(n)));
                }
                Ok(largest)
            })
            .collect()
    }
}

/// Every second point of a grid, and how far the others are from the cells between them.
fn halve(fine: &SampledPatches) -> (SampledPatches, f64) {
    let (n, row) = (fine.cells / 2, fine.cells + 1);
    let patches = fine.samples.len() / (row * row);
    let mut samples = Vec::with_capacity(patches * (n + 1) * (n + 1));
    let mut error = 0.0_f64;
    for p in 0..patches {
        let at = |i: usize, j: usize| fine.samples[(p * row + i) * row + j];
        for i in 0..=n {
            for j in 0..=n {
                samples.push(at(2 * i, 2 * j));
                if i < n && j < n {
                    let corners = [(0, 0), (2, 0), (2, 2), (0, 2)];
                    let mean =
                        corners.iter().map(|&(a, b)| at(2 * i + a, 2 * j + b).point).sum::<DVec3>()
                            / 4.0;
                    error = error.max(mean.distance(at(2 * i + 1, 2 * j + 1).point));
                }
            }
        }
    }
    (SampledPatches { samples, cells: n }, error)
}

/// `points` + 1 points along the image of a segment, for drawing its circular arc.
///
/// # Errors
/// As [`DarbouxMap::image`].
pub fn image_of_segment(
    map: &DarbouxMap,
    branch: Branch,
    ends: [DVec3; 2],
    points: usize,
) -> Result<Vec<DVec3>, Error> {
    (0..=points)
        .map(|k| map.image(ends[0].lerp(ends[1], k as f64 / points as f64), branch))
        .collect()
}

/// The twelve edges of a box with corners as [`super::cage_corners`] numbers them.
pub const CAGE_EDGES: [[usize; 2]; 12] = [
    [0, 1],
    [2, 3],
    [4, 5],
    [6, 7],
    [0, 2],
    [1, 3],
    [4, 6],
    [5, 7],
    [0, 4],
    [1, 5],
    [2, 6],
    [3, 7],
];

/// Straight lines within the faces of a box with corners as [`super::cage_corners`] numbers them,
/// `count` in each direction of each face: their images are circles on the spheres that the faces
/// become.
#[must_use]
pub fn cage_face_lines(corners: &[DVec3; 8], count: usize) -> Vec<[DVec3; 2]> {
    let mut lines = Vec::with_capacity(12 * count);
    for across in 0..3 {
        let (along, over) = (1 << ((across + 1) % 3), 1 << ((across + 2) % 3));
        for base in [0, 1 << across] {
            for (a, b) in [(along, over), (over, along)] {
                for k in 1..=count {
                    let t = k as f64 / (count + 1) as f64;
                    let end = |from: usize| corners[from].lerp(corners[from + a], t);
                    lines.push([end(base), end(base + b)]);
                }
            }
        }
    }
    lines
}

#[cfg(test)]
mod tests {
    use super::super::cage::cage_corners;
    use super::*;
    use crate::{Input, Options, QuadNet, solve};
    use fixtures::asymptotic_nets;
    use geom_core::{BoundingBox, PolyMesh};

    fn solved() -> HyperbolicNet {
        let model = asymptotic_nets::catenoid(20, 14);
        let mesh = PolyMesh::new(model.positions.clone(), &model.quads).unwrap();
        let net = QuadNet::new(&mesh).unwrap();
        let input = Input::near_surface(&net, &*model.surface);
        solve(&input, &Options::default(), &mut ()).unwrap().result
    }

    #[test]
    fn lines_of_the_cage_lie_in_its_faces() {
        let bounds = BoundingBox { min: DVec3::ZERO, max: DVec3::new(1.0, 2.0, 3.0) };
        let lines = cage_face_lines(&cage_corners(bounds, 0.0), 2);
        assert_eq!(lines.len(), 24);
        for [a, b] in lines {
            let (a, b) = ((a / bounds.max).to_array(), (b / bounds.max).to_array());
            let same = |k: &usize| (a[*k] - b[*k]).abs() < 1e-12;
            assert_eq!((0..3).filter(same).count(), 2, "parallel to an axis");
            let on_face = |k: &usize| same(k) && (a[*k] < 1e-12 || a[*k] > 1.0 - 1e-12);
            assert_eq!((0..3).filter(on_face).count(), 1, "{a:?} {b:?}");
        }
    }

    #[test]
    fn joins_stay_smooth_and_curvature_becomes_positive_somewhere() {
        let surface = solved();
        let bounds = BoundingBox::of(surface.net().positions().iter().copied()).unwrap();
        let frame = |c: f64| {
            DarbouxMap::new(c).unwrap().in_frame(bounds.center(), bounds.diagonal()).unwrap()
        };
        let mut positive = false;
        for c in [-3.0, -0.6, 0.4, 2.5] {
            let map = frame(c);
            let mut both = 0;
            for branch in [Branch::Regular, Branch::Other] {
                let Ok(image) = TransformedNet::new(&surface, &map, branch) else { continue };
                both += 1;
                let worst = image.kinks().unwrap().into_iter().fold(0.0, f64::max);
                assert!(worst.to_degrees() <= 1e-6, "c = {c}, {branch:?}: {worst}");
                let (_, high) = image.sample(4).unwrap().range(|s| s.gaussian_curvature);
                positive |= high > 0.0;
            }
            assert!(both >= 1, "c = {c}");
        }
        assert!(positive, "some image leaves negative curvature");
    }

    #[test]
    fn sampling_reaches_its_accuracy() {
        let surface = solved();
        let bounds = BoundingBox::of(surface.net().positions().iter().copied()).unwrap();
        let map = DarbouxMap::new(-0.6).unwrap();
        let map = map.in_frame(bounds.center(), bounds.diagonal()).unwrap();
        let image = TransformedNet::new(&surface, &map, Branch::Regular).unwrap();
        let (sampled, error, status) = image.sample_within(1e-4, &mut ()).unwrap();
        assert_eq!(status, Status::Converged);
        assert!(error <= 1e-4 && sampled.cells < 32, "{error} with {}", sampled.cells);
        assert_eq!(sampled.samples.len(), 240 * (sampled.cells + 1).pow(2));
    }
}
