//! Levels that suit a surface.

use bspline::BsplineSurface;
use gp_solver::Counts;

use crate::error::Error;
use crate::schedule::refit_to;

/// Shares of the input's control points per direction that are tried for the coarsest net.
///
/// Much coarser nets end in surfaces that are farther away: from 5 x 5 of a roof of 14 x 14 control points the
/// mean deviation is 1.5 % of the size, from 10 x 8 it is 0.7 %.
const SHARES: [f64; 4] = [0.6, 0.7, 0.85, 1.0];
/// How far a net may be from the input, as a share of its size.
const REFIT: f64 = 1e-3;
/// By how much a net is finer than the one before, per direction.
const FINER: f64 = 1.35;
/// Number of nets.
const NETS: i32 = 4;
/// Control points per direction beyond which no net is made finer than the input.
const MOST: usize = 60;

/// Control nets that suit `surface`, coarse to fine, for [`crate::Options::levels`]: the coarsest one that
/// is within 0.1 % of the size of the surface when refitted, and three more, each by a third finer. Every
/// one of them is refitted as well as that.
///
/// # Errors
/// [`Error`] for surfaces that cannot be refitted.
///
/// # Example
/// ```
/// use weingarten::{Options, solve, suited_levels};
/// let roof = fixtures::surfaces::Shape::Roof.surface(14, 12, 4, 4);
/// let levels = suited_levels(&roof)?;
/// assert_eq!(levels.len(), 4);
/// let options = Options { levels: levels.into(), ..Options::default() };
/// let solution = solve(&roof, &options, &mut ())?;
/// assert!(solution.metrics.diagram_area < 0.02 * solution.before.diagram_area);
/// # Ok::<(), weingarten::Error>(())
/// ```
pub fn suited_levels(surface: &BsplineSurface) -> Result<Vec<Counts>, Error> {
    let place = surface.normalization()?;
    let centred = surface.translated(-place.center());
    let mut coarsest = None;
    for share in SHARES {
        let counts = scaled_counts(surface, share);
        if distance(&centred, counts)? <= REFIT * place.size() {
            coarsest = Some((share, counts));
            break;
        }
    }
    let own = Counts { u: surface.n_u(), v: surface.n_v() };
    let (share, first) = coarsest.unwrap_or((1.0, own));
    let mut levels = vec![first];
    for k in 1..NETS {
        let finer = scaled_counts(surface, share * FINER.powi(k));
        let limited = Counts {
            u: finer.u.min(MOST.max(surface.n_u())),
            v: finer.v.min(MOST.max(surface.n_v())),
        };
        // Finer nets of other knots may miss a feature that the input's own knots have.
        let near = distance(&centred, limited)? <= REFIT * place.size();
        if near && levels.last() != Some(&limited) {
            levels.push(limited);
        }
    }
    Ok(levels)
}

fn scaled_counts(surface: &BsplineSurface, share: f64) -> Counts {
    let of = |n: usize, knots: &bspline::KnotVector| {
        let least = knots.degree().get().max(3) + 1;
        ((share * n as f64).round() as usize).max(least)
    };
    Counts { u: of(surface.n_u(), surface.knots_u()), v: of(surface.n_v(), surface.knots_v()) }
}

/// The largest distance of the surface refitted to a net from itself, on its check grid; infinite if it
/// cannot be.
fn distance(surface: &BsplineSurface, counts: Counts) -> Result<f64, Error> {
    let refitted = match refit_to(surface, counts) {
        Ok(refitted) => refitted,
        Err(Error::Level { .. } | Error::LevelKnots { .. }) => return Ok(f64::INFINITY),
        Err(other) => return Err(other),
    };
    let [u, v] = surface.check_parameters();
    let (here, there) = (surface.point_grid(&u, &v), refitted.point_grid(&u, &v));
    Ok(here.iter().zip(&there).map(|(a, b)| a.distance(*b)).fold(0.0, f64::max))
}

#[cfg(test)]
mod tests {
    use super::*;
    use fixtures::surfaces::Shape;

    #[test]
    fn every_net_is_as_near_as_asked_and_finer_than_the_one_before() {
        for (shape, n_u, n_v) in
            [(Shape::Roof, 14, 14), (Shape::Eggbox, 12, 12), (Shape::Tube, 16, 8)]
        {
            let surface = shape.surface(n_u, n_v, 4, 4);
            let levels = suited_levels(&surface).unwrap();
            let size = surface.normalization().unwrap().size();
            for counts in &levels {
                assert!(distance(&surface, *counts).unwrap() <= 1e-3 * size, "{shape:?} {counts}");
            }
            assert!(levels.windows(2).all(|l| l[1].u >= l[0].u && l[1].v >= l[0].v));
            assert!(levels.last().unwrap().u >= n_u, "{shape:?} {levels:?}");
        }
    }
}
