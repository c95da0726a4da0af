//! A gridshell from a net of points: patches through a quad mesh along asymptotic lines, joined with
//! the least jump of the mean curvature, written as an OBJ file with the patches as a mesh and the
//! asymptotic curves as lines; then the straight strips to build it from.
//!
//! `cargo run -p asymptotic-bezier --example gridshell [FILE.obj]`
#![allow(clippy::print_stdout, reason = "an example tells what it does")]

use std::error::Error;
use std::fmt::Write;

use asymptotic_bezier::{Joins, Options, Patch, Solution, solve};
use geom_core::{DVec3, PolyMesh};

/// Quads of the net in either direction.
const CELLS: usize = 6;
/// Segments of a drawn patch in either direction.
const SEGMENTS: usize = 12;

/// Enneper's surface by parameters along its asymptotic lines.
fn enneper(p: f64, q: f64) -> DVec3 {
    let (u, v) = (0.5 * (p + q), 0.5 * (p - q));
    DVec3::new(u - u.powi(3) / 3.0 + u * v * v, v - v.powi(3) / 3.0 + v * u * u, u * u - v * v)
}

fn net() -> Result<PolyMesh, Box<dyn Error>> {
    let at = |i: usize| -0.9 + 1.8 * i as f64 / CELLS as f64;
    let side = CELLS + 1;
    let points = (0..side * side).map(|k| enneper(at(k / side), at(k % side))).collect();
    let corner = |i: usize, j: usize| (i * side + j) as u32;
    let faces: Vec<[u32; 4]> = (0..CELLS * CELLS)
        .map(|k| (k / CELLS, k % CELLS))
        .map(|(i, j)| [corner(i, j), corner(i + 1, j), corner(i + 1, j + 1), corner(i, j + 1)])
        .collect();
    Ok(PolyMesh::new(points, &faces)?)
}

/// The patches as quads and the curves as polylines.
fn obj(solution: &Solution) -> Result<String, std::fmt::Error> {
    let mut text = String::new();
    let mut first = 1;
    let vertex = |text: &mut String, p: DVec3| writeln!(text, "v {} {} {}", p.x, p.y, p.z);
    let t = |k: usize| k as f64 / SEGMENTS as f64;
    let side = SEGMENTS + 1;
    for (f, filled) in solution.result.patches.iter().enumerate() {
        let patch: &Patch = &filled.patch;
        writeln!(text, "g patch_{f}")?;
        for k in 0..side * side {
            vertex(&mut text, patch.position(t(k / side), t(k % side)))?;
        }
        for k in 0..SEGMENTS * SEGMENTS {
            let a = first + k / SEGMENTS * side + k % SEGMENTS;
            writeln!(text, "f {} {} {} {}", a, a + side, a + side + 1, a + 1)?;
        }
        first += side * side;
    }
    writeln!(text, "g asymptotic_curves")?;
    for curve in &solution.result.boundary.curves {
        let points = curve.polyline(SEGMENTS);
        for point in &points {
            vertex(&mut text, *point)?;
        }
        let numbers: Vec<String> = (first..first + points.len()).map(|n| n.to_string()).collect();
        writeln!(text, "l {}", numbers.join(" "))?;
        first += points.len();
    }
    Ok(text)
}

fn main() -> Result<(), Box<dyn Error>> {
    let path = std::env::args().nth(1).unwrap_or_else(|| "gridshell.obj".to_owned());
    let options = Options { joins: Joins::G2, ..Options::default() };
    let solution = solve(&net()?.into(), &options, &mut ())?;
    let m = &solution.metrics;
    println!("{} patches of degree {}, {} C1 joins", m.patches, m.degree, m.continuous_joins);
    println!("normal curvature of the curves at most {:.1e} (times size)", m.normal_curvature_max);
    println!("kinks at most {:.1e} degrees, jumps of H {:.1e}", m.kink_max_deg, m.mean_jump_max);
    for warning in &solution.warnings {
        println!("warning: {warning}");
    }
    let (sizes, strips) = solution.lamellas(&options);
    println!("{} straight strips, {:.3} wide:", strips.len(), sizes.width);
    for (k, strip) in strips.iter().enumerate() {
        let (length, nodes) = (strip.length, strip.nodes.len());
        println!("  L{k}: {length:.3} long, {nodes} nodes, turns by {:.2} rad", strip.twist);
    }
    std::fs::write(&path, obj(&solution)?)?;
    println!("wrote {path}");
    Ok(())
}
