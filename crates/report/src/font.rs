//! A small stroke font for pictures: every letter is a few polylines on a grid.
//!
//! Each glyph is written as pairs of digits `xy`: x from 0 to 4, y from 0 (top of capitals) over 6
//! (baseline) to 8 (descenders); a space lifts the pen. Lower-case letters are 4 units high.

/// Room between two letters, in grid units.
const GAP: f64 = 1.7;
/// Width of a space, in grid units.
const SPACE: f64 = 1.6;
/// Height of a capital letter in grid units.
pub(crate) const CAPITAL: f64 = 6.0;

/// Width of a line of text with capitals `height` high.
pub(crate) fn text_width(text: &str, height: f64) -> f64 {
    text.chars().map(advance).sum::<f64>() * height / CAPITAL
}

/// The strokes of a line of text whose first letter's upper left corner is at `corner`.
pub(crate) fn text_strokes(text: &str, corner: [f64; 2], height: f64) -> Vec<Vec<[f64; 2]>> {
    let unit = height / CAPITAL;
    let mut lines = Vec::new();
    let mut x = corner[0];
    for c in text.chars() {
        let Glyph { strokes, scale, lift, left, .. } = glyph(c);
        for stroke in strokes.split_ascii_whitespace() {
            let at = |pair: &[u8]| {
                let [a, b] = [pair[0], pair[1]].map(|digit| f64::from(digit - b'0'));
                [x + unit * scale * (a - left), corner[1] + unit * (scale * b + lift)]
            };
            lines.push(stroke.as_bytes().chunks_exact(2).map(at).collect());
        }
        x += unit * advance(c);
    }
    lines
}

/// From the left edge of a letter to that of the next, in grid units.
fn advance(c: char) -> f64 {
    let glyph = glyph(c);
    glyph.scale * (glyph.right - glyph.left) + GAP
}

/// How a character is drawn.
struct Glyph {
    strokes: &'static str,
    scale: f64,
    lift: f64,
    left: f64,
    right: f64,
}

/// A raised or lowered character: the plain one and how far down it starts.
fn small(c: char) -> Option<(char, f64)> {
    let raised = "⁰¹²³⁴⁵⁶⁷⁸⁹⁻".chars().position(|r| r == c).map(|i| (i, -0.6));
    let lowered = "₀₁₂₃₄₅₆₇₈₉".chars().position(|r| r == c).map(|i| (i, 3.4));
    let (digit, lift) = raised.or(lowered)?;
    "0123456789-".chars().nth(digit).map(|plain| (plain, lift))
}

/// The glyph of a character; an unknown one is a box.
fn glyph(c: char) -> Glyph {
    let (plain, scale, lift) = small(c).map_or((c, 1.0, 0.0), |(plain, lift)| (plain, 0.58, lift));
    let strokes = strokes(plain);
    let across = || strokes.split_ascii_whitespace().flat_map(|s| s.bytes().step_by(2));
    let edge = |x: Option<u8>| f64::from(x.unwrap_or(b'0') - b'0');
    let (left, right) = match c {
        ' ' => (0.0, SPACE),
        // Digits of one width stand below one another.
        '0'..='9' => (0.0, 4.0),
        _ => (edge(across().min()), edge(across().max())),
    };
    Glyph { strokes, scale, lift, left, right }
}

fn strokes(c: char) -> &'static str {
    match c {
        ' ' => "",
        '0' => "103041453616050110",
        '1' => "112026 1636",
        '2' => "01103041420646",
        '3' => "0110304142334445361605 1333",
        '4' => "36300444",
        '5' => "400002324345361605",
        '6' => "413010010516364544331304",
        '7' => "004016",
        '8' => "103041423313020110 1304051636454433",
        '9' => "051636454130100102133342",
        'A' => "0602204246 0444",
        'B' => "00063645443303 3342413000",
        'C' => "4130100105163645",
        'D' => "00062644422000",
        'E' => "40000646 0333",
        'F' => "400006 0333",
        'G' => "41301001051636454323",
        'H' => "0006 4046 0343",
        'I' => "1030 2026 1636",
        'J' => "4045361605",
        'K' => "0006 400346",
        'L' => "000646",
        'M' => "0600234046",
        'N' => "06004640",
        'O' => "103041453616050110",
        'P' => "06003041423303",
        'Q' => "103041453616050110 2446",
        'R' => "06003041423303 2346",
        'S' => "413010010213334445361605",
        'T' => "0040 2026",
        'U' => "000516364540",
        'V' => "002640",
        'W' => "0016233640",
        'X' => "0046 4006",
        'Y' => "002340 2326",
        'Z' => "00400646",
        'a' => "12324346 441405163645",
        'b' => "0006 0312324345361605",
        'c' => "4332120305163645",
        'd' => "4046 4332120305163645",
        'e' => "04444332120305163645",
        'f' => "40302126 1232",
        'g' => "4247381807 4332120304153544",
        'h' => "0006 0312324346",
        'i' => "1216 1010",
        'j' => "22271808 2020",
        'k' => "0006 320436",
        'l' => "1016",
        'm' => "0206 03122326 23324346",
        'n' => "0206 0312324346",
        'o' => "123243453616050312",
        'p' => "0208 0312324345361605",
        'q' => "4248 4332120305163645",
        'r' => "0206 041232",
        's' => "43321203143445361605",
        't' => "10152636 0232",
        'u' => "0205163645 4246",
        'v' => "022642",
        'w' => "0216243642",
        'x' => "0246 4206",
        'y' => "0226 4208",
        'z' => "02420646",
        'κ' => "0206 320436",
        '-' => "1333",
        '−' => "0343",
        '–' => "0343",
        '+' => "0343 2125",
        '.' => "1616",
        ',' => "1607",
        ':' => "1313 1616",
        '·' => "1313",
        '/' => "0640",
        '(' => "20111526",
        ')' => "00111506",
        '[' => "20101626",
        ']' => "00101606",
        '%' => "0640 0010110100 3545463635",
        '=' => "0242 0444",
        '°' => "1020211110",
        '|' => "1018",
        '\'' => "1012",
        '!' => "1014 1616",
        '_' => "0747",
        _ => "0040460600",
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn labels_of_reports_have_all_their_letters() {
        let unknown = strokes('\u{1}');
        let labels = "principal curvature κ₁ [1/mm²] −3.5·10⁻⁴ (95 %) from: 0.1°, x=2 + y_3";
        for c in labels.chars() {
            assert_ne!(glyph(c).strokes, unknown, "{c}");
        }
        assert_eq!(glyph('☃').strokes, unknown);
    }

    #[test]
    fn strokes_stay_within_the_width() {
        let text = "Gaussian curvature K";
        let width = text_width(text, 12.0);
        for [x, y] in text_strokes(text, [5.0, 7.0], 12.0).into_iter().flatten() {
            assert!((5.0..=5.0 + width).contains(&x) && (7.0..=7.0 + 16.0).contains(&y));
        }
    }
}
