//! Drawings of the unrolled strips, with the slots in which they plug into one another.

use geom_core::DVec3;

use crate::lamella::strip::{Lamella, LamellaOptions};

/// Drawing of one unrolled strip: lengths along x, widths along y.
#[derive(Clone, Debug, PartialEq)]
pub struct StripLayout {
    /// Number of the lamella.
    pub lamella: usize,
    /// Closed outline with the slots cut in.
    pub outline: Vec<DVec3>,
    /// Lines across the strip at its nodes.
    pub marks: Vec<[DVec3; 2]>,
    /// Where the names of the nodes go, with their vertices.
    pub labels: Vec<(DVec3, usize)>,
}

/// Lays the strips out one above the other; `gap` is the distance between them.
///
/// Slots come from the upper edge in one family and from the lower in the other, so that the
/// lamellas plug into one another.
#[must_use]
pub fn strip_layout(lamellas: &[Lamella], options: &LamellaOptions, gap: f64) -> Vec<StripLayout> {
    let w = options.width;
    lamellas
        .iter()
        .enumerate()
        .map(|(k, lamella)| {
            let base = -(k as f64) * (w + gap);
            let at = |x: f64, y: f64| DVec3::new(x, base + y, 0.0);
            // The slotted edge runs from the start of the strip to its end.
            let (slotted, plain) = if lamella.family > 0.0 { (w, 0.0) } else { (0.0, w) };
            let mut outline = vec![at(0.0, plain), at(0.0, slotted)];
            for node in &lamella.nodes {
                if node.slot_width.is_nan() {
                    continue;
                }
                // A slot at the end of a strip is cut open.
                let from = (node.arc - 0.5 * node.slot_width).max(0.0);
                let to = (node.arc + 0.5 * node.slot_width).min(lamella.length);
                let floor = slotted + (plain - slotted) * node.slot_depth / w;
                outline.extend([
                    at(from, slotted),
                    at(from, floor),
                    at(to, floor),
                    at(to, slotted),
                ]);
            }
            outline.extend([at(lamella.length, slotted), at(lamella.length, plain)]);
            outline.dedup();
            StripLayout {
                lamella: k,
                outline,
                marks: lamella.nodes.iter().map(|n| [at(n.arc, 0.0), at(n.arc, w)]).collect(),
                labels: lamella.nodes.iter().map(|n| (at(n.arc, 0.5 * w), n.vertex)).collect(),
            }
        })
        .collect()
}
