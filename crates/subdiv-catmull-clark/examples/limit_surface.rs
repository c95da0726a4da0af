//! The limit surface of a cube, its upper edges creased as sharply as wanted: mean curvature from
//! exact derivatives in colour, with level lines, as one SVG drawing.
//!
//! `cargo run --release -p subdiv-catmull-clark --example limit_surface -- [SHARPNESS] [SAMPLES]
//! [FILE]`
#![expect(clippy::print_stdout, reason = "an example reports on the console")]

use geom_core::{DVec2, DVec3, PolyMesh, SurfaceJet, VertexId, isolines};
use std::error::Error;
use std::fmt::Write;
use subdiv_catmull_clark::{Blend, Creases, SubdivisionSurface, refine, refinements_needed};

/// Level lines, with mean curvatures at equal distances.
const LEVELS: usize = 12;
/// How far inside of a patch the outermost samples lie; too little to see in the drawing.
const BESIDE: f64 = 1e-3;
/// Half the side of the drawing, in SVG units.
const HALF: f64 = 350.0;

/// A patch sampled on a grid of parameters.
struct Samples {
    points: Vec<DVec3>,
    curvatures: Vec<f64>,
    /// Whether the surface faces the eye there.
    is_seen: Vec<bool>,
}

fn main() -> Result<(), Box<dyn Error>> {
    let mut arguments = std::env::args().skip(1);
    let sharpness: f64 = arguments.next().map_or(Ok(1.0), |a| a.parse())?;
    let n: usize = arguments.next().map_or(Ok(12), |a| a.parse::<usize>())?.max(1);
    let file = arguments.next().unwrap_or_else(|| "limit_surface.svg".to_owned());

    let corner = |k: u32| DVec3::new(f64::from(k & 1), f64::from(k >> 1 & 1), f64::from(k >> 2));
    let corners = (0..8).map(|k| 2.0 * corner(k) - 1.0).collect();
    let faces =
        [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
    let cube = PolyMesh::new(corners, &faces)?;
    let mut creases = Creases::none();
    for (a, b) in [(4, 5), (5, 7), (7, 6), (6, 4)] {
        creases.set(VertexId(a), VertexId(b), sharpness);
    }

    // Quads, and a regular ring around every extraordinary vertex.
    let (mut mesh, mut sharp) = (cube.clone(), creases.clone());
    for _ in 0..refinements_needed(&cube, &creases) {
        let fine = refine(&mesh, &sharp)?;
        (mesh, sharp) = (fine.mesh, fine.creases);
    }
    let surface = SubdivisionSurface::new(&mesh, &sharp, Blend::Smooth)?;
    let patches: Vec<Samples> = surface
        .patches()
        .iter()
        .map(|patch| {
            let jet = |k: usize| {
                let at = [k / (n + 1), k % (n + 1)].map(|i| i as f64 / n as f64);
                // Derivatives by u and v vanish or are infinite in an extraordinary corner, whatever
                // the curvature is: it is measured a little way from the corners.
                let [u, v] = at.map(|t| t.clamp(BESIDE, 1.0 - BESIDE));
                surface.evaluate(mesh.positions(), patch, u, v)
            };
            let jets: Vec<SurfaceJet> = (0..(n + 1) * (n + 1)).map(jet).collect();
            let is_seen =
                |jet: &SurfaceJet| jet.normal().is_ok_and(|normal| normal.dot(eye()) > 0.0);
            Samples {
                points: jets.iter().map(SurfaceJet::position).collect(),
                curvatures: jets.iter().map(|j| j.mean_curvature().unwrap_or(f64::NAN)).collect(),
                is_seen: jets.iter().map(is_seen).collect(),
            }
        })
        .collect();

    let finite = || patches.iter().flat_map(|p| &p.curvatures).filter(|h| h.is_finite());
    let (low, high) = finite().fold((f64::MAX, f64::MIN), |(l, h), x| (l.min(*x), h.max(*x)));
    std::fs::write(&file, drawing(&cube, &patches, n, low, high)?)?;
    println!("{} patches, mean curvature from {low:.3} to {high:.3}; see {file}", patches.len());
    Ok(())
}

/// Direction to the eye.
fn eye() -> DVec3 {
    DVec3::new(0.45, -0.75, 0.5).normalize()
}

fn seen(p: DVec3) -> DVec2 {
    let right = DVec3::Z.cross(eye()).normalize();
    let up = eye().cross(right);
    DVec2::new(p.dot(right), -p.dot(up)) * (HALF / 1.9)
}

fn drawing(
    cube: &PolyMesh,
    patches: &[Samples],
    n: usize,
    low: f64,
    high: f64,
) -> Result<String, std::fmt::Error> {
    let mut svg = String::new();
    let (corner, side) = (-HALF, 2.0 * HALF);
    writeln!(
        svg,
        r#"<svg xmlns="http://www.w3.org/2000/svg" viewBox="{corner} {corner} {side} {side}" font-family="sans-serif" font-size="16">"#
    )?;
    writeln!(
        svg,
        r#"<rect x="{corner}" y="{corner}" width="{side}" height="{side}" fill="white"/>"#
    )?;
    // A convex body hides only its own back, so that the cells need no sorting.
    for patch in patches {
        for (i, j) in (0..n * n).map(|k| (k / n, k % n)) {
            let at = i * (n + 1) + j;
            let cell = [at, at + n + 1, at + n + 2, at + 1];
            if !cell.iter().any(|k| patch.is_seen[*k]) {
                continue;
            }
            let mean = 0.25 * cell.iter().map(|k| patch.curvatures[*k]).sum::<f64>();
            let outline = path(cell.iter().map(|k| patch.points[*k]));
            let colour = colour((mean - low) / (high - low));
            writeln!(
                svg,
                r#"<polygon points="{outline}" fill="{colour}" stroke="{colour}" stroke-width="0.6"/>"#
            )?;
        }
    }
    for level in 1..=LEVELS {
        let value = low + (high - low) * level as f64 / (LEVELS + 1) as f64;
        for patch in patches {
            for line in isolines(&patch.curvatures, n + 1, n + 1, value) {
                let mut points = line.points;
                if line.is_closed {
                    points.push(points[0]);
                }
                for pair in points.windows(2) {
                    let [a, b] = [pair[0], pair[1]].map(|p| between(patch, n, p));
                    if a.1 && b.1 {
                        let line = path([a.0, b.0].into_iter());
                        writeln!(
                            svg,
                            r##"<polyline points="{line}" stroke="#222" stroke-width="0.8"/>"##
                        )?;
                    }
                }
            }
        }
    }
    for h in cube.edges() {
        let ends = [cube.origin(h), cube.target(h)].map(|v| cube.position(v));
        writeln!(
            svg,
            r##"<polyline points="{}" stroke="#999" stroke-width="1.2" stroke-dasharray="6 4"/>"##,
            path(ends.into_iter())
        )?;
    }
    writeln!(
        svg,
        r#"<text x="{}" y="{}">mean curvature from {low:.3} (blue) to {high:.3} (yellow); control cube dashed</text>"#,
        corner + 15.0,
        HALF - 15.0
    )?;
    writeln!(svg, "</svg>")?;
    Ok(svg)
}

/// A point of a level line, and whether it is in sight.
fn between(patch: &Samples, n: usize, [i, j]: [f64; 2]) -> (DVec3, bool) {
    let (a, b) = ((i as usize).min(n - 1), (j as usize).min(n - 1));
    let at = |p: usize, q: usize| (a + p) * (n + 1) + b + q;
    let (s, t) = (i - a as f64, j - b as f64);
    let side = |q: usize| patch.points[at(0, q)].lerp(patch.points[at(1, q)], s);
    let nearest = at(s.round() as usize, t.round() as usize);
    (side(0).lerp(side(1), t), patch.is_seen[nearest])
}

fn path(points: impl Iterator<Item = DVec3>) -> String {
    let points = points.map(seen).map(|p| format!("{:.2},{:.2}", p.x, p.y));
    points.collect::<Vec<_>>().join(" ")
}

/// From blue at 0 over white to yellow at 1; grey where there is no value.
fn colour(t: f64) -> String {
    if !t.is_finite() {
        return "#ccc".to_owned();
    }
    let stops =
        [[38.0, 70.0, 150.0], [120.0, 170.0, 210.0], [245.0, 245.0, 240.0], [253.0, 190.0, 60.0]];
    let place = 3.0 * t.clamp(0.0, 1.0);
    let k = (place as usize).min(2);
    let [r, g, b] = [0, 1, 2]
        .map(|c| (stops[k][c] + (place - k as f64) * (stops[k + 1][c] - stops[k][c])) as u8);
    format!("#{r:02x}{g:02x}{b:02x}")
}
