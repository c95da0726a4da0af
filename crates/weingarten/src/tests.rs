//! Tests that look inside: recorded first steps, Jacobians of every block.

use std::sync::Arc;

use bspline::{BsplineSurface, KnotVector};
use geom_core::assert_close;
use gp_solver::{Closeness, Counts, Factorization, ResidualBlock, Stage, System};

use crate::area::CheckGrid;
use crate::blocks::{
    Alignment, BorderGlide, BorderSpacing, Fairness, Field, Net, Parallel, Regularity,
    RelationRows, SampledSurface, Shape,
};
use crate::grid::SampleGrid;
use crate::level::Level;
use crate::lifted::{self, Definitions};
use crate::metrics::Meter;
use crate::variables::coordinates;
use crate::{Input, Options, Relation};

/// The level of a recorded scene, which is on the working scale already.
fn recorded_level(scene: &fixtures::reference::Scene) -> (Level, Options) {
    let (u, v) = scene.samples;
    let options = Options { samples: Some(Counts { u, v }), ..Default::default() };
    (Level::new(scene.surface(), None, options.samples, Stage::only("scene")).unwrap(), options)
}

/// The step of the recorded program, which damps every coordinate by itself: `(A + μ diag A) s = −g`.
fn coordinate_step(system: &System<'_>, damping: f64) -> Vec<f64> {
    let n = system.variables();
    let mut matrix = vec![0.0; n * n];
    for (i, j, value) in system.normal_triplets() {
        matrix[i * n + j] = value;
        matrix[j * n + i] = value;
    }
    for k in 0..n {
        matrix[k * n + k] *= 1.0 + damping;
    }
    let mut step: Vec<f64> = system.gradient().iter().map(|g| -g).collect();
    assert!(numerics::lu_solve(&mut matrix, &mut step, n));
    step
}

#[test]
fn first_steps_equal_the_recorded_ones() {
    for scene in fixtures::reference::scenes() {
        let (level, options) = recorded_level(&scene);
        let x = coordinates(&level.reference);
        let start = level.sampled(&x).unwrap();
        let q0 = crate::blocks::residual_scale(&start.samples, level.curvature);
        assert_close(q0 / scene.first_step.q0, 1.0, 1e-10);
        for factorization in [Factorization::Auto, Factorization::Sparse] {
            let problem = level.problem(&options, &start, &x).unwrap();
            let mut system = System::new(problem, factorization).unwrap();
            system.refresh(&x);
            let energy = system.linearize(&x).unwrap();
            // The record leaves the half out.
            assert_close(2.0 * energy / scene.first_step.energy_before, 1.0, 1e-10);
            // The recorded program multiplies the damping by 5 until the energy falls.
            let mut damping = scene.first_step.mu;
            let mut moved;
            loop {
                moved = x.clone();
                let step = coordinate_step(&system, damping);
                for (s, &unknown) in step.iter().zip(system.order()) {
                    moved[unknown] += s;
                }
                if system.energy_at(&moved) < energy {
                    break;
                }
                damping *= 5.0;
            }
            let size = scene.first_step.step.iter().map(|s| s.length()).fold(0.0, f64::max);
            for (k, want) in scene.first_step.step.iter().enumerate() {
                for axis in 0..3 {
                    let got = moved[3 * k + axis] - x[3 * k + axis];
                    assert_close((got - want[axis]) / size, 0.0, 1e-10);
                }
            }
        }
    }
}

#[test]
fn metrics_of_recorded_nets_equal_the_recorded_ones() {
    for scene in fixtures::reference::scenes() {
        let surface = scene.surface();
        let samples = [scene.samples.0, scene.samples.1];
        let input = Input::from(&surface);
        let metrics = Meter::new(input, 1.0, samples, 1.0).measure(&surface, None);
        assert_close(metrics.alignment_rms / scene.metrics_start.sin, 1.0, 1e-9);
        assert_close(metrics.diagram_area / scene.metrics_start.area, 1.0, 1e-9);
        assert_close(metrics.deviation_max_percent, 0.0, 1e-12);
    }
}

/// Compares the Jacobian of a block with fourth-order central differences at `x`.
fn check_jacobian(block: &dyn ResidualBlock, x: &[f64], step: f64, bound: f64) {
    let elements = block.elements();
    let mut residuals = vec![0.0; elements.rows_total()];
    let mut jacobian = vec![f64::NAN; elements.jacobian_len()];
    block.linearize(x, &mut residuals, &mut jacobian);
    let mut same = vec![0.0; residuals.len()];
    block.residuals(x, &mut same);
    for (a, b) in residuals.iter().zip(&same) {
        assert_close(*a, *b, 1e-12 * (1.0 + b.abs()));
    }
    let mut dense = vec![0.0; residuals.len() * x.len()];
    for e in 0..elements.len() {
        let values = &jacobian[elements.jacobian_range(e)];
        let columns = elements.columns(e);
        for (r, row) in elements.rows(e).zip(values.chunks_exact(columns.len())) {
            for (&column, &value) in columns.iter().zip(row) {
                dense[r * x.len() + column] += value;
            }
        }
    }
    let scale = dense.iter().fold(0.0f64, |m, v| m.max(v.abs()));
    let at = |k: usize, s: f64| {
        let mut moved = x.to_vec();
        moved[k] += s;
        let mut out = vec![0.0; residuals.len()];
        block.residuals(&moved, &mut out);
        out
    };
    // Every seventh column: they are all alike, and this takes every kind of them.
    for k in (0..x.len()).step_by(7) {
        let near = (at(k, step), at(k, -step));
        let far = (at(k, 2.0 * step), at(k, -2.0 * step));
        for r in 0..residuals.len() {
            let want = (8.0 * (near.0[r] - near.1[r]) - (far.0[r] - far.1[r])) / (12.0 * step);
            assert_close(dense[r * x.len() + k] / scale, want / scale, bound);
        }
    }
}

/// Small surfaces of every kind of net: clamped, closed in u or v, rational.
fn small_surfaces() -> Vec<BsplineSurface> {
    let shape = fixtures::surfaces::Shape::Roof.surface(7, 6, 4, 4);
    let tube = fixtures::surfaces::Shape::Tube.surface(8, 6, 4, 4);
    let weights = (0..42).map(|k| 1.0 + 0.3 * (f64::from(k) * 1.3).sin()).collect();
    let rational = BsplineSurface::new(
        shape.knots_u().clone(),
        shape.knots_v().clone(),
        shape.control_points().to_vec(),
        Some(weights),
    )
    .unwrap();
    let transposed = (0..48).map(|k| tube.control_point(k % 8, k / 8)).collect();
    let closed_v =
        BsplineSurface::new(tube.knots_v().clone(), tube.knots_u().clone(), transposed, None)
            .unwrap();
    vec![shape, tube, rational, closed_v]
}

#[test]
fn jacobians_of_sample_terms_match_central_differences() {
    for surface in small_surfaces() {
        let start = SampledSurface::new(&surface, Counts { u: 9, v: 7 }).unwrap();
        let x = coordinates(&surface);
        check_jacobian(&Alignment::new(&start, 0.7), &x, 1e-4, 1e-8);
        for relation in [
            Relation::Linear(1.0, 0.3, 0.2),
            Relation::ConstantGauss(0.4),
            Relation::Ratio(-0.5),
            Relation::LinearFit,
            Relation::CurveFit,
            Relation::Curve(vec![[-1.0, 0.2], [0.0, 0.5], [1.0, -0.3]]),
        ] {
            let block = RelationRows::new(&start, &relation, 1.0, 0.9).unwrap();
            check_jacobian(&block, &x, 1e-4, 1e-8);
        }
        for field in [Field::Mean, Field::Gauss] {
            let block = Parallel::new(&start, field, 0.3);
            check_jacobian(&block, &x, 1e-4, 1e-7);
        }
    }
}

/// Shrunk to a quarter of the area, and grown to nine times as much: the barrier is at work everywhere.
#[test]
fn jacobians_of_the_barrier_match_central_differences() {
    for surface in small_surfaces() {
        let x = coordinates(&surface);
        let grid = Arc::new(SampleGrid::quadrature(&surface, |_| 2, 1));
        let check = Arc::new(CheckGrid::new(&surface, &surface, None, &x));
        let block = Regularity::new(grid, check, &x, 100, 0.8);
        let mut rows = vec![0.0; block.elements().rows_total()];
        block.residuals(&x, &mut rows);
        assert!(rows.iter().all(|r| *r == 0.0));
        for factor in [0.5, 3.0] {
            let moved: Vec<f64> = x.iter().map(|v| factor * v).collect();
            block.residuals(&moved, &mut rows);
            assert!(rows.iter().all(|r| *r > 0.0));
            check_jacobian(&block, &moved, 1e-4, 1e-8);
        }
    }
}

#[test]
fn jacobians_of_net_terms_match_central_differences() {
    for surface in small_surfaces() {
        let net = Net::of(&surface);
        let x = coordinates(&surface);
        let moved: Vec<f64> =
            x.iter().enumerate().map(|(k, v)| v + 0.03 * (k as f64).sin()).collect();
        check_jacobian(&Fairness::new(net, Some(&x), 0.2), &moved, 1e-3, 1e-10);
        check_jacobian(&Shape::new(net, &x, 0.2), &moved, 1e-4, 1e-8);
        check_jacobian(&Closeness::to_last_iterate(&x, 0.2), &moved, 1e-3, 1e-10);
        let mut border = BorderGlide::new(net, &x, 1.0);
        border.refresh(&moved);
        check_jacobian(&border, &moved, 1e-3, 1e-10);
        check_jacobian(&BorderSpacing::new(net, &x, 0.4), &moved, 1e-4, 1e-8);
    }
}

#[test]
fn lifted_jacobians_match_central_differences_and_the_start_satisfies_the_definitions() {
    for surface in small_surfaces() {
        let options = Options { samples: Some(Counts { u: 6, v: 5 }), ..Options::published() };
        let level = Level::new(surface, None, options.samples, Stage::only("small")).unwrap();
        let x = lifted::start(&level.grid, &coordinates(&level.reference)).unwrap();
        let problem = lifted::problem(&level, &options, &x).unwrap();
        let mut system = System::new(problem, Factorization::Sparse).unwrap();
        system.refresh(&x);
        system.linearize(&x).unwrap();
        for term in system.terms() {
            if term.name.contains("definitions") {
                assert!(term.energy < 1e-24, "{}: {}", term.name, term.energy);
            }
        }
        let mut off = x.clone();
        off.iter_mut().enumerate().for_each(|(k, v)| *v *= 1.0 + 0.01 * (k as f64).cos());
        check_jacobian(&Definitions::new(&level.grid, &off), &off, 1e-3, 1e-9);
    }
}

/// Control points, degree and samples of rows of Table 2 and the printed number of unknowns.
#[test]
fn lifted_unknowns_are_those_of_table_2() {
    let open = |n: (usize, usize), degree: usize, samples: (usize, usize)| {
        let knots = |n| KnotVector::clamped_uniform(bspline::Degree::new(degree).unwrap(), n);
        count(knots(n.0).unwrap(), knots(n.1).unwrap(), samples)
    };
    let closed = |n: (usize, usize), samples_v: usize| {
        let degree = bspline::Degree::new(4).unwrap();
        let u = KnotVector::periodic_uniform(degree, n.0).unwrap();
        let v = KnotVector::clamped_uniform(degree, n.1).unwrap();
        count(u, v, (2 * (n.0 + 4), samples_v))
    };
    assert_eq!(open((14, 14), 4, (28, 28)), 9996); // row 1
    assert_eq!(open((18, 18), 4, (36, 36)), 16524); // row 2, printed as 16525
    assert_eq!(open((25, 25), 4, (50, 50)), 31875); // row 3
    assert_eq!(open((20, 18), 4, (40, 36)), 18360); // row 4b
    assert_eq!(open((6, 8), 4, (12, 16)), 2448); // row 7
    assert_eq!(open((16, 20), 3, (48, 60)), 35520); // row 8b
    assert_eq!(open((16, 20), 4, (48, 60)), 35520); // row 8c
    assert_eq!(open((8, 10), 4, (16, 20)), 4080); // row 9b
    assert_eq!(open((35, 12), 4, (70, 24)), 21420); // row 10a
    assert_eq!(open((40, 12), 4, (80, 24)), 24480); // row 10b
    assert_eq!(open((10, 10), 4, (20, 20)), 5100); // row 12
    assert_eq!(open((16, 20), 4, (32, 40)), 16320); // row 13 top
    assert_eq!(open((20, 30), 4, (40, 60)), 30600); // row 13 bottom
    assert_eq!(closed((10, 8), 16), 5616); // row 6b
    assert_eq!(closed((14, 10), 20), 9060); // row 6c
    assert_eq!(closed((18, 14), 28), 15540); // row 6d
    assert_eq!(closed((25, 18), 36), 26406); // row 6e
    assert_eq!(closed((40, 15), 30), 33480); // row 10c
}

fn count(u: KnotVector, v: KnotVector, samples: (usize, usize)) -> usize {
    let points = vec![geom_core::DVec3::ZERO; u.control_count() * v.control_count()];
    let surface = BsplineSurface::new(u, v, points, None).unwrap();
    lifted::unknowns(&SampleGrid::uniform(&surface, [samples.0, samples.1]))
}

#[test]
fn net_edges_of_a_closed_net_join_its_ends() {
    let net = Net { n_u: 6, n_v: 5, closed_u: true, closed_v: false };
    let x: Vec<f64> = (0..90).map(|k| f64::from(k).sin()).collect();
    // 6 · 4 edges along v, 6 · 5 along u, two diagonals in each of 24 faces.
    assert_eq!(Shape::new(net, &x, 1.0).elements().rows_total(), 24 + 30 + 48);
}
