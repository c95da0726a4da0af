//! Tensor-product B-splines: knot vectors, curves and surfaces of any bi-degree up to 15, clamped,
//! open and periodic, polynomial and rational, with exact derivatives up to order four.
//!
//! Control points of a surface stand in the order `i * n_v + j`; parameters outside the domain
//! are clamped to it, or wrapped where the direction is periodic.

mod basis;
mod check_grid;
mod closest;
mod conic;
mod crease;
mod curve;
mod elementary;
mod error;
mod extent;
mod face;
mod fit;
mod grid;
mod grid_fit;
mod knots;
mod lift;
mod offset;
mod pole;
mod quadrature;
mod rational;
mod refine;
mod region;
mod statistics;
mod subdomain;
mod surface;
mod sweep;
mod table;
mod trim;
mod trim_mesh;

pub use basis::{BasisValues, MAX_DERIVATIVE};
pub use check_grid::{Flaw, FlawKind, LEAST_AREA_RATIO};
pub use closest::SurfaceLocator;
pub use conic::ArcSpans;
pub use crease::{CREASE_ANGLE, Crease};
pub use curve::BsplineCurve;
pub use elementary::{Elementary, ElementaryKind, Frame};
pub use error::SplineError;
pub use face::{Carrier, Face, FaceEdge, FaceError};
pub use fit::{FitError, fit_curve, fit_surface};
pub use grid_fit::{GridFit, GridFitOptions, fit_grid};
pub use knots::{Degree, KnotError, KnotVector};
pub use offset::OffsetError;
pub use pole::{Side, SurfaceCurvature};
pub use rational::BINOMIAL;
pub use refine::BezierPiece;
pub use region::{Region, RegionNode};
pub use surface::BsplineSurface;
pub use sweep::Axis;
pub use table::{BasisTable, SampleGrid, SpanSamples};
pub use trim::{Trim, TrimCurve, TrimError, TrimLoop};
pub use trim_mesh::TrimMesh;
