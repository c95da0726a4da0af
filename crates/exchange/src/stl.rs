//! STL, ASCII and binary. Equal corners become one vertex.

use crate::error::ReadError;
use crate::mesh::Mesh;
use crate::text_number::coordinate;
use crate::triangulate::triangulate;
use geom_core::DVec3;
use std::collections::HashMap;

const HEADER: usize = 80;
const TRIANGLE: usize = 50;

/// Reads an STL file; triangles with two equal corners are dropped with a warning.
///
/// # Errors
/// [`ReadError`] names the line or byte at fault.
pub fn read_stl(bytes: &[u8]) -> Result<(Mesh, Vec<String>), ReadError> {
    let mut soup = Soup::default();
    let announced = bytes.get(HEADER..HEADER + 4).and_then(|b| b.try_into().ok());
    let announced = announced.map(|b: [u8; 4]| u32::from_le_bytes(b) as usize);
    let is_ascii = bytes.trim_ascii_start().starts_with(b"solid");
    match announced {
        // Some programs begin binary files with `solid` too, so the size decides.
        Some(n) if bytes.len() == HEADER + 4 + n * TRIANGLE => soup.read_binary(bytes)?,
        _ if is_ascii => soup.read_ascii(&String::from_utf8_lossy(bytes))?,
        Some(n) if n > 0 && bytes.len() > HEADER + 4 + n * TRIANGLE => {
            let end = HEADER + 4 + n * TRIANGLE;
            soup.read_binary(&bytes[..end])?;
            let rest = bytes.len() - end;
            soup.warnings
                .push(format!("byte {end}: the {rest} bytes after the last triangle are left out"));
        }
        Some(n) => {
            let fits = (bytes.len() - HEADER - 4) / TRIANGLE;
            let what = format!("{n} triangles are announced, the file has bytes for {fits}");
            return Err(ReadError::binary(HEADER, what, "the file is truncated or damaged"));
        }
        None => {
            let what = "the file is neither binary nor ASCII STL";
            return Err(ReadError::binary(0, what, "export it again"));
        }
    }
    if soup.mesh.faces.is_empty() {
        return Err(ReadError::content("the file has no triangle", "export it again"));
    }
    let dropped = soup.dropped;
    if dropped > 0 {
        soup.warnings.push(format!("{dropped} triangles with two equal corners are left out"));
    }
    Ok((soup.mesh, soup.warnings))
}

#[derive(Default)]
struct Soup {
    mesh: Mesh,
    ids: HashMap<[u64; 3], u32>,
    dropped: usize,
    warnings: Vec<String>,
}

impl Soup {
    fn read_binary(&mut self, bytes: &[u8]) -> Result<(), ReadError> {
        for (t, record) in bytes[HEADER + 4..].chunks_exact(TRIANGLE).enumerate() {
            let number = |k: usize| {
                let at = 12 + 4 * k;
                let raw = [record[at], record[at + 1], record[at + 2], record[at + 3]];
                f64::from(f32::from_le_bytes(raw))
            };
            let corners: [DVec3; 3] = std::array::from_fn(|c| {
                DVec3::from_array(std::array::from_fn(|k| number(3 * c + k)))
            });
            if let Some(corner) = corners.iter().find(|c| !c.is_finite()) {
                let what = format!("triangle {t} has the corner {corner}");
                let offset = HEADER + 4 + t * TRIANGLE;
                return Err(ReadError::binary(offset, what, "coordinates must be finite"));
            }
            self.push(corners);
        }
        Ok(())
    }

    fn read_ascii(&mut self, text: &str) -> Result<(), ReadError> {
        let mut corners = Vec::with_capacity(3);
        let mut ended = false;
        let mut last = 0;
        for (k, line) in text.lines().enumerate() {
            last = k + 1;
            let mut words = line.split_ascii_whitespace();
            match words.next() {
                Some("vertex") => {
                    let mut xyz = [0.0; 3];
                    for value in &mut xyz {
                        let word = words.next().ok_or_else(|| {
                            ReadError::text(k + 1, "a vertex without three coordinates", "add them")
                        })?;
                        *value = coordinate(word, k + 1)?;
                    }
                    corners.push(DVec3::from_array(xyz));
                }
                Some("endfacet") => match corners[..] {
                    [a, b, c] => {
                        self.push([a, b, c]);
                        corners.clear();
                    }
                    _ => {
                        let what = format!("a facet with {} vertices", corners.len());
                        return Err(ReadError::text(k + 1, what, "facets are triangles"));
                    }
                },
                Some("endsolid") => ended = true,
                Some("solid" | "facet" | "outer" | "endloop") | None => {}
                Some(_) if k == 0 => {}
                Some(_) => {
                    let what = "a line that is no part of an ASCII STL file";
                    return Err(ReadError::text(k + 1, what, "export the file again"));
                }
            }
        }
        if ended {
            return Ok(());
        }
        Err(ReadError::text(last, "the file ends before `endsolid`", "it is truncated"))
    }

    fn push(&mut self, corners: [DVec3; 3]) {
        let ids = corners.map(|p| {
            // Adding 0 makes -0 and 0 one vertex.
            let key = (p + DVec3::ZERO).to_array().map(f64::to_bits);
            let next = self.mesh.positions.len() as u32;
            *self.ids.entry(key).or_insert_with(|| {
                self.mesh.positions.push(p);
                next
            })
        });
        if ids[0] == ids[1] || ids[1] == ids[2] || ids[2] == ids[0] {
            self.dropped += 1;
        } else {
            self.mesh.faces.push(&ids);
        }
    }
}

/// Meshes as triangles in a binary STL file, which has single precision and no unit.
#[must_use]
pub fn write_stl(meshes: &[Mesh]) -> Vec<u8> {
    let mut bytes = b"Umbilic".to_vec();
    bytes.resize(HEADER + 4, 0);
    let mut count = 0_u32;
    for mesh in meshes {
        let mut triangles = Vec::new();
        mesh.faces.iter().for_each(|f| triangulate(&mesh.positions, f, &mut triangles));
        for t in triangles.chunks_exact(3) {
            let corners = [t[0], t[1], t[2]].map(|i| mesh.positions[i as usize]);
            let normal = (corners[1] - corners[0]).cross(corners[2] - corners[0]);
            for v in [normal.normalize_or_zero(), corners[0], corners[1], corners[2]] {
                bytes.extend(v.as_vec3().to_array().iter().flat_map(|x| x.to_le_bytes()));
            }
            bytes.extend([0, 0]);
            count += 1;
        }
    }
    bytes[HEADER..HEADER + 4].copy_from_slice(&count.to_le_bytes());
    bytes
}

#[cfg(test)]
mod tests {
    use super::*;

    fn tetrahedron() -> Mesh {
        let positions = vec![DVec3::ZERO, DVec3::X, DVec3::Y, DVec3::Z];
        Mesh::new(positions, [[0_u32, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]])
    }

    #[test]
    fn corners_are_welded_again() {
        let (mesh, warnings) = read_stl(&write_stl(&[tetrahedron()])).unwrap();
        assert_eq!((mesh.positions.len(), mesh.faces.len()), (4, 4));
        assert!(mesh.to_poly_mesh().unwrap().boundary_loops().is_empty());
        assert!(warnings.is_empty());
    }

    #[test]
    fn ascii_and_flat_triangles() {
        let facet = "facet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 -0\nvertex 0 1 0\n\
                     endloop\nendfacet\n";
        let text = format!("solid x\n{facet}{}endsolid x\n", facet.replace("1 0 -0", "0 0 0"));
        let (mesh, warnings) = read_stl(text.as_bytes()).unwrap();
        assert_eq!((mesh.positions.len(), mesh.faces.len()), (3, 1));
        assert_eq!(warnings, ["1 triangles with two equal corners are left out"]);
    }

    #[test]
    fn faults_name_place_and_mend() {
        let good = write_stl(&[tetrahedron()]);
        let mut huge = good.clone();
        huge[HEADER..HEADER + 4].copy_from_slice(&4_000_000_000_u32.to_le_bytes());
        let mut nan = good.clone();
        nan[HEADER + 4 + 12..HEADER + 4 + 16].copy_from_slice(&f32::NAN.to_le_bytes());
        let cases: [(&[u8], &str); 8] = [
            (b"", "byte 0: the file is neither"),
            (&good[..200], "byte 80: 4 triangles are announced, the file has bytes for 2"),
            (&huge, "byte 80: 4000000000 triangles are announced"),
            (&nan, "byte 84: triangle 0 has the corner [NaN"),
            (b"solid x\nvertex 0 0\n", "line 2: a vertex without three"),
            (b"solid x\nvertex 0 0 x\n", "line 2: `x` is not a finite number"),
            (b"solid x\nvertex 0 0 0\nendfacet\n", "line 3: a facet with 1 vertices"),
            (b"solid x\nfacet\n", "line 2: the file ends before `endsolid`"),
        ];
        for (bytes, want) in cases {
            let message = read_stl(bytes).unwrap_err().to_string();
            assert!(message.starts_with(want), "{message}, not {want}");
        }
    }
}
