//! The same answer wherever the model stands: moved, scaled, turned, mirrored, with u and v
//! exchanged, with vertices and faces in another order.

#![allow(clippy::unwrap_used, reason = "a test may stop at the first surprise")]

use crate::common::{message, root, umbilic};
use bspline::BsplineSurface;
use exchange::{Mesh, Model};
use geom_core::{Ball, DMat3, DVec3};
use serde_json::{Map, Value};
use std::path::Path;

/// A command line without input and output, and the extension of its model file.
struct Case {
    input: &'static str,
    command: &'static [&'static str],
    extension: &'static str,
    /// Whether its result depends on where the parameters run.
    is_surface: bool,
}

const CASES: &[Case] = &[
    Case {
        input: "fixtures/roof.ron",
        command: &["weingarten", "--levels", "10x8,14x10"],
        extension: "ron",
        is_surface: true,
    },
    Case {
        input: "fixtures/saddle.ron",
        command: &["weingarten", "--iterations", "15"],
        extension: "ron",
        is_surface: true,
    },
    Case {
        input: "fixtures/eggbox-coarse.ron",
        command: &["weingarten", "--levels", "10x8,14x10"],
        extension: "ron",
        is_surface: true,
    },
    Case {
        input: "fixtures/roof.ron",
        command: &["panel", "--panels", "6x5", "--molds", "4"],
        extension: "ron",
        is_surface: false,
    },
    Case {
        input: "fixtures/nets/enneper.obj",
        command: &["hnet"],
        extension: "obj",
        is_surface: false,
    },
    Case {
        input: "fixtures/nets/scherk.obj",
        command: &["hnet"],
        extension: "obj",
        is_surface: false,
    },
    Case {
        input: "fixtures/nets/catenoid-ring.obj",
        command: &["darboux", "--c", "-0.6"],
        extension: "obj",
        is_surface: false,
    },
    Case {
        input: "fixtures/quads/cube.obj",
        command: &["fair"],
        extension: "obj",
        is_surface: false,
    },
    Case {
        input: "fixtures/quads/theta.obj",
        command: &["fair", "--energy", "bending", "--iterations", "20"],
        extension: "obj",
        is_surface: false,
    },
    Case {
        input: "fixtures/asymptotic/hyperbolic-helicoid.obj",
        command: &["asymptotic", "--from-net"],
        extension: "obj",
        is_surface: false,
    },
    Case {
        input: "fixtures/triangles/bumped-ring.obj",
        command: &["remesh", "--faces", "200"],
        extension: "obj",
        is_surface: false,
    },
    Case { input: "fixtures/grid.obj", command: &["fit"], extension: "obj", is_surface: false },
    Case { input: "fixtures/roof.ron", command: &["analyze"], extension: "ron", is_surface: true },
    Case {
        input: "fixtures/quads/torus.obj",
        command: &["analyze"],
        extension: "obj",
        is_surface: false,
    },
];

/// What was done to a model.
#[derive(Clone, Copy)]
struct Motion {
    turn: DMat3,
    scale: f64,
    by: DVec3,
    exchanged: bool,
    renumbered: bool,
}

const STILL: Motion = Motion {
    turn: DMat3::IDENTITY,
    scale: 1.0,
    by: DVec3::ZERO,
    exchanged: false,
    renumbered: false,
};

impl Motion {
    fn point(&self, p: DVec3) -> DVec3 {
        self.turn * p * self.scale + self.by
    }

    /// Whether normals change sides with respect to the model.
    fn flips(&self) -> bool {
        (self.turn.determinant() < 0.0) != self.exchanged
    }

    fn apply(&self, model: &Model) -> Model {
        let mut model = model.clone();
        for named in &mut model.surfaces {
            let surface = &named.surface;
            let points = surface.control_points().iter().map(|&p| self.point(p)).collect();
            named.surface = surface.with_control_points(points).unwrap();
            if self.exchanged {
                named.surface = exchanged(&named.surface);
            }
        }
        for mesh in &mut model.meshes {
            mesh.positions.iter_mut().for_each(|p| *p = self.point(*p));
            if self.renumbered {
                *mesh = renumbered(mesh);
            }
        }
        model
    }
}

/// The mesh with vertices and faces in another order, every second quad with the opposite first corner.
fn renumbered(mesh: &Mesh) -> Mesh {
    let place = shuffled(mesh.positions.len());
    let mut positions = mesh.positions.clone();
    for (&p, &to) in mesh.positions.iter().zip(&place) {
        positions[to] = p;
    }
    let faces: Vec<&[u32]> = mesh.faces.iter().collect();
    let order = shuffled(faces.len());
    let face = |k: &usize| {
        let mut face: Vec<u32> = faces[*k].iter().map(|v| place[*v as usize] as u32).collect();
        // The first corner says between which diagonal and family a net tells.
        let half = face.len() / 2;
        face.rotate_left(k % 2 * half);
        face
    };
    Mesh::new(positions, order.iter().map(face))
}

/// The numbers below `count` in an order that looks like none, the same every time.
fn shuffled(count: usize) -> Vec<usize> {
    let mut order: Vec<usize> = (0..count).collect();
    let mut state = 12345_u64;
    for k in (1..count).rev() {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
        order.swap(k, (state >> 33) as usize % (k + 1));
    }
    order
}

/// The surface with u and v exchanged.
fn exchanged(surface: &BsplineSurface) -> BsplineSurface {
    let (n_u, n_v) = (surface.n_u(), surface.n_v());
    let place = |k: usize| (k % n_u) * n_v + k / n_u;
    let points = (0..n_u * n_v).map(|k| surface.control_points()[place(k)]).collect();
    let weights = surface.weights().map(|w| (0..n_u * n_v).map(|k| w[place(k)]).collect());
    let (u, v) = (surface.knots_u().clone(), surface.knots_v().clone());
    BsplineSurface::new(v, u, points, weights).unwrap()
}

/// Coordinates rounded to multiples of 2⁻²⁰ of the size, so that a move is exact; and the size.
fn rounded(mut model: Model) -> (Model, f64) {
    let mut points: Vec<DVec3> = model.meshes.iter().flat_map(|m| m.positions.clone()).collect();
    points.extend(model.surfaces.iter().flat_map(|s| s.surface.control_points().to_vec()));
    let size = 2.0_f64.powi(Ball::around(&points).unwrap().diameter().log2().floor() as i32);
    let grid = size * 2.0_f64.powi(-20);
    for named in &mut model.surfaces {
        let points = named.surface.control_points().iter().map(|&p| (p / grid).round() * grid);
        named.surface = named.surface.with_control_points(points.collect()).unwrap();
    }
    for mesh in &mut model.meshes {
        mesh.positions.iter_mut().for_each(|p| *p = (*p / grid).round() * grid);
    }
    (model, size)
}

/// The counts of an argument exchanged, as in `10x8,14x10`.
fn swapped(argument: &str) -> String {
    let counts = |text: &str| {
        let (u, v) = text.split_once('x')?;
        (u.parse::<u32>().is_ok() && v.parse::<u32>().is_ok()).then(|| format!("{v}x{u}"))
    };
    let all: Option<Vec<String>> = argument.split(',').map(counts).collect();
    all.map_or_else(|| argument.to_owned(), |all| all.join(","))
}

/// Status, steps and metrics of a run on a model.
fn run(
    case: &Case,
    model: &Model,
    motion: &Motion,
    folder: &Path,
) -> (String, u64, Map<String, Value>) {
    let at = |name: &str| folder.join(name).display().to_string();
    let input = at(&format!("in.{}", case.extension));
    std::fs::write(&input, exchange::encode_model(input.as_ref(), model).unwrap()).unwrap();
    let metrics = at("m.json");
    let mut args = vec![case.command[0], &input];
    // Nets belong to u and v.
    let exchanged: Vec<String> = case.command[1..].iter().map(|a| swapped(a)).collect();
    match motion.exchanged {
        true => args.extend(exchanged.iter().map(String::as_str)),
        false => args.extend(&case.command[1..]),
    }
    let is_net = ["hnet", "darboux", "remesh"].contains(&case.command[0]);
    let out = at(if is_net { "out.obj" } else { "out.step" });
    if case.command[0] != "analyze" {
        args.extend(["-o", &out]);
    }
    args.extend(["--metrics", &metrics]);
    let output = umbilic(&args);
    assert!(output.status.success(), "{args:?}: {}", message(&output));
    let json: Value = serde_json::from_slice(&std::fs::read(&metrics).unwrap()).unwrap();
    let status = json["status"].as_str().unwrap().to_owned();
    (status, json["iterations"].as_u64().unwrap(), json["metrics"].as_object().unwrap().clone())
}

/// With which power of a length a metric grows; none for what is not compared.
fn power(key: &str) -> Option<i32> {
    // Timings and memory are of the machine; the box is of the axes.
    let of_the_machine = key.starts_with("ms_") || key == "peak_memory_mb";
    if of_the_machine || key.contains("_box") || key == "bounding_box" {
        return None;
    }
    Some(match key {
        _ if key.ends_with("_percent") || key.ends_with("_deg") || key.ends_with("_edges") => 0,
        "area" => 2,
        "sampling_error_max" | "circle_defect_max" => 1,
        "tolerance" | "torus_fit_rms" | "fitted_deviation_max" => 1,
        "blank_area" | "panel_area" => 2,
        "max_deviation" | "edge_length" | "edge_length_mean" => 1,
        _ if key.starts_with("gap_") || key.starts_with("distance_") => 1,
        _ if key.starts_with("gaussian_curvature") => -2,
        _ if key.starts_with("mean_curvature") || key.starts_with("principal_curvature") => -1,
        // Bézier energies of curves and patches, energies of a subdivision surface.
        "strain_energy" | "thin_plate_energy" => 2,
        // Working lengths per length.
        "working_scale" => -1,
        "gaussian_jump_max" | "torsion_defect_max" => -2,
        "mean_jump_max" => -1,
        _ => 0,
    })
}

/// What is zero but for rounding: compared by size only.
const ROUNDING: &[(&str, f64)] = &[
    ("star_planarity_max", 1e-12),
    ("kink_max_deg", 1e-10),
    ("normal_curvature_max", 1e-11),
    ("torsion_defect_max", 1e-10),
    ("gauss_bonnet_residual", 1e-12),
    ("quadrature_gap", 1e-8),
    // Of patches that are written where the model stands.
    ("fitted_deviation_max", 1e-6),
    ("gaussian_jump_max", 1e-9),
    ("mean_jump_max", 1e-5),
];

fn number(metrics: &Map<String, Value>, key: &str) -> Option<f64> {
    metrics.get(key).and_then(Value::as_f64)
}

/// The metric that a key becomes where normals change sides, and its sign.
fn mirrored(key: &str) -> (String, f64) {
    let signed = ["mean_curvature_", "principal_curvature_"].iter().any(|p| key.starts_with(p));
    match key {
        _ if signed && key.ends_with("_min") => (key.replace("_min", "_max"), -1.0),
        _ if signed && key.ends_with("_max") => (key.replace("_max", "_min"), -1.0),
        _ if signed && key.ends_with("_p01") => (key.replace("_p01", "_p99"), -1.0),
        _ if signed && key.ends_with("_p99") => (key.replace("_p99", "_p01"), -1.0),
        _ => (key.to_owned(), 1.0),
    }
}

/// The metric that a key becomes where u and v are exchanged.
fn exchanged_key(key: &str) -> String {
    match key {
        "samples_u" => "samples_v".to_owned(),
        "samples_v" => "samples_u".to_owned(),
        _ => key.to_owned(),
    }
}

/// How well what is left over of differences of large numbers is the same: the gradient in a valley,
/// and what quadrature misses, which another order of the faces moves as far as rounding moves the
/// last steps.
fn remainder(key: &str, motion: &Motion) -> f64 {
    match key {
        "gradient_norm" if motion.renumbered => 0.9,
        "gradient_norm" => 1e-3,
        "gauss_bonnet_residual" | "quadrature_gap" if motion.renumbered => 0.02,
        _ => 0.0,
    }
}

fn compare(
    what: &str,
    motion: &Motion,
    tolerance: f64,
    before: &Map<String, Value>,
    after: &Map<String, Value>,
    faults: &mut Vec<String>,
) {
    for key in before.keys() {
        let Some(a) = number(before, key) else { continue };
        let Some(power) = power(key) else { continue };
        let (there, sign) = if motion.flips() { mirrored(key) } else { (key.clone(), 1.0) };
        let there = if motion.exchanged { exchanged_key(&there) } else { there };
        let b = sign * number(after, &there).unwrap_or(f64::NAN) / motion.scale.powi(power);
        if let Some((_, most)) = ROUNDING.iter().find(|(k, most)| k == key && a.abs() <= *most) {
            if !(b.abs() <= *most) {
                faults.push(format!("{what}: {key} is {b:e}, beyond {most:e}"));
            }
            continue;
        }
        let tolerance = if tolerance > 0.0 { remainder(key, motion).max(tolerance) } else { 0.0 };
        // Angles below a millionth of a degree are rounding.
        let least = if key.ends_with("_deg") { 1e-6 } else { 1e-9 };
        if !((a - b).abs() <= tolerance * a.abs().max(b.abs()).max(least)) {
            let off = (a - b).abs() / a.abs().max(b.abs());
            faults.push(format!("{what}: {key} {a:e} became {b:e} ({off:.1e})"));
        }
    }
}

fn check(case: &Case) -> Vec<String> {
    let folder = tempfile::tempdir().unwrap();
    let model = exchange::read_model(&root().join(case.input)).unwrap();
    let (model, size) = rounded(model);
    let (status, steps, before) = run(case, &model, &STILL, folder.path());
    let far = |sizes: f64| {
        // A multiple of the grid.
        Motion { by: size * DVec3::new(sizes, -0.5 * sizes, 0.25 * sizes), ..STILL }
    };
    let turned = |angles: [f64; 3]| {
        let [a, b, c] = angles;
        let turn =
            DMat3::from_rotation_z(a) * DMat3::from_rotation_x(b) * DMat3::from_rotation_y(c);
        Motion { turn, ..STILL }
    };
    let mirror = DMat3::from_diagonal(DVec3::new(-1.0, 1.0, 1.0));
    let mut motions = vec![
        ("moved by 1e3 sizes", far(1e3), 1e-9),
        ("moved by 5e5 sizes", far(5e5), 1e-9),
        ("moved by 1e7 sizes", far(1e7), 1e-9),
        ("scaled by 2^20", Motion { scale: 2.0_f64.powi(20), ..STILL }, 0.0),
        ("scaled by 2^-10", Motion { scale: 2.0_f64.powi(-10), ..STILL }, 0.0),
        ("scaled by 1e6", Motion { scale: 1e6, ..STILL }, 1e-6),
        ("scaled by 1e-6", Motion { scale: 1e-6, ..STILL }, 1e-6),
        ("mirrored", Motion { turn: mirror, ..STILL }, 1e-6),
    ];
    motions.push(("turned", turned([0.7, 0.0, 0.0]), 1e-6));
    motions.push(("turned freely", turned([0.4, -1.1, 2.3]), 1e-6));
    if case.extension == "obj" {
        motions.push(("renumbered", Motion { renumbered: true, ..STILL }, 1e-6));
    }
    if case.is_surface {
        motions.push(("u and v exchanged", Motion { exchanged: true, ..STILL }, 1e-6));
    }
    let mut faults = Vec::new();
    for (name, motion, tolerance) in motions {
        let what = format!("{} {} {name}", case.command[0], case.input);
        let (status_after, steps_after, after) =
            run(case, &motion.apply(&model), &motion, folder.path());
        let few = if motion.renumbered { steps / 20 } else { steps / 50 };
        if status_after != status || steps_after.abs_diff(steps) > few.max(1) {
            faults.push(format!(
                "{what}: {status} in {steps} became {status_after} in {steps_after}"
            ));
        }
        compare(&what, &motion, tolerance, &before, &after, &mut faults);
    }
    faults
}

fn the_same_answer_for(commands: &[&str]) {
    let cases = CASES.iter().filter(|case| commands.contains(&case.command[0]));
    let faults: Vec<String> = cases.flat_map(check).collect();
    assert!(faults.is_empty(), "{}", faults.join("\n"));
}

#[test]
fn weingarten_surfaces_are_the_same_wherever_the_model_stands() {
    the_same_answer_for(&["weingarten"]);
}

#[test]
fn panels_are_the_same_wherever_the_model_stands() {
    the_same_answer_for(&["panel"]);
}

#[test]
fn nets_and_patches_are_the_same_wherever_the_model_stands() {
    the_same_answer_for(&["hnet", "darboux", "asymptotic"]);
}

#[test]
fn new_nets_are_the_same_wherever_the_model_stands() {
    the_same_answer_for(&["remesh"]);
}

#[test]
fn faired_meshes_are_the_same_wherever_the_model_stands() {
    the_same_answer_for(&["fair"]);
}

#[test]
fn measures_and_fits_are_the_same_wherever_the_model_stands() {
    the_same_answer_for(&["analyze", "fit"]);
}
