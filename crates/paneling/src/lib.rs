//! Panels, molds, kinks and gaps: a surface is cut along seams into panels, panels of like shape
//! share a mold, and molds and poses are fitted so that the panels meet with small kinks and gaps
//! (Pellis et al. 2021, Sec. 4.2).
//!
//! A [`Layout`] of polygons over the unit square is mapped to a surface, which gives a
//! [`PanelSet`]; [`solve`] groups it for a given number of molds, or finds the cheapest molds that
//! keep given bounds ([`Options`]); the [`Solution`] has molds, poses and measures, and everything a
//! workshop needs ([`Paneling`]). [`solve_with`] takes residual rows of one's own along;
//! [`blocks`] has those of the joint seam step.
//!
//! # Example
//! ```
//! use paneling::{Counts, Options, solve};
//! let surface = fixtures::surfaces::Shape::Saddle.surface(10, 10, 4, 4);
//! let options = Options { panels: Some(Counts { u: 10, v: 10 }), k: Some(2.0), ..Options::default() };
//! let solution = solve(&surface, &options, &mut ())?;
//! assert_eq!(solution.result.molds.len(), 20);
//! assert!(solution.metrics.quality.kink_median_deg < 0.4);
//! # Ok::<(), paneling::Error>(())
//! ```

pub mod blocks;
mod error;
mod fit;
mod input;
mod layout;
mod metrics;
mod mold;
mod options;
mod output;
mod paneling;
mod pulse;
mod seam;
mod search;
mod solve;
mod trade_off;

pub use blocks::variables;
pub use error::Error;
pub use fit::clustering::DiagramAxis;
pub use gp_solver::{Counts, List};
pub use input::Input;
pub use layout::panels::{PanelSet, Pose, SEAM_SAMPLES, Seam};
pub use layout::tiling::{Layout, MAX_PANELS, Pattern};
pub use metrics::{Metrics, Quality};
pub use mold::prices::{Price, PriceList};
pub use mold::shape::{Mold, MoldType};
pub use options::{Clustering, Options, SheetSize, mold_count};
pub use output::outline::{Bend, FlatPanel, FlatSheets};
pub use output::workshop::{PanelMesh, PanelRow};
pub use paneling::Paneling;
pub use seam::measure::{Measures, SeamMeasure, Spread};
pub use solve::{Solution, problem, solve, solve_with};
pub use trade_off::{Diagram, FINENESS, Law, TradeOff, trade_off};
