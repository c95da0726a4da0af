//! Files and numbers of a paneling.

use crate::failure::Failure;
use exchange::{Group, LengthUnit, Mesh, Model, NamedSurface};
use paneling::{Mold, PanelRow, PanelSet, Paneling};
use serde::Serialize;
use std::path::Path;

/// How well the panels of one paneling meet.
#[derive(Serialize)]
pub(crate) struct Quality {
    pub(crate) panels: usize,
    pub(crate) molds: usize,
    pub(crate) kink_median_deg: f64,
    pub(crate) kink_p95_deg: f64,
    pub(crate) kink_max_deg: f64,
    pub(crate) gap_median: f64,
    pub(crate) gap_p95: f64,
    pub(crate) gap_max: f64,
    pub(crate) gap_median_percent: f64,
    pub(crate) gap_p95_percent: f64,
    pub(crate) gap_max_percent: f64,
    pub(crate) deviation_max_percent: f64,
}

impl Quality {
    /// The measures of `paneling` in degrees, model units, and percent of the diagonal.
    pub(crate) fn new(set: &PanelSet, paneling: &Paneling) -> Self {
        let (kinks, gaps) = (paneling.measures.kinks, paneling.measures.gaps);
        let percent = |length: f64| set.percent_of_diagonal(length);
        Self {
            panels: set.len(),
            molds: paneling.molds.len(),
            kink_median_deg: kinks.median.to_degrees(),
            kink_p95_deg: kinks.p95.to_degrees(),
            kink_max_deg: kinks.max.to_degrees(),
            gap_median: gaps.median,
            gap_p95: gaps.p95,
            gap_max: gaps.max,
            gap_median_percent: percent(gaps.median),
            gap_p95_percent: percent(gaps.p95),
            gap_max_percent: percent(gaps.max),
            deviation_max_percent: percent(paneling.measures.max_deviation()),
        }
    }
}

/// The RON form of a paneling.
#[derive(Serialize)]
struct PanelingFile<'a> {
    molds: &'a [Mold],
    panels: &'a [PanelRow],
}

/// The bytes of `path`: panels, their table, or molds, by its extension.
pub(crate) fn encode(
    path: &Path,
    set: &PanelSet,
    paneling: &Paneling,
    table: &[PanelRow],
    unit: &LengthUnit,
) -> Result<Vec<u8>, Failure> {
    match exchange::extension_of(path).as_str() {
        "csv" => Ok(csv(table).into_bytes()),
        "ron" => {
            let file = PanelingFile { molds: &paneling.molds, panels: table };
            exchange::to_ron(&file).map(String::into_bytes).map_err(Failure::other)
        }
        "step" | "stp" => {
            let mut model = Model { unit: unit.clone(), ..Model::default() };
            for (m, mold) in paneling.molds.iter().enumerate() {
                let surface = paneling.mold_surface(set, m).map_err(Failure::other)?;
                let name = mold_name(m, mold);
                model.surfaces.push(NamedSurface { name, surface });
            }
            exchange::encode_model(path, &model).map_err(|e| Failure::input(path, e))
        }
        _ => {
            let model = Model::of_mesh(panels_mesh(set, paneling), unit.clone());
            exchange::encode_model(path, &model).map_err(|e| Failure::input(path, e))
        }
    }
}

fn mold_name(m: usize, mold: &Mold) -> String {
    format!("mold-{m}-{}", mold.kind.name())
}

fn panels_mesh(set: &PanelSet, paneling: &Paneling) -> Mesh {
    let mut mesh = Mesh { name: "panels".into(), ..Mesh::default() };
    mesh.groups =
        paneling.molds.iter().enumerate().map(|(m, mold)| Group::new(mold_name(m, mold))).collect();
    for p in 0..set.len() {
        let panel = paneling.panel_mesh(set, p);
        let first = mesh.positions.len() as u32;
        mesh.positions.extend(panel.positions);
        mesh.normals.extend(panel.normals);
        for triangle in panel.triangles {
            mesh.faces.push(&triangle.map(|v| first + v));
            mesh.face_groups.push(paneling.labels[p] as u32);
        }
    }
    mesh
}

fn csv(table: &[PanelRow]) -> String {
    let header = [
        "panel",
        "mold",
        "mold_type",
        "u",
        "v",
        "origin_x",
        "origin_y",
        "origin_z",
        "x_axis_x",
        "x_axis_y",
        "x_axis_z",
        "z_axis_x",
        "z_axis_y",
        "z_axis_z",
        "x_min",
        "x_max",
        "y_min",
        "y_max",
        "worst_kink_deg",
        "worst_gap",
        "deviation",
    ];
    let rows = table.iter().map(|row| {
        let name = row.mold_type.name();
        let mut cells = vec![row.panel.to_string(), row.mold.to_string(), name.to_owned()];
        let numbers = row
            .parameters
            .iter()
            .chain(&row.origin)
            .chain(&row.x_axis)
            .chain(&row.z_axis)
            .chain(&row.extent)
            .chain([&row.worst_kink_deg, &row.worst_gap, &row.deviation]);
        cells.extend(numbers.map(f64::to_string));
        cells
    });
    exchange::write_csv(&header, rows)
}
