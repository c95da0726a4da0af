//! The table of `umbilic analyze --list`.

use exchange::{Mesh, Model, NamedSurface};
use geom_core::{BoundingBox, CurvatureStatistics, DVec3};
use serde::Serialize;

/// What `--metrics` holds of a listed file.
#[derive(Serialize)]
pub(crate) struct Listing {
    kind: &'static str,
    surfaces: Vec<SurfaceRow>,
    meshes: Vec<MeshRow>,
    grids: Vec<GridRow>,
}

#[derive(Serialize)]
struct SurfaceRow {
    number: usize,
    name: String,
    degree: [usize; 2],
    control_points: [usize; 2],
    rational: bool,
    /// Loops of the trim, 0 for a whole surface.
    trim_loops: usize,
    area: f64,
    bounding_box: Option<[[f64; 3]; 2]>,
}

#[derive(Serialize)]
struct MeshRow {
    name: String,
    /// Numbers of its parts, the last included.
    parts: [usize; 2],
    vertices: usize,
    faces: usize,
    polylines: usize,
    bounding_box: Option<[[f64; 3]; 2]>,
}

#[derive(Serialize)]
struct GridRow {
    name: String,
    points: [usize; 2],
    bounding_box: Option<[[f64; 3]; 2]>,
}

impl Listing {
    pub(crate) fn new(model: &Model) -> Self {
        let surfaces = model.surfaces.iter().enumerate().map(|(k, s)| surface_row(k + 1, s));
        let mut first = 1;
        let meshes = model.meshes.iter().map(|mesh| {
            let parts = mesh.piece_count();
            first += parts;
            mesh_row([first - parts, first - 1], mesh)
        });
        let grids = model.grids.iter().map(|grid| GridRow {
            name: grid.name.clone(),
            points: [grid.n_u, grid.n_v],
            bounding_box: of_points(&grid.points),
        });
        Self {
            kind: "list",
            surfaces: surfaces.collect(),
            meshes: meshes.collect(),
            grids: grids.collect(),
        }
    }

    /// One row each, the columns under one another.
    pub(crate) fn lines(&self, unit: &str) -> Vec<String> {
        let mut lines = Vec::new();
        if !self.surfaces.is_empty() {
            let head = ["surface", "name", "degree", "control points", "trim", "area", "size"];
            let rows = self.surfaces.iter().map(|s| {
                let rational = if s.rational { ", rational" } else { "" };
                let trim = match s.trim_loops {
                    0 => String::from("whole"),
                    1 => String::from("1 loop"),
                    n => format!("{n} loops"),
                };
                [
                    s.number.to_string(),
                    s.name.clone(),
                    format!("{} x {}{rational}", s.degree[0], s.degree[1]),
                    format!("{} x {}", s.control_points[0], s.control_points[1]),
                    trim,
                    format!("{} {unit}²", short(s.area)),
                    size(s.bounding_box, unit),
                ]
            });
            lines.extend(table(head, rows.collect()));
        }
        if !self.meshes.is_empty() {
            let head = ["part", "name", "vertices", "faces", "polylines", "size"];
            let rows = self.meshes.iter().map(|m| {
                let parts = match m.parts {
                    [a, b] if a < b => format!("{a} to {b}"),
                    [a, b] if a == b => a.to_string(),
                    _ => String::from("none"),
                };
                let counts = [m.vertices, m.faces, m.polylines].map(|n| n.to_string());
                let [vertices, faces, polylines] = counts;
                [parts, m.name.clone(), vertices, faces, polylines, size(m.bounding_box, unit)]
            });
            lines.extend(table(head, rows.collect()));
        }
        if !self.grids.is_empty() {
            let rows = self.grids.iter().map(|g| {
                let points = format!("{} x {}", g.points[0], g.points[1]);
                [g.name.clone(), points, size(g.bounding_box, unit)]
            });
            lines.extend(table(["grid", "points", "size"], rows.collect()));
        }
        lines
    }
}

fn surface_row(number: usize, named: &NamedSurface) -> SurfaceRow {
    let surface = &named.surface;
    let CurvatureStatistics { area, bounding_box, .. } = named.curvature_statistics();
    SurfaceRow {
        number,
        name: named.name.clone(),
        degree: [surface.degree_u(), surface.degree_v()].map(|d| d.get()),
        control_points: [surface.n_u(), surface.n_v()],
        rational: surface.is_rational(),
        trim_loops: named.trim.as_ref().map_or(0, |t| t.loops().len()),
        area,
        bounding_box: bounding_box.map(|b| [b.min.to_array(), b.max.to_array()]),
    }
}

fn mesh_row(parts: [usize; 2], mesh: &Mesh) -> MeshRow {
    MeshRow {
        name: mesh.name.clone(),
        parts,
        vertices: mesh.positions.len(),
        faces: mesh.faces.len(),
        polylines: mesh.lines.len(),
        bounding_box: of_points(&mesh.positions),
    }
}

fn of_points(points: &[DVec3]) -> Option<[[f64; 3]; 2]> {
    BoundingBox::of(points.iter().copied()).map(|b| [b.min.to_array(), b.max.to_array()])
}

fn size(bounds: Option<[[f64; 3]; 2]>, unit: &str) -> String {
    bounds.map_or_else(String::new, |[a, b]| {
        format!("{} x {} x {} {unit}", short(b[0] - a[0]), short(b[1] - a[1]), short(b[2] - a[2]))
    })
}

/// Six digits that matter, or powers of ten far from one.
fn short(x: f64) -> String {
    if x != 0.0 && !(1e-3..1e9).contains(&x.abs()) {
        return format!("{x:.5e}");
    }
    let whole = if x == 0.0 { 1 } else { x.abs().log10().floor() as i32 + 1 };
    let text = format!("{x:.*}", (6 - whole).clamp(0, 8) as usize);
    if text.contains('.') { text.trim_end_matches('0').trim_end_matches('.').into() } else { text }
}

fn table<const N: usize>(head: [&str; N], rows: Vec<[String; N]>) -> Vec<String> {
    let head = head.map(str::to_owned);
    let wide: [usize; N] = std::array::from_fn(|k| {
        let column = std::iter::once(&head).chain(&rows).map(|row| row[k].chars().count());
        column.max().unwrap_or(0)
    });
    let line = |row: &[String; N]| {
        let mut text = String::new();
        for (cell, width) in row.iter().zip(wide) {
            text += &format!("  {cell:<width$}");
        }
        text.trim_end().to_owned()
    };
    std::iter::once(&head).chain(&rows).map(line).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_short_and_columns_stand_under_one_another() {
        let shown = [0.0, 1.5, 39_478.417_6, 0.004_5, 1e-7, 123_456_789.4].map(short);
        assert_eq!(shown, ["0", "1.5", "39478.4", "0.0045", "1.00000e-7", "123456789"]);
        let rows = vec![["1".to_owned(), "é".to_owned()], ["23".to_owned(), String::new()]];
        assert_eq!(table(["a", "bc"], rows), ["  a   bc", "  1   é", "  23"]);
    }
}
