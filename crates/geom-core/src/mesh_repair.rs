//! Faces that only look apart, and faces that look the wrong way.

use glam::DVec3;
use std::collections::HashMap;

/// For every point the first one within `tolerance` of it, itself if there is none before it.
///
/// Chains do not add up: a point joins one that stands for itself.
///
/// # Example
/// ```
/// use geom_core::{DVec3, coinciding_points};
/// let points = [DVec3::ZERO, DVec3::X, DVec3::splat(1e-12), DVec3::X];
/// assert_eq!(coinciding_points(&points, 1e-9), [0, 1, 0, 1]);
/// ```
///
/// # Panics
/// If there are more points than `u32` can count.
#[must_use]
pub fn coinciding_points(points: &[DVec3], tolerance: f64) -> Vec<u32> {
    assert!(u32::try_from(points.len()).is_ok(), "points are counted by 32 bits");
    // Cells are much wider than the tolerance, so that few points look into a neighbour.
    let width = if tolerance > 0.0 { 64.0 * tolerance } else { f64::MIN_POSITIVE };
    let low = points.iter().copied().reduce(DVec3::min).unwrap_or_default();
    let cell = |p: DVec3| ((p - low) / width).floor().to_array().map(|x| x as i64);
    let mut heads: HashMap<[i64; 3], Vec<u32>> = HashMap::with_capacity(points.len());
    let mut out = Vec::with_capacity(points.len());
    for (k, &p) in points.iter().enumerate() {
        let (from, to) = (cell(p - tolerance), cell(p + tolerance));
        let mut found: Option<u32> = None;
        for x in from[0]..=to[0] {
            for y in from[1]..=to[1] {
                for z in from[2]..=to[2] {
                    let near = heads.get(&[x, y, z]).into_iter().flatten();
                    let near = near.filter(|&&i| points[i as usize].distance(p) <= tolerance);
                    found = near.copied().chain(found).min();
                }
            }
        }
        if found.is_none() {
            heads.entry(cell(p)).or_default().push(k as u32);
        }
        out.push(found.unwrap_or(k as u32));
    }
    out
}

/// Which faces to turn over so that neighbours run along their common edges in opposite directions.
///
/// In every connected part the fewer ones are turned. A part that cannot be oriented (a Möbius
/// strip) is left as it is; edges of three and more faces connect nothing.
///
/// # Example
/// ```
/// use geom_core::faces_to_turn;
/// // The second triangle runs from 1 to 2 as the first does.
/// assert_eq!(faces_to_turn(&[[0, 1, 2], [1, 2, 3], [1, 4, 3]]), [false, true, false]);
/// ```
#[must_use]
pub fn faces_to_turn<F: AsRef<[u32]>>(faces: &[F]) -> Vec<bool> {
    // Per edge its faces, and whether they run from the smaller to the larger number.
    let mut edges: HashMap<(u32, u32), Vec<(u32, bool)>> = HashMap::new();
    for (f, face) in faces.iter().enumerate() {
        for (a, b) in sides(face.as_ref()) {
            edges.entry((a.min(b), a.max(b))).or_default().push((f as u32, a < b));
        }
    }
    let mut turned: Vec<Option<bool>> = vec![None; faces.len()];
    let mut out = vec![false; faces.len()];
    for first in 0..faces.len() {
        if turned[first].is_some() {
            continue;
        }
        turned[first] = Some(false);
        let mut part = vec![first];
        let (mut at, mut sound) = (0, true);
        while at < part.len() {
            let f = part[at];
            at += 1;
            let own = turned[f].unwrap_or(false);
            for (a, b) in sides(faces[f].as_ref()) {
                let [one, two] = edges[&(a.min(b), a.max(b))][..] else { continue };
                let ((_, mine), (other, theirs)) =
                    if one.0 as usize == f { (one, two) } else { (two, one) };
                let wanted = own ^ (mine == theirs);
                match turned[other as usize] {
                    None => {
                        turned[other as usize] = Some(wanted);
                        part.push(other as usize);
                    }
                    Some(now) => sound &= now == wanted || other as usize == f,
                }
            }
        }
        let count = part.iter().filter(|&&f| turned[f] == Some(true)).count();
        if sound && count > 0 {
            let fewer = 2 * count <= part.len();
            part.iter().for_each(|&f| out[f] = (turned[f] == Some(true)) == fewer);
        }
    }
    out
}

fn sides(face: &[u32]) -> impl Iterator<Item = (u32, u32)> + '_ {
    (0..face.len()).map(|k| (face[k], face[(k + 1) % face.len()]))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn points_on_both_sides_of_a_cell_wall_coincide() {
        let points: Vec<DVec3> = (0..300)
            .map(|k| DVec3::new(f64::from(k / 2) * 0.37, f64::from(k % 2) * 9e-10, 5.0))
            .collect();
        let heads = coinciding_points(&points, 1e-9);
        assert!((0..300).all(|k| heads[k] == (k - k % 2) as u32), "{heads:?}");
        assert_eq!(coinciding_points(&points, 1e-12), (0..300).collect::<Vec<u32>>());
        assert_eq!(coinciding_points(&[DVec3::ONE; 3], 0.0), [0, 0, 0]);
        assert_eq!(coinciding_points(&[], 1.0), Vec::<u32>::new());
    }

    #[test]
    fn the_fewer_faces_are_turned_in_every_part() {
        let strip = |flip: &[usize], first: u32| -> Vec<[u32; 4]> {
            (0..5)
                .map(|k| {
                    let [a, b, c, d] = [0, 2, 3, 1].map(|i| first + 2 * k + i);
                    if flip.contains(&(k as usize)) { [a, d, c, b] } else { [a, b, c, d] }
                })
                .collect()
        };
        let faces = [strip(&[1, 4], 0), strip(&[0, 1, 2], 100)].concat();
        let turned: Vec<usize> =
            faces_to_turn(&faces).iter().enumerate().filter(|(_, t)| **t).map(|(k, _)| k).collect();
        assert_eq!(turned, [1, 4, 8, 9]);
        // A strip of three quads with a half turn.
        let moebius = [[0, 2, 3, 1], [2, 4, 5, 3], [4, 1, 0, 5]];
        assert_eq!(faces_to_turn(&moebius), [false; 3]);
        // Three faces on one edge tell nothing.
        assert_eq!(faces_to_turn(&[[0, 1, 2], [0, 1, 3], [0, 1, 4]]), [false; 3]);
    }
}
