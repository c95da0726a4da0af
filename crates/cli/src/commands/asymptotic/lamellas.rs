//! Drawings and tables of the unrolled strips.

use asymptotic_bezier::{Lamella, LamellaOptions, Options, Solution, strip_layout};
use exchange::{Drawing, DrawnLine, Label, LengthUnit};
use geom_core::DVec3;
use std::path::{Path, PathBuf};

/// Drawings and tables of the strips.
pub(super) fn files(
    folder: &Path,
    result: &Solution,
    options: &Options,
    unit: &LengthUnit,
) -> Vec<(PathBuf, Vec<u8>)> {
    let (settings, strips) = result.lamellas(options);
    let drawing = strip_drawing(&strips, &settings);
    vec![
        (folder.join("lamellas.svg"), exchange::write_svg(&drawing, unit).into_bytes()),
        (folder.join("lamellas.dxf"), exchange::write_dxf(&drawing, unit).into_bytes()),
        (folder.join("lamellas.csv"), lamella_table(&strips).into_bytes()),
        (folder.join("nodes.csv"), node_table(&strips).into_bytes()),
    ]
}

fn strip_drawing(strips: &[Lamella], settings: &LamellaOptions) -> Drawing {
    let mut drawing = Drawing::default();
    let height = 0.2 * settings.width;
    for layout in strip_layout(strips, settings, 0.5 * settings.width) {
        let start = layout.outline[0].x;
        drawing.lines.push(DrawnLine { layer: "cut".into(), points: layout.outline, closed: true });
        for mark in layout.marks {
            let points = mark.to_vec();
            drawing.lines.push(DrawnLine { layer: "engrave".into(), points, closed: false });
        }
        let mut label = |at, text| {
            let layer = "label".into();
            drawing.labels.push(Label { layer, at, height, angle: 0.0, text });
        };
        // In front of the strip, and beside the marks rather than on them.
        if let Some((first, _)) = layout.labels.first() {
            let front = DVec3::new(start - settings.width, first.y, 0.0);
            label(front, format!("L{}", layout.lamella));
        }
        for (at, vertex) in layout.labels {
            label(at + DVec3::X * 0.5 * height, format!("{vertex}"));
        }
    }
    drawing
}

fn lamella_table(strips: &[Lamella]) -> String {
    let header = [
        "lamella",
        "family",
        "curves",
        "length",
        "curvature_max",
        "radius_min",
        "torsion_max",
        "twist_deg",
        "width_bound",
        "bending_stress",
        "shear_stress",
        "edge_stress",
        "elastic_energy",
    ];
    let optional = |value: Option<f64>| value.map_or_else(String::new, |v| v.to_string());
    let rows = strips.iter().enumerate().map(|(k, l)| {
        let curves: Vec<String> = l.curves.iter().map(|(i, _)| i.to_string()).collect();
        vec![
            format!("L{k}"),
            if l.family > 0.0 { "u".into() } else { "v".into() },
            curves.join(" "),
            l.length.to_string(),
            l.curvature.to_string(),
            l.curvature.recip().to_string(),
            l.torsion.to_string(),
            l.twist.to_degrees().to_string(),
            l.width_bound.to_string(),
            optional(l.bending_stress),
            optional(l.shear_stress),
            optional(l.edge_stress),
            optional(l.elastic_energy),
        ]
    });
    exchange::write_csv(&header, rows)
}

fn node_table(strips: &[Lamella]) -> String {
    let header = [
        "lamella",
        "vertex",
        "arc",
        "angle_deg",
        "slot_width",
        "slot_depth",
        "normal_x",
        "normal_y",
        "normal_z",
        "direction_x",
        "direction_y",
        "direction_z",
    ];
    let rows = strips.iter().enumerate().flat_map(|(k, l)| {
        l.nodes.iter().map(move |n| {
            let mut row = vec![format!("L{k}"), n.vertex.to_string()];
            let numbers = [n.arc, n.angle.to_degrees(), n.slot_width, n.slot_depth];
            let frame = n.normal.to_array().into_iter().chain(n.direction.to_array());
            row.extend(numbers.into_iter().chain(frame).map(|v| v.to_string()));
            row
        })
    });
    exchange::write_csv(&header, rows)
}
