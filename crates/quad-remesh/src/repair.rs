//! From any polygons to the triangles the method works on.

use std::collections::{BTreeMap, HashMap};

use geom_core::{DVec3, coinciding_points, faces_to_turn};

use crate::error::Error;
use crate::surface::{NONE, Surface, neighbours};
use crate::warning::Warning;

/// Points nearer than this share of the size are one.
const WELD: f64 = 1e-9;
/// Triangles with less area than this share of the square of their longest side are dropped.
const DEGENERATE: f64 = 1e-9;

/// What was mended, and the largest part of it.
#[derive(Clone, Debug)]
pub(crate) struct Repaired {
    pub(crate) surface: Surface,
    /// The given point each vertex stands on.
    pub(crate) sources: Vec<u32>,
    pub(crate) warnings: Vec<Warning>,
}

/// Welds, cuts polygons into triangles, drops what has no area, splits what is not manifold, orients
/// and keeps the part with the largest area.
pub(crate) fn repair<F: AsRef<[u32]>>(points: &[DVec3], faces: &[F]) -> Result<Repaired, Error> {
    let mut warnings = Vec::new();
    if let Some(vertex) = points.iter().position(|p| !p.is_finite()) {
        return Err(Error::NotFinite { vertex });
    }
    let low = points.iter().copied().reduce(DVec3::min).unwrap_or_default();
    let high = points.iter().copied().reduce(DVec3::max).unwrap_or_default();
    let heads = coinciding_points(points, WELD * (high - low).length());
    let mut triangles: Vec<[u32; 3]> = Vec::new();
    let mut dropped = 0;
    for face in faces {
        let mut corners: Vec<u32> = Vec::new();
        for &v in face.as_ref() {
            let head = *heads
                .get(v as usize)
                .ok_or(Error::NoSuchVertex { vertex: v as usize, count: points.len() })?;
            if corners.last() != Some(&head) {
                corners.push(head);
            }
        }
        if corners.len() > 1 && corners.first() == corners.last() {
            corners.pop();
        }
        let before = triangles.len();
        cut(points, &corners, &mut triangles);
        dropped += usize::from(triangles.len() == before);
    }
    let count = triangles.len();
    triangles.retain(|t| has_area(points, t));
    dropped += count - triangles.len();
    if triangles.is_empty() {
        return Err(Error::NoFace);
    }
    if dropped > 0 {
        warnings.push(Warning::Dropped { faces: dropped });
    }
    let repeated = drop_repeated(&mut triangles);
    if repeated > 0 {
        warnings.push(Warning::Repeated { faces: repeated });
    }
    let turned = faces_to_turn(&triangles);
    let count = turned.iter().filter(|t| **t).count();
    for (t, _) in triangles.iter_mut().zip(&turned).filter(|(_, turned)| **turned) {
        t.swap(1, 2);
    }
    if count > 0 {
        warnings.push(Warning::Turned { faces: count });
    }
    let Fans { triangles, sources, split } = split_vertices(&triangles)?;
    if split > 0 {
        warnings.push(Warning::Split { vertices: split });
    }
    let positions: Vec<DVec3> = sources.iter().map(|&v| points[v as usize]).collect();
    let Part { vertices, triangles, parts } = largest_part(&positions, triangles);
    let positions = vertices.iter().map(|&v| positions[v as usize]).collect();
    let sources = vertices.iter().map(|&v| sources[v as usize]).collect();
    if parts > 1 {
        warnings.push(Warning::Parts { parts });
    }
    Ok(Repaired { surface: Surface::new(positions, triangles), sources, warnings })
}

/// Cuts a polygon: a quad along its shorter diagonal, others as a fan from the corner that makes the
/// best worst triangle.
fn cut(points: &[DVec3], corners: &[u32], out: &mut Vec<[u32; 3]>) {
    let n = corners.len();
    if n < 3 {
        return;
    }
    let at = |k: usize| points[corners[k % n] as usize];
    let worst = |first: usize| {
        let areas = (1..n - 1).map(|k| {
            let (a, b, c) = (at(first), at(first + k), at(first + k + 1));
            let longest = (b - a).length_squared().max((c - b).length_squared());
            (b - a).cross(c - a).length() / longest.max((a - c).length_squared())
        });
        areas.fold(f64::INFINITY, f64::min)
    };
    let first = match n {
        4 if at(0).distance(at(2)) > at(1).distance(at(3)) => 1,
        3 | 4 => 0,
        _ => (0..n).fold(0, |best, k| if worst(k) > worst(best) { k } else { best }),
    };
    for k in 1..n - 1 {
        out.push([0, k, k + 1].map(|j| corners[(first + j) % n]));
    }
}

fn has_area(points: &[DVec3], t: &[u32; 3]) -> bool {
    let [a, b, c] = t.map(|v| points[v as usize]);
    let longest = (b - a).length_squared().max((c - b).length_squared());
    let longest = longest.max((a - c).length_squared());
    t[0] != t[1]
        && t[1] != t[2]
        && t[2] != t[0]
        && (b - a).cross(c - a).length() > DEGENERATE * longest
}

/// Of triangles on the same three vertices the first stays.
fn drop_repeated(triangles: &mut Vec<[u32; 3]>) -> usize {
    let before = triangles.len();
    let mut seen = std::collections::HashSet::new();
    triangles.retain(|t| {
        let mut key = *t;
        key.sort_unstable();
        seen.insert(key)
    });
    before - triangles.len()
}

/// Triangles whose every vertex has one fan.
struct Fans {
    triangles: Vec<[u32; 3]>,
    /// Of which vertex each new one is a copy.
    sources: Vec<u32>,
    /// How many copies there are.
    split: usize,
}

/// Gives every fan of triangles a vertex of its own: triangles are neighbours across edges of exactly
/// two that run along it in opposite directions.
fn split_vertices(triangles: &[[u32; 3]]) -> Result<Fans, Error> {
    let mut sides: BTreeMap<(u32, u32), Vec<u32>> = BTreeMap::new();
    for (f, t) in triangles.iter().enumerate() {
        for k in 0..3 {
            let (a, b) = (t[k], t[(k + 1) % 3]);
            sides.entry((a.min(b), a.max(b))).or_default().push((3 * f + k) as u32);
        }
    }
    // Corners that belong together, as a forest over 3 f + k.
    let mut parent: Vec<u32> = (0..3 * triangles.len() as u32).collect();
    fn find(parent: &mut [u32], mut a: u32) -> u32 {
        while parent[a as usize] != a {
            parent[a as usize] = parent[parent[a as usize] as usize];
            a = parent[a as usize];
        }
        a
    }
    let next = |i: u32| i / 3 * 3 + (i + 1) % 3;
    let corner = |i: u32| triangles[i as usize / 3][i as usize % 3];
    for list in sides.values() {
        let [i, j] = list[..] else { continue };
        if corner(i) == corner(j) {
            // Still the same way round: no way of turning faces makes these two agree.
            return Err(Error::OneSided { from: corner(i) as usize, to: corner(next(i)) as usize });
        }
        for (a, b) in [(i, next(j)), (next(i), j)] {
            let (a, b) = (find(&mut parent, a), find(&mut parent, b));
            parent[a.max(b) as usize] = a.min(b);
        }
    }
    let mut numbers: HashMap<u32, u32> = HashMap::new();
    let (mut out, mut sources) = (triangles.to_vec(), Vec::new());
    for i in 0..3 * triangles.len() as u32 {
        let root = find(&mut parent, i);
        let number = *numbers.entry(root).or_insert_with(|| {
            sources.push(corner(i));
            sources.len() as u32 - 1
        });
        out[i as usize / 3][i as usize % 3] = number;
    }
    let distinct: std::collections::HashSet<u32> = sources.iter().copied().collect();
    let split = sources.len() - distinct.len();
    Ok(Fans { triangles: out, sources, split })
}

/// Some of the triangles, their vertices numbered anew.
struct Part {
    /// The number each vertex had.
    vertices: Vec<u32>,
    triangles: Vec<[u32; 3]>,
    /// How many parts there are.
    parts: usize,
}

/// The edge-connected part with the largest area.
fn largest_part(points: &[DVec3], triangles: Vec<[u32; 3]>) -> Part {
    let across = neighbours(&triangles);
    let mut part = vec![NONE; triangles.len()];
    let mut areas: Vec<f64> = Vec::new();
    for start in 0..triangles.len() {
        if part[start] != NONE {
            continue;
        }
        let number = areas.len() as u32;
        part[start] = number;
        let (mut open, mut area) = (vec![start], 0.0);
        while let Some(f) = open.pop() {
            let [a, b, c] = triangles[f].map(|v| points[v as usize]);
            area += (b - a).cross(c - a).length();
            for g in across[f].into_iter().filter(|g| *g != NONE) {
                if part[g as usize] == NONE {
                    part[g as usize] = number;
                    open.push(g as usize);
                }
            }
        }
        areas.push(area);
    }
    let best = (0..areas.len()).fold(0, |best, k| if areas[k] > areas[best] { k } else { best });
    let mut numbers = vec![NONE; points.len()];
    let (mut kept, mut vertices) = (Vec::new(), Vec::new());
    for (t, _) in triangles.iter().zip(&part).filter(|(_, p)| **p == best as u32) {
        kept.push(t.map(|v| {
            if numbers[v as usize] == NONE {
                numbers[v as usize] = vertices.len() as u32;
                vertices.push(v);
            }
            numbers[v as usize]
        }));
    }
    Part { vertices, triangles: kept, parts: areas.len() }
}
