//! A subdivision surface: patches, shared bases, evaluation.

use crate::blend::{Blend, flat_step, weight_jet};
use crate::characteristic::{characteristic_map, limit_masks};
use crate::classes::Classes;
use crate::crease::{Creases, Tags};
use crate::error::SubdivisionError;
use crate::guide::{Guide, MONOMIALS, coordinate_jets};
use crate::jet::{JET_LEN, Jet, JetWeights, jet_product};
use crate::local::LocalPatch;
use crate::regions::{RegionFace, Regions};
use crate::wide::{Cell, WideGuide};
use geom_core::{DVec3, FaceId, HalfEdgeId, PolyMesh, SurfaceJet, VertexId};
use std::collections::HashMap;
use std::collections::hash_map::Entry;
use std::sync::Arc;

/// Patches with the same [`BasisId`] have the same weights on their control points.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct BasisId(pub usize);

#[derive(Clone, Debug)]
enum Basis {
    Plain { class: usize },
    Guided { class: usize, map: Vec<[f64; 2]>, guide: Guide },
    Flat { class: usize, map: Vec<[f64; 2]>, valence: usize },
    Wide { class: usize, cell: Cell, guide: Arc<WideGuide> },
}

/// One quad's piece of the limit surface, over the unit square.
#[derive(Clone, Debug, PartialEq)]
pub struct Patch {
    /// The quad.
    pub face: FaceId,
    /// The half-edge from the corner at `(0, 0)` to the one at `(1, 0)`.
    pub corner: HalfEdgeId,
    /// Which weights it uses.
    pub basis: BasisId,
    /// What the weights apply to: vertices, and from the number of vertices on the coefficients of
    /// guides, see [`GuideSector`].
    pub controls: Vec<u32>,
}

/// One sector of a smooth blend of several rings.
///
/// The patches of such a blend take the coefficients of its guide as further control points, which
/// keeps them small. The coefficients are numbered on after the mesh's vertices, and are linear in
/// the vertices around the blend.
#[derive(Clone, Debug)]
pub struct GuideSector {
    /// Number of the first coefficient.
    pub first: u32,
    /// The vertices the coefficients depend on: the same for all sectors of a blend, but each in an
    /// order of its own.
    pub vertices: Vec<u32>,
    guide: Arc<WideGuide>,
    class: usize,
}

impl GuideSector {
    /// Number of coefficients.
    pub const COEFFICIENTS: usize = MONOMIALS;

    /// The weights of the vertices in coefficient `k`.
    ///
    /// # Panics
    /// If `k` is not below [`Self::COEFFICIENTS`].
    #[must_use]
    pub fn weights(&self, k: usize) -> &[f64] {
        self.guide.coefficient(k)
    }

    fn coefficient(&self, k: usize, positions: &[DVec3]) -> DVec3 {
        let vertices = self.vertices.iter().map(|&v| positions[v as usize]);
        self.weights(k).iter().zip(vertices).map(|(&w, p)| w * p).sum()
    }
}

/// A Catmull-Clark limit surface with exact evaluation (Stam 1998, by powers of the subdivision
/// matrix), repaired around extraordinary vertices as its [`Blend`] says.
///
/// Everything is linear in the control points: a patch's jets are its basis' weights times its
/// control points, and patches of one connectivity share their basis, which depends on the
/// valence alone. The surface holds connectivity only; positions are passed to each evaluation.
///
/// # Example
/// ```
/// use geom_core::{DVec3, PolyMesh};
/// use subdiv_catmull_clark::{Blend, Creases, SubdivisionSurface};
/// // Control points on z = x²: inside, the cubic B-spline of such values is x² + 1/3.
/// let xy = |k: u32| (f64::from(k / 5), f64::from(k % 5));
/// let points = (0..25).map(xy).map(|(x, y)| DVec3::new(x, y, x * x)).collect();
/// let quad = |k: u32| {
///     let at = 5 * (k / 4) + k % 4;
///     [at, at + 5, at + 6, at + 1]
/// };
/// let mesh = PolyMesh::new(points, &(0..16).map(quad).collect::<Vec<_>>())?;
/// let surface = SubdivisionSurface::new(&mesh, &Creases::none(), Blend::Smooth)?;
/// let jet = surface.evaluate(mesh.positions(), &surface.patches()[5], 0.5, 0.5);
/// assert!(jet.position().distance(DVec3::new(1.5, 1.5, 2.25 + 1.0 / 3.0)) < 1e-14);
/// assert!((jet.d(1, 0).z - 3.0).abs() < 1e-14 && (jet.d(2, 0).z - 2.0).abs() < 1e-14);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Debug)]
pub struct SubdivisionSurface {
    classes: Classes,
    bases: Vec<Basis>,
    patches: Vec<Patch>,
    regular: Option<BasisId>,
    blend: Blend,
    vertex_count: usize,
    sectors: Vec<GuideSector>,
    // Of every blended vertex.
    rings: Vec<usize>,
}

impl SubdivisionSurface {
    /// Finds the patches of a quad mesh.
    ///
    /// Interior extraordinary vertices that no crease touches are blended and need a regular ring,
    /// which one refinement of any quad mesh gives (see [`crate::refine`]).
    ///
    /// # Errors
    /// [`SubdivisionError`] names the first face or vertex at fault.
    pub fn new(mesh: &PolyMesh, creases: &Creases, blend: Blend) -> Result<Self, SubdivisionError> {
        Self::with_rings(mesh, creases, blend, None)
    }

    /// As [`Self::new`], with smooth blends that cover `rings` rings of patches around every
    /// extraordinary vertex.
    ///
    /// A blend reaches at most half the way to the next vertex that is not regular, and one ring at
    /// least. `None` takes a quarter of that way and one ring more, but at most three or a tenth of
    /// the way, and 170 control points or 2.7 for every ring of it.
    ///
    /// # Errors
    /// As [`Self::new`].
    pub fn with_rings(
        mesh: &PolyMesh,
        creases: &Creases,
        blend: Blend,
        rings: Option<usize>,
    ) -> Result<Self, SubdivisionError> {
        for f in mesh.faces() {
            if mesh.face_degree(f) != 4 {
                let corners = mesh.face_degree(f);
                return Err(SubdivisionError::NotQuad { face: f.index(), corners });
            }
        }
        let tags = Tags::new(mesh, creases);
        let mut builder = Builder {
            mesh,
            tags: &tags,
            plain: plain_vertices(mesh, &tags),
            surface: Self {
                classes: Classes::default(),
                bases: Vec::new(),
                patches: Vec::with_capacity(mesh.face_count()),
                regular: None,
                blend,
                vertex_count: mesh.vertex_count(),
                sectors: Vec::new(),
                rings: Vec::new(),
            },
            interior: HashMap::new(),
            wide: HashMap::new(),
            by_class: HashMap::new(),
        };
        let blended = builder.blended_vertices()?;
        let regions = if blend == Blend::Smooth {
            Regions::new(mesh, &blended, &|v| builder.is_regular(v), rings)
        } else {
            Regions::default()
        };
        builder.add_sectors(&regions)?;
        for f in mesh.faces() {
            builder.add_patch(f, &blended, &regions)?;
        }
        Ok(builder.surface)
    }

    /// All patches, in the order of the faces.
    #[must_use]
    pub fn patches(&self) -> &[Patch] {
        &self.patches
    }

    /// Number of different bases.
    #[must_use]
    pub fn basis_count(&self) -> usize {
        self.bases.len()
    }

    /// The basis of patches inside a regular grid: bi-cubic B-splines on 16 control points, see
    /// [`Self::b_spline_grid`] for their order.
    #[must_use]
    pub fn regular_basis(&self) -> Option<BasisId> {
        self.regular
    }

    /// How extraordinary vertices are repaired.
    #[must_use]
    pub fn blend(&self) -> Blend {
        self.blend
    }

    /// Fewest and most rings of patches of a smooth blend; `None` without such blends.
    #[must_use]
    pub fn blend_rings(&self) -> Option<[usize; 2]> {
        Some([*self.rings.iter().min()?, *self.rings.iter().max()?])
    }

    /// The sectors of all blends of more than one ring.
    #[must_use]
    pub fn sectors(&self) -> &[GuideSector] {
        &self.sectors
    }

    /// The sector a control point of a patch belongs to if it is no vertex, and its place there.
    #[must_use]
    pub fn coefficient(&self, control: u32) -> Option<(&GuideSector, usize)> {
        let place = (control as usize).checked_sub(self.vertex_count)?;
        Some((&self.sectors[place / MONOMIALS], place % MONOMIALS))
    }

    /// All control points: the mesh's vertices, then the coefficients of guides.
    ///
    /// # Panics
    /// If `positions` is shorter than the mesh's vertices.
    #[must_use]
    pub fn control_points(&self, positions: &[DVec3]) -> Vec<DVec3> {
        let mut out = positions[..self.vertex_count].to_vec();
        for sector in &self.sectors {
            out.extend((0..MONOMIALS).map(|k| sector.coefficient(k, positions)));
        }
        out
    }

    /// Weights on a patch's controls as weights on vertices.
    pub(crate) fn on_vertices(&self, patch: &Patch, weights: &[f64]) -> Vec<(u32, f64)> {
        if let Basis::Wide { cell, guide, .. } = &self.bases[patch.basis.0]
            && let Some((sector, _)) = patch.controls.last().and_then(|&c| self.coefficient(c))
        {
            let spread = guide.spread(*cell, weights);
            return sector.vertices.iter().copied().zip(spread).collect();
        }
        patch.controls.iter().copied().zip(weights.iter().copied()).collect()
    }

    /// Whether the patches of a basis touch a blended extraordinary vertex (at `(0, 0)`).
    #[must_use]
    pub fn is_blended(&self, basis: BasisId) -> bool {
        !matches!(self.bases[basis.0], Basis::Plain { .. }) && !self.is_smooth(basis)
    }

    /// Whether the patches of a basis belong to a blend of several rings.
    #[must_use]
    pub fn is_wide(&self, basis: BasisId) -> bool {
        matches!(self.bases[basis.0], Basis::Wide { .. })
    }

    /// Whether the patches of a basis have all derivatives: B-splines and those inside of a wide
    /// blend that do not touch its vertex.
    #[must_use]
    pub fn is_smooth(&self, basis: BasisId) -> bool {
        match &self.bases[basis.0] {
            Basis::Plain { class } => self.classes.grid(*class).is_some(),
            Basis::Wide { cell, .. } => *cell != (0, 0),
            _ => false,
        }
    }

    /// For a bi-cubic B-spline patch the control points as combinations `(position in the patch's
    /// controls, weight)`; entry `4 i + j` stands at `(i − 1, j − 1)` around the unit square.
    #[must_use]
    pub fn b_spline_grid(&self, basis: BasisId) -> Option<&[Vec<(usize, f64)>; 16]> {
        match &self.bases[basis.0] {
            Basis::Plain { class } => self.classes.grid(*class),
            _ => None,
        }
    }

    /// Jets of the control points' weights at `(u, v)` in the unit square.
    ///
    /// At an extraordinary corner that is not blended the derivatives are those at a point `2⁻⁴⁸`
    /// away from it: the true ones do not exist.
    #[must_use]
    pub fn weights(&self, basis: BasisId, u: f64, v: f64) -> JetWeights {
        match &self.bases[basis.0] {
            Basis::Plain { class } => self.classes.weights(*class, u, v),
            Basis::Guided { class, map, guide } => {
                guide.blend(|u, v| self.classes.weights(*class, u, v), map, u, v)
            }
            Basis::Wide { class, cell, guide } => {
                guide.local_weights(*cell, |u, v| self.classes.weights(*class, u, v), u, v)
            }
            Basis::Flat { class, map, valence } => {
                flat_weights(&self.classes.weights(*class, u, v), map, *valence, u, v)
            }
        }
    }

    /// Position and derivatives of a patch at `(u, v)`.
    ///
    /// `positions` are the mesh's vertices or, which is faster for many points of wide blends, the
    /// [`Self::control_points`].
    ///
    /// # Panics
    /// If `positions` is shorter than the mesh's vertices.
    #[must_use]
    pub fn evaluate(&self, positions: &[DVec3], patch: &Patch, u: f64, v: f64) -> SurfaceJet {
        self.weights(patch.basis, u, v).apply(|k| {
            let control = patch.controls[k];
            match self.coefficient(control) {
                Some((sector, k)) if control as usize >= positions.len() => {
                    sector.coefficient(k, positions)
                }
                _ => positions[control as usize],
            }
        })
    }
}

/// Number of refinements after which all faces are quads and every blended vertex has a regular
/// ring: 0 if `mesh` can be used as it is.
///
/// # Example
/// ```
/// use geom_core::{DVec3, PolyMesh};
/// use subdiv_catmull_clark::{Creases, refine, refinements_needed};
/// let corners = vec![DVec3::ZERO, DVec3::X, DVec3::Y, DVec3::Z];
/// let tetrahedron = PolyMesh::new(corners, &[[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]])?;
/// assert_eq!(refinements_needed(&tetrahedron, &Creases::none()), 2);
/// let once = refine(&tetrahedron, &Creases::none())?;
/// assert_eq!(refinements_needed(&once.mesh, &once.creases), 1);
/// # Ok::<(), geom_core::MeshError>(())
/// ```
#[must_use]
pub fn refinements_needed(mesh: &PolyMesh, creases: &Creases) -> usize {
    let quads = mesh.is_quad_mesh();
    if quads && SubdivisionSurface::new(mesh, creases, Blend::Flat).is_ok() {
        0
    } else if quads {
        1
    } else {
        // The centre of an n-gon is extraordinary and may share a quad with an old vertex.
        let crowded = mesh.faces().any(|f| {
            mesh.face_degree(f) != 4 && mesh.face_vertices(f).any(|v| mesh.valence(v) != 4)
        });
        1 + usize::from(crowded)
    }
}

// Interior vertices of any valence that no crease touches, among quads only.
fn plain_vertices(mesh: &PolyMesh, tags: &Tags) -> Vec<bool> {
    mesh.vertices()
        .map(|v| {
            mesh.outgoing(v).is_some()
                && !mesh.is_boundary_vertex(v)
                && !tags.corner[v.index()]
                && mesh.outgoing_half_edges(v).all(|h| {
                    tags.sharpness[h.index()] == 0.0
                        && tags.shift[h.index()] == 0.0
                        && tags.shift[mesh.twin(h).index()] == 0.0
                })
        })
        .collect()
}

struct Builder<'a> {
    mesh: &'a PolyMesh,
    tags: &'a Tags,
    plain: Vec<bool>,
    surface: SubdivisionSurface,
    // Bases of patches without crease or boundary, by (valence of the first corner, blended).
    interior: HashMap<(usize, bool), BasisId>,
    // Patches of wide blends by number of control points, rings and cell.
    wide: HashMap<(usize, usize, Cell), BasisId>,
    by_class: HashMap<usize, BasisId>,
}

impl Builder<'_> {
    fn is_regular(&self, v: VertexId) -> bool {
        self.plain[v.index()] && self.mesh.valence(v) == 4
    }

    /// Marks the extraordinary vertices to be blended.
    fn blended_vertices(&self) -> Result<Vec<bool>, SubdivisionError> {
        let mut blended = vec![false; self.mesh.vertex_count()];
        for v in self.mesh.vertices() {
            if !self.plain[v.index()] || self.mesh.valence(v) == 4 {
                continue;
            }
            if self.mesh.valence(v) == 2 {
                return Err(SubdivisionError::ValenceTwo { vertex: v.index() });
            }
            if self.surface.blend == Blend::None {
                continue;
            }
            for h in self.mesh.outgoing_half_edges(v) {
                let mut at = h;
                for _ in 0..2 {
                    at = self.mesh.next(at);
                    let neighbour = self.mesh.origin(at);
                    if !self.is_regular(neighbour) {
                        return Err(SubdivisionError::Crowded {
                            vertex: v.index(),
                            neighbour: neighbour.index(),
                        });
                    }
                }
            }
            blended[v.index()] = true;
        }
        Ok(blended)
    }

    fn add_patch(
        &mut self,
        face: FaceId,
        blended: &[bool],
        regions: &Regions,
    ) -> Result<(), SubdivisionError> {
        let mesh = self.mesh;
        if let Some(here) = regions.faces.get(&face) {
            let patch = self.wide_patch(face, here);
            self.surface.patches.push(patch);
            return Ok(());
        }
        let first = mesh.face_half_edge(face);
        let sides: Vec<HalfEdgeId> = mesh.face_half_edges(face).collect();
        let odd: Vec<HalfEdgeId> =
            sides.iter().copied().filter(|&h| !self.is_regular(mesh.origin(h))).collect();
        let patch = match odd[..] {
            [] => self.interior_patch(face, first, false)?,
            [h] if self.plain[mesh.origin(h).index()] => {
                self.interior_patch(face, h, blended[mesh.origin(h).index()])?
            }
            _ => self.general_patch(face, &sides)?,
        };
        self.surface.patches.push(patch);
        Ok(())
    }

    /// A patch whose corners are regular, except perhaps the one `corner` leaves.
    fn interior_patch(
        &mut self,
        face: FaceId,
        corner: HalfEdgeId,
        blended: bool,
    ) -> Result<Patch, SubdivisionError> {
        let mesh = self.mesh;
        let n = mesh.valence(mesh.origin(corner));
        let basis = if let Some(&id) = self.interior.get(&(n, blended)) {
            id
        } else {
            let id = self.interior_basis(face, corner, n, blended)?;
            self.interior.insert((n, blended), id);
            if n == 4 {
                self.surface.regular = Some(id);
            }
            id
        };
        let controls = if blended && self.surface.blend == Blend::Smooth {
            self.two_ring(corner, n)
        } else {
            self.one_ring(corner, n)
        };
        Ok(Patch { face, corner, basis, controls })
    }

    fn interior_basis(
        &mut self,
        face: FaceId,
        corner: HalfEdgeId,
        n: usize,
        blended: bool,
    ) -> Result<BasisId, SubdivisionError> {
        let class = self.interior_class(face.index(), corner, n)?;
        if !blended {
            return Ok(self.push_basis(Basis::Plain { class }));
        }
        let map = self.characteristic_map(face.index(), class, n)?;
        let classes = &self.surface.classes;
        let basis = if self.surface.blend == Blend::Smooth {
            let guide = Guide::new(n, &map, |u, v| classes.weights(class, u, v));
            Basis::Guided { class, map, guide }
        } else {
            Basis::Flat { class, map, valence: n }
        };
        Ok(self.push_basis(basis))
    }

    /// Makes the guides of the blends of several rings.
    fn add_sectors(&mut self, regions: &Regions) -> Result<(), SubdivisionError> {
        self.surface.rings.clone_from(&regions.rings);
        let mut guides: HashMap<(usize, usize), (usize, Arc<WideGuide>)> = HashMap::new();
        for sector in &regions.sectors {
            let (n, rings) = (sector.valence, sector.rings);
            let (class, guide) = match guides.entry((n, rings)) {
                Entry::Occupied(entry) => entry.get().clone(),
                Entry::Vacant(entry) => {
                    let face = self.mesh.face(sector.spoke).map_or(0, FaceId::index);
                    let class = self.interior_class(face, sector.spoke, n)?;
                    let map = self.characteristic_map(face, class, n)?;
                    let classes = &self.surface.classes;
                    let weights = |u, v| classes.weights(class, u, v);
                    entry.insert((class, Arc::new(WideGuide::new(n, rings, &map, weights)))).clone()
                }
            };
            let first = self.surface.vertex_count + MONOMIALS * self.surface.sectors.len();
            let (first, vertices) = (first as u32, sector.vertices.clone());
            self.surface.sectors.push(GuideSector { first, vertices, guide, class });
        }
        Ok(())
    }

    /// Class of a patch whose corners are regular, except perhaps the one `corner` leaves.
    fn interior_class(
        &mut self,
        face: usize,
        corner: HalfEdgeId,
        n: usize,
    ) -> Result<usize, SubdivisionError> {
        let overlapping = SubdivisionError::Overlapping { face };
        let (local, _) =
            LocalPatch::cut(self.mesh, self.tags, corner).ok_or(overlapping.clone())?;
        let classes = &mut self.surface.classes;
        let class = classes.insert(&local).ok_or(overlapping.clone())?;
        if classes.vertex_count(class) == 2 * n + 8 { Ok(class) } else { Err(overlapping) }
    }

    fn characteristic_map(
        &self,
        face: usize,
        class: usize,
        n: usize,
    ) -> Result<Vec<[f64; 2]>, SubdivisionError> {
        let matrix = self.surface.classes.subdivision_matrix(class);
        Ok(characteristic_map(n, matrix.ok_or(SubdivisionError::Overlapping { face })?))
    }

    fn wide_patch(&mut self, face: FaceId, here: &RegionFace) -> Patch {
        let sector = &self.surface.sectors[here.sector];
        let (class, guide) = (sector.class, Arc::clone(&sector.guide));
        let columns = guide.columns(here.cell);
        let mut controls: Vec<u32> = columns.iter().map(|&c| sector.vertices[c]).collect();
        controls.extend((0..MONOMIALS as u32).map(|k| sector.first + k));
        let key = (guide.points(), guide.rings(), here.cell);
        let basis = match self.wide.get(&key) {
            Some(&id) => id,
            None => {
                let id = self.push_basis(Basis::Wide { class, cell: here.cell, guide });
                self.wide.insert(key, id);
                id
            }
        };
        Patch { face, corner: here.corner, basis, controls }
    }

    fn push_basis(&mut self, basis: Basis) -> BasisId {
        self.surface.bases.push(basis);
        BasisId(self.surface.bases.len() - 1)
    }

    /// A patch at the boundary, at a crease, or with several extraordinary corners that are not
    /// blended: turned so that as few classes as possible arise.
    fn general_patch(
        &mut self,
        face: FaceId,
        sides: &[HalfEdgeId],
    ) -> Result<Patch, SubdivisionError> {
        let overlapping = SubdivisionError::Overlapping { face: face.index() };
        let mut best: Option<(Vec<u64>, HalfEdgeId, LocalPatch, Vec<HalfEdgeId>)> = None;
        for &corner in sides {
            let (local, sources) =
                LocalPatch::cut(self.mesh, self.tags, corner).ok_or(overlapping.clone())?;
            let key = local.key();
            if best.as_ref().is_none_or(|(other, ..)| key < *other) {
                best = Some((key, corner, local, sources));
            }
        }
        let (_, corner, local, sources) = best.ok_or(overlapping.clone())?;
        let class = self.surface.classes.insert(&local).ok_or(overlapping)?;
        let basis = if let Some(&id) = self.by_class.get(&class) {
            id
        } else {
            let id = self.push_basis(Basis::Plain { class });
            self.by_class.insert(class, id);
            id
        };
        let controls = sources.iter().map(|&h| self.mesh.origin(h).0).collect();
        Ok(Patch { face, corner, basis, controls })
    }

    /// The `2n + 8` control points of an interior patch, in the order of [`LocalPatch`].
    fn one_ring(&self, corner: HalfEdgeId, n: usize) -> Vec<u32> {
        let mesh = self.mesh;
        let mut out = Vec::with_capacity(2 * n + 8);
        out.push(mesh.origin(corner).0);
        let mut at = corner;
        for _ in 0..n {
            out.push(mesh.target(at).0);
            out.push(mesh.target(mesh.next(at)).0);
            at = mesh.twin(mesh.prev(at));
        }
        self.push_outer(corner, &mut out);
        out
    }

    // The seven points around the far corners: two faces around corner 1, the one opposite of
    // corner 2, two around corner 3.
    fn push_outer(&self, corner: HalfEdgeId, out: &mut Vec<u32>) {
        let mesh = self.mesh;
        let target = |h: HalfEdgeId| mesh.target(h).0;
        // Across the edge from corner 1 to corner 2: c2 → c1 → p → q.
        let east = mesh.next(mesh.twin(mesh.next(corner)));
        let north = mesh.next(mesh.twin(mesh.next(mesh.next(corner))));
        // Around corner 1, below the edge to p.
        let south_east = mesh.twin(east);
        out.push(mesh.origin(mesh.prev(south_east)).0);
        out.push(target(east));
        out.push(target(mesh.next(east)));
        // c3 → c2 → p2 → q2; the diagonal face lies between c2 → q and c2 → p2.
        let diagonal = mesh.twin(north);
        out.push(mesh.origin(mesh.prev(diagonal)).0);
        out.push(target(north));
        out.push(target(mesh.next(north)));
        // Around corner 3, left of the edge to q2.
        let west = mesh.twin(mesh.next(mesh.next(north)));
        out.push(target(mesh.next(west)));
    }

    /// The `6n + 1` control points of a blended patch: the one-ring, then points 1 to 4 of the
    /// outer ones of every sector.
    fn two_ring(&self, corner: HalfEdgeId, n: usize) -> Vec<u32> {
        let mesh = self.mesh;
        let mut out = self.one_ring(corner, n);
        out.truncate(2 * n + 1);
        let mut at = corner;
        let mut outer = Vec::with_capacity(7);
        for _ in 0..n {
            outer.clear();
            self.push_outer(at, &mut outer);
            out.extend_from_slice(&outer[1..5]);
            at = mesh.twin(mesh.prev(at));
        }
        out
    }
}

/// Weights of the surface with the flat spot of Joshi 2008, Eq. 5.3, the tangent plane being
/// parametrised by the characteristic coordinates so that it stays linear in the control points.
fn flat_weights(plain: &JetWeights, map: &[[f64; 2]], n: usize, u: f64, v: f64) -> JetWeights {
    let fade = weight_jet(flat_step, u, v);
    if fade.iter().all(|&w| w == 0.0) {
        return plain.clone();
    }
    let masks = limit_masks(n);
    let coordinates = coordinate_jets(plain, map);
    let mut out = plain.clone();
    for k in 0..plain.control_points() {
        let jet = plain.jet(k);
        let mut difference: Jet = jet.map(|x| -x);
        if k < masks.position.len() {
            difference[0] += masks.position[k];
            for d in 0..JET_LEN {
                difference[d] += masks.tangents[0][k] * coordinates[0][d]
                    + masks.tangents[1][k] * coordinates[1][d];
            }
        }
        let correction = jet_product(&fade, &difference);
        out.set_jet(k, &std::array::from_fn(|d| jet[d] + correction[d]));
    }
    out
}
