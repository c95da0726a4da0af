//! What is to be panelled.

use crate::error::Error;
use crate::layout::panels::PanelSet;
use crate::layout::tiling::Layout;
use crate::mold::prices::PriceList;
use crate::options::{Options, PANELS};
use bspline::BsplineSurface;
use geom_core::{Cost, DVec3};
use gp_solver::Counts;

/// Memory and microseconds of one core that a panel takes, measured on grids of 1,000 to 4,000
/// panels.
const BYTES_PER_PANEL: u64 = 64 << 10;
const EVALUATIONS_PER_PANEL: u64 = 1100;

/// What is to be panelled: a surface, or panels that are cut already; and what molds and panels
/// cost. Made from either by reference.
///
/// ```
/// use paneling::{Input, Layout, Options, Pattern, Price, PriceList, MoldType, solve};
/// let surface = fixtures::surfaces::Shape::Saddle.surface(10, 10, 4, 4);
/// let hexagons = Layout::generate(Pattern::Hexagon, 6, 6, [false, false])?;
/// let prices = PriceList::new([(MoldType::Cubic, Price { mold: 900.0, panel: 45.0, area: 0.0 })]);
/// let input = Input::from(&surface).with_layout(&hexagons).with_prices(prices);
/// let solution = solve(input, &Options { molds: Some(4), ..Options::default() }, &mut ())?;
/// assert_eq!(solution.metrics.cost, 4.0 * 900.0 + 45.0 * hexagons.len() as f64);
/// # Ok::<(), paneling::Error>(())
/// ```
#[derive(Clone, Debug)]
pub struct Input<'a> {
    cut: Cut<'a>,
    pub(crate) prices: PriceList,
}

#[derive(Clone, Copy, Debug)]
enum Cut<'a> {
    /// A surface, and a layout if the options are not to generate one.
    Surface(&'a BsplineSurface, Option<&'a Layout>),
    Panels(&'a PanelSet),
}

impl<'a> From<&'a BsplineSurface> for Input<'a> {
    fn from(surface: &'a BsplineSurface) -> Self {
        Self { cut: Cut::Surface(surface, None), prices: PriceList::counting_molds() }
    }
}

/// Panels that are cut already: `panels`, `layout` and `equal_arc_length` of the options are not
/// looked at.
impl<'a> From<&'a PanelSet> for Input<'a> {
    fn from(panels: &'a PanelSet) -> Self {
        Self { cut: Cut::Panels(panels), prices: PriceList::counting_molds() }
    }
}

impl<'a> Input<'a> {
    /// The surface cut by a layout of one's own; panels that are cut already stay as they are.
    #[must_use]
    pub fn with_layout(mut self, layout: &'a Layout) -> Self {
        if let Cut::Surface(_, own) = &mut self.cut {
            *own = Some(layout);
        }
        self
    }

    /// Another surface with the same layout and prices, also in place of panels that are cut
    /// already.
    #[must_use]
    pub fn with_surface(mut self, other: &'a BsplineSurface) -> Self {
        self.cut = match self.cut {
            Cut::Surface(_, layout) => Cut::Surface(other, layout),
            Cut::Panels(_) => Cut::Surface(other, None),
        };
        self
    }

    /// With these prices; without them every mold costs 1 and panels nothing.
    #[must_use]
    pub fn with_prices(mut self, prices: PriceList) -> Self {
        self.prices = prices;
        self
    }

    /// What a run would take, roughly: in proportion to the number of panels.
    ///
    /// ```
    /// use paneling::{Input, Options};
    /// let surface = fixtures::surfaces::Shape::Saddle.surface(10, 10, 4, 4);
    /// let panels = Some(gp_solver::Counts { u: 2000, v: 2000 });
    /// let cost = Input::from(&surface).cost(&Options { panels, ..Options::default() });
    /// assert!(cost.bytes > 200 << 30 && cost.evaluations > 3_600_000_000);
    /// ```
    #[must_use]
    pub fn cost(&self, options: &Options) -> Cost {
        let faces = match self.cut {
            Cut::Panels(panels) => panels.len(),
            Cut::Surface(_, Some(layout)) => layout.len(),
            Cut::Surface(_, None) => {
                let Counts { u, v } = options.panels.unwrap_or(PANELS);
                u.saturating_mul(v)
            }
        } as u64;
        Cost {
            bytes: faces.saturating_mul(BYTES_PER_PANEL),
            evaluations: faces.saturating_mul(EVALUATIONS_PER_PANEL),
            vertices: faces,
            faces,
        }
    }

    /// The panels, cut as the options say.
    ///
    /// # Errors
    /// [`Error`] of the layout, [`Error::Singular`] where the surface has no normal, [`Error::Size`]
    /// for one without extent.
    pub fn panels(&self, options: &Options) -> Result<PanelSet, Error> {
        let (centred, center) = self.centred(options)?;
        Ok(centred.placed(center))
    }

    /// The panels moved to the origin, and by what they have been moved away from.
    pub(crate) fn centred(&self, options: &Options) -> Result<(PanelSet, DVec3), Error> {
        let (surface, layout) = match self.cut {
            Cut::Panels(panels) => {
                // Panels are made by `PanelSet::new` only, which keeps them at the origin too.
                return Ok(match &panels.at_origin {
                    Some((centred, center)) => (PanelSet::clone(centred), *center),
                    None => (panels.clone(), DVec3::ZERO),
                });
            }
            Cut::Surface(surface, layout) => (surface, layout),
        };
        let layout = match layout {
            Some(_) if options.panels.is_some() => return Err(Error::PanelsWithLayout),
            Some(layout) => layout.clone(),
            None => {
                let Counts { u, v } = options.panels.unwrap_or(PANELS);
                let closed = [surface.knots_u().is_periodic(), surface.knots_v().is_periodic()];
                Layout::generate(options.layout, u, v, closed)?
            }
        };
        let layout =
            if options.equal_arc_length { layout.with_equal_arc_length(surface) } else { layout };
        PanelSet::centred(surface, &layout)
    }
}
