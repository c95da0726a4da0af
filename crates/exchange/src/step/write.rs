//! Writing: one open shell of named faces, each on the whole of its surface.

use super::border::{Border, Side};
use crate::model::Model;
use crate::unit::LengthUnit;
use crate::wrapped::wrapped;
use bspline::{BsplineSurface, KnotVector};
use geom_core::{BoundingBox, DVec3};
use std::fmt::Write;

/// Uncertainty of positions that the file states, as a share of the bounding box.
const UNCERTAINTY: f64 = 1e-7;

/// The surfaces of a model as a STEP file of application protocol 214: one `OPEN_SHELL` with an
/// `ADVANCED_FACE` for each. Knots, weights and control points are exact; a periodic surface is
/// written with unclamped knots and its first control points repeated at the end.
#[must_use]
pub fn write_step(model: &Model) -> String {
    let mut file = Writer::default();
    let context = file.header(model);
    let faces: Vec<usize> =
        model.surfaces.iter().map(|named| file.face(&named.name, &named.surface)).collect();
    let shell = file.add(&format!("OPEN_SHELL('',{})", refs(&faces)));
    let body = file.add(&format!("SHELL_BASED_SURFACE_MODEL('',(#{shell}))"));
    let shape = file
        .add(&format!("MANIFOLD_SURFACE_SHAPE_REPRESENTATION('',(#{body}),#{})", context.geometry));
    file.add(&format!("SHAPE_DEFINITION_REPRESENTATION(#{},#{shape})", context.product));
    file.text.push_str("ENDSEC;\nEND-ISO-10303-21;\n");
    file.text
}

#[derive(Default)]
struct Writer {
    text: String,
    last: usize,
}

struct Context {
    product: usize,
    geometry: usize,
}

impl Writer {
    fn add(&mut self, body: &str) -> usize {
        self.last += 1;
        // Writing into a `String` cannot fail.
        let _ = writeln!(self.text, "#{}={body};", self.last);
        self.last
    }

    fn header(&mut self, model: &Model) -> Context {
        let name = match model.surfaces.as_slice() {
            [only] if !only.name.is_empty() => only.name.as_str(),
            _ => "surfaces",
        };
        let name = string(name);
        // The time is constant on purpose: equal input gives equal bytes.
        let _ = write!(
            self.text,
            "ISO-10303-21;\nHEADER;\nFILE_DESCRIPTION((''),'2;1');\n\
             FILE_NAME({name},'2000-01-01T00:00:00',(''),(''),'umbilic','umbilic','');\n\
             FILE_SCHEMA(('AUTOMOTIVE_DESIGN {{ 1 0 10303 214 1 1 1 1 }}'));\nENDSEC;\nDATA;\n"
        );
        let application = self.add("APPLICATION_CONTEXT('automotive design')");
        self.add(&format!(
            "APPLICATION_PROTOCOL_DEFINITION('international standard','automotive_design',2000,#{application})"
        ));
        let product_context = self.add(&format!("PRODUCT_CONTEXT('',#{application},'mechanical')"));
        let product = self.add(&format!("PRODUCT({name},{name},'',(#{product_context}))"));
        self.add(&format!("PRODUCT_RELATED_PRODUCT_CATEGORY('part',$,(#{product}))"));
        let formation = self.add(&format!("PRODUCT_DEFINITION_FORMATION('','',#{product})"));
        let design = self
            .add(&format!("PRODUCT_DEFINITION_CONTEXT('part definition',#{application},'design')"));
        let definition =
            self.add(&format!("PRODUCT_DEFINITION('design','',#{formation},#{design})"));
        let product = self.add(&format!("PRODUCT_DEFINITION_SHAPE('','',#{definition})"));
        let length = self.length_unit(&model.unit);
        let angle = self.add("(NAMED_UNIT(*)PLANE_ANGLE_UNIT()SI_UNIT($,.RADIAN.))");
        let solid = self.add("(NAMED_UNIT(*)SI_UNIT($,.STERADIAN.)SOLID_ANGLE_UNIT())");
        let points = model.surfaces.iter().flat_map(|s| s.surface.control_points());
        let size = BoundingBox::of(points.copied()).map_or(1.0, BoundingBox::diagonal);
        let accuracy = real(if size > 0.0 { size * UNCERTAINTY } else { UNCERTAINTY });
        let accuracy = self.add(&format!(
            "UNCERTAINTY_MEASURE_WITH_UNIT(LENGTH_MEASURE({accuracy}),#{length},'distance_accuracy_value','')"
        ));
        let geometry = self.add(&format!(
            "(GEOMETRIC_REPRESENTATION_CONTEXT(3)GLOBAL_UNCERTAINTY_ASSIGNED_CONTEXT((#{accuracy}))\
             GLOBAL_UNIT_ASSIGNED_CONTEXT((#{length},#{angle},#{solid}))REPRESENTATION_CONTEXT('',''))"
        ));
        Context { product, geometry }
    }

    fn length_unit(&mut self, unit: &LengthUnit) -> usize {
        let prefix = match unit {
            LengthUnit::Millimetre => ".MILLI.",
            LengthUnit::Centimetre => ".CENTI.",
            LengthUnit::Decimetre => ".DECI.",
            LengthUnit::Metre => "$",
            LengthUnit::Kilometre => ".KILO.",
            other => return self.converted_unit(other),
        };
        self.add(&format!("(LENGTH_UNIT()NAMED_UNIT(*)SI_UNIT({prefix},.METRE.))"))
    }

    fn converted_unit(&mut self, unit: &LengthUnit) -> usize {
        let metre = self.add("(LENGTH_UNIT()NAMED_UNIT(*)SI_UNIT($,.METRE.))");
        let dimensions = self.add("DIMENSIONAL_EXPONENTS(1.,0.,0.,0.,0.,0.,0.)");
        let factor = real(unit.metres());
        let factor =
            self.add(&format!("LENGTH_MEASURE_WITH_UNIT(LENGTH_MEASURE({factor}),#{metre})"));
        let name = string(match unit {
            LengthUnit::Inch => "INCH",
            LengthUnit::Foot => "FOOT",
            LengthUnit::Yard => "YARD",
            LengthUnit::Mile => "MILE",
            LengthUnit::Other { name, .. } => name,
            _ => "UNIT",
        });
        self.add(&format!(
            "(CONVERSION_BASED_UNIT({name},#{factor})LENGTH_UNIT()NAMED_UNIT(#{dimensions}))"
        ))
    }

    fn point(&mut self, p: DVec3) -> usize {
        self.add(&format!("CARTESIAN_POINT('',({},{},{}))", real(p.x), real(p.y), real(p.z)))
    }

    fn face(&mut self, name: &str, surface: &BsplineSurface) -> usize {
        let bound = self.natural_bound(surface);
        let geometry = self.surface(name, surface);
        let name = string(name);
        self.add(&format!("ADVANCED_FACE({name},(#{bound}),#{geometry},.T.)"))
    }

    fn surface(&mut self, name: &str, surface: &BsplineSurface) -> usize {
        let (rows_u, rows_v) = (wrapped(surface.knots_u()), wrapped(surface.knots_v()));
        let n_v = surface.n_v();
        let ids: Vec<usize> = surface.control_points().iter().map(|p| self.point(*p)).collect();
        let grid = |cell: &dyn Fn(usize) -> String| {
            let row = |i: &usize| list(rows_v.iter().map(|j| cell(i * n_v + j)));
            list(rows_u.iter().map(row))
        };
        let net = grid(&|k| format!("#{}", ids[k]));
        let borders = Borders::of(surface);
        let form = format!(
            "{},{},{net},.UNSPECIFIED.,{},{},.U.",
            surface.degree_u(),
            surface.degree_v(),
            logical(borders.closed_u),
            logical(borders.closed_v)
        );
        let (mult_u, knots_u) = knot_lists(surface.knots_u());
        let (mult_v, knots_v) = knot_lists(surface.knots_v());
        let knots = format!("{mult_u},{mult_v},{knots_u},{knots_v},.UNSPECIFIED.");
        let name = string(name);
        let Some(weights) = surface.weights() else {
            return self.add(&format!("B_SPLINE_SURFACE_WITH_KNOTS({name},{form},{knots})"));
        };
        let weights = grid(&|k| real(weights[k]));
        self.add(&format!(
            "(BOUNDED_SURFACE()B_SPLINE_SURFACE({form})B_SPLINE_SURFACE_WITH_KNOTS({knots})\
             GEOMETRIC_REPRESENTATION_ITEM()RATIONAL_B_SPLINE_SURFACE({weights})\
             REPRESENTATION_ITEM({name})SURFACE())"
        ))
    }

    fn curve(&mut self, border: &Border, knots: &KnotVector, closed: bool) -> usize {
        let rows = wrapped(knots);
        let ids: Vec<usize> = border.points.iter().map(|p| self.point(*p)).collect();
        let net = list(rows.iter().map(|&k| format!("#{}", ids[k])));
        let form = format!("{},{net},.UNSPECIFIED.,{},.U.", knots.degree(), logical(closed));
        let (multiplicities, values) = knot_lists(knots);
        let knots = format!("{multiplicities},{values},.UNSPECIFIED.");
        let Some(weights) = &border.weights else {
            return self.add(&format!("B_SPLINE_CURVE_WITH_KNOTS('',{form},{knots})"));
        };
        let weights = list(rows.iter().map(|&k| real(weights[k])));
        self.add(&format!(
            "(BOUNDED_CURVE()B_SPLINE_CURVE({form})B_SPLINE_CURVE_WITH_KNOTS({knots})CURVE()\
             GEOMETRIC_REPRESENTATION_ITEM()RATIONAL_B_SPLINE_CURVE({weights})REPRESENTATION_ITEM(''))"
        ))
    }

    /// The loop around the whole parameter rectangle. A closed surface runs its seam twice, in
    /// opposite directions; a side that is one point has no edge.
    fn natural_bound(&mut self, surface: &BsplineSurface) -> usize {
        let borders = Borders::of(surface);
        let ((u0, u1), (v0, v1)) = (surface.knots_u().domain(), surface.knots_v().domain());
        // The end of a closed direction is its start, to the last bit.
        let u1 = if borders.closed_u { u0 } else { u1 };
        let v1 = if borders.closed_v { v0 } else { v1 };
        let corners = [(u0, v0), (u1, v0), (u1, v1), (u0, v1)].map(|(u, v)| surface.point(u, v));
        let mut vertices: Vec<(DVec3, usize)> = Vec::new();
        let corners = corners.map(|p| {
            if let Some((_, id)) = vertices.iter().find(|(q, _)| *q == p) {
                return *id;
            }
            let point = self.point(p);
            let id = self.add(&format!("VERTEX_POINT('',#{point})"));
            vertices.push((p, id));
            id
        });
        let edge = |file: &mut Self, side: Side, from: usize, to: usize| {
            let border = &borders.sides[side as usize];
            if border.is_collapsed() {
                return None;
            }
            let along_v = matches!(side, Side::UStart | Side::UEnd);
            let (knots, closed) = if along_v {
                (surface.knots_v(), borders.closed_v)
            } else {
                (surface.knots_u(), borders.closed_u)
            };
            let curve = file.curve(border, knots, closed);
            let (from, to) = (corners[from], corners[to]);
            Some(file.add(&format!("EDGE_CURVE('',#{from},#{to},#{curve},.T.)")))
        };
        let bottom = edge(self, Side::VStart, 0, 1);
        let left = edge(self, Side::UStart, 0, 3);
        let right = if borders.closed_u { left } else { edge(self, Side::UEnd, 1, 2) };
        let top = if borders.closed_v { bottom } else { edge(self, Side::VEnd, 3, 2) };
        let turns = [(bottom, true), (right, true), (top, false), (left, false)];
        let mut oriented = Vec::new();
        for (edge, forward) in turns {
            if let Some(edge) = edge {
                let forward = logical(forward);
                oriented.push(self.add(&format!("ORIENTED_EDGE('',*,*,#{edge},{forward})")));
            }
        }
        let bound = if oriented.is_empty() {
            self.add(&format!("VERTEX_LOOP('',#{})", corners[0]))
        } else {
            self.add(&format!("EDGE_LOOP('',{})", refs(&oriented)))
        };
        self.add(&format!("FACE_OUTER_BOUND('',#{bound},.T.)"))
    }
}

/// Border curves, indexed by [`Side`], and the directions in which the surface closes.
struct Borders {
    sides: [Border; 4],
    closed_u: bool,
    closed_v: bool,
}

impl Borders {
    fn of(surface: &BsplineSurface) -> Self {
        let sides = [Side::UStart, Side::UEnd, Side::VStart, Side::VEnd]
            .map(|side| Border::of(surface, side));
        let closed = |knots: &KnotVector, a: &Border, b: &Border| {
            knots.is_periodic() || (a == b && !a.is_collapsed())
        };
        let closed_u = closed(surface.knots_u(), &sides[0], &sides[1]);
        let closed_v = closed(surface.knots_v(), &sides[2], &sides[3]);
        Self { sides, closed_u, closed_v }
    }
}

fn knot_lists(knots: &KnotVector) -> (String, String) {
    let pairs = knots.multiplicities();
    (list(pairs.iter().map(|(_, m)| m.to_string())), list(pairs.iter().map(|(t, _)| real(*t))))
}

fn list(items: impl Iterator<Item = String>) -> String {
    let mut text = String::from("(");
    for (k, item) in items.enumerate() {
        if k > 0 {
            text.push(',');
        }
        text.push_str(&item);
    }
    text.push(')');
    text
}

fn refs(ids: &[usize]) -> String {
    list(ids.iter().map(|id| format!("#{id}")))
}

fn logical(value: bool) -> &'static str {
    if value { ".T." } else { ".F." }
}

/// A real that reads back bit-equal; the format demands a decimal point.
fn real(x: f64) -> String {
    let text = format!("{x:?}");
    let (mantissa, exponent) = match text.split_once('e') {
        Some((mantissa, exponent)) => (mantissa, format!("E{exponent}")),
        None => (text.as_str(), String::new()),
    };
    let point = if mantissa.contains('.') { "" } else { "." };
    format!("{mantissa}{point}{exponent}")
}

/// A string in quotes; characters beyond ASCII as `\X2\` hexadecimal code units.
fn string(text: &str) -> String {
    let mut quoted = String::from("'");
    for c in text.chars() {
        match c {
            '\'' => quoted.push_str("''"),
            '\\' => quoted.push_str("\\\\"),
            ' '..='~' => quoted.push(c),
            _ => {
                quoted.push_str("\\X2\\");
                for unit in c.encode_utf16(&mut [0; 2]) {
                    let _ = write!(quoted, "{unit:04X}");
                }
                quoted.push_str("\\X0\\");
            }
        }
    }
    quoted.push('\'');
    quoted
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn reals_have_a_point_and_come_back() {
        assert_eq!(real(1.0), "1.0");
        assert_eq!(real(1e-7), "1.E-7");
        assert_eq!(real(-1.5e300), "-1.5E300");
        assert_eq!(real(0.1), "0.1");
        for x in [f64::MAX, 5e-324, 0.1 + 0.2, -0.0, 1e22] {
            assert_eq!(real(x).parse::<f64>().unwrap().to_bits(), x.to_bits());
        }
    }

    #[test]
    fn strings_are_escaped() {
        assert_eq!(string("a'b\\"), "'a''b\\\\'");
        assert_eq!(string("Dach é"), "'Dach \\X2\\00E9\\X0\\'");
    }
}
