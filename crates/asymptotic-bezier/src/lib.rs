//! Bezier patches bounded by asymptotic curves, and gridshells filled with them.

mod bernstein;
mod boundary;
mod bounds;
mod curve;
mod data;
mod dense;
mod design;
mod error;
mod field;
mod file;
mod fill;
mod gridshell;
mod intersect;
mod net;
mod patch;
mod quad;
mod relax;
mod surface;
mod torsion_energy;
mod torsion_qp;
mod verify;
mod vertex;

pub use boundary::{
    BOUNDARY_DEGREES, Boundary, BoundaryEnergy, BoundaryOptions, TorsionHandle, solve_boundary,
};
pub use curve::{BezierCurve, CurveJet, CurveQuality};
pub use data::{AsymptoticNet, CornerData, Curvatures, DATA_DEGREE, NetCurve, NetFace};
pub use design::{Design, DesignMetrics, DesignOptions, Input, design};
pub use error::{AsymptoticError, AsymptoticWarning, Place};
pub use file::{DataFile, FileCurve, TorsionWish};
pub use fill::MAX_SURFACE_DEGREE;
pub use gridshell::{Gridshell, GridshellCheck, GridshellOptions, JoinCheck, fill_net};
pub use patch::{Ansatz, FilledPatch, PatchBoundary, PatchOptions, fill_patch};
pub use quad::{Quadrilateral, solve_quadrilateral};
pub use relax::{RelaxOptions, Relaxed, relax};
pub use surface::{Patch, PatchJet};
pub use verify::PatchCheck;
