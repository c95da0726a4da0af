//! Representations and how they stand in one another: assemblies, mapped items, units.

use super::file::StepFile;
use super::parse::Cursor;
use super::units::Context;
use crate::error::ReadError;
use glam::DAffine3;
use std::collections::{BTreeMap, HashMap, HashSet};

/// A representation of a shape.
#[derive(Debug)]
pub(super) struct Representation {
    pub(super) items: Vec<u64>,
    pub(super) context: Context,
    /// The group of representations that share its coordinates, by the position of the first.
    group: usize,
}

/// A group of representations placed in another.
#[derive(Debug)]
struct Placed {
    child: usize,
    map: DAffine3,
}

/// All representations of a file.
#[derive(Debug, Default)]
pub(super) struct Tree {
    /// In the order of the file.
    all: Vec<Representation>,
    by_id: HashMap<u64, usize>,
    children: HashMap<usize, Vec<Placed>>,
    is_child: HashSet<usize>,
    /// Names of the products that groups are the shapes of, where there are several products.
    names: HashMap<usize, String>,
    /// Whether every unit is the same; if not, which there are.
    pub(super) units: Vec<String>,
}

/// A relationship between two representations.
struct Relation {
    ids: [u64; 2],
    operator: Option<u64>,
}

impl Tree {
    pub(super) fn of(file: &StepFile<'_>) -> Result<Self, ReadError> {
        let mut tree = Self::default();
        let mut contexts: HashMap<u64, Context> = HashMap::new();
        let mut relations: BTreeMap<u64, Relation> = BTreeMap::new();
        let mut usages: Vec<(u64, u64)> = Vec::new();
        let mut definitions: HashMap<u64, u64> = HashMap::new();
        for instance in file.index.in_file_order() {
            let body = file.index.at(instance);
            let keyword = file.index.keyword(instance);
            match keyword {
                b"SHAPE_REPRESENTATION_RELATIONSHIP" => {
                    if let Some(ids) = related(body.record("SHAPE_REPRESENTATION_RELATIONSHIP"))? {
                        relations.insert(instance.id, Relation { ids, operator: None });
                    }
                }
                b"CONTEXT_DEPENDENT_SHAPE_REPRESENTATION" => {
                    let record = body.record("CONTEXT_DEPENDENT_SHAPE_REPRESENTATION");
                    if let Some(mut cursor) = record {
                        let relation = cursor.reference()?;
                        cursor.comma()?;
                        usages.push((relation, cursor.reference()?));
                    }
                }
                b"SHAPE_DEFINITION_REPRESENTATION" => {
                    if let Some(mut cursor) = body.record("SHAPE_DEFINITION_REPRESENTATION") {
                        let definition = cursor.reference()?;
                        cursor.comma()?;
                        if let Some(product) = product_of(file, definition, &body)? {
                            definitions.insert(product, cursor.reference()?);
                        }
                    }
                }
                b"(" => {
                    let transformed =
                        body.record("REPRESENTATION_RELATIONSHIP_WITH_TRANSFORMATION");
                    if let Some(mut cursor) = transformed {
                        if let Some(ids) = related(body.record("REPRESENTATION_RELATIONSHIP"))? {
                            let operator = Some(cursor.reference()?);
                            relations.insert(instance.id, Relation { ids, operator });
                        }
                    } else if body.record("SHAPE_REPRESENTATION").is_some()
                        && let Some(cursor) = body.record("REPRESENTATION")
                    {
                        tree.add(file, instance.id, cursor, &mut contexts)?;
                    }
                }
                _ if keyword.ends_with(b"SHAPE_REPRESENTATION")
                    && !keyword.starts_with(b"CONTEXT") =>
                {
                    if let Some(cursor) = body.record(&String::from_utf8_lossy(keyword)) {
                        tree.add(file, instance.id, cursor, &mut contexts)?;
                    }
                }
                _ => {}
            }
        }
        tree.relate(file, &relations, &usages, &definitions)?;
        for representation in &tree.all {
            let name = representation.context.length.to_string();
            if !representation.items.is_empty() && !tree.units.contains(&name) {
                tree.units.push(name);
            }
        }
        Ok(tree)
    }

    fn add(
        &mut self,
        file: &StepFile<'_>,
        id: u64,
        mut cursor: Cursor<'_>,
        contexts: &mut HashMap<u64, Context>,
    ) -> Result<(), ReadError> {
        cursor.skip_arguments(1)?;
        let items = cursor.reference_list()?;
        cursor.comma()?;
        let context = match cursor.optional_reference()? {
            None => Context::default(),
            Some(id) => match contexts.get(&id) {
                Some(context) => context.clone(),
                None => {
                    let context = file.context(id)?.unwrap_or_default();
                    contexts.insert(id, context.clone());
                    context
                }
            },
        };
        let group = self.all.len();
        self.by_id.insert(id, group);
        self.all.push(Representation { items, context, group });
        Ok(())
    }

    /// Joins what shares coordinates, then hangs children under their parents.
    fn relate(
        &mut self,
        file: &StepFile<'_>,
        relations: &BTreeMap<u64, Relation>,
        usages: &[(u64, u64)],
        definitions: &HashMap<u64, u64>,
    ) -> Result<(), ReadError> {
        for relation in relations.values().filter(|r| r.operator.is_none()) {
            let [Some(a), Some(b)] = relation.ids.map(|id| self.by_id.get(&id).copied()) else {
                continue;
            };
            let (a, b) = (self.root(a), self.root(b));
            self.all[a.max(b)].group = a.min(b);
        }
        for k in 0..self.all.len() {
            self.all[k].group = self.root(k);
        }
        let named = definitions.iter().filter_map(|(definition, shape)| {
            let group = self.all[*self.by_id.get(shape)?].group;
            Some((group, product_name(file, *definition)?))
        });
        let names: HashMap<usize, String> = named.collect();
        if names.len() > 1 {
            self.names = names;
        }
        let parts: HashMap<u64, u64> = usages.iter().copied().collect();
        for (id, relation) in relations {
            let Some(operator) = relation.operator else { continue };
            let Some(instance) = file.instance(*id) else { continue };
            let body = file.index.at(instance);
            let [Some(first), Some(second)] = relation.ids.map(|id| self.by_id.get(&id).copied())
            else {
                continue;
            };
            // The first is the child, unless the assembly says that the second is.
            let child_of = match parts.get(id) {
                Some(shape) => assembled(file, *shape, &body)?
                    .and_then(|product| definitions.get(&product))
                    .and_then(|id| self.by_id.get(id))
                    .map(|k| self.all[*k].group),
                None => None,
            };
            let swapped =
                child_of == Some(self.all[second].group) && child_of != Some(self.all[first].group);
            let (child, parent) = if swapped { (second, first) } else { (first, second) };
            let map = self.operator(file, operator, &body, [child, parent], swapped)?;
            let (child, parent) = (self.all[child].group, self.all[parent].group);
            self.is_child.insert(child);
            self.children.entry(parent).or_default().push(Placed { child, map });
        }
        Ok(())
    }

    fn root(&self, mut k: usize) -> usize {
        while self.all[k].group != k {
            k = self.all[k].group;
        }
        k
    }

    /// From the coordinates of the child to those of the parent, their units included.
    fn operator(
        &self,
        file: &StepFile<'_>,
        id: u64,
        from: &Cursor<'_>,
        [child, parent]: [usize; 2],
        swapped: bool,
    ) -> Result<DAffine3, ReadError> {
        let scale = self.scale(child, parent);
        let target = file.index.open(id, from)?;
        if let Some(mut cursor) = target.record("ITEM_DEFINED_TRANSFORMATION") {
            cursor.skip_arguments(2)?;
            let here = cursor.clone();
            let first = file.placement(cursor.reference()?, &here)?;
            cursor.comma()?;
            let second = file.placement(cursor.reference()?, &here)?;
            let (inner, outer) = if swapped { (second, first) } else { (first, second) };
            return Ok(composed(outer, scale, inner));
        }
        let map = file.placement(id, from)?;
        Ok(composed(map, scale, DAffine3::IDENTITY))
    }

    /// How many units of the second representation one unit of the first is.
    fn scale(&self, from: usize, to: usize) -> f64 {
        let [a, b] = [from, to].map(|k| &self.all[k].context.length);
        if a == b { 1.0 } else { a.metres() / b.metres() }
    }

    /// Representations in the order of the file.
    pub(super) fn representations(&self) -> &[Representation] {
        &self.all
    }

    /// The representation that a mapped item shows, and how it stands there.
    pub(super) fn mapped(
        &self,
        file: &StepFile<'_>,
        id: u64,
        in_representation: usize,
        from: &Cursor<'_>,
    ) -> Result<Option<(usize, DAffine3)>, ReadError> {
        let mut cursor = file.record(id, "MAPPED_ITEM", from)?;
        cursor.skip_arguments(1)?;
        let here = cursor.clone();
        let source = cursor.reference()?;
        cursor.comma()?;
        let target = cursor.reference()?;
        let mut cursor = file.record(source, "REPRESENTATION_MAP", &here)?;
        let here = cursor.clone();
        let origin = cursor.reference()?;
        cursor.comma()?;
        let shown = cursor.reference()?;
        let Some(&shown) = self.by_id.get(&shown) else { return Ok(None) };
        let (inner, outer) = (file.placement(origin, &here)?, file.placement(target, &here)?);
        let map = composed(outer, self.scale(shown, in_representation), inner);
        Ok(Some((self.all[shown].group, map)))
    }

    /// The name of the product that a group is the shape of, in a file of several.
    pub(super) fn name(&self, group: usize) -> Option<&str> {
        self.names.get(&group).map(String::as_str)
    }

    /// Marks the group of a representation as part of another.
    pub(super) fn mark_mapped(&mut self, group: usize) {
        self.is_child.insert(group);
    }

    /// The first representations of groups that stand in no other.
    pub(super) fn roots(&self) -> Vec<usize> {
        let own = |k: &usize| self.all[*k].group == *k && !self.is_child.contains(k);
        (0..self.all.len()).filter(own).collect()
    }

    /// Positions of the representations of a group.
    pub(super) fn members(&self, group: usize) -> impl Iterator<Item = usize> + '_ {
        (group..self.all.len()).filter(move |k| self.all[*k].group == group)
    }

    /// Groups placed in a group, with their maps.
    pub(super) fn placed(&self, group: usize) -> impl Iterator<Item = (usize, DAffine3)> + '_ {
        self.children.get(&group).into_iter().flatten().map(|p| (p.child, p.map))
    }

    /// From the unit of a representation to that of the model.
    pub(super) fn to_unit(&self, k: usize, metres: f64) -> DAffine3 {
        let length = &self.all[k].context.length;
        let scale = length.metres() / metres;
        if scale == 1.0 {
            DAffine3::IDENTITY
        } else {
            DAffine3::from_scale(geom_core::DVec3::splat(scale))
        }
    }
}

/// `outer · scale · inner⁻¹`, to the last bit the identity where the two are the same.
fn composed(outer: DAffine3, scale: f64, inner: DAffine3) -> DAffine3 {
    let scaled = if scale == 1.0 {
        outer
    } else {
        outer * DAffine3::from_scale(geom_core::DVec3::splat(scale))
    };
    if inner == DAffine3::IDENTITY {
        scaled
    } else if inner == scaled {
        DAffine3::IDENTITY
    } else {
        scaled * inner.inverse()
    }
}

/// The two representations of a relationship, behind a name and a description.
fn related(record: Option<Cursor<'_>>) -> Result<Option<[u64; 2]>, ReadError> {
    let Some(mut cursor) = record else { return Ok(None) };
    cursor.skip_arguments(2)?;
    let first = cursor.reference()?;
    cursor.comma()?;
    Ok(Some([first, cursor.reference()?]))
}

/// The product definition or usage that a `PRODUCT_DEFINITION_SHAPE` is the shape of.
fn product_of(file: &StepFile<'_>, id: u64, from: &Cursor<'_>) -> Result<Option<u64>, ReadError> {
    if file.keyword(id) != b"PRODUCT_DEFINITION_SHAPE" {
        return Ok(None);
    }
    let mut cursor = file.record(id, "PRODUCT_DEFINITION_SHAPE", from)?;
    cursor.skip_arguments(2)?;
    cursor.optional_reference()
}

/// The name of a product by its definition; nothing depends on it, so that faults do not matter.
fn product_name(file: &StepFile<'_>, definition: u64) -> Option<String> {
    if !file.keyword(definition).starts_with(b"PRODUCT_DEFINITION") {
        return None;
    }
    let record = |id: u64| {
        let body = file.index.at(file.instance(id)?);
        body.record(&String::from_utf8_lossy(file.keyword(id)))
    };
    let mut id = definition;
    // From the definition to its formation, and on to the product.
    for _ in 0..2 {
        let mut cursor = record(id)?;
        cursor.skip_arguments(2).ok()?;
        id = cursor.reference().ok()?;
    }
    let mut cursor = record(id).filter(|_| file.keyword(id) == b"PRODUCT")?;
    let number = cursor.string().ok()?;
    cursor.comma().ok()?;
    let name = cursor.string().ok()?;
    [name, number].into_iter().find(|text| !text.is_empty())
}

/// The product definition that a usage puts into another, by the shape of the usage.
fn assembled(file: &StepFile<'_>, shape: u64, from: &Cursor<'_>) -> Result<Option<u64>, ReadError> {
    let Some(usage) = product_of(file, shape, from)? else { return Ok(None) };
    if file.keyword(usage) != b"NEXT_ASSEMBLY_USAGE_OCCURRENCE" {
        return Ok(None);
    }
    let mut cursor = file.record(usage, "NEXT_ASSEMBLY_USAGE_OCCURRENCE", from)?;
    cursor.skip_arguments(4)?;
    cursor.optional_reference()
}
