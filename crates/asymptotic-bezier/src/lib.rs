//! Bezier patches bounded by asymptotic curves, and gridshells filled with them.
//!
//! Along an asymptotic curve the normal curvature is zero, so a strip orthogonal to the surface
//! unrolls to a straight one. [`solve_quadrilateral`] makes four quintics from positions, tangents
//! and curvatures at the corners (Wang et al. 2019), [`fill_patch`] the Bezier patch of least
//! thin-plate energy that has them as asymptotic boundary, [`fill_net`] does both for whole nets,
//! whose patches join with a common tangent plane, [`relax`] mends noisy data, and [`lamellas`]
//! gives the strips. [`design()`] runs all of it and measures the result.
//!
//! Departures from the paper, and why: the boundary is solved for the corner torsions, which are
//! its four free parameters (`K = −τ²`); the tangent fields are all polynomial ones instead of a
//! two-term ansatz, which gives with degree seven what the paper needs eleven for; curves with
//! inflections and lines have regular patches too; nets made from positions get their curves from
//! polynomial normals by Lelieuvre's formula ([`CurveForm`]), which inflections do not disturb.
//!
//! # Example
//! ```
//! use asymptotic_bezier::{DataFile, DesignOptions, design};
//! # let text = std::fs::read_to_string("../../fixtures/asymptotic/catenoid.ron").unwrap();
//! # let options = ron::Options::default()
//! #     .with_default_extension(ron::extensions::Extensions::IMPLICIT_SOME);
//! let file: DataFile = options.from_str(&text)?; // fixtures/asymptotic/catenoid.ron
//! let (input, _) = file.input()?;
//! let result = design(&input, &DesignOptions::default())?;
//! assert!(result.metrics().normal_curvature_max < 1e-10);
//! assert!(result.check.warnings.is_empty());
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod boundary;
mod curve;
mod data;
mod design;
mod error;
mod file;
mod lamella;
mod patch;
mod relax;
mod shell;

pub use boundary::four_curves::PatchBoundary;
pub use boundary::options::{
    BOUNDARY_DEGREES, BoundaryEnergy, BoundaryOptions, CurveForm, TorsionHandle,
};
pub use boundary::quad::{Quadrilateral, doubt_signs, solve_quadrilateral};
pub use boundary::quartic::solve_quartic_quadrilateral;
pub use boundary::solve::solve_boundary;
pub use boundary::solved::Boundary;
pub use curve::bezier::{BezierCurve, CurveJet, CurveQuality};
pub use data::corners::{AsymptoticNet, CornerData, Curvatures, DATA_DEGREE, NetCurve, NetFace};
pub use design::{Design, DesignMetrics, DesignOptions, Input, design};
pub use error::{AsymptoticError, AsymptoticWarning, Place};
pub use file::{DataFile, FileCurve, TorsionWish, torsion_handles};
pub use lamella::layout::{StripLayout, strip_layout};
pub use lamella::strip::{Lamella, LamellaNode, LamellaOptions, lamellas};
pub use patch::mask::Interior;
pub use patch::options::{Ansatz, PatchOptions};
pub use patch::solve::{FilledPatch, fill_patch};
pub use patch::surface::{Patch, PatchJet};
pub use patch::thin_plate::MAX_SURFACE_DEGREE;
pub use patch::verify::PatchCheck;
pub use relax::relaxed::{RelaxOptions, Relaxed, relax, relax_patch};
pub use shell::gridshell::{Gridshell, GridshellCheck, GridshellOptions, JoinCheck, fill_net};
pub use shell::joint::Joins;
