//! Colours of written meshes, in linear RGB as glTF wants them.

use crate::mesh::Mesh;

/// Blue over white to red for -1 to 1; readable by colour-blind people. The stops are given in
/// sRGB and mixed in linear light.
pub(crate) fn diverging(t: f64) -> [f32; 3] {
    const BLUE: [f64; 3] = [0.130, 0.400, 0.674];
    const WHITE: [f64; 3] = [0.968, 0.968, 0.968];
    const RED: [f64; 3] = [0.698, 0.094, 0.168];
    let t = if t.is_finite() { t.clamp(-1.0, 1.0) } else { 0.0 };
    let end = if t < 0.0 { BLUE } else { RED };
    std::array::from_fn(|c| {
        let (w, e) = (linear(WHITE[c]), linear(end[c]));
        (w + t.abs() * (e - w)) as f32
    })
}

/// Well separated colours for groups, after Okabe and Ito; then hues by the golden ratio.
pub(crate) fn palette(k: usize) -> [f32; 3] {
    const OKABE_ITO: [[f64; 3]; 7] = [
        [0.000, 0.447, 0.698],
        [0.902, 0.624, 0.000],
        [0.000, 0.620, 0.451],
        [0.835, 0.369, 0.000],
        [0.337, 0.706, 0.914],
        [0.800, 0.475, 0.655],
        [0.941, 0.894, 0.259],
    ];
    let srgb = match OKABE_ITO.get(k) {
        Some(color) => *color,
        None => {
            let hue = (k as f64 * 0.618_033_988_749_895).fract() * 6.0;
            let ramp = |shift: f64| ((hue + shift).rem_euclid(6.0) - 3.0).abs() - 1.0;
            [ramp(0.0), ramp(4.0), ramp(2.0)].map(|x| 0.25 + 0.6 * x.clamp(0.0, 1.0))
        }
    };
    srgb.map(|x| linear(x) as f32)
}

/// The sRGB transfer function, from display value to linear light (IEC 61966-2-1).
pub(crate) fn linear(srgb: f64) -> f64 {
    if srgb <= 0.04045 { srgb / 12.92 } else { ((srgb + 0.055) / 1.055).powf(2.4) }
}

/// The sRGB transfer function, from linear light to display value (IEC 61966-2-1).
pub(crate) fn display(linear: f64) -> f64 {
    if linear <= 0.003_130_8 { linear * 12.92 } else { 1.055 * linear.powf(1.0 / 2.4) - 0.055 }
}

/// Half the range of a diverging map: the 95th percentile of the sizes, so that a few spikes do
/// not wash out the rest; values beyond keep the end colour.
pub(crate) fn diverging_range(values: &[f64]) -> f64 {
    let mut sizes: Vec<f64> = values.iter().map(|v| v.abs()).filter(|v| v.is_finite()).collect();
    if sizes.is_empty() {
        return 1.0;
    }
    let at = (sizes.len() - 1) * 95 / 100;
    let (_, range, _) = sizes.select_nth_unstable_by(at, f64::total_cmp);
    if *range > 0.0 { *range } else { 1.0 }
}

/// Colours of the vertices by their `K`, or by their first field; none where groups have colours.
pub(crate) fn field_colors(mesh: &Mesh) -> Vec<[f32; 3]> {
    let shown = mesh.vertex_fields.iter().find(|f| f.name == "K").or(mesh.vertex_fields.first());
    match shown {
        Some(field) if mesh.groups.is_empty() => {
            let range = diverging_range(&field.values);
            field.values.iter().map(|v| diverging(v / range)).collect()
        }
        _ => Vec::new(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn transfer_functions_are_inverse() {
        for k in 0..=100 {
            let x = f64::from(k) / 100.0;
            assert!((display(linear(x)) - x).abs() < 1e-6, "{x}");
        }
        assert!((linear(0.5) - 0.214_041_14).abs() < 1e-8);
    }

    #[test]
    fn the_map_is_white_at_zero_and_keeps_its_ends() {
        let white = diverging(0.0);
        assert!(white.iter().all(|c| *c == white[0]));
        assert_eq!(diverging(7.0), diverging(1.0));
        assert_eq!(diverging(f64::NAN), white);
        assert!((0..100).map(palette).all(|c| c.iter().all(|x| (0.0..=1.0).contains(x))));
    }
}
