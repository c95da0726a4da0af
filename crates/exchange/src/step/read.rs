//! Reading: every face, and every surface that stands alone, in the place where it stands.

use super::face::{Face, Shared};
use super::file::{StepFile, counted, points};
use super::parse::{Cursor, Index};
use super::surface::{Lost, is_read};
use super::tree::Tree;
use super::units::Context;
use crate::error::ReadError;
use crate::model::{Model, NamedSurface};
use crate::ron_text::MAX_DEPTH;
use geom_core::DMat3;
use glam::DAffine3;
use std::collections::{BTreeMap, HashMap, HashSet};
use std::rc::Rc;

/// Bytes of a control point with its weight.
const POINT_BYTES: usize = 32;
/// What the surfaces may need together, beside this share of the size of the file.
const LEAST_MEMORY: usize = 32 << 20;
/// See [`LEAST_MEMORY`].
const MEMORY_RATIO: usize = 12;
/// Control points that the visit of a placed part counts as.
const VISIT: usize = 16;
/// Reasons for lost faces that are told in full.
const MOST_REASONS: usize = 4;

/// Reads the faces and surfaces of a STEP file (application protocols 203, 214 and 242) as
/// B-spline surfaces, trimmed where a face covers a part of its surface, with names and colours.
/// Planes, cylinders, cones, spheres, tori, extrusions and surfaces of revolution become exact
/// rational surfaces; surfaces at a distance are fitted. Parts of assemblies stand where the
/// assembly places them, and all lengths are in one unit. Faces that cannot be followed are left
/// out with a warning.
///
/// # Errors
/// [`ReadError`] with the line of the first fault, or if there is no surface.
pub fn read_step(text: &[u8]) -> Result<Model, ReadError> {
    let index = Index::new(text)?;
    let mut model = Model::default();
    check_references(&index, &mut model.warnings)?;
    let file = StepFile { points: points(&index), index };
    let tree = Tree::of(&file)?;
    let mut reader = Reader {
        colors: file.colors()?,
        used: used_surfaces(&file),
        file: &file,
        tree,
        shared: HashMap::new(),
        groups: HashMap::new(),
        seen: HashSet::new(),
        budget: (LEAST_MEMORY + MEMORY_RATIO * text.len()) / POINT_BYTES,
        tally: Tally::default(),
    };
    reader.find_mapped()?;
    let unit = reader.unit()?;
    model.unit = unit.length.clone();
    let mut out = Vec::new();
    for root in reader.tree.roots() {
        let map = reader.tree.to_unit(root, model.unit.metres());
        reader.emit(root, map, &mut Vec::new(), &mut out)?;
    }
    reader.emit_rest(&unit, &mut out)?;
    model.surfaces = out;
    if reader.tree.units.len() > 1 {
        let all = reader.tree.units.join(", ");
        let told =
            format!("the file mixes units of length ({all}); all is given in {}", model.unit);
        model.warnings.push(told);
    }
    reader.tally.report(&mut model.warnings);
    if model.surfaces.is_empty() {
        let what = reader.tally.nothing();
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

/// Surfaces that only serve a face, a curve or another surface.
fn used_surfaces(file: &StepFile<'_>) -> HashSet<u64> {
    let mut used = HashSet::new();
    for instance in file.index.by_id() {
        let keyword = file.index.keyword(*instance);
        let serves = matches!(
            keyword,
            b"ADVANCED_FACE"
                | b"FACE_SURFACE"
                | b"OFFSET_SURFACE"
                | b"RECTANGULAR_TRIMMED_SURFACE"
                | b"RECTANGULAR_COMPOSITE_SURFACE"
                | b"CURVE_BOUNDED_SURFACE"
                | b"SURFACE_PATCH"
                | b"SURFACE_REPLICA"
                | b"PCURVE"
                | b"BOUNDED_PCURVE"
                | b"SURFACE_CURVE"
                | b"SEAM_CURVE"
                | b"INTERSECTION_CURVE"
        );
        if serves {
            file.index.at(*instance).references(|id| {
                used.insert(id);
            });
        }
    }
    used
}

/// What was found and not taken.
#[derive(Default)]
struct Tally {
    kinds: BTreeMap<String, usize>,
    shared: usize,
    lost: BTreeMap<String, usize>,
    fitted: usize,
}

impl Tally {
    fn lose(&mut self, reason: String) {
        *self.lost.entry(reason).or_default() += 1;
    }

    fn report(&self, warnings: &mut Vec<String>) {
        if self.shared > 0 {
            warnings.push(format!(
                "{} faces share the surface of another face; each surface is taken once",
                self.shared
            ));
        }
        if self.fitted > 0 {
            warnings.push(format!(
                "{} surfaces at a distance are fitted to within {:e} of their size",
                self.fitted,
                super::surface::OFFSET_ACCURACY
            ));
        }
        if !self.kinds.is_empty() {
            let kinds = counted(&self.kinds);
            warnings.push(format!("faces on other kinds of surfaces are left out: {kinds}"));
        }
        let total: usize = self.lost.values().sum();
        for (reason, count) in self.lost.iter().take(MOST_REASONS) {
            warnings.push(format!("{count} of {total} lost faces are left out: {reason}"));
        }
    }

    fn nothing(&self) -> String {
        if let Some(reason) = self.lost.keys().next() {
            return format!("no face of the file can be followed ({reason})");
        }
        if self.kinds.is_empty() {
            return "the file has no surface".to_owned();
        }
        format!("the file has no surface that is read, only {}", counted(&self.kinds))
    }
}

/// A face with what colours and names it from above.
#[derive(Clone)]
struct Owned {
    face: Face,
    color: Option<[f32; 3]>,
}

struct Reader<'f, 'a> {
    file: &'f StepFile<'a>,
    tree: Tree,
    colors: HashMap<u64, [f32; 3]>,
    used: HashSet<u64>,
    /// Curves and surfaces by the unit of angle and uncertainty of the context.
    shared: HashMap<[u64; 2], Shared>,
    /// Faces of each representation.
    groups: HashMap<usize, Rc<Vec<Owned>>>,
    /// Faces, shells and surfaces that were reached.
    seen: HashSet<u64>,
    /// Control points that may still be written.
    budget: usize,
    tally: Tally,
}

/// What a body hands down to its faces.
#[derive(Clone, Default)]
struct Inherited {
    name: String,
    color: Option<[f32; 3]>,
}

impl<'a> Reader<'_, 'a> {
    /// Finds what is shown by mapped items, which is no root.
    fn find_mapped(&mut self) -> Result<(), ReadError> {
        let mut shown = Vec::new();
        for (k, representation) in self.tree.representations().iter().enumerate() {
            for id in &representation.items {
                if let (b"MAPPED_ITEM", Some(instance)) =
                    (self.file.keyword(*id), self.file.instance(*id))
                {
                    let body = self.file.index.at(instance);
                    if let Some((group, _)) = self.tree.mapped(self.file, *id, k, &body)? {
                        shown.push(group);
                    }
                }
            }
        }
        shown.into_iter().for_each(|group| self.tree.mark_mapped(group));
        Ok(())
    }

    /// The context that the model takes its unit from: of the first root with a face or surface,
    /// else the first of the file.
    fn unit(&self) -> Result<Context, ReadError> {
        let first = self.tree.roots().into_iter().find(|root| {
            self.tree.members(*root).any(|k| !self.tree.representations()[k].items.is_empty())
        });
        if let Some(first) = first {
            return Ok(self.tree.representations()[first].context.clone());
        }
        for instance in self.file.index.in_file_order() {
            if let Some(context) = self.file.context(instance.id)? {
                return Ok(context);
            }
        }
        Ok(Context::default())
    }

    /// Everything of a group and what is placed in it.
    fn emit(
        &mut self,
        group: usize,
        map: DAffine3,
        path: &mut Vec<usize>,
        out: &mut Vec<NamedSurface>,
    ) -> Result<(), ReadError> {
        if path.contains(&group) || path.len() > MAX_DEPTH {
            let what = "the assembly contains itself or is nested too deeply";
            return Err(ReadError::content(what, "export it again"));
        }
        // Parts that double at every level are too many even where they hold nothing.
        self.take(VISIT)?;
        path.push(group);
        for k in self.tree.members(group).collect::<Vec<_>>() {
            let name = self.tree.name(group).unwrap_or_default().to_owned();
            for owned in self.faces_of(k)?.iter() {
                self.push(owned, map, &name, out)?;
            }
            for id in self.tree.representations()[k].items.clone() {
                if self.file.keyword(id) != b"MAPPED_ITEM" {
                    continue;
                }
                let Some(instance) = self.file.instance(id) else { continue };
                let body = self.file.index.at(instance);
                if let Some((shown, inner)) = self.tree.mapped(self.file, id, k, &body)? {
                    self.emit(shown, map * inner, path, out)?;
                }
            }
        }
        for (child, inner) in self.tree.placed(group).collect::<Vec<_>>() {
            let inner = if map == DAffine3::IDENTITY { inner } else { map * inner };
            self.emit(child, inner, path, out)?;
        }
        path.pop();
        Ok(())
    }

    /// Takes so many control points off the budget.
    fn take(&mut self, needed: usize) -> Result<(), ReadError> {
        let Some(left) = self.budget.checked_sub(needed) else {
            let what = "the placed parts need more memory than a file of this size may take";
            return Err(ReadError::content(what, "open the parts one by one"));
        };
        self.budget = left;
        Ok(())
    }

    /// One face in its place, under the name of the part if it has none of its own.
    fn push(
        &mut self,
        owned: &Owned,
        map: DAffine3,
        part: &str,
        out: &mut Vec<NamedSurface>,
    ) -> Result<(), ReadError> {
        let Face { name, surface, trim } = &owned.face;
        let edges = trim.iter().flat_map(|t| t.loops()).flat_map(|l| l.curves());
        let in_edges: usize = edges.map(|c| 4 + 2 * c.parameters.control_points().len()).sum();
        let needed = surface.control_points().len() + in_edges;
        self.take(needed)?;
        let (mut surface, mut trim) = (surface.clone(), trim.clone());
        if map != DAffine3::IDENTITY {
            let place = |p| map.transform_point3(p);
            let far = |e: bspline::SplineError| {
                ReadError::content(format!("a placed face: {e}"), "move it")
            };
            surface = surface.mapped(place).map_err(far)?;
            trim = trim.map(|t| t.with_mapped_edges(place)).transpose().map_err(far)?;
            if DMat3::determinant(&map.matrix3) < 0.0 {
                (surface, trim) = (surface.swapped(), trim.map(|t| t.swapped()));
            }
        }
        let name = if name.is_empty() { part.to_owned() } else { name.clone() };
        out.push(NamedSurface { trim, color: owned.color, ..NamedSurface::new(name, surface) });
        Ok(())
    }

    /// The faces of a representation, in its own coordinates.
    fn faces_of(&mut self, k: usize) -> Result<Rc<Vec<Owned>>, ReadError> {
        if let Some(found) = self.groups.get(&k) {
            return Ok(found.clone());
        }
        let representation = &self.tree.representations()[k];
        let (items, context) = (representation.items.clone(), representation.context.clone());
        let mut found = Vec::new();
        let mut whole = HashSet::new();
        for id in items {
            self.item(id, &context, &Inherited::default(), 0, &mut whole, &mut found)?;
        }
        let found = Rc::new(found);
        self.groups.insert(k, found.clone());
        Ok(found)
    }

    /// What no representation holds.
    fn emit_rest(
        &mut self,
        context: &Context,
        out: &mut Vec<NamedSurface>,
    ) -> Result<(), ReadError> {
        let mut found = Vec::new();
        let mut whole = HashSet::new();
        for instance in self.file.index.in_file_order() {
            let keyword = self.file.index.keyword(instance);
            let is_face = matches!(keyword, b"ADVANCED_FACE" | b"FACE_SURFACE");
            // A bare elementary surface has no end; listed ones are told about with their kind.
            let is_surface = keyword == b"("
                || keyword.ends_with(b"_SURFACE")
                || keyword.starts_with(b"B_SPLINE_SURFACE")
                || keyword == b"SURFACE_OF_LINEAR_EXTRUSION"
                || keyword == b"SURFACE_OF_REVOLUTION";
            if (is_face || is_surface) && !self.seen.contains(&instance.id) {
                let inherited = Inherited::default();
                self.item(instance.id, context, &inherited, 0, &mut whole, &mut found)?;
            }
        }
        found.iter().try_for_each(|owned| self.push(owned, DAffine3::IDENTITY, "", out))
    }

    /// An item of a representation and all below it.
    fn item(
        &mut self,
        id: u64,
        context: &Context,
        inherited: &Inherited,
        depth: usize,
        whole: &mut HashSet<(u64, bool)>,
        out: &mut Vec<Owned>,
    ) -> Result<(), ReadError> {
        let Some(instance) = self.file.instance(id) else { return Ok(()) };
        if depth > MAX_DEPTH {
            let at = self.file.index.at(instance);
            return Err(at.error("bodies are nested too deeply", "export the file again"));
        }
        let body = self.file.index.at(instance);
        let keyword = self.file.index.keyword(instance);
        let color = self.colors.get(&id).copied().or(inherited.color);
        // What these bodies, shells and sets name is what they consist of.
        let is_body =
            matches!(keyword, b"MANIFOLD_SOLID_BREP" | b"FACETED_BREP" | b"BREP_WITH_VOIDS");
        let is_set = matches!(
            keyword,
            b"SHELL_BASED_SURFACE_MODEL"
                | b"FACE_BASED_SURFACE_MODEL"
                | b"OPEN_SHELL"
                | b"CLOSED_SHELL"
                | b"CONNECTED_FACE_SET"
                | b"GEOMETRIC_SET"
                | b"GEOMETRIC_CURVE_SET"
                | b"ORIENTED_CLOSED_SHELL"
                | b"ORIENTED_OPEN_SHELL"
                | b"ORIENTED_FACE"
        );
        if !is_body && !is_set {
            return self.leaf(id, body, context, inherited, color, whole, out);
        }
        self.seen.insert(id);
        let mut name = inherited.name.clone();
        if is_body && let Some(mut cursor) = body.record(&String::from_utf8_lossy(keyword)) {
            name = Some(cursor.string()?).filter(|n| !n.is_empty()).unwrap_or(name);
        }
        let below = Inherited { name, color };
        let mut children: Vec<u64> = Vec::new();
        body.references(|id| children.push(id));
        for child in children {
            self.item(child, context, &below, depth + 1, whole, out)?;
        }
        Ok(())
    }

    /// A face, or a surface that stands alone.
    fn leaf(
        &mut self,
        id: u64,
        body: Cursor<'a>,
        context: &Context,
        inherited: &Inherited,
        color: Option<[f32; 3]>,
        whole: &mut HashSet<(u64, bool)>,
        out: &mut Vec<Owned>,
    ) -> Result<(), ReadError> {
        let Some(instance) = self.file.instance(id) else { return Ok(()) };
        let key = [context.angle, context.uncertainty.unwrap_or(0.0)].map(f64::to_bits);
        let mut shared = self.shared.remove(&key).unwrap_or_default();
        let result = match self.file.face_text(instance)? {
            Some(text) => {
                self.seen.insert(id);
                let again = text.is_boundless() && whole.contains(&(text.surface, text.forward));
                if again {
                    self.tally.shared += 1;
                    self.shared.insert(key, shared);
                    return Ok(());
                }
                let from = self.file.index.at(instance);
                match self.file.shared_shape(text.surface, &from, context, &mut shared)? {
                    None => {
                        self.count_kind(text.surface);
                        Ok(None)
                    }
                    Some(shape) => {
                        let face = self.file.face(&text, &shape.1, &from, context, &mut shared);
                        face.map(|mut face| {
                            let names = [&face.name, &shape.0, &inherited.name];
                            let name = names.into_iter().find(|n| !n.is_empty());
                            face.name = name.cloned().unwrap_or_default();
                            let color = color.or(self.colors.get(&text.surface).copied());
                            if face.trim.is_none() && !whole.insert((text.surface, text.forward)) {
                                let is_cut = !matches!(
                                    shape.1,
                                    super::surface::Shape::Carrier(bspline::Carrier::Spline(_))
                                );
                                if !is_cut {
                                    self.tally.shared += 1;
                                    return None;
                                }
                            }
                            self.tally.fitted += usize::from(shape.1.is_fitted());
                            Some(Owned { face, color })
                        })
                    }
                }
            }
            None => self.lone_surface(id, &body, context, inherited, color, &mut shared),
        };
        self.shared.insert(key, shared);
        match result {
            Ok(Some(owned)) => out.push(owned),
            Ok(None) => {}
            Err(Lost::Read(error)) => return Err(error),
            Err(Lost::Cannot(reason)) => self.tally.lose(reason),
        }
        Ok(())
    }

    fn lone_surface(
        &mut self,
        id: u64,
        body: &Cursor<'a>,
        context: &Context,
        inherited: &Inherited,
        color: Option<[f32; 3]>,
        shared: &mut Shared,
    ) -> Result<Option<Owned>, Lost> {
        if self.used.contains(&id) || !self.seen.insert(id) {
            return Ok(None);
        }
        let Some(shape) = self.file.shared_shape(id, body, context, shared)? else {
            let keyword = self.file.keyword(id);
            if keyword.ends_with(b"_SURFACE") && !is_read(keyword) {
                self.count_kind(id);
            }
            return Ok(None);
        };
        let face = match shape.1.realise(&[])? {
            bspline::Carrier::Spline(surface) => Face { name: String::new(), surface, trim: None },
            carrier => match carrier.face(&[], 0.0) {
                Ok(face) => Face { name: String::new(), surface: face.surface, trim: None },
                Err(_) => {
                    self.count_kind(id);
                    return Ok(None);
                }
            },
        };
        self.tally.fitted += usize::from(shape.1.is_fitted());
        let names = [&shape.0, &inherited.name];
        let name = names.into_iter().find(|n| !n.is_empty()).cloned().unwrap_or_default();
        Ok(Some(Owned { face: Face { name, ..face }, color }))
    }

    fn count_kind(&mut self, surface: u64) {
        let keyword = String::from_utf8_lossy(self.file.keyword(surface)).into_owned();
        let known = keyword.len() <= 40 && keyword != "(";
        *self.tally.kinds.entry(if known { keyword } else { "other".into() }).or_default() += 1;
    }
}
