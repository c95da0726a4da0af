//! What a file is by its first bytes, where its name does not tell or tells wrong.

/// How sure a guess is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Guess {
    /// The bytes say so: a reader of another format would refuse them.
    Sure(&'static str),
    /// It looks like it.
    Likely(&'static str),
}

/// Bytes that are looked at; a binary STL file has its length in them.
const HEAD: usize = 4096;

/// The format of a file by its content, as its extension.
pub(crate) fn guess(bytes: &[u8]) -> Option<Guess> {
    use Guess::{Likely, Sure};
    if bytes.starts_with(b"glTF") {
        return Some(Sure("glb"));
    }
    if bytes.starts_with(b"3D Geometry File Format ") {
        return Some(Sure("3dm"));
    }
    let head = &bytes[..bytes.len().min(HEAD)];
    let head = head.strip_prefix(b"\xEF\xBB\xBF").unwrap_or(head).trim_ascii_start();
    if head.starts_with(b"ISO-10303-21") {
        return Some(Sure("step"));
    }
    let line = head.split(|b| *b == b'\n' || *b == b'\r').next().unwrap_or_default();
    let line = line.trim_ascii();
    if line.eq_ignore_ascii_case(b"ply") {
        return Some(Sure("ply"));
    }
    let first = line.split(u8::is_ascii_whitespace).next().unwrap_or_default();
    if first.ends_with(b"OFF") && first.len() <= 6 {
        return Some(Sure("off"));
    }
    let faces = bytes.get(80..84).map(|b| u32::from_le_bytes([b[0], b[1], b[2], b[3]]));
    if faces.is_some_and(|n| bytes.len() as u64 == 84 + 50 * u64::from(n)) {
        return Some(Sure("stl"));
    }
    if first == b"solid" && contains(head, b"facet") {
        return Some(Sure("stl"));
    }
    match head.first() {
        Some(b'{' | b'[') => return Some(Likely("json")),
        Some(b'(') => return Some(Likely("ron")),
        _ if head.starts_with(b"//") || head.starts_with(b"#!") => return Some(Likely("ron")),
        _ => {}
    }
    let mut lines = head.split(|b| *b == b'\n').map(<[u8]>::trim_ascii);
    let statement = lines.find(|line| !line.is_empty() && !line.starts_with(b"#"))?;
    let keyword = statement.split(u8::is_ascii_whitespace).next().unwrap_or_default();
    let known: [&[u8]; 11] =
        [b"v", b"vn", b"vt", b"vp", b"o", b"g", b"s", b"mtllib", b"usemtl", b"cstype", b"deg"];
    known.contains(&keyword).then_some(Likely("obj"))
}

fn contains(text: &[u8], word: &[u8]) -> bool {
    text.windows(word.len()).any(|w| w == word)
}

/// Whether two extensions name the same format.
pub(crate) fn is_same(a: &str, b: &str) -> bool {
    let plain = |e: &str| if e == "stp" { "step".to_owned() } else { e.to_owned() };
    plain(a) == plain(b)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn formats_are_known_by_their_first_bytes() {
        use Guess::{Likely, Sure};
        let mut binary = vec![b' '; 84 + 50];
        binary[80..84].copy_from_slice(&1_u32.to_le_bytes());
        let cases: [(&[u8], Option<Guess>); 16] = [
            (b"glTF\x02\0\0\0", Some(Sure("glb"))),
            (b"3D Geometry File Format       60", Some(Sure("3dm"))),
            (b"\xEF\xBB\xBF\r\nISO-10303-21;", Some(Sure("step"))),
            (b"PLY\r\nformat ascii 1.0", Some(Sure("ply"))),
            (b"COFF 3 1 0", Some(Sure("off"))),
            (b"solid a\n facet normal 0 0 1", Some(Sure("stl"))),
            (&binary, Some(Sure("stl"))),
            (b"  {\"asset\"", Some(Likely("json"))),
            (b"// a roof\n(surfaces: [])", Some(Likely("ron"))),
            (b"(unit: \"m\")", Some(Likely("ron"))),
            (b"# made by\n\nmtllib a.mtl\nv 0 0 0", Some(Likely("obj"))),
            (b"v 0 0 0", Some(Likely("obj"))),
            (b"solid ground", None),
            (b"<svg>", None),
            (b"", None),
            (b"\0\0\0\0", None),
        ];
        for (bytes, wanted) in cases {
            assert_eq!(guess(bytes), wanted, "{}", String::from_utf8_lossy(bytes));
        }
    }
}
