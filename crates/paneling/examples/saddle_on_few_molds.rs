//! A saddle panelled once with as many molds as the published rule asks for and once on as few as
//! keep every kink within one degree; writes the second as `saddle.obj` with a colour per mold.
#![allow(clippy::print_stdout, reason = "an example")]

use paneling::{Counts, Options, Solution, solve};
use std::fmt::Write;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let surface = fixtures::surfaces::Shape::Saddle.surface(10, 10, 4, 4);
    let panels = Some(Counts { u: 12, v: 12 });
    let by_rule = solve(&surface, &Options { panels, ..Options::default() }, &mut ())?;
    let options = Options { panels, max_kink_deg: Some(1.0), ..Options::default() };
    let few = solve(&surface, &options, &mut ())?;
    for (name, solution) in [("3 √N molds", &by_rule), ("kinks within 1°", &few)] {
        let quality = &solution.metrics.quality;
        println!(
            "{name}: {} panels on {} molds, largest kink {:.3}°, largest gap {:.2e}, {}",
            quality.panels,
            quality.molds,
            quality.kink_max_deg,
            quality.gap_max,
            solution.report.status,
        );
    }
    let (panels, colours) = obj(&few)?;
    std::fs::write("saddle.obj", panels)?;
    std::fs::write("saddle.mtl", colours)?;
    println!("written: saddle.obj, saddle.mtl");
    Ok(())
}

/// All panels as triangles on their molds, and a colour per mold.
fn obj(solution: &Solution) -> Result<(String, String), std::fmt::Error> {
    let paneling = &solution.result;
    let (mut panels, mut colours) = (String::from("mtllib saddle.mtl\n"), String::new());
    for m in 0..paneling.molds.len() {
        // Hues a golden angle apart, so that neighbouring numbers look different.
        let [r, g, b] = [0.0, 2.1, 4.2].map(|phase| 0.6 + 0.35 * (2.4 * m as f64 + phase).sin());
        writeln!(colours, "newmtl mold-{m}\nKd {r:.3} {g:.3} {b:.3}")?;
    }
    let mut first = 1;
    for (p, mold) in paneling.labels.iter().enumerate() {
        let mesh = paneling.panel_mesh(&solution.panels, p);
        writeln!(panels, "usemtl mold-{mold}")?;
        for v in &mesh.positions {
            writeln!(panels, "v {} {} {}", v.x, v.y, v.z)?;
        }
        for [a, b, c] in mesh.triangles {
            writeln!(panels, "f {} {} {}", first + a, first + b, first + c)?;
        }
        first += mesh.positions.len() as u32;
    }
    Ok((panels, colours))
}
