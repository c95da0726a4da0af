//! No circle of files: two files of a crate that import each other, directly or through others, are
//! one thing in two places.

use super::tokens::{tokens, without_tests};
use crate::shell::{Outcome, read, root};
use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

/// Looks for circles of files in the sources of every crate.
pub(crate) fn check(faults: &mut Vec<String>) -> Outcome {
    let folder = root().join("crates");
    let entries = std::fs::read_dir(&folder).map_err(|e| format!("{}: {e}", folder.display()))?;
    let mut crates: Vec<PathBuf> = entries.flatten().map(|entry| entry.path()).collect();
    crates.extend([root().join("fixtures"), root().join("xtask")]);
    crates.sort();
    for path in crates {
        let name = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
        let mut texts = BTreeMap::new();
        gather(&path.join("src"), &path.join("src"), &mut texts)?;
        faults.extend(circles(&texts).iter().map(|circle| format!("{name}: {circle}")));
    }
    Ok(())
}

/// All Rust files below `folder` by their names from `base` on, with `/` between folders.
fn gather(base: &Path, folder: &Path, texts: &mut BTreeMap<String, String>) -> Outcome {
    let entries = std::fs::read_dir(folder).map_err(|e| format!("{}: {e}", folder.display()))?;
    for path in entries.flatten().map(|entry| entry.path()) {
        if path.is_dir() {
            gather(base, &path, texts)?;
        } else if path.extension().is_some_and(|e| e == "rs") {
            let parts = path.strip_prefix(base).unwrap_or(&path).components();
            let parts: Vec<_> = parts.map(|c| c.as_os_str().to_string_lossy()).collect();
            texts.insert(parts.join("/"), read(&path)?);
        }
    }
    Ok(())
}

/// One sentence per circle among the files of a crate, which are given by their names below `src`.
fn circles(texts: &BTreeMap<String, String>) -> Vec<String> {
    let arrows = Tree::new(texts).arrows();
    let reached: BTreeMap<&str, BTreeSet<&str>> =
        arrows.keys().map(|file| (*file, reachable(&arrows, file))).collect();
    let mut told = BTreeSet::new();
    let mut out = Vec::new();
    for (file, targets) in &reached {
        let mutual = |other: &&&str| reached.get(**other).is_some_and(|back| back.contains(file));
        let circle: Vec<&str> = targets.iter().filter(mutual).copied().collect();
        if circle.is_empty() || !told.insert(circle.clone()) {
            continue;
        }
        let mut imports = Vec::new();
        for from in &circle {
            for (to, names) in arrows[from].iter().filter(|(to, _)| circle.contains(to)) {
                let names: Vec<&str> = names.iter().map(String::as_str).collect();
                imports.push(format!("{from} takes {} from {to}", names.join(", ")));
            }
        }
        out.push(format!(
            "circle of {}: {}; move what goes against the current into a file of its own",
            circle.join(", "),
            imports.join("; ")
        ));
    }
    out
}

/// What each file takes from which other.
type Arrows<'a> = BTreeMap<&'a str, BTreeMap<&'a str, BTreeSet<String>>>;

/// All files that `start` depends on, itself only if it is on a circle.
fn reachable<'a>(arrows: &Arrows<'a>, start: &str) -> BTreeSet<&'a str> {
    let mut found = BTreeSet::new();
    let mut open = vec![start];
    while let Some(file) = open.pop() {
        for to in arrows.get(file).into_iter().flat_map(BTreeMap::keys) {
            if found.insert(*to) {
                open.push(to);
            }
        }
    }
    found
}

/// A path from the root of the crate.
type Place<'a> = Vec<&'a str>;

/// One name of a `use`.
struct Import<'a> {
    /// As written, without a final `self`.
    path: Vec<&'a str>,
    /// What the name is in this file; `None` for `*`.
    name: Option<&'a str>,
}

struct File<'a> {
    name: &'a str,
    place: Place<'a>,
    tokens: Vec<&'a str>,
    imports: Vec<Import<'a>>,
    /// `lib.rs`, `main.rs` and `mod.rs` are tables of contents: imports go through them to the file
    /// that they take a name from.
    is_contents: bool,
}

/// The files of a crate by their places.
struct Tree<'a> {
    files: BTreeMap<Place<'a>, File<'a>>,
}

impl<'a> Tree<'a> {
    fn new(texts: &'a BTreeMap<String, String>) -> Self {
        let mut files = BTreeMap::new();
        let mut for_tests: Vec<Place<'a>> = Vec::new();
        for (name, text) in texts {
            let mut place: Place<'a> = name.trim_end_matches(".rs").split('/').collect();
            let is_root = matches!(place.as_slice(), ["lib" | "main"]);
            // With a library beside it the program is a crate of its own.
            if place[0] == "bin" || (name == "main.rs" && texts.contains_key("lib.rs")) {
                continue;
            }
            let is_contents = is_root || place.last() == Some(&"mod");
            if is_contents {
                place.pop();
            }
            let (tokens, modules) = without_tests(&tokens(text));
            for_tests.extend(modules.iter().map(|m| [place.as_slice(), &[m]].concat()));
            let imports = imports(&tokens);
            files.insert(place.clone(), File { name, place, tokens, imports, is_contents });
        }
        files.retain(|place, _| !for_tests.iter().any(|test| place.starts_with(test)));
        Self { files }
    }

    fn arrows(&self) -> Arrows<'a> {
        let mut arrows = Arrows::new();
        for file in self.files.values().filter(|file| !file.is_contents) {
            let targets: &mut BTreeMap<_, BTreeSet<String>> = arrows.entry(file.name).or_default();
            for (module, path) in paths(file) {
                let Some(place) = self.absolute(file, &module, &path) else { continue };
                for target in self.homes(&place, 0) {
                    if target != file.name {
                        let name = path.last().copied().unwrap_or_default();
                        targets.entry(target).or_default().insert(name.to_owned());
                    }
                }
            }
        }
        arrows
    }

    /// The place that `path` names when written in `module`, which is `file` or within it; `None`
    /// for other crates, types and variables.
    fn absolute(&self, file: &File<'a>, module: &[&'a str], path: &[&'a str]) -> Option<Place<'a>> {
        if let Some(place) = self.without_imports(module, path) {
            return Some(place);
        }
        let (first, rest) = path.split_first()?;
        let import = file.imports.iter().find(|import| import.name == Some(first))?;
        self.without_imports(&file.place, &[&import.path, rest].concat())
    }

    fn without_imports(&self, module: &[&'a str], path: &[&'a str]) -> Option<Place<'a>> {
        let (first, mut rest) = path.split_first()?;
        let mut place = match *first {
            "crate" => Place::new(),
            "self" => module.to_vec(),
            "super" => module.split_last()?.1.to_vec(),
            name => Some([module, &[name]].concat()).filter(|p| self.files.contains_key(p))?,
        };
        while *first == "super" && rest.first() == Some(&"super") {
            place.pop()?;
            rest = &rest[1..];
        }
        place.extend(rest);
        Some(place)
    }

    /// The files where `place` is defined, through tables of contents; none for names that stand in
    /// a table of contents itself.
    fn homes(&self, place: &[&'a str], depth: usize) -> BTreeSet<&'a str> {
        let known = (0..=place.len()).rev().find(|&k| self.files.contains_key(&place[..k]));
        // Tables of contents that take a name from one another in turn do not compile.
        let Some(known) = known.filter(|_| depth < 16) else { return BTreeSet::new() };
        let (file, rest) = (&self.files[&place[..known]], &place[known..]);
        if !file.is_contents {
            return BTreeSet::from([file.name]);
        }
        let Some((wanted, beyond)) = rest.split_first() else { return BTreeSet::new() };
        let follow = |path: &[&'a str], beyond: &[&'a str]| {
            let place = self.absolute(file, &file.place, &[path, beyond].concat());
            place.map_or_else(BTreeSet::new, |place| self.homes(&place, depth + 1))
        };
        let mut found = BTreeSet::new();
        for import in &file.imports {
            // `*` takes everything that the table of contents has.
            if *wanted == "*" || import.name == Some(*wanted) {
                found.extend(follow(&import.path, beyond));
            } else if let (None, Some((_, module))) = (import.name, import.path.split_last()) {
                let homes = follow(module, &[wanted]);
                found.extend(homes.into_iter().filter(|home| self.defines(home, wanted)));
            }
        }
        found
    }

    fn defines(&self, file: &str, name: &str) -> bool {
        let item = ["fn", "struct", "enum", "trait", "type", "const", "static"];
        let mut files = self.files.values().filter(|f| f.name == file);
        files.any(|f| f.tokens.windows(2).any(|pair| item.contains(&pair[0]) && pair[1] == name))
    }
}

/// All names that `use` brings into a file.
fn imports<'a>(tokens: &[&'a str]) -> Vec<Import<'a>> {
    let mut out = Vec::new();
    for at in (0..tokens.len()).filter(|&at| is_use(tokens, at)) {
        import_tree(tokens, at + 1, Vec::new(), &mut out);
    }
    out
}

/// Whether a `use` declaration starts here; `use<…>` in a bound is none.
fn is_use(tokens: &[&str], at: usize) -> bool {
    tokens[at] == "use" && tokens.get(at + 1) != Some(&"<")
}

/// Reads one branch of a `use` and returns where it ends.
fn import_tree<'a>(
    tokens: &[&'a str],
    mut at: usize,
    mut path: Vec<&'a str>,
    out: &mut Vec<Import<'a>>,
) -> usize {
    while let Some(&token) = tokens.get(at) {
        at += 1;
        match token {
            "{" => {
                while tokens.get(at).is_some_and(|t| *t != "}") {
                    at = import_tree(tokens, at, path.clone(), out);
                    at += usize::from(tokens.get(at) == Some(&","));
                }
                return at + 1;
            }
            "*" => {
                path.push("*");
                out.push(Import { path, name: None });
                return at;
            }
            // Between names; at the start it says that another crate follows.
            "::" => {
                if path.is_empty() {
                    path.push("::");
                }
            }
            ";" | "," | "}" => return at - 1,
            name => {
                if name != "self" || path.is_empty() {
                    path.push(name);
                }
                if tokens.get(at) == Some(&"::") {
                    continue;
                }
                let mut bound = path.last().copied();
                if tokens.get(at) == Some(&"as") {
                    bound = tokens.get(at + 1).copied();
                    at += 2;
                }
                out.push(Import { path, name: bound });
                return at;
            }
        }
    }
    at
}

/// Every path of two names or more in a file, with the module it stands in.
fn paths<'a>(file: &File<'a>) -> Vec<(Place<'a>, Vec<&'a str>)> {
    let tokens = &file.tokens;
    let mut out = Vec::new();
    let mut module = file.place.clone();
    // Depth of braces, and the depths at which the modules inside the file began.
    let (mut depth, mut inside) = (0, Vec::new());
    let mut at = 0;
    while at < tokens.len() {
        let token = tokens[at];
        let mut next = at + 1;
        match token {
            "{" => depth += 1,
            "}" => {
                depth -= 1;
                if inside.last() == Some(&depth) {
                    inside.pop();
                    module.pop();
                }
            }
            "mod" if tokens.get(at + 2) == Some(&"{") => {
                inside.push(depth);
                module.push(tokens[at + 1]);
            }
            "use" if is_use(tokens, at) => {
                let mut found = Vec::new();
                next = import_tree(tokens, at + 1, Vec::new(), &mut found);
                out.extend(found.into_iter().map(|import| (module.clone(), import.path)));
            }
            // The scope of a visibility, `pub(in crate::a)`, takes nothing from there.
            "pub" if tokens.get(at + 2) == Some(&"in") => {
                next = at + tokens[at..].iter().position(|t| *t == ")").unwrap_or(0) + 1;
            }
            name if is_name(name) => {
                let mut path = vec![name];
                while tokens.get(next) == Some(&"::")
                    && tokens.get(next + 1).is_some_and(|t| is_name(t))
                {
                    path.push(tokens[next + 1]);
                    next += 2;
                }
                let is_start = at == 0 || tokens[at - 1] != "::";
                if is_start && path.len() > 1 {
                    out.push((module.clone(), path));
                }
            }
            _ => {}
        }
        at = next;
    }
    out
}

fn is_name(token: &str) -> bool {
    token.starts_with(|c: char| c.is_alphabetic() || c == '_')
}

#[cfg(test)]
mod tests {
    use super::*;

    fn tree(files: &[(&str, &str)]) -> BTreeMap<String, String> {
        files.iter().map(|(name, text)| ((*name).to_owned(), (*text).to_owned())).collect()
    }

    /// The names of the files on each circle.
    fn circles_of(files: &[(&str, &str)]) -> Vec<String> {
        let told = circles(&tree(files)).into_iter();
        told.map(|s| s["circle of ".len()..s.find(':').unwrap()].to_owned()).collect()
    }

    #[test]
    fn two_files_that_import_each_other_are_a_circle_with_its_names() {
        let files = tree(&[
            ("lib.rs", "mod a; mod b; pub use a::A;"),
            ("a.rs", "use crate::b::{self, B as Other}; pub struct A(Other);"),
            ("b.rs", "pub struct B; fn f() -> crate::a::A { crate::a::make() }"),
        ]);
        assert_eq!(
            circles(&files),
            ["circle of a.rs, b.rs: a.rs takes B, b from b.rs; b.rs takes A, make from a.rs; \
              move what goes against the current into a file of its own"]
        );
    }

    #[test]
    fn a_tree_without_circles_has_none() {
        let files = [
            ("lib.rs", "mod a; mod b; mod c;"),
            ("a.rs", "use crate::{b::B, c::*}; use rayon::prelude::*; fn f() { a::g(); }"),
            ("b.rs", "use crate::c::C; impl B { fn a() { Self::b(); crate::b::h() } }"),
            ("c.rs", "pub struct C; /* crate::a::A */ const TEXT: &str = \"crate::b::B\";"),
        ];
        assert!(circles_of(&files).is_empty());
    }

    #[test]
    fn circles_go_through_other_files_and_tables_of_contents() {
        let files = [
            ("lib.rs", "mod a; mod wing; pub use wing::inner::Deep; pub use a::{A, f as g};"),
            ("a.rs", "use crate::Deep; pub struct A; pub fn f() {}"),
            ("wing/mod.rs", "mod inner; mod outer; pub use outer::*; fn own() {}"),
            ("wing/inner.rs", "use super::Outer; pub struct Deep;"),
            ("wing/outer.rs", "pub struct Outer; fn f() { crate::g(); }"),
            ("aside.rs", "use crate::wing; fn f() { wing::Outer::new(); }"),
        ];
        assert_eq!(circles_of(&files), ["a.rs, wing/inner.rs, wing/outer.rs"]);
    }

    #[test]
    fn names_bound_to_modules_and_children_of_a_file_are_followed() {
        let files = [
            ("lib.rs", "mod a; mod b;"),
            ("a.rs", "mod child; fn f() { child::g(); }"),
            ("a/child.rs", "use super::super::b as other; fn f() { other::g(); }"),
            ("b.rs", "mod inside { fn f() { super::super::a::h(); } }"),
        ];
        assert_eq!(circles_of(&files), ["a.rs, a/child.rs, b.rs"]);
    }

    #[test]
    fn test_code_and_names_of_a_table_of_contents_make_no_circle() {
        let files = [
            ("lib.rs", "mod a; mod b; #[cfg(test)] mod checks; fn own() {}"),
            ("a.rs", "use crate::b::B; #[cfg(test)] mod tests { use crate::checks::c; }"),
            ("b.rs", "fn f() { crate::own(); } #[cfg(test)] mod tests { use crate::a::A; }"),
            ("checks.rs", "use crate::a::A; use crate::b::B;"),
            ("main.rs", "fn main() { crate::a::A; }"),
        ];
        assert!(circles_of(&files).is_empty());
    }
}
