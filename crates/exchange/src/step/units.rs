//! Units of length and angle of a geometric context, and how exact it says it is.

use super::file::StepFile;
use super::parse::Cursor;
use crate::error::ReadError;
use crate::unit::LengthUnit;

/// A context names no more than this many units.
const MOST_UNITS: usize = 16;

/// What the numbers of a representation mean.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Context {
    pub(super) length: LengthUnit,
    /// Radians of an angle of 1.
    pub(super) angle: f64,
    /// Distances below this do not count, in the unit of length.
    pub(super) uncertainty: Option<f64>,
}

impl Default for Context {
    fn default() -> Self {
        Self { length: LengthUnit::default(), angle: 1.0, uncertainty: None }
    }
}

impl<'a> StepFile<'a> {
    /// The context `#id`; `None` if it says nothing about units.
    pub(super) fn context(&self, id: u64) -> Result<Option<Context>, ReadError> {
        let Some(instance) = self.instance(id) else { return Ok(None) };
        let body = self.index.at(instance);
        let Some(mut list) = body.record("GLOBAL_UNIT_ASSIGNED_CONTEXT") else { return Ok(None) };
        let mut context = Context::default();
        for id in list.reference_list()?.into_iter().take(MOST_UNITS) {
            let unit = self.index.open(id, &body)?;
            if unit.record("LENGTH_UNIT").is_some() {
                context.length = self.unit(&unit)?;
            } else if unit.record("PLANE_ANGLE_UNIT").is_some() {
                context.angle = self.angle_unit(&unit)?;
            }
        }
        if let Some(mut list) = body.record("GLOBAL_UNCERTAINTY_ASSIGNED_CONTEXT") {
            for id in list.reference_list()?.into_iter().take(MOST_UNITS) {
                let measure = self.index.open(id, &body)?;
                if let Some(mut value) = measure.record("UNCERTAINTY_MEASURE_WITH_UNIT") {
                    context.uncertainty = Some(value.measure()?).filter(|x| *x > 0.0);
                }
            }
        }
        Ok(Some(context))
    }

    /// Radians of a unit of angle.
    fn angle_unit(&self, unit: &Cursor<'a>) -> Result<f64, ReadError> {
        let Some(mut conversion) = unit.record("CONVERSION_BASED_UNIT") else { return Ok(1.0) };
        conversion.skip_arguments(1)?;
        let here = conversion.clone();
        let measure = self.index.open(conversion.reference()?, &here)?;
        let factor =
            measure.record("PLANE_ANGLE_MEASURE_WITH_UNIT").or(measure.record("MEASURE_WITH_UNIT"));
        let Some(mut factor) = factor else {
            return Err(
                measure.error("expected a PLANE_ANGLE_MEASURE_WITH_UNIT", "export it again")
            );
        };
        let value = factor.measure()?;
        if value > 0.0 {
            Ok(value)
        } else {
            Err(here.error("a unit of angle that is not positive", "use the radian"))
        }
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
        let value = factor.measure()?;
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
