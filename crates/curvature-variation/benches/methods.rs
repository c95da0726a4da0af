//! Compares the methods of descent: steps and seconds from the raw theta graph of genus 2 to given
//! energies, on one mesh without levels and without symmetry, as a table in Markdown.
//!
//! `cargo bench -p curvature-variation --bench methods -- [REFINEMENTS] [ITERATIONS]`: 2 (the default) and 3
//! refinements of the base mesh have 382 and 1,534 vertices. A run ends at the last energy; a dash
//! says that an energy was not reached.

use curvature_variation::{Input, Method, Options, Symmetry, solve};
use fixtures::quad_graphs;
use gp_solver::Progress;
use std::error::Error;
use std::io::Write as _;
use std::ops::ControlFlow;
use std::time::Instant;
use subdiv_catmull_clark::{Creases, refine};

/// Least energies found on the meshes with 382 and 1,534 vertices.
const LEAST: [f64; 2] = [1892.2, 1824.8];
/// The energies to reach, as multiples of the least one.
const GOALS: [f64; 4] = [1.3, 1.1, 1.02, 1.005];

fn main() -> Result<(), Box<dyn Error>> {
    let argument = |k: usize, default: usize| -> Result<usize, std::num::ParseIntError> {
        std::env::args().filter(|a| a != "--bench").nth(k).map_or(Ok(default), |text| text.parse())
    };
    let refinements = argument(1, 2)?.clamp(2, 3);
    let iterations = argument(2, 8000)?;
    let mut mesh = quad_graphs::theta_graph(3);
    for _ in 0..refinements {
        mesh = refine(&mesh, &Creases::none())?.mesh;
    }
    let goals = GOALS.map(|factor| factor * LEAST[refinements - 2]);
    let mut out = std::io::stdout();
    writeln!(out, "{} vertices, steps / seconds to an energy of", mesh.vertex_count())?;
    let heads: Vec<String> = goals.iter().map(|goal| format!("{goal:.0}")).collect();
    writeln!(out, "| method | {} | factorisations | end |", heads.join(" | "))?;
    writeln!(out, "|---|{}", "---|".repeat(GOALS.len() + 2))?;
    for method in [Method::Lbfgs, Method::Sobolev, Method::GaussNewton, Method::LaggedGaussNewton] {
        let options = Options {
            levels: 0,
            iterations,
            method,
            symmetry: Symmetry::None,
            tolerance: 1e-9,
            ..Options::default()
        };
        let mut reached: Vec<(usize, f64)> = Vec::new();
        let begin = Instant::now();
        let input = Input::from(mesh.clone());
        let result = solve(&input, &options, &mut |p: &Progress<'_>| {
            while reached.len() < goals.len() && p.energy <= goals[reached.len()] {
                reached.push((p.iteration, begin.elapsed().as_secs_f64()));
            }
            if reached.len() == goals.len() {
                ControlFlow::Break(())
            } else {
                ControlFlow::Continue(())
            }
        })?;
        let level = &result.report.stages[0].solver;
        write!(out, "| {method:?} ")?;
        for k in 0..goals.len() {
            match reached.get(k) {
                Some((steps, seconds)) => write!(out, "| {steps} / {seconds:.2} ")?,
                None => write!(out, "| — ")?,
            }
        }
        writeln!(
            out,
            "| {} | {:.1} after {} |",
            level.factorizations, level.final_energy, level.iterations
        )?;
    }
    Ok(())
}
