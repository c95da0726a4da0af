//! Claims of `hnet`: a net of rational bilinear patches, planar stars, kinks along edges.

use crate::claims::Values;
use crate::content::Content;
use crate::edges::{Edges, Side};
use crate::shape::angle_deg;
use crate::spline::Spline;
use glam::DVec3;

/// Points of an edge at which kinks are taken, ends included.
const SAMPLES: usize = 11;
/// Shape parameters this close count as one mold.
const SAME_SHAPE: f64 = 1e-3;

/// Quads with their shape parameters, if the file has them.
struct Net {
    positions: Vec<DVec3>,
    quads: Vec<Vec<usize>>,
    shape: Vec<f64>,
}

pub(crate) fn recompute(content: &Content, values: &mut Values) {
    let Some(net) = net_of(content) else { return };
    let Some(edges) = Edges::new(&net.quads, net.positions.len()) else { return };
    values.count("faces", net.quads.len());
    values.count("vertices", net.positions.len());
    let inner = |v: &usize| !edges.on_border[*v] && edges.valence[*v] > 0;
    let count = |odd: bool| {
        let is_one = |v: &usize| {
            let n = edges.valence[*v];
            if odd { n % 2 == 1 } else { n != 4 }
        };
        (0..net.positions.len()).filter(inner).filter(is_one).count()
    };
    values.count("irregular_vertices", count(false));
    values.count("odd_valence_vertices", count(true));
    values.number("star_planarity_max", star_planarity(&net.positions, &edges));
    let seams: Vec<[Side; 2]> =
        edges.list.iter().filter_map(|e| Some([e.first, e.second?])).collect();
    values.count("folds", seams.iter().filter(|sides| net.is_folded(**sides)).count());
    if net.shape.is_empty() {
        return;
    }
    let kinks: Vec<f64> = seams.iter().map(|sides| net.kink_deg(*sides)).collect();
    values.number("kink_max_deg", kinks.iter().copied().fold(0.0, f64::max));
    values.number("kink_mean_deg", kinks.iter().sum::<f64>() / kinks.len().max(1) as f64);
    values.number("shape_parameter_min", net.shape.iter().copied().fold(f64::INFINITY, f64::min));
    values.number("shape_parameter_max", net.shape.iter().copied().fold(0.0, f64::max));
    values.count("shape_parameters_distinct", distinct(&net.shape));
}

impl Net {
    /// The corners of a face from that of a side on, and their weights `1, 1, W, 1` likewise.
    fn turned(&self, side: Side) -> ([DVec3; 4], [f64; 4]) {
        let at = |k: usize| (side.k + k) % 4;
        let corners = [0, 1, 2, 3].map(|k| self.positions[self.quads[side.face][at(k)]]);
        let weights = [0, 1, 2, 3].map(|k| if at(k) == 2 { self.shape[side.face] } else { 1.0 });
        (corners, weights)
    }

    /// The normal of a patch at the share `t` of the length of a side: the side crossed with the
    /// ruling that leaves it there, both straight lines of the patch.
    fn normal(&self, side: Side, t: f64) -> DVec3 {
        let ([a, b, c, d], [wa, wb, wc, wd]) = self.turned(side);
        // The parameter that belongs to the share of the length.
        let (start, end) = ((1.0 - t) * wb, t * wa);
        let p = a.lerp(b, t);
        let q = (start * wd * d + end * wc * c) / (start * wd + end * wc);
        (b - a).cross(q - p)
    }

    fn kink_deg(&self, [first, second]: [Side; 2]) -> f64 {
        (0..SAMPLES)
            .map(|k| {
                let t = k as f64 / (SAMPLES - 1) as f64;
                // The second face runs along the edge the other way.
                angle_deg(self.normal(first, t), self.normal(second, 1.0 - t))
            })
            .fold(0.0, f64::max)
    }

    /// Whether the neighbours of an end of the edge lie on the same side of it.
    fn is_folded(&self, [first, second]: [Side; 2]) -> bool {
        let corner = |side: Side, k: usize| self.positions[self.quads[side.face][(side.k + k) % 4]];
        let (a, b) = (corner(first, 0), corner(first, 1));
        let edge = b - a;
        let same =
            |end: DVec3, p: DVec3, q: DVec3| edge.cross(p - end).dot(edge.cross(q - end)) >= 0.0;
        same(a, corner(first, 3), corner(second, 2)) || same(b, corner(first, 2), corner(second, 3))
    }
}

fn net_of(content: &Content) -> Option<Net> {
    if let Some(mesh) = content.mesh() {
        let shape = content.shape_parameters.clone();
        let is_whole = mesh.faces.iter().all(|f| f.len() == 4)
            && (shape.is_empty() || shape.len() == mesh.faces.len());
        let net = Net { positions: mesh.positions.clone(), quads: mesh.faces.clone(), shape };
        return is_whole.then_some(net);
    }
    patches(&content.surfaces)
}

/// Bilinear patches with common corners put together.
fn patches(surfaces: &[Spline]) -> Option<Net> {
    let mut net = Net { positions: Vec::new(), quads: Vec::new(), shape: Vec::new() };
    let mut seen: std::collections::BTreeMap<[u64; 3], usize> = std::collections::BTreeMap::new();
    for s in surfaces {
        if s.degree() != [1, 1] || s.counts() != [2, 2] {
            return None;
        }
        let [a, b, c, d] = [(0, 0), (1, 0), (1, 1), (0, 1)].map(|(i, j)| s.control_point(i, j));
        let quad = [a, b, c, d].map(|(p, _)| {
            // Adding zero makes one zero of the two.
            let bits = (p + DVec3::ZERO).to_array().map(f64::to_bits);
            *seen.entry(bits).or_insert_with(|| {
                net.positions.push(p);
                net.positions.len() - 1
            })
        });
        net.quads.push(quad.to_vec());
        net.shape.push((a.1 / b.1) * (c.1 / d.1));
    }
    (!net.quads.is_empty()).then_some(net)
}

/// Largest distance of a vertex or a neighbour from the best plane of its star, in mean edge
/// lengths.
fn star_planarity(positions: &[DVec3], edges: &Edges) -> f64 {
    let length = edges.mean_length(positions);
    let star = |(v, ring): (usize, Vec<usize>)| {
        if ring.len() < 3 {
            return 0.0;
        }
        let mut points: Vec<DVec3> = ring.iter().map(|w| positions[*w]).collect();
        points.push(positions[v]);
        let centre = points.iter().sum::<DVec3>() / points.len() as f64;
        points.iter_mut().for_each(|p| *p -= centre);
        let normal = least_axis(&points);
        points.iter().map(|p| p.dot(normal).abs()).fold(0.0, f64::max) / length
    };
    edges.neighbours().into_iter().enumerate().map(star).fold(0.0, f64::max)
}

/// The unit vector along which the sum of squares is least: inverse iteration on the covariance,
/// from the normal of the largest pair of points.
fn least_axis(points: &[DVec3]) -> DVec3 {
    let mut start = DVec3::Z;
    let mut largest = 0.0;
    for (k, p) in points.iter().enumerate() {
        for q in &points[..k] {
            let cross = p.cross(*q);
            if cross.length_squared() > largest {
                (largest, start) = (cross.length_squared(), cross);
            }
        }
    }
    let mut axis = start.normalize();
    let size = points.iter().map(|p| p.length_squared()).sum::<f64>();
    for _ in 0..50 {
        // A frame with the axis third; the covariance of the other two is well conditioned there.
        let x = axis.any_orthonormal_vector();
        let y = axis.cross(x);
        let sum = |f: &dyn Fn(&DVec3) -> f64| points.iter().map(f).sum::<f64>();
        let (xx, xy, yy) = (
            sum(&|p| p.dot(x) * p.dot(x)),
            sum(&|p| p.dot(x) * p.dot(y)),
            sum(&|p| p.dot(y) * p.dot(y)),
        );
        let (xz, yz) = (sum(&|p| p.dot(x) * p.dot(axis)), sum(&|p| p.dot(y) * p.dot(axis)));
        let zz = sum(&|p| p.dot(axis) * p.dot(axis));
        // The slopes of the plane that goes with the least eigenvalue, one Newton step each.
        let (a, b) = (xx - zz, yy - zz);
        let det = a * b - xy * xy;
        if !(det.abs() > 1e-30 * size * size) {
            break;
        }
        let step = ((xz * b - xy * yz) / det) * x + ((yz * a - xy * xz) / det) * y;
        axis = (axis - step).normalize();
        if step.length() < 1e-15 {
            break;
        }
    }
    axis
}

/// Different parameters; `W` and `1/W` are one panel seen along its two diagonals.
fn distinct(shape: &[f64]) -> usize {
    let mut logs: Vec<f64> = shape.iter().map(|w| w.ln().abs()).collect();
    logs.sort_by(f64::total_cmp);
    let mut first = f64::NEG_INFINITY;
    let mut count = 0;
    for log in logs {
        if log - first > SAME_SHAPE {
            (count, first) = (count + 1, log);
        }
    }
    count
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::content::Mesh;

    /// `z = x y` over a grid: an exact net of hyperbolic paraboloids, all shape parameters 1.
    fn saddle() -> Content {
        let at = |k: usize| f64::from(u8::try_from(k).unwrap()) - 1.0;
        let positions =
            (0..9).map(|k| DVec3::new(at(k / 3), at(k % 3), at(k / 3) * at(k % 3))).collect();
        let quad =
            |i: usize, j: usize| vec![3 * i + j, 3 * i + j + 3, 3 * i + j + 4, 3 * i + j + 1];
        let faces = vec![quad(0, 0), quad(0, 1), quad(1, 0), quad(1, 1)];
        let mesh = Mesh { positions, faces };
        Content { meshes: vec![mesh], shape_parameters: vec![1.0; 4], ..Content::default() }
    }

    fn values(content: &Content) -> Values {
        let mut values = Values::default();
        recompute(content, &mut values);
        values
    }

    #[test]
    fn an_exact_net_has_no_kinks_and_a_moved_vertex_is_seen() {
        let exact = values(&saddle());
        let get = |key: &str| exact.get(key).unwrap();
        assert_eq!((get("faces"), get("vertices"), get("irregular_vertices")), (4.0, 9.0, 0.0));
        assert!(get("kink_max_deg") < 1e-13 && get("star_planarity_max") < 1e-14);
        assert_eq!((get("folds"), get("shape_parameters_distinct")), (0.0, 1.0));
        let mut moved = saddle();
        moved.meshes[0].positions[4].z += 1e-6;
        let moved = values(&moved);
        assert!(moved.get("kink_max_deg").unwrap() > 1e-5);
        assert!(moved.get("star_planarity_max").unwrap() > 1e-7);
    }

    #[test]
    fn patches_of_a_surface_file_are_the_same_net() {
        let saddle = saddle();
        let mesh = &saddle.meshes[0];
        let knots = || vec![0.0, 0.0, 1.0, 1.0];
        let patch = |f: &Vec<usize>| {
            let points = [f[0], f[3], f[1], f[2]].map(|v| mesh.positions[v]);
            Spline::new([1, 1], [knots(), knots()], &points, Some(&[2.0, 2.0, 2.0, 2.0])).unwrap()
        };
        let surfaces = mesh.faces.iter().map(patch).collect();
        let file = Content { surfaces, ..Content::default() };
        assert_eq!(values(&file).get("vertices"), Some(9.0));
        assert!(values(&file).get("kink_max_deg").unwrap() < 1e-13);
    }

    #[test]
    fn the_best_plane_of_a_bent_star() {
        let bent = [DVec3::X, -DVec3::X, DVec3::Y, -DVec3::Y].map(|p| p - DVec3::Z * 0.02);
        let mut points = bent.to_vec();
        points.push(DVec3::Z * 0.08);
        let turn = glam::DMat3::from_rotation_y(0.4) * glam::DMat3::from_rotation_x(0.3);
        points.iter_mut().for_each(|p| *p = turn * *p);
        let axis = least_axis(&points);
        assert!(axis.cross(turn * DVec3::Z).length() < 1e-14);
    }
}
