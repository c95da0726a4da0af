//! B-spline curves and surfaces, simple and complex, with knots or implied ones.

use super::file::StepFile;
use super::parse::{Cursor, Instance};
use crate::error::ReadError;
use crate::wrapped::{Direction, unwrap};
use bspline::{BsplineCurve, BsplineSurface, Degree, KnotVector, SplineError};
use geom_core::DVec3;

impl StepFile<'_> {
    /// A B-spline surface with its own name, or `None` if the instance is something else.
    pub(super) fn spline_surface(
        &self,
        instance: Instance,
    ) -> Result<Option<(String, BsplineSurface)>, ReadError> {
        let body = self.index.at(instance);
        let simple = self.index.keyword(instance) != b"(";
        let kind = Kind::ALL.into_iter().find(|k| body.record(k.surface()).is_some());
        let record = match (simple, kind) {
            (true, Some(kind)) => body.record(kind.surface()),
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
            Some(Kind::WithKnots) => {
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
        let refused = |error: SplineError| refused(&error, &body, instance.id);
        let u = Direction::new(degree_u, knots_u, closed_u, n_u).map_err(refused)?;
        let v = Direction::new(degree_v, knots_v, closed_v, n_v).map_err(refused)?;
        let surface = unwrap(&u, &v, &points, weights.as_deref()).map_err(refused)?;
        Ok(Some((name, surface)))
    }

    /// A B-spline curve with control points of `dimension` coordinates, or `None` if the instance
    /// is something else.
    pub(super) fn spline_curve(
        &self,
        instance: Instance,
        dimension: usize,
    ) -> Result<Option<BsplineCurve>, ReadError> {
        let body = self.index.at(instance);
        let simple = self.index.keyword(instance) != b"(";
        let kind = Kind::ALL.into_iter().find(|k| body.record(k.curve()).is_some());
        let record = match (simple, kind) {
            (true, Some(kind)) => body.record(kind.curve()),
            (false, _) => body.record("B_SPLINE_CURVE"),
            (true, None) => None,
        };
        let Some(mut cursor) = record else { return Ok(None) };
        if simple {
            cursor.skip_arguments(1)?;
        }
        let degree = degree(&mut cursor)?;
        cursor.comma()?;
        let net = cursor.clone();
        let ids = cursor.reference_list()?;
        let point = |id: &u64| match dimension {
            2 => self.flat_point(*id, &net),
            _ => self.point(*id, &net),
        };
        let points: Vec<DVec3> = ids.iter().map(point).collect::<Result<_, _>>()?;
        cursor.comma()?;
        cursor.skip_arguments(2)?;
        cursor.skip_value()?;
        let knots = match kind {
            Some(Kind::WithKnots) => {
                if simple {
                    cursor.comma()?;
                } else {
                    cursor = body.record("B_SPLINE_CURVE_WITH_KNOTS").unwrap_or(cursor);
                }
                let multiplicities = multiplicities(&mut cursor, degree, points.len(), "t")?;
                cursor.comma()?;
                knots(&mut cursor, &multiplicities)?
            }
            Some(kind) => kind.implied_knots(degree, points.len(), &net)?,
            None => {
                let what = format!("#{} is a B-spline curve without knots", instance.id);
                return Err(body.error(what, "export it again with knots"));
            }
        };
        let weights = match body.record("RATIONAL_B_SPLINE_CURVE").filter(|_| !simple) {
            None => None,
            Some(mut cursor) => Some(cursor.real_list()?),
        };
        let made = KnotVector::new(degree, knots)
            .map_err(SplineError::from)
            .and_then(|knots| BsplineCurve::new(knots, points, weights));
        made.map(Some).map_err(|error| refused(&error, &body, instance.id))
    }
}

/// A fault of an instance in the words of the library, which end with how to mend it.
fn refused(error: &SplineError, body: &Cursor<'_>, id: u64) -> ReadError {
    let message = error.to_string();
    let (what, mend) = message.split_once("; ").unwrap_or((&message, "export it again"));
    body.error(format!("#{id}: {what}"), mend)
}

#[derive(Clone, Copy, PartialEq)]
enum Kind {
    WithKnots,
    Bezier,
    Uniform,
    QuasiUniform,
}

impl Kind {
    const ALL: [Self; 4] = [Self::WithKnots, Self::Bezier, Self::Uniform, Self::QuasiUniform];

    fn surface(self) -> &'static str {
        match self {
            Self::WithKnots => "B_SPLINE_SURFACE_WITH_KNOTS",
            Self::Bezier => "BEZIER_SURFACE",
            Self::Uniform => "UNIFORM_SURFACE",
            Self::QuasiUniform => "QUASI_UNIFORM_SURFACE",
        }
    }

    fn curve(self) -> &'static str {
        match self {
            Self::WithKnots => "B_SPLINE_CURVE_WITH_KNOTS",
            Self::Bezier => "BEZIER_CURVE",
            Self::Uniform => "UNIFORM_CURVE",
            Self::QuasiUniform => "QUASI_UNIFORM_CURVE",
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
