//! Meshes as modellers write them: corners apart, faces turned over.

use crate::mesh::{IndexLists, Mesh};
use crate::model::Model;
use geom_core::{Ball, DVec3, coinciding_points, faces_to_turn};

/// Corners within this share of a mesh's size, the diameter of the smallest ball around it, are one.
pub const WELD_SHARE: f64 = 1e-9;

impl Model {
    /// Welds the corners of every mesh that coincide to [`WELD_SHARE`] of its size, if `weld`, and
    /// turns faces over until neighbours are oriented alike. What was done joins the warnings.
    ///
    /// A mesh that welding would make non-manifold stays as it is, and so does a part that cannot be
    /// oriented.
    pub fn mend(&mut self, weld: bool) {
        for mesh in self.meshes.iter_mut().filter(|mesh| !mesh.faces.is_empty()) {
            let name = if mesh.name.is_empty() { "the mesh" } else { &mesh.name };
            let name = crate::error::clip(name);
            if weld {
                self.warnings.extend(mesh.weld().map(|done| format!("{name}: {done}")));
            }
            let turned = mesh.orient();
            if turned > 0 {
                self.warnings.push(format!(
                    "{name}: {turned} faces were turned over, so that neighbours are oriented alike"
                ));
            }
        }
    }
}

impl Mesh {
    /// Welds coinciding corners; what was done, in words. Vertices behind a welded one move up.
    fn weld(&mut self) -> Option<String> {
        let mut used = vec![false; self.positions.len()];
        self.faces.iter().flatten().for_each(|&v| used[v as usize] = true);
        let corners = || (0..used.len()).filter(|&v| used[v]);
        let points: Vec<DVec3> = corners().map(|v| self.positions[v]).collect();
        let size = Ball::around(&points).map_or(0.0, |ball| ball.diameter());
        let heads = coinciding_points(&points, WELD_SHARE * size);
        let count = heads.iter().enumerate().filter(|(k, head)| *k as u32 != **head).count();
        if count == 0 {
            return None;
        }
        // Where every vertex goes, by its old number.
        let numbers: Vec<usize> = corners().collect();
        let mut head: Vec<usize> = (0..used.len()).collect();
        for (k, &first) in heads.iter().enumerate() {
            head[numbers[k]] = numbers[first as usize];
        }
        let kept: Vec<usize> = (0..used.len()).filter(|&v| head[v] == v).collect();
        let mut place = vec![0_u32; used.len()];
        kept.iter().enumerate().for_each(|(k, &v)| place[v] = k as u32);
        let to = |v: u32| place[head[v as usize]];
        let mut faces = Vec::with_capacity(self.faces.len());
        let mut kept_faces = Vec::with_capacity(self.faces.len());
        for (f, face) in self.faces.iter().enumerate() {
            let mut corners: Vec<u32> = face.iter().map(|&v| to(v)).collect();
            corners.dedup();
            if corners.len() > 1 && corners.first() == corners.last() {
                corners.pop();
            }
            if corners.len() >= 3 {
                faces.push(corners);
                kept_faces.push(f);
            }
        }
        let mut welded = Self {
            name: self.name.clone(),
            positions: picked(&self.positions, &kept),
            faces: faces.iter().collect::<IndexLists>(),
            lines: self
                .lines
                .iter()
                .map(|l| l.iter().map(|&v| to(v)).collect::<Vec<_>>())
                .collect(),
            groups: self.groups.clone(),
            face_groups: picked(&self.face_groups, &kept_faces),
            // Normals of flat faces differ at a common corner.
            normals: Vec::new(),
            colors: picked(&self.colors, &kept),
            vertex_fields: self.vertex_fields.clone(),
            face_fields: self.face_fields.clone(),
            sharpness: self.sharpness.renumbered(|v| Some(to(v))),
        };
        for field in &mut welded.vertex_fields {
            field.values = picked(&field.values, &kept);
        }
        for field in &mut welded.face_fields {
            field.values = picked(&field.values, &kept_faces);
        }
        let flat = self.faces.len() - faces.len();
        let mut oriented = welded.clone();
        oriented.orient();
        if let Err(error) = oriented.to_poly_mesh()
            && self.to_poly_mesh().is_ok()
        {
            return Some(format!(
                "{count} corners coincide with others but stay apart, for welded {error}"
            ));
        }
        *self = welded;
        let dropped = match flat {
            0 => String::new(),
            n => format!("; {n} faces without area were dropped"),
        };
        Some(format!(
            "{count} corners that coincide with others were welded, {} vertices are left{dropped}",
            self.positions.len()
        ))
    }

    /// Turns faces over until neighbours are oriented alike; how many.
    fn orient(&mut self) -> usize {
        let faces: Vec<&[u32]> = self.faces.iter().collect();
        let turned = faces_to_turn(&faces);
        let count = turned.iter().filter(|t| **t).count();
        if count > 0 {
            let face = |(face, turned): (&&[u32], &bool)| {
                let mut corners = face.to_vec();
                if *turned {
                    corners[1..].reverse();
                }
                corners
            };
            self.faces = faces.iter().zip(&turned).map(face).collect();
        }
        count
    }
}

/// The entries of an optional list.
fn picked<T: Clone>(list: &[T], places: &[usize]) -> Vec<T> {
    if list.is_empty() { Vec::new() } else { places.iter().map(|&k| list[k].clone()).collect() }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::{Field, Group};

    /// A row of quads, each with corners of its own.
    fn unwelded(n: u32) -> Mesh {
        let corner = |k: u32| {
            let (x, y) =
                (f64::from(k / 4 + u32::from(k % 4 == 1 || k % 4 == 2)), f64::from(k % 4 / 2));
            DVec3::new(x, y, 0.1 * x * y)
        };
        Mesh::new(
            (0..4 * n).map(corner).collect(),
            (0..n).map(|k| [4 * k, 4 * k + 1, 4 * k + 2, 4 * k + 3]),
        )
    }

    #[test]
    fn corners_of_their_own_are_welded() {
        let mut mesh = unwelded(4);
        mesh.groups = vec![Group::new("a"), Group::new("b")];
        mesh.face_groups = vec![0, 0, 1, 1];
        mesh.vertex_fields =
            vec![Field { name: "x".into(), values: mesh.positions.iter().map(|p| p.x).collect() }];
        mesh.normals = vec![DVec3::Z; 16];
        let mut model = Model { meshes: vec![mesh], ..Model::default() };
        model.mend(true);
        let mesh = &model.meshes[0];
        assert_eq!((mesh.positions.len(), mesh.faces.len(), mesh.normals.len()), (10, 4, 0));
        assert_eq!(mesh.face_groups, [0, 0, 1, 1]);
        assert!(mesh.positions.iter().zip(&mesh.vertex_fields[0].values).all(|(p, x)| p.x == *x));
        assert_eq!(mesh.to_poly_mesh().unwrap().components().1, 1);
        assert_eq!(
            model.warnings,
            ["the mesh: 6 corners that coincide with others were welded, 10 vertices are left"]
        );
        let mut apart = Model { meshes: vec![unwelded(4)], ..Model::default() };
        apart.mend(false);
        assert_eq!((apart.meshes[0].positions.len(), apart.warnings.len()), (16, 0));
    }

    #[test]
    fn quads_with_two_equal_corners_become_triangles() {
        let mut mesh = unwelded(2);
        mesh.positions[0] = mesh.positions[3];
        let mut model = Model { meshes: vec![mesh], ..Model::default() };
        model.mend(true);
        assert_eq!(model.meshes[0].faces.get(0).len(), 3);
        assert_eq!(model.meshes[0].faces.get(1).len(), 4);
    }

    #[test]
    fn what_welding_would_spoil_stays_apart() {
        // Two tetrahedra that touch at a vertex.
        let tetrahedron = [DVec3::ZERO, DVec3::X, DVec3::Y, DVec3::Z];
        let positions = [tetrahedron, tetrahedron.map(|p| -p)].concat();
        let faces = [[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]];
        let all = [faces, faces.map(|f| [f[0] + 4, f[2] + 4, f[1] + 4])].concat();
        let mut model = Model { meshes: vec![Mesh::new(positions, all)], ..Model::default() };
        model.mend(true);
        assert_eq!(model.meshes[0].positions.len(), 8);
        assert!(model.warnings[0].contains("stay apart"), "{:?}", model.warnings);
    }

    #[test]
    fn faces_turned_over_are_turned_back() {
        let mut model = Model { meshes: vec![unwelded(4)], ..Model::default() };
        model.mend(true);
        let mut faces: Vec<Vec<u32>> = model.meshes[0].faces.iter().map(<[u32]>::to_vec).collect();
        faces[2].reverse();
        model.meshes[0].faces = faces.iter().collect();
        assert!(model.meshes[0].to_poly_mesh().is_err());
        model.mend(false);
        assert!(model.meshes[0].to_poly_mesh().is_ok());
        assert_eq!(
            model.warnings[1],
            "the mesh: 1 faces were turned over, so that neighbours are oriented alike"
        );
    }
}
