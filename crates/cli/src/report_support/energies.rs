//! Energies per iteration, from what the solver tells.

use report::{EnergyHistory, Series};

/// The histories of one or more solves in a row, each with the name of its level; a mark stands
/// where a level begins. A term that a level does not have is NaN there.
pub(crate) fn energy_history<'a>(
    solves: impl IntoIterator<Item = (String, &'a gp_solver::Report)>,
) -> EnergyHistory {
    let mut history = EnergyHistory::default();
    history.terms.push(Series { name: "total".to_owned(), values: Vec::new() });
    let mut length = 0;
    for (name, solve) in solves {
        history.marks.push((length, name));
        let end = length + solve.history.len();
        let totals = solve.history.iter().map(|record| record.energy);
        history.terms[0].values.extend(totals);
        for (k, term) in solve.terms.iter().enumerate() {
            let known = history.terms.iter().skip(1).position(|s| s.name == term.name);
            let at = known.map_or(history.terms.len(), |i| i + 1);
            if known.is_none() {
                history.terms.push(Series { name: term.name.clone(), values: Vec::new() });
            }
            let values = &mut history.terms[at].values;
            values.resize(length, f64::NAN);
            values.extend(solve.history.iter().map(|record| record.terms[k]));
        }
        length = end;
        history.terms.iter_mut().for_each(|series| series.values.resize(end, f64::NAN));
    }
    if history.marks.len() < 2 {
        history.marks.clear();
    }
    if history.terms.len() == 2 {
        // One term alone is the total.
        history.terms.remove(0);
    }
    history
}

#[cfg(test)]
mod tests {
    use super::*;
    use gp_solver::{IterationRecord, Report, Status, Term, Timings};

    fn solve(names: &[&str], energies: &[f64]) -> Report {
        let count = names.len() as f64;
        let record = |&energy: &f64| IterationRecord {
            energy,
            terms: vec![energy / count; names.len()],
            decrease: 0.0,
            damping: 0.0,
            step_norm: 0.0,
            gradient_norm: 0.0,
            factorizations: 1,
        };
        Report {
            status: Status::Converged,
            iterations: energies.len() - 1,
            initial_energy: energies[0],
            final_energy: energies[energies.len() - 1],
            terms: names.iter().map(|n| Term { name: (*n).to_owned(), energy: 0.0 }).collect(),
            history: energies.iter().map(record).collect(),
            factorizations: 0,
            evaluations: 0,
            gradient_norm: 0.0,
            damping: 0.0,
            variables: 1,
            rows: 1,
            timings: Timings::default(),
        }
    }

    #[test]
    fn levels_follow_one_another_and_terms_keep_their_place() {
        let (a, b) =
            (solve(&["closeness"], &[4.0, 2.0]), solve(&["alignment", "closeness"], &[1.0]));
        let history = energy_history([("10x8".to_owned(), &a), ("14x10".to_owned(), &b)]);
        assert_eq!(history.marks, [(0, "10x8".to_owned()), (2, "14x10".to_owned())]);
        let of = |name: &str| &history.terms.iter().find(|s| s.name == name).unwrap().values;
        assert_eq!(of("total"), &[4.0, 2.0, 1.0]);
        assert_eq!(of("closeness"), &[4.0, 2.0, 0.5]);
        assert!(of("alignment")[..2].iter().all(|v| v.is_nan()) && of("alignment")[2] == 0.5);
    }
}
