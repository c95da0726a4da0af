//! Files that are read, and what is taken of them.

use crate::context::Context;
use crate::failure::Failure;
use bspline::BsplineSurface;
use exchange::{Mesh, Model, NamedSurface, Pick, PickError};
use std::path::Path;
use subdiv_catmull_clark::{CreaseList, Creases};

/// `--surface`, for commands that work on surfaces.
#[derive(Clone, Debug, Default, clap::Args)]
pub(crate) struct SurfaceArgs {
    /// Take this surface of the file (repeatable; `all`); numbers as `analyze --list` shows them
    #[arg(long, value_name = "NAME|N")]
    pub(crate) surface: Vec<Pick>,
}

/// `--part`, for commands that work on meshes.
#[derive(Clone, Debug, Default, clap::Args)]
pub(crate) struct PartArgs {
    /// Take this connected part of the meshes (repeatable; `all`), by number or name of the mesh
    #[arg(long, value_name = "N|NAME")]
    pub(crate) part: Vec<Pick>,
    /// Keep corners of meshes apart that coincide to 1e-9 of the size
    #[arg(long)]
    pub(crate) no_weld: bool,
}

/// The content of the input, as far as it is chosen, its meshes welded and oriented; what was done
/// is among the warnings.
pub(crate) fn read(
    context: &Context,
    path: &Path,
    surface: &SurfaceArgs,
    part: &PartArgs,
) -> Result<Model, Failure> {
    let format = context.input_format.as_deref();
    let mut model = exchange::read_model_as(path, format).map_err(|e| Failure::input(path, e))?;
    model.mend(!part.no_weld);
    model.select(&surface.surface, &part.part).map_err(|e| refused(path, &e))?;
    Ok(model)
}

/// The one chosen surface of a file, and its model, which keeps unit and warnings.
pub(crate) fn read_surface(
    context: &Context,
    path: &Path,
    surface: &SurfaceArgs,
) -> Result<(Model, NamedSurface), Failure> {
    let model = read(context, path, surface, &PartArgs::default())?;
    let named = model.only_surface().map_err(|e| refused(path, &e))?.clone();
    Ok((model, named))
}

/// The sharp edges and vertices that the file of a control mesh gives it. What is to be said of them
/// joins `warnings`.
pub(crate) fn creases(
    path: &Path,
    mesh: &Mesh,
    warnings: &mut Vec<String>,
) -> Result<Creases, Failure> {
    if mesh.sharpness.is_empty() {
        return Ok(Creases::none());
    }
    let list = CreaseList {
        edges: mesh.sharpness.edges.iter().map(|&([a, b], s)| ((a, b), s)).collect(),
        corners: mesh.sharpness.vertices.iter().filter(|(_, s)| *s > 0.0).map(|c| c.0).collect(),
    };
    let soft = mesh.sharpness.vertices.iter().find(|(_, s)| *s > 0.0 && s.is_finite());
    warnings.extend(soft.map(|(vertex, sharpness)| {
        format!("vertex {vertex} has sharpness {sharpness}; a corner of any sharpness stays sharp")
    }));
    warnings.extend(list.note());
    let control = mesh.to_poly_mesh().map_err(|e| Failure::input(path, e))?;
    list.for_mesh(&control).map_err(|e| Failure::input(path, e))
}

/// The content of a file beside the input, its meshes mended as those of the input.
pub(crate) fn read_other(path: &Path, part: &PartArgs) -> Result<Model, Failure> {
    let mut model = exchange::read_model(path).map_err(|e| Failure::input(path, e))?;
    model.mend(!part.no_weld);
    Ok(model)
}

/// The one surface of a file beside the input.
pub(crate) fn read_other_surface(path: &Path) -> Result<BsplineSurface, Failure> {
    let model = exchange::read_model(path).map_err(|e| Failure::input(path, e))?;
    let named = model.only_surface().map_err(|e| refused(path, &e))?;
    Ok(named.surface.clone())
}

/// The one mesh of a model.
pub(crate) fn only_mesh<'a>(path: &Path, model: &'a Model) -> Result<&'a Mesh, Failure> {
    model.only_mesh().map_err(|e| refused(path, &e))
}

fn refused(path: &Path, error: &PickError) -> Failure {
    let text = error.to_string();
    let text = text.replace("as `surface`", "with --surface NAME|N");
    Failure::input(path, text.replace("as `part`", "with --part N"))
}
