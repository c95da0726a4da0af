//! Settings of the method.

use gp_solver::options;
use serde::{Deserialize, Serialize};

use crate::error::Error;

options! {
    /// Settings of [`crate::solve`].
    ///
    /// # Example
    /// ```
    /// use quad_remesh::Options;
    /// let options = Options { faces: Some(400), ..Options::default() };
    /// assert_eq!((options.edge_length, options.min_angle), (None, 26.0));
    /// assert!(Options::FIELDS.iter().any(|field| field.name == "faces"));
    /// ```
    #[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
    #[serde(default, deny_unknown_fields)]
    pub struct Options {
        /// Length of the net's edges in model units; without it and without a number of faces, that
        /// of 600 faces.
        edge_length: Option<f64> = None, replaces ["faces"];
        /// Number of faces the net is to have, about.
        faces: Option<usize> = None, replaces ["edge_length"];
        /// Least angle between the two families, in degrees; where asymptotic lines meet at less, the
        /// net leaves them.
        min_angle: f64 = 26.0;
    }
}

/// Faces of a net of which neither the number nor the edge length is asked for.
const FACES: usize = 600;

impl Options {
    /// Refuses what makes no sense.
    ///
    /// # Errors
    /// [`Error::BadOption`] names the field.
    pub fn check(&self) -> Result<(), Error> {
        if let Some(value) = self.edge_length
            && !(value > 0.0 && value.is_finite())
        {
            return Err(Error::BadOption {
                name: "edge_length",
                value,
                need: "positive and finite",
            });
        }
        if let Some(faces) = self.faces
            && !(1..=1_000_000).contains(&faces)
        {
            let (name, value) = ("faces", faces as f64);
            return Err(Error::BadOption { name, value, need: "between 1 and 1000000" });
        }
        if !(self.min_angle > 0.0 && self.min_angle <= 80.0) {
            let (name, value) = ("min_angle", self.min_angle);
            return Err(Error::BadOption { name, value, need: "above 0 and at most 80" });
        }
        Ok(())
    }

    /// The number of faces to aim at, if no edge length is given.
    pub(crate) fn wanted_faces(&self) -> Option<usize> {
        match self.edge_length {
            Some(_) => None,
            None => Some(self.faces.unwrap_or(FACES)),
        }
    }
}
