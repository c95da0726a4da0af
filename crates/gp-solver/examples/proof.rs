//! Prints the proof of the solver on public test sets as a Markdown page: NIST StRD nonlinear
//! regression, and Moré, Garbow and Hillstrom from three starts beside a port of MINPACK.
#![expect(clippy::print_stdout, reason = "the page is the output")]

#[path = "../tests/problems/mod.rs"]
mod problems;

use problems::{mgh, minpack, nist};

fn main() {
    println!("# Proof of the solver\n");
    println!("Written by `cargo run --release -p gp-solver --example proof`; default options for");
    println!("every run, Levenberg-Marquardt on the normal equations.\n");
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
    println!("\n## Moré, Garbow and Hillstrom 1981\n");
    println!("Sums of squares from x0, 10 x0 and 100 x0 (Watson from 10 and 100), beside the");
    println!("`levenberg-marquardt` crate, a port of MINPACK. A start at which the functions");
    println!("overflow is refused with the row's name.\n");
    println!("| no. | problem | start | status | steps | sum of squares | port | known minima |");
    println!("|---|---|---|---|---|---|---|---|");
    for m in mgh::all() {
        for factor in [1.0, 10.0, 100.0] {
            let start = m.start(factor);
            let (port, ok) = minpack::run(&m.problem, &start);
            let port = if ok { format!("{port:.9e}") } else { format!("{port:.3e} (gave up)") };
            let known: Vec<String> = m.minima.iter().map(|v| format!("{v:.6e}")).collect();
            let known = known.join(", ");
            let head = format!("| {} | {} | {factor} x0 |", m.number, m.problem.name);
            let mut x = start.clone();
            match m.problem.solve(&mut x) {
                Ok(r) => println!(
                    "{head} {} | {} | {:.9e} | {port} | {known} |",
                    r.status,
                    r.iterations,
                    2.0 * r.final_energy
                ),
                Err(_) => println!("{head} refused | | | {port} | {known} |"),
            }
        }
    }
}
