//! Settings of the methods.

use gp_solver::{List, choices, options};
use serde::{Deserialize, Serialize};

use crate::error::Error;
use crate::net::Spread;

/// How an exact or nearly exact net is found.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Method {
    /// Positions and normals together; exact on any topology.
    #[default]
    Joint,
    /// Planar vertex stars, then shape parameters and vertices in turn (Shi et al. 2014, §3.2);
    /// leaves kinks, since the closing conditions around holes are met by least squares only.
    Published,
}

choices!(Method { Joint = "joint", Published = "published" });

/// How boundary vertices are held.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Boundary {
    /// Each is drawn to where it started, with the weight of the proximity to nearest points.
    /// Without this the outermost faces may slide along the surface and collapse.
    #[default]
    Anchored,
    /// As the vertices inside: near the surface, free within it.
    Free,
    /// Each stays exactly where it started if an exact net near the input has this boundary, and
    /// moves as little as it must otherwise: see [`crate::BoundaryPolygon`].
    Fixed,
    /// Each stays near the boundary curve of the start and may slide along it; corners (vertices
    /// with a single face) are anchored.
    Glide,
}

choices!(Boundary { Anchored = "anchored", Free = "free", Fixed = "fixed", Glide = "glide" });

/// How the published method writes the planarity of vertex stars.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum StarPlanarity {
    /// Distances of the diagonals of valence − 2 quads per star, the paper's choice.
    #[default]
    Quads,
    /// A unit normal per vertex as further unknowns, orthogonal to the edges (Deng et al. 2011).
    Normals,
}

choices!(StarPlanarity { Quads = "quads", Normals = "normals" });

/// Which differences along the curves of the net are to be small in the published method.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum FairnessOrder {
    /// Second differences.
    #[default]
    Second,
    /// Third differences: allows constant curvature.
    Third,
}

choices!(FairnessOrder { Second = "second", Third = "third" });

options! {
    /// Settings of [`crate::solve`].
    ///
    /// Lengths are counted in mean edge lengths and normals in their mean length, so that weights do
    /// not depend on the size of the model. Weights multiply squares.
    ///
    /// # Example
    /// ```
    /// use hyperbolic_nets::{Boundary, Method, Options};
    /// let options = Options { boundary: Boundary::Glide, ..Options::default() };
    /// assert_eq!((options.method, options.fairness), (Method::Joint, None));
    /// assert!(Options::FIELDS.iter().any(|field| field.name == "boundary"));
    /// ```
    #[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
    #[serde(default, deny_unknown_fields)]
    pub struct Options {
        /// Positions and normals together, which is exact, or the published scheme.
        method: Method = Method::Joint;
        /// Boundary vertices: drawn to where they start, free near the surface, fixed unless no exact
        /// net has this boundary, or gliding along the boundary curve.
        boundary: Boundary = Boundary::Anchored;
        /// Weight of differences of positions along the curves of the net, in the joint method at the
        /// start; without it 0.3, and 0.6 in the published method.
        ///
        /// The paper's λ₁.
        fairness: Option<f64> = None;
        /// Weight of the distance to the tangent plane of the reference; without it 1, and 0.04 in the
        /// published method.
        ///
        /// The paper's λ₂.
        proximity: Option<f64> = None;
        /// Weight that pulls shape parameters to 1 in the joint method; without it 0.3.
        ///
        /// Of `ν₀ + ν₂ − ν₁ − ν₃` for the normals of every face.
        shape: Option<f64> = None;
        /// Weight of the frame points' planarity in the published method; without it 0.6.
        ///
        /// The paper's λ₃.
        frame: Option<f64> = None;
        /// Wire positions of each family on every panel in tables for mold cutting.
        wire_positions: usize = 9;
        /// Weight of the distance to the nearest point as a share of the proximity; without it 0.02,
        /// and 0.09 in the published method.
        ///
        /// Rarely needed.
        point_share: Option<f64> = None;
        /// Weight of the Lelieuvre equations in every stage of the joint method.
        ///
        /// Rarely needed.
        constraint_weights: List<f64> = List(vec![10.0, 100.0, 1000.0]);
        /// Steps per stage of the joint method at most.
        ///
        /// Rarely needed. A stage ends early once a step lowers the energy by `≤ 1e-6` of it.
        steps_per_stage: usize = 2;
        /// Factor of the fairness from stage to stage of the joint method.
        ///
        /// Rarely needed.
        fairness_decay: f64 = 0.2;
        /// Least weight of the fairness in the joint method.
        ///
        /// Rarely needed.
        fairness_floor: f64 = 0.002;
        /// Weight of second differences of normals in the joint method.
        ///
        /// Rarely needed.
        normal_fairness: f64 = 0.05;
        /// Share of the proximity that counts in the joint method where the reference is not
        /// negatively curved.
        ///
        /// Rarely needed.
        relaxed_share: f64 = 0.02;
        /// Newton steps onto the exact equations at the end of the joint method at most.
        ///
        /// Rarely needed.
        polish_steps: usize = 30;
        /// Largest violation of the exact equations of a converged net, in mean edge lengths.
        ///
        /// Rarely needed.
        polish_tol: f64 = 1e-13;
        /// How the published method writes planar stars: as quads or with normals.
        ///
        /// Rarely needed.
        planarity: StarPlanarity = StarPlanarity::Quads;
        /// Order of the differences of the published method's fairness.
        ///
        /// Rarely needed.
        fairness_order: FairnessOrder = FairnessOrder::Second;
        /// How the published method spreads shape parameters over the net.
        ///
        /// Rarely needed.
        spread: Spread = Spread::LeastSquares;
        /// Steps towards planar stars in the published method at most.
        ///
        /// Rarely needed. They end early once a step lowers the energy by `≤ 1e-9` of it.
        first_steps: usize = 15;
        /// Rounds of shape parameters and vertices in turn in the published method.
        ///
        /// Rarely needed.
        rounds: usize = 6;
        /// Steps in each round of the published method at most.
        ///
        /// Rarely needed.
        steps_per_round: usize = 5;
        /// The published method has converged if its last round changes the largest kink by at most
        /// this share of it.
        ///
        /// Rarely needed.
        kink_tol: f64 = 0.02;
    }
}

impl Options {
    /// The settings of the published method (Shi et al. 2014, §3.2).
    #[must_use]
    pub fn published() -> Self {
        Self { method: Method::Published, ..Self::default() }
    }

    fn by_method<T>(&self, joint: T, published: T) -> T {
        match self.method {
            Method::Joint => joint,
            Method::Published => published,
        }
    }

    /// The weight of the fairness in force.
    #[must_use]
    pub fn fairness_weight(&self) -> f64 {
        self.fairness.unwrap_or(self.by_method(0.3, 0.6))
    }

    /// The weight of the proximity in force.
    #[must_use]
    pub fn proximity_weight(&self) -> f64 {
        self.proximity.unwrap_or(self.by_method(1.0, 0.04))
    }

    /// The weight of the nearest point in force, as a share of the proximity.
    #[must_use]
    pub fn point_weight(&self) -> f64 {
        self.point_share.unwrap_or(self.by_method(0.02, 0.09))
    }

    /// The weight of the shape parameters in force.
    #[must_use]
    pub fn shape_weight(&self) -> f64 {
        self.shape.unwrap_or(0.3)
    }

    /// The weight of the frame points in force.
    #[must_use]
    pub fn frame_weight(&self) -> f64 {
        self.frame.unwrap_or(0.6)
    }

    /// Refuses what makes no sense.
    ///
    /// # Errors
    /// [`Error::BadOption`] or [`Error::OtherMethod`] names the field.
    pub fn check(&self) -> Result<(), Error> {
        let positive = [
            ("fairness", self.fairness_weight()),
            ("proximity", self.proximity_weight()),
            ("shape", self.shape_weight()),
            ("frame", self.frame_weight()),
            ("polish_tol", self.polish_tol),
        ];
        let weights = self.constraint_weights.iter().map(|&w| ("constraint_weights", w));
        for (name, value) in positive.into_iter().chain(weights) {
            if !(value > 0.0 && value.is_finite()) {
                return Err(Error::BadOption { name, value, need: "positive and finite" });
            }
        }
        let not_negative = [
            ("point_share", self.point_weight()),
            ("fairness_decay", self.fairness_decay),
            ("fairness_floor", self.fairness_floor),
            ("normal_fairness", self.normal_fairness),
            ("relaxed_share", self.relaxed_share),
            ("kink_tol", self.kink_tol),
        ];
        for (name, value) in not_negative {
            if !(value >= 0.0 && value.is_finite()) {
                return Err(Error::BadOption { name, value, need: "zero or more, and finite" });
            }
        }
        if !(2..=1000).contains(&self.wire_positions) {
            let (name, value) = ("wire_positions", self.wire_positions as f64);
            return Err(Error::BadOption { name, value, need: "between 2 and 1000" });
        }
        match self.method {
            Method::Joint if self.frame.is_some() => {
                Err(Error::OtherMethod { name: "frame", method: "published" })
            }
            Method::Published if self.shape.is_some() => {
                Err(Error::OtherMethod { name: "shape", method: "joint" })
            }
            _ => Ok(()),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn nonsense_is_refused_by_the_name_of_the_field() {
        let default = Options::default;
        let bad = [
            (Options { fairness: Some(-1.0), ..default() }, "`fairness` is -1"),
            (Options { proximity: Some(f64::NAN), ..default() }, "`proximity` is NaN"),
            (Options { constraint_weights: vec![1.0, 0.0].into(), ..default() }, "_weights` is 0"),
            (Options { kink_tol: -0.1, ..default() }, "`kink_tol` is -0.1"),
            (Options { wire_positions: 1, ..default() }, "between 2 and 1000"),
            (Options { frame: Some(1.0), ..default() }, "`frame` is a weight of the published"),
            (Options { shape: Some(1.0), ..Options::published() }, "`shape` is a weight of the jo"),
        ];
        for (options, words) in bad {
            let message = options.check().unwrap_err().to_string();
            assert!(message.contains(words), "{message}");
        }
        assert_eq!(default().check(), Ok(()));
        assert_eq!(Options::published().check(), Ok(()));
    }
}
