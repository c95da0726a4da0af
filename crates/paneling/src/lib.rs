//! Panels, molds, kinks and gaps.

mod clustering;
mod error;
mod fit;
mod layout;
mod measure;
mod mold;
mod paneling;
mod panels;
mod polygon;
mod residuals;
mod seam_step;
mod small;

pub use clustering::DiagramAxis;
pub use error::PanelingError;
pub use layout::{Layout, MAX_PANELS, Pattern};
pub use measure::{Measures, SeamMeasure, Spread};
pub use mold::{Mold, MoldType};
pub use paneling::{Clustering, Options, Paneling, mold_count, panel};
pub use panels::{PanelSet, Pose, SEAM_SAMPLES, Seam};
