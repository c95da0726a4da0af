//! `cargo xtask judges`: written files read again by independent programs.
//!
//! Open CASCADE evaluates every face of a STEP file on a grid of parameters; points, Gaussian and
//! mean curvature and the areas of faces must agree with our own evaluation of the same file, which
//! it must find to be one valid shell, without kinks where there are to be none and with our volume
//! where it is closed. geomdl does the same with points and derivatives of its own format. rhino3dm
//! reads our 3DM files, and we read its own. The glTF validator must find no error in a GLB file, and
//! ezdxf none in a drawing.
//! What is not installed is skipped by name.

mod reading;
mod rhino;
mod verdict;

use self::verdict::{Face, Verdict, ask};
use crate::shell::{Outcome, build_umbilic, check, root, umbilic};
use bspline::BsplineSurface;
use geom_core::DVec3;
use serde::Deserialize;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::process::Command;

/// Largest difference of points (times the size of the surface) and of curvatures (times their
/// largest size on the face) that counts as agreement.
const AGREEMENT: f64 = 1e-8;
/// Largest relative difference of the areas of a face that counts as agreement.
const AREA_AGREEMENT: f64 = 1e-6;
/// The same of volumes.
const VOLUME_AGREEMENT: f64 = 1e-6;
/// What the judge of ezdxf prints.
#[derive(Deserialize)]
struct Drawing {
    errors: Vec<String>,
    layers: BTreeMap<String, usize>,
}

/// What the judge of geomdl prints of one surface.
#[derive(Deserialize)]
struct Derivatives {
    /// u, v, S, S_u, S_v, S_uu, S_uv, S_vv, on the domain scaled to the unit square.
    samples: Vec<Vec<f64>>,
}

/// Orders of the derivatives, as geomdl's judge lists them.
const ORDERS: [(usize, usize); 6] = [(0, 0), (1, 0), (0, 1), (2, 0), (1, 1), (0, 2)];

/// A command that writes files to be judged; `{out}` is the scratch folder.
struct Case {
    name: &'static str,
    arguments: &'static [&'static str],
    /// Whether `a.step`, `a.json`, `a.glb` and `a.dxf` are written.
    step: bool,
    json: bool,
    glb: bool,
    dxf: bool,
    /// Largest angle in degrees between neighbouring faces.
    kink: f64,
    /// Whether all boundaries are asymptotic curves, so that K there must be minus the torsion
    /// squared.
    asymptotic: bool,
}

const CASES: &[Case] = &[
    Case::step("saddle", &["convert", "fixtures/saddle.ron", "{out}/a.step"]),
    Case::step("tube, closed", &["convert", "fixtures/tube.ron", "{out}/a.step"]),
    Case::step("sphere cap, rational", &["convert", "fixtures/sphere-cap.ron", "{out}/a.step"]),
    Case::step("torus patch, rational", &["convert", "fixtures/torus-patch.ron", "{out}/a.step"]),
    Case::step(
        "catenoid window, asymptotic boundary",
        &["asymptotic", "fixtures/asymptotic/catenoid.ron", "-o", "{out}/a.step"],
    )
    .asymptotic(),
    Case::step(
        "Enneper window, asymptotic boundary",
        &[
            "asymptotic",
            "fixtures/asymptotic/enneper.ron",
            "-o",
            "{out}/a.step",
            "-o",
            "{out}/a.glb",
        ],
    )
    .asymptotic()
    .and_glb(),
    Case::step(
        "gridshell of nine patches",
        &["asymptotic", "fixtures/asymptotic/catenoid-grid-3.ron", "-o", "{out}/a.step"],
    )
    .asymptotic()
    .smooth_to(1e-8),
    // The torsion of its curves is a quotient of two small numbers near the inflections (2e-6 there),
    // so only the surfaces are compared.
    Case::step(
        "gridshell across inflections, curves from normals, G2 joins",
        &[
            "asymptotic",
            "fixtures/asymptotic/hyperbolic-enneper.obj",
            "--from-net",
            "--joins",
            "g2",
            "-o",
            "{out}/a.step",
        ],
    ),
    Case::step(
        "hyperbolic net of a helicoid",
        &["hnet", "fixtures/nets/helicoid.obj", "-o", "{out}/a.step", "-o", "{out}/a.glb"],
    )
    .and_glb(),
    Case::step(
        "hyperbolic net around a flat point",
        &["hnet", "fixtures/nets/p-disc.obj", "-o", "{out}/a.step"],
    )
    .smooth_to(1e-8),
    Case::step(
        "hyperbolic net, odd ring",
        &["hnet", "fixtures/nets/catenoid-odd.obj", "-o", "{out}/a.step"],
    )
    .smooth_to(1e-8),
    Case::json("near-helical surface", &["convert", "fixtures/near-helical.ron", "{out}/a.json"]),
    Case::json("sphere cap, rational", &["convert", "fixtures/sphere-cap.ron", "{out}/a.json"]),
    Case::json("tube, closed", &["convert", "fixtures/tube.ron", "{out}/a.json"]),
    Case::glb("saddle as GLB", &["convert", "fixtures/saddle.ron", "{out}/a.glb"]),
    Case::glb(
        "Darboux transform as GLB",
        &["darboux", "fixtures/nets/enneper.obj", "--c", "-0.6", "-o", "{out}/a.glb"],
    ),
    Case::step("limit of a cube of tubes", &["convert", "fixtures/quads/cube.obj", "{out}/a.step"])
        .smooth_to(1e-8),
    Case::step("faired surface", &["fair", "fixtures/quads/theta.obj", "-o", "{out}/a.step"])
        .smooth_to(1e-3),
    Case::dxf(
        "flat panels",
        &[
            "panel",
            "fixtures/roof.ron",
            "--panels",
            "8x6",
            "--mold-types",
            "cylinder",
            "-o",
            "{out}/a.dxf",
        ],
    ),
];

impl Case {
    const fn files(
        name: &'static str,
        arguments: &'static [&'static str],
        [step, json, glb]: [bool; 3],
    ) -> Self {
        Self { name, arguments, step, json, glb, dxf: false, kink: 180.0, asymptotic: false }
    }

    const fn step(name: &'static str, arguments: &'static [&'static str]) -> Self {
        Self::files(name, arguments, [true, false, false])
    }

    const fn json(name: &'static str, arguments: &'static [&'static str]) -> Self {
        Self::files(name, arguments, [false, true, false])
    }

    const fn glb(name: &'static str, arguments: &'static [&'static str]) -> Self {
        Self::files(name, arguments, [false, false, true])
    }

    const fn dxf(name: &'static str, arguments: &'static [&'static str]) -> Self {
        let mut case = Self::files(name, arguments, [false; 3]);
        case.dxf = true;
        case
    }

    const fn smooth_to(mut self, degrees: f64) -> Self {
        self.kink = degrees;
        self
    }

    const fn and_glb(mut self) -> Self {
        self.glb = true;
        self
    }

    const fn asymptotic(mut self) -> Self {
        self.asymptotic = true;
        self
    }
}

/// Judges all cases; fails on the first disagreement.
pub(crate) fn run() -> Outcome {
    build_umbilic()?;
    let python = python_with("OCP");
    let geomdl = python_with("geomdl");
    let rhino = python_with("rhino3dm");
    let drawings = python_with("ezdxf");
    let node = node_with_validator();
    for (missing, name, wanted) in [
        (python.is_none(), "Open CASCADE", "a python3 (or UMBILIC_JUDGE_PYTHON) with OCP 7.9.3.1"),
        (rhino.is_none(), "rhino3dm", "a python3 (or UMBILIC_JUDGE_PYTHON) with rhino3dm 8"),
        (geomdl.is_none(), "geomdl", "a python3 (or UMBILIC_JUDGE_PYTHON) with geomdl 5"),
        (drawings.is_none(), "ezdxf", "a python3 (or UMBILIC_JUDGE_PYTHON) with ezdxf 1"),
        (node.is_none(), "the glTF validator", "node with gltf-validator on NODE_PATH"),
    ] {
        if missing {
            println!("SKIPPED {name}: needs {wanted}");
        }
    }
    if let Some(python) = &python {
        reading::judge(python)?;
    }
    if let Some(python) = &rhino {
        rhino::judge(python)?;
    }
    for (k, case) in CASES.iter().enumerate() {
        let out = root().join("target/judges").join(k.to_string());
        std::fs::create_dir_all(&out).map_err(|e| format!("{}: {e}", out.display()))?;
        write_files(case, &out)?;
        if let (Some(python), true) = (&python, case.step) {
            let said = judge_step(python, &out.join("a.step"), case)
                .map_err(|e| format!("{}: {e}", case.name))?;
            println!("{}: Open CASCADE agrees: {said}", case.name);
        }
        if let (Some(python), true) = (&geomdl, case.json) {
            let said = judge_json(python, &out.join("a.json"))
                .map_err(|e| format!("{}: {e}", case.name))?;
            println!("{}: geomdl agrees: {said}", case.name);
        }
        if let (Some(python), true) = (&drawings, case.dxf) {
            let said =
                judge_dxf(python, &out.join("a.dxf")).map_err(|e| format!("{}: {e}", case.name))?;
            println!("{}: ezdxf agrees: {said}", case.name);
        }
        if let (Some(node), true) = (&node, case.glb) {
            let mut validator = Command::new(node);
            validator.arg(root().join("xtask/judges/gltf.cjs")).arg(out.join("a.glb"));
            check(validator).map_err(|e| format!("{}: {e}", case.name))?;
        }
    }
    Ok(())
}

fn write_files(case: &Case, out: &Path) -> Outcome {
    let mut command = umbilic();
    let shown = out.to_string_lossy();
    command.args(case.arguments.iter().map(|a| a.replace("{out}", &shown))).arg("-q");
    check(command).map_err(|e| format!("{}: {e}", case.name))
}

fn python_with(package: &str) -> Option<PathBuf> {
    let chosen = std::env::var_os("UMBILIC_JUDGE_PYTHON").map(PathBuf::from);
    let python = chosen.unwrap_or_else(|| "python3".into());
    let tried = Command::new(&python).args(["-c", &format!("import {package}")]).output();
    tried.is_ok_and(|output| output.status.success()).then_some(python)
}

fn node_with_validator() -> Option<PathBuf> {
    let tried = Command::new("node").args(["-e", "require('gltf-validator')"]).output();
    tried.is_ok_and(|output| output.status.success()).then(|| "node".into())
}

/// Compares points and derivatives, each relative to the largest of its order on the surface.
fn judge_json(python: &Path, file: &Path) -> Outcome<String> {
    let theirs: Vec<Derivatives> = serde_json::from_str(&ask(python, "spline_library.py", file)?)
        .map_err(|e| format!("the judge said: {e}"))?;
    let model = exchange::read_model(file).map_err(|e| e.to_string())?;
    if theirs.len() != model.surfaces.len() {
        return Err(format!("{} surfaces read, {} written", theirs.len(), model.surfaces.len()));
    }
    let mut worst = [0.0_f64; ORDERS.len()];
    for (theirs, ours) in theirs.iter().zip(&model.surfaces) {
        let surface = &ours.surface;
        let [(u0, u1), (v0, v1)] = [surface.knots_u().domain(), surface.knots_v().domain()];
        for (k, &(a, b)) in ORDERS.iter().enumerate() {
            let (mut size, mut difference) = (0.0_f64, 0.0_f64);
            for sample in &theirs.samples {
                let [u, v, rest @ ..] = sample.as_slice() else {
                    return Err("a sample without parameters".to_owned());
                };
                let Some(&[x, y, z]) = rest.as_chunks().0.get(k) else {
                    return Err(format!("a sample without derivative ({a}, {b})"));
                };
                let got = DVec3::new(x, y, z);
                size = size.max(got.length());
                let jet = surface.jet(u0 + (u1 - u0) * u, v0 + (v1 - v0) * v, 2);
                let scale = (u1 - u0).powi(a as i32) * (v1 - v0).powi(b as i32);
                difference = difference.max((scale * jet.d(a, b)).distance(got));
            }
            // Written so that NaN is a disagreement.
            worst[k] = worst[k].max(if difference > 0.0 { difference / size } else { difference });
            if !(difference <= AGREEMENT * size) {
                return Err(format!("derivative ({a}, {b}) differs by {difference:.1e} of {size}"));
            }
        }
    }
    let [point, u, v, uu, uv, vv] = worst;
    let (first, second) = (u.max(v), uu.max(uv).max(vv));
    Ok(format!("points to {point:.1e}, derivatives to {first:.1e} and {second:.1e}"))
}

/// Compares every sample of every face; returns the largest differences in words.
fn judge_step(python: &Path, file: &Path, case: &Case) -> Outcome<String> {
    let verdict = Verdict::of(python, file)?;
    let model = exchange::read_model(file).map_err(|e| e.to_string())?;
    if !verdict.valid || verdict.roots == 0 {
        return Err("Open CASCADE finds the shape invalid".to_owned());
    }
    if verdict.faces.len() != model.surfaces.len() {
        let (theirs, ours) = (verdict.faces.len(), model.surfaces.len());
        return Err(format!("Open CASCADE finds {theirs} faces, we wrote {ours}"));
    }
    let scale = model.unit.metres() * 1e3;
    let mut worst = Differences::default();
    for (face, named) in verdict.faces.iter().zip(&model.surfaces) {
        worst.merge(&compare(face, &named.surface, scale, case.asymptotic)?);
        let ours = named.curvature_statistics().area * scale * scale;
        // Written so that NaN is a disagreement.
        if !((face.area / ours - 1.0).abs() <= AREA_AGREEMENT) {
            return Err(format!("an area of {}, we measure {ours}", face.area));
        }
    }
    // All cases are surfaces in one piece.
    if verdict.shells != 1 {
        return Err(format!("Open CASCADE finds {} shells, one was expected", verdict.shells));
    }
    // Written so that NaN is a disagreement, here and below.
    if !(verdict.kink <= case.kink) {
        return Err(format!("kinks of {:.1e} degrees, {:.1e} allowed", verdict.kink, case.kink));
    }
    let mut said = worst.check(verdict.faces.len())?;
    if case.kink < 180.0 {
        said += &format!(", kinks to {:.1e} degrees", verdict.kink);
    }
    if verdict.solids > 0 {
        let parts = model.surfaces.iter();
        let volume: f64 = parts.map(|s| s.surface.cone_volume(s.trim.as_ref(), DVec3::ZERO)).sum();
        let change = (verdict.volume / (volume * scale.powi(3)) - 1.0).abs();
        if !(change <= VOLUME_AGREEMENT) {
            return Err(format!("a volume of {}, we measure {volume}", verdict.volume));
        }
        said += &format!(", a solid, volume to {change:.1e}");
    }
    Ok(said)
}

/// The layers of a drawing without errors, in words.
fn judge_dxf(python: &Path, file: &Path) -> Outcome<String> {
    let said: Drawing = serde_json::from_str(&ask(python, "drawing.py", file)?)
        .map_err(|e| format!("the judge said: {e}"))?;
    if let Some(first) = said.errors.first() {
        return Err(format!("{} errors: {first}", said.errors.len()));
    }
    let layers = said.layers.iter().map(|(name, count)| format!("{count} on {name}"));
    Ok(layers.collect::<Vec<_>>().join(", "))
}

/// Largest differences, each relative to the largest value on its face.
#[derive(Default)]
struct Differences {
    point: f64,
    gaussian: f64,
    mean: f64,
    torsion: f64,
}

impl Differences {
    fn merge(&mut self, other: &Self) {
        self.point = self.point.max(other.point);
        self.gaussian = self.gaussian.max(other.gaussian);
        self.mean = self.mean.max(other.mean);
        self.torsion = self.torsion.max(other.torsion);
    }

    fn check(&self, faces: usize) -> Outcome<String> {
        let said = format!(
            "{faces} faces, points to {:.1e}, K to {:.1e}, H to {:.1e}, K + torsion² to {:.1e}",
            self.point, self.gaussian, self.mean, self.torsion
        );
        let worst = [self.point, self.gaussian, self.mean, self.torsion];
        // Written so that NaN is a disagreement.
        if worst.iter().all(|&d| d <= AGREEMENT) { Ok(said) } else { Err(said) }
    }
}

fn compare(
    face: &Face,
    surface: &BsplineSurface,
    scale: f64,
    asymptotic: bool,
) -> Outcome<Differences> {
    let mut found = Differences::default();
    let size = face.samples.iter().flat_map(|s| &s[2..5]).fold(0.0_f64, |m, x| m.max(x.abs()));
    let largest = |k: usize| face.samples.iter().fold(0.0_f64, |m, s| m.max(s[k].abs()));
    let (gaussian_size, mean_size) = (largest(5), largest(6));
    let relative =
        |difference: f64, size: f64| difference.abs() / if size > 0.0 { size } else { 1.0 };
    for &[u, v, x, y, z, gaussian, mean] in &face.samples {
        let jet = surface.jet(u, v, 3);
        let theirs = DVec3::new(x, y, z);
        found.point = found.point.max(relative((jet.position() * scale).distance(theirs), size));
        let our_gaussian = jet.gaussian_curvature().map_err(|e| e.to_string())? / (scale * scale);
        let our_mean = jet.mean_curvature().map_err(|e| e.to_string())? / scale;
        found.gaussian = found.gaussian.max(relative(our_gaussian - gaussian, gaussian_size));
        // The sign of H depends on the side a face is looked at from.
        found.mean = found.mean.max(relative(our_mean.abs() - mean.abs(), mean_size));
        if asymptotic {
            let [u0, u1, v0, v1] = face.domain;
            if let Some(torsion) = boundary_torsion(&jet, [u == u0 || u == u1, v == v0 || v == v1])
            {
                let want = -(torsion / scale).powi(2);
                found.torsion = found.torsion.max(relative(gaussian - want, gaussian_size));
            }
        }
    }
    Ok(found)
}

/// Torsion of the parameter line through a boundary point that runs along the boundary.
fn boundary_torsion(jet: &geom_core::SurfaceJet, [on_u, on_v]: [bool; 2]) -> Option<f64> {
    let derivatives = match (on_u, on_v) {
        (true, _) => [jet.d(0, 1), jet.d(0, 2), jet.d(0, 3)],
        (_, true) => [jet.d(1, 0), jet.d(2, 0), jet.d(3, 0)],
        _ => return None,
    };
    let [first, second, third] = derivatives;
    let binormal = first.cross(second);
    (binormal.length_squared() > 0.0).then(|| binormal.dot(third) / binormal.length_squared())
}
