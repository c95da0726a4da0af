//! Writing: faces sewn into shells, trims and colours kept.

use super::sew::{Sewn, SewnFace, Use, sew, tolerance};
use crate::color::display;
use crate::model::{Model, NamedSurface};
use crate::unit::LengthUnit;
use crate::wrapped::wrapped;
use bspline::{BsplineCurve, BsplineSurface, KnotVector, SplineError};
use geom_core::DVec3;
use std::collections::HashMap;
use std::fmt::Write;

/// Opposite sides of a flat surface differ by no more than this share of their length.
const PARALLEL: f64 = 1e-12;
/// Uncertainty of positions that the file states, as a share of the bounding box.
const UNCERTAINTY: f64 = 1e-7;

/// The surfaces of a model as a STEP file of application protocol 214, an `ADVANCED_FACE` for
/// each. Faces with a border curve in common share its edge and vertices and stand in one shell;
/// a closed shell is a `MANIFOLD_SOLID_BREP` with its normals outside. Where a face must be turned
/// over for that, its parameters are swapped. Knots, weights and control points are exact; a
/// periodic surface is written with unclamped knots and its first control points repeated at the
/// end. Trims are written as curves in space and in the parameter plane.
///
/// # Errors
/// [`SplineError`] if the numbers of an extreme surface leave the range of `f64`.
pub fn write_step(model: &Model) -> Result<String, SplineError> {
    let sewn = sew(&model.surfaces, tolerance(&model.surfaces, UNCERTAINTY))?;
    let mut file = Writer::default();
    let context = file.header(model);
    let faces = file.faces(&model.surfaces, &sewn);
    file.shells(&sewn, &faces, &context);
    file.colors(&model.surfaces, &faces, &context);
    file.text.push_str("ENDSEC;\nEND-ISO-10303-21;\n");
    Ok(file.text)
}

#[derive(Default)]
struct Writer {
    text: String,
    last: usize,
    /// The context of parameter planes, once there is one.
    plane: Option<usize>,
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
             FILE_NAME({name},'2000-01-01T00:00:00',(''),(''),'Umbilic','Umbilic','');\n\
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
        let accuracy = real(tolerance(&model.surfaces, UNCERTAINTY));
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

    /// All faces in the order of the model, after the edges they share.
    fn faces(&mut self, surfaces: &[NamedSurface], sewn: &Sewn) -> Vec<usize> {
        let mut vertices: Vec<usize> = Vec::with_capacity(sewn.vertices.len());
        for p in &sewn.vertices {
            let point = self.point(*p);
            vertices.push(self.add(&format!("VERTEX_POINT('',#{point})")));
        }
        let mut geometry: Vec<usize> = Vec::with_capacity(sewn.faces.len());
        for (face, named) in sewn.faces.iter().zip(surfaces) {
            geometry.push(self.surface(&named.name, &face.surface));
        }
        let courses = courses(sewn);
        let mut edges: Vec<usize> = Vec::with_capacity(sewn.edges.len());
        for (k, edge) in sewn.edges.iter().enumerate() {
            let [from, to] = edge.vertices;
            let mut curve = if edge.is_straight {
                self.line(sewn.vertices[from], sewn.vertices[to])
            } else {
                self.curve(&edge.curve, from == to, 3)
            };
            if let Some(planar) = courses.get(&k) {
                curve = self.curve_on_surfaces(curve, planar, &geometry);
            }
            let (from, to) = (vertices[from], vertices[to]);
            edges.push(self.add(&format!("EDGE_CURVE('',#{from},#{to},#{curve},.T.)")));
        }
        let mut faces = Vec::with_capacity(sewn.faces.len());
        for ((face, named), surface) in sewn.faces.iter().zip(surfaces).zip(&geometry) {
            let bounds = refs(&self.bounds(face, &edges, &vertices));
            let name = string(&named.name);
            faces.push(self.add(&format!("ADVANCED_FACE({name},{bounds},#{surface},.T.)")));
        }
        faces
    }

    fn bounds(&mut self, face: &SewnFace, edges: &[usize], vertices: &[usize]) -> Vec<usize> {
        let mut bounds = Vec::with_capacity(face.loops.len());
        for (k, uses) in face.loops.iter().enumerate() {
            let mut oriented = Vec::with_capacity(uses.len());
            for Use { edge, forward, .. } in uses {
                let (edge, forward) = (edges[*edge], logical(*forward));
                oriented.push(self.add(&format!("ORIENTED_EDGE('',*,*,#{edge},{forward})")));
            }
            let bound = if oriented.is_empty() {
                if k > 0 {
                    continue;
                }
                self.add(&format!("VERTEX_LOOP('',#{})", vertices[face.point]))
            } else {
                self.add(&format!("EDGE_LOOP('',{})", refs(&oriented)))
            };
            let kind = if k == 0 { "FACE_OUTER_BOUND" } else { "FACE_BOUND" };
            bounds.push(self.add(&format!("{kind}('',#{bound},.T.)")));
        }
        bounds
    }

    /// Closed shells as solids, the others as surfaces.
    fn shells(&mut self, sewn: &Sewn, faces: &[usize], context: &Context) {
        let (mut solids, mut open) = (Vec::new(), Vec::new());
        for shell in &sewn.shells {
            let ids: Vec<usize> = shell.faces.iter().map(|f| faces[*f]).collect();
            if shell.is_closed {
                let shell = self.add(&format!("CLOSED_SHELL('',{})", refs(&ids)));
                solids.push(self.add(&format!("MANIFOLD_SOLID_BREP('',#{shell})")));
            } else {
                open.push(self.add(&format!("OPEN_SHELL('',{})", refs(&ids))));
            }
        }
        let geometry = context.geometry;
        let mut shapes = Vec::new();
        if !open.is_empty() {
            let body = self.add(&format!("SHELL_BASED_SURFACE_MODEL('',{})", refs(&open)));
            shapes.push(
                self.add(&format!(
                    "MANIFOLD_SURFACE_SHAPE_REPRESENTATION('',(#{body}),#{geometry})"
                )),
            );
        }
        if !solids.is_empty() {
            let solids = refs(&solids);
            shapes.push(
                self.add(&format!("ADVANCED_BREP_SHAPE_REPRESENTATION('',{solids},#{geometry})")),
            );
        }
        let shape = match shapes[..] {
            [only] => only,
            _ => {
                // Solids and surfaces stand in the coordinates of one shape.
                let origin = self.point(DVec3::ZERO);
                let axes = [DVec3::Z, DVec3::X].map(|axis| self.direction(axis));
                let frame = self
                    .add(&format!("AXIS2_PLACEMENT_3D('',#{origin},#{},#{})", axes[0], axes[1]));
                let shape = self.add(&format!("SHAPE_REPRESENTATION('',(#{frame}),#{geometry})"));
                for other in shapes {
                    self.add(&format!(
                        "SHAPE_REPRESENTATION_RELATIONSHIP('','',#{shape},#{other})"
                    ));
                }
                shape
            }
        };
        self.add(&format!("SHAPE_DEFINITION_REPRESENTATION(#{},#{shape})", context.product));
    }

    /// A style for every colour, and which faces have it.
    fn colors(&mut self, surfaces: &[NamedSurface], faces: &[usize], context: &Context) {
        let mut styles: Vec<([f32; 3], usize)> = Vec::new();
        let mut items = Vec::new();
        for (named, face) in surfaces.iter().zip(faces) {
            let Some(color) = named.color else { continue };
            let style = match styles.iter().find(|(known, _)| *known == color) {
                Some((_, style)) => *style,
                None => {
                    let style = self.style(color);
                    styles.push((color, style));
                    style
                }
            };
            items.push(self.add(&format!("STYLED_ITEM('',(#{style}),#{face})")));
        }
        if !items.is_empty() {
            let (items, geometry) = (refs(&items), context.geometry);
            self.add(&format!(
                "MECHANICAL_DESIGN_GEOMETRIC_PRESENTATION_REPRESENTATION('',{items},#{geometry})"
            ));
        }
    }

    fn style(&mut self, color: [f32; 3]) -> usize {
        let [r, g, b] = color.map(|c| real(display(f64::from(c)).clamp(0.0, 1.0)));
        let color = self.add(&format!("COLOUR_RGB('',{r},{g},{b})"));
        let color = self.add(&format!("FILL_AREA_STYLE_COLOUR('',#{color})"));
        let fill = self.add(&format!("FILL_AREA_STYLE('',(#{color}))"));
        let area = self.add(&format!("SURFACE_STYLE_FILL_AREA(#{fill})"));
        let side = self.add(&format!("SURFACE_SIDE_STYLE('',(#{area}))"));
        let usage = self.add(&format!("SURFACE_STYLE_USAGE(.BOTH.,#{side})"));
        self.add(&format!("PRESENTATION_STYLE_ASSIGNMENT((#{usage}))"))
    }

    fn direction(&mut self, d: DVec3) -> usize {
        self.add(&format!("DIRECTION('',({},{},{}))", real(d.x), real(d.y), real(d.z)))
    }

    fn line(&mut self, from: DVec3, to: DVec3) -> usize {
        let origin = self.point(from);
        let direction = self.direction((to - from).normalize_or(DVec3::X));
        let vector = self.add(&format!("VECTOR('',#{direction},1.)"));
        self.add(&format!("LINE('',#{origin},#{vector})"))
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
        let closed = |knots: &KnotVector, first: &dyn Fn(usize) -> [usize; 2], n: usize| {
            knots.is_periodic()
                || (0..n).all(|k| {
                    let [a, b] = first(k);
                    surface.control_points()[a] == surface.control_points()[b]
                })
        };
        let (n_u, n_v) = (surface.n_u(), surface.n_v());
        let closed_u = closed(surface.knots_u(), &|j| [j, (n_u - 1) * n_v + j], n_v);
        let closed_v = closed(surface.knots_v(), &|i| [i * n_v, i * n_v + n_v - 1], n_u);
        let form = format!(
            "{},{},{net},.UNSPECIFIED.,{},{},.U.",
            surface.degree_u(),
            surface.degree_v(),
            logical(closed_u),
            logical(closed_v)
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

    /// A curve in space, or with two coordinates in a parameter plane.
    fn curve(&mut self, curve: &BsplineCurve, closed: bool, dimension: usize) -> usize {
        let knots = curve.knots();
        let rows = wrapped(knots);
        let mut ids = Vec::with_capacity(curve.control_points().len());
        for p in curve.control_points() {
            ids.push(if dimension == 3 { self.point(*p) } else { self.flat_point(*p) });
        }
        let net = list(rows.iter().map(|&k| format!("#{}", ids[k])));
        let form = format!("{},{net},.UNSPECIFIED.,{},.U.", knots.degree(), logical(closed));
        let (multiplicities, values) = knot_lists(knots);
        let knots = format!("{multiplicities},{values},.UNSPECIFIED.");
        let Some(weights) = curve.weights() else {
            return self.add(&format!("B_SPLINE_CURVE_WITH_KNOTS('',{form},{knots})"));
        };
        let weights = list(rows.iter().map(|&k| real(weights[k])));
        self.add(&format!(
            "(BOUNDED_CURVE()B_SPLINE_CURVE({form})B_SPLINE_CURVE_WITH_KNOTS({knots})CURVE()\
             GEOMETRIC_REPRESENTATION_ITEM()RATIONAL_B_SPLINE_CURVE({weights})REPRESENTATION_ITEM(''))"
        ))
    }

    fn flat_point(&mut self, p: DVec3) -> usize {
        self.add(&format!("CARTESIAN_POINT('',({},{}))", real(p.x), real(p.y)))
    }

    /// A curve in space with its courses in the parameter planes of trimmed faces.
    fn curve_on_surfaces(
        &mut self,
        curve: usize,
        courses: &[(usize, BsplineCurve)],
        surfaces: &[usize],
    ) -> usize {
        let plane = match self.plane {
            Some(plane) => plane,
            None => self.add(
                "(GEOMETRIC_REPRESENTATION_CONTEXT(2)PARAMETRIC_REPRESENTATION_CONTEXT()\
                 REPRESENTATION_CONTEXT('',''))",
            ),
        };
        self.plane = Some(plane);
        let mut planar = Vec::with_capacity(courses.len());
        for (face, course) in courses {
            let closed = false;
            let course = self.curve(course, closed, 2);
            let definition =
                self.add(&format!("DEFINITIONAL_REPRESENTATION('',(#{course}),#{plane})"));
            planar.push(self.add(&format!("PCURVE('',#{},#{definition})", surfaces[*face])));
        }
        let is_seam = matches!(courses, [(a, _), (b, _)] if a == b);
        let kind = if is_seam { "SEAM_CURVE" } else { "SURFACE_CURVE" };
        self.add(&format!("{kind}('',#{curve},{},.CURVE_3D.)", refs(&planar)))
    }
}

/// The courses of every edge in the parameter planes of trimmed faces, in the direction of the
/// edge.
fn courses(sewn: &Sewn) -> HashMap<usize, Vec<(usize, BsplineCurve)>> {
    let mut courses: HashMap<usize, Vec<(usize, BsplineCurve)>> = HashMap::new();
    for (k, face) in sewn.faces.iter().enumerate() {
        for made in face.loops.iter().flatten() {
            if let Some(course) = &made.parameters {
                let course = if made.forward { course.clone() } else { course.reversed() };
                let edge = &sewn.edges[made.edge];
                let runs_alike = course.knots() == edge.curve.knots()
                    && course.weights() == edge.curve.weights();
                // Readers that find an edge and its course at other places of their parameters refit
                // the course; on a plane it can be had exactly.
                let exact = if runs_alike || edge.is_straight {
                    None
                } else {
                    on_plane(&face.surface, &edge.curve)
                };
                courses.entry(made.edge).or_default().push((k, exact.unwrap_or(course)));
            }
        }
    }
    courses
}

/// The course of a curve in the parameters of a flat surface: an affine map of its control points.
fn on_plane(surface: &BsplineSurface, curve: &BsplineCurve) -> Option<BsplineCurve> {
    let [p00, p01, p10, p11] = *surface.control_points() else { return None };
    let (a, b) = (p10 - p00, p01 - p00);
    let is_flat = !surface.is_rational()
        && (p11 - p00 - a - b).length() <= PARALLEL * (a.length() + b.length());
    if !is_flat || !curve.knots().is_clamped() {
        return None;
    }
    let ((u0, u1), (v0, v1)) = (surface.knots_u().domain(), surface.knots_v().domain());
    let (e, f, g) = (a.dot(a), a.dot(b), b.dot(b));
    let determinant = e * g - f * f;
    let place = |p: DVec3| {
        let (x, y) = ((p - p00).dot(a), (p - p00).dot(b));
        let (s, t) = ((g * x - f * y) / determinant, (e * y - f * x) / determinant);
        DVec3::new(u0 + s * (u1 - u0), v0 + t * (v1 - v0), 0.0)
    };
    curve.mapped(place).ok()
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
