//! The unknowns of a problem by name.

use std::ops::Range;

use crate::error::SolverError;

/// Named groups of unknowns: control points, normals, shape parameters, poses, …
///
/// Unknowns are numbered from 0 in the order in which groups are added. A plain vector of unknowns
/// needs no names: `Variables::from(3)`.
///
/// ```
/// use gp_solver::Variables;
/// let mut variables = Variables::new();
/// // Positions and normals of two vertices, vertex by vertex: p₀ n₀ p₁ n₁.
/// let [positions, normals] = variables.interleave(2, [("positions", 3), ("normals", 3)]);
/// let weights = variables.add("weights", 2, 1);
/// assert_eq!(variables.len(), 14);
/// assert_eq!((positions.column(1, 2), normals.column(0, 0), weights.column(1, 0)), (8, 3, 13));
/// variables.fix(positions, 0);
/// assert_eq!(variables.fixed().iter().filter(|f| **f).count(), 3);
/// ```
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Variables {
    groups: Vec<(String, Group)>,
    fixed: Vec<bool>,
    scale: Vec<f64>,
    order: Option<Vec<usize>>,
    run: Option<usize>,
    vectors: Vec<Group>,
}

/// Where the unknowns of one group stand: `items` of `width` components each.
///
/// # Example
/// ```
/// use gp_solver::Variables;
/// let mut variables = Variables::new();
/// let [points, normals] = variables.interleave(2, [("points", 3), ("normals", 3)]);
/// let mut x = vec![0.0; variables.len()];
/// normals.set(&mut x, 1, [0.0, 0.0, 1.0]);
/// assert_eq!((normals.get(&x, 1), points.get(&x, 1)), ([0.0, 0.0, 1.0], [0.0; 3]));
/// assert_eq!(x[normals.column(1, 2)], 1.0);
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Group {
    first: usize,
    items: usize,
    /// Items along the faster index, for groups over a grid; else 1.
    columns: usize,
    width: usize,
    stride: usize,
}

impl Group {
    /// Number of items.
    #[must_use]
    pub fn len(self) -> usize {
        self.items
    }

    /// Whether there is no item.
    #[must_use]
    pub fn is_empty(self) -> bool {
        self.items == 0
    }

    /// Rows and columns of a group over a grid; else the number of items and 1.
    #[must_use]
    pub fn shape(self) -> [usize; 2] {
        [self.items / self.columns.max(1), self.columns]
    }

    /// Components of an item.
    #[must_use]
    pub fn width(self) -> usize {
        self.width
    }

    /// Number of the unknown that is component `component` of item `item`.
    #[must_use]
    pub fn column(self, item: usize, component: usize) -> usize {
        debug_assert!(item < self.items && component < self.width, "no such unknown in the group");
        self.first + self.stride * item + component
    }

    /// Numbers of the unknowns of an item.
    ///
    /// # Example
    /// ```
    /// use gp_solver::Variables;
    /// let mut variables = Variables::new();
    /// variables.add("time", 1, 1);
    /// let points = variables.add("points", 4, 3);
    /// assert_eq!(points.columns::<3>(2), [7, 8, 9]);
    /// assert_eq!(points.column(2, 1), 8);
    /// ```
    #[must_use]
    pub fn columns<const W: usize>(self, item: usize) -> [usize; W] {
        debug_assert_eq!(W, self.width, "one number per component");
        std::array::from_fn(|c| self.column(item, c))
    }

    /// The value of an item in a vector of all unknowns.
    #[must_use]
    pub fn get<const W: usize>(self, x: &[f64], item: usize) -> [f64; W] {
        let first = self.column(item, 0);
        std::array::from_fn(|c| x[first + c])
    }

    /// Sets the value of an item in a vector of all unknowns.
    ///
    /// # Example
    /// ```
    /// use gp_solver::Variables;
    /// let mut variables = Variables::new();
    /// let points = variables.add("points", 2, 3);
    /// let mut x = vec![0.0; variables.len()];
    /// points.set(&mut x, 1, [1.0, 2.0, 3.0]);
    /// assert_eq!(x, [0.0, 0.0, 0.0, 1.0, 2.0, 3.0]);
    /// assert_eq!(points.get::<3>(&x, 1), [1.0, 2.0, 3.0]);
    /// ```
    pub fn set<const W: usize>(self, x: &mut [f64], item: usize, value: [f64; W]) {
        let first = self.column(item, 0);
        x[first..first + W].copy_from_slice(&value);
    }

    /// The numbers of all unknowns of the group if they follow one another.
    ///
    /// # Example
    /// ```
    /// use gp_solver::Variables;
    /// let mut variables = Variables::new();
    /// let heights = variables.add("heights", 4, 1);
    /// let [points, _] = variables.interleave(2, [("points", 3), ("normals", 3)]);
    /// assert_eq!((heights.range(), points.range()), (Some(0..4), None));
    /// ```
    #[must_use]
    pub fn range(self) -> Option<Range<usize>> {
        (self.stride == self.width || self.items <= 1)
            .then(|| self.first..self.first + self.items * self.width)
    }

    /// The items for which `keep(i, j)` holds: row and column of a group over a grid, else the
    /// number of the item and 0.
    ///
    /// # Example
    /// ```
    /// use gp_solver::Variables;
    /// let mut variables = Variables::new();
    /// let net = variables.add_grid("control points", [3, 4], 3);
    /// let border = net.select(|i, j| i == 0 || i == 2 || j == 0 || j == 3);
    /// assert_eq!(border.len(), 10);
    /// for item in border {
    ///     variables.fix(net, item);
    /// }
    /// assert_eq!(variables.fixed().iter().filter(|fixed| !**fixed).count(), 2 * 3);
    /// ```
    #[must_use]
    pub fn select(self, mut keep: impl FnMut(usize, usize) -> bool) -> Vec<usize> {
        (0..self.items).filter(|k| keep(k / self.columns, k % self.columns)).collect()
    }
}

impl Variables {
    /// No unknown yet.
    #[must_use]
    pub fn new() -> Self {
        Self::default()
    }

    /// Adds a group of `items` items of `width` components each, item by item.
    pub fn add(&mut self, name: impl Into<String>, items: usize, width: usize) -> Group {
        let group = Group { first: self.len(), items, columns: 1, width, stride: width };
        self.push(name.into(), group, items * width);
        group
    }

    /// Adds a group over a grid, item `(i, j)` being number `i · columns + j`.
    pub fn add_grid(
        &mut self,
        name: impl Into<String>,
        [rows, columns]: [usize; 2],
        width: usize,
    ) -> Group {
        let (first, items) = (self.len(), rows * columns);
        let group = Group { first, items, columns, width, stride: width };
        self.push(name.into(), group, items * width);
        group
    }

    /// Adds several groups of equally many items that stand together item by item, each with its
    /// name and its number of components.
    pub fn interleave<const G: usize>(
        &mut self,
        items: usize,
        groups: [(&str, usize); G],
    ) -> [Group; G] {
        let stride = groups.iter().map(|(_, width)| width).sum();
        let mut first = self.len();
        let made = groups.map(|(name, width)| {
            let group = Group { first, items, columns: 1, width, stride };
            first += width;
            self.groups.push((name.to_owned(), group));
            group
        });
        self.grow(items * stride);
        made
    }

    fn push(&mut self, name: String, group: Group, unknowns: usize) {
        self.groups.push((name, group));
        self.grow(unknowns);
    }

    fn grow(&mut self, unknowns: usize) {
        let len = self.len() + unknowns;
        self.fixed.resize(len, false);
        self.scale.resize(len, 1.0);
    }

    /// Number of unknowns, the fixed ones included.
    #[must_use]
    pub fn len(&self) -> usize {
        self.fixed.len()
    }

    /// Whether there is no unknown.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.fixed.is_empty()
    }

    /// The group of this name.
    ///
    /// # Errors
    /// [`SolverError::NoSuchGroup`] lists the names there are.
    ///
    /// # Example
    /// ```
    /// use gp_solver::Variables;
    /// let mut variables = Variables::new();
    /// variables.add("points", 5, 3);
    /// assert_eq!(variables.group("points")?.len(), 5);
    /// assert_eq!(
    ///     variables.group("normals").unwrap_err().to_string(),
    ///     "there is no group of unknowns `normals`; there are: points"
    /// );
    /// # Ok::<(), gp_solver::SolverError>(())
    /// ```
    pub fn group(&self, name: &str) -> Result<Group, SolverError> {
        let found = self.groups.iter().find(|(n, _)| n == name);
        found.map(|(_, group)| *group).ok_or_else(|| SolverError::NoSuchGroup {
            name: name.to_owned(),
            groups: self.groups.iter().map(|(n, _)| n.as_str()).collect::<Vec<_>>().join(", "),
        })
    }

    /// Names and groups in order.
    pub fn groups(&self) -> impl Iterator<Item = (&str, Group)> {
        self.groups.iter().map(|(name, group)| (name.as_str(), *group))
    }

    /// Fixes an item at its start value: its unknowns leave the system.
    ///
    /// # Panics
    /// If there is no such item.
    ///
    /// # Example
    /// ```
    /// use gp_solver::{Options, Problem, QuadraticBuilder, Variables, solve};
    /// // The height of a point at x = 3 on the circle of radius 5.
    /// let mut variables = Variables::new();
    /// let point = variables.add("x and y", 2, 1);
    /// variables.fix(point, 0);
    /// let mut circle = QuadraticBuilder::new("circle");
    /// circle.equation(1.0).product(0, 0, 1.0).product(1, 1, 1.0).constant(-25.0);
    /// let mut problem = Problem::new(variables);
    /// problem.add(circle.build());
    /// let mut x = [3.0, 1.0];
    /// solve(problem, &mut x, &Options::default())?;
    /// assert!(x[0] == 3.0 && (x[1] - 4.0).abs() < 1e-9);
    /// # Ok::<(), gp_solver::SolverError>(())
    /// ```
    pub fn fix(&mut self, group: Group, item: usize) -> &mut Self {
        assert!(item < group.items, "the group has no item {item}");
        let first = group.column(item, 0);
        self.fixed[first..first + group.width].fill(true);
        self
    }

    /// Fixes one unknown at its start value.
    ///
    /// # Panics
    /// If there is no such unknown.
    pub fn fix_unknown(&mut self, unknown: usize) -> &mut Self {
        self.fixed[unknown] = true;
        self
    }

    /// Whether each unknown is fixed.
    #[must_use]
    pub fn fixed(&self) -> &[bool] {
        &self.fixed
    }

    /// Gives the unknowns of a group their natural size. Levenberg-Marquardt's own scaling follows
    /// the diagonal of the normal matrix; the natural size stands in where that is zero, and weighs
    /// the distance to the last iterate of guided projection.
    ///
    /// # Panics
    /// If `size` is not positive and finite.
    ///
    /// # Example
    /// ```
    /// use gp_solver::Variables;
    /// let mut variables = Variables::new();
    /// let angles = variables.add("angles", 2, 1);
    /// let lengths = variables.add("lengths", 1, 1);
    /// variables.set_size(lengths, 1e3); // millimetres
    /// assert_eq!((variables.sizes(), angles.len()), (&[1.0, 1.0, 1e3][..], 2));
    /// ```
    pub fn set_size(&mut self, group: Group, size: f64) -> &mut Self {
        for item in 0..group.items {
            let first = group.column(item, 0);
            self.set_range_size(first..first + group.width, size);
        }
        self
    }

    /// As [`set_size`](Self::set_size) for unknowns that follow one another.
    ///
    /// # Panics
    /// If the range leaves the unknowns or `size` is not positive and finite.
    pub fn set_range_size(&mut self, range: Range<usize>, size: f64) -> &mut Self {
        assert!(size > 0.0 && size.is_finite(), "a natural size is positive and finite");
        self.scale[range].fill(size);
        self
    }

    /// Says that the items of a group are points or vectors in space, whose components mean nothing
    /// each by itself, so that a turned problem takes turned steps. With `B` the block of a vector
    /// of `k` components in the normal matrix, it is damped by `(2 B + tr B I)/(k + 2)`, the mean of
    /// `diag B` over all systems of axes; where the scaling is the largest so far by `tr B / k`.
    pub fn set_vectors(&mut self, group: Group) -> &mut Self {
        self.vectors.push(group);
        self
    }

    /// The groups whose items are points or vectors.
    #[must_use]
    pub fn vectors(&self) -> &[Group] {
        &self.vectors
    }

    /// The natural size of each unknown.
    #[must_use]
    pub fn sizes(&self) -> &[f64] {
        &self.scale
    }

    /// Orders the unknowns where the structure is known: `order[k]` is the unknown that comes
    /// `k`-th. Matters for band matrices: let the shorter side of a control net run fastest.
    pub fn set_order(&mut self, order: Vec<usize>) -> &mut Self {
        self.order = Some(order);
        self
    }

    /// The order of the caller, if there is one.
    #[must_use]
    pub fn order(&self) -> Option<&[usize]> {
        self.order.as_deref()
    }

    /// Says that unknowns come in runs of `length`, such as the coordinates of the vertices of a
    /// mesh: large systems are then factored by nested dissection of these runs. An
    /// [order](Self::set_order) of the caller's goes first.
    ///
    /// # Panics
    /// If `length` is zero.
    pub fn set_runs(&mut self, length: usize) -> &mut Self {
        assert!(length > 0, "a run has at least one unknown");
        self.run = Some(length);
        self
    }

    /// The length of the runs, if the unknowns come in runs.
    #[must_use]
    pub fn runs(&self) -> Option<usize> {
        self.run
    }

    /// Whether an order of the caller is a permutation.
    pub(crate) fn check_order(&self) -> Result<(), SolverError> {
        let (Some(order), unknowns) = (&self.order, self.len()) else { return Ok(()) };
        if order.len() != unknowns {
            let (what, expected, found) = ("the ordering", unknowns, order.len());
            return Err(SolverError::WrongLength { what, expected, found });
        }
        let mut used = vec![false; unknowns];
        for (entry, &variable) in order.iter().enumerate() {
            if variable >= unknowns || std::mem::replace(&mut used[variable], true) {
                return Err(SolverError::NotAPermutation { entry, variable, unknowns });
            }
        }
        Ok(())
    }
}

/// A vector of unnamed unknowns, the group `x`.
impl From<usize> for Variables {
    fn from(unknowns: usize) -> Self {
        let mut variables = Self::new();
        variables.add("x", unknowns, 1);
        variables
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn groups_are_found_by_name_and_selected_by_place() {
        let mut variables = Variables::new();
        variables.add("angles", 2, 1);
        let net = variables.add_grid("control points", [3, 4], 3);
        assert_eq!(variables.group("control points"), Ok(net));
        assert_eq!(net.select(|i, _| i == 1), [4, 5, 6, 7]);
        assert_eq!(net.select(|i, j| i == 2 && j == 0), [8]);
        assert_eq!(net.columns::<3>(1), [5, 6, 7]);
        assert_eq!(net.range(), Some(2..38));
        let message = variables.group("poses").unwrap_err().to_string();
        assert!(message.contains("angles, control points"), "{message}");
    }

    #[test]
    fn interleaved_groups_keep_their_items_apart() {
        let mut variables = Variables::new();
        let [p, n] = variables.interleave(3, [("positions", 3), ("normals", 2)]);
        let mut x = vec![0.0; variables.len()];
        for item in 0..3 {
            p.set(&mut x, item, [1.0, 2.0, 3.0].map(|c| c + 10.0 * item as f64));
            n.set(&mut x, item, [-1.0, -2.0]);
        }
        assert_eq!(p.get::<3>(&x, 2), [21.0, 22.0, 23.0]);
        assert_eq!(n.get::<2>(&x, 0), [-1.0, -2.0]);
        assert_eq!((p.range(), x.len()), (None, 15));
        variables.set_size(n, 0.5).fix(n, 1);
        assert_eq!(variables.sizes()[3..5], [0.5, 0.5]);
        assert_eq!(variables.fixed().iter().filter(|f| **f).count(), 2);
    }
}
