//! Panels, molds, kinks and gaps: a surface is cut along seams into panels, panels of like shape
//! share a mold, and molds and poses are fitted so that the panels meet with small kinks and gaps
//! (Pellis et al. 2021, Sec. 4.2).
//!
//! A [`Layout`] of polygons over the unit square is mapped to a surface, which gives a
//! [`PanelSet`]; [`panel`] clusters it for a given number of molds, [`panel_within`] finds the
//! cheapest molds that keep given bounds; the [`Paneling`] has molds, poses and [`Measures`].
//!
//! # Example
//! ```
//! use paneling::{Layout, Options, PanelSet, Pattern, mold_count, panel};
//! let surface = fixtures::surfaces::Shape::Saddle.surface(10, 10, 4, 4);
//! let layout = Layout::generate(Pattern::Quad, 10, 10, [false, false])?;
//! let panels = PanelSet::new(&surface, &layout)?;
//! let result = panel(&panels, &Options::with_molds(mold_count(2.0, panels.len())))?;
//! assert_eq!(result.molds.len(), 20);
//! assert!(result.measures.kinks.median.to_degrees() < 0.4);
//! # Ok::<(), paneling::PanelingError>(())
//! ```

mod error;
mod fit;
mod layout;
mod mold;
mod output;
mod paneling;
mod seam;
mod search;

pub use error::PanelingError;
pub use fit::clustering::DiagramAxis;
pub use layout::panels::{PanelSet, Pose, SEAM_SAMPLES, Seam};
pub use layout::tiling::{Layout, MAX_PANELS, Pattern};
pub use mold::prices::{Price, PriceList};
pub use mold::shape::{Mold, MoldType};
pub use output::outline::{Bend, FlatPanel, FlatSheets};
pub use output::workshop::{PanelMesh, PanelRow};
pub use paneling::{Clustering, Options, Paneling, mold_count, panel};
pub use seam::measure::{Measures, SeamMeasure, Spread};
pub use search::{Bounded, Bounds, panel_within};
