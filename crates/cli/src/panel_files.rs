//! Files and numbers of a paneling.

use crate::failure::Failure;
use exchange::{Drawing, DrawnLine, Group, Label, LengthUnit, Mesh, Model, NamedSurface};
use geom_core::DVec3;
use paneling::{FlatPanel, FlatSheets, Mold, PanelRow, PanelSet, Paneling};
use serde::Serialize;
use std::path::{Path, PathBuf};

/// The RON form of a paneling.
#[derive(Serialize)]
struct PanelingFile<'a> {
    molds: &'a [Mold],
    panels: &'a [PanelRow],
}

/// File extensions a paneling can be written as.
pub(crate) const PANEL_OUTPUTS: [&str; 9] =
    ["glb", "obj", "csv", "ron", "step", "stp", "3dm", "svg", "dxf"];

/// The files of an output `path`: panels, their table, molds, or flat outlines, by its extension,
/// and beside the panels of an OBJ file the colours of their molds. `sheet` is width and height of
/// the sheets for flat outlines.
pub(crate) fn encode(
    path: &Path,
    set: &PanelSet,
    paneling: &Paneling,
    unit: &LengthUnit,
    sheet: Option<[f64; 2]>,
) -> Result<Vec<(PathBuf, Vec<u8>)>, Failure> {
    if exchange::extension_of(path) == "obj" {
        let library = path.with_extension("mtl");
        let name = library.file_name().unwrap_or_default().to_string_lossy();
        let [panels, materials] =
            exchange::write_obj_and_materials(&[panels_mesh(set, paneling)], &name);
        return Ok(vec![(path.to_owned(), panels.into_bytes()), (library, materials.into_bytes())]);
    }
    let bytes = encode_one(path, set, paneling, unit, sheet)?;
    Ok(vec![(path.to_owned(), bytes)])
}

fn encode_one(
    path: &Path,
    set: &PanelSet,
    paneling: &Paneling,
    unit: &LengthUnit,
    sheet: Option<[f64; 2]>,
) -> Result<Vec<u8>, Failure> {
    match exchange::extension_of(path).as_str() {
        "csv" => Ok(csv(&paneling.table(set)).into_bytes()),
        "ron" => {
            let file = PanelingFile { molds: &paneling.molds, panels: &paneling.table(set) };
            exchange::to_ron(&file).map(String::into_bytes).map_err(Failure::other)
        }
        kind @ ("step" | "stp" | "3dm") => {
            let mut model = Model { unit: unit.clone(), ..Model::default() };
            for (m, mold) in paneling.molds.iter().enumerate() {
                let surface = paneling.mold_surface(set, m).map_err(Failure::other)?;
                let name = mold_name(m, mold);
                let named = NamedSurface::new(name.clone(), surface);
                model.surfaces.push(NamedSurface { layer: name, ..named });
            }
            if kind == "3dm" {
                // Every mold and its panels stand on one layer.
                model.meshes.push(panels_mesh(set, paneling));
            }
            exchange::encode_model(path, &model).map_err(|e| Failure::input(path, e))
        }
        kind @ ("svg" | "dxf") => {
            let flat = paneling.flat_panels(set, sheet).map_err(Failure::usage)?;
            if flat.panels.is_empty() {
                return Err(Failure::input(
                    path,
                    "no panel can be unrolled; flat outlines need planar or cylindrical molds, as in --mold-types cylinder",
                ));
            }
            let drawing = drawing(&flat, sheet.is_some(), unit);
            let write = if kind == "svg" { exchange::write_svg } else { exchange::write_dxf };
            Ok(write(&drawing, unit).into_bytes())
        }
        _ => {
            let model = Model::of_mesh(panels_mesh(set, paneling), unit.clone());
            exchange::encode_model(path, &model).map_err(|e| Failure::input(path, e))
        }
    }
}

/// Outlines to cut, marks along the bending axes, names, and the borders of the sheets.
fn drawing(flat: &FlatSheets, with_sheets: bool, unit: &LengthUnit) -> Drawing {
    let at = |p: &geom_core::DVec2| DVec3::new(p.x, p.y, 0.0);
    let mut drawing = Drawing::default();
    let mut line = |layer: &str, points: Vec<DVec3>, closed| {
        drawing.lines.push(DrawnLine { layer: layer.to_owned(), points, closed });
    };
    if with_sheets {
        for [low, high] in &flat.sheets {
            let corners = [[low.x, low.y], [high.x, low.y], [high.x, high.y], [low.x, high.y]];
            line("sheet", corners.map(|[x, y]| DVec3::new(x, y, 0.0)).to_vec(), true);
        }
    }
    for panel in &flat.panels {
        line("cut", panel.outline.iter().map(at).collect(), true);
        if let Some(bend) = panel.bend {
            line("bend", bend.mark.iter().map(at).collect(), false);
        }
    }
    let texts = flat.panels.iter().flat_map(|panel| names(panel, unit));
    drawing.labels.extend(texts);
    drawing
}

/// Panel and mold, and below them the bending radius, to the right of the mark.
fn names(panel: &FlatPanel, unit: &LengthUnit) -> Vec<Label> {
    let mut lines = vec![format!("P{} M{}", panel.panel, panel.mold)];
    if let Some(bend) = panel.bend {
        lines.push(format!("R {:.4} {unit}", bend.radius));
    }
    // Letters are about as wide as high; a line takes less than half of the breadth.
    let longest = lines.iter().map(String::len).max().unwrap_or(1);
    let height = 0.42 * panel.breadth / longest as f64;
    let label = |(k, text): (usize, String)| {
        let below = 1.6 * height * k as f64;
        let at = DVec3::new(panel.middle.x + 0.6 * height, panel.middle.y - below, 0.0);
        Label { layer: "label".to_owned(), at, height, angle: 0.0, text }
    };
    lines.into_iter().enumerate().map(label).collect()
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
