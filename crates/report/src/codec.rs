//! Small encodings of mesh data for the page.
//!
//! Floats are quantised to 24 bits over their range, which is finer than the 32-bit floats a GPU
//! works with, predicted from their neighbours, split into byte planes and deflated; whole numbers
//! likewise without the quantisation. The page undoes it in `viewer/js/decode.js`.

use base64::Engine as _;
use glam::DVec3;
use serde_json::{Value, json};

/// Codes `0..LEVELS` are values, `LEVELS` itself is "no value".
const LEVELS: u32 = (1 << 24) - 1;

/// Collects arrays into one byte string and describes where each went.
#[derive(Default)]
pub(crate) struct Packer {
    bytes: Vec<u8>,
    /// Length of a row where the vertices come in a grid, for the prediction.
    row: usize,
}

impl Packer {
    /// For vertices that come in rows of `row` (0 if they do not).
    pub(crate) fn with_rows_of(row: usize) -> Self {
        Self { bytes: Vec::new(), row }
    }

    /// Packs one float per entry; what is not finite comes back as NaN.
    pub(crate) fn floats(&mut self, values: impl Iterator<Item = f64> + Clone) -> Value {
        let finite = values.clone().filter(|v| v.is_finite());
        let (lo, hi) = finite.fold((f64::MAX, f64::MIN), |(lo, hi), v| (lo.min(v), hi.max(v)));
        let (lo, span) = if lo <= hi { (lo, hi - lo) } else { (0.0, 0.0) };
        let scale = if span > 0.0 { f64::from(LEVELS - 1) / span } else { 0.0 };
        let code = |v: f64| if v.is_finite() { ((v - lo) * scale).round() as u32 } else { LEVELS };
        let codes: Vec<u32> = values.map(code).collect();
        let shifts = [[1, 0, 0], [1, 1, 0], [self.row, 1, 1]];
        let layout = self.predicted(&codes, 3, &shifts);
        json!({"lo": lo, "span": span, "levels": LEVELS, "layout": layout})
    }

    /// Packs whole numbers.
    pub(crate) fn integers(&mut self, values: &[u32]) -> Value {
        let layout = self.predicted(values, 4, &[[1, 0, 0], [3, 0, 0], [6, 0, 0]]);
        json!({"layout": layout})
    }

    /// Packs the three coordinates one after the other.
    pub(crate) fn points(&mut self, points: &[DVec3]) -> Value {
        let mut coordinate = |i: usize| self.floats(points.iter().map(move |p| p[i]));
        Value::Array(vec![coordinate(0), coordinate(1), coordinate(2)])
    }

    /// Packs unit vectors by their octahedral coordinates, good to about 1e-7 radians.
    pub(crate) fn normals(&mut self, normals: &[DVec3]) -> Value {
        let mut coordinate = |i: usize| self.floats(normals.iter().map(move |n| octahedral(*n)[i]));
        Value::Array(vec![coordinate(0), coordinate(1)])
    }

    /// Deflated and base64 text of all bytes.
    pub(crate) fn into_text(self) -> String {
        let deflated = miniz_oxide::deflate::compress_to_vec_zlib(&self.bytes, 7);
        base64::engine::general_purpose::STANDARD.encode(deflated)
    }

    /// Writes the differences to the best of some predictions, one plane per byte.
    ///
    /// A shift `[a, b, c]` predicts entry `i` as `x[i - a]`, plus the step `x[i - b] - x[i - a - c]`
    /// where `b` is not 0: the same step as before (`[1, 1, 0]`... with `c = b`) or the
    /// parallelogram of a grid.
    fn predicted(&mut self, codes: &[u32], width: usize, shifts: &[[usize; 3]]) -> Value {
        let mask = if width == 3 { LEVELS } else { u32::MAX };
        let residuals = |shift: &[usize; 3]| -> Vec<u32> {
            let residual =
                |i: usize| zigzag(codes[i].wrapping_sub(predict(codes, i, *shift)), width);
            (0..codes.len()).map(|i| residual(i) & mask).collect()
        };
        let cost = |r: &Vec<u32>| -> u64 {
            r.iter().map(|v| u64::from(u32::BITS - v.leading_zeros())).sum()
        };
        let tried = shifts.iter().filter(|s| s[0] > 0).map(|s| (*s, residuals(s)));
        let best = tried.min_by_key(|(_, r)| cost(r));
        let (shift, residuals) = best.unwrap_or_default();
        let start = self.bytes.len();
        for plane in 0..width {
            self.bytes.extend(residuals.iter().map(|r| (r >> (8 * plane)) as u8));
        }
        json!({"at": start, "n": codes.len(), "width": width, "shift": shift})
    }
}

/// Value of entry `i` guessed from earlier ones; see [`Packer::predicted`].
fn predict(codes: &[u32], i: usize, [a, b, c]: [usize; 3]) -> u32 {
    let far = a + c.max(b);
    if i < a {
        return if i > 0 { codes[i - 1] } else { 0 };
    }
    if b == 0 || i < far {
        return codes[i - a];
    }
    codes[i - a].wrapping_add(codes[i - b]).wrapping_sub(codes[i - far])
}

/// Small numbers of either sign to small unsigned ones, within `width` bytes.
fn zigzag(difference: u32, width: usize) -> u32 {
    let unused = 32 - 8 * width as u32;
    let signed = ((difference << unused) as i32) >> unused;
    ((signed << 1) ^ (signed >> 31)) as u32
}

/// Coordinates in [-1, 1]² of a direction on the octahedron folded into a square.
fn octahedral(n: DVec3) -> [f64; 2] {
    let p = n / (n.x.abs() + n.y.abs() + n.z.abs());
    let fold = |a: f64, b: f64| (1.0 - b.abs()) * if a < 0.0 { -1.0 } else { 1.0 };
    if p.z < 0.0 { [fold(p.x, p.y), fold(p.y, p.x)] } else { [p.x, p.y] }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    /// The page's decoder, in Rust.
    fn unpack(bytes: &[u8], layout: &Value) -> Vec<u32> {
        let get = |key: &str| layout[key].as_u64().unwrap() as usize;
        let (at, n, width) = (get("at"), get("n"), get("width"));
        let shift = [0, 1, 2].map(|i| layout["shift"][i].as_u64().unwrap() as usize);
        let mask = if width == 3 { LEVELS } else { u32::MAX };
        let mut codes = Vec::new();
        for i in 0..n {
            let byte = |plane: usize| u32::from(bytes[at + plane * n + i]) << (8 * plane);
            let r = (0..width).map(byte).sum::<u32>();
            let difference = (r >> 1) ^ (r & 1).wrapping_neg();
            codes.push(predict(&codes, i, shift).wrapping_add(difference) & mask);
        }
        codes
    }

    #[test]
    fn floats_come_back_to_a_24_bit_step() {
        let mut packer = Packer::with_rows_of(7);
        let values: Vec<f64> = (0..63).map(|i| (f64::from(i) * 0.3).sin() * 40.0).collect();
        let about = packer.floats(values.iter().copied());
        let codes = unpack(&packer.bytes, &about["layout"]);
        let (lo, span) = (about["lo"].as_f64().unwrap(), about["span"].as_f64().unwrap());
        for (code, value) in codes.iter().zip(&values) {
            let got = lo + span * f64::from(*code) / f64::from(LEVELS - 1);
            assert!((got - value).abs() < 80.0 / f64::from(1 << 24));
        }
    }

    #[test]
    fn values_that_are_not_finite_get_their_own_code() {
        let mut packer = Packer::default();
        let about = packer.floats([1.0, f64::NAN, 2.0, f64::INFINITY, 1.0].into_iter());
        assert_eq!(unpack(&packer.bytes, &about["layout"]), [0, LEVELS, LEVELS - 1, LEVELS, 0]);
        let about = packer.floats([f64::NAN; 2].into_iter());
        assert_eq!(unpack(&packer.bytes, &about["layout"]), [LEVELS; 2]);
    }

    #[test]
    fn integers_come_back_exactly() {
        let values = Vec::from_iter((0..50_u32).map(|i| (i * i).wrapping_mul(777_777_777)));
        let mut packer = Packer::default();
        let about = packer.integers(&values);
        assert_eq!(unpack(&packer.bytes, &about["layout"]), values);
    }

    #[test]
    fn octahedral_coordinates_keep_the_direction() {
        for i in 0..200 {
            let (a, z) = (f64::from(i) * 2.4, f64::from(i) / 99.5 - 1.0);
            let r = (1.0_f64 - z * z).sqrt();
            let n = DVec3::new(r * a.cos(), r * a.sin(), z);
            let [x, y] = octahedral(n);
            // The decoding of `decode.js`.
            let z = 1.0 - x.abs() - y.abs();
            let t = (-z).max(0.0);
            let back = DVec3::new(x - t * sign(x), y - t * sign(y), z).normalize();
            assert!((back - n).length() < 1e-12);
        }
    }

    fn sign(x: f64) -> f64 {
        if x < 0.0 { -1.0 } else { 1.0 }
    }

    #[test]
    fn a_smooth_grid_takes_few_bytes() {
        let (rows, columns) = (100, 100);
        let f = |k: usize| {
            let (u, v) = ((k / columns) as f64 / 99.0, (k % columns) as f64 / 99.0);
            (3.0 * u).sin() * (2.0 * v).cos()
        };
        let mut packer = Packer::with_rows_of(columns);
        packer.floats((0..rows * columns).map(f));
        assert!(packer.into_text().len() < 2 * rows * columns);
    }

    proptest! {
        #[test]
        fn any_floats_come_back_to_a_step(
            values in prop::collection::vec(prop_oneof![9 => -1e6..1e6_f64, 1 => Just(f64::NAN)], 1..80),
            row in 0_usize..9,
        ) {
            let mut packer = Packer::with_rows_of(row);
            let about = packer.floats(values.iter().copied());
            let codes = unpack(&packer.bytes, &about["layout"]);
            let (lo, span) = (about["lo"].as_f64().unwrap(), about["span"].as_f64().unwrap());
            prop_assert_eq!(codes.len(), values.len());
            for (code, value) in codes.iter().zip(&values) {
                let got = lo + span * f64::from(*code) / f64::from(LEVELS - 1);
                let near = (got - value).abs() <= 0.51 * span / f64::from(LEVELS - 1);
                let kept = if value.is_nan() { *code == LEVELS } else { near };
                prop_assert!(kept);
            }
        }

        #[test]
        fn any_integers_come_back(values in prop::collection::vec(any::<u32>(), 0..80), row in 0_usize..9) {
            let mut packer = Packer::with_rows_of(row);
            let about = packer.integers(&values);
            prop_assert_eq!(unpack(&packer.bytes, &about["layout"]), values);
        }
    }
}
