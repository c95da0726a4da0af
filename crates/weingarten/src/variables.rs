//! The unknowns of a level: its control points.

use bspline::BsplineSurface;
use glam::DVec3;
use gp_solver::{Group, Variables};

use crate::blocks::{Net, border_points};
use crate::error::Error;
use crate::options::Border;

/// Name of the group of control points, `(i, j)` being number `i · n_v + j`, three coordinates each.
pub const CONTROL_POINTS: &str = "control points";

/// The control points of a surface as unknowns: ordered for a narrow band, those of the border
/// fixed if they are to stay.
///
/// # Errors
/// [`Error::NotClamped`] if border points are to be held or to glide where they do not lie on the
/// border.
///
/// ```
/// use weingarten::{Border, variables};
/// let roof = fixtures::surfaces::Shape::Roof.surface(6, 5, 3, 3);
/// let variables = variables(&roof, Border::Fixed)?;
/// let points = variables.group(weingarten::CONTROL_POINTS)?;
/// assert_eq!(points.len(), 30);
/// assert_eq!(variables.fixed().iter().filter(|f| **f).count(), 3 * 18);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn variables(surface: &BsplineSurface, border: Border) -> Result<Variables, Error> {
    let (mut variables, points) = bordered(surface, border)?;
    variables.set_vectors(points);
    let net = Net::of(surface);
    variables.set_order(order(net, surface.degree_u().get(), surface.degree_v().get()));
    Ok(variables)
}

/// The control points, those of a fixed border held.
pub(crate) fn bordered(
    surface: &BsplineSurface,
    border: Border,
) -> Result<(Variables, Group), Error> {
    let mut variables = Variables::new();
    let points = variables.add_grid(CONTROL_POINTS, [surface.n_u(), surface.n_v()], 3);
    if border != Border::Free {
        for (direction, knots) in [("u", surface.knots_u()), ("v", surface.knots_v())] {
            if !knots.is_periodic() && !knots.is_clamped() {
                return Err(Error::NotClamped { direction });
            }
        }
    }
    if border == Border::Fixed {
        for control in border_points(Net::of(surface)).into_iter().flatten() {
            variables.fix(points, control);
        }
    }
    Ok((variables, points))
}

/// An ordering of the unknowns that keeps the normal matrix in a narrow band: one side of the net
/// runs fastest, and a closed slow side is folded (0, n−1, 1, n−2, …), so that its two ends, which
/// are neighbours, stay near one another.
fn order(net: Net, degree_u: usize, degree_v: usize) -> Vec<usize> {
    let Net { n_u, n_v, closed_u, closed_v } = net;
    // Half bandwidth in control points if this side is the slow one.
    let band = |degree: usize, closed: bool, fast: usize, fast_degree: usize, fast_closed: bool| {
        let slow_reach = if closed { 2 * degree } else { degree };
        slow_reach * fast + if fast_closed { fast } else { fast_degree }
    };
    let u_slow = band(degree_u, closed_u, n_v, degree_v, closed_v);
    let v_slow = band(degree_v, closed_v, n_u, degree_u, closed_u);
    let folded = |n: usize, closed: bool| -> Vec<usize> {
        if !closed {
            return (0..n).collect();
        }
        (0..n).map(|k| if k % 2 == 0 { k / 2 } else { n - 1 - k / 2 }).collect()
    };
    let mut order = Vec::with_capacity(3 * n_u * n_v);
    let mut push = |i: usize, j: usize| {
        let first = 3 * (i * n_v + j);
        order.extend(first..first + 3);
    };
    if u_slow <= v_slow {
        for i in folded(n_u, closed_u) {
            (0..n_v).for_each(|j| push(i, j));
        }
    } else {
        for j in folded(n_v, closed_v) {
            (0..n_u).for_each(|i| push(i, j));
        }
    }
    order
}

/// Coordinates of the control points, one after the other.
pub(crate) fn coordinates(surface: &BsplineSurface) -> Vec<f64> {
    surface.control_points().iter().flat_map(|p| p.to_array()).collect()
}

/// The control points with these coordinates.
pub(crate) fn control_points(x: &[f64]) -> Vec<DVec3> {
    x.chunks_exact(3).map(DVec3::from_slice).collect()
}

/// The surface with all lengths multiplied by `factor`.
pub(crate) fn scaled(surface: &BsplineSurface, factor: f64) -> Result<BsplineSurface, Error> {
    let points = surface.control_points().iter().map(|p| *p * factor).collect();
    Ok(surface.with_control_points(points)?)
}
