//! Prints the proof of the solver on public test sets as a Markdown page: NIST StRD nonlinear
//! regression, also as quadratic systems, and Moré, Garbow and Hillstrom from three starts beside
//! a port of MINPACK. The argument describes the machine.
#![expect(clippy::print_stdout, reason = "the page is the output")]

#[path = "../tests/all/problems/mod.rs"]
mod problems;

use gp_solver::{Options, Problem, Report, SolverError, solve};
use problems::{lifted, mgh, minpack, nist, quadratic};

fn main() {
    let machine = std::env::args().nth(1).unwrap_or_else(|| std::env::consts::ARCH.to_owned());
    let profile = if cfg!(debug_assertions) { "dev" } else { "release" };
    println!("# Proof of the solver\n");
    println!("Written by `cargo xtask bench --proof` ({profile} build; {machine}).");
    println!("Default options for every run: Levenberg-Marquardt on the normal equations.");
    println!(
        "The tests `nist`, `lifted`, `mgh` and `quadratic` of `gp-solver` check what is wanted here.\n"
    );
    regression();
    regression_lifted();
    least_squares();
}

fn regression() {
    println!("## NIST StRD nonlinear regression\n");
    println!("Digits: the least log relative error over the certified parameters (11 are");
    println!("certified). Wanted: 6 on lower and average difficulty, 4 on higher.\n");
    println!("| problem | difficulty | start | status | steps | factorisations | digits |");
    println!("|---|---|---|---|---|---|---|");
    for (name, _) in nist::MODELS {
        let set = nist::read(name);
        for start in 0..2 {
            let mut x = set.starts[start].clone();
            let level = format!("{:?}", set.level).to_lowercase();
            match set.problem(start).solve(&mut x) {
                Ok(r) => println!(
                    "| {name} | {level} | {} | {} | {} | {} | {:.1} |",
                    start + 1,
                    r.status,
                    r.iterations,
                    r.factorizations,
                    nist::digits(&x, &set.certified)
                ),
                Err(error) => println!("| {name} | {level} | {} | {error} | | | |", start + 1),
            }
        }
    }
}

fn regression_lifted() {
    println!("\n## The six rational ones as quadratic systems\n");
    println!("The fitted value `f` of every observation is an unknown, bound by `f q = p` with");
    println!("numerator and denominator of the model. Eliminated: these equations are met exactly");
    println!("(digits as above). Soft: they are rows of weight `w`, each weight starting from the");
    println!("result of the one before; the largest relative error of a parameter falls with");
    println!("`1/w²` until the stop rules end the run at a relative change of energy of 1e-14.\n");
    println!("| problem | start | eliminated | steps | w = 10 | 100 | 1000 | 10000 | steps |");
    println!("|---|---|---|---|---|---|---|---|---|");
    for name in lifted::NAMES {
        let lifted = lifted::Lifted::new(name);
        for start in 0..2 {
            let mut b = lifted.set.starts[start].clone();
            let outcome = |r: Result<Report, SolverError>| match r {
                Ok(r) if r.status == gp_solver::Status::Converged => r.iterations.to_string(),
                Ok(r) => format!("{} ({})", r.iterations, r.status),
                Err(error) => error.to_string(),
            };
            let steps = outcome(lifted.solve_eliminated(&mut b));
            let digits = nist::digits(&b, &lifted.set.certified);
            let mut b = lifted.set.starts[start].clone();
            let mut soft = Vec::new();
            let errors = [1e1, 1e2, 1e3, 1e4].map(|w| {
                soft.push(outcome(lifted.solve_soft(w, &mut b)));
                format!("{:.1e}", lifted.error(&b))
            });
            let (start, errors, soft) = (start + 1, errors.join(" | "), soft.join(", "));
            println!("| {name} | {start} | {digits:.1} | {steps} | {errors} | {soft} |");
        }
    }
}

fn least_squares() {
    println!("\n## Moré, Garbow and Hillstrom 1981\n");
    println!("Sums of squares from x0, 10 x0 and 100 x0 (Watson from 10 and 100): as one dense");
    println!("block; where every residual is quadratic also as `QuadraticConstraints`; and by the");
    println!("`levenberg-marquardt` crate, a port of MINPACK. A start at which the functions");
    println!("overflow is refused with the row's name.\n");
    println!(
        "| no. | problem | start | status | steps | sum of squares | quadratic form | port | \
         known minima |"
    );
    println!("|---|---|---|---|---|---|---|---|---|");
    let mut elsewhere = Vec::new();
    for m in mgh::all() {
        for factor in [1.0, 10.0, 100.0] {
            let start = m.start(factor);
            let (port, ok) = minpack::run(&m.problem, &start);
            let port = if ok { format!("{port:.9e}") } else { format!("{port:.3e} (gave up)") };
            let known: Vec<String> = m.minima.iter().map(|v| format!("{v:.6e}")).collect();
            let known = known.join(", ");
            let run = format!("{}, {factor} x0", m.problem.name);
            let head = format!("| {} | {} | {factor} x0 |", m.number, m.problem.name);
            let form = quadratic::by_name(&m.problem.name).map_or_else(String::new, |rows| {
                let mut x = start.clone();
                let mut problem = Problem::new(x.len());
                problem.add(rows);
                match solve(problem, &mut x, &Options::default()) {
                    Ok(r) => format!("{:.9e}", 2.0 * r.final_energy),
                    Err(_) => "refused".to_owned(),
                }
            });
            let mut x = start.clone();
            match m.problem.solve(&mut x) {
                Ok(r) => {
                    let sum = 2.0 * r.final_energy;
                    if !m.is_known_minimum(sum) {
                        elsewhere.push(format!("{run}: {}, {sum:.3e}", r.status));
                    }
                    let (status, steps) = (r.status, r.iterations);
                    println!("{head} {status} | {steps} | {sum:.9e} | {form} | {port} | {known} |");
                }
                Err(error) => {
                    elsewhere.push(format!("{run}: {error}"));
                    println!("{head} refused | | | {form} | {port} | {known} |");
                }
            }
        }
    }
    println!(
        "\nRuns that end elsewhere than at a known minimum (1e-8, relative if it is positive):\n"
    );
    for run in elsewhere {
        println!("- {run}");
    }
}
