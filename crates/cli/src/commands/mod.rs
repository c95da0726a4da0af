//! The commands, one file each.
//!
//! To add one: write `commands/<name>.rs` with a struct that derives `Debug` and `clap::Args` and
//! has `fn run(self, context: &Context) -> Result<Outcome, Failure>`, then add a line to each of
//! the two lists below. `run` first checks its output paths, then reads, computes, and returns all
//! files as bytes: `main` writes them together with the metrics and prints the summary.

mod analyze;
mod analyze_list;
mod asymptotic;
mod convert;
mod darboux;
mod demo;
mod fair;
mod fit;
mod hnet;
mod panel;
mod remesh;
mod verify;
mod weingarten;

use crate::context::Context;
use crate::failure::Failure;
use crate::outcome::Outcome;

macro_rules! commands {
    ($($(#[$help:meta])* $module:ident :: $command:ident),* $(,)?) => {
        /// What to do.
        #[derive(Debug, clap::Subcommand)]
        #[allow(clippy::large_enum_variant, reason = "there is one command in a run")]
        pub(crate) enum Command {
            $($(#[$help])* $command($module::$command)),*
        }

        impl Command {
            /// The name in the metrics file.
            pub(crate) fn name(&self) -> &'static str {
                match self {
                    $(Self::$command(_) => stringify!($module)),*
                }
            }

            pub(crate) fn run(self, context: &Context) -> Result<Outcome, Failure> {
                match self {
                    $(Self::$command(command) => command.run(context)),*
                }
            }
        }
    };
}

commands! {
    /// Measure size and curvatures of surfaces and meshes
    analyze::Analyze,
    /// Patch or gridshell bounded by asymptotic curves, from corner data or an asymptotic net
    asymptotic::Asymptotic,
    /// Change the format of surfaces, meshes, curves and points
    convert::Convert,
    /// Transform a hyperbolic net into a smooth surface of Darboux cyclide patches
    darboux::Darboux,
    /// Run the main job with no input: a built-in roof becomes a Weingarten surface
    demo::Demo,
    /// Fit a B-spline surface to a quad mesh or a grid of points
    fit::Fit,
    /// Minimise a curvature functional of a subdivision surface
    fair::Fair,
    /// Cut a surface into panels and find the molds they are made on
    panel::Panel,
    /// Optimise a B-spline surface towards a Weingarten surface
    weingarten::Weingarten,
    /// Recompute what a run claims from the files it wrote
    verify::Verify,
    /// Make quads along the asymptotic lines of any negatively curved surface
    remesh::Remesh,
    /// Turn quads along asymptotic directions into a smooth skin of ruled patches
    hnet::Hnet,
}
