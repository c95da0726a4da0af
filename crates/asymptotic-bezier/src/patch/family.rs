//! All patches of one degree between four asymptotic curves: affine in the freedoms of the tangent
//! fields, with a quadratic energy.

use geom_core::DVec3;

use crate::boundary::four_curves::PatchBoundary;
use crate::curve::bernstein::{bernstein, elevate, eval};
use crate::error::{Error, Place};
use crate::patch::field::{FieldSpace, paper_ansatz, tangent_fields};
use crate::patch::options::Ansatz;
use crate::patch::surface::Patch;
use crate::patch::thin_plate::fill_table;
use numerics::{Matrix, affine_space, axpy, dot};

/// Rank tolerance of the corner equations after scaling of the columns.
pub(crate) const RANK_TOL: f64 = 1e-10;

/// Largest residual of the corner equations relative to the patch.
pub(crate) const CORNER_TOL: f64 = 1e-8;

/// A sparse vector equation: coefficients by column, and the right side.
pub(crate) type VectorEquation = (Vec<(usize, DVec3)>, DVec3);

/// Curve and end at the corners `00`, `10`, `01`, `11`: the u-curve, then the v-curve.
pub(crate) const CORNERS: [[(usize, usize); 2]; 4] =
    [[(0, 0), (1, 0)], [(0, 1), (3, 0)], [(2, 0), (1, 1)], [(2, 1), (3, 1)]];

/// Whether the inward direction at curve `i` is with (`+1`) or against (`−1`) the parameter.
pub(crate) const INWARD: [f64; 4] = [1.0, 1.0, -1.0, -1.0];

/// The affine family of control points in the freedoms of the tangent fields.
pub(crate) struct PatchFamily {
    pub(crate) degree: usize,
    /// Corner `00`, from which everything else is measured.
    pub(crate) origin: DVec3,
    /// Elevated boundary rows.
    pub(crate) rows: [Vec<DVec3>; 4],
    pub(crate) spaces: [FieldSpace; 4],
    /// First unknown of each curve.
    pub(crate) offsets: [usize; 5],
    /// Field coefficients: `z = particular + null · y`.
    pub(crate) particular: Vec<f64>,
    pub(crate) null: Matrix,
    /// Second ring, constant part, and its derivative per coordinate.
    pub(crate) second: Vec<DVec3>,
    pub(crate) slopes: [Matrix; 3],
    /// Thin-plate energy `½ yᵀ H y + gᵀ y + c` (twice the coefficients of the energy).
    pub(crate) hessian: Matrix,
    pub(crate) gradient: Vec<f64>,
}

impl PatchFamily {
    pub(crate) fn new(
        boundary: &PatchBoundary,
        n: usize,
        ansatz: Ansatz,
        place: Place,
    ) -> Result<Self, Error> {
        let spaces: [FieldSpace; 4] = std::array::from_fn(|i| {
            let curve = &boundary.curves[i];
            match ansatz {
                Ansatz::Paper if !boundary.lines[i] => paper_ansatz(curve, false),
                Ansatz::PaperFree if !boundary.lines[i] => paper_ansatz(curve, true),
                _ => {
                    let ribbon = boundary.ribbons[i].as_ref();
                    tangent_fields(curve, boundary.lines[i], &boundary.inflections[i], ribbon, n)
                }
            }
        });
        let mut family = Self::framed(boundary, n, spaces);
        family.solve_corners(place)?;
        family.reduce();
        Ok(family)
    }

    /// Boundary rows and spaces; the coefficients of the fields are still to be solved for.
    pub(crate) fn framed(boundary: &PatchBoundary, n: usize, spaces: [FieldSpace; 4]) -> Self {
        let origin = boundary.curves[0].points()[0];
        let rows: [Vec<DVec3>; 4] = std::array::from_fn(|i| {
            let curve = &boundary.curves[i];
            let start = curve.points()[0] - origin;
            elevate(curve.offsets(), n).iter().map(|d| start + *d).collect()
        });
        let mut offsets = [0; 5];
        for i in 0..4 {
            offsets[i + 1] = offsets[i] + spaces[i].fields.len();
        }
        Self {
            degree: n,
            origin,
            rows,
            spaces,
            offsets,
            particular: Vec::new(),
            null: Matrix::default(),
            second: Vec::new(),
            slopes: Default::default(),
            hessian: Matrix::default(),
            gradient: Vec::new(),
        }
    }

    /// Position on the second row of curve `i` at index `k`, affine in the field coefficients.
    fn second_row(&self, i: usize, k: usize) -> (DVec3, impl Iterator<Item = (usize, DVec3)> + '_) {
        let factor = INWARD[i] / self.degree as f64;
        let columns = self.spaces[i]
            .fields
            .iter()
            .enumerate()
            .map(move |(f, field)| (self.offsets[i] + f, field[k] * factor))
            .filter(|(_, d)| *d != DVec3::ZERO);
        (self.rows[i][k], columns)
    }

    /// Unit of each field's coefficient.
    pub(crate) fn scales(&self) -> Vec<f64> {
        let largest =
            |f: &Vec<DVec3>| f.iter().map(|c| c.abs().max_element()).fold(0.0, f64::max).recip();
        self.spaces.iter().flat_map(|s| &s.fields).map(largest).collect()
    }

    /// Both tangents and the twist at the corners `00`, `10`, `01`, `11`.
    pub(crate) fn corner_equations(&self) -> Vec<[VectorEquation; 3]> {
        let n = self.degree;
        let mut equations: Vec<[VectorEquation; 3]> = Vec::with_capacity(4);
        for [(p, pe), (q, qe)] in CORNERS {
            let at = |e: usize, k: usize| if e == 0 { k } else { n - k };
            let (p0, p_columns) = self.second_row(p, at(pe, 0));
            let tangent_p = (p_columns.collect(), self.rows[q][at(qe, 1)] - p0);
            let (q0, q_columns) = self.second_row(q, at(qe, 0));
            let tangent_q = (q_columns.collect(), self.rows[p][at(pe, 1)] - q0);
            let (p1, p_columns) = self.second_row(p, at(pe, 1));
            let (q1, q_columns) = self.second_row(q, at(qe, 1));
            let mut columns: Vec<(usize, DVec3)> = p_columns.collect();
            columns.extend(q_columns.map(|(c, d)| (c, -d)));
            equations.push([tangent_p, tangent_q, (columns, q1 - p1)]);
        }
        equations
    }

    /// Tangents and twists at the four corners; each corner alone when the fields allow it.
    fn solve_corners(&mut self, place: Place) -> Result<(), Error> {
        let total = self.offsets[4];
        let scale = self.scales();
        let equations = self.corner_equations();
        let mut owner = vec![usize::MAX; total];
        let mut separate = true;
        for (c, corner) in equations.iter().enumerate() {
            for (column, _) in corner.iter().flat_map(|(columns, _)| columns) {
                separate &= owner[*column] == usize::MAX || owner[*column] == c;
                owner[*column] = c;
            }
        }
        let groups: Vec<(Vec<usize>, Vec<usize>)> = if separate {
            (0..4).map(|c| (vec![c], (0..total).filter(|k| owner[*k] == c).collect())).collect()
        } else {
            vec![((0..4).collect(), (0..total).collect())]
        };
        let mut particular = vec![0.0; total];
        let mut null_columns: Vec<Vec<(usize, f64)>> = Vec::new();
        let mut worst = 0.0_f64;
        for (corners, columns) in &groups {
            let mut index = vec![usize::MAX; total];
            for (k, c) in columns.iter().enumerate() {
                index[*c] = k;
            }
            let mut matrix = Matrix::zeros(9 * corners.len(), columns.len());
            let mut rhs = vec![0.0; 9 * corners.len()];
            let vectors = corners.iter().flat_map(|c| &equations[*c]);
            for (r, (entries, right)) in vectors.enumerate() {
                for axis in 0..3 {
                    rhs[3 * r + axis] = right[axis];
                    for (column, d) in entries {
                        matrix[(3 * r + axis, index[*column])] += d[axis];
                    }
                }
            }
            let scale: Vec<f64> = columns.iter().map(|c| scale[*c]).collect();
            let space = affine_space(&matrix, &rhs, &scale, RANK_TOL);
            worst = worst.max(space.residual);
            for (k, c) in columns.iter().enumerate() {
                particular[*c] = space.particular[k];
            }
            for j in 0..space.null.cols() {
                null_columns.push(
                    columns.iter().enumerate().map(|(k, c)| (*c, space.null[(k, j)])).collect(),
                );
            }
        }
        if separate {
            for c in (0..total).filter(|c| owner[*c] == usize::MAX) {
                null_columns.push(vec![(c, scale[c])]);
            }
        }
        if !(worst <= CORNER_TOL * self.size()) {
            return Err(Error::CornerEquations { place, residual: worst });
        }
        self.particular = particular;
        self.null = Matrix::zeros(total, null_columns.len());
        for (j, column) in null_columns.iter().enumerate() {
            for (i, value) in column {
                self.null[(*i, j)] = *value;
            }
        }
        Ok(())
    }

    /// Largest distance of a point of `r1` or `r3` from the corner `00`.
    pub(crate) fn size(&self) -> f64 {
        self.rows[0].iter().chain(&self.rows[2]).map(|q| q.length()).fold(0.0, f64::max)
    }

    /// Second ring and energy in terms of the freedoms.
    pub(crate) fn reduce(&mut self) {
        let (n, ny) = (self.degree, self.null.cols());
        let table = fill_table(n);
        let mut second = Vec::with_capacity(table.second.len());
        let mut slopes: [Matrix; 3] =
            std::array::from_fn(|_| Matrix::zeros(table.second.len(), ny));
        for (r, &(i, j)) in table.second.iter().enumerate() {
            let (curve, k) = match (i, j) {
                (_, 1) => (0, i),
                (_, _) if j == n - 1 => (2, i),
                (1, _) => (1, j),
                _ => (3, j),
            };
            let (mut point, columns) = self.second_row(curve, k);
            for (column, d) in columns {
                point += d * self.particular[column];
                let null = self.null.row(column);
                for axis in 0..3 {
                    axpy(d[axis], null, slopes[axis].row_mut(r));
                }
            }
            second.push(point);
        }
        let border: Vec<DVec3> = table.border.iter().map(|ij| self.border_point(*ij)).collect();
        let mut hessian = Matrix::zeros(ny, ny);
        let mut gradient = vec![0.0; ny];
        for axis in 0..3 {
            let b: Vec<f64> = border.iter().map(|p| p[axis]).collect();
            let s: Vec<f64> = second.iter().map(|p| p[axis]).collect();
            let mut force = table.second_border.apply(&b);
            axpy(1.0, &table.second_second.apply(&s), &mut force);
            axpy(1.0, &slopes[axis].apply_transpose(&force), &mut gradient);
            let stiff = table.second_second.product(&slopes[axis]);
            hessian.add_scaled(1.0, &slopes[axis].transpose_product(&stiff));
        }
        self.second = second;
        self.slopes = slopes;
        self.hessian = hessian;
        self.gradient = gradient;
    }

    pub(crate) fn border_point(&self, (i, j): (usize, usize)) -> DVec3 {
        let n = self.degree;
        match (i, j) {
            (_, 0) => self.rows[0][i],
            (_, _) if j == n => self.rows[2][i],
            (0, _) => self.rows[1][j],
            _ => self.rows[3][j],
        }
    }

    /// Control points and thin-plate energy at the freedoms `y`.
    pub(crate) fn patch(&self, y: &[f64]) -> (Patch, f64) {
        let n = self.degree;
        let table = fill_table(n);
        let border: Vec<DVec3> = table.border.iter().map(|ij| self.border_point(*ij)).collect();
        let mut points = vec![DVec3::ZERO; (n + 1) * (n + 1)];
        let mut energy = 0.0;
        let mut second = self.second.clone();
        for axis in 0..3 {
            let steps = self.slopes[axis].apply(y);
            for (point, step) in second.iter_mut().zip(steps) {
                point[axis] += step;
            }
            let b: Vec<f64> = border.iter().map(|p| p[axis]).collect();
            let s: Vec<f64> = second.iter().map(|p| p[axis]).collect();
            energy += dot(&table.border_border.apply(&b), &b)
                + 2.0 * dot(&table.second_border.apply(&b), &s)
                + dot(&table.second_second.apply(&s), &s);
            let ring: Vec<f64> = b.iter().chain(&s).copied().collect();
            for (value, (i, j)) in table.recover.apply(&ring).iter().zip(&table.inner) {
                points[i * (n + 1) + j][axis] = *value;
            }
        }
        for (point, (i, j)) in
            border.iter().zip(&table.border).chain(second.iter().zip(&table.second))
        {
            points[i * (n + 1) + j] = *point;
        }
        for point in &mut points {
            *point += self.origin;
        }
        (Patch::new(n, points), energy)
    }

    /// Transversal field of curve `i` at `t`, constant part and derivative in the freedoms.
    pub(crate) fn field_row(&self, i: usize, t: f64, direction: DVec3) -> (f64, Vec<f64>) {
        let basis = bernstein(self.degree, t);
        let mut constant = 0.0;
        let mut row = vec![0.0; self.null.cols()];
        for (f, field) in self.spaces[i].fields.iter().enumerate() {
            let value: f64 = field.iter().zip(&basis).map(|(c, b)| c.dot(direction) * b).sum();
            let column = self.offsets[i] + f;
            constant += value * self.particular[column];
            axpy(value, self.null.row(column), &mut row);
        }
        (constant, row)
    }

    /// Unit normal of the tangent plane along curve `i` at `t`, up to one sign per curve.
    pub(crate) fn strip_normal(&self, i: usize, t: f64) -> Option<DVec3> {
        self.spaces[i].normal.as_ref().map(|normal| eval(normal, t).normalize_or_zero())
    }
}
