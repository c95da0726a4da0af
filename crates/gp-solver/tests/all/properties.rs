//! What holds for any block, any problem and any names of unknowns.

use gp_solver::{
    BlockId, Checkpoint, Closeness, DualBlock, ElementFunction, Elements, Factorization,
    NumericBlock, Options, Problem, QuadraticConstraints, ResidualBlock, Run, System, Variables,
};
use numerics::Number;
use proptest::collection::vec;
use proptest::prelude::*;

fn near(got: f64, wanted: f64, bound: f64) -> Result<(), TestCaseError> {
    let off = (got - wanted).abs();
    prop_assert!(off <= bound, "got {got}, wanted {wanted}: off by {off:e}, allowed {bound:e}");
    Ok(())
}

/// Row `i` of an element: `Σ_k a sin(b x_k + i) + (Σ_k c x_k)² / (2 + cos x₀)`, with `a, b, c`
/// of each row and column.
#[derive(Clone, Debug)]
struct Waves {
    columns: usize,
    rows: usize,
    coefficients: Vec<[f64; 3]>,
}

impl ElementFunction for Waves {
    fn rows<T: Number>(&self, element: usize, x: &[T], rows: &mut [T]) {
        for (i, row) in rows.iter_mut().enumerate() {
            let (mut waves, mut sum) = (T::from(0.0), T::from(0.0));
            for (k, x) in x.iter().enumerate() {
                let [a, b, c] = self.of(element, i, k);
                waves += (*x * b + i as f64).sin() * a;
                sum += *x * c;
            }
            *row = waves + sum * sum / (x[0].cos() + 2.0);
        }
    }
}

impl Waves {
    fn of(&self, element: usize, row: usize, column: usize) -> [f64; 3] {
        let place = (element * self.rows + row) * self.columns + column;
        self.coefficients[place % self.coefficients.len()]
    }

    /// Derivative of a row by hand.
    fn derivative(&self, element: usize, i: usize, k: usize, x: &[f64]) -> f64 {
        let [a, b, c] = self.of(element, i, k);
        let sum: f64 = (0..x.len()).map(|k| self.of(element, i, k)[2] * x[k]).sum();
        let below = x[0].cos() + 2.0;
        let of_below = if k == 0 { sum * sum * x[0].sin() / (below * below) } else { 0.0 };
        a * b * (b * x[k] + i as f64).cos() + 2.0 * sum * c / below + of_below
    }
}

fn any_waves() -> impl Strategy<Value = Waves> {
    let coefficients = vec([-1.0..1.0_f64, -2.0..2.0_f64, -1.0..1.0_f64], 37);
    // More columns than dual numbers have lanes.
    (1..12_usize, 1..4_usize, coefficients).prop_map(|(columns, rows, coefficients)| Waves {
        columns,
        rows,
        coefficients,
    })
}

/// Elements of `waves` over neighbouring unknowns.
fn overlapping(waves: &Waves, count: usize) -> Elements {
    let mut elements = Elements::new();
    for first in 0..count {
        let columns: Vec<usize> = (first..first + waves.columns).collect();
        elements.push(&columns, waves.rows);
    }
    elements
}

fn linearized(block: &dyn ResidualBlock, x: &[f64]) -> (Vec<f64>, Vec<f64>) {
    let elements = block.elements();
    let mut residuals = vec![f64::NAN; elements.rows_total()];
    let mut jacobian = vec![f64::NAN; elements.jacobian_len()];
    block.linearize(x, &mut residuals, &mut jacobian);
    (residuals, jacobian)
}

const UNKNOWNS: usize = 6;

/// A block of a small problem: closeness, a quadratic equation, or waves.
#[derive(Clone, Debug)]
enum Recipe {
    Close(Vec<f64>),
    Equation([usize; 2], [f64; 3]),
    Waves(Waves),
}

impl Recipe {
    fn add_to(&self, system: &mut System<'_>) -> BlockId {
        match self {
            Self::Close(to) => system.add(close(to)).unwrap(),
            Self::Equation(at, values) => system.add(equation(*at, *values)).unwrap(),
            Self::Waves(waves) => system.add(wave_block(waves)).unwrap(),
        }
    }

    fn add(&self, problem: &mut Problem<'_>) -> BlockId {
        match self {
            Self::Close(to) => problem.add(close(to)),
            Self::Equation(at, values) => problem.add(equation(*at, *values)),
            Self::Waves(waves) => problem.add(wave_block(waves)),
        }
    }
}

fn close(to: &[f64]) -> Closeness {
    Closeness::new("close", to.to_vec(), vec![1.0; to.len()])
}

/// `a x y + b x + c = 0`.
fn equation([i, j]: [usize; 2], [a, b, c]: [f64; 3]) -> QuadraticConstraints {
    QuadraticConstraints::from_triplets("equation", &[(0, i, j, 2.0 * a)], &[(0, i, b)], &[c])
}

fn wave_block(waves: &Waves) -> DualBlock<Waves> {
    DualBlock::new("waves", overlapping(waves, 1), waves.clone())
}

fn any_recipe() -> impl Strategy<Value = Recipe> {
    prop_oneof![
        vec(-1.0..1.0_f64, UNKNOWNS).prop_map(Recipe::Close),
        ([0..UNKNOWNS, 0..UNKNOWNS], [-1.0..1.0_f64, -1.0..1.0_f64, -1.0..1.0_f64])
            .prop_map(|(at, values)| Recipe::Equation(at, values)),
        any_waves()
            .prop_map(|waves| Recipe::Waves(Waves { columns: 1 + waves.columns % 5, ..waves })),
    ]
}

/// Energy, gradient and damped step at `x`, as bits.
fn state(system: &mut System<'_>, x: &[f64]) -> Vec<u64> {
    let energy = system.linearize(x).unwrap();
    system.damped_step(0.1).unwrap();
    let numbers = [&[energy], system.gradient(), system.step()].concat();
    numbers.iter().map(|value| value.to_bits()).collect()
}

/// Every unknown coupled with every other, so that the pattern never changes, in the given order.
fn dense() -> Problem<'static> {
    let mut variables = Variables::from(UNKNOWNS);
    variables.set_order((0..UNKNOWNS).collect());
    let mut problem = Problem::new(variables);
    let mut elements = Elements::new();
    elements.push(&(0..UNKNOWNS).collect::<Vec<_>>(), 1);
    problem.add(NumericBlock::new("sum", elements, |_, x, rows| rows[0] = x.iter().sum()));
    problem
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(48))]

    #[test]
    fn dual_and_numeric_blocks_agree(waves in any_waves(), x in vec(-1.5..1.5_f64, 14)) {
        let dual = DualBlock::new("dual", overlapping(&waves, 3), waves.clone());
        let function = |element: usize, x: &[f64], rows: &mut [f64]| waves.rows(element, x, rows);
        let numeric = NumericBlock::new("numeric", overlapping(&waves, 3), function);
        let ((r, exact), (same, differences)) = (linearized(&dual, &x), linearized(&numeric, &x));
        prop_assert_eq!(r, same);
        let elements = dual.elements();
        for e in 0..3 {
            let here = &x[e..e + waves.columns];
            for (at, place) in elements.jacobian_range(e).enumerate() {
                let (i, k) = (at / waves.columns, at % waves.columns);
                let wanted = waves.derivative(e, i, k, here);
                near(exact[place], wanted, 1e-11)?;
                // A step of 10⁻³ leaves 10⁻¹² / 30 of the fifth derivative, which reaches 10⁴.
                near(differences[place], wanted, 1e-8)?;
            }
        }
    }

    #[test]
    fn a_block_fills_the_same_residuals_both_ways(
        waves in any_waves(), x in vec(-1.5..1.5_f64, 14),
    ) {
        let dual = DualBlock::new("dual", overlapping(&waves, 3), waves.clone());
        let mut alone = vec![f64::NAN; dual.elements().rows_total()];
        dual.residuals(&x, &mut alone);
        prop_assert_eq!(alone, linearized(&dual, &x).0);
    }

    #[test]
    fn a_weight_multiplies_residuals(
        recipe in any_recipe(), x in vec(-1.0..1.0_f64, UNKNOWNS), power in -3..4_i32,
    ) {
        let mut system = System::new(Problem::new(UNKNOWNS), Factorization::Band).unwrap();
        let block = recipe.add_to(&mut system);
        let energy = system.linearize(&x).unwrap();
        let gradient = system.gradient().to_vec();
        // A power of two rounds nothing.
        let weight = 2.0_f64.powi(power);
        system.set_weight(block, weight).unwrap();
        prop_assert_eq!(system.linearize(&x).unwrap(), weight * weight * energy);
        for (got, before) in system.gradient().iter().zip(&gradient) {
            prop_assert_eq!(*got, weight * weight * before);
        }
        system.set_weight(block, 0.0).unwrap();
        prop_assert_eq!(system.linearize(&x).unwrap(), 0.0);
    }

    #[test]
    fn a_changed_system_equals_a_new_one_bit_for_bit(
        recipes in vec(any_recipe(), 4), x in vec(-1.0..1.0_f64, UNKNOWNS), weight in 0.5..2.0_f64,
        last in vec(-1.0..1.0_f64, UNKNOWNS), removed in 0..3_usize,
    ) {
        // Three blocks; one goes, the closeness is replaced, another comes, all while linearised.
        let mut system = System::new(dense(), Factorization::Band).unwrap();
        let first = system.add(close(&x)).unwrap();
        let ids: Vec<BlockId> = recipes[..3].iter().map(|r| r.add_to(&mut system)).collect();
        state(&mut system, &x);
        system.remove(ids[removed]).unwrap();
        system.replace(first, close(&last)).unwrap();
        state(&mut system, &x);
        let added = recipes[3].add_to(&mut system);
        system.set_weight(added, weight).unwrap();

        let mut problem = dense();
        problem.add(close(&last));
        for (k, recipe) in recipes.iter().enumerate() {
            if k != removed {
                let block = recipe.add(&mut problem);
                if k == 3 {
                    problem.set_weight(block, weight).unwrap();
                }
            }
        }
        let mut fresh = System::new(problem, Factorization::Band).unwrap();
        prop_assert_eq!(state(&mut system, &x), state(&mut fresh, &x));
        prop_assert_eq!(system.terms(), fresh.terms());
        prop_assert_eq!(system.rows(), fresh.rows());
    }

    #[test]
    fn the_order_of_unknowns_changes_no_step(
        recipes in vec(any_recipe(), 3), x in vec(-1.0..1.0_f64, UNKNOWNS),
        keys in vec(any::<u32>(), UNKNOWNS),
    ) {
        let stepped = |order: Vec<usize>| {
            let mut variables = Variables::from(UNKNOWNS);
            variables.set_order(order);
            let mut problem = Problem::new(variables);
            problem.add(close(&x.iter().map(|x| x + 1.0).collect::<Vec<_>>()));
            recipes.iter().for_each(|recipe| {
                recipe.add(&mut problem);
            });
            let mut system = System::new(problem, Factorization::Band).unwrap();
            system.linearize(&x).unwrap();
            system.damped_step(1e-3).unwrap();
            let mut out = vec![0.0; UNKNOWNS];
            system.stepped_into(&x, &mut out);
            out
        };
        let mut order: Vec<usize> = (0..UNKNOWNS).collect();
        let wanted = stepped(order.clone());
        order.sort_by_key(|k| keys[*k]);
        for (got, wanted) in stepped(order).iter().zip(&wanted) {
            near(*got, *wanted, 1e-10 * (1.0 + wanted.abs()))?;
        }
    }

    #[test]
    fn a_quadratic_equation_is_its_matrix(
        a in vec(-1.0..1.0_f64, 9), b in vec(-1.0..1.0_f64, 3), c in -1.0..1.0_f64,
        x in vec(-2.0..2.0_f64, 3),
    ) {
        let entries: Vec<_> = (0..9).map(|k| (0, k / 3, k % 3, a[k])).collect();
        let linear: Vec<_> = b.iter().enumerate().map(|(i, b)| (0, i, *b)).collect();
        let equation = QuadraticConstraints::from_triplets("equation", &entries, &linear, &[c]);
        let (r, jacobian) = linearized(&equation, &x);
        let row = |i: usize| (0..3).map(|j| a[3 * i + j] * x[j]).sum::<f64>();
        let column = |i: usize| (0..3).map(|j| a[3 * j + i] * x[j]).sum::<f64>();
        let wanted: f64 = (0..3).map(|i| x[i] * (0.5 * row(i) + b[i])).sum::<f64>() + c;
        near(r[0], wanted, 1e-13)?;
        for i in 0..3 {
            near(jacobian[i], 0.5 * (row(i) + column(i)) + b[i], 1e-13)?;
        }
    }

    #[test]
    fn groups_share_the_unknowns_out(
        rows in 1..5_usize, columns in 1..5_usize, items in 1..6_usize,
        widths in [1..4_usize, 1..4_usize],
    ) {
        let mut variables = Variables::new();
        let net = variables.add_grid("net", [rows, columns], 3);
        let pairs = variables.interleave(items, [("left", widths[0]), ("right", widths[1])]);
        let plain = variables.add("plain", items, 2);
        let mut seen = vec![0; variables.len()];
        for group in [net, pairs[0], pairs[1], plain] {
            for item in 0..group.len() {
                (0..group.width()).for_each(|c| seen[group.column(item, c)] += 1);
            }
            if let Some(range) = group.range() {
                let all: Vec<usize> = (0..group.len())
                    .flat_map(|item| (0..group.width()).map(move |c| group.column(item, c)))
                    .collect();
                prop_assert_eq!(all, range.collect::<Vec<_>>());
            }
        }
        prop_assert!(seen.iter().all(|times| *times == 1));
        prop_assert_eq!(net.shape(), [rows, columns]);
        prop_assert_eq!(net.select(|i, j| (i, j) == (rows - 1, 0)), [(rows - 1) * columns]);
        for (name, group) in variables.groups() {
            prop_assert_eq!(variables.group(name).unwrap(), group);
        }
        let mut x: Vec<f64> = (0..variables.len()).map(|k| k as f64).collect();
        let before = x.clone();
        let value = plain.get::<2>(&x, items - 1);
        plain.set(&mut x, items - 1, [-1.0, -2.0]);
        prop_assert_eq!(plain.get(&x, items - 1), [-1.0, -2.0]);
        plain.set(&mut x, items - 1, value);
        prop_assert_eq!(x, before);
    }

    #[test]
    fn fixed_unknowns_leave_the_others_their_gradient(
        recipes in vec(any_recipe(), 3), x in vec(-1.0..1.0_f64, UNKNOWNS),
        fixed in vec(any::<bool>(), UNKNOWNS - 1),
    ) {
        let gradient = |fixed: &[bool]| {
            let mut problem = dense();
            recipes.iter().for_each(|recipe| {
                recipe.add(&mut problem);
            });
            for (k, _) in fixed.iter().enumerate().filter(|(_, fixed)| **fixed) {
                problem.variables_mut().fix_unknown(k);
            }
            let mut system = System::new(problem, Factorization::Band).unwrap();
            let energy = system.linearize(&x).unwrap();
            let mut out = [None; UNKNOWNS];
            for (&unknown, &g) in system.order().iter().zip(system.gradient()) {
                out[unknown] = Some(g);
            }
            (energy, out)
        };
        let (all, some) = (gradient(&[]), gradient(&fixed));
        prop_assert_eq!(all.0, some.0);
        for k in 0..UNKNOWNS {
            match some.1[k] {
                None => prop_assert!(fixed[k]),
                Some(g) => near(g, all.1[k].unwrap(), 1e-13)?,
            }
        }
    }

    #[test]
    fn a_resumed_run_ends_in_the_same_bits(
        waves in any_waves(), start in vec(-1.0..1.0_f64, 12), steps in 1..5_usize,
    ) {
        let run = || {
            let mut problem = Problem::new(12);
            problem.add(wave_block(&waves));
            problem.add(close(&[0.1; 12]));
            let system = System::new(problem, Factorization::Band).unwrap();
            Run::new(system, &start, &Options::default()).unwrap()
        };
        let mut whole = run();
        for _ in 0..steps {
            whole.step(&mut ()).unwrap();
        }
        let saved = whole.save(Checkpoint::new("waves", 0, 0, 0));
        let mut resumed = run();
        resumed.resume(&saved).unwrap();
        for _ in 0..3 {
            prop_assert_eq!(whole.step(&mut ()).unwrap(), resumed.step(&mut ()).unwrap());
        }
        prop_assert_eq!(whole.x(), resumed.x());
        prop_assert_eq!(whole.damping(), resumed.damping());
    }
}
