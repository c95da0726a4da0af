//! A saddle panelled once with as many molds as the published rule asks for and once on as few as
//! keep every kink within one degree; writes the second as `saddle.obj` with a colour per mold.
#![allow(clippy::print_stdout, reason = "an example")]

use exchange::{Group, Mesh, write_files, write_obj_and_materials};
use paneling::{Counts, Options, Solution, solve};
use std::path::Path;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let surface = fixtures::surfaces::Shape::Saddle.surface(10, 10, 4, 4);
    let panels = Some(Counts { u: 12, v: 12 });
    let by_rule = solve(&surface, &Options { panels, ..Options::default() }, &mut ())?;
    let options = Options { panels, max_kink_deg: Some(1.0), ..Options::default() };
    let few = solve(&surface, &options, &mut ())?;
    for (name, solution) in [("3 √N molds", &by_rule), ("kinks within 1°", &few)] {
        let quality = &solution.metrics.quality;
        println!(
            "{name}: {} panels on {} molds, largest kink {:.3}°, largest gap {:.2e}, {}",
            quality.panels,
            quality.molds,
            quality.kink_max_deg,
            quality.gap_max,
            solution.report.status,
        );
    }
    let [panels, materials] = write_obj_and_materials(&[mesh(&few)], "saddle.mtl");
    write_files(&[
        (Path::new("saddle.obj"), panels.as_bytes()),
        (Path::new("saddle.mtl"), materials.as_bytes()),
    ])?;
    println!("written: saddle.obj, saddle.mtl");
    Ok(())
}

/// All panels as triangles on their molds, a group per mold.
fn mesh(solution: &Solution) -> Mesh {
    let paneling = &solution.result;
    let mut mesh = Mesh { name: "panels".into(), ..Mesh::default() };
    mesh.groups = (0..paneling.molds.len()).map(|m| Group::new(format!("mold-{m}"))).collect();
    for (p, &mold) in paneling.labels.iter().enumerate() {
        let panel = paneling.panel_mesh(&solution.panels, p);
        let first = mesh.positions.len() as u32;
        mesh.positions.extend(panel.positions);
        mesh.normals.extend(panel.normals);
        for triangle in panel.triangles {
            mesh.faces.push(&triangle.map(|v| first + v));
            mesh.face_groups.push(mold as u32);
        }
    }
    mesh
}
