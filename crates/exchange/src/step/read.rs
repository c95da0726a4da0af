//! Reading: every B-spline and Bezier surface of a file, whatever it is part of.

use super::face::Faces;
use super::file::{StepFile, points};
use super::parse::Index;
use crate::error::ReadError;
use crate::model::{Model, NamedSurface};

/// Reads the B-spline, rational and Bezier surfaces of a STEP file, in the order of the file.
/// Coordinates are kept as they are, with the unit; trims, placements and other kinds of surfaces
/// are left out with a warning.
///
/// # Errors
/// [`ReadError`] with the line of the first fault, or if there is no surface.
pub fn read_step(text: &[u8]) -> Result<Model, ReadError> {
    let index = Index::new(text)?;
    let mut model = Model::default();
    check_references(&index, &mut model.warnings)?;
    let file = StepFile { points: points(&index), index };
    let faces = Faces::of(&file)?;
    for instance in file.index.in_file_order() {
        let Some((own_name, surface)) = file.surface(instance)? else { continue };
        let name = faces.name(instance.id).filter(|n| !n.is_empty()).unwrap_or(own_name);
        faces.check(&file, instance, &surface)?;
        model.surfaces.push(NamedSurface { name, surface });
    }
    faces.report(&file, &mut model.warnings);
    model.unit = file.length_unit(&mut model.warnings)?;
    if model.surfaces.is_empty() {
        let kinds = faces.other_kinds(&file);
        let what = if kinds.is_empty() {
            "the file has no surface".to_owned()
        } else {
            format!("the file has no B-spline surface, only {kinds}")
        };
        return Err(ReadError::content(what, "export the faces as B-spline (NURBS) surfaces"));
    }
    Ok(model)
}

/// An instance that names itself makes no sense; one that names a missing one may matter to
/// nobody, so it only becomes an error when it is needed.
fn check_references(index: &Index<'_>, warnings: &mut Vec<String>) -> Result<(), ReadError> {
    let mut dangling: Option<(u64, u64)> = None;
    for instance in index.by_id() {
        let mut itself = false;
        index.at(*instance).references(|id| {
            itself |= id == instance.id;
            if dangling.is_none() && index.position(id).is_none() {
                dangling = Some((instance.id, id));
            }
        });
        if itself {
            let what = format!("#{} contains itself", instance.id);
            return Err(index.at(*instance).error(what, "export the file again"));
        }
    }
    if let Some((from, to)) = dangling {
        warnings.push(format!("#{from} names #{to}, which is defined nowhere; it was not needed"));
    }
    Ok(())
}
