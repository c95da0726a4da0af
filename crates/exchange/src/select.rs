//! Some of the surfaces or meshes of a file, chosen by name or number.

use crate::mesh::{Field, Mesh};
use crate::model::{Model, NamedSurface};
use std::convert::Infallible;
use std::fmt::Write;
use std::str::FromStr;

/// Names that an error lists at most.
const MOST_NAMES: usize = 8;

/// What to take of a file.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Pick {
    /// Everything.
    All,
    /// By the place in the file, counted from 1.
    Number(usize),
    /// All that have this name.
    Name(String),
}

impl FromStr for Pick {
    type Err = Infallible;

    /// `all`, a number, or anything else as a name.
    fn from_str(text: &str) -> Result<Self, Infallible> {
        Ok(match text.parse() {
            Ok(number) => Self::Number(number),
            Err(_) if text == "all" => Self::All,
            Err(_) => Self::Name(text.to_owned()),
        })
    }
}

/// Why nothing, or not just one thing, could be taken of a file.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
#[expect(missing_docs, reason = "the messages spell out every field")]
pub enum PickError {
    /// The file has nothing of the kind.
    #[error("there is no {kind} in this file; give a file with one")]
    Nothing { kind: &'static str },
    /// A number out of range.
    #[error("there is no {kind} {number} in this file; give a number from 1 to {count}")]
    Number { kind: &'static str, number: usize, count: usize },
    /// A name that nothing has.
    #[error("no {kind} of this file is named `{name}`; there are {known}")]
    Name { kind: &'static str, name: String, known: String },
    /// Several where one was wanted.
    #[error("there are {count} {kind}s in this file, {known}; choose one of them as `{kind}`")]
    Several { kind: &'static str, count: usize, known: String },
}

impl Model {
    /// Keeps the chosen surfaces and parts and drops all else; without any choice keeps
    /// everything. Parts are the connected pieces of the meshes, counted through all of them.
    ///
    /// # Errors
    /// [`PickError`] if a choice fits nothing.
    ///
    /// # Example
    /// ```
    /// use exchange::{Pick, read_scene};
    /// let flat = |name: &str| format!("(name: \"{name}\", u: (degree: 1), v: (degree: 1), \
    ///     control_points: [[(0, 0, 0), (0, 1, 0)], [(1, 0, 0), (1, 1, 0)]])");
    /// let scene = format!("(surfaces: [{}, {}])", flat("roof"), flat("wall"));
    /// let mut model = read_scene(&scene)?;
    /// model.select(&["wall".parse::<Pick>()?], &[])?;
    /// assert_eq!(model.only_surface()?.name, "wall");
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    pub fn select(&mut self, surfaces: &[Pick], parts: &[Pick]) -> Result<(), PickError> {
        if surfaces.is_empty() && parts.is_empty() {
            return Ok(());
        }
        let names: Vec<&str> = self.surfaces.iter().map(|s| s.name.as_str()).collect();
        let chosen = chosen("surface", &names, surfaces)?;
        let parts = if parts.is_empty() { Vec::new() } else { picked_parts(&self.meshes, parts)? };
        let mut place = chosen.into_iter();
        self.surfaces.retain(|_| place.next() == Some(true));
        self.meshes = parts;
        self.grids.clear();
        Ok(())
    }

    /// The one surface of the model.
    ///
    /// # Errors
    /// [`PickError`] if there is none, or more than one.
    pub fn only_surface(&self) -> Result<&NamedSurface, PickError> {
        let kind = "surface";
        match self.surfaces.as_slice() {
            [] => Err(PickError::Nothing { kind }),
            [only] => Ok(only),
            all => {
                let names: Vec<&str> = all.iter().map(|s| s.name.as_str()).collect();
                Err(PickError::Several { kind, count: all.len(), known: listed(&names) })
            }
        }
    }

    /// The one mesh with faces of the model.
    ///
    /// # Errors
    /// [`PickError`] if there is none, or more than one.
    pub fn only_mesh(&self) -> Result<&Mesh, PickError> {
        let with_faces: Vec<&Mesh> = self.meshes.iter().filter(|m| !m.faces.is_empty()).collect();
        match with_faces[..] {
            [] => Err(PickError::Nothing { kind: "mesh" }),
            [only] => Ok(only),
            _ => {
                let names: Vec<&str> = with_faces.iter().map(|m| m.name.as_str()).collect();
                let (kind, count) = ("part", names.len());
                Err(PickError::Several { kind, count, known: listed(&names) })
            }
        }
    }
}

/// Which of the named things are chosen, in their order.
fn chosen(kind: &'static str, names: &[&str], picks: &[Pick]) -> Result<Vec<bool>, PickError> {
    let mut chosen = vec![false; names.len()];
    for pick in picks {
        if names.is_empty() {
            return Err(PickError::Nothing { kind });
        }
        match pick {
            Pick::All => chosen.fill(true),
            Pick::Number(number) => {
                let place = number.checked_sub(1).and_then(|k| chosen.get_mut(k));
                let (number, count) = (*number, names.len());
                *place.ok_or(PickError::Number { kind, number, count })? = true;
            }
            Pick::Name(name) => {
                let mut found = false;
                for (known, chosen) in names.iter().zip(&mut chosen) {
                    if known == name {
                        (*chosen, found) = (true, true);
                    }
                }
                if !found {
                    let (name, known) = (name.clone(), listed(names));
                    return Err(PickError::Name { kind, name, known });
                }
            }
        }
    }
    Ok(chosen)
}

/// Numbers and names, as far as they fit into a message.
fn listed(names: &[&str]) -> String {
    let mut text = String::new();
    for (k, name) in names.iter().take(MOST_NAMES).enumerate() {
        let comma = if k > 0 { ", " } else { "" };
        // Writing into a `String` cannot fail.
        let _ = match name.is_empty() {
            true => write!(text, "{comma}{}", k + 1),
            false => write!(text, "{comma}{} `{}`", k + 1, crate::error::clip(name)),
        };
    }
    if names.len() > MOST_NAMES {
        text.push_str(", …");
    }
    text
}

/// The chosen parts, each as a mesh of its own.
fn picked_parts(meshes: &[Mesh], picks: &[Pick]) -> Result<Vec<Mesh>, PickError> {
    let owners: Vec<Vec<u32>> = meshes.iter().map(Mesh::piece_of_vertices).collect();
    let counts: Vec<usize> = meshes.iter().zip(&owners).map(|(m, o)| pieces(m, o)).collect();
    let names: Vec<&str> = meshes
        .iter()
        .zip(&counts)
        .flat_map(|(mesh, count)| std::iter::repeat_n(mesh.name.as_str(), *count))
        .collect();
    let chosen = chosen("part", &names, picks)?;
    let mut parts = Vec::new();
    let mut first = 0;
    for ((mesh, owners), count) in meshes.iter().zip(&owners).zip(&counts) {
        let here = &chosen[first..first + count];
        first += count;
        if here.iter().all(|c| *c) {
            if *count > 0 {
                parts.push(mesh.clone());
            }
            continue;
        }
        let wanted = (0..*count).filter(|k| here[*k]);
        parts.extend(wanted.map(|k| mesh.piece(owners, k as u32)));
    }
    Ok(parts)
}

/// How many pieces a mesh has, by the pieces of its vertices.
fn pieces(mesh: &Mesh, owners: &[u32]) -> usize {
    if mesh.faces.is_empty() {
        return usize::from(!mesh.positions.is_empty());
    }
    owners.iter().filter(|o| **o != LOOSE).max().map_or(0, |last| *last as usize + 1)
}

/// The piece of a vertex without a face.
const LOOSE: u32 = u32::MAX;

impl Mesh {
    /// How many pieces the faces make that hang together by common vertices; one without faces.
    #[must_use]
    pub fn piece_count(&self) -> usize {
        pieces(self, &self.piece_of_vertices())
    }

    /// The piece of every vertex, numbered by their first faces.
    fn piece_of_vertices(&self) -> Vec<u32> {
        let mut parent: Vec<u32> = (0..self.positions.len() as u32).collect();
        for corners in self.faces.iter() {
            for pair in corners.windows(2) {
                let (a, b) = (root(&mut parent, pair[0]), root(&mut parent, pair[1]));
                parent[a.max(b) as usize] = a.min(b);
            }
        }
        let mut owners = vec![LOOSE; parent.len()];
        let mut numbers = vec![LOOSE; parent.len()];
        let mut count = 0;
        for corners in self.faces.iter() {
            for &corner in corners {
                let number = &mut numbers[root(&mut parent, corner) as usize];
                if *number == LOOSE {
                    *number = count;
                    count += 1;
                }
                owners[corner as usize] = *number;
            }
        }
        owners
    }

    /// The faces of a piece with what belongs to them, and the polylines along them.
    fn piece(&self, owners: &[u32], piece: u32) -> Self {
        let kept: Vec<usize> = (0..owners.len()).filter(|v| owners[*v] == piece).collect();
        let mut moved = vec![LOOSE; owners.len()];
        kept.iter().enumerate().for_each(|(k, v)| moved[*v] = k as u32);
        let has = |list: &[u32]| list.iter().all(|v| owners[*v as usize] == piece);
        let faces: Vec<usize> = (0..self.faces.len()).filter(|f| has(self.faces.get(*f))).collect();
        let moved = |list: &[u32]| list.iter().map(|v| moved[*v as usize]).collect::<Vec<u32>>();
        let mut groups = vec![None; self.groups.len()];
        let mut made = Self { name: self.name.clone(), ..Self::default() };
        for group in faces.iter().filter_map(|f| self.face_group(*f)) {
            let next = made.groups.len() as u32;
            if groups[group].is_none() {
                groups[group] = Some(next);
                made.groups.push(self.groups[group].clone());
            }
        }
        made.positions = kept.iter().map(|v| self.positions[*v]).collect();
        made.faces = faces.iter().map(|f| moved(self.faces.get(*f))).collect();
        made.lines = self.lines.iter().filter(|line| has(line)).map(moved).collect();
        made.face_groups = faces
            .iter()
            .filter_map(|f| self.face_group(*f))
            .map(|g| groups[g].unwrap_or_default())
            .collect();
        made.normals = of(&self.normals, &kept);
        made.colors = of(&self.colors, &kept);
        let fields = |fields: &[Field], kept: &[usize]| {
            let field = |f: &Field| Field { name: f.name.clone(), values: of(&f.values, kept) };
            fields.iter().map(field).collect()
        };
        made.sharpness = self.sharpness.renumbered(|v| {
            let is_kept = owners.get(v as usize) == Some(&piece);
            is_kept.then(|| moved(&[v])[0])
        });
        made.vertex_fields = fields(&self.vertex_fields, &kept);
        made.face_fields = fields(&self.face_fields, &faces);
        made
    }
}

/// The entries at some places, of a list that may be empty.
fn of<T: Clone>(all: &[T], places: &[usize]) -> Vec<T> {
    places.iter().filter_map(|k| all.get(*k).cloned()).collect()
}

/// The representative of a vertex; paths are halved on the way.
fn root(parent: &mut [u32], mut v: u32) -> u32 {
    while parent[v as usize] != v {
        let above = parent[parent[v as usize] as usize];
        parent[v as usize] = above;
        v = above;
    }
    v
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::Group;
    use geom_core::DVec3;

    /// Two triangles apart in one mesh, and a quad.
    fn model() -> Model {
        let at = |k: u32| DVec3::new(f64::from(k), f64::from(k * k), 0.0);
        let mut two = Mesh::new((0..7).map(at).collect(), [[0, 1, 6], [2, 3, 5]]);
        two.name = "two".into();
        two.groups = vec![Group::new("a"), Group::new("b")];
        two.face_groups = vec![0, 1];
        two.face_fields = vec![Field { name: "f".into(), values: vec![1.0, 2.0] }];
        two.vertex_fields =
            vec![Field { name: "x".into(), values: (0..7).map(f64::from).collect() }];
        two.lines.push(&[3, 5]);
        two.lines.push(&[0, 3]);
        let quad = Mesh::new((0..4).map(at).collect(), [[0, 1, 2, 3]]);
        Model { meshes: vec![two, quad], ..Model::default() }
    }

    fn picks(words: &[&str]) -> Vec<Pick> {
        words.iter().filter_map(|w| w.parse().ok()).collect()
    }

    #[test]
    fn parts_are_pieces_counted_through_all_meshes() {
        let mut second = model();
        assert_eq!(second.meshes[0].piece_count(), 2);
        second.select(&[], &picks(&["2"])).unwrap();
        let part = second.only_mesh().unwrap();
        assert_eq!(part.faces.get(0), [0, 1, 2]);
        assert_eq!(part.positions[2], DVec3::new(5.0, 25.0, 0.0));
        assert_eq!((part.groups.len(), part.groups[0].name.as_str()), (1, "b"));
        assert_eq!((&part.face_groups[..], part.lines.len()), (&[0][..], 1));
        assert_eq!(part.vertex_fields[0].values, [2.0, 3.0, 5.0]);
        assert_eq!(part.face_fields[0].values, [2.0]);
        let mut third = model();
        third.select(&[], &picks(&["3"])).unwrap();
        assert_eq!(third.meshes, model().meshes[1..]);
        let mut named = model();
        named.select(&[], &picks(&["two"])).unwrap();
        assert_eq!(named.meshes, model().meshes[..1]);
        let mut all = model();
        all.select(&[], &picks(&["all"])).unwrap();
        assert_eq!(all, model());
    }

    #[test]
    fn what_is_not_there_is_said() {
        let said = |surfaces: &[&str], parts: &[&str]| {
            model().select(&picks(surfaces), &picks(parts)).unwrap_err().to_string()
        };
        let none = "there is no surface in this file; give a file with one";
        assert_eq!(said(&["1"], &[]), none);
        let four = "there is no part 4 in this file; give a number from 1 to 3";
        assert_eq!(said(&[], &["4"]), four);
        assert!(said(&[], &["0"]).contains("no part 0"));
        let name = "no part of this file is named `x`; there are 1 `two`, 2 `two`, 3";
        assert_eq!(said(&[], &["x"]), name);
        let several = model().only_mesh().unwrap_err().to_string();
        assert_eq!(
            several,
            "there are 2 parts in this file, 1 `two`, 2; choose one of them as `part`"
        );
    }
}
