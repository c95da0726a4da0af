//! Where the principal directions turn around a point, and how it is put right.

use std::f64::consts::{PI, TAU};

use crate::field::Field;
use crate::refine::refine;
use crate::surface::{NONE, Surface};

/// Rounds of filling until no point of positive index is left.
const ROUNDS: usize = 8;
/// Discs of a fill grow from this many edge lengths by this factor, up to the last.
const FIRST_DISC: f64 = 0.8;
const DISC_GROWTH: f64 = 1.4;
const LAST_DISC: f64 = 4.0;
/// Singular points nearer than this many edge lengths are one.
const CLUSTER: f64 = 1.0;
/// A vertex around which the plane turns `4 + 2 m` quarters has at least `3 (m + 2)` triangles, if it
/// is not as ordinary as `m = 1`.
const TRIANGLES_PER_HALF_TURN: usize = 3;

/// Triangles are halved within this many edge lengths of a vertex with many turns.
const OPENED: f64 = 0.4;

/// How directions go from triangle to triangle.
#[derive(Clone, Debug)]
pub(crate) struct Matching {
    /// Whether the direction of the larger curvature, taken across a side, meets the neighbour's own
    /// or its opposite: `1` or `−1`.
    pub(crate) signs: Vec<[i8; 3]>,
    /// The angle left between the two.
    left: Vec<[f64; 3]>,
}

impl Matching {
    pub(crate) fn new(surface: &Surface, field: &Field) -> Self {
        let angles: Vec<f64> =
            (0..surface.triangles.len()).map(|f| field.principal_angle(f)).collect();
        let (mut signs, mut left) = (Vec::new(), Vec::new());
        for f in 0..surface.triangles.len() {
            let (mut sign, mut rest) = ([1_i8; 3], [0.0; 3]);
            for k in 0..3 {
                let g = surface.across[f][k];
                // Each side is looked at once, so that both of its triangles agree even at 90 degrees.
                if g != NONE && (g as usize) > f {
                    let d = angles[f] + surface.turn(f, k) - angles[g as usize];
                    let halves = (d / PI).round();
                    sign[k] = if halves.rem_euclid(2.0) == 0.0 { 1 } else { -1 };
                    rest[k] = d - halves * PI;
                }
            }
            signs.push(sign);
            left.push(rest);
        }
        for f in 0..surface.triangles.len() {
            for k in 0..3 {
                let g = surface.across[f][k];
                if g != NONE && (g as usize) < f {
                    let l = surface.same_side(f, k, g as usize);
                    signs[f][k] = signs[g as usize][l];
                    left[f][k] = -left[g as usize][l];
                }
            }
        }
        Self { signs, left }
    }

    /// Twice the index of the directions at an inner vertex: −1 at an ordinary flat point.
    pub(crate) fn twice_index(&self, surface: &Surface, v: usize) -> i32 {
        let (mut defect, mut turned) = (TAU, 0.0);
        for &(f, k) in surface.star(v) {
            let (f, k) = (f as usize, k as usize);
            let p = surface.corners(f);
            let (a, b) = (p[(k + 1) % 3] - p[k], p[(k + 2) % 3] - p[k]);
            defect -= a.cross(b).length().atan2(a.dot(b));
            turned += self.left[f][(k + 2) % 3];
        }
        ((defect - turned) / PI).round() as i32
    }
}

/// A vertex around which directions turn.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Singular {
    pub(crate) vertex: usize,
    /// `−m` for a vertex of valence `4 + 2 m`.
    pub(crate) twice_index: i32,
}

/// All singular vertices, in rising order.
pub(crate) fn singular_vertices(surface: &Surface, matching: &Matching) -> Vec<Singular> {
    let inner = (0..surface.positions.len())
        .filter(|&v| !surface.on_border[v] && !surface.star(v).is_empty());
    inner
        .map(|vertex| Singular { vertex, twice_index: matching.twice_index(surface, vertex) })
        .filter(|s| s.twice_index != 0)
        .collect()
}

/// Puts the field right: points of positive index, which no negatively curved surface has, are
/// cancelled against negative ones near by, and clusters of negative ones become one vertex each.
///
/// Everything is local: discs around these points get a harmonic field, the rest keeps its own.
pub(crate) fn settle(surface: &mut Surface, field: &mut Field, edge: f64) {
    cancel(surface, field, edge);
    let found = singular_vertices(surface, &Matching::new(surface, field));
    for cluster in clusters(surface, &found, CLUSTER * edge) {
        merge(surface, field, &found, &cluster, edge);
    }
    // A merge near another cluster may have stirred it.
    cancel(surface, field, edge);
    let found = singular_vertices(surface, &Matching::new(surface, field));
    for s in found {
        open_star(surface, field, s.vertex, s.twice_index, OPENED * edge);
    }
}

/// Gives a vertex enough triangles for its turns, since more than a quarter turn of the directions
/// from one to the next could not be told from less, and the triangles around it as many.
fn open_star(surface: &mut Surface, field: &mut Field, v: usize, twice_index: i32, radius: f64) {
    let wanted = TRIANGLES_PER_HALF_TURN * (2 + twice_index.unsigned_abs() as usize);
    if twice_index >= -1 || surface.star(v).len() >= wanted {
        return;
    }
    while surface.star(v).len() < wanted {
        let opposite = surface.star(v).iter().map(|&(f, k)| (f, (k + 1) % 3)).collect::<Vec<_>>();
        refine(surface, field, &opposite);
    }
    let disc = surface.disc(v, radius);
    let sides: Vec<(u32, u8)> = disc.iter().flat_map(|&f| [(f, 0), (f, 1), (f, 2)]).collect();
    refine(surface, field, &sides);
}

fn cancel(surface: &Surface, field: &mut Field, edge: f64) {
    let mut radius = FIRST_DISC * edge;
    for _ in 0..ROUNDS {
        let found = singular_vertices(surface, &Matching::new(surface, field));
        let positive: Vec<usize> =
            found.iter().filter(|s| s.twice_index > 0).map(|s| s.vertex).collect();
        if positive.is_empty() {
            return;
        }
        for v in positive {
            // The smallest disc whose points do not add up to a positive index.
            let mut size = radius;
            while size < LAST_DISC * edge && sum_of_indices(surface, &found, v, size) > 0 {
                size *= DISC_GROWTH;
            }
            let disc = surface.disc(v, size);
            field.fill(surface, &disc, v, 0);
        }
        radius *= DISC_GROWTH;
    }
}

fn sum_of_indices(surface: &Surface, found: &[Singular], v: usize, radius: f64) -> i32 {
    let near = |s: &&Singular| surface.positions[s.vertex].distance(surface.positions[v]) < radius;
    found.iter().filter(near).map(|s| s.twice_index).sum()
}

/// Groups of at least two points in which each is near another.
fn clusters(surface: &Surface, found: &[Singular], distance: f64) -> Vec<Vec<usize>> {
    let mut group: Vec<usize> = (0..found.len()).collect();
    let at = |k: usize| surface.positions[found[k].vertex];
    for i in 0..found.len() {
        for j in 0..i {
            if at(i).distance(at(j)) < distance && group[i] != group[j] {
                let (from, to) = (group[i].max(group[j]), group[i].min(group[j]));
                group.iter_mut().filter(|g| **g == from).for_each(|g| *g = to);
            }
        }
    }
    let members = |g: usize| (0..found.len()).filter(|&k| group[k] == g).collect::<Vec<_>>();
    (0..found.len()).map(members).filter(|m| m.len() > 1).collect()
}

/// Makes one vertex of a cluster, if a disc around it holds neither a border nor a handle nor
/// another singular point.
fn merge(
    surface: &mut Surface,
    field: &mut Field,
    found: &[Singular],
    cluster: &[usize],
    edge: f64,
) -> bool {
    let points = cluster.iter().map(|&k| surface.positions[found[k].vertex]);
    let middle = points.clone().sum::<geom_core::DVec3>() / cluster.len() as f64;
    let reach = points.map(|p| p.distance(middle)).fold(0.0, f64::max);
    // The vertex nearest to the middle, sought around one of the points.
    let first = found[cluster[0]].vertex;
    let near = surface.disc(first, 2.0 * reach + 0.5 * edge);
    let corners = near.iter().flat_map(|&f| surface.triangles[f as usize]);
    let nearest = corners.map(|v| v as usize).min_by(|&a, &b| {
        let away = |v: usize| surface.positions[v].distance_squared(middle);
        away(a).total_cmp(&away(b)).then(a.cmp(&b))
    });
    let Some(centre) = nearest else { return false };
    let radius = reach + 0.75 * edge;
    let disc = surface.disc(centre, radius);
    if !is_disc(surface, &disc) {
        return false;
    }
    let inside: std::collections::BTreeSet<u32> =
        disc.iter().flat_map(|&f| surface.triangles[f as usize]).collect();
    let held: Vec<&Singular> =
        found.iter().filter(|s| inside.contains(&(s.vertex as u32))).collect();
    if held.len() != cluster.len() {
        return false;
    }
    let turns: i32 = held.iter().map(|s| s.twice_index).sum();
    open_star(surface, field, centre, turns, OPENED * edge);
    let disc = surface.disc(centre, radius);
    let inside: std::collections::BTreeSet<u32> =
        disc.iter().flat_map(|&f| surface.triangles[f as usize]).collect();
    let before = (field.mean.clone(), field.deviator.clone());
    if turns >= 0 || !field.fill(surface, &disc, centre, -turns) {
        return false;
    }
    // Only what is as foreseen stays.
    let matching = Matching::new(surface, field);
    let sound = inside.iter().all(|&v| {
        let v = v as usize;
        let wanted = if v == centre { turns } else { 0 };
        surface.on_border[v] || matching.twice_index(surface, v) == wanted
    });
    if !sound {
        (field.mean, field.deviator) = before;
    }
    sound
}

/// Whether triangles form a disc away from the border.
fn is_disc(surface: &Surface, disc: &[u32]) -> bool {
    let mut vertices: Vec<u32> = disc.iter().flat_map(|&f| surface.triangles[f as usize]).collect();
    vertices.sort_unstable();
    vertices.dedup();
    if vertices.iter().any(|&v| surface.on_border[v as usize]) {
        return false;
    }
    let mut inner = 0;
    for &f in disc {
        let across = surface.across[f as usize];
        inner += across.iter().filter(|g| disc.binary_search(g).is_ok()).count();
    }
    let edges = 3 * disc.len() - inner / 2;
    vertices.len() + disc.len() == edges + 1
}
