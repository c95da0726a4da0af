//! Files with one B-spline surface.

use crate::failure::Failure;
use exchange::{Model, NamedSurface};
use std::path::Path;

/// The one surface of a file, taken out of its model, which keeps unit and warnings.
pub(crate) fn read_surface(path: &Path) -> Result<(Model, NamedSurface), Failure> {
    let mut model = exchange::read_model(path).map_err(|e| Failure::input(path, e))?;
    match model.surfaces.len() {
        1 => {
            let named = model.surfaces.remove(0);
            Ok((model, named))
        }
        0 => Err(Failure::input(
            path,
            "there is no B-spline surface in this file; give a RON scene or a STEP file with one",
        )),
        n => Err(Failure::input(
            path,
            format!("there are {n} surfaces in this file; leave one of them in it"),
        )),
    }
}
