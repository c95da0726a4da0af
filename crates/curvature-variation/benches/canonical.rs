//! Minimises a functional of one of the canonical inputs and prints every level; writes the
//! control mesh as OBJ if a file is given.
//!
//! `cargo bench -p curvature-variation --bench canonical -- theta3 mehlum_tarrou 2 [auto|none] [METHOD] [out.obj|-]
//! [ITERATIONS] [ENERGIES]`, with the energies (1865,1840) whose first passing is to be timed.

use curvature_variation::{Input, Method, Options, Rings, Symmetry, solve};
use fixtures::quad_graphs;
use geom_core::DVec3;
use gp_solver::{OptionValue, Progress};
use std::error::Error;
use std::fmt::Write as _;
use std::io::Write as _;
use std::ops::ControlFlow;

fn main() -> Result<(), Box<dyn Error>> {
    // Cargo adds a flag of its own.
    let given: Vec<String> = std::env::args().filter(|a| a != "--bench").collect();
    let argument = |k: usize, default: &str| given.get(k).cloned().unwrap_or(default.to_owned());
    let mesh = match argument(1, "theta3").as_str() {
        "theta3" => quad_graphs::theta_graph(3),
        "theta4" => quad_graphs::theta_graph(4),
        "tetrahedron" => quad_graphs::tetrahedron_graph(),
        "prism" => quad_graphs::prism_graph(),
        "cube" => quad_graphs::cube_graph(),
        "torus" => quad_graphs::torus(24, 12, 1.0, 0.5),
        "ellipsoid" => quad_graphs::ellipsoid(4, DVec3::new(1.0, 1.5, 3.0)),
        other => return Err(format!("unknown input {other}").into()),
    };
    let options = Options {
        energy: argument(2, "mehlum_tarrou").parse()?,
        levels: argument(3, "2").parse()?,
        symmetry: if argument(4, "auto") == "none" { Symmetry::None } else { Symmetry::Auto },
        method: match argument(5, "lagged").as_str() {
            "gauss-newton" => Method::GaussNewton,
            "sobolev" => Method::Sobolev,
            "lbfgs" => Method::Lbfgs,
            _ => Method::LaggedGaussNewton,
        },
        iterations: argument(7, "400").parse()?,
        blend_rings: Rings::read(&argument(9, "auto"))?,
        ..Options::default()
    };
    let begin = std::time::Instant::now();
    let mut out = std::io::stdout();
    let mut watched: Vec<f64> = argument(8, "").split(',').filter_map(|e| e.parse().ok()).collect();
    let mut passed = Vec::new();
    let result = solve(&Input::from(mesh), &options, &mut |p: &Progress<'_>| {
        watched.retain(|&energy| {
            let waiting = p.energy > energy;
            if !waiting {
                passed.push((energy, p.stage.name.clone(), begin.elapsed().as_secs_f64()));
            }
            waiting
        });
        ControlFlow::Continue(())
    })?;
    for (energy, vertices, seconds) in passed {
        writeln!(out, "below {energy} at {vertices} vertices after {seconds:.2} s")?;
    }
    for (stage, level) in result.report.stages.iter().zip(&result.levels) {
        let solver = &stage.solver;
        writeln!(
            out,
            "{:6} vertices, {:5}/{:5} patches, {:2} symmetries, {:6} unknowns: {:9.2} -> {:9.3} in {} steps, {} evaluations, {} factors of {} ({:?}) {:.2} s",
            level.vertices,
            level.evaluated_patches,
            level.patches,
            level.symmetries,
            solver.variables,
            solver.initial_energy,
            solver.final_energy,
            solver.iterations,
            solver.evaluations,
            solver.factorizations,
            level.factor_len,
            solver.status,
            solver.timings.total.as_secs_f64()
        )?;
    }
    let metrics = &result.metrics;
    writeln!(
        out,
        "fine {:.3}, gap {:.2e}, Gauss-Bonnet {:.1e}, extrapolated {:?}, {:.2} s",
        metrics.energy_final,
        metrics.quadrature_gap,
        metrics.gauss_bonnet_residual.unwrap_or(f64::NAN),
        result.extrapolated,
        begin.elapsed().as_secs_f64()
    )?;
    for (functional, value) in result.after.iter() {
        write!(out, "{functional} {value:.3}  ")?;
    }
    writeln!(out)?;
    if let Some(file) = given.get(6).filter(|f| *f != "-") {
        let mut text = String::new();
        for p in result.result.positions() {
            writeln!(text, "v {} {} {}", p.x, p.y, p.z)?;
        }
        for f in result.result.faces() {
            let corners: Vec<String> =
                result.result.face_vertices(f).map(|v| (v.0 + 1).to_string()).collect();
            writeln!(text, "f {}", corners.join(" "))?;
        }
        std::fs::write(file, text)?;
    }
    Ok(())
}
