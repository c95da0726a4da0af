//! A surface fitted to a measured grid of points: control net, knot lines, and the distance of
//! every point to the surface in colour, as one SVG drawing.
//!
//! `cargo run --release -p bspline --example fit_points -- [POINTS PER SIDE] [NOISE] [TOLERANCE]
//! [FILE]`
#![expect(clippy::print_stdout, reason = "an example reports on the console")]

use bspline::{BsplineSurface, GridFitOptions, fit_grid};
use geom_core::{BoundingBox, DVec2, DVec3};
use std::error::Error;
use std::fmt::Write;

/// Width of the drawing, in SVG units.
const WIDTH: f64 = 900.0;
/// Points of a drawn parameter line.
const LINE_POINTS: usize = 60;

fn main() -> Result<(), Box<dyn Error>> {
    let mut arguments = std::env::args().skip(1);
    let n: usize = arguments.next().map_or(Ok(24), |a| a.parse())?;
    let noise: f64 = arguments.next().map_or(Ok(0.02), |a| a.parse())?;
    let tolerance: f64 = arguments.next().map_or(Ok(0.03), |a| a.parse())?;
    let file = arguments.next().unwrap_or_else(|| "fit_points.svg".to_owned());

    // A roof 10 wide and long over an uneven grid, every point off by up to `noise` in height.
    let points: Vec<DVec3> = (0..n * n)
        .map(|k| (uneven(k / n, n), uneven(k % n, n), k))
        .map(|(x, y, k)| {
            let roof = 2.0 - 0.03 * (x - 5.0).powi(2) + 0.8 * (0.7 * x).sin() * (0.5 * y).cos();
            // The golden ratio spreads the errors evenly and repeats them at every run.
            let error = 2.0 * (k as f64 * 0.618_033_988_749_895).fract() - 1.0;
            DVec3::new(x, y, roof + noise * error)
        })
        .collect();

    let options = GridFitOptions { tolerance: Some(tolerance), ..GridFitOptions::default() };
    let fit = fit_grid(&points, n, n, false, &options)?;
    let surface = &fit.surface;
    std::fs::write(&file, drawing(surface, &points, n, tolerance)?)?;
    println!(
        "{} points, {} by {} control points of degree {}: distance at most {:.4} (asked {}), \
         rms {:.4}; see {file}",
        n * n,
        surface.n_u(),
        surface.n_v(),
        surface.degree_u(),
        fit.distance_max,
        fit.tolerance,
        fit.distance_rms
    );
    Ok(())
}

/// Coordinate `k` of `n` between 0 and 10, closer together in the middle.
fn uneven(k: usize, n: usize) -> f64 {
    let t = 2.0 * k as f64 / (n - 1) as f64 - 1.0;
    5.0 * (1.0 + t * (0.7 + 0.3 * t * t))
}

/// Seen from the front and above.
fn seen(p: DVec3) -> DVec2 {
    DVec2::new(p.x - 0.45 * p.y, -0.35 * p.x - 0.45 * p.y - p.z)
}

fn drawing(
    surface: &BsplineSurface,
    points: &[DVec3],
    n: usize,
    tolerance: f64,
) -> Result<String, std::fmt::Error> {
    let net = surface.control_points();
    let flat = |p: &DVec3| seen(*p).extend(0.0);
    let bounds = BoundingBox::of(points.iter().chain(net).map(flat))
        .unwrap_or(BoundingBox { min: DVec3::ZERO, max: DVec3::ONE });
    let scale = (WIDTH - 40.0) / bounds.size().x;
    let place = |p: DVec3| (seen(p) - bounds.min.truncate()) * scale + DVec2::splat(20.0);
    let text = |p: DVec3| format!("{:.1},{:.1}", place(p).x, place(p).y);
    let mut svg = String::new();
    let height = bounds.size().y * scale + 70.0;
    writeln!(
        svg,
        r#"<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {WIDTH} {height:.0}" font-family="sans-serif" font-size="15">"#
    )?;
    writeln!(svg, r#"<rect width="100%" height="100%" fill="white"/>"#)?;
    let mut polyline = |line: Vec<DVec3>, style: &str| {
        let line: Vec<String> = line.into_iter().map(text).collect();
        writeln!(svg, r#"<polyline points="{}" fill="none" {style}/>"#, line.join(" "))
    };

    // The control net, grey.
    let (n_u, n_v) = (surface.n_u(), surface.n_v());
    let grey = r##"stroke="#aaa" stroke-width="0.8""##;
    for i in 0..n_u {
        polyline((0..n_v).map(|j| surface.control_point(i, j)).collect(), grey)?;
    }
    for j in 0..n_v {
        polyline((0..n_u).map(|i| surface.control_point(i, j)).collect(), grey)?;
    }
    // The knot lines: where the polynomial pieces meet.
    let dark = r##"stroke="#124" stroke-width="1.4""##;
    for u in surface.knots_u().breaks() {
        let v = surface.knots_v().uniform_parameters(LINE_POINTS);
        polyline(surface.point_grid(&[u], &v), dark)?;
    }
    for v in surface.knots_v().breaks() {
        let u = surface.knots_u().uniform_parameters(LINE_POINTS);
        polyline(surface.point_grid(&u, &[v]), dark)?;
    }
    // The points: white on the surface, orange above and blue below at the tolerance.
    for (k, p) in points.iter().enumerate() {
        let start = [(k / n) as f64, (k % n) as f64].map(|t| t / (n - 1) as f64);
        let ([u, v], distance) = surface.foot_point(*p, start);
        let side = surface
            .jet(u, v, 1)
            .normal()
            .map_or(1.0, |normal| (*p - surface.point(u, v)).dot(normal).signum());
        let (x, y) = (place(*p).x, place(*p).y);
        let colour = colour(side * distance / tolerance);
        writeln!(
            svg,
            r##"<circle cx="{x:.1}" cy="{y:.1}" r="3.2" fill="{colour}" stroke="#555" stroke-width="0.4"/>"##
        )?;
    }
    writeln!(
        svg,
        r#"<text x="20" y="{:.0}">points from {tolerance} below (blue) to {tolerance} above (orange); knot lines dark, control net grey</text>"#,
        height - 14.0
    )?;
    writeln!(svg, "</svg>")?;
    Ok(svg)
}

/// Blue at −1, white at 0, orange at 1.
fn colour(t: f64) -> String {
    let end = if t < 0.0 { [33.0, 102.0, 172.0] } else { [217.0, 95.0, 2.0] };
    let [r, g, b] = end.map(|c| (255.0 + t.abs().min(1.0) * (c - 255.0)) as u8);
    format!("#{r:02x}{g:02x}{b:02x}")
}
