//! Bezier patches bounded by asymptotic curves, and gridshells filled with them.
//!
//! Along an asymptotic curve the normal curvature is zero, so a strip orthogonal to the surface
//! unrolls to a straight one. [`solve`] makes quintics from positions, tangents and curvatures at
//! the corners (Wang et al. 2019), or curves from normals through whole nets, fills them with the
//! Bezier patches of least thin-plate energy that have them as asymptotic boundaries and join with
//! a common tangent plane, and measures the result; noisy data are moved where they are bad.
//! [`solve_with`] takes further terms and equations. The steps can be had one by one:
//! [`solve_quadrilateral`], [`solve_boundary`], [`fill_patch`], [`fill_net`], [`relax`];
//! [`lamellas`] gives the strips.
//!
//! Departures from the paper, and why: the boundary is solved for the corner torsions, which are
//! its four free parameters (`K = −τ²`); the tangent fields are all polynomial ones instead of a
//! two-term ansatz, which gives with degree seven what the paper needs eleven for; curves with
//! inflections and lines have regular patches too; nets made from positions get their curves from
//! polynomial normals by Lelieuvre's formula ([`CurveForm`]), which inflections do not disturb.
//!
//! # Example
//! ```
//! use asymptotic_bezier::{DataFile, Options, solve};
//! # let text = std::fs::read_to_string("../../fixtures/asymptotic/catenoid.ron").unwrap();
//! # let options = ron::Options::default()
//! #     .with_default_extension(ron::extensions::Extensions::IMPLICIT_SOME);
//! let file: DataFile = options.from_str(&text)?; // fixtures/asymptotic/catenoid.ron
//! let solution = solve(&file.input()?, &Options::default(), &mut ())?;
//! assert!(solution.metrics.normal_curvature_max < 1e-10);
//! assert!(solution.warnings.is_empty());
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

pub mod blocks;
mod boundary;
mod curve;
mod data;
mod error;
mod faults;
mod file;
mod input;
mod kept;
mod lamella;
mod metrics;
mod options;
mod patch;
mod place;
mod relax;
mod shell;
mod solve;
mod stages;
mod warning;
mod watch;
mod wishes;

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
pub use error::{Error, Place};
pub use faults::{DataFault, NetFault};
pub use file::{DataFile, FileCurve};
pub use gp_solver::Status;
pub use input::{Input, InputData};
pub use lamella::layout::{StripLayout, strip_layout};
pub use lamella::strip::{Lamella, LamellaNode, LamellaOptions, lamellas};
pub use metrics::Metrics;
pub use options::{Options, Wish};
pub use patch::mask::Interior;
pub use patch::options::{Ansatz, PatchOptions};
pub use patch::solve::{FilledPatch, fill_patch};
pub use patch::surface::{Patch, PatchJet};
pub use patch::thin_plate::MAX_SURFACE_DEGREE;
pub use patch::verify::PatchCheck;
pub use relax::relaxed::{RelaxOptions, Relaxed, relax, relax_patch};
pub use shell::gridshell::{Gridshell, GridshellCheck, GridshellOptions, JoinCheck, fill_net};
pub use shell::joins::Joins;
pub use solve::{Solution, problem, solve, solve_with, variables};
pub use stages::{BOUNDARY, CONTROL_POINTS, FIELDS, JOINT, PATCH, Phase, RELAXATION, TORSIONS};
pub use warning::Warning;
pub use wishes::TorsionWish;
