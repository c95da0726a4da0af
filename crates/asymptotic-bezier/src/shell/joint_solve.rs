//! The minimum of all patches of a net at once.

use geom_core::DVec3;
use gp_solver::{
    Group, Problem, QuadraticForm, QuadraticTerm, SolverError, SparseQp, Status, Variables,
};
use numerics::{Matrix, axpy};
use rayon::prelude::*;

use crate::boundary::four_curves::PatchBoundary;
use crate::boundary::solved::Boundary;
use crate::curve::bernstein::{bernstein, eval};
use crate::data::corners::AsymptoticNet;
use crate::error::{Error, Place};
use crate::patch::extension::{Points, held_equations, tangent_planes};
use crate::patch::family::PatchFamily;
use crate::patch::mask::thin_plate_energy;
use crate::patch::plate_block::ThinPlate;
use crate::patch::solve::FilledPatch;
use crate::patch::surface::Patch;
use crate::patch::thin_plate::{fill_table, thin_plate_block};
use crate::shell::joins::Joins;
use crate::shell::joint::{Freedoms, Joint, started};
use crate::stages::{CONTROL_POINTS, FIELDS};
use crate::warning::Warning;
use crate::watch::{Shape, Watch};

/// Weight of the jumps of `N · R_vv` against the thin-plate energy: larger ones cost digits.
const JUMP_WEIGHT: f64 = 1e2;
/// Samples of the jump along a curve: more than the coefficients of its polynomial.
const JUMP_SAMPLES: usize = 21;

/// Fills all faces of a net in one system, and tells which curves got a common cross derivative;
/// `Joins::G1` patches are filled one by one elsewhere.
///
/// # Errors
/// As [`started`], and [`Error::Joint`] when the system cannot be factorised.
pub(crate) fn fill_joint(
    net: &AsymptoticNet,
    boundary: &Boundary,
    outlines: &[PatchBoundary],
    degree: Option<usize>,
    joins: Joins,
    watch: &mut Watch<'_, '_>,
) -> Result<(Vec<FilledPatch>, Vec<bool>), Error> {
    let (joint, freedoms) = started(net, boundary, outlines, degree)?;
    watch.check()?;
    let shared = joint.shared.clone();
    let reduced = Reduced::new(joint, &freedoms);
    watch.check()?;
    let (patches, fields) = reduced.solve(joins).map_err(Error::Joint)?;
    if !watch.is_extended() {
        return Ok((patches, shared));
    }
    Ok((reduced.extended(joins, &patches, &fields, watch)?.unwrap_or(patches), shared))
}

/// The problem of the stage.
pub(crate) fn joint_problem(
    net: &AsymptoticNet,
    boundary: &Boundary,
    outlines: &[PatchBoundary],
    degree: Option<usize>,
) -> Result<Problem<'static>, Error> {
    let (joint, freedoms) = started(net, boundary, outlines, degree)?;
    Ok(Reduced::new(joint, &freedoms).problem().0)
}

/// The problem in the freedoms of the fields, and in the inner points where they are kept.
struct Reduced<'a> {
    joint: Joint<'a>,
    /// The freedoms of each face.
    unknowns: Vec<Vec<usize>>,
    /// Freedoms in all; inner points come after them, face by face, axis by axis.
    count: usize,
}

fn dense(matrix: &Matrix) -> Vec<f64> {
    (0..matrix.rows()).flat_map(|i| matrix.row(i)).copied().collect()
}

impl<'a> Reduced<'a> {
    fn new(mut joint: Joint<'a>, freedoms: &Freedoms) -> Self {
        // The unknowns of each face, and its family in terms of them.
        let unknowns: Vec<Vec<usize>> = (0..joint.families.len())
            .map(|f| {
                let total = joint.families[f].offsets[4];
                let mut list: Vec<usize> = (0..total)
                    .flat_map(|c| freedoms.null[joint.raw_of(f, c)].iter().map(|(y, _)| *y))
                    .collect();
                list.sort_unstable();
                list.dedup();
                list
            })
            .collect();
        let raw: Vec<Vec<usize>> = (0..joint.families.len())
            .map(|f| (0..joint.families[f].offsets[4]).map(|c| joint.raw_of(f, c)).collect())
            .collect();
        joint.families.par_iter_mut().enumerate().for_each(|(f, family)| {
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
        Self { joint, unknowns, count: freedoms.count }
    }

    /// Minimises the energy of all patches together; the freedoms come with them.
    fn solve(&self, joins: Joins) -> Result<(Vec<FilledPatch>, Vec<f64>), SolverError> {
        if joins == Joins::G2 {
            let lists = self.lists();
            let mut qp = SparseQp::new(self.total());
            self.plates(&lists).into_iter().for_each(|t| _ = qp.term(t));
            self.jumps(&lists).into_iter().for_each(|t| _ = qp.wish(t));
            let y = qp.solve()?.x;
            return Ok((self.with_inner_points(&lists, &y), y));
        }
        let families = || self.joint.families.iter().zip(&self.unknowns);
        let mut qp = SparseQp::new(self.count);
        for (family, list) in families() {
            qp.term(QuadraticTerm {
                unknowns: list.clone(),
                hessian: dense(&family.hessian),
                gradient: family.gradient.clone(),
            });
        }
        let y = qp.solve()?.x;
        let patches = families()
            .enumerate()
            .map(|(f, (family, list))| {
                let own: Vec<f64> = list.iter().map(|k| y[*k]).collect();
                let (patch, energy) = family.patch(&own);
                self.filled(f, patch, energy, own.len())
            })
            .collect();
        Ok((patches, y))
    }

    fn filled(&self, f: usize, patch: Patch, energy: f64, freedoms: usize) -> FilledPatch {
        let open =
            self.joint.net.faces[f].curves.iter().filter(|c| !self.joint.shared[**c]).count();
        let shared = self.joint.net.faces[f].curves.len() - open;
        let mut warnings = Vec::new();
        if patch.least_sine(16) <= 0.0 {
            let place = Place::Patch(f);
            warnings.push(Warning::JointFold { place, shared });
        }
        FilledPatch {
            patch,
            thin_plate_energy: energy,
            freedoms,
            transversality: f64::NAN,
            warnings,
        }
    }

    /// Inner coordinates of a patch.
    fn inner(&self) -> usize {
        3 * fill_table(self.joint.degree).inner.len()
    }

    /// Freedoms and inner coordinates in all.
    fn total(&self) -> usize {
        self.count + self.joint.families.len() * self.inner()
    }

    /// Freedoms and inner coordinates of each face.
    fn lists(&self) -> Vec<Vec<usize>> {
        let (first, inner) = (self.count, self.inner());
        let each = self.unknowns.iter().enumerate();
        each.map(|(f, list)| {
            let own = first + f * inner..first + (f + 1) * inner;
            list.iter().copied().chain(own).collect()
        })
        .collect()
    }

    /// The thin-plate energies with the inner control points as unknowns.
    fn plates(&self, lists: &[Vec<usize>]) -> Vec<QuadraticTerm> {
        let n = self.joint.degree;
        let table = fill_table(n);
        let blocks = InnerBlocks {
            second: thin_plate_block(n, &table.second, &table.second),
            second_border: thin_plate_block(n, &table.second, &table.border),
            inner: thin_plate_block(n, &table.inner, &table.inner),
            inner_second: thin_plate_block(n, &table.inner, &table.second),
            inner_border: thin_plate_block(n, &table.inner, &table.border),
        };
        let families = self.joint.families.par_iter().zip(lists);
        families.map(|(family, list)| blocks.element(family, list)).collect()
    }

    /// The squares of the jumps along the shared curves.
    fn jumps(&self, lists: &[Vec<usize>]) -> Vec<QuadraticTerm> {
        let mut sides: Vec<Vec<(usize, usize)>> = vec![Vec::new(); self.joint.spaces.len()];
        for (f, face) in self.joint.net.faces.iter().enumerate() {
            for (k, c) in face.curves.iter().enumerate() {
                sides[*c].push((f, k));
            }
        }
        (0..sides.len())
            .into_par_iter()
            .filter(|c| self.joint.shared[*c])
            .map(|c| self.jump(c, &sides[c], lists))
            .collect()
    }

    fn with_inner_points(&self, lists: &[Vec<usize>], y: &[f64]) -> Vec<FilledPatch> {
        let n = self.joint.degree;
        let (table, inner) = (fill_table(n), self.inner());
        self.joint
            .families
            .par_iter()
            .zip(lists)
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
            .collect()
    }

    /// The problem in fields and control points, measured from the first vertex.
    fn problem(&self) -> (Problem<'static>, Group, gp_solver::BlockId) {
        let n = self.joint.degree;
        let mut variables = Variables::new();
        let fields = variables.add(FIELDS, self.count, 1);
        let per_face = (n + 1) * (n + 1);
        let points = variables.add(CONTROL_POINTS, self.joint.families.len() * per_face, 3);
        for f in 0..self.joint.families.len() {
            for (i, j) in &fill_table(n).border {
                variables.fix(points, f * per_face + i * (n + 1) + j);
            }
        }
        let mut problem = Problem::new(variables);
        problem.add_energy(ThinPlate::new(n, points));
        let planes = tangent_planes(&self.maps(), fields, points);
        let planes = problem.add(planes);
        (problem, points, planes)
    }

    /// The control points of every face as functions of freedoms and inner points.
    fn maps(&self) -> Vec<Points> {
        let origin = self.joint.net.positions[0];
        let each = self.joint.families.iter().zip(&self.unknowns).enumerate();
        each.map(|(f, (family, list))| {
            let inner = self.count + f * self.inner();
            Points::new(family, list, inner, family.origin - origin)
        })
        .collect()
    }

    /// The patches with what the caller adds, if that is anything.
    fn extended(
        &self,
        joins: Joins,
        patches: &[FilledPatch],
        y: &[f64],
        watch: &mut Watch<'_, '_>,
    ) -> Result<Option<Vec<FilledPatch>>, Error> {
        let origin = self.joint.net.positions[0];
        let stage = watch.stage_from(origin);
        let (mut problem, points, planes) = self.problem();
        let before = Shape::of(&problem);
        watch.extend(&stage, &mut problem)?;
        if Shape::of(&problem) == before {
            return Ok(None);
        }
        let mut start = vec![0.0; problem.unknowns()];
        start[..self.count].copy_from_slice(&y[..self.count]);
        for (k, point) in patches.iter().flat_map(|p| p.patch.points()).enumerate() {
            points.set(&mut start, k, (*point - origin).to_array());
        }
        let mut rows: Vec<Vec<(usize, f64)>> = (0..self.count).map(|k| vec![(k, 1.0)]).collect();
        let mut constants = vec![0.0; self.count];
        for map in self.maps() {
            rows.extend(map.rows);
            constants.extend(map.constants);
        }
        let held = held_equations(&before, &problem, &start);
        // The fields and inner points know the tangent planes.
        problem.remove(planes)?;
        let mut form = QuadraticForm::of(&problem)?;
        form.equations.extend(held);
        let form = form.in_terms_of(&rows, &constants);
        let mut qp = SparseQp::new(self.total());
        form.terms.into_iter().for_each(|t| _ = qp.term(t));
        form.equations.into_iter().for_each(|e| _ = qp.equal(e));
        let lists = self.lists();
        if joins == Joins::G2 {
            self.jumps(&lists).into_iter().for_each(|t| _ = qp.wish(t));
        }
        let solution = qp.solve().map_err(Error::Joint)?;
        if solution.status == Status::Infeasible {
            let (stage, violation) = (stage.name, solution.violation);
            return Err(Error::Infeasible { stage, violation });
        }
        Ok(Some(self.with_inner_points(&lists, &solution.x)))
    }

    /// `w ∫ (N · (R_vv left − R_vv right))² dt` along curve `c`.
    fn jump(&self, c: usize, sides: &[(usize, usize)], lists: &[Vec<usize>]) -> QuadraticTerm {
        let n = self.joint.degree;
        let mut unknowns: Vec<usize> =
            sides.iter().flat_map(|(f, _)| lists[*f].iter().copied()).collect();
        unknowns.sort_unstable();
        unknowns.dedup();
        let mut rows = Vec::with_capacity(JUMP_SAMPLES);
        for s in 0..JUMP_SAMPLES {
            let t = s as f64 / (JUMP_SAMPLES - 1) as f64;
            let normal = self.joint.spaces[c].normal.as_ref().map_or(DVec3::Z, |p| eval(p, t));
            let normal = normal.normalize_or_zero();
            let basis = bernstein(n, t);
            let (mut constant, mut row) = (0.0, vec![0.0; unknowns.len()]);
            for (&(f, k), sign) in sides.iter().zip([1.0, -1.0]) {
                let face = &self.joint.net.faces[f];
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
        let hessian = dense(&hessian);
        QuadraticTerm { unknowns: used.iter().map(|j| unknowns[*j]).collect(), hessian, gradient }
    }

    /// `weight · Q_at`: returns the constant part and reports the face's columns.
    fn affine(
        &self,
        f: usize,
        at: (usize, usize),
        weight: DVec3,
        mut report: impl FnMut(usize, f64),
    ) -> f64 {
        let (family, table) = (&self.joint.families[f], fill_table(self.joint.degree));
        let ring = at.0.min(at.1).min(self.joint.degree - at.0).min(self.joint.degree - at.1);
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
    fn element(&self, family: &PatchFamily, unknowns: &[usize]) -> QuadraticTerm {
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
        QuadraticTerm { unknowns: unknowns.to_vec(), hessian: dense(&hessian), gradient }
    }
}
