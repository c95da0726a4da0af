//! The index of a STEP file with its points: what the other readers ask.

use super::parse::{Cursor, Index, Instance};
use crate::error::ReadError;
use crate::unit::LengthUnit;
use crate::wrapped::{Direction, unwrap};
use bspline::{BsplineSurface, Degree, SplineError};
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

    /// A surface with its own name, or `None` if the instance is something else.
    pub(super) fn surface(
        &self,
        instance: Instance,
    ) -> Result<Option<(String, BsplineSurface)>, ReadError> {
        let body = self.index.at(instance);
        let simple = self.index.keyword(instance) != b"(";
        let kind = SurfaceKind::ALL.into_iter().find(|k| body.record(k.keyword()).is_some());
        let record = match (simple, kind) {
            (true, Some(kind)) => body.record(kind.keyword()),
            (false, _) => body.record("B_SPLINE_SURFACE"),
            (true, None) => None,
        };
        let Some(mut cursor) = record else { return Ok(None) };
        let mut name = String::new();
        if simple {
            name = cursor.string()?;
            cursor.comma()?;
        } else if let Some(mut item) = body.record("REPRESENTATION_ITEM") {
            name = item.string()?;
        }
        let degree_u = degree(&mut cursor)?;
        cursor.comma()?;
        let degree_v = degree(&mut cursor)?;
        cursor.comma()?;
        let net = cursor.clone();
        let (ids, n_v) = cursor.grid(Cursor::reference)?;
        let points: Result<Vec<DVec3>, _> = ids.iter().map(|id| self.point(*id, &net)).collect();
        let (points, n_u) = (points?, ids.len() / n_v);
        cursor.comma()?;
        cursor.skip_value()?;
        cursor.comma()?;
        let closed_u = cursor.is_true()?;
        cursor.comma()?;
        let closed_v = cursor.is_true()?;
        cursor.comma()?;
        cursor.skip_value()?;
        let (knots_u, knots_v) = match kind {
            Some(SurfaceKind::WithKnots) => {
                if simple {
                    cursor.comma()?;
                } else {
                    cursor = body.record("B_SPLINE_SURFACE_WITH_KNOTS").unwrap_or(cursor);
                }
                let multiplicities_u = multiplicities(&mut cursor, degree_u, n_u, "u")?;
                cursor.comma()?;
                let multiplicities_v = multiplicities(&mut cursor, degree_v, n_v, "v")?;
                cursor.comma()?;
                let knots_u = knots(&mut cursor, &multiplicities_u)?;
                cursor.comma()?;
                (knots_u, knots(&mut cursor, &multiplicities_v)?)
            }
            Some(kind) => {
                (kind.implied_knots(degree_u, n_u, &net)?, kind.implied_knots(degree_v, n_v, &net)?)
            }
            None => {
                let what = format!("#{} is a B-spline surface without knots", instance.id);
                return Err(body.error(what, "export it again with knots"));
            }
        };
        let weights = match body.record("RATIONAL_B_SPLINE_SURFACE").filter(|_| !simple) {
            None => None,
            Some(mut cursor) => {
                let here = cursor.clone();
                let (weights, columns) = cursor.grid(Cursor::real)?;
                if weights.len() != points.len() || columns != n_v {
                    let rows = weights.len() / columns;
                    let what =
                        format!("{rows} x {columns} weights for {n_u} x {n_v} control points");
                    return Err(here.error(what, "give one weight for each"));
                }
                Some(weights)
            }
        };
        let refused = |error: SplineError| {
            let message = error.to_string();
            let (what, mend) = message.split_once("; ").unwrap_or((&message, "export it again"));
            body.error(format!("#{}: {what}", instance.id), mend)
        };
        let u = Direction::new(degree_u, knots_u, closed_u, n_u).map_err(refused)?;
        let v = Direction::new(degree_v, knots_v, closed_v, n_v).map_err(refused)?;
        let surface = unwrap(&u, &v, &points, weights.as_deref()).map_err(refused)?;
        Ok(Some((name, surface)))
    }

    /// The unit of the first geometric context.
    pub(super) fn length_unit(&self, warnings: &mut Vec<String>) -> Result<LengthUnit, ReadError> {
        let mut found: Vec<LengthUnit> = Vec::new();
        for instance in self.index.in_file_order() {
            let body = self.index.at(instance);
            let Some(mut list) = body.record("GLOBAL_UNIT_ASSIGNED_CONTEXT") else { continue };
            let mut ids = Vec::new();
            list.list(|c| {
                ids.push(c.reference()?);
                Ok(())
            })?;
            // A context names a handful of units.
            for id in ids.into_iter().take(16) {
                let unit = self.index.open(id, &body)?;
                if unit.record("LENGTH_UNIT").is_some() {
                    let unit = self.unit(&unit)?;
                    if !found.contains(&unit) {
                        found.push(unit);
                    }
                }
            }
        }
        if found.len() > 1 {
            let names: Vec<String> = found.iter().take(4).map(ToString::to_string).collect();
            let (all, first) = (names.join(", "), &names[0]);
            warnings.push(format!("the file mixes units of length ({all}); {first} is assumed"));
        }
        Ok(found.into_iter().next().unwrap_or_default())
    }

    fn unit(&self, unit: &Cursor<'a>) -> Result<LengthUnit, ReadError> {
        if let Some(mut si) = unit.record("SI_UNIT") {
            let here = si.clone();
            let prefix = si.enumeration()?;
            let Some((_, power)) = SI_PREFIXES.iter().find(|(p, _)| p.as_bytes() == prefix) else {
                return Err(here.error("an unknown prefix of the metre", "use an SI prefix"));
            };
            return Ok(LengthUnit::from_metres("unit", 10_f64.powi(*power)));
        }
        let Some(mut conversion) = unit.record("CONVERSION_BASED_UNIT") else {
            return Err(unit.error("a unit of length without a size", "use an SI unit"));
        };
        let name = conversion.string()?;
        conversion.comma()?;
        let here = conversion.clone();
        let measure = self.index.open(conversion.reference()?, &here)?;
        let factor =
            measure.record("LENGTH_MEASURE_WITH_UNIT").or(measure.record("MEASURE_WITH_UNIT"));
        let Some(mut factor) = factor else {
            return Err(measure.error("expected a LENGTH_MEASURE_WITH_UNIT", "export it again"));
        };
        let Some(mut value) = factor.record("LENGTH_MEASURE") else {
            return Err(factor.error("expected a LENGTH_MEASURE", "export the file again"));
        };
        let value = value.real()?;
        factor.skip_value()?;
        factor.comma()?;
        let base = self.index.open(factor.reference()?, &here)?;
        // The base is an SI unit; a chain of conversions is not followed.
        let base =
            if base.record("SI_UNIT").is_some() { self.unit(&base)? } else { LengthUnit::Metre };
        if !(value > 0.0) {
            return Err(here.error("a unit of length that is not positive", "use an SI unit"));
        }
        Ok(LengthUnit::from_metres(&name, value * base.metres()))
    }
}

const SI_PREFIXES: [(&str, i32); 17] = [
    ("", 0),
    ("EXA", 18),
    ("PETA", 15),
    ("TERA", 12),
    ("GIGA", 9),
    ("MEGA", 6),
    ("KILO", 3),
    ("HECTO", 2),
    ("DECA", 1),
    ("DECI", -1),
    ("CENTI", -2),
    ("MILLI", -3),
    ("MICRO", -6),
    ("NANO", -9),
    ("PICO", -12),
    ("FEMTO", -15),
    ("ATTO", -18),
];

#[derive(Clone, Copy, PartialEq)]
enum SurfaceKind {
    WithKnots,
    Bezier,
    Uniform,
    QuasiUniform,
}

impl SurfaceKind {
    const ALL: [Self; 4] = [Self::WithKnots, Self::Bezier, Self::Uniform, Self::QuasiUniform];

    fn keyword(self) -> &'static str {
        match self {
            Self::WithKnots => "B_SPLINE_SURFACE_WITH_KNOTS",
            Self::Bezier => "BEZIER_SURFACE",
            Self::Uniform => "UNIFORM_SURFACE",
            Self::QuasiUniform => "QUASI_UNIFORM_SURFACE",
        }
    }

    /// The knots that the kind stands for (ISO 10303-42, `default_b_spline_knots`).
    fn implied_knots(
        self,
        degree: Degree,
        n: usize,
        net: &Cursor<'_>,
    ) -> Result<Vec<f64>, ReadError> {
        let d = degree.get();
        if n < degree.order() {
            let what = format!("degree {d} needs at least {} control points, found {n}", d + 1);
            return Err(net.error(what, "lower the degree"));
        }
        let (inner, ends, spans) = match self {
            Self::Bezier if !(n - 1).is_multiple_of(d) => {
                let what = format!("{n} control points do not make Bezier pieces of degree {d}");
                return Err(net.error(what, "give a multiple of the degree plus one"));
            }
            Self::Bezier => (d, d + 1, (n - 1) / d),
            Self::Uniform => {
                return Ok((0..n + d + 1).map(|i| i as f64 - d as f64).collect());
            }
            _ => (1, d + 1, n - d),
        };
        let times = |i: usize| if i == 0 || i == spans { ends } else { inner };
        Ok((0..=spans).flat_map(|i| std::iter::repeat_n(i as f64, times(i))).collect())
    }
}

fn degree(cursor: &mut Cursor<'_>) -> Result<Degree, ReadError> {
    cursor.skip_blanks();
    let here = cursor.clone();
    let value = cursor.integer()?;
    let degree = usize::try_from(value).ok().and_then(|d| Degree::new(d).ok());
    degree.ok_or_else(|| {
        let what = format!("degree {value} is not between 1 and {}", Degree::MAX);
        here.error(what, "lower it or split the surface")
    })
}

/// Multiplicities, which must fit the control points before any knot is repeated.
fn multiplicities(
    cursor: &mut Cursor<'_>,
    degree: Degree,
    n: usize,
    direction: &str,
) -> Result<Vec<u32>, ReadError> {
    cursor.skip_blanks();
    let here = cursor.clone();
    let (mut list, mut sum) = (Vec::new(), 0_i64);
    cursor.list(|c| {
        let here = c.clone();
        let value = c.integer()?;
        let Some(small) = u32::try_from(value).ok().filter(|m| *m > 0) else {
            let what = format!("multiplicity {value} of a knot");
            return Err(here.error(what, "multiplicities are small positive numbers"));
        };
        list.push(small);
        sum = sum.saturating_add(value);
        Ok(())
    })?;
    let needed = (n + degree.order()) as i64;
    if sum != needed {
        let what = format!(
            "the multiplicities in {direction} add up to {sum}, but {n} control points of \
             degree {degree} need {needed} knots"
        );
        return Err(here.error(what, "correct the multiplicities or the control points"));
    }
    Ok(list)
}

fn knots(cursor: &mut Cursor<'_>, multiplicities: &[u32]) -> Result<Vec<f64>, ReadError> {
    cursor.skip_blanks();
    let here = cursor.clone();
    let (mut knots, mut count) = (Vec::new(), 0);
    let wrong = |found: &str| {
        let what = format!("{found} knots for {} multiplicities", multiplicities.len());
        here.error(what, "give one multiplicity for each knot")
    };
    cursor.list(|c| {
        let value = c.real()?;
        let times = *multiplicities.get(count).ok_or_else(|| wrong("more"))?;
        knots.extend(std::iter::repeat_n(value, times as usize));
        count += 1;
        Ok(())
    })?;
    if count == multiplicities.len() { Ok(knots) } else { Err(wrong(&count.to_string())) }
}

/// Kinds of surfaces with their number, as one line.
pub(super) fn counted(kinds: &BTreeMap<String, usize>) -> String {
    let items: Vec<String> = kinds.iter().take(8).map(|(kind, n)| format!("{n} {kind}")).collect();
    items.join(", ")
}
