//! One file of a run against its metrics.

use crate::claims::{Claims, Finding, Values};
use crate::content::Content;
use crate::table::{Scale, row_of};
use crate::{analyze, asymptotic, convert, darboux, fair, fit, hnet, panel, remesh, weingarten};
use glam::DVec3;
use serde_json::Value;

/// Every number of `metrics` compared with what `file`, written by `command`, gives; `input` is
/// what the run was given, if that is known.
#[must_use]
pub fn check(
    command: &str,
    metrics: &Value,
    file: &Content,
    input: Option<&Content>,
) -> Vec<Finding> {
    let claims = Claims::new(metrics);
    let (size, center) = file.extent();
    // Measured at the origin, where nothing is lost to rounding.
    let center = rounded(center, size);
    let (file, input) = (file.moved(-center), input.map(|i| i.moved(-center)));
    let values = recompute(command, &claims, &file, input.as_ref(), Values::around(center));
    // The scale of lengths: the larger of the two, since deviations are of the input's size.
    let size = input.as_ref().map_or(size, |i| size.max(i.extent().0));
    let all = input.iter().chain([&file]);
    let count = all.map(Content::most_in_a_direction).max().unwrap_or(1);
    let scale = Scale { size, distance: center.length(), count };
    let is_single = file.is_single || (command == "convert" && input.is_some_and(|i| i.is_single));
    let numbers = claims.numbers().into_iter();
    numbers
        .map(|claim| {
            let row = row_of(command, &claim.0);
            Finding::new(claim, row, &values, (&scale, is_single))
        })
        .collect()
}

/// A place nearby that coordinates far from the origin can be moved from without rounding.
fn rounded(center: DVec3, size: f64) -> DVec3 {
    let grid = size.log2().floor().exp2() * GRID;
    (center / grid).round() * grid
}

/// The grid of such places, a share of the size.
const GRID: f64 = 1.0 / 1_048_576.0;

fn recompute(
    command: &str,
    claims: &Claims<'_>,
    file: &Content,
    input: Option<&Content>,
    mut values: Values,
) -> Values {
    let input_surface = input.and_then(|i| one(&i.surfaces));
    match command {
        "weingarten" => {
            // Of a trimmed surface a part is measured.
            let is_whole = !file.is_trimmed && input.is_none_or(|i| !i.is_trimmed);
            if let Some(surface) = one(&file.surfaces).filter(|_| is_whole) {
                weingarten::recompute(surface, input_surface, claims, &mut values);
            }
        }
        "demo" => {
            if let Some(surface) = one(&file.surfaces) {
                // The molds are surfaces as well, without the samples of the roof.
                let is_net = claims.count("control_points")
                    == Some(surface.different_counts().iter().product());
                if is_net {
                    weingarten::recompute(surface, input_surface, claims, &mut values);
                }
            }
            values.below("panels_after");
            // Of the surfaces one is the roof, several are molds; only these go on.
            let molds = if file.surfaces.len() > 1 { file.surfaces.clone() } else { Vec::new() };
            panel::recompute(&Content { surfaces: molds, ..file.clone() }, None, &mut values);
        }
        "panel" => panel::recompute(file, input_surface, &mut values),
        "hnet" => hnet::recompute(file, &mut values),
        "remesh" => {
            if let Some(mesh) = file.mesh() {
                remesh::recompute(mesh, claims, &mut values);
            }
        }
        "darboux" => {
            if let Some(mesh) = file.mesh() {
                darboux::recompute(mesh, claims, &mut values);
            }
        }
        "asymptotic" => asymptotic::recompute(&file.surfaces, file.extent().0, &mut values),
        "fair" => {
            if let Some(mesh) = file.mesh() {
                fair::recompute(mesh, claims, &mut values);
            } else if !file.surfaces.is_empty() {
                fair::recompute_patches(&file.surfaces, claims, &mut values);
            }
        }
        "fit" => {
            if let Some(surface) = one(&file.surfaces) {
                fit::recompute(surface, input, &mut values);
            }
        }
        "analyze" => {
            let is_regular = claims.count("singular_points") == Some(0);
            if !file.surfaces.is_empty() && is_regular && !file.is_trimmed {
                analyze::recompute(&file.surfaces, &mut values);
            }
        }
        "convert" => {
            let had_surfaces = claims.count("surfaces").is_some_and(|n| n > 0);
            if had_surfaces != file.surfaces.is_empty() {
                convert::recompute(file, &mut values);
            }
        }
        _ => {}
    }
    values
}

fn one<T>(list: &[T]) -> Option<&T> {
    if let [only] = list { Some(only) } else { None }
}
