//! Tags of control meshes in OBJ: `t NAME INTEGERS/NUMBERS/WORDS …`, as subdivision modellers write
//! them. Vertices are counted from 0 there.

use crate::error::{ReadError, clip};
use crate::mesh::Sharpness;
use crate::text_number::coordinate;
use std::fmt::Write;

/// What a sharpness from here on stands for: an edge that stays sharp.
const INFINITE: f64 = 10.0;

/// A tag.
pub(crate) enum Tag {
    /// Both ends of an edge and its sharpness.
    Crease([u32; 2], f64),
    /// A vertex and its sharpness.
    Corner(u32, f64),
    /// Another one, by its name.
    Unknown(String),
}

/// Reads what stands behind `t`.
///
/// # Errors
/// [`ReadError::Text`] for counts that do not fit the tag, and what is no number.
pub(crate) fn read<'a>(
    mut words: impl Iterator<Item = &'a str>,
    line: usize,
) -> Result<Tag, ReadError> {
    let name = words.next().unwrap_or_default();
    let ends = match name {
        "crease" => 2,
        "corner" => 1,
        _ => return Ok(Tag::Unknown(clip(name))),
    };
    let counts = words.next().unwrap_or_default();
    let wanted = format!("{ends}/1/0");
    if counts != wanted {
        let what = format!("a {name} with the counts `{}`", clip(counts));
        return Err(ReadError::text(line, what, format!("write `t {name} {wanted}`")));
    }
    let mut vertex = || {
        let word = words.next().unwrap_or_default();
        word.parse::<u32>().map_err(|_| {
            let what = format!("`{}` is no vertex of a {name}", clip(word));
            ReadError::text(line, what, "tags count vertices from 0")
        })
    };
    let first = vertex()?;
    let second = if ends == 2 { vertex()? } else { first };
    let sharpness = coordinate(words.next().unwrap_or_default(), line)?;
    if sharpness < 0.0 {
        let what = format!("a {name} of sharpness {sharpness}");
        return Err(ReadError::text(line, what, "give a number from 0 up"));
    }
    let sharpness = if sharpness >= INFINITE { f64::INFINITY } else { sharpness };
    Ok(match ends {
        2 => Tag::Crease([first, second], sharpness),
        _ => Tag::Corner(first, sharpness),
    })
}

/// Writes the tags of a mesh whose first vertex has the number `base`.
pub(crate) fn write(text: &mut String, sharpness: &Sharpness, base: usize) {
    let number = |s: f64| if s == f64::INFINITY { INFINITE } else { s };
    // Writing into a `String` cannot fail.
    for &([a, b], s) in &sharpness.edges {
        let (a, b) = (a as usize + base, b as usize + base);
        let _ = writeln!(text, "t crease 2/1/0 {a} {b} {}", number(s));
    }
    for &(v, s) in &sharpness.vertices {
        let _ = writeln!(text, "t corner 1/1/0 {} {}", v as usize + base, number(s));
    }
}

#[cfg(test)]
mod tests {
    use crate::{Mesh, read_obj, write_obj};

    const QUAD: &str = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nf 1 2 3 4\n";

    #[test]
    fn creases_and_corners_come_back() {
        let text =
            format!("{QUAD}t crease 2/1/0 0 1 2.5\nt crease 2/1/0 1 2 10\nt corner 1/1/0 3 4\n");
        let model = read_obj(&text).unwrap();
        let sharpness = &model.meshes[0].sharpness;
        assert_eq!(sharpness.edges, [([0, 1], 2.5), ([1, 2], f64::INFINITY)]);
        assert_eq!(sharpness.vertices, [(3, 4.0)]);
        // The second of two meshes counts on.
        let other = Mesh { name: "b".into(), ..model.meshes[0].clone() };
        let both = read_obj(&write_obj(&[model.meshes[0].clone(), other])).unwrap();
        assert_eq!(both.meshes[0].sharpness.edges[2], ([4, 5], 2.5));
        assert_eq!(both.meshes[0].sharpness.vertices, [(3, 4.0), (7, 4.0)]);
    }

    #[test]
    fn faulty_tags_name_their_line_and_others_are_told() {
        for (tag, want) in [
            ("t crease 2/1/0 0 9 1", "vertex 9"),
            ("t crease 4/2/0 0 1 2 3 1 1", "2/1/0"),
            ("t crease 2/1/0 0 x 1", "`x` is no vertex"),
            ("t crease 2/1/0 0 1 -1", "sharpness -1"),
            ("t corner 1/1/0 0 nan", "nan"),
        ] {
            let error = read_obj(&format!("{QUAD}{tag}\n")).unwrap_err().to_string();
            assert!(error.contains("line 6") && error.contains(want), "{tag}: {error}");
        }
        let model = read_obj(&format!("{QUAD}t hole 1/0/0 0\nt hole 1/0/0 1\n")).unwrap();
        assert_eq!(model.warnings, ["line 6: the tag `hole` of a control mesh is left out"]);
    }
}
