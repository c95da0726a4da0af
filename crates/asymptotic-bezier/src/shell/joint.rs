//! All patches of a net at once: joins with continuous cross derivative (C1), and with the least
//! jump of the mean curvature (G2 where it can vanish).
//!
//! A patch on each side of a curve takes the same field `W` of cross derivatives, so the patches
//! share unknowns and one sparse system replaces the many small ones. This asks for opposite
//! tangents of the boundary curves that meet at both ends of the curve; joins without them stay
//! G1. Across a C1 join the second fundamental forms differ in `N · R_vv` alone. Its jump is a
//! linear function of the control points because the normals along asymptotic curves are known
//! beforehand; its mean square is added to the thin-plate energy with a large weight, so it
//! vanishes where the net allows it (the derivatives of the torsions along through-curves must
//! agree at the vertices, which nets of one smooth surface have) and is least elsewhere.

use geom_core::DVec3;
use numerics::{Matrix, affine_space};
use rayon::prelude::*;

use crate::boundary::four_curves::PatchBoundary;
use crate::boundary::solved::Boundary;
use crate::data::corners::{AsymptoticNet, NetFace};
use crate::error::Error;
use crate::patch::family::{CORNER_TOL, INWARD, PatchFamily, RANK_TOL};
use crate::patch::field::{FieldSpace, tangent_fields};

/// Opposite tangents may differ by this much, relative to their length.
const OPPOSITE_TOL: f64 = 1e-9;
/// The joint problem of a net.
pub(super) struct Joint<'a> {
    pub(super) net: &'a AsymptoticNet,
    pub(super) degree: usize,
    /// Fields along each curve, in its direction.
    pub(super) spaces: Vec<FieldSpace>,
    /// Whether both sides of a curve share one field.
    pub(super) shared: Vec<bool>,
    pub(super) families: Vec<PatchFamily>,
    /// First raw coefficient of each side of each face.
    starts: Vec<[usize; 4]>,
    raw: usize,
}

/// One coefficient vector for all fields as an affine function of the free unknowns.
pub(super) struct Freedoms {
    pub(super) particular: Vec<f64>,
    /// Per raw coefficient, its unknowns and their factors.
    pub(super) null: Vec<Vec<(usize, f64)>>,
    pub(super) count: usize,
}

/// The fields of all faces and their freedoms.
///
/// # Errors
/// [`Error::Degree`] below one more than the degree of the curves, and [`Error::CornerEquations`]
/// where tangents and twists contradict one another.
pub(super) fn started<'a>(
    net: &'a AsymptoticNet,
    boundary: &Boundary,
    outlines: &[PatchBoundary],
    degree: Option<usize>,
) -> Result<(Joint<'a>, Freedoms), Error> {
    let p = boundary.curves[0].degree();
    let n = degree.unwrap_or(p + 2);
    let (min, max) = (p + 1, crate::patch::thin_plate::MAX_SURFACE_DEGREE);
    if !(min..=max).contains(&n) {
        return Err(Error::Degree { what: "jointly filled surface", degree: n, min, max });
    }
    let mut shared = continued(net);
    loop {
        let joint = Joint::new(net, boundary, outlines, n, shared.clone());
        match joint.freedoms() {
            Ok(freedoms) => return Ok((joint, freedoms)),
            Err((vertex, residual)) => {
                // Where the twists contradict one another the joins at that vertex stay G1.
                let before = shared.clone();
                for (curve, shared) in net.curves.iter().zip(&mut shared) {
                    *shared &= !curve.ends.contains(&vertex);
                }
                if shared == before {
                    let place = net.vertex_place(vertex);
                    return Err(Error::CornerEquations { place, residual });
                }
            }
        }
    }
}

/// Per curve, whether it lies between two faces whose other curves at both ends continue one
/// another with the same parameter speed.
fn continued(net: &AsymptoticNet) -> Vec<bool> {
    let mut across: Vec<[Vec<DVec3>; 2]> = vec![Default::default(); net.curves.len()];
    for face in &net.faces {
        let arm = |k: usize, e: usize| {
            let end = if face.reversed[k] { 1 - e } else { e };
            net.curves[face.curves[k]].arms[end]
        };
        for k in 0..4 {
            // The sides at the start and end of side k, and their ends there.
            let next = [[(1, 0), (3, 0)], [(0, 0), (2, 0)], [(1, 1), (3, 1)], [(0, 1), (2, 1)]][k];
            for (e, (side, end)) in next.into_iter().enumerate() {
                let own = if face.reversed[k] { 1 - e } else { e };
                across[face.curves[k]][own].push(arm(side, end));
            }
        }
    }
    let opposite = |pair: &Vec<DVec3>| {
        pair.len() == 2 && (pair[0] + pair[1]).length() <= OPPOSITE_TOL * pair[0].length()
    };
    across.iter().map(|ends| ends.iter().all(opposite)).collect()
}

/// `+1` where side `k` of the face lies to the left of the net's curve, `−1` otherwise.
fn side_of(face: &NetFace, k: usize) -> f64 {
    let forward = k == 0 || k == 3;
    if forward == face.reversed[k] { -1.0 } else { 1.0 }
}

impl<'a> Joint<'a> {
    fn new(
        net: &'a AsymptoticNet,
        boundary: &Boundary,
        outlines: &[PatchBoundary],
        degree: usize,
        shared: Vec<bool>,
    ) -> Self {
        let mut ribbons = vec![None; net.curves.len()];
        for (face, outline) in net.faces.iter().zip(outlines) {
            for k in 0..4 {
                let mut ribbon = outline.ribbons[k];
                if let (true, Some(ribbon)) = (face.reversed[k], &mut ribbon) {
                    ribbon.reverse();
                }
                ribbons[face.curves[k]] = ribbon;
            }
        }
        let spaces: Vec<FieldSpace> = (0..net.curves.len())
            .into_par_iter()
            .map(|i| {
                let (line, inflections) = (net.curves[i].line, &boundary.inflections[i]);
                tangent_fields(&boundary.curves[i], line, inflections, ribbons[i].as_ref(), degree)
            })
            .collect();
        let families = net
            .faces
            .par_iter()
            .zip(outlines)
            .map(|(face, outline)| {
                let spaces = std::array::from_fn(|k| {
                    // The shared field points to the left of the net's curve, those of a patch
                    // with its parameter.
                    let sign = INWARD[k] * side_of(face, k);
                    oriented(&spaces[face.curves[k]], face.reversed[k], sign)
                });
                PatchFamily::framed(outline, degree, spaces)
            })
            .collect();
        let mut joint = Self { net, degree, spaces, shared, families, starts: Vec::new(), raw: 0 };
        joint.number();
        joint
    }

    /// Gives every field its coefficients: one set for a shared curve, one per side otherwise.
    fn number(&mut self) {
        let mut of_curve = vec![None; self.spaces.len()];
        for face in &self.net.faces {
            let starts = face.curves.map(|c| {
                let known = if self.shared[c] { of_curve[c] } else { None };
                known.unwrap_or_else(|| {
                    let start = self.raw;
                    self.raw += self.spaces[c].fields.len();
                    of_curve[c] = Some(start);
                    start
                })
            });
            self.starts.push(starts);
        }
    }

    /// The raw coefficient behind column `c` of a face's family.
    pub(super) fn raw_of(&self, f: usize, c: usize) -> usize {
        let offsets = &self.families[f].offsets;
        let k = (0..4).rfind(|k| offsets[*k] <= c).unwrap_or(0);
        self.starts[f][k] + c - offsets[k]
    }

    /// Solves the corner equations vertex by vertex; an error names a vertex without solution.
    fn freedoms(&self) -> Result<Freedoms, (usize, f64)> {
        let mut corners: Vec<Vec<(usize, usize)>> = vec![Vec::new(); self.net.positions.len()];
        for (f, face) in self.net.faces.iter().enumerate() {
            for c in 0..4 {
                corners[self.net.face_corner(face, c)].push((f, c));
            }
        }
        let equations: Vec<_> =
            self.families.par_iter().map(PatchFamily::corner_equations).collect();
        let mut scale = vec![1.0; self.raw];
        for (f, family) in self.families.iter().enumerate() {
            for (c, s) in family.scales().into_iter().enumerate() {
                scale[self.raw_of(f, c)] = s;
            }
        }
        let solved: Vec<_> = corners
            .par_iter()
            .map(|corners| {
                let mut columns: Vec<usize> = Vec::new();
                let mut rows: Vec<(Vec<(usize, DVec3)>, DVec3)> = Vec::new();
                for &(f, c) in corners {
                    for (entries, right) in &equations[f][c] {
                        let row: Vec<(usize, DVec3)> =
                            entries.iter().map(|(k, d)| (self.raw_of(f, *k), *d)).collect();
                        columns.extend(row.iter().map(|(k, _)| *k));
                        rows.push((row, *right));
                    }
                }
                columns.sort_unstable();
                columns.dedup();
                let mut matrix = Matrix::zeros(3 * rows.len(), columns.len());
                let mut right = vec![0.0; 3 * rows.len()];
                for (r, (row, value)) in rows.iter().enumerate() {
                    for axis in 0..3 {
                        right[3 * r + axis] = value[axis];
                        for (k, d) in row {
                            if let Ok(c) = columns.binary_search(k) {
                                matrix[(3 * r + axis, c)] += d[axis];
                            }
                        }
                    }
                }
                let scale: Vec<f64> = columns.iter().map(|c| scale[*c]).collect();
                let space = affine_space(&matrix, &right, &scale, RANK_TOL);
                (columns, space)
            })
            .collect();
        let mut out = Freedoms {
            particular: vec![0.0; self.raw],
            null: vec![Vec::new(); self.raw],
            count: 0,
        };
        let mut touched = vec![false; self.raw];
        for (v, (columns, space)) in solved.iter().enumerate() {
            let size = corners[v].iter().map(|(f, _)| self.families[*f].size()).fold(0.0, f64::max);
            if !(space.residual <= CORNER_TOL * size) {
                return Err((v, space.residual));
            }
            for (i, c) in columns.iter().enumerate() {
                debug_assert!(
                    !touched[*c],
                    "one more degree than the curves separates the corners"
                );
                touched[*c] = true;
                out.particular[*c] = space.particular[i];
                out.null[*c] =
                    (0..space.null.cols()).map(|j| (out.count + j, space.null[(i, j)])).collect();
            }
            out.count += space.null.cols();
        }
        for c in (0..self.raw).filter(|c| !touched[*c]) {
            out.null[c].push((out.count, scale[c]));
            out.count += 1;
        }
        Ok(out)
    }
}

/// `sign ·` the fields, in the direction of the face.
fn oriented(space: &FieldSpace, reversed: bool, sign: f64) -> FieldSpace {
    let turned = |p: &Vec<DVec3>, sign: f64| -> Vec<DVec3> {
        let signed = p.iter().map(|c| *c * sign);
        if reversed { signed.rev().collect() } else { signed.collect() }
    };
    FieldSpace {
        fields: space.fields.iter().map(|f| turned(f, sign)).collect(),
        normal: space.normal.as_ref().map(|p| turned(p, 1.0)),
    }
}
