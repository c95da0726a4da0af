//! Fills reports: surfaces and meshes become views with exact normals and curvatures, outcomes
//! become pages and figures.
//!
//! A command with `--report` and `--figures` flattens [`ReportArgs`], calls its `check` first,
//! and ends with
//!
//! ```ignore
//! if self.report.wanted() {
//!     let mut report = report_support::new("Curvature of a surface");
//!     report.stages.push(report_support::jets::spline_view("surface", &[&surface], None, "mm")?);
//!     report_support::add_files(&mut outcome, &self.report, context, report)?;
//! }
//! ```

pub(crate) mod energies;
pub(crate) mod jets;
pub(crate) mod mesh;
pub(crate) mod panels;
pub(crate) mod weingarten;

use crate::args::ReportArgs;
use crate::context::Context;
use crate::failure::{Failure, refused};
use crate::outcome::{Outcome, Status};
use crate::report_support::jets::spline_view;
use crate::report_support::mesh::mesh_view;
use exchange::{Mesh, Model};
use report::{LineRole, LineSet, Report};
use serde_json::Value;

impl ReportArgs {
    /// Whether a report has to be filled at all.
    pub(crate) fn wanted(&self) -> bool {
        self.report.is_some() || self.figures.is_some()
    }
}

/// An empty report of this run.
pub(crate) fn new(title: &str) -> Report {
    let words = std::env::args().skip(1).map(|word| quoted(&word));
    let line = std::iter::once("umbilic".to_owned()).chain(words).collect::<Vec<_>>().join(" ");
    Report::new(title, line)
}

/// Adds a stage for the surfaces of `model` and one for each of its meshes; its polylines are drawn
/// over the last of them.
pub(crate) fn add_model(report: &mut Report, model: &Model) -> Result<(), Failure> {
    report.length_unit = model.unit.to_string();
    let (solid, loose): (Vec<&Mesh>, Vec<&Mesh>) =
        model.meshes.iter().partition(|m| !m.faces.is_empty());
    for mesh in solid {
        let name = if mesh.name.is_empty() { "mesh" } else { &mesh.name };
        report.stages.push(mesh_view(name, mesh, &report.length_unit)?);
    }
    if model.surfaces.iter().any(|s| s.trim.is_some()) {
        // A part is looked at as a whole, whichever of its faces are trimmed.
        let mesh = exchange::joined_mesh("faces", &model.surfaces);
        report.stages.push(mesh_view(&mesh.name, &mesh, &report.length_unit)?);
    } else if !model.surfaces.is_empty() {
        let surfaces: Vec<_> = model.surfaces.iter().map(|s| &s.surface).collect();
        let name = if surfaces.len() == 1 { "surface" } else { "surfaces" };
        report.stages.push(spline_view(name, &surfaces, None, &report.length_unit)?);
    }
    let lines = loose.iter().flat_map(|m| (0..m.lines.len()).map(|k| m.polyline(k).collect()));
    let mut curves = LineSet::new("lines", "curves", LineRole::Curves, lines.collect());
    curves.visible = true;
    if !curves.polylines.is_empty()
        && let Some(view) = report.stages.pop()
    {
        report.stages.push(view.with_lines(curves).map_err(refused)?);
    }
    Ok(())
}

/// Takes status, warnings and metrics from `outcome`, which gets the page and the figures as
/// further files. `iterates` commands show their status, others always converge.
pub(crate) fn add_files(
    outcome: &mut Outcome,
    args: &ReportArgs,
    context: &Context,
    mut report: Report,
) -> Result<(), Failure> {
    if outcome.iterations > 0 || outcome.status != Status::Converged {
        report.status = outcome.status.as_str().to_owned();
    }
    report.warnings.extend(outcome.warnings.iter().cloned());
    if let Value::Object(metrics) = &outcome.metrics {
        report.metrics = metrics.clone();
    }
    report.run.insert("threads".to_owned(), context.threads.into());
    if let Some(path) = &args.report {
        outcome.pages.push((path.clone(), report.to_html().into_bytes()));
    }
    if let Some(folder) = &args.figures {
        for figure in report.figures().map_err(Failure::other)? {
            outcome.pages.push((folder.join(figure.name), figure.bytes));
        }
    }
    Ok(())
}

/// The word as a shell would need it.
fn quoted(word: &str) -> String {
    let plain = |c: char| c.is_alphanumeric() || "-_./=,:+@%".contains(c);
    if !word.is_empty() && word.chars().all(plain) {
        word.to_owned()
    } else {
        format!("'{}'", word.replace('\'', r"'\''"))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn surfaces_meshes_and_loose_curves_of_a_file_arrive() {
        let corners = [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]];
        let positions = corners.map(|[x, y]| geom_core::DVec3::new(x, y, 0.0)).to_vec();
        let face = Mesh::new(positions.clone(), [[0, 1, 2]]);
        let mut loose = Mesh { positions, ..Mesh::default() };
        loose.lines.push(&[0, 1, 2]);
        let stages = |meshes: Vec<Mesh>| {
            let mut report = Report::default();
            add_model(&mut report, &Model { meshes, ..Model::default() }).unwrap();
            report.stages.iter().map(|s| s.lines().len()).collect::<Vec<_>>()
        };
        assert_eq!(stages(vec![face.clone()]), [1]);
        assert_eq!(stages(vec![face, loose.clone()]), [2]);
        assert!(stages(vec![loose]).is_empty());
    }

    #[test]
    fn words_are_quoted_where_a_shell_needs_it() {
        assert_eq!(quoted("--levels=10x8,14x10"), "--levels=10x8,14x10");
        assert_eq!(quoted("my roof.ron"), "'my roof.ron'");
        assert_eq!(quoted("it's"), r"'it'\''s'");
    }
}
