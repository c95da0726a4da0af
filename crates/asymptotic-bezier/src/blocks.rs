//! The terms of the least-squares stages and the energies of the exact ones as blocks of the solver,
//! for problems of one's own too.
//!
//! | stage | unknowns | blocks |
//! |---|---|---|
//! | relaxation | `tilts`, `torsions` per vertex, `arms`, `curvatures` per curve end | [`Moves`] |
//! | boundary, from curvatures | `torsions` per vertex | [`CurveEnergy`], or [`TorsionRows`] |
//! | boundary, from normals | `normals`, `tangents`, `middles` | [`Fairness`], [`Exactness`], [`Closeness`] |
//! | patch, joint | `fields`, `control points` | [`ThinPlate`], and the equations `tangent planes` |

pub use crate::boundary::curve_energy::{CurveEnergy, CurveShare};
pub use crate::boundary::normals::blocks::{Exactness, Fairness};
pub use crate::boundary::normals::curves::NormalCurves;
pub use crate::boundary::torsion_energy::{TorsionCurve, TorsionRows};
pub use crate::patch::plate_block::ThinPlate;
pub use crate::relax::model::{MovableNet, Moves};
pub use gp_solver::Closeness;
