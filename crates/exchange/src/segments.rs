//! Labelled straight segments as tables (CSV) and drawings (DXF): wire positions, members.

use geom_core::DVec3;
use std::fmt::Write as _;

/// A straight segment with the labels a workshop finds it by.
#[derive(Clone, Debug, PartialEq)]
pub struct Segment {
    /// One label per column named in [`write_segments_csv`].
    pub labels: Vec<u64>,
    /// Its ends, in the unit of the model.
    pub ends: [DVec3; 2],
}

/// A table with a heading line: the label columns, then `x0,y0,z0,x1,y1,z1`.
#[must_use]
pub fn write_segments_csv(columns: &[&str], segments: &[Segment]) -> String {
    let mut text = columns.join(",");
    text.push_str(",x0,y0,z0,x1,y1,z1\n");
    for segment in segments {
        for label in &segment.labels {
            let _ = write!(text, "{label},");
        }
        let [a, b] = segment.ends;
        // Rust prints the shortest decimal that reads back to the same number.
        let _ = writeln!(text, "{},{},{},{},{},{}", a.x, a.y, a.z, b.x, b.y, b.z);
    }
    text
}

/// A drawing of `LINE` entities in space (DXF R12, which every program reads); the layer of a
/// segment is `layer` followed by its first label.
#[must_use]
pub fn write_segments_dxf(layer: &str, segments: &[Segment]) -> String {
    let mut text = String::from("0\nSECTION\n2\nENTITIES\n");
    for segment in segments {
        let label = segment.labels.first().map(u64::to_string).unwrap_or_default();
        let [a, b] = segment.ends;
        let _ = write!(text, "0\nLINE\n8\n{layer}{label}\n");
        let codes = [(10, a.x), (20, a.y), (30, a.z), (11, b.x), (21, b.y), (31, b.z)];
        for (code, value) in codes {
            let _ = write!(text, "{code}\n{value}\n");
        }
    }
    text.push_str("0\nENDSEC\n0\nEOF\n");
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tables_and_drawings_hold_the_exact_numbers() {
        let ends = [DVec3::new(0.1, 0.2, 0.3), DVec3::new(1.0, -2.5, 1e-7)];
        let segments = [Segment { labels: vec![7, 1], ends }];
        let csv = write_segments_csv(&["panel", "family"], &segments);
        assert_eq!(csv, "panel,family,x0,y0,z0,x1,y1,z1\n7,1,0.1,0.2,0.3,1,-2.5,0.0000001\n");
        let dxf = write_segments_dxf("PANEL", &segments);
        assert!(dxf.contains("0\nLINE\n8\nPANEL7\n10\n0.1\n20\n0.2\n30\n0.3\n11\n1\n21\n-2.5\n"));
        assert!(dxf.ends_with("0\nEOF\n"));
    }
}
