//! The report of a command: one HTML file with a 3D view that opens offline, and figures as SVG
//! and PNG.
//!
//! A command fills a [`Report`] with plain data and writes the bytes it gets back. Nothing is
//! computed here that a method should compute: curvatures, normals and deviations come in as
//! arrays. Everything is optional; what is not there is not shown.
//!
//! ```
//! use glam::DVec3;
//! use report::{Report, ReportError, ScalarField, SurfaceView};
//!
//! // The hyperbolic paraboloid z = xy / 2 on a grid, with its exact normals and curvatures.
//! let (rows, columns) = (30, 40);
//! let parameters = (0..rows * columns).map(|k| {
//!     let step = |i: usize, n: usize| 2.0 * i as f64 / (n - 1) as f64 - 1.0;
//!     (step(k / columns, rows), step(k % columns, columns))
//! });
//! let (mut positions, mut normals) = (Vec::new(), Vec::new());
//! let (mut mean, mut gauss) = (Vec::new(), Vec::new());
//! for (x, y) in parameters {
//!     let w = 1.0 + (x * x + y * y) / 4.0;
//!     positions.push(DVec3::new(x, y, x * y / 2.0));
//!     normals.push(DVec3::new(-y / 2.0, -x / 2.0, 1.0).normalize());
//!     mean.push(-x * y / (8.0 * w.powf(1.5)));
//!     gauss.push(-1.0 / (4.0 * w * w));
//! }
//! let triangles = SurfaceView::grid_triangles(rows, columns);
//! let view = SurfaceView::new("as given", positions, normals, triangles)?
//!     .with_field(ScalarField::mean_curvature(mean, "m"))?
//!     .with_field(ScalarField::gaussian_curvature(gauss, "m"))?;
//!
//! let mut report = Report::new("Curvature of a saddle", "umbilic analyze saddle.obj");
//! report.option("samples", "30x40");
//! report.stages.push(view);
//! let page: String = report.to_html(); // write it with `exchange`
//! assert!(page.starts_with("<!doctype html>"));
//! # Ok::<(), ReportError>(())
//! ```
//!
//! [`Report::figures`] gives the same plots as SVG and shaded pictures as PNG, without a browser.
//!
//! Colour maps are safe for colour-blind readers. Numbers that change from run to run (timings,
//! threads, the command line) stand in one JSON block of the page, `<script id="run">`; the rest of the bytes depend
//! on the data alone.

mod border;
mod camera;
mod canvas;
mod codec;
mod colormap;
mod diagram;
mod energies;
mod error;
mod figures;
mod font;
mod histogram;
mod html;
mod layers;
mod legend;
mod numbers;
mod page_data;
mod palette;
mod picture;
mod plots;
mod raster;
mod report;
mod sha256;
mod surface_view;
mod svg;
mod text;

pub use error::ReportError;
pub use figures::Figure;
pub use layers::{FaceGroups, FieldScale, LineRole, LineSet, ScalarField};
pub use plots::{EnergyHistory, Histogram, RelationCurve, Seam, SeamTable, Series};
pub use report::Report;
pub use surface_view::SurfaceView;

/// Runs the example of the README.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;
