//! Plain Catmull-Clark subdivision (Catmull and Clark 1978), without creases and blends; borders
//! are cubic B-splines, and their vertices with one face only are corners.

use crate::edges::Edges;
use glam::DVec3;

/// A control mesh.
#[derive(Clone, Debug, PartialEq)]
pub struct Subdivision {
    positions: Vec<DVec3>,
    faces: Vec<Vec<usize>>,
}

impl Subdivision {
    /// A mesh of polygons.
    #[must_use]
    pub fn new(positions: &[DVec3], faces: &[Vec<usize>]) -> Self {
        Self { positions: positions.to_vec(), faces: faces.to_vec() }
    }

    /// One refinement: a point per face, per edge, per vertex, and a quad per corner. `None` if the
    /// faces are no surface.
    #[must_use]
    pub fn refined(&self) -> Option<Self> {
        let edges = Edges::new(&self.faces, self.positions.len())?;
        let p = &self.positions;
        let centres: Vec<DVec3> = self
            .faces
            .iter()
            .map(|f| f.iter().map(|v| p[*v]).sum::<DVec3>() / f.len() as f64)
            .collect();
        let (vertices, n_edges) = (p.len(), edges.list.len());
        let mut positions = Vec::with_capacity(vertices + n_edges + centres.len());
        // Sums around every vertex: of face points, of edge middles, of border middles.
        let mut around = vec![DVec3::ZERO; vertices];
        let mut faces_at = vec![0.0; vertices];
        let mut middles = vec![DVec3::ZERO; vertices];
        let mut border = vec![DVec3::ZERO; vertices];
        for (f, centre) in self.faces.iter().zip(&centres) {
            for v in f {
                around[*v] += *centre;
                faces_at[*v] += 1.0;
            }
        }
        for e in &edges.list {
            let middle = 0.5 * (p[e.ends[0]] + p[e.ends[1]]);
            for v in e.ends {
                middles[v] += middle;
                if e.second.is_none() {
                    border[v] += middle;
                }
            }
        }
        for v in 0..vertices {
            let n = edges.valence[v] as f64;
            positions.push(if is_kept(&edges, v) {
                p[v]
            } else if edges.on_border[v] {
                0.5 * p[v] + 0.25 * border[v]
            } else {
                (around[v] / n + 2.0 * middles[v] / n + (n - 3.0) * p[v]) / n
            });
        }
        let mut edge_of = std::collections::BTreeMap::new();
        for (k, e) in edges.list.iter().enumerate() {
            let [a, b] = e.ends;
            edge_of.insert([a.min(b), a.max(b)], vertices + k);
            let middle = 0.5 * (p[a] + p[b]);
            positions.push(match e.second {
                None => middle,
                Some(second) => 0.25 * (p[a] + p[b] + centres[e.first.face] + centres[second.face]),
            });
        }
        positions.extend(&centres);
        let mut faces = Vec::new();
        for (f, corners) in self.faces.iter().enumerate() {
            let n = corners.len();
            for k in 0..n {
                let (before, here, next) =
                    (corners[(k + n - 1) % n], corners[k], corners[(k + 1) % n]);
                let edge = |a: usize, b: usize| edge_of[&[a.min(b), a.max(b)]];
                faces.push(vec![
                    here,
                    edge(here, next),
                    vertices + n_edges + f,
                    edge(before, here),
                ]);
            }
        }
        Some(Self { positions, faces })
    }

    /// Limit positions of the vertices of a mesh of quads (Halstead, Kass and DeRose 1993):
    /// `(n² p + 4 Σ edge neighbours + Σ opposite corners) / (n (n + 5))`, on the border
    /// `(4 p + its two neighbours) / 6`.
    fn limit_positions(&self, edges: &Edges) -> Vec<DVec3> {
        let p = &self.positions;
        let mut near = vec![DVec3::ZERO; p.len()];
        let mut border = vec![DVec3::ZERO; p.len()];
        let mut opposite = vec![DVec3::ZERO; p.len()];
        for e in &edges.list {
            let [a, b] = e.ends;
            near[a] += p[b];
            near[b] += p[a];
            if e.second.is_none() {
                border[a] += p[b];
                border[b] += p[a];
            }
        }
        for f in &self.faces {
            for k in 0..4 {
                opposite[f[k]] += p[f[(k + 2) % 4]];
            }
        }
        let limit = |v: usize| {
            let n = edges.valence[v] as f64;
            if is_kept(edges, v) {
                p[v]
            } else if edges.on_border[v] {
                (4.0 * p[v] + border[v]) / 6.0
            } else {
                (n * n * p[v] + 4.0 * near[v] + opposite[v]) / (n * (n + 5.0))
            }
        };
        (0..p.len()).map(limit).collect()
    }

    /// Area of the limit surface: of the quads between limit positions after `levels` and one fewer
    /// refinements, extrapolated with the square of the size of the faces.
    ///
    /// Not finite if the faces are no surface.
    #[must_use]
    pub fn limit_area(&self, levels: usize) -> f64 {
        let (mut mesh, mut areas) = (self.clone(), Vec::new());
        for level in 0..=levels {
            if level > 0 {
                let Some(finer) = mesh.refined() else { return f64::NAN };
                mesh = finer;
            }
            let Some(edges) = Edges::new(&mesh.faces, mesh.positions.len()) else {
                return f64::NAN;
            };
            if mesh.faces.iter().any(|f| f.len() != 4) {
                continue;
            }
            let limit = mesh.limit_positions(&edges);
            // Half the cross product of the diagonals: the area of the quad to second order.
            let quad = |f: &Vec<usize>| {
                let [a, b, c, d] = [0, 1, 2, 3].map(|k| limit[f[k]]);
                0.5 * (c - a).cross(d - b).length()
            };
            areas.push(mesh.faces.iter().map(quad).sum::<f64>());
        }
        match areas[..] {
            [.., a, b] => b + (b - a) / 3.0,
            [a] => a,
            [] => f64::NAN,
        }
    }
}

/// Whether a vertex stays where it is: it has no face, or one only at a border, where it is a corner.
fn is_kept(edges: &Edges, v: usize) -> bool {
    edges.valence[v] == 0 || edges.on_border[v] && edges.valence[v] == 2
}

#[cfg(test)]
mod tests {
    use super::*;

    fn cube() -> Subdivision {
        let positions: Vec<DVec3> = (0..8)
            .map(|k| DVec3::new(f64::from(k & 1), f64::from(k >> 1 & 1), f64::from(k >> 2)))
            .collect();
        let faces =
            [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
        Subdivision::new(&positions, &faces.map(Vec::from))
    }

    #[test]
    fn refining_keeps_the_limit() {
        let cube = cube();
        let edges = Edges::new(&cube.faces, 8).unwrap();
        let fine = cube.refined().unwrap();
        assert_eq!((fine.positions.len(), fine.faces.len()), (26, 24));
        let (a, b) = (
            cube.limit_positions(&edges),
            fine.limit_positions(&Edges::new(&fine.faces, 26).unwrap()),
        );
        for v in 0..8 {
            assert!((a[v] - b[v]).length() < 1e-15, "{v}");
        }
    }

    #[test]
    fn the_area_converges_with_the_levels() {
        let cube = cube();
        let areas = [3, 4, 5].map(|l| cube.limit_area(l));
        assert!((areas[2] - areas[1]).abs() < 0.4 * (areas[1] - areas[0]).abs());
        assert!((areas[2] / areas[1] - 1.0).abs() < 2e-5, "{areas:?}");
        // A square has four corners, which stay.
        let square = Subdivision::new(
            &[DVec3::ZERO, DVec3::X, DVec3::X + DVec3::Y, DVec3::Y],
            &[vec![0, 1, 2, 3]],
        );
        assert!((square.limit_area(4) - 1.0).abs() < 1e-14);
    }
}
