//! What written files hold, as plain numbers for checking them.

use crate::choice::Choice;
use crate::failure::Failure;
use bspline::{BsplineSurface, KnotVector};
use exchange::{Model, Net, Pick};
use geom_core::DVec3;
use paneling::{MoldType, PanelRow};
use serde::Deserialize;
use std::path::Path;
use verify::{Content, Mesh, Spline};

/// The RON form of a paneling.
#[derive(Deserialize)]
struct PanelingFile {
    molds: Vec<paneling::Mold>,
    panels: Vec<PanelRow>,
}

/// Whether a file may hold what a claim can be recomputed from; reports, drawings and checkpoints
/// do not.
pub(crate) fn is_content(command: &str, path: &Path) -> bool {
    let extension = exchange::extension_of(path);
    if extension == "json" && is_record(path) {
        return false;
    }
    if extension == "ron" && command == "weingarten" && is_relation(path) {
        return false;
    }
    exchange::READABLE.split(", ").any(|known| known == extension)
        || (extension == "csv" && is_panels(command))
}

/// Whether a JSON file holds the metrics or the checkpoint of a run.
fn is_record(path: &Path) -> bool {
    let text = exchange::read_text(path).unwrap_or_default();
    let value = serde_json::from_str::<serde_json::Value>(&text).unwrap_or_default();
    ["metrics", "fingerprint"].iter().any(|key| value.get(key).is_some())
}

/// Whether a file holds the control points of a relation.
fn is_relation(path: &Path) -> bool {
    exchange::read_ron::<Vec<(f64, f64)>>(path).is_ok()
}

fn is_panels(command: &str) -> bool {
    matches!(command, "panel" | "demo")
}

/// Reads one file that `command` has written.
pub(crate) fn read(command: &str, path: &Path) -> Result<Content, Failure> {
    let refused = |e: &dyn std::fmt::Display| Failure::input(path, e);
    match exchange::extension_of(path).as_str() {
        "ron" if command == "panel" => {
            let file: PanelingFile = exchange::read_ron(path).map_err(|e| refused(&e))?;
            Ok(of_paneling(&file))
        }
        "ron" if command == "hnet" => read_net(path),
        "csv" if is_panels(command) => {
            let text = exchange::read_text(path).map_err(|e| refused(&e))?;
            of_table(&text).map_err(|e| refused(&e))
        }
        _ => read_model(path),
    }
}

/// Reads what a run was given: a model, as far as it was chosen, or the net file of `hnet`.
pub(crate) fn read_input(path: &Path, choice: &Choice) -> Result<Content, Failure> {
    read_chosen(path, choice).or_else(|failure| {
        let is_ron = exchange::extension_of(path) == "ron";
        if is_ron { read_net(path).map_err(|_| failure) } else { Err(failure) }
    })
}

fn read_model(path: &Path) -> Result<Content, Failure> {
    read_chosen(path, &Choice::default())
}

fn read_chosen(path: &Path, choice: &Choice) -> Result<Content, Failure> {
    let refused = |e: &dyn std::fmt::Display| Failure::input(path, e);
    let format = choice.input_format.as_deref();
    let mut model = exchange::read_model_as(path, format).map_err(|e| refused(&e))?;
    // A choice is any text: what is no number and not `all` is a name.
    let picks = |list: &[String]| list.iter().filter_map(|p| p.parse().ok()).collect::<Vec<Pick>>();
    model.select(&picks(&choice.surface), &picks(&choice.part)).map_err(|e| refused(&e))?;
    let extension = exchange::extension_of(path);
    let mut content = of_model(&model).map_err(|e| Failure::input(path, e))?;
    content.is_single = matches!(extension.as_str(), "glb" | "stl");
    Ok(content)
}

fn read_net(path: &Path) -> Result<Content, Failure> {
    let text = exchange::read_text(path).map_err(|e| Failure::input(path, e))?;
    let Net { vertices, quads, shape_parameters, .. } =
        exchange::read_net(&text).map_err(|e| Failure::input(path, e))?;
    let faces = quads.iter().map(|q| q.map(|v| v as usize).to_vec()).collect();
    let meshes = vec![Mesh { positions: vertices, faces }];
    Ok(Content { meshes, shape_parameters, ..Content::default() })
}

/// Surfaces, point grids and meshes of a model.
pub(crate) fn of_model(model: &Model) -> Result<Content, verify::SplineError> {
    let surfaces = model.surfaces.iter().map(|s| of_surface(&s.surface));
    let grids = model.grids.iter().map(|g| Mesh { positions: g.points.clone(), faces: Vec::new() });
    let meshes = model.meshes.iter().map(|m| Mesh {
        positions: m.positions.clone(),
        faces: m.faces.iter().map(|f| f.iter().map(|v| *v as usize).collect()).collect(),
    });
    Ok(Content {
        surfaces: surfaces.collect::<Result<_, _>>()?,
        meshes: grids.chain(meshes).collect(),
        is_trimmed: model.surfaces.iter().any(|s| s.trim.is_some()),
        ..Content::default()
    })
}

/// A closed direction repeats its first control points at the end.
fn of_surface(surface: &BsplineSurface) -> Result<Spline, verify::SplineError> {
    let (u, v) = (surface.knots_u(), surface.knots_v());
    let count = |knots: &KnotVector| knots.knots().len() - knots.degree().get() - 1;
    let (n_u, n_v) = (surface.n_u(), surface.n_v());
    let place = |k: usize| {
        let (i, j) = (k / count(v), k % count(v));
        (i % n_u) * n_v + j % n_v
    };
    let all = 0..count(u) * count(v);
    let points: Vec<DVec3> = all.clone().map(|k| surface.control_points()[place(k)]).collect();
    let weights: Option<Vec<f64>> = surface.weights().map(|w| all.map(|k| w[place(k)]).collect());
    let degrees = [u.degree().get(), v.degree().get()];
    let knots = [u.knots().to_vec(), v.knots().to_vec()];
    let closed = [u.is_periodic(), v.is_periodic()];
    Ok(Spline::new(degrees, knots, &points, weights.as_deref())?.with_closed(closed))
}

fn of_paneling(file: &PanelingFile) -> Content {
    let row = |row: &PanelRow| verify::PanelRow {
        mold: row.mold,
        origin: DVec3::from_array(row.origin),
        axes: [row.x_axis, row.z_axis].map(DVec3::from_array),
        corners: row.corners.clone(),
        worst_kink_deg: row.worst_kink_deg,
        worst_gap: row.worst_gap,
    };
    Content {
        molds: file.molds.iter().map(of_mold).collect(),
        panels: file.panels.iter().map(row).collect(),
        ..Content::default()
    }
}

fn of_mold(mold: &paneling::Mold) -> verify::Mold {
    let p = mold.parameters;
    match mold.kind {
        MoldType::Plane => verify::Mold::Plane,
        MoldType::Cylinder => verify::Mold::Cylinder(p[0]),
        MoldType::Sphere => verify::Mold::Sphere(p[0]),
        MoldType::Paraboloid => verify::Mold::Paraboloid(p[0], p[1]),
        MoldType::Torus => verify::Mold::Torus(p[0], p[1], p[2]),
        MoldType::Cubic => verify::Mold::Cubic(p),
    }
}

/// The rows of `panels.csv`.
fn of_table(text: &str) -> Result<Content, String> {
    let mut lines = text.lines().enumerate();
    let header: Vec<&str> = lines.next().map(|(_, l)| l.split(',').collect()).unwrap_or_default();
    let column = |name: &str| {
        let found = header.iter().position(|h| h.trim() == name);
        found.ok_or(format!("line 1: there is no column `{name}`; give the table that panel wrote"))
    };
    let vector = |name: &str| -> Result<[usize; 3], String> {
        let [x, y, z] = ["x", "y", "z"].map(|axis| column(&format!("{name}_{axis}")));
        Ok([x?, y?, z?])
    };
    let (mold, kink, gap) = (column("mold")?, column("worst_kink_deg")?, column("worst_gap")?);
    let (origin, x_axis, z_axis) = (vector("origin")?, vector("x_axis")?, vector("z_axis")?);
    let mut content = Content::default();
    for (index, line) in lines {
        let cells: Vec<&str> = line.split(',').collect();
        let number = |k: usize| -> Result<f64, String> {
            let cell = cells.get(k).copied().unwrap_or_default();
            let value = cell.trim().parse::<f64>().ok().filter(|x| x.is_finite());
            value.ok_or(format!(
                "line {}: `{cell}` is no number for {}; write the table again",
                index + 1,
                header[k]
            ))
        };
        let point = |at: [usize; 3]| -> Result<DVec3, String> {
            Ok(DVec3::new(number(at[0])?, number(at[1])?, number(at[2])?))
        };
        content.panels.push(verify::PanelRow {
            mold: number(mold)? as usize,
            origin: point(origin)?,
            axes: [point(x_axis)?, point(z_axis)?],
            corners: Vec::new(),
            worst_kink_deg: number(kink)?,
            worst_gap: number(gap)?,
        });
    }
    Ok(content)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_table_names_the_line_at_fault() {
        let header = "panel,mold,origin_x,origin_y,origin_z,x_axis_x,x_axis_y,x_axis_z,\
                      z_axis_x,z_axis_y,z_axis_z,worst_kink_deg,worst_gap";
        let good = format!("{header}\n0,3,0,0,0,1,0,0,0,0,1,0.5,0.25\n");
        let content = of_table(&good).unwrap();
        assert_eq!((content.panels[0].mold, content.panels[0].worst_gap), (3, 0.25));
        let bad = of_table(&format!("{good}1,2,x,0,0,1,0,0,0,0,1,0.5,0.25\n")).unwrap_err();
        assert!(bad.starts_with("line 3: `x` is no number for origin_x"), "{bad}");
        assert!(of_table("a,b\n").unwrap_err().starts_with("line 1: there is no column `mold`"));
    }
}
