//! Numbers that can be read but have no meaning as geometry.

use crate::error::ReadError;
use crate::model::Model;
use bspline::{BsplineSurface, KnotVector};
use geom_core::{DVec3, Normalization, NormalizationError};

/// Largest coordinate, weight and knot, and one over the smallest size and weight: areas and their
/// squares then stay within the range of numbers.
const LARGEST: f64 = Normalization::LARGEST;

/// Refuses coordinates, weights and knots whose squares overflow or vanish, and surfaces and meshes
/// whose points all coincide.
pub(crate) fn check(model: &Model) -> Result<(), ReadError> {
    for named in &model.surfaces {
        let surface = &named.surface;
        check_points(
            "control point",
            "control points coincide, so the surface",
            surface.control_points(),
        )?;
        check_weights(surface)?;
        check_knots(surface.knots_u())?;
        check_knots(surface.knots_v())?;
    }
    for grid in &model.grids {
        check_points("grid point", "points coincide, so the grid", &grid.points)?;
    }
    for mesh in &model.meshes {
        if mesh.faces.is_empty() {
            check_sizes("point", &mesh.positions)?;
        } else {
            check_points("vertex", "vertices coincide, so the mesh", &mesh.positions)?;
        }
    }
    Ok(())
}

/// As [`check`], for points under the name `what`; `none` says what has no extent.
pub(crate) fn check_points(what: &str, none: &str, points: &[DVec3]) -> Result<(), ReadError> {
    check_sizes(what, points)?;
    if points.len() < 2 {
        return Ok(());
    }
    match Normalization::of(points) {
        // What is far away has few digits, but it can be looked at and moved.
        Ok(_) | Err(NormalizationError::TooFar { .. }) => Ok(()),
        Err(NormalizationError::Size { size }) => Err(ReadError::content(
            format!("all is within {size:e}, and areas of that size vanish"),
            "scale the model up or choose another unit",
        )),
        Err(_) => {
            let what = format!("all {none} has no extent");
            Err(ReadError::content(what, "check the coordinates"))
        }
    }
}

fn check_sizes(what: &str, points: &[DVec3]) -> Result<(), ReadError> {
    match points.iter().position(|p| !(p.abs().max_element() <= LARGEST)) {
        None => Ok(()),
        Some(k) => {
            let DVec3 { x, y, z } = points[k];
            let what = format!("{what} {k} is ({x:e}, {y:e}, {z:e}), and squares of that overflow");
            let mend = format!("keep coordinates within {LARGEST:e}, or choose another unit");
            Err(ReadError::content(what, mend))
        }
    }
}

fn check_weights(surface: &BsplineSurface) -> Result<(), ReadError> {
    let sound = |w: &f64| *w <= LARGEST && *w * LARGEST >= 1.0;
    let weights = surface.weights().unwrap_or_default();
    match weights.iter().position(|w| !sound(w)) {
        None => Ok(()),
        Some(k) => Err(ReadError::content(
            format!("weight {k} is {:e}, and its products leave the range of numbers", weights[k]),
            "weights near 1 give every surface, for only their ratios count",
        )),
    }
}

fn check_knots(knots: &KnotVector) -> Result<(), ReadError> {
    let breaks = knots.breaks();
    let sound = |pair: &[f64]| {
        let step = pair[1] - pair[0];
        step * LARGEST >= 1.0 && pair[0].abs().max(pair[1].abs()) <= LARGEST
    };
    match breaks.windows(2).position(|pair| !sound(pair)) {
        None => Ok(()),
        Some(k) => Err(ReadError::content(
            format!(
                "the knots {:e} and {:e} follow each other, and derivatives over such a step leave the range of numbers",
                breaks[k],
                breaks[k + 1]
            ),
            "scale the knots to about 0 to 1",
        )),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::Mesh;
    use crate::unit::LengthUnit;
    use bspline::Degree;

    fn message(points: [DVec3; 4], weights: Option<Vec<f64>>, end: f64) -> Option<String> {
        let knots = || KnotVector::new(Degree::new(1).unwrap(), vec![0.0, 0.0, end, end]).unwrap();
        let surface = BsplineSurface::new(knots(), knots(), points.to_vec(), weights).unwrap();
        let model = Model::of_surface("s", surface, LengthUnit::default());
        check(&model).err().map(|e| e.to_string())
    }

    #[test]
    fn what_has_no_meaning_is_refused_in_a_sentence() {
        let square = [DVec3::ZERO, DVec3::Y, DVec3::X, DVec3::ONE];
        assert_eq!(message(square, Some(vec![1.0, 0.5, 2.0, 1.0]), 1.0), None);
        assert_eq!(message(square.map(|p| 1e-20 * p), None, 1.0), None);
        for (got, want) in [
            (
                message([DVec3::new(1.0, 2.0, 3.0); 4], None, 1.0),
                "all control points coincide, so the surface has no extent; check the coordinates",
            ),
            (
                message(square.map(|p| 1e150 * p), None, 1.0),
                "control point 1 is (0e0, 1e150, 0e0), and squares of that overflow",
            ),
            (message(square.map(|p| 1e-70 * p), None, 1.0), "areas of that size vanish"),
            (message(square, Some(vec![1.0, 1e300, 1.0, 1.0]), 1.0), "weight 1 is 1e300"),
            (message(square, Some(vec![1.0, 1.0, 1e-200, 1.0]), 1.0), "weight 2 is 1e-200"),
            (message(square, None, 1e-300), "the knots 0e0 and 1e-300 follow each other"),
        ] {
            assert!(got.as_ref().is_some_and(|g| g.contains(want)), "{got:?} for {want}");
        }
        let mesh =
            |p: DVec3| Model::of_mesh(Mesh::new(vec![p; 3], [[0, 1, 2]]), LengthUnit::default());
        assert!(
            check(&mesh(DVec3::ONE)).unwrap_err().to_string().contains("so the mesh has no extent")
        );
        assert!(check(&mesh(DVec3::splat(1e200))).is_err());
    }
}
