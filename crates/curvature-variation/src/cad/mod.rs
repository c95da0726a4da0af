//! The plain limit surface of a control mesh as B-spline surfaces, for CAD.

mod cap;

use crate::chart_net::{self, COARSE, FINE, place};
use crate::splines::{FittedRule, SplinePatchError};
use bspline::{BsplineSurface, Degree, KnotVector};
use cap::{CapRule, DEGREE, SIDE};
use geom_core::{DVec3, FaceId, HalfEdgeId, PolyMesh, VertexId};
use std::collections::BTreeMap;
use std::collections::btree_map::Entry;
use subdiv_catmull_clark::{
    BasisId, Blend, Creases, SubdivisionError, SubdivisionSurface, refine, refinements_needed,
};

/// Most rings of bi-cubic patches around a cap.
const MOST_RINGS: usize = 4;
/// Largest valence that has caps.
const MOST_VALENCE: usize = 32;

/// B-spline surfaces that together are the limit surface of a control mesh, see [`limit_patches`].
#[derive(Clone, Debug)]
pub struct LimitPatches {
    /// The surfaces.
    pub surfaces: Vec<BsplineSurface>,
    /// How many of them are polynomial caps around extraordinary vertices.
    pub caps: usize,
    /// How many are interpolated, at creases and extraordinary vertices of the boundary.
    pub fitted: usize,
    /// Most rings of exact patches around a cap.
    pub rings: usize,
    /// Largest distance from the limit surface, in units of the model; 0 if all of them are exact.
    pub max_deviation: f64,
}

/// Why a control mesh has no surfaces for CAD.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
#[expect(missing_docs, reason = "the messages spell out every field")]
pub enum LimitPatchError {
    /// A tolerance that is none.
    #[error("the tolerance {value} is no share of an edge; give one above 0")]
    Tolerance { value: f64 },
    /// A vertex with more edges than there are caps for.
    #[error("vertex {vertex} has {valence} edges, and caps have at most {most}; divide its faces")]
    Valence { vertex: u32, valence: usize, most: usize },
    /// Four rings do not bring a cap near enough.
    #[error(
        "the surface at vertex {vertex} is met to {reached:.1e} of an edge only, not to \
         {wanted:.1e}; allow that or refine the mesh once"
    )]
    TooFar { vertex: u32, reached: f64, wanted: f64 },
    /// A mesh without a surface.
    #[error(transparent)]
    Subdivision(#[from] SubdivisionError),
    /// A patch that is no spline.
    #[error(transparent)]
    Patch(#[from] SplinePatchError),
}

/// The Catmull-Clark limit surface of `mesh` as B-spline surfaces, nothing blended and nothing
/// faired: exact bi-cubic patches, merged where they are of one ring, and around every
/// extraordinary vertex a cap of one patch of bidegree six in each sector. Caps continue the
/// tangent planes of the ring and of one another exactly; around each vertex there are as many
/// rings, up to four, as bring the caps within `tolerance` of the surface, a share of the mean edge
/// at the vertex after one refinement.
///
/// # Errors
/// [`LimitPatchError`], if more rings were needed or the mesh has no surface.
///
/// # Example
/// ```
/// use curvature_variation::limit_patches;
/// use fixtures::quad_graphs;
/// use subdiv_catmull_clark::Creases;
/// let patches = limit_patches(&quad_graphs::theta_graph(3), &Creases::none(), 1e-4)?;
/// assert!(patches.caps > 0 && patches.fitted == 0 && patches.max_deviation < 1e-3);
/// # Ok::<(), curvature_variation::LimitPatchError>(())
/// ```
pub fn limit_patches(
    mesh: &PolyMesh,
    creases: &Creases,
    tolerance: f64,
) -> Result<LimitPatches, LimitPatchError> {
    if !(tolerance > 0.0) {
        return Err(LimitPatchError::Tolerance { value: tolerance });
    }
    let (mut coarse, mut creases) = (mesh.clone(), creases.clone());
    for _ in 1..refinements_needed(&coarse, &creases).max(1) {
        let refined = refine(&coarse, &creases)?;
        (coarse, creases) = (refined.mesh, refined.creases);
    }
    let refined = refine(&coarse, &creases)?;
    let surface = SubdivisionSurface::new(&refined.mesh, &refined.creases, Blend::Flat)?;
    let mut made = Maker::new(&refined.mesh, &surface, tolerance)?;
    let mut done = vec![false; refined.mesh.face_count()];
    // A coarse face whose patch is exact needs no refinement.
    if coarse.is_quad_mesh()
        && let Ok(surface) = SubdivisionSurface::new(&coarse, &creases, Blend::Flat)
    {
        for patch in surface.patches() {
            if let Some(points) = surface.bezier(coarse.positions(), patch) {
                made.push(points.into_iter().flatten().collect())?;
                done[4 * patch.face.index()..4 * patch.face.index() + 4].fill(true);
            }
        }
    }
    for patch in surface.patches() {
        if done[patch.face.index()] {
            continue;
        }
        if let Some(points) = surface.bezier(refined.mesh.positions(), patch) {
            made.push(points.into_iter().flatten().collect())?;
        } else if surface.is_blended(patch.basis) {
            made.add_middle(refined.mesh.origin(patch.corner))?;
        } else {
            made.add_fitted(patch.face)?;
        }
    }
    Ok(made.out)
}

struct Maker<'m> {
    mesh: &'m PolyMesh,
    surface: &'m SubdivisionSurface,
    tolerance: f64,
    rules: BTreeMap<usize, CapRule>,
    fits: BTreeMap<BasisId, FittedRule>,
    done: Vec<bool>,
    cubic: Degree,
    out: LimitPatches,
}

impl<'m> Maker<'m> {
    fn new(
        mesh: &'m PolyMesh,
        surface: &'m SubdivisionSurface,
        tolerance: f64,
    ) -> Result<Self, SplinePatchError> {
        let out =
            LimitPatches { surfaces: Vec::new(), caps: 0, fitted: 0, rings: 0, max_deviation: 0.0 };
        Ok(Self {
            mesh,
            surface,
            tolerance,
            rules: BTreeMap::new(),
            fits: BTreeMap::new(),
            done: vec![false; mesh.vertex_count()],
            cubic: Degree::new(3)?,
            out,
        })
    }

    /// A bi-cubic patch of one span.
    fn push(&mut self, points: Vec<DVec3>) -> Result<(), SplinePatchError> {
        let knots = KnotVector::clamped_uniform(self.cubic, 4)?;
        self.out.surfaces.push(BsplineSurface::new(knots.clone(), knots, points, None)?);
        Ok(())
    }

    fn mean_edge(&self, vertex: VertexId) -> f64 {
        let at = |v: VertexId| self.mesh.position(v);
        let lengths = self
            .mesh
            .outgoing_half_edges(vertex)
            .map(|h| at(vertex).distance(at(self.mesh.target(h))));
        let lengths: Vec<f64> = lengths.collect();
        lengths.iter().sum::<f64>() / lengths.len() as f64
    }

    /// Rings and caps of all sectors of an extraordinary vertex, unless they are there.
    fn add_middle(&mut self, vertex: VertexId) -> Result<(), LimitPatchError> {
        if std::mem::replace(&mut self.done[vertex.index()], true) {
            return Ok(());
        }
        let valence = self.mesh.valence(vertex);
        let too_many = LimitPatchError::Valence { vertex: vertex.0, valence, most: MOST_VALENCE };
        if valence > MOST_VALENCE {
            return Err(too_many);
        }
        let allowed = self.tolerance * self.mean_edge(vertex);
        let rule = match self.rules.entry(valence) {
            Entry::Occupied(known) => known.into_mut(),
            Entry::Vacant(place) => place.insert(CapRule::new(valence).ok_or(too_many)?),
        };
        let mut net = local_net(self.mesh, vertex, valence);
        let (mut rings, mut reached) = (Vec::new(), f64::INFINITY);
        let mut caps = Vec::new();
        while rings.len() < MOST_RINGS && !(reached <= allowed) {
            caps = rule.patches(&net);
            reached = rule.distance(&net, &caps);
            let fine: Vec<DVec3> = (0..rule.rows.rows())
                .map(|i| rule.rows.row(i).iter().zip(&net).map(|(w, p)| *w * *p).sum())
                .collect();
            rings.push(fine);
            net = rule.finer(&net);
        }
        if !(reached <= allowed) {
            let share = self.tolerance / allowed;
            let (reached, wanted) = (reached * share, self.tolerance);
            return Err(LimitPatchError::TooFar { vertex: vertex.0, reached, wanted });
        }
        self.out.rings = self.out.rings.max(rings.len());
        self.out.max_deviation = self.out.max_deviation.max(reached);
        self.out.caps += valence;
        for fine in &rings {
            for sector in 0..valence {
                let at = |a: isize, b: isize| fine[place(valence, sector, [a, b], FINE)];
                // Beside the cap and at its corner, then the other side.
                self.out.surfaces.push(spans(self.cubic, [4, 5], |i, j| at(i, j - 1))?);
                self.out.surfaces.push(spans(self.cubic, [4, 4], |i, j| at(i - 1, j))?);
            }
        }
        let sextic = Degree::new(DEGREE).map_err(SplinePatchError::from)?;
        for cap in caps {
            let knots = KnotVector::clamped_uniform(sextic, SIDE);
            let knots = knots.map_err(SplinePatchError::from)?;
            let patch = BsplineSurface::new(knots.clone(), knots, cap.to_vec(), None);
            self.out.surfaces.push(patch.map_err(SplinePatchError::from)?);
        }
        Ok(())
    }

    /// A patch at a crease or at the boundary that is no polynomial.
    fn add_fitted(&mut self, face: FaceId) -> Result<(), LimitPatchError> {
        let surface = self.surface;
        let patch = &surface.patches()[face.index()];
        let valence = self.mesh.valence(self.mesh.origin(patch.corner));
        let rule = match self.fits.entry(patch.basis) {
            Entry::Occupied(known) => known.into_mut(),
            Entry::Vacant(place) => place.insert(FittedRule::new(surface, patch.basis, valence)?),
        };
        let positions = self.mesh.positions();
        let control = |k: usize| positions[patch.controls[k] as usize];
        let fitted = rule.fit(&control);
        let (fitted, deviation) = fitted.map_err(SplinePatchError::from)?;
        let vertex = self.mesh.origin(patch.corner);
        let share = deviation / self.mean_edge(vertex);
        if !(share <= self.tolerance) {
            let wanted = self.tolerance;
            return Err(LimitPatchError::TooFar { vertex: vertex.0, reached: share, wanted });
        }
        self.out.fitted += 1;
        self.out.max_deviation = self.out.max_deviation.max(deviation);
        self.out.surfaces.push(fitted);
        Ok(())
    }
}

/// The control points around a vertex with a regular ring of faces, see [`chart_net`].
fn local_net(mesh: &PolyMesh, vertex: VertexId, valence: usize) -> Vec<DVec3> {
    let mut points = vec![mesh.position(vertex); chart_net::count(valence, COARSE)];
    let Some(first) = mesh.outgoing(vertex) else { return points };
    let mut along = first;
    for sector in 0..valence {
        let mut set = |a: isize, b: isize, h: HalfEdgeId| {
            points[place(valence, sector, [a, b], COARSE)] = mesh.position(mesh.target(h));
        };
        let up = mesh.next(along);
        let back = mesh.next(up);
        set(1, 0, along);
        set(1, 1, up);
        // The neighbours beyond both outer sides, and between them.
        let right = mesh.next(mesh.twin(up));
        set(2, 0, right);
        set(2, 1, mesh.next(right));
        let above = mesh.next(mesh.twin(back));
        set(1, 2, above);
        let corner = mesh.twin(mesh.next(mesh.next(right)));
        set(2, 2, mesh.next(corner));
        along = mesh.twin(mesh.prev(along));
    }
    points
}

/// A bi-cubic spline over equal spans from the points of a uniform one, the same with clamped
/// knots.
fn spans(
    cubic: Degree,
    [n_u, n_v]: [usize; 2],
    at: impl Fn(isize, isize) -> DVec3,
) -> Result<BsplineSurface, SplinePatchError> {
    let (rows_u, rows_v) = (clamped_rows(n_u), clamped_rows(n_v));
    let mut points = Vec::with_capacity(n_u * n_v);
    for weights_u in &rows_u {
        for weights_v in &rows_v {
            let mut sum = DVec3::ZERO;
            for (i, u) in weights_u.iter().enumerate() {
                for (j, v) in weights_v.iter().enumerate().filter(|_| *u != 0.0) {
                    sum += u * v * at(i as isize, j as isize);
                }
            }
            points.push(sum);
        }
    }
    let knots = |n: usize| KnotVector::clamped_uniform(cubic, n);
    Ok(BsplineSurface::new(knots(n_u)?, knots(n_v)?, points, None)?)
}

/// Control points of one or two clamped cubic spans by those of a uniform spline.
fn clamped_rows(n: usize) -> Vec<Vec<f64>> {
    let sixth = 1.0 / 6.0;
    let third = 1.0 / 3.0;
    let rows: &[&[f64]] = match n {
        4 => &[
            &[sixth, 4.0 * sixth, sixth, 0.0],
            &[0.0, 2.0 * third, third, 0.0],
            &[0.0, third, 2.0 * third, 0.0],
            &[0.0, sixth, 4.0 * sixth, sixth],
        ],
        _ => &[
            &[sixth, 4.0 * sixth, sixth, 0.0, 0.0],
            &[0.0, 2.0 * third, third, 0.0, 0.0],
            &[0.0, 0.0, 1.0, 0.0, 0.0],
            &[0.0, 0.0, third, 2.0 * third, 0.0],
            &[0.0, 0.0, sixth, 4.0 * sixth, sixth],
        ],
    };
    rows.iter().map(|row| row.to_vec()).collect()
}
