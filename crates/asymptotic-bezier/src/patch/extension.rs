//! Control points as functions of the freedoms of the tangent fields, for callers who add to the
//! problem of a patch.

use geom_core::DVec3;
use gp_solver::{Group, LinearEquation, Problem, QuadraticBuilder, QuadraticConstraints};

use crate::patch::family::PatchFamily;
use crate::patch::thin_plate::fill_table;
use crate::watch::Shape;

/// The control points of a patch, coordinate by coordinate: affine in freedoms and inner points.
pub(crate) struct Points {
    /// Per coordinate its unknowns and their factors.
    pub(crate) rows: Vec<Vec<(usize, f64)>>,
    pub(crate) constants: Vec<f64>,
    /// Coordinates of the second ring, which the fields decide.
    second: Vec<usize>,
}

impl Points {
    /// `freedoms` are the numbers of the family's own, `inner` that of the first inner coordinate
    /// (axis by axis); `shift` is where the family's origin lies.
    pub(crate) fn new(
        family: &PatchFamily,
        freedoms: &[usize],
        inner: usize,
        shift: DVec3,
    ) -> Self {
        let n = family.degree;
        let table = fill_table(n);
        let len = 3 * (n + 1) * (n + 1);
        let mut out =
            Self { rows: vec![Vec::new(); len], constants: vec![0.0; len], second: Vec::new() };
        let at = |(i, j): (usize, usize), axis: usize| 3 * (i * (n + 1) + j) + axis;
        for axis in 0..3 {
            for p in &table.border {
                out.constants[at(*p, axis)] = (family.border_point(*p) + shift)[axis];
            }
            for (r, p) in table.second.iter().enumerate() {
                let slopes = family.slopes[axis].row(r).iter().zip(freedoms);
                let entries = slopes.filter(|(s, _)| **s != 0.0).map(|(s, y)| (*y, *s));
                out.rows[at(*p, axis)] = entries.collect();
                out.constants[at(*p, axis)] = (family.second[r] + shift)[axis];
                out.second.push(at(*p, axis));
            }
            for (r, p) in table.inner.iter().enumerate() {
                out.rows[at(*p, axis)] = vec![(inner + axis * table.inner.len() + r, 1.0)];
                out.constants[at(*p, axis)] = shift[axis];
            }
        }
        out
    }
}

/// The equations that tie the second rings of patches to their tangent fields, which keeps the
/// boundary asymptotic: `Q − Σ slope · field = constant`.
pub(crate) fn tangent_planes(
    maps: &[Points],
    fields: Group,
    points: Group,
) -> QuadraticConstraints {
    let mut equations = QuadraticBuilder::new("tangent planes");
    let mut first = 0;
    for map in maps {
        for &k in &map.second {
            let row = equations.equation(1.0);
            row.linear(points.column(first + k / 3, k % 3), 1.0).constant(-map.constants[k]);
            for (y, slope) in &map.rows[k] {
                row.linear(fields.column(*y, 0), -slope);
            }
        }
        first += map.rows.len() / 3;
    }
    equations.build_exact()
}

/// What the caller fixed keeps its start value.
pub(crate) fn held_equations(
    before: &Shape,
    problem: &Problem<'_>,
    start: &[f64],
) -> Vec<LinearEquation> {
    let fixed = problem.variables().fixed();
    let new = (0..fixed.len()).filter(|k| fixed[*k] && !before.is_fixed(*k));
    new.map(|k| LinearEquation { entries: vec![(k, 1.0)], value: start[k] }).collect()
}
