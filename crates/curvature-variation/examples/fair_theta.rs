//! Fairs a raw control mesh of genus 2 and writes the surface as OBJ with vertex colours: blue where
//! the curvature does not vary, red where it varies most.
//!
//! `cargo run --release -p curvature-variation --example fair_theta -- [LEVELS] [OUT.obj]`

use curvature_variation::{Input, Options, SurfaceSamples, solve};
use gp_solver::Progress;
use std::error::Error;
use std::fmt::Write as _;
use std::io::Write as _;
use std::ops::ControlFlow;

/// Samples per side of a patch.
const SIDE: usize = 6;

fn main() -> Result<(), Box<dyn Error>> {
    let mut arguments = std::env::args().skip(1);
    let levels = arguments.next().map_or(Ok(1), |text| text.parse())?;
    let file = arguments.next().unwrap_or("fair-theta.obj".to_owned());
    let mut out = std::io::stdout();

    let theta = Input::from(fixtures::quad_graphs::theta_graph(3));
    let options = Options { levels, ..Options::default() };
    let solution = solve(&theta, &options, &mut |p: &Progress<'_>| {
        if p.iteration.is_multiple_of(10) {
            let _ =
                writeln!(out, "{} vertices, step {}: {:.2}", p.stage.name, p.iteration, p.energy);
        }
        ControlFlow::Continue(())
    })?;
    let metrics = &solution.metrics;
    writeln!(
        std::io::stdout(),
        "{}: {} from {:.1} to {:.1}",
        solution.report.status,
        options.energy,
        metrics.energy_initial,
        metrics.energy_final
    )?;

    let samples = SurfaceSamples::new(&solution.result, &solution.surface, SIDE);
    let mut sorted = samples.curvature_variation.clone();
    sorted.sort_by(f64::total_cmp);
    // The largest hundredth saturates, so that one spike does not paint the rest blue.
    let largest = sorted[sorted.len() * 99 / 100].max(f64::MIN_POSITIVE);
    let mut text = String::new();
    for (p, variation) in samples.positions.iter().zip(&samples.curvature_variation) {
        let red = (variation / largest).min(1.0);
        let green = 1.0 - (2.0 * red - 1.0).abs();
        writeln!(text, "v {} {} {} {red:.3} {green:.3} {:.3}", p.x, p.y, p.z, 1.0 - red)?;
    }
    for [a, b, c] in &samples.triangles {
        writeln!(text, "f {} {} {}", a + 1, b + 1, c + 1)?;
    }
    std::fs::write(&file, text)?;
    writeln!(std::io::stdout(), "wrote {file}")?;
    Ok(())
}
