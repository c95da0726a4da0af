//! Mean curvature of a quad mesh, measured at its vertices, beside the error against the closed
//! form: an egg box `z = a sin x sin y`, coloured, with level lines, as one SVG drawing.
//!
//! `cargo run --release -p geom-core --example mesh_curvature -- [VERTICES PER SIDE] [A] [FILE]`
#![expect(clippy::print_stdout, reason = "an example reports on the console")]

use geom_core::{DVec2, DVec3, FirstForm, PolyMesh, SecondForm, isolines, vertex_curvatures};
use std::error::Error;
use std::f64::consts::TAU;
use std::fmt::Write;

/// Level lines on either side of zero.
const LEVELS: i32 = 4;
/// Side of a picture, in SVG units.
const SIDE: f64 = 400.0;

fn main() -> Result<(), Box<dyn Error>> {
    let mut arguments = std::env::args().skip(1);
    let n: usize = arguments.next().map_or(Ok(49), |a| a.parse())?;
    let height: f64 = arguments.next().map_or(Ok(0.6), |a| a.parse())?;
    let file = arguments.next().unwrap_or_else(|| "mesh_curvature.svg".to_owned());
    if n < 3 {
        return Err("at least 3 vertices per side make a mesh with curvatures".into());
    }

    let place = |k: usize| DVec2::new((k / n) as f64, (k % n) as f64) * (TAU / (n - 1) as f64);
    let points = (0..n * n)
        .map(place)
        .map(|p| DVec3::new(p.x, p.y, height * p.x.sin() * p.y.sin()))
        .collect();
    let quads: Vec<[u32; 4]> = (0..(n - 1) * (n - 1))
        .map(|k| (k / (n - 1)) * n + k % (n - 1))
        .map(|at| [at, at + n, at + n + 1, at + 1].map(|v| v as u32))
        .collect();
    let mesh = PolyMesh::new(points, &quads)?;

    let measured: Vec<f64> = vertex_curvatures(&mesh)
        .into_iter()
        .map(|curvature| curvature.map_or(f64::NAN, |c| c.mean))
        .collect();
    let error = measured.iter().enumerate().map(|(k, h)| h - exact(height, place(k)));
    let error: Vec<f64> = error.collect();

    let mut svg = String::new();
    writeln!(
        svg,
        r#"<svg xmlns="http://www.w3.org/2000/svg" viewBox="-10 -40 {} {}" font-family="sans-serif" font-size="16">"#,
        2.0 * SIDE + 60.0,
        SIDE + 60.0
    )?;
    writeln!(svg, r#"<rect x="-10" y="-40" width="100%" height="100%" fill="white"/>"#)?;
    for (left, title, values) in [(0.0, "H", &measured), (SIDE + 40.0, "error of H", &error)] {
        let size = values.iter().fold(0.0_f64, |m, v| m.max(v.abs()));
        writeln!(svg, r#"<g transform="translate({left} 0)">"#)?;
        writeln!(svg, r#"<text y="-14">{title}, blue −{size:.2e} to orange {size:.2e}</text>"#)?;
        picture(&mut svg, n, values, size)?;
        writeln!(svg, "</g>")?;
    }
    writeln!(svg, "</svg>")?;
    std::fs::write(&file, svg)?;

    let inside = |k: &usize| (2..n - 2).contains(&(k / n)) && (2..n - 2).contains(&(k % n));
    let largest =
        |of: &mut dyn Iterator<Item = usize>| of.map(|k| error[k].abs()).fold(0.0, f64::max);
    println!(
        "{} vertices: |H| up to {:.3}, error up to {:.1e} inside and {:.1e} on the border; see {file}",
        n * n,
        measured.iter().fold(0.0_f64, |m, h| m.max(h.abs())),
        largest(&mut (0..n * n).filter(inside)),
        largest(&mut (0..n * n)),
    );
    Ok(())
}

/// Mean curvature of `z = a sin x sin y`.
fn exact(a: f64, p: DVec2) -> f64 {
    let ((sx, cx), (sy, cy)) = (p.x.sin_cos(), p.y.sin_cos());
    let (p, q) = (a * cx * sy, a * sx * cy);
    let slope = (1.0 + p * p + q * q).sqrt();
    let first = FirstForm { e: 1.0 + p * p, f: p * q, g: 1.0 + q * q };
    let (bend, twist) = (-a * sx * sy / slope, a * cx * cy / slope);
    let second = SecondForm { l: bend, m: twist, n: bend };
    geom_core::mean_curvature(first, second).unwrap_or(f64::NAN)
}

/// Cells in colours and the level lines above them.
fn picture(svg: &mut String, n: usize, values: &[f64], size: f64) -> Result<(), std::fmt::Error> {
    let cell = SIDE / (n - 1) as f64;
    for k in 0..(n - 1) * (n - 1) {
        let (i, j) = (k / (n - 1), k % (n - 1));
        let at = i * n + j;
        let mean = 0.25 * [at, at + n, at + n + 1, at + 1].map(|v| values[v]).iter().sum::<f64>();
        let (x, y) = (i as f64 * cell, SIDE - (j + 1) as f64 * cell);
        // A little wider than the cell, so that no seams show.
        let width = cell + 0.3;
        let colour = colour(mean / size);
        writeln!(
            svg,
            r#"<rect x="{x:.2}" y="{y:.2}" width="{width:.2}" height="{width:.2}" fill="{colour}"/>"#
        )?;
    }
    for level in -LEVELS..=LEVELS {
        let dashes = if level < 0 { "4 3" } else { "none" };
        let value = f64::from(level) / f64::from(LEVELS + 1) * size;
        for line in isolines(values, n, n, value) {
            let points: Vec<String> = line
                .points
                .iter()
                .map(|[i, j]| format!("{:.2},{:.2}", i * cell, SIDE - j * cell))
                .collect();
            let shape = if line.is_closed { "polygon" } else { "polyline" };
            writeln!(
                svg,
                r##"<{shape} points="{}" fill="none" stroke="#222" stroke-width="0.8" stroke-dasharray="{dashes}"/>"##,
                points.join(" ")
            )?;
        }
    }
    Ok(())
}

/// Blue at −1, white at 0, orange at 1; grey where there is no value.
fn colour(t: f64) -> String {
    if !t.is_finite() {
        return "#ccc".to_owned();
    }
    let end = if t < 0.0 { [33.0, 102.0, 172.0] } else { [217.0, 95.0, 2.0] };
    let [r, g, b] = end.map(|c| (255.0 + t.abs().min(1.0) * (c - 255.0)) as u8);
    format!("#{r:02x}{g:02x}{b:02x}")
}
