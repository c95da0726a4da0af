//! Files that are read, and what is taken of them.

use crate::context::Context;
use crate::failure::Failure;
use bspline::BsplineSurface;
use exchange::{Mesh, Model, NamedSurface, Pick, PickError};
use std::path::Path;

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
}

/// The content of the input, as far as it is chosen.
pub(crate) fn read(
    context: &Context,
    path: &Path,
    surface: &SurfaceArgs,
    part: &PartArgs,
) -> Result<Model, Failure> {
    let format = context.input_format.as_deref();
    let mut model = exchange::read_model_as(path, format).map_err(|e| Failure::input(path, e))?;
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
