//! Colours that styles give to faces, shells, bodies and representations.

use super::file::StepFile;
use crate::color::linear;
use crate::error::ReadError;
use std::collections::HashMap;

/// Instances between a style and its colour.
const DEEPEST: usize = 12;
/// Instances looked at for one style.
const MOST: usize = 200;

impl StepFile<'_> {
    /// Linear RGB by the number of the styled instance.
    pub(super) fn colors(&self) -> Result<HashMap<u64, [f32; 3]>, ReadError> {
        let mut colors = HashMap::new();
        for instance in self.index.in_file_order() {
            let keyword = self.index.keyword(instance);
            if !matches!(keyword, b"STYLED_ITEM" | b"OVER_RIDING_STYLED_ITEM") {
                continue;
            }
            let Some(mut cursor) =
                self.index.at(instance).record(&String::from_utf8_lossy(keyword))
            else {
                continue;
            };
            cursor.skip_arguments(1)?;
            let styles = cursor.reference_list()?;
            cursor.comma()?;
            let Some(item) = cursor.optional_reference()? else { continue };
            let mut left = MOST;
            if let Some(color) = styles.iter().find_map(|id| self.color(*id, 0, &mut left)) {
                colors.insert(item, color.map(|c| linear(c.clamp(0.0, 1.0)) as f32));
            }
        }
        Ok(colors)
    }

    /// The first colour of a surface that a style leads to, as sRGB.
    fn color(&self, id: u64, depth: usize, left: &mut usize) -> Option<[f64; 3]> {
        if depth > DEEPEST || *left == 0 {
            return None;
        }
        *left -= 1;
        let keyword = self.keyword(id);
        let body = self.index.at(self.instance(id)?);
        match keyword {
            b"COLOUR_RGB" => {
                let mut cursor = body.record("COLOUR_RGB")?;
                cursor.skip_arguments(1).ok()?;
                let mut rgb = [0.0; 3];
                for (k, value) in rgb.iter_mut().enumerate() {
                    if k > 0 {
                        cursor.comma().ok()?;
                    }
                    *value = cursor.real().ok()?;
                }
                Some(rgb)
            }
            b"DRAUGHTING_PRE_DEFINED_COLOUR" => {
                let name = body.record("DRAUGHTING_PRE_DEFINED_COLOUR")?.string().ok()?;
                let found = PRE_DEFINED.iter().find(|(known, _)| *known == name);
                found.map(|(_, rgb)| *rgb)
            }
            // The colour of edges and points is not that of a face.
            b"CURVE_STYLE" | b"POINT_STYLE" | b"SURFACE_STYLE_BOUNDARY" => None,
            _ => {
                let mut ids = Vec::new();
                body.references(|id| ids.push(id));
                ids.into_iter().take(16).find_map(|id| self.color(id, depth + 1, left))
            }
        }
    }
}

/// The colours that ISO 10303-46 names.
const PRE_DEFINED: [(&str, [f64; 3]); 8] = [
    ("red", [1.0, 0.0, 0.0]),
    ("green", [0.0, 1.0, 0.0]),
    ("blue", [0.0, 0.0, 1.0]),
    ("yellow", [1.0, 1.0, 0.0]),
    ("magenta", [1.0, 0.0, 1.0]),
    ("cyan", [0.0, 1.0, 1.0]),
    ("black", [0.0, 0.0, 0.0]),
    ("white", [1.0, 1.0, 1.0]),
];
