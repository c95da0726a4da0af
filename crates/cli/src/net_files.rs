//! Quad nets in and hyperbolic nets out, for the commands that work on them.

use crate::context::Context;
use crate::failure::Failure;
use crate::input_file::{self, PartArgs, SurfaceArgs};
use exchange::{Field, LengthUnit, Mesh, Model, NamedSurface, Net, Segment};
use geom_core::{DVec3, PolyMesh};
use hyperbolic_nets::{HyperbolicNet, PatchJet, QuadNet, SampledPatches};
use std::path::{Path, PathBuf};

/// Formats of the commands on nets.
pub(crate) const NET_OUTPUTS: [&str; 10] =
    ["ron", "step", "stp", "3dm", "obj", "glb", "ply", "stl", "csv", "dxf"];

/// What an input holds.
pub(crate) enum NetInput {
    /// A net file: patches are known.
    Net(Box<HyperbolicNet>),
    /// Faces of a mesh.
    Mesh(PolyMesh),
}

/// Reads a net file (`.ron`) or the one chosen mesh of a file.
pub(crate) fn read(
    context: &Context,
    path: &Path,
    part: &PartArgs,
) -> Result<(NetInput, LengthUnit, Vec<String>), Failure> {
    let refused = |e: &dyn std::fmt::Display| Failure::input(path, e);
    if is_net(context, path) {
        if !part.part.is_empty() {
            return Err(Failure::usage("--part has no meaning for a net file; leave it out"));
        }
        let text = exchange::read_text(path).map_err(|e| refused(&e))?;
        let net = exchange::read_net(&text).map_err(|e| refused(&e))?;
        let mesh = net.to_poly_mesh().map_err(|e| refused(&e))?;
        let quads = QuadNet::new(&mesh).map_err(|e| refused(&e))?;
        if quads.quads() != net.quads.as_slice() || quads.positions().len() != net.vertices.len() {
            // Turned corners would exchange W and 1/W, dropped vertices shift the normals.
            return Err(refused(
                &"corners do not start along the first family in every face, or a vertex has no face; write the net with `umbilic hnet`",
            ));
        }
        let normals = (!net.normals.is_empty()).then_some(net.normals);
        let surface =
            HyperbolicNet::new(quads, normals, net.shape_parameters).map_err(|e| refused(&e))?;
        return Ok((NetInput::Net(Box::new(surface)), net.unit, Vec::new()));
    }
    let (mesh, unit, warnings) = read_mesh(context, path, part)?;
    Ok((NetInput::Mesh(mesh), unit, warnings))
}

/// Whether a file is to hold a net and not a mesh.
pub(crate) fn is_net(context: &Context, path: &Path) -> bool {
    match context.input_format.as_deref() {
        Some(format) => format == "ron",
        None => exchange::extension_of(path) == "ron",
    }
}

/// Reads the one chosen mesh of a file.
pub(crate) fn read_mesh(
    context: &Context,
    path: &Path,
    part: &PartArgs,
) -> Result<(PolyMesh, LengthUnit, Vec<String>), Failure> {
    let model = input_file::read(context, path, &SurfaceArgs::default(), part)?;
    let mesh = input_file::only_mesh(path, &model)?;
    let mesh = mesh.to_poly_mesh().map_err(|e| Failure::input(path, e))?;
    Ok((mesh, model.unit, model.warnings))
}

/// Refuses outputs that could not be written at the end.
pub(crate) fn check_outputs(outputs: &[PathBuf], known: &[&str]) -> Result<(), Failure> {
    for (k, path) in outputs.iter().enumerate() {
        if outputs[..k].contains(path) {
            let message = format!("{}: named twice as an output; drop one", path.display());
            return Err(Failure::usage(message));
        }
        crate::args::check_output_path(path)?;
        let extension = exchange::extension_of(path);
        if !known.contains(&extension.as_str()) {
            let list = known.join(", ");
            return Err(Failure::input(
                path,
                format!("no writer of nets for the extension `{extension}`; use one of {list}"),
            ));
        }
    }
    Ok(())
}

/// The bytes of one output file.
pub(crate) fn encode(
    path: &Path,
    surface: &HyperbolicNet,
    unit: &LengthUnit,
    wire_positions: usize,
) -> Result<Vec<u8>, Failure> {
    let model = |mesh: Mesh| Model::of_mesh(mesh, unit.clone());
    let write =
        |model: &Model| exchange::encode_model(path, model).map_err(|e| Failure::input(path, e));
    match exchange::extension_of(path).as_str() {
        "ron" => exchange::write_net(&net_file(surface, unit))
            .map(String::into_bytes)
            .map_err(Failure::other),
        "step" | "stp" | "3dm" => {
            let mut surfaces = Vec::with_capacity(surface.shape().len());
            for (face, patch) in surface.patches().map_err(Failure::other)?.iter().enumerate() {
                let surface = patch.to_surface().map_err(Failure::other)?;
                surfaces.push(NamedSurface::new(format!("panel {face}"), surface));
            }
            write(&Model { unit: unit.clone(), surfaces, ..Model::default() })
        }
        "glb" | "ply" | "stl" => {
            let sampled = SampledPatches::new(surface, PICTURE_CELLS, PatchJet::sample)
                .map_err(Failure::other)?;
            write(&model(sampled_mesh("hyperbolic net", &sampled)))
        }
        "csv" | "dxf" => {
            let cuts =
                hyperbolic_nets::wire_cuts(surface, wire_positions).map_err(Failure::other)?;
            let segments: Vec<Segment> = cuts
                .iter()
                .map(|c| Segment {
                    labels: vec![c.face as u64, u64::from(c.family), c.index as u64],
                    ends: c.ends,
                })
                .collect();
            Ok(if exchange::extension_of(path) == "csv" {
                exchange::write_segments_csv(&["panel", "family", "position"], &segments)
            } else {
                exchange::write_segments_dxf("PANEL", &segments)
            }
            .into_bytes())
        }
        _ => write(&model(Mesh::from_poly_mesh(surface.net().mesh()))),
    }
}

/// Cells of a patch in pictures and meshes.
pub(crate) const PICTURE_CELLS: usize = 6;

fn net_file(surface: &HyperbolicNet, unit: &LengthUnit) -> Net {
    Net {
        unit: unit.clone(),
        vertices: surface.net().positions().to_vec(),
        quads: surface.net().quads().to_vec(),
        normals: surface.normals().map(<[DVec3]>::to_vec).unwrap_or_default(),
        shape_parameters: surface.shape().to_vec(),
    }
}

/// A mesh with exact normals and curvatures.
pub(crate) fn sampled_mesh(name: &str, sampled: &SampledPatches) -> Mesh {
    let field = |name: &str, value: fn(&hyperbolic_nets::SurfaceSample) -> f64| Field {
        name: name.to_owned(),
        values: sampled.samples.iter().map(value).collect(),
    };
    Mesh {
        name: name.to_owned(),
        positions: sampled.samples.iter().map(|s| s.point).collect(),
        normals: sampled.samples.iter().map(|s| s.normal).collect(),
        faces: sampled.quads().into_iter().collect(),
        vertex_fields: vec![field("H", |s| s.mean_curvature), field("K", |s| s.gaussian_curvature)],
        ..Mesh::default()
    }
}
