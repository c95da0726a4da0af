//! Meshes, polylines and points as files hold them: not yet checked to be manifold.

use geom_core::{DVec3, MeshError, PolyMesh};

/// Lists of indices in one allocation: faces as lists of corners, polylines as lists of points.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct IndexLists {
    indices: Vec<u32>,
    starts: Vec<u32>,
}

impl Default for IndexLists {
    fn default() -> Self {
        Self { indices: Vec::new(), starts: vec![0] }
    }
}

impl IndexLists {
    /// Appends a list.
    pub fn push(&mut self, list: &[u32]) {
        self.indices.extend_from_slice(list);
        self.starts.push(self.indices.len() as u32);
    }

    /// Number of lists.
    #[must_use]
    pub fn len(&self) -> usize {
        self.starts.len() - 1
    }

    /// Whether there is no list.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// One list.
    ///
    /// # Panics
    /// If `k` is not below [`Self::len`].
    #[must_use]
    pub fn get(&self, k: usize) -> &[u32] {
        &self.indices[self.starts[k] as usize..self.starts[k + 1] as usize]
    }

    /// All lists in order.
    pub fn iter(&self) -> impl ExactSizeIterator<Item = &[u32]> + '_ {
        (0..self.len()).map(|k| self.get(k))
    }

    /// Length of all lists together.
    #[must_use]
    pub fn total(&self) -> usize {
        self.indices.len()
    }
}

impl<L: AsRef<[u32]>> FromIterator<L> for IndexLists {
    fn from_iter<I: IntoIterator<Item = L>>(lists: I) -> Self {
        let mut all = Self::default();
        lists.into_iter().for_each(|list| all.push(list.as_ref()));
        all
    }
}

/// A named set of faces, such as a panel type or a mold.
#[derive(Clone, Debug, PartialEq)]
pub struct Group {
    /// The name, written to files as it is.
    pub name: String,
    /// Linear RGB in 0..=1 for formats with materials; a palette is used without.
    pub color: Option<[f32; 3]>,
}

impl Group {
    /// A group without a colour of its own.
    pub fn new(name: impl Into<String>) -> Self {
        Self { name: name.into(), color: None }
    }
}

/// A named number per vertex or per face.
#[derive(Clone, Debug, PartialEq)]
pub struct Field {
    /// Such as `H`, `K`, `k1`, `k2`: letters, digits and `_`.
    pub name: String,
    /// One value each, in the order of the vertices or faces.
    pub values: Vec<f64>,
}

/// Sharpness of edges and vertices of a control mesh, as OBJ's tags `crease` and `corner` give it.
///
/// # Example
/// ```
/// let text = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nf 1 2 3 4\nt crease 2/1/0 0 1 2.5\n";
/// let model = exchange::read_obj(text)?;
/// assert_eq!(model.meshes[0].sharpness.edges, [([0, 1], 2.5)]);
/// assert!(exchange::write_obj(&model.meshes).contains("t crease 2/1/0 0 1 2.5"));
/// # Ok::<(), exchange::ReadError>(())
/// ```
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Sharpness {
    /// Edges by their ends, which are refined by the crease masks so many times; infinite if they
    /// stay sharp for ever.
    pub edges: Vec<([u32; 2], f64)>,
    /// Vertices likewise.
    pub vertices: Vec<(u32, f64)>,
}

impl Sharpness {
    /// Whether nothing is sharp.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.edges.is_empty() && self.vertices.is_empty()
    }

    /// The same of vertices with other numbers; what belongs to one that has none is left out.
    pub(crate) fn renumbered(&self, to: impl Fn(u32) -> Option<u32>) -> Self {
        let edge = |&([a, b], s): &([u32; 2], f64)| Some(([to(a)?, to(b)?], s));
        Self {
            edges: self.edges.iter().filter_map(edge).filter(|([a, b], _)| a != b).collect(),
            vertices: self.vertices.iter().filter_map(|&(v, s)| Some((to(v)?, s))).collect(),
        }
    }
}

/// Polygons, polylines and loose points over one list of positions, with optional data on them.
///
/// Optional lists are either empty or have one entry per vertex (or per face).
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Mesh {
    /// The name of the object, empty if it has none.
    pub name: String,
    /// Positions in the unit of the model.
    pub positions: Vec<DVec3>,
    /// Corners of each face, counter-clockwise seen from outside.
    pub faces: IndexLists,
    /// Points of each polyline; a closed one ends where it begins.
    pub lines: IndexLists,
    /// Groups of faces.
    pub groups: Vec<Group>,
    /// The group of each face; empty if there are no groups.
    pub face_groups: Vec<u32>,
    /// Unit normals per vertex.
    pub normals: Vec<DVec3>,
    /// Linear RGB in 0..=1 per vertex.
    pub colors: Vec<[f32; 3]>,
    /// Numbers per vertex.
    pub vertex_fields: Vec<Field>,
    /// Numbers per face.
    pub face_fields: Vec<Field>,
    /// Sharp edges and vertices of a control mesh.
    pub sharpness: Sharpness,
}

impl Mesh {
    /// Positions and faces, nothing else.
    pub fn new<L: AsRef<[u32]>>(positions: Vec<DVec3>, faces: impl IntoIterator<Item = L>) -> Self {
        Self { positions, faces: faces.into_iter().collect(), ..Self::default() }
    }

    /// The faces of a checked mesh.
    #[must_use]
    pub fn from_poly_mesh(mesh: &PolyMesh) -> Self {
        let corners = |f| mesh.face_vertices(f).map(|v| v.0).collect::<Vec<u32>>();
        Self::new(mesh.positions().to_vec(), mesh.faces().map(corners))
    }

    /// The faces as an oriented manifold mesh; face and vertex numbers stay.
    ///
    /// # Errors
    /// [`MeshError`] names the first face, edge or vertex at fault.
    pub fn to_poly_mesh(&self) -> Result<PolyMesh, MeshError> {
        let faces: Vec<&[u32]> = self.faces.iter().collect();
        PolyMesh::new(self.positions.clone(), &faces)
    }

    /// Appends a polyline with points of its own.
    pub fn push_polyline(&mut self, points: &[DVec3]) {
        let first = self.positions.len() as u32;
        self.positions.extend_from_slice(points);
        let indices: Vec<u32> = (first..first + points.len() as u32).collect();
        self.lines.push(&indices);
    }

    /// The points of polyline `k`.
    ///
    /// # Panics
    /// If there are not that many.
    pub fn polyline(&self, k: usize) -> impl ExactSizeIterator<Item = DVec3> + '_ {
        self.lines.get(k).iter().map(|&i| self.positions[i as usize])
    }

    /// The group of face `f`, if there are groups.
    #[must_use]
    pub fn face_group(&self, f: usize) -> Option<usize> {
        self.face_groups.get(f).map(|&g| g as usize)
    }
}
