//! Why a paneling was refused.

use bspline::Crease;

/// Why a paneling was refused.
///
/// # Example
/// ```
/// use paneling::{Counts, Error, Options, solve};
/// let surface = fixtures::surfaces::Shape::Saddle.surface(8, 8, 4, 4);
/// let options = Options {
///     panels: Some(Counts { u: 3, v: 3 }),
///     molds: Some(10),
///     ..Options::default()
/// };
/// let error = solve(&surface, &options, &mut ()).unwrap_err();
/// assert_eq!(error, Error::MoldCount { molds: 10, panels: 9 });
/// ```
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
#[expect(missing_docs, reason = "the messages spell out every field")]
pub enum Error {
    /// No extent, too much of it, or too far away.
    #[error(transparent)]
    Size(#[from] geom_core::NormalizationError),
    /// A layout with no panels in one direction.
    #[error("a layout of {u} x {v} panels has none; ask for at least 1 x 1")]
    NoPanels { u: usize, v: usize },
    /// More panels than can be held.
    #[error("{panels} panels are more than {limit}; ask for fewer")]
    TooManyPanels { panels: usize, limit: usize },
    /// Too few panels to close the layout around the surface.
    #[error(
        "a surface closed in {direction} needs at least {needed} panels there, found {found}; ask for more"
    )]
    TooFewAround { direction: &'static str, needed: usize, found: usize },
    /// A pattern whose rows must come in pairs around a closed surface.
    #[error(
        "this layout needs an even number of panels around the closed direction {direction}, found {found}; take one more or one less"
    )]
    OddAround { direction: &'static str, found: usize },
    /// A layout mesh that is not in the plane z = 0.
    #[error(
        "layout vertex {vertex} has z = {z}; the layout is a mesh in the plane z = 0 over the unit square, so flatten it"
    )]
    NotPlanar { vertex: usize, z: f64 },
    /// A layout mesh that leaves the unit square.
    #[error(
        "layout vertex {vertex} at ({u}, {v}) is outside the unit square, which stands for the whole surface; scale the layout"
    )]
    OutsideDomain { vertex: usize, u: f64, v: f64 },
    /// A layout face that overlaps itself or is turned over.
    #[error(
        "layout face {face} is not a simple polygon of positive area; mend it in the layout file"
    )]
    BadFace { face: usize },
    /// Two layout faces that overlap.
    #[error("layout faces {first} and {second} overlap; every place belongs to one panel only")]
    Overlap { first: usize, second: usize },
    /// More molds than panels.
    #[error("{molds} molds for {panels} panels; ask for at most one per panel, and at least one")]
    MoldCount { molds: usize, panels: usize },
    /// The surface has no normal inside a panel.
    #[error(
        "the surface is singular at ({u}, {v}), inside panel {panel}; cut the pole off or move its control points apart"
    )]
    Singular { panel: usize, u: f64, v: f64 },
    /// A kink inside the surface.
    #[error("the surface has {crease}, which no seam smooths; split it there and panel the pieces")]
    Creased { crease: Crease },
    /// An option without meaning, such as a bound that no paneling can be measured against.
    #[error("`{name}` is {value}; it must be positive and at most 1e60")]
    BadOption { name: &'static str, value: f64 },
    /// More than one rule for the number of molds.
    #[error(
        "`k`, `molds` and the bounds `max_kink_deg`, `max_gap`, `max_deviation` exclude one another; keep one"
    )]
    SeveralRules,
    /// Several types of molds and nothing to choose by.
    #[error(
        "several mold types need bounds to choose by; add `max_kink_deg` or `max_gap`, or keep one of `mold_types`"
    )]
    SeveralTypes,
    /// A number of panels for a layout that has its own.
    #[error("`panels` has no meaning with a layout of one's own; drop one of the two")]
    PanelsWithLayout,
    /// A flat panel that does not fit on a sheet.
    #[error(
        "panel {panel} needs {} x {} of sheet with its margins, but a sheet is {} x {}; take a larger sheet or smaller panels",
        size[0], size[1], sheet[0], sheet[1]
    )]
    SheetTooSmall { panel: usize, size: [f64; 2], sheet: [f64; 2] },
    /// A panel beyond the limit of its size.
    #[error(
        "panel {panel} at ({u}, {v}) is {} long and {} broad, but `panel_max` is {} x {}; ask for more `panels` or a larger limit",
        size[0], size[1], limit[0], limit[1]
    )]
    PanelTooLarge { panel: usize, u: f64, v: f64, size: [f64; 2], limit: [f64; 2] },
    /// No type of mold was allowed.
    #[error(
        "`mold_types` is empty; name at least one of plane, cylinder, sphere, paraboloid, torus, cubic"
    )]
    NoMoldTypes,
    /// A price list without a type that is allowed.
    #[error("the price list has no entry for {kind}; add it or leave that type out")]
    NoPrice { kind: &'static str },
    /// A price that is not a number or below zero.
    #[error("the price of {kind} is {value}; prices must be finite and not negative")]
    BadPrice { kind: &'static str, value: f64 },
    /// The solver refuses a block of the caller's, or a checkpoint.
    #[error(transparent)]
    Solver(#[from] gp_solver::SolverError),
}
