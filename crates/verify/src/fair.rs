//! Claims of `fair`: the written control mesh, its plain limit, and the energies where it is a
//! regular grid.

use crate::catmull_clark::Subdivision;
use crate::claims::{Claims, Values};
use crate::content::{Mesh, centroid};
use crate::edges::{Edges, Side};
use crate::quadrature::{gauss, piecewise};
use crate::shape::Shape;
use crate::spline::Spline;
use glam::DVec3;
use rayon::prelude::*;

/// Points per side of a bicubic patch, as the program's normal rule has.
const NODES: usize = 8;
/// Points per knot span of a written patch of few breaks, and of one of many.
const SPAN_NODES: [usize; 2] = [10, 4];
/// Breaks of a patch of few, at most.
const FEW_BREAKS: usize = 3;
/// What the root is regularised with, over the area, see the functional `sqrt`.
const ROOT_EPSILON: f64 = 1e-3;
/// Share of `|II|²` by which directions fade at umbilics, see the functional `mvs`.
const UMBILIC_SHARE: f64 = 1e-6;
/// Refinements of the plain limit.
const LEVELS: usize = 4;
/// Faces of the finest level.
const MOST_FACES: usize = 40_000;

pub(crate) fn recompute(mesh: &Mesh, claims: &Claims<'_>, values: &mut Values) {
    let Some(edges) = Edges::new(&mesh.faces, mesh.positions.len()) else { return };
    if !mesh.faces.iter().all(|f| f.len() == 4) {
        return;
    }
    values.count("vertices", mesh.positions.len());
    values.count("patches", mesh.faces.len());
    if let Some(centre) = centroid(mesh.positions.iter().copied()) {
        values.place("vertex_centroid", centre);
    }
    if let Some(rings) = claims.count("plain_rings") {
        let grids = plain_grids(mesh, &edges, rings);
        values.count("plain_patches", grids.len());
        if !grids.is_empty() {
            plain_energies(&mesh.positions, &grids, values);
        }
    }
    let levels = (0..=LEVELS).rev().find(|l| mesh.faces.len() << (2 * l) <= MOST_FACES);
    // Sharp edges are not in the file, and a clamped border is not counted.
    if let (Some(levels), Some("none"), Some("all")) =
        (levels, claims.text("creases"), claims.text("energies_of"))
    {
        let area = Subdivision::new(&mesh.positions, &mesh.faces).limit_area(levels);
        values.number("energies.area", area);
    }
}

/// The 16 control points around every face that has no vertex on the border or of another valence
/// than 4 within `rings` rings of faces.
fn plain_grids(mesh: &Mesh, edges: &Edges, rings: usize) -> Vec<[usize; 16]> {
    let is_special = |v: usize| edges.on_border[v] || edges.valence[v] != 4;
    let mut reached: Vec<bool> = (0..mesh.positions.len()).map(is_special).collect();
    let mut is_plain = vec![true; mesh.faces.len()];
    for _ in 0..rings.max(1) {
        let touched: Vec<usize> = (0..mesh.faces.len())
            .filter(|f| is_plain[*f] && mesh.faces[*f].iter().any(|v| reached[*v]))
            .collect();
        for f in touched {
            is_plain[f] = false;
            mesh.faces[f].iter().for_each(|v| reached[*v] = true);
        }
    }
    let mut sides: std::collections::BTreeMap<(usize, usize), Side> = Default::default();
    for (face, corners) in mesh.faces.iter().enumerate() {
        for k in 0..4 {
            sides.insert((corners[k], corners[(k + 1) % 4]), Side { face, k });
        }
    }
    let grid = |f: usize| -> Option<[usize; 16]> {
        let corner = |side: Side, k: usize| mesh.faces[side.face][(side.k + k) % 4];
        let across = |a: usize, b: usize| sides.get(&(b, a)).copied();
        // Corners 0 to 3 stand at (0,0), (1,0), (1,1), (0,1); the grid starts at (−1, −1).
        let mut out = [usize::MAX; 16];
        let places = [(1, 1), (2, 1), (2, 2), (1, 2)];
        let steps = [(0_i32, -1_i32), (1, 0), (0, 1), (-1, 0)];
        let at = |(i, j): (i32, i32)| (4 * i + j) as usize;
        for k in 0..4 {
            let side = Side { face: f, k };
            let (a, b) = (corner(side, 0), corner(side, 1));
            out[at(places[k])] = a;
            let beyond = across(a, b)?;
            // Beyond the side from b to a: its corners go on behind a and come back at b.
            let (d, c) = (corner(beyond, 2), corner(beyond, 3));
            let step = steps[k];
            let shifted = |(i, j): (i32, i32), (x, y): (i32, i32)| (i + x, j + y);
            out[at(shifted(places[k], step))] = d;
            out[at(shifted(places[(k + 1) % 4], step))] = c;
            // The corner of the grid: the next face around a goes from beyond a to a and on.
            let diagonal = corner(across(a, d)?, 3);
            let before = steps[(k + 3) % 4];
            let place = shifted(shifted(places[k], step), before);
            out[at(place)] = diagonal;
        }
        out.iter().all(|v| *v != usize::MAX).then_some(out)
    };
    (0..mesh.faces.len()).filter(|f| is_plain[*f]).filter_map(grid).collect()
}

/// Integrals over one patch.
#[derive(Clone, Default)]
struct Sums {
    area: f64,
    mean: f64,
    gaussian: f64,
    bending: f64,
    f1: f64,
    f3: f64,
    mvs: f64,
    mvs_cross: f64,
    /// `(F1² + F3²)` at every node with its weight: the root needs the whole area first.
    roots: Vec<(f64, f64)>,
}

/// Claims of the spline patches that stand for the surface in files for CAD.
pub(crate) fn recompute_patches(patches: &[Spline], claims: &Claims<'_>, values: &mut Values) {
    // A clamped border is not counted, and the file does not say where it is.
    if claims.text("energies_of") != Some("all") {
        return;
    }
    let rule = |s: &Spline, k: usize| {
        let breaks = s.breaks(k);
        piecewise(SPAN_NODES[usize::from(breaks.len() > FEW_BREAKS)], &breaks)
    };
    let sums = patches.par_iter().map(|s| sums(s, [rule(s, 0), rule(s, 1)]));
    energies(&sums.collect::<Vec<_>>(), "written_energies", values);
}

/// Energies of the faces that are plain bicubic patches.
fn plain_energies(positions: &[DVec3], grids: &[[usize; 16]], values: &mut Values) {
    let rule = gauss(NODES);
    let patch = |grid: &[usize; 16]| match Spline::uniform_bicubic(&grid.map(|v| positions[v])) {
        Ok(surface) => sums(&surface, [rule.clone(), rule.clone()]),
        Err(_) => Sums::default(),
    };
    energies(&grids.par_iter().map(patch).collect::<Vec<_>>(), "plain_energies", values);
}

/// Integrals over a surface by a rule in each direction.
fn sums(surface: &Spline, rules: [Vec<(f64, f64)>; 2]) -> Sums {
    let [us, vs] = [0, 1].map(|k| {
        let nodes: Vec<f64> = rules[k].iter().map(|(x, _)| *x).collect();
        surface.ready(k, &nodes, 3)
    });
    let mut sums = Sums::default();
    for (u, (_, w)) in us.iter().zip(&rules[0]) {
        surface.row(u, &vs, |j, jet| {
            let shape = Shape::new(jet);
            if !shape.mean.is_finite() {
                // A singular point, which has no area.
                return;
            }
            let weight = w * rules[1][j].1 * shape.delta.sqrt();
            let ([l, m, n], [a, b, c, d]) = shape.cubic(jet);
            // κₙ'(θ) as a cubic form has the harmonics cos θ, sin θ, cos 3θ, sin 3θ.
            let (c1, s1) = (0.75 * (a + c), 0.75 * (b + d));
            let (c3, s3) = (0.25 * (a - 3.0 * c), 0.25 * (3.0 * b - d));
            let (f1, f3) = (c1 * c1 + s1 * s1, c3 * c3 + s3 * s3);
            // Twice the angle of the first principal direction.
            let (cos, sin) = (0.5 * (l - n), m);
            let r = cos * cos + sin * sin;
            let second = l * l + 2.0 * m * m + n * n;
            let guarded = r + UMBILIC_SHARE * second;
            // cos 4φ and sin 4φ, faded at umbilics.
            let (cos4, sin4) = if guarded > 0.0 {
                ((cos * cos - sin * sin) / guarded, 2.0 * cos * sin / guarded)
            } else {
                (0.0, 0.0)
            };
            // Re((c1 − i s1)(c3 − i s3) e^{4iφ}).
            let (re, im) = (c1 * c3 - s1 * s3, -(c1 * s3 + s1 * c3));
            let coupling = re * cos4 - im * sin4;
            sums.area += weight;
            sums.mean += weight * shape.mean;
            sums.gaussian += weight * shape.gaussian;
            sums.bending += weight * second;
            sums.f1 += weight * f1;
            sums.f3 += weight * f3;
            sums.mvs += weight * (f1 + f3 + 2.0 * coupling);
            sums.mvs_cross += weight * (10.0 / 9.0 * f1 + 2.0 * f3 + 4.0 / 3.0 * coupling);
            sums.roots.push((weight, f1 + f3));
        });
    }
    sums
}

/// All functionals, below a key.
fn energies(all: &[Sums], key: &str, values: &mut Values) {
    let sum = |f: fn(&Sums) -> f64| all.iter().map(f).sum::<f64>();
    let area = sum(|s| s.area);
    let (f1, f3) = (sum(|s| s.f1), sum(|s| s.f3));
    let (bending, gaussian) = (sum(|s| s.bending), sum(|s| s.gaussian));
    let epsilon = ROOT_EPSILON / area;
    let roots = all.iter().flat_map(|s| &s.roots);
    let root: f64 = roots.map(|(w, square)| w * (square + epsilon * epsilon).sqrt()).sum();
    let scaled = [
        ("area", area),
        ("mean_curvature", sum(|s| s.mean)),
        ("gaussian", gaussian),
        ("bending", bending),
        // H² = (|II|² + 2 K)/4 and (κ₁ − κ₂)² = |II|² − 2 K.
        ("willmore", 0.25 * bending + 0.5 * gaussian),
        ("umbilic_deviation", bending - 2.0 * gaussian),
        ("mvs", area * sum(|s| s.mvs)),
        ("mvs_cross", area * sum(|s| s.mvs_cross)),
        ("f1", area * 0.5 * f1),
        ("f3", area * 0.5 * f3),
        ("mehlum_tarrou", area * 0.5 * (f1 + f3)),
        ("cross_curvature", area * 0.5 * (f1 / 9.0 + f3)),
        ("average_derivative", area * (0.25 * 10.0 / 9.0 * f1 + 0.5 * f3)),
        ("sqrt", root),
    ];
    for (name, value) in scaled {
        values.number(&format!("{key}.{name}"), value);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    /// A torus of `n × n` quads.
    fn torus(n: usize) -> Mesh {
        let mut mesh = Mesh::default();
        for i in 0..n {
            for j in 0..n {
                let turn = std::f64::consts::TAU / n as f64;
                let ((su, cu), (sv, cv)) =
                    ((turn * i as f64).sin_cos(), (turn * j as f64).sin_cos());
                let radius = 3.0 + cv;
                mesh.positions.push(DVec3::new(radius * cu, radius * su, sv));
                let at = |i: usize, j: usize| (i % n) * n + j % n;
                mesh.faces.push(vec![at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)]);
            }
        }
        mesh
    }

    #[test]
    fn a_regular_torus_is_plain_everywhere() {
        let metrics = json!({"plain_rings": 1, "creases": "none", "energies_of": "all"});
        let mut values = Values::default();
        recompute(&torus(40), &Claims::new(&metrics), &mut values);
        let get = |key: &str| values.get(key).unwrap();
        assert_eq!(get("plain_patches"), 1600.0);
        // 4π² R r = 118.44, a little less on the shrunk limit of the mesh; ∫K = 0.
        assert!((get("plain_energies.area") / 118.435 - 1.0).abs() < 0.02);
        assert!(get("plain_energies.gaussian").abs() < 1e-11);
        assert!((get("energies.area") / get("plain_energies.area") - 1.0).abs() < 1e-4);
        let willmore = get("plain_energies.willmore");
        // 2π² R²/(r √(R² − r²)) / 2 for H = (κ₁ + κ₂)/2: π² · 9/√8.
        let want = std::f64::consts::PI.powi(2) * 9.0 / 8.0_f64.sqrt();
        assert!((willmore / want - 1.0).abs() < 0.01, "{willmore} {want}");
        assert!(get("vertex_centroid.0").abs() < 1e-14);
    }

    #[test]
    fn faces_near_a_border_are_not_plain() {
        let mut mesh = torus(12);
        mesh.faces.truncate(12 * 9);
        let metrics = json!({"plain_rings": 2});
        let mut values = Values::default();
        recompute(&mesh, &Claims::new(&metrics), &mut values);
        // Nine strips, two of them off at either end.
        assert_eq!(values.get("plain_patches"), Some(60.0));
    }
}
