//! Images of a net in normalised coordinates: a transformation squares coordinates, so that a net
//! far from the origin would lose its digits twice.

use geom_core::DVec3;

use super::error::Error;
use super::map::{Branch, DarbouxMap};
use super::transformed::{TransformedNet, image_of_segment};
use crate::net::{PlacedNet, SampledPatches};

impl PlacedNet {
    /// Points and normals on all patches of the image, in model units; the map is one of normalised
    /// coordinates.
    ///
    /// # Errors
    /// As [`TransformedNet::sample`].
    pub fn sample_image(
        &self,
        map: &DarbouxMap,
        branch: Branch,
        cells: usize,
    ) -> Result<SampledPatches, Error> {
        let image = TransformedNet::new(self.net(), map, branch);
        let sampled = image.and_then(|image| image.sample(cells));
        sampled.map(|s| self.restored(s)).map_err(|e| self.told(e))
    }

    /// As [`image_of_segment`], with ends and image in model units.
    ///
    /// # Errors
    /// As [`DarbouxMap::image`].
    pub fn image_of_segment(
        &self,
        map: &DarbouxMap,
        branch: Branch,
        ends: [DVec3; 2],
        points: usize,
    ) -> Result<Vec<DVec3>, Error> {
        let ends = ends.map(|p| self.place().apply(p));
        let image = image_of_segment(map, branch, ends, points).map_err(|e| self.told(e))?;
        Ok(image.into_iter().map(|p| self.place().restore(p)).collect())
    }

    /// Samples in normalised coordinates back where the model stands.
    pub(super) fn restored(&self, mut sampled: SampledPatches) -> SampledPatches {
        let scale = self.place().scale();
        for sample in &mut sampled.samples {
            sample.point = self.place().restore(sample.point);
            sample.mean_curvature *= scale;
            sample.gaussian_curvature *= scale * scale;
        }
        sampled
    }

    /// An error that names a place, with the place in model units.
    pub(super) fn told(&self, error: Error) -> Error {
        let back = |x, y, z| self.place().restore(DVec3::new(x, y, z)).to_array();
        match error {
            Error::OutsideRealDomain { x, y, z, discriminant } => {
                let [x, y, z] = back(x, y, z);
                Error::OutsideRealDomain { x, y, z, discriminant }
            }
            Error::Infinite { x, y, z } => {
                let [x, y, z] = back(x, y, z);
                Error::Infinite { x, y, z }
            }
            other => other,
        }
    }
}
