//! Drawings of curves and texts for fabrication, as SVG and DXF.

use crate::unit::LengthUnit;
use geom_core::{BoundingBox, DVec3};
use std::collections::BTreeSet;
use std::fmt::Write;

/// A polyline on a layer.
#[derive(Clone, Debug, PartialEq)]
pub struct DrawnLine {
    /// The layer, such as `cut` or `engrave`.
    pub layer: String,
    /// Its points; SVG shows x and y.
    pub points: Vec<DVec3>,
    /// Whether the last point is joined to the first.
    pub closed: bool,
}

/// A text on a layer.
#[derive(Clone, Debug, PartialEq)]
pub struct Label {
    /// The layer.
    pub layer: String,
    /// The left end of its base line.
    pub at: DVec3,
    /// Height of its capitals.
    pub height: f64,
    /// Direction of the base line in the plane, in radians.
    pub angle: f64,
    /// The text, on one line.
    pub text: String,
}

/// Curves and texts in the unit of the model.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Drawing {
    /// Polylines.
    pub lines: Vec<DrawnLine>,
    /// Texts.
    pub labels: Vec<Label>,
}

const LAYER_COLORS: [&str; 6] = ["#1b1b1b", "#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00"];

impl Drawing {
    fn layers(&self) -> BTreeSet<&str> {
        let lines = self.lines.iter().map(|l| l.layer.as_str());
        lines.chain(self.labels.iter().map(|l| l.layer.as_str())).collect()
    }

    fn bounds(&self) -> BoundingBox {
        let points = self.lines.iter().flat_map(|l| l.points.iter().copied());
        let texts = self.labels.iter().flat_map(|l| [l.at, l.at + DVec3::Y * l.height]);
        BoundingBox::of(points.chain(texts))
            .unwrap_or(BoundingBox { min: DVec3::ZERO, max: DVec3::ONE })
    }
}

/// An SVG picture at full size: y points up, one group per layer, lengths in `unit`.
#[must_use]
pub fn write_svg(drawing: &Drawing, unit: &LengthUnit) -> String {
    let bounds = drawing.bounds();
    let (min, size) = (bounds.min, bounds.size());
    let diagonal = size.truncate().length().max(1e-12);
    let margin = 0.02 * diagonal;
    let (width, height) = (size.x + 2.0 * margin, size.y + 2.0 * margin);
    let millimetres = unit.metres() * 1000.0;
    let stroke = 0.001 * diagonal;
    // Writing into a `String` cannot fail.
    let mut svg = String::new();
    let _ = writeln!(
        svg,
        "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{}mm\" height=\"{}mm\" \
         viewBox=\"{} {} {width} {height}\">",
        width * millimetres,
        height * millimetres,
        min.x - margin,
        -bounds.max.y - margin,
    );
    for (k, layer) in drawing.layers().into_iter().enumerate() {
        let color = LAYER_COLORS[k % LAYER_COLORS.len()];
        let _ = writeln!(
            svg,
            "<g id=\"{}\" fill=\"none\" stroke=\"{color}\" stroke-width=\"{stroke}\">",
            escape(layer)
        );
        for line in drawing.lines.iter().filter(|l| l.layer == layer) {
            svg.push_str(if line.closed { "<polygon points=\"" } else { "<polyline points=\"" });
            for (k, p) in line.points.iter().enumerate() {
                let space = if k == 0 { "" } else { " " };
                let _ = write!(svg, "{space}{},{}", p.x, -p.y);
            }
            svg.push_str("\"/>\n");
        }
        for label in drawing.labels.iter().filter(|l| l.layer == layer) {
            let (x, y, degrees) = (label.at.x, -label.at.y, -label.angle.to_degrees());
            let _ = writeln!(
                svg,
                "<text x=\"{x}\" y=\"{y}\" transform=\"rotate({degrees} {x} {y})\" \
                 font-family=\"sans-serif\" font-size=\"{}\" fill=\"{color}\" stroke=\"none\">{}</text>",
                // Capitals are about 0.72 of the font size.
                label.height / 0.72,
                escape(&label.text)
            );
        }
        svg.push_str("</g>\n");
    }
    svg.push_str("</svg>\n");
    svg
}

fn escape(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;").replace('"', "&quot;")
}

/// A DXF drawing of release 12, which every CAD program reads: three-dimensional polylines and
/// texts on their layers. DXF of that release has no unit; the numbers are in `unit`, which a
/// comment names.
#[must_use]
pub fn write_dxf(drawing: &Drawing, unit: &LengthUnit) -> String {
    let mut dxf = String::new();
    let bounds = drawing.bounds();
    pair(&mut dxf, 999, &format!("Umbilic, lengths in {unit}"));
    section(&mut dxf, "HEADER");
    pair(&mut dxf, 9, "$ACADVER");
    pair(&mut dxf, 1, "AC1009");
    for (name, corner) in [("$EXTMIN", bounds.min), ("$EXTMAX", bounds.max)] {
        pair(&mut dxf, 9, name);
        point(&mut dxf, corner);
    }
    pair(&mut dxf, 0, "ENDSEC");
    section(&mut dxf, "TABLES");
    pair(&mut dxf, 0, "TABLE");
    pair(&mut dxf, 2, "LAYER");
    let layers = drawing.layers();
    pair(&mut dxf, 70, &layers.len().to_string());
    for (k, layer) in layers.iter().enumerate() {
        pair(&mut dxf, 0, "LAYER");
        pair(&mut dxf, 2, &plain(layer));
        pair(&mut dxf, 70, "0");
        pair(&mut dxf, 62, &(k % 7 + 1).to_string());
        pair(&mut dxf, 6, "CONTINUOUS");
    }
    pair(&mut dxf, 0, "ENDTAB");
    pair(&mut dxf, 0, "ENDSEC");
    section(&mut dxf, "ENTITIES");
    for line in &drawing.lines {
        pair(&mut dxf, 0, "POLYLINE");
        pair(&mut dxf, 8, &plain(&line.layer));
        pair(&mut dxf, 66, "1");
        point(&mut dxf, DVec3::ZERO);
        pair(&mut dxf, 70, if line.closed { "9" } else { "8" });
        for p in &line.points {
            pair(&mut dxf, 0, "VERTEX");
            pair(&mut dxf, 8, &plain(&line.layer));
            point(&mut dxf, *p);
            pair(&mut dxf, 70, "32");
        }
        pair(&mut dxf, 0, "SEQEND");
        pair(&mut dxf, 8, &plain(&line.layer));
    }
    for label in &drawing.labels {
        pair(&mut dxf, 0, "TEXT");
        pair(&mut dxf, 8, &plain(&label.layer));
        point(&mut dxf, label.at);
        pair(&mut dxf, 40, &format!("{:?}", label.height));
        pair(&mut dxf, 1, &text(&label.text));
        pair(&mut dxf, 50, &format!("{:?}", label.angle.to_degrees()));
    }
    pair(&mut dxf, 0, "ENDSEC");
    pair(&mut dxf, 0, "EOF");
    dxf
}

fn section(dxf: &mut String, name: &str) {
    pair(dxf, 0, "SECTION");
    pair(dxf, 2, name);
}

fn pair(dxf: &mut String, code: u32, value: &str) {
    let _ = writeln!(dxf, "{code:>3}\n{value}");
}

fn point(dxf: &mut String, p: DVec3) {
    for (code, value) in [(10, p.x), (20, p.y), (30, p.z)] {
        pair(dxf, code, &format!("{value:?}"));
    }
}

/// Names of layers in release 12 are letters, digits, `-`, `_` and `$`.
fn plain(name: &str) -> String {
    let fit = |c: char| if c.is_ascii_alphanumeric() || "-_$".contains(c) { c } else { '_' };
    let name: String = name.chars().take(31).map(fit).collect();
    if name.is_empty() { "0".to_owned() } else { name }
}

/// A text on one line, in the ASCII that release 12 knows.
fn text(text: &str) -> String {
    text.chars().map(|c| if matches!(c, ' '..='~') { c } else { '?' }).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn drawing() -> Drawing {
        let line = |layer: &str, closed| DrawnLine {
            layer: layer.into(),
            points: vec![DVec3::ZERO, DVec3::new(3.0, 0.0, 0.0), DVec3::new(3.0, 4.0, 1.0)],
            closed,
        };
        let label = Label {
            layer: "notes & marks".into(),
            at: DVec3::new(1.0, 1.0, 0.0),
            height: 0.72,
            angle: std::f64::consts::FRAC_PI_2,
            text: "strip <7>".into(),
        };
        Drawing { lines: vec![line("cut", true), line("fold", false)], labels: vec![label] }
    }

    #[test]
    fn svg_is_full_size_with_y_up() {
        let svg = write_svg(&drawing(), &LengthUnit::Centimetre);
        assert!(svg.contains("width=\"32mm\" height=\"42mm\""), "{svg}");
        assert!(svg.contains("<polygon points=\"0,-0 3,-0 3,-4\"/>"), "{svg}");
        assert!(svg.contains("strip &lt;7&gt;") && svg.contains("id=\"notes &amp; marks\""));
        assert!(svg.contains("rotate(-90 1 -1)") && svg.contains("font-size=\"1\""));
    }

    #[test]
    fn dxf_has_layers_polylines_and_texts() {
        let dxf = write_dxf(&drawing(), &LengthUnit::Millimetre);
        assert_eq!(dxf.matches("\nPOLYLINE\n").count(), 2);
        assert_eq!(dxf.matches("\nVERTEX\n").count(), 6);
        assert!(dxf.contains("\nnotes___marks\n") && dxf.contains("\nstrip <7>\n"));
        assert!(dxf.ends_with("  0\nENDSEC\n  0\nEOF\n"));
        assert_eq!(dxf.lines().count() % 2, 0);
    }
}
