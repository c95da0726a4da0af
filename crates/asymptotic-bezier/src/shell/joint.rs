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
use gp_solver::{SolverError, SparseCholesky, SymmetricPattern};
use numerics::{Matrix, affine_space, axpy};
use rayon::prelude::*;

use crate::boundary::four_curves::PatchBoundary;
use crate::boundary::solved::Boundary;
use crate::curve::bernstein::{bernstein, eval};
use crate::data::corners::{AsymptoticNet, NetFace};
use crate::error::{AsymptoticError, AsymptoticWarning, Place};
use crate::patch::family::{CORNER_TOL, INWARD, PatchFamily, RANK_TOL};
use crate::patch::field::{FieldSpace, tangent_fields};
use crate::patch::mask::thin_plate_energy;
use crate::patch::solve::FilledPatch;
use crate::patch::surface::Patch;
use crate::patch::thin_plate::{fill_table, thin_plate_block};

/// Opposite tangents may differ by this much, relative to their length.
const OPPOSITE_TOL: f64 = 1e-9;
/// Weight of the jumps of `N · R_vv` against the thin-plate energy: larger ones cost digits.
const JUMP_WEIGHT: f64 = 1e2;
/// Rounds of the method of multipliers, each of which acts like more weight in the directions that need it.
const JUMP_ROUNDS: usize = 20;
/// Samples of the jump along a curve: more than the coefficients of its polynomial.
const JUMP_SAMPLES: usize = 21;

/// How patches of a net join across their common curves.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Joins {
    /// Common tangent planes; each patch has its own least thin-plate energy.
    #[default]
    G1,
    /// Common cross derivatives where the boundary curves continue one another.
    C1,
    /// C1, and the least jump of the mean curvature, zero where the net allows it.
    G2,
}

/// The joint problem of a net.
struct Joint<'a> {
    net: &'a AsymptoticNet,
    degree: usize,
    /// Fields along each curve, in its direction.
    spaces: Vec<FieldSpace>,
    /// Whether both sides of a curve share one field.
    shared: Vec<bool>,
    families: Vec<PatchFamily>,
    /// First raw coefficient of each side of each face.
    starts: Vec<[usize; 4]>,
    raw: usize,
}

/// One coefficient vector for all fields as an affine function of the free unknowns.
struct Freedoms {
    particular: Vec<f64>,
    /// Per raw coefficient, its unknowns and their factors.
    null: Vec<Vec<(usize, f64)>>,
    count: usize,
}

/// Fills all faces of a net in one system, and tells which curves got a common cross derivative;
/// `Joins::G1` patches are filled one by one elsewhere.
///
/// # Errors
/// [`AsymptoticError::Degree`] below one more than the degree of the curves, and
/// [`AsymptoticError::CornerEquations`] where tangents and twists contradict one another,
/// [`AsymptoticError::Joint`] when the system cannot be factorised.
pub(crate) fn fill_joint(
    net: &AsymptoticNet,
    boundary: &Boundary,
    outlines: &[PatchBoundary],
    degree: Option<usize>,
    joins: Joins,
) -> Result<(Vec<FilledPatch>, Vec<bool>), AsymptoticError> {
    let p = boundary.curves[0].degree();
    let n = degree.unwrap_or(p + 2);
    let (min, max) = (p + 1, crate::patch::thin_plate::MAX_SURFACE_DEGREE);
    if !(min..=max).contains(&n) {
        return Err(AsymptoticError::Degree {
            what: "jointly filled surface",
            degree: n,
            min,
            max,
        });
    }
    let mut shared = continued(net);
    loop {
        let joint = Joint::new(net, boundary, outlines, n, shared.clone());
        match joint.freedoms() {
            Ok(freedoms) => {
                let patches = joint.solve(freedoms, joins).map_err(AsymptoticError::Joint)?;
                return Ok((patches, shared));
            }
            Err((vertex, residual)) => {
                // Where the twists contradict one another the joins at that vertex stay G1.
                let before = shared.clone();
                for (curve, shared) in net.curves.iter().zip(&mut shared) {
                    *shared &= !curve.ends.contains(&vertex);
                }
                if shared == before {
                    let place = net.vertex_place(vertex);
                    return Err(AsymptoticError::CornerEquations { place, residual });
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
    fn raw_of(&self, f: usize, c: usize) -> usize {
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

    /// Minimises the energy of all patches together.
    fn solve(mut self, freedoms: Freedoms, joins: Joins) -> Result<Vec<FilledPatch>, SolverError> {
        // The unknowns of each face, and its family in terms of them.
        let unknowns: Vec<Vec<usize>> = (0..self.families.len())
            .map(|f| {
                let total = self.families[f].offsets[4];
                let mut list: Vec<usize> = (0..total)
                    .flat_map(|c| freedoms.null[self.raw_of(f, c)].iter().map(|(y, _)| *y))
                    .collect();
                list.sort_unstable();
                list.dedup();
                list
            })
            .collect();
        let raw: Vec<Vec<usize>> = (0..self.families.len())
            .map(|f| (0..self.families[f].offsets[4]).map(|c| self.raw_of(f, c)).collect())
            .collect();
        self.families.par_iter_mut().enumerate().for_each(|(f, family)| {
            let list = &unknowns[f];
            family.particular = raw[f].iter().map(|c| freedoms.particular[*c]).collect();
            family.null = Matrix::zeros(raw[f].len(), list.len());
            for (i, c) in raw[f].iter().enumerate() {
                for (y, value) in &freedoms.null[*c] {
                    if let Ok(j) = list.binary_search(y) {
                        family.null[(i, j)] = *value;
                    }
                }
            }
            family.reduce();
        });
        match joins {
            Joins::G2 => self.solve_smooth(&unknowns, freedoms.count),
            Joins::G1 | Joins::C1 => {
                let elements: Vec<Element> = self
                    .families
                    .iter()
                    .zip(&unknowns)
                    .map(|(family, list)| Element {
                        unknowns: list.clone(),
                        hessian: family.hessian.clone(),
                        gradient: family.gradient.clone(),
                    })
                    .collect();
                let y = minimize(freedoms.count, &elements, &[])?;
                let patches = self
                    .families
                    .iter()
                    .zip(&unknowns)
                    .enumerate()
                    .map(|(f, (family, list))| {
                        let own: Vec<f64> = list.iter().map(|k| y[*k]).collect();
                        let (patch, energy) = family.patch(&own);
                        self.filled(f, patch, energy, own.len())
                    })
                    .collect();
                Ok(patches)
            }
        }
    }

    fn filled(&self, f: usize, patch: Patch, energy: f64, freedoms: usize) -> FilledPatch {
        let open = self.net.faces[f].curves.iter().filter(|c| !self.shared[**c]).count();
        let shared = self.net.faces[f].curves.len() - open;
        let mut warnings = Vec::new();
        if patch.least_sine(16) <= 0.0 {
            let place = Place::Patch(f);
            warnings.push(AsymptoticWarning::JointFold { place, shared });
        }
        FilledPatch {
            patch,
            thin_plate_energy: energy,
            freedoms,
            transversality: f64::NAN,
            warnings,
        }
    }

    /// As [`Joint::solve`] with the jumps of `N · R_vv` in the energy; the inner control points
    /// are unknowns then.
    fn solve_smooth(
        &self,
        unknowns: &[Vec<usize>],
        first: usize,
    ) -> Result<Vec<FilledPatch>, SolverError> {
        let n = self.degree;
        let table = fill_table(n);
        let inner = 3 * table.inner.len();
        let blocks = InnerBlocks {
            second: thin_plate_block(n, &table.second, &table.second),
            second_border: thin_plate_block(n, &table.second, &table.border),
            inner: thin_plate_block(n, &table.inner, &table.inner),
            inner_second: thin_plate_block(n, &table.inner, &table.second),
            inner_border: thin_plate_block(n, &table.inner, &table.border),
        };
        let lists: Vec<Vec<usize>> = unknowns
            .iter()
            .enumerate()
            .map(|(f, list)| {
                let own = first + f * inner..first + (f + 1) * inner;
                list.iter().copied().chain(own).collect()
            })
            .collect();
        let elements: Vec<Element> = self
            .families
            .par_iter()
            .zip(&lists)
            .map(|(family, list)| blocks.element(family, list))
            .collect();
        let mut sides: Vec<Vec<(usize, usize)>> = vec![Vec::new(); self.spaces.len()];
        for (f, face) in self.net.faces.iter().enumerate() {
            for (k, c) in face.curves.iter().enumerate() {
                sides[*c].push((f, k));
            }
        }
        let jumps: Vec<Element> = (0..sides.len())
            .into_par_iter()
            .filter(|c| self.shared[*c])
            .map(|c| self.jump(c, &sides[c], &lists))
            .collect();
        let y = minimize(first + self.families.len() * inner, &elements, &jumps)?;
        let patches = self
            .families
            .par_iter()
            .zip(&lists)
            .enumerate()
            .map(|(f, (family, list))| {
                let own: Vec<f64> = list.iter().map(|k| y[*k]).collect();
                let split = own.len() - inner;
                let mut points = family.patch(&own[..split]).0.points().to_vec();
                for (r, (i, j)) in table.inner.iter().enumerate() {
                    let at = |axis: usize| own[split + axis * table.inner.len() + r];
                    points[i * (n + 1) + j] = family.origin + DVec3::new(at(0), at(1), at(2));
                }
                let patch = Patch::new(n, points);
                let energy = thin_plate_energy(&patch);
                self.filled(f, patch, energy, own.len())
            })
            .collect();
        Ok(patches)
    }

    /// `w ∫ (N · (R_vv left − R_vv right))² dt` along curve `c`.
    fn jump(&self, c: usize, sides: &[(usize, usize)], lists: &[Vec<usize>]) -> Element {
        let n = self.degree;
        let mut unknowns: Vec<usize> =
            sides.iter().flat_map(|(f, _)| lists[*f].iter().copied()).collect();
        unknowns.sort_unstable();
        unknowns.dedup();
        let mut rows = Vec::with_capacity(JUMP_SAMPLES);
        for s in 0..JUMP_SAMPLES {
            let t = s as f64 / (JUMP_SAMPLES - 1) as f64;
            let normal = self.spaces[c].normal.as_ref().map_or(DVec3::Z, |p| eval(p, t));
            let normal = normal.normalize_or_zero();
            let basis = bernstein(n, t);
            let (mut constant, mut row) = (0.0, vec![0.0; unknowns.len()]);
            for (&(f, k), sign) in sides.iter().zip([1.0, -1.0]) {
                let face = &self.net.faces[f];
                for (i, b) in basis.iter().enumerate() {
                    let along = if face.reversed[k] { n - i } else { i };
                    for (depth, stencil) in [1.0, -2.0, 1.0].into_iter().enumerate() {
                        let across = if k < 2 { depth } else { n - depth };
                        let at = if k == 0 || k == 2 { (along, across) } else { (across, along) };
                        let weight = normal * (sign * b * stencil * (n * (n - 1)) as f64);
                        constant += self.affine(f, at, weight, |column, value| {
                            if let Ok(j) = unknowns.binary_search(&lists[f][column]) {
                                row[j] += value;
                            }
                        });
                    }
                }
            }
            rows.push((constant, row));
        }
        // Only what occurs, so that the matrix stays sparse.
        let used: Vec<usize> =
            (0..unknowns.len()).filter(|j| rows.iter().any(|(_, r)| r[*j] != 0.0)).collect();
        let m = used.len();
        let (mut hessian, mut gradient) = (Matrix::zeros(m, m), vec![0.0; m]);
        let weight = JUMP_WEIGHT / JUMP_SAMPLES as f64;
        for (constant, row) in &rows {
            for (a, i) in used.iter().enumerate() {
                gradient[a] += weight * row[*i] * constant;
                for (b, j) in used.iter().enumerate() {
                    hessian[(a, b)] += weight * row[*i] * row[*j];
                }
            }
        }
        Element { unknowns: used.iter().map(|j| unknowns[*j]).collect(), hessian, gradient }
    }

    /// `weight · Q_at`: returns the constant part and reports the face's columns.
    fn affine(
        &self,
        f: usize,
        at: (usize, usize),
        weight: DVec3,
        mut report: impl FnMut(usize, f64),
    ) -> f64 {
        let (family, table) = (&self.families[f], fill_table(self.degree));
        let ring = at.0.min(at.1).min(self.degree - at.0).min(self.degree - at.1);
        match ring {
            0 => weight.dot(family.border_point(at)),
            1 => {
                let r = table.second.iter().position(|p| *p == at).unwrap_or(0);
                for axis in 0..3 {
                    for (column, slope) in family.slopes[axis].row(r).iter().enumerate() {
                        if *slope != 0.0 {
                            report(column, weight[axis] * slope);
                        }
                    }
                }
                weight.dot(family.second[r])
            }
            _ => {
                let r = table.inner.iter().position(|p| *p == at).unwrap_or(0);
                for axis in 0..3 {
                    let column = family.null.cols() + axis * table.inner.len() + r;
                    report(column, weight[axis]);
                }
                0.0
            }
        }
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

/// Blocks of the thin-plate matrix with the inner points kept.
struct InnerBlocks {
    second: Matrix,
    second_border: Matrix,
    inner: Matrix,
    inner_second: Matrix,
    inner_border: Matrix,
}

impl InnerBlocks {
    /// The thin-plate energy of one face in its field freedoms and its inner points.
    fn element(&self, family: &PatchFamily, unknowns: &[usize]) -> Element {
        let (ny, ni) = (family.null.cols(), self.inner.rows());
        let table = fill_table(family.degree);
        let mut hessian = Matrix::zeros(unknowns.len(), unknowns.len());
        let mut gradient = vec![0.0; unknowns.len()];
        for axis in 0..3 {
            let slopes = &family.slopes[axis];
            let b: Vec<f64> = table.border.iter().map(|p| family.border_point(*p)[axis]).collect();
            let s: Vec<f64> = family.second.iter().map(|p| p[axis]).collect();
            let mut on_second = self.second.apply(&s);
            axpy(1.0, &self.second_border.apply(&b), &mut on_second);
            let mut on_inner = self.inner_second.apply(&s);
            axpy(1.0, &self.inner_border.apply(&b), &mut on_inner);
            let stiff = slopes.transpose_product(&self.second.product(slopes));
            let cross = self.inner_second.product(slopes);
            let first = ny + axis * ni;
            for (i, force) in slopes.apply_transpose(&on_second).into_iter().enumerate() {
                gradient[i] += force;
                for j in 0..ny {
                    hessian[(i, j)] += stiff[(i, j)];
                }
            }
            for r in 0..ni {
                gradient[first + r] = on_inner[r];
                for q in 0..ni {
                    hessian[(first + r, first + q)] = self.inner[(r, q)];
                }
                for j in 0..ny {
                    hessian[(first + r, j)] = cross[(r, j)];
                    hessian[(j, first + r)] = cross[(r, j)];
                }
            }
        }
        Element { unknowns: unknowns.to_vec(), hessian, gradient }
    }
}

/// A share `½ yᵀ H y + gᵀ y` of the energy in a few of the unknowns.
struct Element {
    unknowns: Vec<usize>,
    hessian: Matrix,
    gradient: Vec<f64>,
}

/// The minimum of the sum of the elements, where squares as small as can be are wanted of
/// `constraints`; unknowns without energy stay zero.
fn minimize(
    n: usize,
    elements: &[Element],
    constraints: &[Element],
) -> Result<Vec<f64>, SolverError> {
    let all = || elements.iter().chain(constraints);
    let pairs = |e: &Element| {
        let u = e.unknowns.clone();
        (0..u.len()).flat_map(move |a| {
            let u = u.clone();
            (0..=a).map(move |b| (u[a], u[b]))
        })
    };
    let diagonal = (0..n).map(|i| (i, i));
    let pattern = SymmetricPattern::new(n, all().flat_map(pairs).chain(diagonal))?;
    let mut values = vec![0.0; pattern.len()];
    let mut x = vec![0.0; n];
    for e in all() {
        for (a, i) in e.unknowns.iter().enumerate() {
            x[*i] -= e.gradient[a];
            for (b, j) in e.unknowns[..=a].iter().enumerate() {
                let slot = pattern.slot(*i, *j).expect("the pattern has every entry");
                values[slot] += e.hessian[(a, b)];
            }
        }
    }
    let mut right = x.clone();
    let mut shifted = values.clone();
    for i in 0..n {
        let slot = pattern.slot(i, i).expect("the pattern has the diagonal");
        // Flat directions stay near zero; refinement below takes the shift out of the others.
        shifted[slot] += 1e-13 * values[slot] + f64::MIN_POSITIVE;
        if shifted[slot] == f64::MIN_POSITIVE {
            shifted[slot] = 1.0;
        }
    }
    let mut factor = SparseCholesky::new(pattern)?;
    factor.factor(&shifted)?;
    factor.solve_in_place(&mut x);
    let mut image = vec![0.0; n];
    let rounds = if constraints.is_empty() { 1 } else { JUMP_ROUNDS };
    for round in 0..rounds {
        if round > 0 {
            // Multipliers: the forces of the constraints stay on, whatever is left of them.
            for e in constraints {
                let own: Vec<f64> = e.unknowns.iter().map(|i| x[*i]).collect();
                for (a, force) in e.hessian.apply(&own).into_iter().enumerate() {
                    right[e.unknowns[a]] -= force + e.gradient[a];
                }
            }
        }
        // The last round is refined once more.
        for _ in 0..1 + usize::from(round + 1 == rounds) {
            factor.pattern().multiply(&values, &x, &mut image);
            let mut step: Vec<f64> = right.iter().zip(&image).map(|(r, y)| r - y).collect();
            factor.solve_in_place(&mut step);
            axpy(1.0, &step, &mut x);
        }
    }
    Ok(x)
}
