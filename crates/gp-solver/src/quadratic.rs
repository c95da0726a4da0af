//! Quadratic constraints from coefficient triplets.

use crate::block::ResidualBlock;
use crate::elements::Elements;

/// One product of an equation: `value · x[i] · x[j]`, local column numbers.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Product {
    i: u32,
    j: u32,
    value: f64,
}

/// Sparse quadratic equations `w (½ xᵀA x + bᵀx + c) = 0`, the lifted form of the papers' problems
/// (Pellis et al. 2021, Eq. 10), one element per equation.
///
/// ```
/// use gp_solver::{Options, Problem, QuadraticBuilder, solve};
/// // x² + y² = 25 and x − 7 y = −25: the point (3, 4).
/// let mut equations = QuadraticBuilder::new("circle and line");
/// equations.equation(1.0).quadratic(0, 0, 2.0).quadratic(1, 1, 2.0).constant(-25.0);
/// equations.equation(1.0).linear(0, 1.0).linear(1, -7.0).constant(25.0);
/// let mut problem = Problem::new(2);
/// problem.add(equations.build());
/// let mut x = [4.0, 3.0];
/// let report = solve(problem, &mut x, &Options::default())?;
/// assert!(report.final_energy < 1e-20 && (x[0] - 3.0).abs() < 1e-9);
/// # Ok::<(), gp_solver::SolverError>(())
/// ```
#[derive(Clone, Debug)]
pub struct QuadraticConstraints {
    name: String,
    elements: Elements,
    products: Vec<Product>,
    product_starts: Vec<usize>,
    /// Linear coefficients, one per column of the equation.
    linear: Vec<f64>,
    constants: Vec<f64>,
    weights: Vec<f64>,
    is_linear: bool,
    is_equation: bool,
}

/// Collects the coefficients of [`QuadraticConstraints`]; start each equation with
/// [`equation`](Self::equation).
///
/// # Example
/// ```
/// use gp_solver::{QuadraticBuilder, ResidualBlock};
/// let mut equations = QuadraticBuilder::new("unit vectors");
/// for v in 0..2 {
///     let length = equations.equation(1.0).constant(-1.0);
///     for c in 3 * v..3 * v + 3 {
///         length.product(c, c, 1.0);
///     }
/// }
/// let mut rows = [0.0; 2];
/// equations.build().residuals(&[0.0, 1.0, 0.0, 2.0, 0.0, 1.0], &mut rows);
/// assert_eq!(rows, [0.0, 4.0]);
/// ```
#[derive(Clone, Debug)]
pub struct QuadraticBuilder {
    name: String,
    equations: Vec<Equation>,
}

/// Coefficients of one equation.
#[derive(Clone, Debug, Default)]
pub struct Equation {
    weight: f64,
    quadratic: Vec<(usize, usize, f64)>,
    linear: Vec<(usize, f64)>,
    constant: f64,
}

impl Equation {
    /// Adds `value` to `A[i, j]`. `A` need not be symmetric: only `xᵀA x` counts, so `x·y = 1` is
    /// `quadratic(x, y, 2.0)` or the symmetric pair with 1.0 each.
    pub fn quadratic(&mut self, i: usize, j: usize, value: f64) -> &mut Self {
        self.quadratic.push((i, j, value));
        self
    }

    /// Adds `value · x[i] · x[j]`, that is twice as much to `A[i, j]`.
    pub fn product(&mut self, i: usize, j: usize, value: f64) -> &mut Self {
        self.quadratic(i, j, 2.0 * value)
    }

    /// Adds `value · x[i]`.
    pub fn linear(&mut self, i: usize, value: f64) -> &mut Self {
        self.linear.push((i, value));
        self
    }

    /// Adds a constant.
    pub fn constant(&mut self, value: f64) -> &mut Self {
        self.constant += value;
        self
    }
}

impl QuadraticBuilder {
    /// No equation yet; `name` is that of the block.
    #[must_use]
    pub fn new(name: impl Into<String>) -> Self {
        Self { name: name.into(), equations: Vec::new() }
    }

    /// Begins an equation; its residual is multiplied by `weight`.
    pub fn equation(&mut self, weight: f64) -> &mut Equation {
        self.equations.push(Equation { weight, ..Equation::default() });
        let last = self.equations.len() - 1;
        &mut self.equations[last]
    }

    /// Number of equations so far.
    #[must_use]
    pub fn len(&self) -> usize {
        self.equations.len()
    }

    /// Whether there is no equation yet.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.equations.is_empty()
    }

    /// Plans the equations as such: to hold exactly where the method can, which is where they are
    /// linear and a stage is a quadratic program.
    #[must_use]
    pub fn build_exact(self) -> QuadraticConstraints {
        QuadraticConstraints { is_equation: true, ..self.build() }
    }

    /// Plans the equations.
    #[must_use]
    pub fn build(self) -> QuadraticConstraints {
        let mut out = QuadraticConstraints {
            name: self.name,
            elements: Elements::new(),
            products: Vec::new(),
            product_starts: vec![0],
            linear: Vec::new(),
            constants: Vec::new(),
            weights: Vec::new(),
            is_linear: true,
            is_equation: false,
        };
        let mut columns = Vec::new();
        for equation in &self.equations {
            columns.clear();
            columns.extend(equation.quadratic.iter().flat_map(|&(i, j, _)| [i, j]));
            columns.extend(equation.linear.iter().map(|&(i, _)| i));
            columns.sort_unstable();
            columns.dedup();
            let local = |i: usize| columns.binary_search(&i).unwrap_or_default();
            let begin = out.linear.len();
            out.linear.resize(begin + columns.len(), 0.0);
            for &(i, value) in &equation.linear {
                out.linear[begin + local(i)] += value;
            }
            for &(i, j, value) in &equation.quadratic {
                let (i, j) = (local(i.min(j)) as u32, local(i.max(j)) as u32);
                out.products.push(Product { i, j, value: 0.5 * value });
            }
            out.is_linear &= equation.quadratic.is_empty();
            out.elements.push(&columns, 1);
            out.product_starts.push(out.products.len());
            out.constants.push(equation.constant);
            out.weights.push(equation.weight);
        }
        out
    }
}

impl QuadraticConstraints {
    /// Equations `½ xᵀA_e x + b_eᵀx + c_e = 0` from triplets: `(e, i, j, A_e[i, j])`, `(e, i, b_e[i])`
    /// and one constant per equation. `A_e` need not be symmetric; entries of one place add up.
    ///
    /// # Panics
    /// If a triplet names an equation without a constant.
    ///
    /// ```
    /// use gp_solver::{QuadraticConstraints, ResidualBlock};
    /// // x² + y² = 1, in the unknowns 0 and 1.
    /// let quadratic = [(0, 0, 0, 2.0), (0, 1, 1, 2.0)];
    /// let circle = QuadraticConstraints::from_triplets("circle", &quadratic, &[], &[-1.0]);
    /// let mut r = [0.0];
    /// circle.residuals(&[3.0, 4.0], &mut r);
    /// assert_eq!(r, [24.0]);
    /// assert_eq!(circle.triplets(&[3.0, 4.0]), [(0, 0, 6.0), (0, 1, 8.0)]);
    /// ```
    #[must_use]
    pub fn from_triplets(
        name: impl Into<String>,
        quadratic: &[(usize, usize, usize, f64)],
        linear: &[(usize, usize, f64)],
        constants: &[f64],
    ) -> Self {
        let mut builder = QuadraticBuilder::new(name);
        for &c in constants {
            builder.equation(1.0).constant(c);
        }
        for &(e, i, j, value) in quadratic {
            builder.equations[e].quadratic(i, j, value);
        }
        for &(e, i, value) in linear {
            builder.equations[e].linear(i, value);
        }
        builder.build()
    }

    /// The Jacobian at `x` as (equation, unknown, value), weights included.
    ///
    /// # Example
    /// ```
    /// use gp_solver::QuadraticBuilder;
    /// let mut hyperbola = QuadraticBuilder::new("hyperbola");
    /// hyperbola.equation(2.0).product(0, 1, 1.0).constant(-1.0); // 2 (x y − 1)
    /// assert_eq!(hyperbola.build().triplets(&[3.0, 5.0]), [(0, 0, 10.0), (0, 1, 6.0)]);
    /// ```
    #[must_use]
    pub fn triplets(&self, x: &[f64]) -> Vec<(usize, usize, f64)> {
        let (mut rows, mut values) = (vec![0.0; self.len()], vec![0.0; self.linear.len()]);
        self.linearize(x, &mut rows, &mut values);
        let entries = |e: usize| {
            let columns = self.elements.columns(e).iter();
            columns.zip(self.elements.jacobian_range(e)).map(move |(&c, k)| (e, c, k))
        };
        (0..self.len()).flat_map(entries).map(|(e, c, k)| (e, c, values[k])).collect()
    }

    /// The Jacobian at `x` as a sparse matrix with a column per unknown, weights included.
    ///
    /// # Example
    /// ```
    /// use gp_solver::QuadraticBuilder;
    /// let mut hyperbola = QuadraticBuilder::new("hyperbola");
    /// hyperbola.equation(1.0).product(0, 2, 1.0).constant(-1.0);
    /// let jacobian = hyperbola.build().jacobian(&[3.0, 9.0, 5.0]);
    /// assert_eq!((jacobian.shape(), jacobian.nnz()), ((1, 3), 2));
    /// assert_eq!(jacobian.get(0, 2), Some(&3.0));
    /// ```
    #[cfg(feature = "sparse")]
    #[must_use]
    pub fn jacobian(&self, x: &[f64]) -> sprs::CsMat<f64> {
        let mut triplets = sprs::TriMat::new((self.len(), x.len()));
        self.triplets(x).into_iter().for_each(|(e, c, value)| triplets.add_triplet(e, c, value));
        triplets.to_csr()
    }

    /// Number of equations.
    #[must_use]
    pub fn len(&self) -> usize {
        self.constants.len()
    }

    /// Whether there is no equation.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.constants.is_empty()
    }

    /// Sets the weight of every equation.
    pub fn set_weight(&mut self, weight: f64) {
        self.weights.fill(weight);
    }

    fn linear_of(&self, e: usize) -> &[f64] {
        // One row an equation, so the Jacobian's layout is that of the linear coefficients.
        &self.linear[self.elements.jacobian_range(e)]
    }

    fn products_of(&self, e: usize) -> &[Product] {
        &self.products[self.product_starts[e]..self.product_starts[e + 1]]
    }
}

impl ResidualBlock for QuadraticConstraints {
    fn name(&self) -> &str {
        &self.name
    }

    fn elements(&self) -> &Elements {
        &self.elements
    }

    fn residuals(&self, x: &[f64], residuals: &mut [f64]) {
        for (e, residual) in residuals.iter_mut().enumerate() {
            let columns = self.elements.columns(e);
            let mut sum = self.constants[e];
            for (&c, &b) in columns.iter().zip(self.linear_of(e)) {
                sum += b * x[c];
            }
            for p in self.products_of(e) {
                sum += p.value * x[columns[p.i as usize]] * x[columns[p.j as usize]];
            }
            *residual = self.weights[e] * sum;
        }
    }

    fn linearize(&self, x: &[f64], residuals: &mut [f64], jacobian: &mut [f64]) {
        for (e, residual) in residuals.iter_mut().enumerate() {
            let columns = self.elements.columns(e);
            let row = &mut jacobian[self.elements.jacobian_range(e)];
            row.copy_from_slice(self.linear_of(e));
            let mut sum = self.constants[e];
            for (&c, &b) in columns.iter().zip(self.linear_of(e)) {
                sum += b * x[c];
            }
            for p in self.products_of(e) {
                let (xi, xj) = (x[columns[p.i as usize]], x[columns[p.j as usize]]);
                sum += p.value * xi * xj;
                row[p.i as usize] += p.value * xj;
                row[p.j as usize] += p.value * xi;
            }
            *residual = self.weights[e] * sum;
            for value in row {
                *value *= self.weights[e];
            }
        }
    }

    fn is_linear(&self) -> bool {
        self.is_linear
    }

    fn is_equation(&self) -> bool {
        self.is_equation
    }
}
