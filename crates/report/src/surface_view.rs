//! A triangulated surface with exact normals, scalar fields, face groups and line sets.

use glam::DVec3;

use crate::{FaceGroups, LineSet, ReportError, ScalarField};

/// How far the squared length of a normal may be from 1 (no unit).
const UNIT_TOL: f64 = 1e-6;

/// One stage of the work (`before`, `after`, `panels`), ready to draw.
///
/// Positions are in model units. Normals are those of the *surface*, not of the display mesh:
/// zebra stripes and isophotes are shaded from them, so a vertex on a crease must be doubled.
/// Every index is in range, every vector finite, every normal of length 1 (kept by `new`), every
/// field has one value per vertex, every grouping one number per triangle (kept by `with_*`).
#[derive(Clone, Debug, PartialEq)]
pub struct SurfaceView {
    name: String,
    positions: Vec<DVec3>,
    normals: Vec<DVec3>,
    has_exact_normals: bool,
    triangles: Vec<[u32; 3]>,
    fields: Vec<ScalarField>,
    groups: Vec<FaceGroups>,
    lines: Vec<LineSet>,
}

impl SurfaceView {
    /// Takes the mesh after checking it.
    ///
    /// # Errors
    /// [`ReportError`] if there is no triangle, an index is out of range, the arrays differ in
    /// length, or a vector is not finite or a normal not of unit length.
    pub fn new(
        name: impl Into<String>,
        positions: Vec<DVec3>,
        normals: Vec<DVec3>,
        triangles: Vec<[u32; 3]>,
    ) -> Result<Self, ReportError> {
        let name = name.into();
        if triangles.is_empty() {
            return Err(ReportError::Empty { view: name });
        }
        check_length("the array of normals", "vertex", positions.len(), normals.len())?;
        for (index, p) in positions.iter().enumerate() {
            if !p.is_finite() {
                let mend = "leave such samples out of the mesh";
                return Err(vector_error("position", index, *p, mend));
            }
        }
        for (index, n) in normals.iter().enumerate() {
            if !((n.length_squared() - 1.0).abs() <= UNIT_TOL) {
                return Err(vector_error("normal", index, *n, "normals must have length 1"));
            }
        }
        for (triangle, corners) in triangles.iter().enumerate() {
            if let Some(&vertex) = corners.iter().find(|&&v| v as usize >= positions.len()) {
                let vertices = positions.len();
                return Err(ReportError::Index { triangle, vertex, vertices });
            }
        }
        let (fields, groups, lines) = (Vec::new(), Vec::new(), Vec::new());
        let has_exact_normals = true;
        Ok(Self { name, positions, normals, has_exact_normals, triangles, fields, groups, lines })
    }

    /// Triangles of a grid of `rows` x `columns` vertices, vertex `i * columns + j`.
    ///
    /// Each cell is cut along the same diagonal; the orientation follows `S_i × S_j`, the normal
    /// of a surface whose first parameter runs along the rows' index.
    pub fn grid_triangles(rows: usize, columns: usize) -> Vec<[u32; 3]> {
        let mut triangles = Vec::with_capacity(2 * rows * columns);
        for i in 1..rows {
            for j in 1..columns {
                let d = (i * columns + j) as u32;
                let (c, b) = (d - 1, d - columns as u32);
                let a = b - 1;
                triangles.push([a, c, d]);
                triangles.push([a, d, b]);
            }
        }
        triangles
    }

    /// Says that the normals were averaged from faces, so that the page does not call them exact.
    #[must_use]
    pub fn with_averaged_normals(mut self) -> Self {
        self.has_exact_normals = false;
        self
    }

    /// Adds a scalar field with one value per vertex; NaN marks a singular point.
    ///
    /// # Errors
    /// [`ReportError::Length`] or [`ReportError::Duplicate`].
    pub fn with_field(mut self, field: ScalarField) -> Result<Self, ReportError> {
        self.check_new(&field.id, self.fields.iter().map(|f| &f.id))?;
        let what = format!("field `{}`", field.id);
        check_length(&what, "vertex", self.positions.len(), field.values.len())?;
        self.fields.push(field);
        Ok(self)
    }

    /// Adds a grouping of the triangles, such as molds or patches.
    ///
    /// # Errors
    /// [`ReportError::Length`], [`ReportError::Group`] or [`ReportError::Duplicate`].
    pub fn with_groups(mut self, groups: FaceGroups) -> Result<Self, ReportError> {
        self.check_new(&groups.id, self.groups.iter().map(|g| &g.id))?;
        let what = format!("grouping `{}`", groups.id);
        check_length(&what, "triangle", self.triangles.len(), groups.of_triangle.len())?;
        for (triangle, &group) in groups.of_triangle.iter().enumerate() {
            if group as usize >= groups.names.len() {
                let groups = groups.names.len();
                return Err(ReportError::Group { what, triangle, group, groups });
            }
        }
        self.groups.push(groups);
        Ok(self)
    }

    /// Adds a set of lines drawn over the surface.
    ///
    /// # Errors
    /// [`ReportError::Vector`] for a point that is not finite, or [`ReportError::Duplicate`].
    pub fn with_lines(mut self, lines: LineSet) -> Result<Self, ReportError> {
        self.check_new(&lines.id, self.lines.iter().map(|l| &l.id))?;
        for (index, p) in lines.polylines.iter().flatten().enumerate() {
            if !p.is_finite() {
                return Err(vector_error("line point", index, *p, "cut the line there"));
            }
        }
        self.lines.push(lines);
        Ok(self)
    }

    /// The stage's name as the reader sees it.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// Vertex positions in model units.
    pub fn positions(&self) -> &[DVec3] {
        &self.positions
    }

    /// Unit normals of the surface, one per vertex.
    pub fn normals(&self) -> &[DVec3] {
        &self.normals
    }

    /// Whether the normals are those of the surface, not averages over faces.
    pub fn has_exact_normals(&self) -> bool {
        self.has_exact_normals
    }

    /// Vertex numbers of the triangles.
    pub fn triangles(&self) -> &[[u32; 3]] {
        &self.triangles
    }

    /// The scalar fields in the order they were added.
    pub fn fields(&self) -> &[ScalarField] {
        &self.fields
    }

    /// The field called `id`.
    pub fn field(&self, id: &str) -> Option<&ScalarField> {
        self.fields.iter().find(|f| f.id == id)
    }

    /// The groupings of triangles in the order they were added.
    pub fn groups(&self) -> &[FaceGroups] {
        &self.groups
    }

    /// The line sets in the order they were added.
    pub fn lines(&self) -> &[LineSet] {
        &self.lines
    }

    /// Lower and upper corner of the box around the vertices.
    pub fn bounding_box(&self) -> (DVec3, DVec3) {
        let start = (DVec3::INFINITY, DVec3::NEG_INFINITY);
        self.positions.iter().fold(start, |(lo, hi), p| (lo.min(*p), hi.max(*p)))
    }

    fn check_new<'a>(
        &self,
        id: &str,
        mut others: impl Iterator<Item = &'a String>,
    ) -> Result<(), ReportError> {
        match others.any(|o| o == id) {
            true => Err(ReportError::Duplicate { view: self.name.clone(), id: id.to_owned() }),
            false => Ok(()),
        }
    }
}

fn check_length(
    what: &str,
    of: &'static str,
    expected: usize,
    found: usize,
) -> Result<(), ReportError> {
    match expected == found {
        true => Ok(()),
        false => Err(ReportError::Length { what: what.to_owned(), of, expected, found }),
    }
}

fn vector_error(what: &'static str, index: usize, p: DVec3, mend: &'static str) -> ReportError {
    ReportError::Vector { what, index, x: p.x, y: p.y, z: p.z, mend }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn flat() -> SurfaceView {
        let positions = vec![DVec3::ZERO, DVec3::Y, DVec3::X, DVec3::X + DVec3::Y];
        let triangles = SurfaceView::grid_triangles(2, 2);
        SurfaceView::new("flat", positions, vec![DVec3::Z; 4], triangles).unwrap()
    }

    #[test]
    fn grid_triangles_follow_the_normal_of_the_parametrisation() {
        let view = flat();
        for t in view.triangles() {
            let [a, b, c] = t.map(|v| view.positions()[v as usize]);
            assert!((b - a).cross(c - a).dot(DVec3::Z) > 0.0);
        }
    }

    #[test]
    fn bad_meshes_are_refused_with_the_place() {
        let p = vec![DVec3::ZERO, DVec3::X, DVec3::Y];
        let n = vec![DVec3::Z; 3];
        let refused = |p: &[DVec3], n: &[DVec3], t: Vec<[u32; 3]>| {
            SurfaceView::new("v", p.to_vec(), n.to_vec(), t).unwrap_err().to_string()
        };
        let index = refused(&p, &n, vec![[0, 1, 3]]);
        assert_eq!(index, "triangle 0 uses vertex 3 of 3; number vertices from 0");
        assert!(
            refused(&p, &n[..2], vec![[0, 1, 2]])
                .contains("2 entries; give one per vertex, 3 in all")
        );
        assert!(refused(&p, &[DVec3::Z * 2.0; 3], vec![[0, 1, 2]]).contains("length 1"));
        assert!(refused(&[DVec3::NAN; 3], &n, vec![[0, 1, 2]]).contains("position 0 is (NaN"));
        assert!(refused(&p, &n, vec![]).contains("no triangles"));
    }

    #[test]
    fn bad_parts_are_refused() {
        let short = ScalarField::mean_curvature(vec![0.0; 3], "m");
        assert!(matches!(flat().with_field(short), Err(ReportError::Length { found: 3, .. })));
        let field = ScalarField::mean_curvature(vec![0.0; 4], "m");
        let twice = flat().with_field(field.clone()).unwrap().with_field(field);
        assert!(matches!(twice, Err(ReportError::Duplicate { .. })));
        let groups = FaceGroups::numbered("molds", "mold", vec![0, 1]);
        assert_eq!(groups.names, ["mold 0", "mold 1"]);
        let nameless = FaceGroups { names: vec!["one".into()], ..groups };
        assert!(matches!(flat().with_groups(nameless), Err(ReportError::Group { group: 1, .. })));
    }
}
