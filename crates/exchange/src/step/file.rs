//! The index of a STEP file with its points: what the other readers ask.

use super::parse::{Cursor, Index, Instance};
use crate::error::ReadError;
use geom_core::DVec3;
use std::collections::BTreeMap;

/// All well-formed points, read once however often they are used.
pub(super) fn points(index: &Index<'_>) -> Points {
    let mut points = Vec::new();
    for instance in index.by_id() {
        let record = index.at(*instance).record("CARTESIAN_POINT");
        if let Some(point) = record.and_then(|mut cursor| cursor.try_point()) {
            points.push((instance.id, DVec3::from_array(point)));
        }
    }
    Points(points)
}

fn point(mut cursor: Cursor<'_>) -> Result<DVec3, ReadError> {
    cursor.skip_value()?;
    cursor.comma()?;
    let (mut xyz, mut count) = ([0.0; 3], 0);
    let here = cursor.clone();
    let wrong = |n: &str| here.error(format!("a point with {n} coordinates"), "give it three");
    cursor.list(|c| {
        let value = c.real()?;
        *xyz.get_mut(count).ok_or_else(|| wrong("more than 3"))? = value;
        count += 1;
        Ok(())
    })?;
    if count == 3 { Ok(DVec3::from_array(xyz)) } else { Err(wrong(&count.to_string())) }
}

/// Points sorted by id.
pub(super) struct Points(Vec<(u64, DVec3)>);

/// The index with the points already read.
pub(super) struct StepFile<'a> {
    pub(super) index: Index<'a>,
    pub(super) points: Points,
}

impl<'a> StepFile<'a> {
    /// The instance `#id` if it is defined.
    pub(super) fn instance(&self, id: u64) -> Option<Instance> {
        self.index.position(id).map(|k| self.index.by_id()[k])
    }

    /// The keyword of `#id`, `(` for a complex instance, empty for a missing one.
    pub(super) fn keyword(&self, id: u64) -> &'a [u8] {
        self.instance(id).map_or(b"", |instance| self.index.keyword(instance))
    }

    /// The record `keyword` of `#id`, wanted by `from`: behind its opening bracket.
    pub(super) fn record(
        &self,
        id: u64,
        keyword: &str,
        from: &Cursor<'a>,
    ) -> Result<Cursor<'a>, ReadError> {
        let target = self.index.open(id, from)?;
        target
            .record(keyword)
            .ok_or_else(|| from.error(format!("#{id} is no {keyword}"), "export the file again"))
    }

    /// The position of point `#id`, wanted by `from`.
    pub(super) fn point(&self, id: u64, from: &Cursor<'a>) -> Result<DVec3, ReadError> {
        if let Ok(k) = self.points.0.binary_search_by_key(&id, |(id, _)| *id) {
            return Ok(self.points.0[k].1);
        }
        let target = self.index.open(id, from)?;
        match target.record("CARTESIAN_POINT") {
            Some(cursor) => point(cursor),
            None => Err(from.error(format!("#{id} is not a point"), "name a CARTESIAN_POINT")),
        }
    }

    /// A point of the parameter plane, as `(u, v, 0)`.
    pub(super) fn flat_point(&self, id: u64, from: &Cursor<'a>) -> Result<DVec3, ReadError> {
        let mut cursor = self.record(id, "CARTESIAN_POINT", from)?;
        cursor.skip_arguments(1)?;
        let here = cursor.clone();
        match cursor.real_list()?[..] {
            [u, v] => Ok(DVec3::new(u, v, 0.0)),
            _ => Err(here.error("a point that is not in a plane", "give it two coordinates")),
        }
    }

    /// A direction as it is written, not yet of unit length.
    pub(super) fn direction(&self, id: u64, from: &Cursor<'a>) -> Result<DVec3, ReadError> {
        let mut cursor = self.record(id, "DIRECTION", from)?;
        cursor.skip_arguments(1)?;
        let here = cursor.clone();
        match cursor.real_list()?[..] {
            [x, y, z] => Ok(DVec3::new(x, y, z)),
            _ => Err(here.error("a direction that is not in space", "give it three numbers")),
        }
    }
}

/// Kinds of surfaces with their number, as one line.
pub(super) fn counted(kinds: &BTreeMap<String, usize>) -> String {
    let items: Vec<String> = kinds.iter().take(8).map(|(kind, n)| format!("{n} {kind}")).collect();
    items.join(", ")
}
