//! OFF, the polygon format of Geomview.

use crate::error::{ReadError, clip};
use crate::mesh::Mesh;
use crate::text_number::coordinate;
use geom_core::DVec3;

/// Reads an OFF file (also `COFF`, `NOFF`, `STOFF` and their combinations: extra numbers of
/// vertices and colours of faces are skipped), and what to say of lines after the last face.
///
/// # Errors
/// [`ReadError::Text`] names the first line at fault.
pub fn read_off(text: &str) -> Result<(Mesh, Vec<String>), ReadError> {
    let mut lines = text
        .lines()
        .enumerate()
        .map(|(k, line)| (k + 1, line.split('#').next().unwrap_or_default().trim()))
        .filter(|(_, line)| !line.is_empty());
    let last = text.lines().count();
    let ended = |what: &str| {
        ReadError::text(last, format!("the file ends before {what}"), "it is truncated")
    };
    let (number, first) = lines.next().ok_or_else(|| ended("its counts"))?;
    let keyword = first.split_ascii_whitespace().next().unwrap_or_default();
    let after = match keyword.strip_suffix("OFF") {
        Some(kind) if kind.chars().all(|c| "STCN".contains(c)) => first[keyword.len()..].trim(),
        _ if keyword.parse::<usize>().is_ok() => first,
        _ => {
            let what = format!("`{}` instead of OFF", clip(keyword));
            return Err(ReadError::text(number, what, "only three-dimensional OFF files are read"));
        }
    };
    let (number, counts) = if after.is_empty() {
        lines.next().ok_or_else(|| ended("its counts"))?
    } else {
        (number, after)
    };
    let counts: Vec<usize> =
        counts.split_ascii_whitespace().map_while(|word| word.parse().ok()).collect();
    let [vertices, faces, ..] = counts[..] else {
        return Err(ReadError::text(
            number,
            "no counts",
            "write the numbers of vertices and faces",
        ));
    };
    if vertices.saturating_add(faces) > text.len() {
        let what = format!("{vertices} vertices and {faces} faces do not fit into the file");
        return Err(ReadError::text(number, what, "correct the counts"));
    }
    let mut mesh = Mesh::default();
    for _ in 0..vertices {
        let mut words = Words::new();
        let mut xyz = [0.0; 3];
        for value in &mut xyz {
            let (word, number) = words.next(&mut lines).ok_or_else(|| ended("its last vertex"))?;
            *value = coordinate(word, number)?;
        }
        mesh.positions.push(DVec3::from_array(xyz));
    }
    let mut corners = Vec::new();
    for _ in 0..faces {
        let mut words = Words::new();
        let (word, number) = words.next(&mut lines).ok_or_else(|| ended("its last face"))?;
        let n: usize = word.parse().unwrap_or(0);
        if n < 3 {
            let what = format!("face with {n} corners");
            return Err(ReadError::text(number, what, "a face needs at least 3"));
        }
        corners.clear();
        for _ in 0..n {
            let (word, number) = words.next(&mut lines).ok_or_else(|| ended("its last face"))?;
            match word.parse::<usize>() {
                Ok(index) if index < vertices => corners.push(index as u32),
                _ => {
                    let what = format!("`{}` names no vertex", clip(word));
                    let mend = format!("the file has {vertices} vertices, counted from 0");
                    return Err(ReadError::text(number, what, mend));
                }
            }
        }
        mesh.faces.push(&corners);
    }
    if mesh.positions.is_empty() {
        return Err(ReadError::content("the file has no vertex", "export it again"));
    }
    let rest = lines.next();
    let warning = |(line, _)| format!("line {line}: what follows the last face is left out");
    Ok((mesh, rest.map(warning).into_iter().collect()))
}

/// The words of one vertex or face, which may run on over lines; what is left of its last line
/// (colours and the like) is not looked at.
struct Words<'a> {
    line: std::str::SplitAsciiWhitespace<'a>,
    number: usize,
}

impl<'a> Words<'a> {
    fn new() -> Self {
        Self { line: "".split_ascii_whitespace(), number: 0 }
    }

    fn next(
        &mut self,
        lines: &mut impl Iterator<Item = (usize, &'a str)>,
    ) -> Option<(&'a str, usize)> {
        loop {
            if let Some(word) = self.line.next() {
                return Some((word, self.number));
            }
            let (number, line) = lines.next()?;
            (self.number, self.line) = (number, line.split_ascii_whitespace());
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn mixed_polygons_comments_and_colours() {
        let text = "COFF # a comment\n\n5 2 0\n0 0 0 1 0 0 1\n1 0 0\n1 1 0\n0 1 0\n0.5 2 1\n\
                    4 0 1 2 3 255 0 0\n3  3 2 4\n";
        let (mesh, warnings) = read_off(text).unwrap();
        assert!(warnings.is_empty());
        let (_, warnings) = read_off(&format!("{text}# fine\n\n4 0 1 2 3\n")).unwrap();
        assert_eq!(warnings, ["line 13: what follows the last face is left out"]);
        assert_eq!(mesh.positions[4], DVec3::new(0.5, 2.0, 1.0));
        assert_eq!(mesh.faces.iter().collect::<Vec<_>>(), [&[0, 1, 2, 3][..], &[3, 2, 4]]);
        assert!(read_off("OFF 1 0 0\n1 2 3\n").is_ok());
        let (over_lines, _) = read_off("OFF\n3 1 0\n0\n0 0\n1 0 0\n0 1\n0\n3 0\n1\n2\n").unwrap();
        assert_eq!(over_lines.positions[2], DVec3::Y);
        assert_eq!(over_lines.faces.get(0), [0, 1, 2]);
    }

    #[test]
    fn faults_name_line_and_mend() {
        let cases = [
            ("", "line 0: the file ends before its counts"),
            ("4OFF\n1 0 0\n", "line 1: `4OFF` instead of OFF"),
            ("OFF\nx\n", "line 2: no counts"),
            ("OFF\n4000000000 1 0\n", "line 2: 4000000000 vertices and 1 faces do not fit"),
            ("OFF\n2 0 0\n0 0 0\n", "line 3: the file ends before its last vertex"),
            ("OFF\n1 0 0\n0 0\n", "line 3: the file ends before its last vertex"),
            ("OFF\n1 0 0\n0 0 inf\n", "line 3: `inf` is not a finite number"),
            ("OFF\n1 1 0\n0 0 0\n3 0 0 1\n", "line 4: `1` names no vertex"),
            ("OFF\n1 1 0\n0 0 0\n2 0 0\n", "line 4: face with 2 corners"),
            ("OFF\n1 1 0\n0 0 0\n3 0\n", "line 4: the file ends before its last face"),
            ("OFF\n0 0 0\n", "the file has no vertex"),
        ];
        for (text, want) in cases {
            let message = read_off(text).unwrap_err().to_string();
            assert!(message.starts_with(want), "{message}, not {want}");
        }
    }
}
