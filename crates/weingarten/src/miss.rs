//! How far a surface is from a relation, and where.

use crate::field::Sample;
use crate::grid::SampleGrid;
use crate::target::Target;

/// Corners count out to this share of the sides.
const CORNER: f64 = 0.1;
/// A relation holds if the root mean square of what it is missed by is below this share of the
/// curvatures.
const HELD: f64 = 0.02;

/// How far a surface is from the relation asked for. Misses are those of
/// [`Metrics::relation_rms`](crate::Metrics::relation_rms), on the same grid.
///
/// # Example
/// ```
/// use weingarten::{Options, Relation, solve};
/// let saddle = fixtures::surfaces::Shape::Saddle.surface(8, 8, 4, 4);
/// let options = Options { relation: Relation::Minimal, closeness: 1e-3, ..Options::default() };
/// let miss = solve(&saddle, &options, &mut ())?.miss.expect("a relation was asked for");
/// assert!(miss.is_held() && miss.inner_rms < 0.05);
/// # Ok::<(), weingarten::Error>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RelationMiss {
    /// Root mean square over the area as a share of the size of the curvatures (of the spread of the
    /// input's for curves and fitted lines).
    pub share: f64,
    /// Root mean square over the area without the corners of the domain, out to 10 % of its sides: where
    /// two border curves meet at a right angle, they alone decide the mean curvature.
    pub inner_rms: f64,
    /// The largest miss.
    pub worst: f64,
    /// Where it is, in the domain.
    pub worst_at: [f64; 2],
}

impl RelationMiss {
    /// Of samples on the working scale.
    pub(crate) fn new(grid: &SampleGrid, here: &[Sample], target: &Target) -> Self {
        let distances = target.distances(here);
        let (mut all, mut area) = (0.0, 0.0);
        let (mut inner, mut inner_area) = (0.0, 0.0);
        let (mut worst, mut worst_at) = (0.0, [0.0; 2]);
        for (k, (distance, s)) in distances.iter().zip(here).enumerate() {
            let share = s.delta().sqrt();
            let square = share * distance * distance;
            let at = grid.parameters(grid.place(k));
            all += square;
            area += share;
            if !is_corner(grid, at) {
                inner += square;
                inner_area += share;
            }
            if distance.abs() > worst {
                (worst, worst_at) = (distance.abs(), at);
            }
        }
        let rms = |sum: f64, area: f64| if area > 0.0 { (sum / area).sqrt() } else { 0.0 };
        let share = rms(all, area) / target.natural();
        Self { share, inner_rms: rms(inner, inner_area), worst, worst_at }
    }

    /// Whether the relation holds, to 2 % of the curvatures in the mean.
    #[must_use]
    pub fn is_held(&self) -> bool {
        self.share <= HELD
    }
}

/// Whether a place lies in a disc about a corner of the domain; closed sides have no corners.
fn is_corner(grid: &SampleGrid, [u, v]: [f64; 2]) -> bool {
    if grid.u.is_closed() || grid.v.is_closed() {
        return false;
    }
    let off = |axis: &crate::axis::Axis, t: f64| {
        let along = (t - axis.start) / axis.period;
        along.min(1.0 - along)
    };
    off(&grid.u, u).hypot(off(&grid.v, v)) < CORNER
}
