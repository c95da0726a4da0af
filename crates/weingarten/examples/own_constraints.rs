//! A saddle becomes a Weingarten surface over four levels while its front border stays in the plane
//! of a facade (a block with a hand-written Jacobian) and its middle stays within a tube (a block on
//! dual numbers). Writes the surface, says what would have happened without the two, and draws both
//! into a folder if one is named.
//!
//! `cargo run --release -p weingarten --example own_constraints -- saddle.glb pictures`
#![allow(clippy::print_stdout, reason = "an example tells what it found")]

use bspline::{BsplineSurface, Degree, KnotVector};
use gp_solver::{
    DualBlock, ElementFunction, Elements, Group, List, OptionValue, Problem, ResidualBlock, Stage,
    Variables,
};
use numerics::Number;
use report::{Report, ScalarField, SurfaceView};
use weingarten::{CONTROL_POINTS, Options, Solution, solve_with};

/// Rows `n · c − d`: these control points lie in the plane `n · p = d`.
struct InPlane {
    elements: Elements,
    normal: [f64; 3],
    offset: f64,
}

impl InPlane {
    fn new(points: Group, which: &[usize], normal: [f64; 3], offset: f64) -> Self {
        let mut elements = Elements::new();
        which.iter().for_each(|&k| elements.push(&points.columns::<3>(k), 1));
        Self { elements, normal, offset }
    }
}

impl ResidualBlock for InPlane {
    fn name(&self) -> &str {
        "facade"
    }
    fn elements(&self) -> &Elements {
        &self.elements
    }
    fn residuals(&self, x: &[f64], residuals: &mut [f64]) {
        for (e, r) in residuals.iter_mut().enumerate() {
            let height = self.elements.columns(e).iter().zip(&self.normal).map(|(&c, n)| x[c] * n);
            *r = height.sum::<f64>() - self.offset;
        }
    }
    fn linearize(&self, x: &[f64], residuals: &mut [f64], jacobian: &mut [f64]) {
        self.residuals(x, residuals);
        jacobian.chunks_exact_mut(3).for_each(|row| row.copy_from_slice(&self.normal));
    }
}

/// One row `max(0, d − r)`, `d` being the distance of a point of the surface, `Σ B_k c_k`, from a
/// vertical axis: it stays within the tube of radius `r`.
struct WithinTube {
    basis: Vec<f64>,
    axis: [f64; 2],
    radius: f64,
}

impl ElementFunction for WithinTube {
    fn rows<T: Number>(&self, _element: usize, x: &[T], rows: &mut [T]) {
        let mut from_axis = self.axis.map(|a| T::from(-a));
        for (point, &b) in x.chunks_exact(2).zip(&self.basis) {
            (0..2).for_each(|c| from_axis[c] += point[c] * T::from(b));
        }
        let distance = (from_axis[0] * from_axis[0] + from_axis[1] * from_axis[1]).sqrt();
        let beyond = distance - self.radius;
        rows[0] = if beyond.value() > 0.0 { beyond } else { T::from(0.0) };
    }
}

/// Control points and weights of the point in the middle of the domain of a level's surface.
fn middle(points: Group) -> Result<(Vec<usize>, Vec<f64>), bspline::KnotError> {
    let [n_u, n_v] = points.shape();
    let side = |n: usize| -> Result<Vec<(usize, f64)>, bspline::KnotError> {
        let knots = KnotVector::clamped_uniform(Degree::new(4)?, n)?;
        let basis = knots.basis(0.5, 0);
        Ok((0..5).map(|r| (knots.control_index(basis.span, r), basis.values[0][r])).collect())
    };
    let (along_u, along_v) = (side(n_u)?, side(n_v)?);
    let pairs = along_u.iter().flat_map(|u| along_v.iter().map(move |v| (u, v)));
    Ok(pairs.map(|(u, v)| (u.0 * n_v + v.0, u.1 * v.1)).unzip())
}

/// The saddle over four levels, with the two constraints or without.
fn optimised(saddle: &BsplineSurface, constrained: bool) -> Result<Solution, weingarten::Error> {
    let levels = List::read("10x8,14x10,18x14,25x18").unwrap_or_default();
    let options = Options { levels, ..Options::default() };
    let start = saddle.point(0.5, 0.5);
    let mut extra = |stage: &Stage, variables: &Variables, problem: &mut Problem<'_>| {
        if !constrained {
            return Ok(());
        }
        let points = variables.group(CONTROL_POINTS)?;
        let [facade, ..] = stage.place([FACADE, 0.0, 0.0]);
        let front = points.select(|i, _| i == 0);
        let plane = problem.add(InPlane::new(points, &front, [1.0, 0.0, 0.0], facade));
        problem.set_weight(plane, WEIGHT)?;
        let [x, y, _] = stage.place(start.to_array());
        let radius = stage.length(RADIUS);
        let (which, basis) = middle(points).map_err(bspline::SplineError::from)?;
        let mut elements = Elements::new();
        let columns = which.iter().flat_map(|&k| [points.column(k, 0), points.column(k, 1)]);
        elements.push(&columns.collect::<Vec<_>>(), 1);
        let tube = WithinTube { basis, axis: [x, y], radius };
        let tube = problem.add(DualBlock::new("tube", elements, tube));
        Ok(problem.set_weight(tube, WEIGHT)?)
    };
    solve_with(saddle, &options, &mut extra, &mut ())
}

/// How much more the constraints weigh than the alignment.
const WEIGHT: f64 = 1e3;
/// Where the plane of the facade is: `x = −1`.
const FACADE: f64 = -1.0;
/// How far the middle may go sideways, in units of the model.
const RADIUS: f64 = 0.002;

/// How far the front border is off the facade, and the middle from where it was (sideways).
fn misses(saddle: &BsplineSurface, surface: &BsplineSurface) -> [f64; 2] {
    let border = (0..=100).map(|k| surface.point(0.0, f64::from(k) / 100.0).x - FACADE);
    let moved = surface.point(0.5, 0.5) - saddle.point(0.5, 0.5);
    [border.fold(0.0, |m: f64, d| m.max(d.abs())), moved.x.hypot(moved.y)]
}

/// Points along each side of a picture.
const POINTS: usize = 81;
/// Colours of the pictures reach from this far before the facade to this far behind, in millimetres
/// of a model in metres.
const DEEPEST: f64 = 25.0;

/// The surface in colours that say how far each point went across the facade.
fn pictured(
    name: &str,
    saddle: &BsplineSurface,
    surface: &BsplineSurface,
) -> Result<SurfaceView, Box<dyn std::error::Error>> {
    let share = |i: usize| i as f64 / (POINTS - 1) as f64;
    let (mut points, mut normals, mut across) = (Vec::new(), Vec::new(), Vec::new());
    for (u, v) in (0..POINTS * POINTS).map(|k| (share(k / POINTS), share(k % POINTS))) {
        let jet = surface.jet(u, v, 1);
        points.push(jet.position());
        normals.push(jet.normal()?);
        across.push(1e3 * (jet.position().x - saddle.point(u, v).x));
    }
    let field = ScalarField {
        range: Some([-DEEPEST, DEEPEST]),
        ..ScalarField::signed("across", "way across the facade", "mm", across)
    };
    let triangles = SurfaceView::grid_triangles(POINTS, POINTS);
    let view = SurfaceView::new(name, points, normals, triangles)?;
    Ok(view.with_field(field)?)
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let path = std::env::args().nth(1).unwrap_or_else(|| "own-constraints.glb".to_owned());
    let mut pictures = Report::new("A saddle with a facade", "");
    let saddle = fixtures::surfaces::Shape::Saddle.surface(10, 8, 4, 4);
    for (name, constrained) in [("without", false), ("with", true)] {
        let solution = optimised(&saddle, constrained)?;
        let [border, middle] = misses(&saddle, &solution.result);
        println!(
            "{name:>8}: diagram {:.5} of its box, border {border:.1e} off the facade, middle moved {middle:.1e}",
            solution.metrics.diagram_area,
        );
        pictures.stages.push(pictured(name, &saddle, &solution.result)?);
        if constrained {
            let model = exchange::Model::of_surface("saddle", solution.result, Default::default());
            std::fs::write(&path, exchange::encode_model(path.as_ref(), &model)?)?;
            println!("written: {path}");
        }
    }
    if let Some(folder) = std::env::args().nth(2) {
        for figure in pictures.figures()?.iter().filter(|f| f.name.ends_with(".png")) {
            std::fs::write(std::path::Path::new(&folder).join(&figure.name), &figure.bytes)?;
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_constraints_hold_and_would_not_without_them() {
        let saddle = fixtures::surfaces::Shape::Saddle.surface(10, 8, 4, 4);
        let free = misses(&saddle, &optimised(&saddle, false).unwrap().result);
        let solution = optimised(&saddle, true).unwrap();
        let held = misses(&saddle, &solution.result);
        assert!(free[0] > 1e-3 && free[1] > 2.0 * RADIUS, "{free:?}");
        assert!(held[0] < 1e-5 && held[1] < 1.01 * RADIUS, "{held:?}");
        assert!(solution.metrics.diagram_area < 0.002, "{:?}", solution.metrics);
        assert_eq!(solution.report.stages.len(), 4);
    }
}
