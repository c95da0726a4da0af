//! How patches of a net join.

use gp_solver::choices;
use serde::{Deserialize, Serialize};

/// How patches of a net join across their common curves.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Joins {
    /// Common tangent planes; each patch has its own least thin-plate energy.
    #[default]
    G1,
    /// Common cross derivatives where the boundary curves continue one another.
    C1,
    /// C1, and the least jump of the mean curvature, zero where the net allows it.
    G2,
}

choices!(Joins { G1 = "g1", C1 = "c1", G2 = "g2" });
