//! A problem linearised at an iterate, and single steps from it.

use super::finite::{check_finite, half_square, weigh};
use super::normal::{NormalPlan, Scratch};
use super::vectors::VectorPlan;
use crate::block::{Block, ResidualBlock};
use crate::clock::Instant;
use crate::error::SolverError;
use crate::linear::{Factor, Factorization};
use crate::problem::{BlockId, Problem, Seen, Slot};
use crate::report::{Term, Timings};

/// Residuals and derivatives of one block, weights included.
#[derive(Default)]
struct BlockValues {
    residuals: Vec<f64>,
    /// Jacobian of a residual block, Hessians of an energy block.
    derivatives: Vec<f64>,
    linearized: bool,
}

/// A planned problem: patterns, ordering and symbolic factorisation are made once, then the
/// problem is linearised and stepped any number of times.
///
/// This is what the solvers stand on; it is public for callers that drive their own iteration.
///
/// # Example
/// ```
/// use gp_solver::{Factorization, Problem, QuadraticBuilder, System};
/// // Newton's root of 2: x ← x − (x² − 2) / 2x.
/// let mut root = QuadraticBuilder::new("root");
/// root.equation(1.0).product(0, 0, 1.0).constant(-2.0);
/// let mut problem = Problem::new(1);
/// problem.add(root.build());
/// let mut system = System::new(problem, Factorization::Auto)?;
/// let mut x = [1.0];
/// for _ in 0..6 {
///     system.linearize(&x)?;
///     system.damped_step(0.0)?;
///     system.stepped_into(&x.clone(), &mut x);
/// }
/// assert!((x[0] - 2.0_f64.sqrt()).abs() < 1e-15);
/// # Ok::<(), gp_solver::SolverError>(())
/// ```
pub struct System<'a> {
    problem: Problem<'a>,
    wanted: Factorization,
    plan: NormalPlan,
    factor: Factor,
    values: Vec<BlockValues>,
    /// Matrix part of the linear blocks: where, and what. Such blocks couple few unknowns, so
    /// that this is far shorter than the matrix.
    constant: Vec<(u32, f64)>,
    matrix: Vec<f64>,
    gradient: Vec<f64>,
    diagonal: Vec<f64>,
    /// Scaling `D` of steps: the diagonal, or its running maximum.
    scaling: Vec<f64>,
    keeps_scaling: bool,
    vectors: VectorPlan,
    /// Whether `D` has the blocks of the vectors, or the mean of their diagonals.
    has_blocks: bool,
    terms: Vec<f64>,
    trial: Vec<f64>,
    shift: Vec<f64>,
    step: Vec<f64>,
    scratch: Scratch,
    energy: f64,
    factorizations: usize,
    timings: Timings,
}

/// What the linear model says of a step.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StepModel {
    /// Decrease of the energy the linear model foresees.
    pub predicted_decrease: f64,
    /// `‖s‖_D` with `D` the scaling.
    pub scaled_norm: f64,
}

impl StepModel {
    /// Whether the damping `μ` of this step weighed more in it than the model, `μ‖s‖²_D > s·A s`.
    pub(crate) fn is_held_back(&self, damping: f64) -> bool {
        // The predicted decrease is `½ s·A s + μ‖s‖²_D`.
        3.0 * damping * self.scaled_norm.powi(2) > 2.0 * self.predicted_decrease
    }
}

impl BlockValues {
    fn for_block(block: &Block<'_>) -> Self {
        Self {
            residuals: vec![0.0; block.elements().rows_total()],
            derivatives: vec![0.0; block.elements().jacobian_len()],
            linearized: false,
        }
    }
}

impl<'a> System<'a> {
    /// Checks and plans a problem.
    ///
    /// # Errors
    /// What [`SolverError`] says of malformed blocks and orderings.
    pub fn new(problem: Problem<'a>, factorization: Factorization) -> Result<Self, SolverError> {
        let begin = Instant::now();
        problem.check()?;
        let (plan, factor) = NormalPlan::new(&problem, factorization)?;
        let values = problem.slots.iter().map(|s| BlockValues::for_block(&s.block)).collect();
        let n = plan.size();
        Ok(Self {
            wanted: factorization,
            values,
            constant: Vec::new(),
            matrix: vec![0.0; factor.values_len()],
            gradient: vec![0.0; n],
            diagonal: vec![0.0; n],
            scaling: vec![0.0; n],
            keeps_scaling: false,
            vectors: VectorPlan::new(&problem, &plan, &factor),
            has_blocks: false,
            terms: vec![0.0; problem.slots.len()],
            trial: vec![0.0; problem.slots.len()],
            shift: vec![0.0; n],
            step: vec![0.0; n],
            scratch: Scratch::default(),
            energy: f64::NAN,
            factorizations: 0,
            timings: Timings { plan: begin.elapsed(), ..Timings::default() },
            problem,
            plan,
            factor,
        })
    }

    /// The problem.
    #[must_use]
    pub fn problem(&self) -> &Problem<'a> {
        &self.problem
    }

    /// Takes up one more block. Its rows join the pattern there is; only if they couple unknowns
    /// that the pattern does not is the problem planned anew.
    ///
    /// # Errors
    /// What [`SolverError`] says of malformed blocks.
    ///
    /// # Example
    /// ```
    /// use gp_solver::{Closeness, Factorization, Problem, System};
    /// let mut system = System::new(Problem::new(1), Factorization::Auto)?;
    /// let target = system.add(Closeness::new("target", vec![3.0], vec![2.0]))?;
    /// assert_eq!(system.linearize(&[0.0])?, 18.0); // ½ (2 · 3)²
    /// system.set_weight(target, 0.5)?;
    /// assert_eq!(system.linearize(&[0.0])?, 4.5);
    /// # Ok::<(), gp_solver::SolverError>(())
    /// ```
    pub fn add(&mut self, block: impl ResidualBlock + 'a) -> Result<BlockId, SolverError> {
        let block = Block::Residual(Box::new(block));
        Seen::new(self.problem.unknowns()).check(&block)?;
        let begin = Instant::now();
        let fits = self.plan.try_add(block.elements(), self.problem.unknowns(), &self.factor);
        self.values.push(BlockValues::for_block(&block));
        self.terms.push(0.0);
        self.trial.push(0.0);
        let id = self.problem.push(block);
        if !fits {
            (self.plan, self.factor) = NormalPlan::new(&self.problem, self.wanted)?;
            self.vectors = VectorPlan::new(&self.problem, &self.plan, &self.factor);
            self.matrix = vec![0.0; self.factor.values_len()];
            self.forget_constant();
        }
        self.timings.plan += begin.elapsed();
        Ok(id)
    }

    /// Takes a block out; pattern and order stay.
    ///
    /// # Errors
    /// [`SolverError::NoSuchBlock`].
    pub fn remove(&mut self, block: BlockId) -> Result<(), SolverError> {
        let is_constant = self.problem.slot(block)?.block.is_constant();
        self.problem.remove(block)?;
        self.plan.clear(block.0);
        self.values[block.0] = BlockValues::default();
        self.terms[block.0] = 0.0;
        if is_constant {
            self.forget_constant();
        }
        Ok(())
    }

    /// Puts a block of equal elements in the place of another.
    ///
    /// # Errors
    /// [`SolverError::NoSuchBlock`], [`SolverError::OtherElements`].
    pub fn replace(
        &mut self,
        block: BlockId,
        by: impl ResidualBlock + 'a,
    ) -> Result<(), SolverError> {
        let slot = self.problem.slot(block)?;
        if slot.block.elements() != by.elements() {
            return Err(SolverError::OtherElements { block: by.name().to_owned() });
        }
        let was_constant = slot.block.is_constant();
        slot.block = Block::Residual(Box::new(by));
        if was_constant || slot.block.is_constant() {
            self.forget_constant();
        }
        Ok(())
    }

    /// Weighs a block, as [`Problem::set_weight`].
    ///
    /// # Errors
    /// As there.
    pub fn set_weight(&mut self, block: BlockId, weight: f64) -> Result<(), SolverError> {
        let before = self.problem.weight(block)?;
        self.problem.set_weight(block, weight)?;
        if before != weight && self.problem.slot(block)?.block.is_constant() {
            self.forget_constant();
        }
        Ok(())
    }

    /// Gives a block new values to measure against, as [`Problem::set_reference`].
    ///
    /// # Errors
    /// As there.
    pub fn set_reference(&mut self, block: BlockId, reference: &[f64]) -> Result<(), SolverError> {
        self.problem.set_reference(block, reference)
    }

    /// The matrix part of the linear blocks is formed again at the next linearisation.
    fn forget_constant(&mut self) {
        self.values.iter_mut().for_each(|values| values.linearized = false);
    }

    /// Gives the problem back.
    #[must_use]
    pub fn into_problem(self) -> Problem<'a> {
        self.problem
    }

    /// Number of free unknowns.
    #[must_use]
    pub fn variables(&self) -> usize {
        self.plan.size()
    }

    /// Number of residual rows.
    #[must_use]
    pub fn rows(&self) -> usize {
        let rows = |(slot, values): (&Slot<'_>, &BlockValues)| match slot.block {
            Block::Residual(_) => values.residuals.len(),
            Block::Energy(_) | Block::Removed => 0,
        };
        self.problem.slots.iter().zip(&self.values).map(rows).sum()
    }

    /// The factorisation in use: `band`, `sparse` or `dissection`.
    #[must_use]
    pub fn factorization(&self) -> &'static str {
        self.factor.name()
    }

    /// The unknown behind each position of the system.
    #[must_use]
    pub fn order(&self) -> &[usize] {
        &self.plan.variable
    }

    /// Gradient of the energy at the last linearisation, by position.
    #[must_use]
    pub fn gradient(&self) -> &[f64] {
        &self.gradient
    }

    /// Diagonal of the normal matrix at the last linearisation, by position, for the components of a
    /// [vector](crate::Variables::set_vectors) its mean or its mean over all systems of axes; where
    /// it is zero the unknown's natural size stands in.
    #[must_use]
    pub fn diagonal(&self) -> &[f64] {
        &self.diagonal
    }

    /// Scaling `D` of Levenberg-Marquardt steps, by position: the [diagonal](Self::diagonal), or,
    /// within a solve, the largest it has been (Moré 1978).
    #[must_use]
    pub fn scaling(&self) -> &[f64] {
        &self.scaling
    }

    /// Makes the scaling the running maximum of the diagonal from here on, or its last value.
    pub(crate) fn keep_scaling(&mut self, keep: bool) {
        self.keeps_scaling = keep;
    }

    /// Damps a vector of `k` components by `(2 B + tr B I)/(k + 2)` from the next linearisation on,
    /// `B` its block of the matrix: what its coordinates would give in the mean over all systems of
    /// axes. Only for scalings that follow the iterate, for the largest of several blocks is no block.
    pub(crate) fn damp_by_blocks(&mut self, blocks: bool) {
        self.has_blocks = blocks && !self.vectors.is_empty();
    }

    /// Takes up a scaling from a checkpoint.
    pub(crate) fn set_scaling(&mut self, scaling: &[f64]) {
        self.scaling.copy_from_slice(scaling);
    }

    /// The last step, by position.
    #[must_use]
    pub fn step(&self) -> &[f64] {
        &self.step
    }

    /// Factorisations so far.
    #[must_use]
    pub fn factorizations(&self) -> usize {
        self.factorizations
    }

    /// Time spent so far.
    #[must_use]
    pub fn timings(&self) -> Timings {
        self.timings
    }

    /// Energy at the last linearisation.
    #[must_use]
    pub fn energy(&self) -> f64 {
        self.energy
    }

    /// Energies of the blocks at the last linearisation.
    #[must_use]
    pub fn terms(&self) -> Vec<Term> {
        let term =
            |(id, name): (BlockId, &str)| Term { name: name.to_owned(), energy: self.terms[id.0] };
        self.problem.blocks().map(term).collect()
    }

    /// Energies of the blocks at the last linearisation, in their order.
    pub(crate) fn term_energies(&self) -> Vec<f64> {
        self.problem.blocks().map(|(id, _)| self.terms[id.0]).collect()
    }

    /// Lets the blocks update their lagged quantities.
    pub fn refresh(&mut self, x: &[f64]) {
        for slot in &mut self.problem.slots {
            slot.block.refresh(x);
        }
    }

    /// Evaluates the blocks at `x`, forms normal matrix and gradient; returns the energy.
    ///
    /// # Errors
    /// [`SolverError::NotFinite`] names block and row, [`SolverError::WrongLength`].
    pub fn linearize(&mut self, x: &[f64]) -> Result<f64, SolverError> {
        self.check_length(x)?;
        let begin = Instant::now();
        for (b, Slot { block, weight }) in self.problem.slots.iter().enumerate() {
            let values = &mut self.values[b];
            self.terms[b] = match block {
                Block::Residual(rows) => {
                    if values.linearized && rows.is_linear() {
                        rows.residuals(x, &mut values.residuals);
                        weigh(&mut values.residuals, *weight);
                    } else {
                        rows.linearize(x, &mut values.residuals, &mut values.derivatives);
                        weigh(&mut values.residuals, *weight);
                        weigh(&mut values.derivatives, *weight);
                    }
                    half_square(&values.residuals)
                }
                Block::Energy(energy) => {
                    let value =
                        energy.quadratic_model(x, &mut values.residuals, &mut values.derivatives);
                    weigh(&mut values.residuals, *weight);
                    weigh(&mut values.derivatives, *weight);
                    weight * value
                }
                Block::Removed => 0.0,
            };
            check_finite(block, &values.residuals, &values.derivatives, self.terms[b])?;
        }
        self.energy = self.terms.iter().sum();
        self.timings.linearize += begin.elapsed();
        let begin = Instant::now();
        self.form();
        self.timings.normal += begin.elapsed();
        Ok(self.energy)
    }

    /// Forms the matrix part of the linear blocks, once.
    fn form_constant(&mut self) {
        self.matrix.fill(0.0);
        // Zero rows are not worth a thought: the gradient is formed with the rest.
        let mut unused = vec![0.0; self.plan.size()];
        for (b, Slot { block, .. }) in self.problem.slots.iter().enumerate() {
            if block.is_constant() {
                let values = &mut self.values[b];
                self.plan.add_rows(
                    b,
                    block.elements(),
                    &values.derivatives,
                    &values.residuals,
                    &mut unused,
                    Some(&mut self.matrix),
                    &mut self.scratch,
                );
                values.linearized = true;
            }
        }
        let entries = self.matrix.iter().zip(0..).filter(|(value, _)| **value != 0.0);
        self.constant = entries.map(|(&value, slot)| (slot, value)).collect();
    }

    fn form(&mut self) {
        let is_new = |(slot, values): (&Slot<'_>, &BlockValues)| {
            slot.block.is_constant() && !values.linearized
        };
        if self.problem.slots.iter().zip(&self.values).any(is_new) {
            self.form_constant();
        }
        self.matrix.fill(0.0);
        for &(slot, value) in &self.constant {
            self.matrix[slot as usize] = value;
        }
        self.gradient.fill(0.0);
        for (b, Slot { block, .. }) in self.problem.slots.iter().enumerate() {
            let values = &self.values[b];
            match block {
                Block::Removed => {}
                Block::Residual(_) => self.plan.add_rows(
                    b,
                    block.elements(),
                    &values.derivatives,
                    &values.residuals,
                    &mut self.gradient,
                    (!values.linearized).then_some(&mut self.matrix[..]),
                    &mut self.scratch,
                ),
                Block::Energy(_) => self.plan.add_energy(
                    b,
                    block.elements(),
                    &values.derivatives,
                    &values.residuals,
                    &mut self.gradient,
                    &mut self.matrix,
                    &mut self.scratch,
                ),
            }
        }
        for i in 0..self.plan.size() {
            let a = self.matrix[self.factor.diagonal_slot(i)];
            let size = self.problem.variables.sizes()[self.plan.variable[i]];
            // Exact Hessians of energies can have negative diagonals.
            self.diagonal[i] = if a != 0.0 { a.abs() } else { 1.0 / (size * size) };
        }
        if self.has_blocks {
            self.vectors.take(&self.matrix, &mut self.diagonal);
        } else {
            self.vectors.average(&mut self.diagonal);
        }
        for (scaling, &diagonal) in self.scaling.iter_mut().zip(&self.diagonal) {
            let least = if self.keeps_scaling { *scaling } else { 0.0 };
            *scaling = diagonal.max(least);
        }
    }

    /// The energy at `x`: infinite where a block does not admit `x`, and infinite or NaN where a
    /// block is; leaves the linearisation alone.
    pub fn energy_at(&mut self, x: &[f64]) -> f64 {
        let begin = Instant::now();
        if !self.problem.slots.iter().all(|slot| slot.block.admits(x)) {
            return f64::INFINITY;
        }
        for (b, Slot { block, weight }) in self.problem.slots.iter().enumerate() {
            self.trial[b] = match block {
                Block::Residual(rows) => {
                    // The linearisation has used the residuals up, so their memory is free.
                    let residuals = &mut self.values[b].residuals;
                    rows.residuals(x, residuals);
                    weigh(residuals, *weight);
                    half_square(residuals)
                }
                Block::Energy(energy) => weight * energy.energy(x),
                Block::Removed => 0.0,
            };
        }
        self.timings.residuals += begin.elapsed();
        self.trial.iter().sum()
    }

    /// Solves `(A + μ D) s = −g` at the last linearisation, with `D` the
    /// [scaling](Self::scaling); the step is then in [`step`](Self::step).
    ///
    /// # Errors
    /// [`SolverError::NotPositiveDefinite`] names the unknown.
    pub fn damped_step(&mut self, damping: f64) -> Result<StepModel, SolverError> {
        for (s, &d) in self.shift.iter_mut().zip(&self.scaling) {
            *s = damping * d;
        }
        self.shifted_step(damping)
    }

    /// The damping that would make the last [damped step](Self::damped_step), taken with
    /// `damping`, about `radius` long in the norm `‖s‖_D`: one Newton step on `1/‖s(μ)‖_D`
    /// (Hebden 1973), which costs a solve with the factorisation at hand.
    #[must_use]
    pub fn damping_for_radius(&mut self, damping: f64, radius: f64) -> f64 {
        let begin = Instant::now();
        let mut scaled: Vec<f64> =
            self.step.iter().zip(&self.scaling).map(|(s, d)| s * d).collect();
        if self.has_blocks {
            self.vectors.add_cross(&self.step, &mut scaled);
        }
        let square: f64 = scaled.iter().zip(&self.step).map(|(a, b)| a * b).sum();
        let mut image = scaled.clone();
        self.factor.solve_in_place(&mut image);
        let bend: f64 = scaled.iter().zip(&image).map(|(d, w)| d * w).sum();
        self.timings.solve += begin.elapsed();
        let norm = square.sqrt();
        (damping + (norm - radius) / radius * square / bend).max(0.0)
    }

    /// Slope of the energy along the last step, `g·s`.
    pub(crate) fn slope(&self) -> f64 {
        self.gradient.iter().zip(&self.step).map(|(g, s)| g * s).sum()
    }

    /// Solves `(A + ε² I) s = −g` at the last linearisation, distances in the unknowns' scale.
    ///
    /// # Errors
    /// [`SolverError::NotPositiveDefinite`] names the unknown.
    pub fn projection_step(&mut self, epsilon: f64) -> Result<StepModel, SolverError> {
        for (s, &i) in self.shift.iter_mut().zip(&self.plan.variable) {
            *s = (epsilon / self.problem.variables.sizes()[i]).powi(2);
        }
        self.shifted_step(0.0)
    }

    /// The step with the shift on the diagonal and `damping` times the rest of the blocks.
    fn shifted_step(&mut self, damping: f64) -> Result<StepModel, SolverError> {
        let begin = Instant::now();
        self.factorizations += 1;
        if self.has_blocks {
            self.vectors.put(&mut self.matrix, damping);
        }
        let result = self.factor.factor(&self.matrix, &self.shift);
        if self.has_blocks {
            self.vectors.put(&mut self.matrix, 0.0);
        }
        self.timings.factor += begin.elapsed();
        if let Err(error) = result {
            return Err(match error {
                SolverError::NotPositiveDefinite { variable } => {
                    SolverError::NotPositiveDefinite { variable: self.plan.variable[variable] }
                }
                other => other,
            });
        }
        let begin = Instant::now();
        for (s, &g) in self.step.iter_mut().zip(&self.gradient) {
            *s = -g;
        }
        self.factor.solve_in_place(&mut self.step);
        self.timings.solve += begin.elapsed();
        // m(0) − m(s) = −g·s − ½ s·A s with A s = −g − shift·s.
        let mut decrease = 0.0;
        let mut square = 0.0;
        for i in 0..self.step.len() {
            let s = self.step[i];
            decrease += 0.5 * s * (self.shift[i] * s - self.gradient[i]);
            square += self.scaling[i] * s * s;
        }
        if self.has_blocks {
            let cross = self.vectors.cross(&self.step);
            decrease += 0.5 * damping * cross;
            square += cross;
        }
        Ok(StepModel { predicted_decrease: decrease, scaled_norm: square.max(0.0).sqrt() })
    }

    /// `out = x + step`, fixed unknowns unchanged.
    ///
    /// # Panics
    /// If the lengths differ from the number of unknowns.
    pub fn stepped_into(&self, x: &[f64], out: &mut [f64]) {
        out.copy_from_slice(x);
        for (&s, &i) in self.step.iter().zip(&self.plan.variable) {
            out[i] += s;
        }
    }

    /// `‖x‖_D` over the free unknowns.
    #[must_use]
    pub fn scaled_norm(&self, x: &[f64]) -> f64 {
        let term = |(&i, &d): (&usize, &f64)| d * x[i] * x[i];
        let mut square: f64 = self.plan.variable.iter().zip(&self.scaling).map(term).sum();
        if self.has_blocks {
            let by_position: Vec<f64> = self.plan.variable.iter().map(|&i| x[i]).collect();
            square += self.vectors.cross(&by_position);
        }
        square.max(0.0).sqrt()
    }

    /// `max_i |g_i| / √(A_ii · 2E)`, 0 where the energy is. Of a
    /// [vector](crate::Variables::set_vectors) the length of its gradient and the mean of its
    /// diagonal count.
    #[must_use]
    pub fn scaled_gradient_norm(&self) -> f64 {
        if self.energy == 0.0 {
            return 0.0;
        }
        let scale = 2.0 * self.energy.abs();
        if self.vectors.is_empty() {
            let cosine = |(&g, &d): (&f64, &f64)| g.abs() / (d * scale).sqrt();
            return self.gradient.iter().zip(&self.diagonal).map(cosine).fold(0.0, f64::max);
        }
        let mut squares: Vec<f64> = self.gradient.iter().map(|g| g * g).collect();
        self.vectors.sum(&mut squares);
        let mut diagonal = self.diagonal.clone();
        self.vectors.average(&mut diagonal);
        let cosine = |(&g, &d): (&f64, &f64)| (g / (d * scale)).sqrt();
        squares.iter().zip(&diagonal).map(cosine).fold(0.0, f64::max)
    }

    pub(super) fn plan(&self) -> &NormalPlan {
        &self.plan
    }

    pub(super) fn factor(&self) -> &Factor {
        &self.factor
    }

    /// Values of the normal matrix, laid out as the factorisation wants them.
    pub(super) fn matrix(&self) -> &[f64] {
        &self.matrix
    }

    /// Residuals of a block where it was last evaluated.
    #[cfg(feature = "sparse")]
    pub(super) fn residuals_of(&self, block: usize) -> &[f64] {
        &self.values[block].residuals
    }

    /// Jacobian values (or Hessians) of a block at the last linearisation.
    pub(super) fn derivatives(&self, block: usize) -> &[f64] {
        &self.values[block].derivatives
    }

    fn check_length(&self, x: &[f64]) -> Result<(), SolverError> {
        if x.len() == self.problem.unknowns() {
            return Ok(());
        }
        let (expected, found) = (self.problem.unknowns(), x.len());
        Err(SolverError::WrongLength { what: "the vector of unknowns", expected, found })
    }
}
