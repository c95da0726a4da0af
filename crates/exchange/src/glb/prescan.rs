//! A look at the JSON of a scene before anything is made of it: an empty object of three bytes
//! would become hundreds.

use crate::error::ReadError;

/// What an object may become, with what a growing list keeps in reserve.
pub(super) const BYTES_PER_OBJECT: usize = 2048;
/// Memory for the objects of any scene.
const FREE: usize = 32 << 20;

/// Refuses a text with more objects than a file of `bytes` bytes may turn into.
pub(super) fn check_objects(text: &str, bytes: usize) -> Result<(), ReadError> {
    let most = (FREE + 8 * bytes) / BYTES_PER_OBJECT;
    let (mut count, mut in_text, mut escaped) = (0_usize, false, false);
    for (at, b) in text.bytes().enumerate() {
        match b {
            _ if escaped => escaped = false,
            b'\\' if in_text => escaped = true,
            b'"' => in_text = !in_text,
            b'{' if !in_text => {
                count += 1;
                if count > most {
                    let what = format!("more than {most} objects describe the scene");
                    let mend = "join its meshes before exporting it";
                    return Err(ReadError::binary(20 + at, what, mend));
                }
            }
            _ => {}
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use gltf::json;

    #[test]
    fn no_object_takes_more_than_is_counted() {
        let sizes = [
            size_of::<json::Node>(),
            size_of::<json::Mesh>(),
            size_of::<json::mesh::Primitive>(),
            size_of::<json::Accessor>(),
            size_of::<json::buffer::View>(),
            size_of::<json::Material>(),
            size_of::<json::Texture>(),
            size_of::<json::Image>(),
            size_of::<json::Animation>(),
            size_of::<json::Skin>(),
            size_of::<json::Camera>(),
            size_of::<json::Scene>(),
        ];
        assert!(sizes.iter().all(|size| 2 * size <= BYTES_PER_OBJECT), "{sizes:?}");
    }

    #[test]
    fn braces_in_texts_do_not_count() {
        let most = FREE / BYTES_PER_OBJECT;
        assert!(check_objects(&"{},".repeat(most), 0).is_ok());
        assert!(check_objects(&format!("\"{}\"", "{\\\"".repeat(2 * most)), 0).is_ok());
        let error = check_objects(&"{},".repeat(most + 1), 0).unwrap_err().to_string();
        let wanted = "byte 49172: more than 16384 objects describe the scene; join its meshes";
        assert!(error.starts_with(wanted), "{error}");
    }
}
