//! Minimises a functional of one of the canonical inputs and prints every level; writes the
//! control mesh as OBJ if a file is given.
//!
//! `cargo run --release --example canonical -- theta3 mehlum_tarrou 2 [auto|none] [METHOD] [out.obj|-]
//! [ITERATIONS] [ENERGIES]`, with the energies (1865,1840) whose first passing is to be timed.

use curvature_variation::{Constraints, FairOptions, Method, SymmetryMode, fair};
use fixtures::quad_graphs;
use geom_core::DVec3;
use std::error::Error;
use std::fmt::Write as _;
use std::io::Write as _;
use std::ops::ControlFlow;
use subdiv_catmull_clark::Creases;

fn main() -> Result<(), Box<dyn Error>> {
    let argument = |k: usize, default: &str| std::env::args().nth(k).unwrap_or(default.to_owned());
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
    let options = FairOptions {
        energy: argument(2, "mehlum_tarrou").parse()?,
        levels: argument(3, "2").parse()?,
        symmetry: if argument(4, "auto") == "none" {
            SymmetryMode::None
        } else {
            SymmetryMode::Auto
        },
        method: match argument(5, "lagged").as_str() {
            "gauss-newton" => Method::GaussNewton,
            "sobolev" => Method::Sobolev,
            "lbfgs" => Method::Lbfgs,
            _ => Method::LaggedGaussNewton,
        },
        iterations: argument(7, "400").parse()?,
        blend_rings: argument(9, "auto").parse().ok(),
        ..FairOptions::default()
    };
    let begin = std::time::Instant::now();
    let mut out = std::io::stdout();
    let mut watched: Vec<f64> = argument(8, "").split(',').filter_map(|e| e.parse().ok()).collect();
    let mut passed = Vec::new();
    let result = fair(&mesh, &Creases::none(), &Constraints::default(), &options, |p| {
        watched.retain(|&energy| {
            let waiting = p.energy > energy;
            if !waiting {
                passed.push((energy, p.vertices, begin.elapsed().as_secs_f64()));
            }
            waiting
        });
        ControlFlow::Continue(())
    })?;
    for (energy, vertices, seconds) in passed {
        writeln!(out, "below {energy} at {vertices} vertices after {seconds:.2} s")?;
    }
    for level in &result.report.levels {
        writeln!(
            out,
            "{:6} vertices, {:5}/{:5} patches, {:2} symmetries, {:6} unknowns: {:9.2} -> {:9.3} in {} steps, {} evaluations, {} factors of {} ({:?}) {:.2} s",
            level.vertices,
            level.evaluated_patches,
            level.patches,
            level.symmetries,
            level.unknowns,
            level.initial_energy,
            level.final_energy,
            level.iterations,
            level.evaluations,
            level.factorizations,
            level.factor_len,
            level.status,
            level.seconds
        )?;
    }
    let report = &result.report;
    writeln!(
        out,
        "fine {:.3}, gap {:.2e}, Gauss-Bonnet {:.1e}, extrapolated {:?}, {:.2} s",
        report.energy_final,
        report.quadrature_gap,
        report.gauss_bonnet_residual,
        report.extrapolated,
        begin.elapsed().as_secs_f64()
    )?;
    for (functional, value) in report.after.iter() {
        write!(out, "{functional} {value:.3}  ")?;
    }
    writeln!(out)?;
    if let Some(file) = std::env::args().nth(6).filter(|f| f != "-") {
        let mut text = String::new();
        for p in result.mesh.positions() {
            writeln!(text, "v {} {} {}", p.x, p.y, p.z)?;
        }
        for f in result.mesh.faces() {
            let corners: Vec<String> =
                result.mesh.face_vertices(f).map(|v| (v.0 + 1).to_string()).collect();
            writeln!(text, "f {}", corners.join(" "))?;
        }
        std::fs::write(file, text)?;
    }
    Ok(())
}
