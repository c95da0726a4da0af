//! Area elements on the check grid: whether a surface is whole between its samples.

use bspline::{BsplineSurface, LEAST_AREA_RATIO, Trim};
use glam::DVec3;
use numerics::{Lanes, Triple};
use pulp::Simd;
use rayon::prelude::*;

use crate::grid::SampleGrid;
use crate::kernel::FIRST;
use crate::sweep::{LaneKernel, Scratch, store};

/// Steps keep this much more of the area element than the check of the result asks for, so that
/// rounding cannot part the two.
const MARGIN: f64 = 1.1;

/// The check grid of a surface ([`BsplineSurface::check_parameters`]) with what its area elements may
/// shrink to. A surface that passes has no
/// [flaws](BsplineSurface::flaws_against) and keeps 5 % of the median area element everywhere (half of its
/// own where it began with less than a tenth).
#[derive(Clone, Debug)]
pub(crate) struct CheckGrid {
    grid: SampleGrid,
    /// Least area element of every point; negative where nothing is asked.
    least: Vec<f64>,
    /// Whether the normal may turn on the way from the point before, in u and in v.
    may_turn: Vec<[bool; 2]>,
}

impl CheckGrid {
    /// For surfaces with knots and weights of `level`, compared with `input` on the level's scale. What
    /// is less than whole at `start` already may stay as it is.
    pub(crate) fn new(
        input: &BsplineSurface,
        level: &BsplineSurface,
        trim: Option<&Trim>,
        start: &[f64],
    ) -> Self {
        let [u, v] = input.check_parameters();
        let before = input.area_vector_grid(&u, &v);
        let grid = SampleGrid::new(level, u, v).within(trim, level);
        let m_v = grid.v.len();
        let mut areas: Vec<f64> = before.iter().map(|n| n.length()).collect();
        let middle = areas.len() / 2;
        let median = *areas.select_nth_unstable_by(middle, f64::total_cmp).1;
        let now = area_vectors(&grid, start);
        let is_pole = |k: usize| before[k].length() <= 1e-6 * median;
        let mut counts = vec![true; before.len()];
        for i in 0..grid.u.len() {
            grid.others(i).iter().for_each(|&j| counts[i * m_v + j] = false);
        }
        let least = (0..before.len()).map(|k| {
            let wanted = (MARGIN * LEAST_AREA_RATIO * median).min(0.5 * before[k].length());
            if !counts[k] || is_pole(k) { -1.0 } else { wanted.min(now[k].length()) }
        });
        let least: Vec<f64> = least.collect();
        let turns = |k: usize, b: usize| {
            is_pole(k) || is_pole(b) || before[k].dot(before[b]) < 0.0 || now[k].dot(now[b]) < 0.0
        };
        let may_turn = (0..before.len()).map(|k| {
            [
                k < m_v || turns(k, k.saturating_sub(m_v)),
                k % m_v == 0 || turns(k, k.saturating_sub(1)),
            ]
        });
        let may_turn = may_turn.collect();
        Self { grid, least, may_turn }
    }

    /// Whether the surface with control points `x` is neither torn nor folded.
    pub(crate) fn is_whole(&self, x: &[f64]) -> bool {
        let m_v = self.grid.v.len();
        let now = area_vectors(&self.grid, x);
        now.par_iter().enumerate().with_min_len(4096).all(|(k, normal)| {
            let least = self.least[k];
            if least < 0.0 {
                return true;
            }
            let [in_u, in_v] = self.may_turn[k];
            // NaN fails the first comparison.
            normal.length() >= least
                && (in_u || self.least[k - m_v] < 0.0 || normal.dot(now[k - m_v]) >= 0.0)
                && (in_v || self.least[k - 1] < 0.0 || normal.dot(now[k - 1]) >= 0.0)
        })
    }
}

struct AreaKernel<'a> {
    out: &'a mut [f64],
    stride: usize,
}

impl LaneKernel<FIRST> for AreaKernel<'_> {
    #[inline(always)]
    fn run<S: Simd>(&mut self, _: S, at: usize, d: &[Triple<Lanes<S>>; FIRST]) {
        let normal = d[1].cross(d[2]);
        for (row, value) in
            self.out.chunks_exact_mut(self.stride).zip([normal.x, normal.y, normal.z])
        {
            store(row, at, value);
        }
    }
}

/// `s_u × s_v` at every point of a grid.
fn area_vectors(grid: &SampleGrid, x: &[f64]) -> Vec<DVec3> {
    let unrolled = grid.unroll(x);
    let (stride, m_v) = (grid.stride(), grid.v.len());
    let mut all = vec![DVec3::ZERO; grid.len()];
    let buffers = || (Scratch::default(), vec![0.0; 3 * stride]);
    all.par_chunks_exact_mut(m_v).enumerate().with_min_len(8).for_each_init(
        buffers,
        |(scratch, out), (i, row)| {
            grid.sweep(i, &unrolled, scratch, &mut AreaKernel { out, stride });
            for (j, normal) in row.iter_mut().enumerate() {
                *normal = DVec3::new(out[j], out[stride + j], out[2 * stride + j]);
            }
        },
    );
    all
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::variables::coordinates;

    #[test]
    fn a_surface_is_whole_where_the_check_of_results_finds_no_flaw() {
        // In space a steep pull overhangs without a fold; in the plane it cannot.
        let tube = fixtures::surfaces::Shape::Tube.surface(9, 8, 4, 4);
        for surface in [fixtures::surfaces::plane(9, 8, 4), tube] {
            let x = coordinates(&surface);
            let check = CheckGrid::new(&surface, &surface, None, &x);
            assert!(check.is_whole(&x));
            let (mut whole, mut torn) = (0, 0);
            for pull in 1..40 {
                let mut pulled = x.clone();
                // One control point after the other over its neighbours.
                pulled[3 * (10 + pull % 50)] += 0.1 * pull as f64;
                pulled[3 * (10 + pull % 50) + 1] -= 0.1 * pull as f64;
                let moved =
                    surface.with_control_points(crate::variables::control_points(&pulled)).unwrap();
                let is_whole = check.is_whole(&pulled);
                if is_whole {
                    assert_eq!(moved.flaws_against(&surface), [], "{pull}");
                }
                *if is_whole { &mut whole } else { &mut torn } += 1;
            }
            assert!(whole > 3 && torn > 3, "{whole} {torn}");
        }
    }

    #[test]
    fn what_is_trimmed_away_may_fold() {
        let surface = fixtures::surfaces::plane(9, 8, 4);
        let x = coordinates(&surface);
        let mut folded = x.clone();
        folded[0] += 3.0;
        assert!(!CheckGrid::new(&surface, &surface, None, &x).is_whole(&folded));
        let centre = DVec3::new(0.6, 0.6, 0.0);
        let turn = bspline::ArcSpans::new(0.0, std::f64::consts::TAU);
        let parameters =
            bspline::BsplineCurve::arc(centre, 0.2 * DVec3::X, 0.2 * DVec3::Y, turn).unwrap();
        let disc = bspline::TrimCurve { parameters, edge: None };
        let disc = bspline::TrimLoop::new(vec![disc], 1e-12).unwrap();
        let trim = Trim::new(vec![disc]).unwrap();
        assert!(CheckGrid::new(&surface, &surface, Some(&trim), &x).is_whole(&folded));
    }
}
