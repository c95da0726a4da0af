//! The nets under `fixtures/asymptotic` are those of the generators here; run with `UMBILIC_BLESS=1`
//! to write them again.

use std::fmt::Write;
use std::path::PathBuf;

use crate::common::star::star;
use crate::common::{catenoid, enneper, exact_net, sampled_net};
use asymptotic_bezier::{AsymptoticNet, DataFile};

/// Writes or compares the numbers of a text, which rounding may change in the last digits.
fn check(name: &str, text: &str) {
    let folder = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../../fixtures/asymptotic");
    let path = folder.join(name);
    if std::env::var_os("UMBILIC_BLESS").is_some() {
        std::fs::write(&path, text).unwrap();
    }
    let stored = std::fs::read_to_string(&path).unwrap();
    let split = |c: char| c.is_whitespace() || "(),".contains(c);
    let words = |t: &str| t.split(split).filter(|w| !w.is_empty()).map(str::to_owned).collect();
    let (got, want): (Vec<String>, Vec<String>) = (words(text), words(&stored));
    assert_eq!(got.len(), want.len(), "{name}");
    for (g, w) in got.iter().zip(&want) {
        match (g.parse::<f64>(), w.parse::<f64>()) {
            (Ok(g), Ok(w)) => assert!((g - w).abs() < 1e-6, "{name}: {g} {w}"),
            _ => assert_eq!(g, w, "{name}"),
        }
    }
}

/// One line per vertex, face and curve.
fn net_text(comment: &str, net: &AsymptoticNet) -> String {
    let file = DataFile::from_net(net);
    let point = |p: [f64; 3]| {
        // Lines must be straight to ten digits, so all digits are kept.
        let [x, y, z] = p.map(|x| if x.abs() < 1e-15 { 0.0 } else { x });
        format!("({x:?}, {y:?}, {z:?})")
    };
    let mut text = format!("// {comment}\n(\n  name: \"{comment}\",\n  vertices: [\n");
    for p in file.vertices.unwrap() {
        writeln!(text, "    {},", point(p)).unwrap();
    }
    text.push_str("  ],\n  quads: [\n");
    for [a, b, c, d] in file.quads.unwrap() {
        writeln!(text, "    ({a}, {b}, {c}, {d}),").unwrap();
    }
    text.push_str("  ],\n  curves: [\n");
    for c in file.curves.unwrap() {
        let [a, b] = c.ends;
        let (start, end) = (point(c.start_point), point(c.end_point));
        let [k, l] = c.k;
        let bend = if c.line { "line: true".into() } else { format!("k: ({k:.10}, {l:.10})") };
        writeln!(text, "    (ends: ({a}, {b}), P_1: {start}, P_4: {end}, {bend}),").unwrap();
    }
    text.push_str("  ],\n)\n");
    text
}

fn mesh_text(comment: &str, mesh: &geom_core::PolyMesh) -> String {
    let mut text = format!("# {comment}\n");
    for p in mesh.positions() {
        writeln!(text, "v {:.16} {:.16} {:.16}", p.x, p.y, p.z).unwrap();
    }
    for f in mesh.faces() {
        let corners: Vec<String> =
            mesh.face_vertices(f).map(|v| (v.index() + 1).to_string()).collect();
        writeln!(text, "f {}", corners.join(" ")).unwrap();
    }
    text
}

#[test]
fn grids_and_stars_are_the_generated_ones() {
    let (enneper_window, catenoid_window) = ([-0.6, 0.9, 0.2, 1.3], [0.2, 1.4, -0.1, 0.9]);
    for n in [2, 3] {
        let net = exact_net(enneper, enneper_window, [n, n]);
        let comment = format!("Enneper's surface, {n} by {n} faces with exact curvatures");
        check(&format!("enneper-grid-{n}.ron"), &net_text(&comment, &net));
        let net = exact_net(catenoid, catenoid_window, [n, n]);
        let comment = format!("Catenoid, {n} by {n} faces with exact curvatures");
        check(&format!("catenoid-grid-{n}.ron"), &net_text(&comment, &net));
    }
    for (valence, name) in [(3, "three"), (5, "five"), (6, "six")] {
        let comment = format!("{valence} patches around one vertex");
        check(&format!("{name}-arms.ron"), &net_text(&comment, &star(valence)));
    }
    let mesh = sampled_net(catenoid, [0.5, 1.5, -0.2, 0.8], [30, 30]);
    check("catenoid-net-30.obj", &mesh_text("Asymptotic net on the catenoid", &mesh));
}
