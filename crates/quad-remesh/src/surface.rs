//! A triangle mesh as the method walks on it: neighbours, frames, stars.

use geom_core::{DVec2, DVec3, TriMesh};

/// No triangle.
pub(crate) const NONE: u32 = u32::MAX;

/// An oriented manifold triangle mesh with what is asked of it everywhere.
///
/// Side `k` of a triangle runs from its corner `k` to the next.
#[derive(Clone, Debug)]
pub(crate) struct Surface {
    pub(crate) positions: Vec<DVec3>,
    pub(crate) triangles: Vec<[u32; 3]>,
    /// The triangle across each side.
    pub(crate) across: Vec<[u32; 3]>,
    pub(crate) areas: Vec<f64>,
    pub(crate) normals: Vec<DVec3>,
    /// First axis of each triangle's frame; the second is `normal × x`.
    pub(crate) x_axes: Vec<DVec3>,
    pub(crate) on_border: Vec<bool>,
    /// Corners `(triangle, corner)` of each vertex, counter-clockwise, from the border on if the
    /// vertex is on it.
    stars: Vec<(u32, u8)>,
    star_starts: Vec<u32>,
}

impl Surface {
    /// Takes triangles that are oriented alike and form one fan or one closed star at every vertex.
    pub(crate) fn new(positions: Vec<DVec3>, triangles: Vec<[u32; 3]>) -> Self {
        let across = neighbours(&triangles);
        let mut on_border = vec![false; positions.len()];
        for (t, sides) in triangles.iter().zip(&across) {
            for k in 0..3 {
                if sides[k] == NONE {
                    on_border[t[k] as usize] = true;
                    on_border[t[(k + 1) % 3] as usize] = true;
                }
            }
        }
        let corners = |t: &[u32; 3]| t.map(|v| positions[v as usize]);
        let (mut areas, mut normals, mut x_axes) = (Vec::new(), Vec::new(), Vec::new());
        for [a, b, c] in triangles.iter().map(corners) {
            let cross = (b - a).cross(c - a);
            areas.push(0.5 * cross.length());
            normals.push(cross.normalize_or_zero());
            x_axes.push((b - a).normalize_or_zero());
        }
        let mut this = Self {
            positions,
            triangles,
            across,
            areas,
            normals,
            x_axes,
            on_border,
            stars: Vec::new(),
            star_starts: Vec::new(),
        };
        this.sort_stars();
        this
    }

    fn sort_stars(&mut self) {
        let mut first = vec![None; self.positions.len()];
        for (f, t) in self.triangles.iter().enumerate() {
            for k in 0..3 {
                // A fan begins at the triangle with no neighbour clockwise.
                let opens = self.across[f][k] == NONE;
                let slot = &mut first[t[k] as usize];
                if slot.is_none() || opens {
                    *slot = Some((f as u32, k as u8));
                }
            }
        }
        self.star_starts.push(0);
        for start in first {
            let mut at = start;
            while let Some((f, k)) = at {
                self.stars.push((f, k));
                let next = self.step(f, k);
                at = next.filter(|n| Some(*n) != start);
            }
            self.star_starts.push(self.stars.len() as u32);
        }
    }

    /// The next corner counter-clockwise around the same vertex.
    fn step(&self, f: u32, k: u8) -> Option<(u32, u8)> {
        let side = (k as usize + 2) % 3;
        let g = self.across[f as usize][side];
        if g == NONE {
            return None;
        }
        let v = self.triangles[f as usize][k as usize];
        Some((g, self.corner_of(g as usize, v) as u8))
    }

    /// Which corner of a triangle is the vertex.
    pub(crate) fn corner_of(&self, f: usize, v: u32) -> usize {
        self.triangles[f].iter().position(|&w| w == v).unwrap_or(0)
    }

    /// Which side of `g` is side `k` of `f`.
    pub(crate) fn same_side(&self, f: usize, k: usize, g: usize) -> usize {
        self.corner_of(g, self.triangles[f][(k + 1) % 3])
    }

    /// Corners at a vertex, counter-clockwise.
    pub(crate) fn star(&self, v: usize) -> &[(u32, u8)] {
        &self.stars[self.star_starts[v] as usize..self.star_starts[v + 1] as usize]
    }

    pub(crate) fn corners(&self, f: usize) -> [DVec3; 3] {
        self.triangles[f].map(|v| self.positions[v as usize])
    }

    pub(crate) fn centre(&self, f: usize) -> DVec3 {
        self.corners(f).into_iter().sum::<DVec3>() / 3.0
    }

    pub(crate) fn y_axis(&self, f: usize) -> DVec3 {
        self.normals[f].cross(self.x_axes[f])
    }

    /// Components of a vector in the frame of a triangle.
    pub(crate) fn local(&self, f: usize, vector: DVec3) -> DVec2 {
        DVec2::new(vector.dot(self.x_axes[f]), vector.dot(self.y_axis(f)))
    }

    /// The vector with these components in the frame of a triangle.
    pub(crate) fn global(&self, f: usize, vector: DVec2) -> DVec3 {
        self.x_axes[f] * vector.x + self.y_axis(f) * vector.y
    }

    /// Gradients of the three functions that are one at a corner and zero at the others.
    pub(crate) fn hat_gradients(&self, f: usize) -> [DVec3; 3] {
        let p = self.corners(f);
        let twice = 2.0 * self.areas[f];
        [0, 1, 2].map(|k| self.normals[f].cross(p[(k + 2) % 3] - p[(k + 1) % 3]) / twice)
    }

    /// By what angle directions turn, in the frames, from a triangle to the one across side `k`.
    pub(crate) fn turn(&self, f: usize, k: usize) -> f64 {
        let g = self.across[f][k] as usize;
        let p = self.corners(f);
        let edge = p[(k + 1) % 3] - p[k];
        let (in_f, in_g) = (self.local(f, edge), self.local(g, edge));
        in_g.y.atan2(in_g.x) - in_f.y.atan2(in_f.x)
    }

    pub(crate) fn area(&self) -> f64 {
        self.areas.iter().sum()
    }

    /// Vertices less edges plus faces.
    pub(crate) fn euler_characteristic(&self) -> i64 {
        let used = (0..self.positions.len()).filter(|&v| !self.star(v).is_empty()).count();
        let open = self.across.iter().flatten().filter(|g| **g == NONE).count();
        let edges = (3 * self.triangles.len() + open) / 2;
        used as i64 - edges as i64 + self.triangles.len() as i64
    }

    pub(crate) fn to_tri_mesh(&self) -> Result<TriMesh, geom_core::MeshError> {
        TriMesh::new(self.positions.clone(), self.triangles.clone())
    }

    /// Triangles whose centres lie within a distance of a point and that a walk over such triangles
    /// reaches from the star of vertex `v`, in rising order.
    pub(crate) fn disc(&self, v: usize, radius: f64) -> Vec<u32> {
        let centre = self.positions[v];
        let mut found: Vec<u32> = self.star(v).iter().map(|&(f, _)| f).collect();
        let mut seen: std::collections::HashSet<u32> = found.iter().copied().collect();
        let mut at = 0;
        while at < found.len() {
            let f = found[at] as usize;
            at += 1;
            for g in self.across[f].into_iter().filter(|g| *g != NONE) {
                let near = self.centre(g as usize).distance(centre) <= radius;
                if near && seen.insert(g) {
                    found.push(g);
                }
            }
        }
        found.sort_unstable();
        found
    }
}

/// The triangle across each side.
pub(crate) fn neighbours(triangles: &[[u32; 3]]) -> Vec<[u32; 3]> {
    let mut sides: Vec<(u32, u32, u32)> = Vec::with_capacity(3 * triangles.len());
    for (f, t) in triangles.iter().enumerate() {
        for k in 0..3 {
            let (a, b) = (t[k], t[(k + 1) % 3]);
            sides.push((a.min(b), a.max(b), (3 * f + k) as u32));
        }
    }
    sides.sort_unstable();
    let mut across = vec![[NONE; 3]; triangles.len()];
    for pair in sides.windows(2) {
        if (pair[0].0, pair[0].1) == (pair[1].0, pair[1].1) {
            let (i, j) = (pair[0].2 as usize, pair[1].2 as usize);
            across[i / 3][i % 3] = (j / 3) as u32;
            across[j / 3][j % 3] = (i / 3) as u32;
        }
    }
    across
}
