//! Geometry of points, surfaces and meshes that every other crate stands on.
//!
//! Vectors are [`glam::DVec3`]; curvatures follow the normal `S_u × S_v`, so that a sphere with
//! its outward normal has negative mean curvature.

mod bounding_box;
mod budget;
mod curvature_derivatives;
mod curvature_statistics;
mod diagonals;
mod enclosing_ball;
mod forms;
mod half_edges;
mod isolines;
mod jet;
mod jet_fit;
mod mesh_curvature;
mod mesh_forms;
mod mesh_repair;
mod neighbours;
mod normalization;
mod poly_mesh;
mod quad_grid;
mod spread;
mod third_order;
mod torus_fit;
mod tri_mesh;
mod worst_direction;

pub use bounding_box::BoundingBox;
pub use budget::{Amount, Budget, BudgetError, Cost};
pub use curvature_derivatives::CurvatureDerivatives;
pub use curvature_statistics::{CurvatureStatistics, ValueRange};
pub use diagonals::{DiagonalError, diagonal_meshes};
pub use enclosing_ball::Ball;
pub use forms::{
    CurvatureError, FirstForm, PrincipalCurvatures, SINGULAR_RATIO, SecondForm,
    asymptotic_directions, gaussian_curvature, gradient_norm_squared, mean_curvature,
    normal_curvature, principal_curvatures,
};
pub use glam::{DMat3, DVec2, DVec3};
pub use half_edges::MeshError;
pub use isolines::{Isoline, isolines};
pub use jet::SurfaceJet;
pub use mesh_curvature::{VertexCurvature, mesh_curvature_statistics, vertex_curvatures};
pub use mesh_forms::{VertexForm, vertex_forms};
pub use mesh_repair::{coinciding_points, faces_to_turn};
pub use normalization::{Normalization, NormalizationError};
pub use numerics::assert_close;
pub use poly_mesh::{FaceId, HalfEdgeId, PolyMesh, VertexId};
pub use quad_grid::{GridError, QuadGrid};
pub use third_order::{ThirdOrder, UmbilicKind};
pub use torus_fit::Torus;
pub use tri_mesh::{ClosestPoint, Foot, Nearest, TriMesh, closest_barycentric, closest_on_segment};
