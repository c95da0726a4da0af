//! What a tolerance costs: molds and cost of one surface for several bounds on its kinks, and how
//! much of the curvature diagram it fills.

use crate::error::Error;
use crate::input::Input;
use crate::options::Options;
use crate::solve::{Solution, solve};
use bspline::BsplineSurface;
use geom_core::SurfaceJet;
use gp_solver::{Observer, Status};
use serde::Serialize;
use std::collections::HashSet;
use std::sync::Arc;

/// Samples per control point and direction for [`Diagram`].
const SAMPLES: usize = 4;

/// What one tolerance takes.
#[derive(Clone, Debug, Serialize)]
pub struct TradeOff {
    /// Every kink is at most this.
    pub max_kink_deg: f64,
    /// Whether all bounds are kept.
    pub is_within: bool,
    /// Number of molds.
    pub molds: usize,
    /// Total cost of molds and panels.
    pub cost: f64,
    /// The largest kink.
    pub kink_max_deg: f64,
    /// The largest gap, in units of the model.
    pub gap_max: f64,
    /// The largest distance from the design, in percent of its size.
    pub deviation_max_percent: f64,
    /// The paneling.
    #[serde(skip)]
    pub solution: Arc<Solution>,
}

impl TradeOff {
    fn new(max_kink_deg: f64, solution: Solution) -> Self {
        let quality = solution.metrics.quality;
        Self {
            max_kink_deg,
            is_within: solution.report.status == Status::Converged,
            molds: quality.molds,
            cost: solution.metrics.cost,
            kink_max_deg: quality.kink_max_deg,
            gap_max: quality.gap_max,
            deviation_max_percent: quality.deviation_max_percent,
            solution: Arc::new(solution),
        }
    }
}

/// The cheapest molds for each of these bounds on the kinks, in degrees; the other bounds are those
/// of the options. What keeps a tighter bound keeps a looser one too, so that the cost never rises
/// with the tolerance. Ends early, with the bounds done so far, if asked to stop.
///
/// # Errors
/// As [`solve`].
///
/// # Example
/// ```
/// use paneling::{Counts, Options, trade_off};
/// let surface = fixtures::surfaces::Shape::Saddle.surface(8, 8, 4, 4);
/// let options = Options { panels: Some(Counts { u: 6, v: 6 }), ..Options::default() };
/// let rows = trade_off(&surface, &options, &[4.0, 1.0], &mut ())?;
/// assert!(rows[0].molds <= rows[1].molds && rows.iter().all(|row| row.is_within));
/// # Ok::<(), paneling::Error>(())
/// ```
pub fn trade_off<'a>(
    input: impl Into<Input<'a>>,
    options: &Options,
    degrees: &[f64],
    observer: &mut dyn Observer,
) -> Result<Vec<TradeOff>, Error> {
    let input = input.into();
    let mut rows = Vec::with_capacity(degrees.len());
    for &max_kink_deg in degrees {
        let options = Options {
            k: None,
            molds: None,
            max_kink_deg: Some(max_kink_deg),
            compare_grid: false,
            ..options.clone()
        };
        let solution = solve(input.clone(), &options, observer)?;
        if solution.report.status == Status::Interrupted {
            break;
        }
        rows.push(TradeOff::new(max_kink_deg, solution));
    }
    for k in 0..rows.len() {
        let within = |of: &&TradeOff| of.is_within && of.kink_max_deg <= rows[k].max_kink_deg;
        let cheapest = rows.iter().filter(within).min_by(|a, b| a.cost.total_cmp(&b.cost));
        if let Some(best) = cheapest
            && (!rows[k].is_within || best.cost < rows[k].cost)
        {
            rows[k] = TradeOff { max_kink_deg: rows[k].max_kink_deg, ..best.clone() };
        }
    }
    Ok(rows)
}

/// Places of a surface in the curvature diagram with the axes `H` and `sign(K) √|K|`.
///
/// A Weingarten surface fills a curve, so that the cells it occupies of an `n × n` grid grow as `n`;
/// those of any other surface grow as `n²` (Pellis et al. 2021, Sec. 4.2: `N × N` panels need about
/// `N` molds).
///
/// # Example
/// ```
/// use paneling::Diagram;
/// let roof = Diagram::new(&fixtures::surfaces::Shape::Roof.surface(14, 14, 4, 4));
/// let [few, many] = [20, 40].map(|n| roof.cells(n, &roof.bounds()));
/// assert!(many > 3 * few);
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct Diagram {
    places: Vec<[f64; 2]>,
}

impl Diagram {
    /// The diagram at four samples per control point in each direction; singular places are left
    /// out.
    #[must_use]
    pub fn new(surface: &BsplineSurface) -> Self {
        let u = surface.knots_u().uniform_parameters(SAMPLES * surface.n_u());
        let v = surface.knots_v().uniform_parameters(SAMPLES * surface.n_v());
        let place = |jet: &SurfaceJet| {
            let (first, second) = (jet.first_form(), jet.second_form().ok()?);
            let h = geom_core::mean_curvature(first, second).ok()?;
            let k = geom_core::gaussian_curvature(first, second).ok()?;
            Some([h, k.signum() * k.abs().sqrt()])
        };
        Self { places: surface.jet_grid(&u, &v, 2).iter().filter_map(place).collect() }
    }

    /// Lower and upper bounds of both axes.
    #[must_use]
    pub fn bounds(&self) -> [[f64; 2]; 2] {
        [0, 1].map(|axis| {
            let start = [f64::INFINITY, f64::NEG_INFINITY];
            self.places.iter().fold(start, |[low, high], p| [low.min(p[axis]), high.max(p[axis])])
        })
    }

    /// How many cells of `n` by `n` over these bounds are occupied; places beyond them count in the
    /// cells that continue the grid.
    #[must_use]
    pub fn cells(&self, n: usize, bounds: &[[f64; 2]; 2]) -> usize {
        let cell = |place: &[f64; 2]| {
            [0, 1].map(|axis| {
                let [low, high] = bounds[axis];
                let share = if high > low { (place[axis] - low) / (high - low) } else { 0.0 };
                // The upper bound belongs to the last cell.
                if share == 1.0 { n as i64 - 1 } else { (share * n as f64).floor() as i64 }
            })
        };
        self.places.iter().map(cell).collect::<HashSet<_>>().len()
    }
}

/// Numbers of cells per axis of a [`Law`].
pub const FINENESS: [usize; 3] = [20, 40, 80];

/// How the occupied cells grow with the fineness of the grid.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Law {
    /// Occupied cells of grids of [`FINENESS`] cells per axis.
    pub cells: [usize; 3],
    /// The power of the fineness by which they grow from the first to the last: about 1 for a
    /// Weingarten surface, about 2 for others.
    pub exponent: f64,
}

impl Diagram {
    /// How the occupied cells over these bounds grow.
    #[must_use]
    pub fn law(&self, bounds: &[[f64; 2]; 2]) -> Law {
        let cells = FINENESS.map(|n| self.cells(n, bounds));
        let grown = cells[2] as f64 / cells[0] as f64;
        let finer = FINENESS[2] as f64 / FINENESS[0] as f64;
        Law { cells, exponent: grown.ln() / finer.ln() }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use fixtures::surfaces::{Shape, sphere_cap, torus_patch};
    use gp_solver::Counts;

    #[test]
    fn weingarten_surfaces_fill_a_curve_and_others_an_area() {
        let cells = |surface: &BsplineSurface, n: usize| {
            let diagram = Diagram::new(surface);
            diagram.cells(n, &diagram.bounds())
        };
        // A sphere is a point, a torus a curve: 2 H = K R + 1/r, with K along it.
        assert!(cells(&sphere_cap(4, 4), 1) == 1);
        let torus = torus_patch(4, 20);
        // Coarse enough for every cell of the curve to have a sample.
        let slope = (cells(&torus, 16) as f64 / cells(&torus, 8) as f64).log2();
        assert!((slope - 1.0).abs() < 0.15, "{slope}");
        let roof = Shape::Roof.surface(14, 14, 4, 4);
        // Cells outnumber samples soon, so that not quite 2 is seen.
        let slope = (cells(&roof, 20) as f64 / cells(&roof, 10) as f64).log2();
        assert!(slope > 1.5, "{slope}");
    }

    #[test]
    fn the_cost_never_rises_with_the_tolerance() {
        let roof = Shape::Roof.surface(14, 14, 4, 4);
        let options = Options { panels: Some(Counts { u: 8, v: 8 }), ..Options::default() };
        let rows = trade_off(&roof, &options, &[4.0, 2.0, 1.0, 0.5], &mut ()).unwrap();
        assert_eq!(rows.len(), 4);
        assert!(rows.windows(2).all(|r| r[0].cost <= r[1].cost), "{rows:?}");
        assert!(rows.iter().all(|r| r.is_within && r.kink_max_deg <= r.max_kink_deg * 1.000_001));
    }
}
