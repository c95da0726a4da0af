//! Colour maps that stay readable without red–green vision, and colours of groups.
//!
//! Each map runs through a few anchors in the OKLab space (Ottosson 2020), where equal steps look
//! about equally large. Both maps change in lightness as well as in hue: the diverging one is
//! lightest at zero, the sequential one grows lighter throughout, so a grey print can be read too.
//!
//! Roots and powers come from `libm`, so that a colour is the same on every machine; those of the
//! standard library are the machine's own.

use libm::{cbrt, cos, pow, sin};

use crate::FieldScale;

/// Entries of a table.
pub(crate) const TABLE: usize = 256;

/// Colour of a vertex without a value.
pub(crate) const NO_VALUE: [u8; 3] = [0xb9, 0xb6, 0xb0];

/// From deep blue over near-white to deep orange: minus, zero, plus.
const DIVERGING: [[u8; 3]; 9] = [
    [0x10, 0x2c, 0x57],
    [0x1f, 0x55, 0x9b],
    [0x4b, 0x8b, 0xc8],
    [0x9e, 0xc3, 0xe2],
    [0xf3, 0xf1, 0xec],
    [0xf3, 0xbf, 0x8b],
    [0xdd, 0x82, 0x3c],
    [0xb0, 0x4a, 0x12],
    [0x66, 0x1f, 0x05],
];

/// From dark violet over teal to light yellow.
const SEQUENTIAL: [[u8; 3]; 7] = [
    [0x2a, 0x12, 0x4d],
    [0x37, 0x3a, 0x84],
    [0x2b, 0x69, 0x93],
    [0x23, 0x94, 0x8c],
    [0x58, 0xb8, 0x70],
    [0xb2, 0xd3, 0x57],
    [0xfa, 0xe8, 0x8c],
];

/// The map of a field, from its lowest to its highest value.
pub(crate) fn table(scale: FieldScale) -> Vec<[u8; 3]> {
    let anchors: &[[u8; 3]] = match scale {
        FieldScale::Signed => &DIVERGING,
        FieldScale::Magnitude => &SEQUENTIAL,
    };
    let anchors: Vec<[f64; 3]> = anchors.iter().map(|c| to_oklab(*c)).collect();
    let colour = |i: usize| {
        let t = i as f64 / (TABLE - 1) as f64 * (anchors.len() - 1) as f64;
        let k = (t as usize).min(anchors.len() - 2);
        let mix = |c: usize| anchors[k][c] + (anchors[k + 1][c] - anchors[k][c]) * (t - k as f64);
        from_oklab([mix(0), mix(1), mix(2)])
    };
    (0..TABLE).map(colour).collect()
}

/// Colour of group `index`: hues a golden angle apart, three steps of lightness.
pub(crate) fn group_colour(index: usize) -> [u8; 3] {
    let hue = 0.6 + index as f64 * std::f64::consts::TAU * 0.381_966_011_250_105;
    let lightness = [0.74, 0.60, 0.85][index % 3];
    let chroma = [0.095, 0.11, 0.075][index % 3];
    from_oklab([lightness, chroma * cos(hue), chroma * sin(hue)])
}

/// `#rrggbb`.
pub(crate) fn hex([r, g, b]: [u8; 3]) -> String {
    format!("#{r:02x}{g:02x}{b:02x}")
}

/// Linear light of an sRGB byte, 0 to 1 (IEC 61966-2-1).
pub(crate) fn to_linear(byte: u8) -> f64 {
    let c = f64::from(byte) / 255.0;
    if c <= 0.040_45 { c / 12.92 } else { pow((c + 0.055) / 1.055, 2.4) }
}

/// The sRGB byte nearest to linear light, clamped to 0 to 1.
pub(crate) fn from_linear(c: f64) -> u8 {
    let c = c.clamp(0.0, 1.0);
    let s = if c <= 0.003_130_8 { c * 12.92 } else { 1.055 * pow(c, 1.0 / 2.4) - 0.055 };
    (s * 255.0).round() as u8
}

fn to_oklab(rgb: [u8; 3]) -> [f64; 3] {
    let [r, g, b] = rgb.map(to_linear);
    let l = cbrt(0.412_221_470_8 * r + 0.536_332_536_3 * g + 0.051_445_992_9 * b);
    let m = cbrt(0.211_903_498_2 * r + 0.680_699_545_1 * g + 0.107_396_956_6 * b);
    let s = cbrt(0.088_302_461_9 * r + 0.281_718_837_6 * g + 0.629_978_700_5 * b);
    [
        0.210_454_255_3 * l + 0.793_617_785_0 * m - 0.004_072_046_8 * s,
        1.977_998_495_1 * l - 2.428_592_205_0 * m + 0.450_593_709_9 * s,
        0.025_904_037_1 * l + 0.782_771_766_2 * m - 0.808_675_766_0 * s,
    ]
}

fn from_oklab([l, a, b]: [f64; 3]) -> [u8; 3] {
    let cube = |v: f64| v * v * v;
    let x = cube(l + 0.396_337_777_4 * a + 0.215_803_757_3 * b);
    let y = cube(l - 0.105_561_345_8 * a - 0.063_854_172_8 * b);
    let z = cube(l - 0.089_484_177_5 * a - 1.291_485_548_0 * b);
    [
        from_linear(4.076_741_662_1 * x - 3.307_711_591_3 * y + 0.230_969_929_2 * z),
        from_linear(-1.268_438_004_6 * x + 2.609_757_401_1 * y - 0.341_319_396_5 * z),
        from_linear(-0.004_196_086_3 * x - 0.703_418_614_7 * y + 1.707_614_701_0 * z),
    ]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn oklab_round_trips() {
        for c in [[0, 0, 0], [255, 255, 255], [12, 200, 99], [250, 3, 128]] {
            assert_eq!(from_oklab(to_oklab(c)), c);
        }
    }

    #[test]
    fn the_sequential_map_grows_lighter_and_the_diverging_one_peaks_at_zero() {
        let lightness = |scale| -> Vec<f64> {
            table(scale).iter().map(|c| to_oklab(*c)[0]).collect::<Vec<_>>()
        };
        // Bytes are rounded, which may cost up to 0.002 of lightness from one entry to the next.
        let rises = |l: &[f64]| l.windows(2).all(|p| p[1] > p[0] - 2e-3);
        assert!(rises(&lightness(FieldScale::Magnitude)));
        let mut diverging = lightness(FieldScale::Signed);
        assert!(rises(&diverging[..TABLE / 2]));
        diverging.reverse();
        assert!(rises(&diverging[..TABLE / 2]));
    }

    #[test]
    fn signs_differ_for_every_kind_of_colour_vision() {
        // Red-green blindness keeps the blue-yellow axis, OKLab's b: it must change sign.
        let map = table(FieldScale::Signed);
        assert!(to_oklab(map[40])[2] < -0.05 && to_oklab(map[215])[2] > 0.05);
    }
}
