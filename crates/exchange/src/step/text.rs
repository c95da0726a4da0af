//! Texts of STEP files: plain ASCII with control directives (ISO 10303-21, section 6.4.3).

use std::borrow::Cow;

/// The characters between the quotes, as people read them; faulty directives are kept as they are.
pub(super) fn decode(raw: &[u8]) -> String {
    // Some programs write the bytes of ISO 8859-1 as they are, which the standard forbids.
    let raw = match std::str::from_utf8(raw) {
        Ok(text) => Cow::Borrowed(text),
        Err(_) => raw.iter().map(|b| char::from(*b)).collect(),
    };
    let mut text = String::with_capacity(raw.len());
    let mut rest = raw.as_ref();
    while let Some(c) = rest.chars().next() {
        if let Some(after) = rest.strip_prefix("''") {
            text.push('\'');
            rest = after;
        } else if let Some(after) = rest.strip_prefix("\\\\") {
            text.push('\\');
            rest = after;
        } else if let Some((decoded, after)) = directive(rest) {
            text.push_str(&decoded);
            rest = after;
        } else {
            text.push(c);
            rest = &rest[c.len_utf8()..];
        }
    }
    text
}

fn directive(rest: &str) -> Option<(String, &str)> {
    if let Some(after) = rest.strip_prefix("\\X2\\") {
        let (hex, after) = after.split_once("\\X0\\")?;
        let units: Option<Vec<u16>> =
            groups(hex, 4)?.map(|h| u16::from_str_radix(h, 16).ok()).collect();
        return Some((String::from_utf16(&units?).ok()?, after));
    }
    if let Some(after) = rest.strip_prefix("\\X4\\") {
        let (hex, after) = after.split_once("\\X0\\")?;
        let chars: Option<String> = groups(hex, 8)?
            .map(|h| u32::from_str_radix(h, 16).ok().and_then(char::from_u32))
            .collect();
        return Some((chars?, after));
    }
    if let Some(after) = rest.strip_prefix("\\X\\") {
        let code = u8::from_str_radix(after.get(..2)?, 16).ok()?;
        return Some((char::from(code).to_string(), &after[2..]));
    }
    let after = rest.strip_prefix("\\S\\")?;
    let c = after.chars().next().filter(char::is_ascii)?;
    // The upper half of ISO 8859-1.
    Some((char::from(c as u8 | 0x80).to_string(), &after[1..]))
}

fn groups(hex: &str, size: usize) -> Option<impl Iterator<Item = &str>> {
    let whole = hex.is_ascii() && hex.len().is_multiple_of(size);
    whole.then(|| (0..hex.len() / size).map(move |k| &hex[k * size..(k + 1) * size]))
}

#[cfg(test)]
mod tests {
    use super::decode;

    #[test]
    fn directives_are_decoded_and_faulty_ones_kept() {
        assert_eq!(decode(b"a''b\\\\c"), "a'b\\c");
        assert_eq!(decode(b"Dach \\X2\\00E9D83DDE00\\X0\\!"), "Dach é😀!");
        assert_eq!(decode(b"\\X4\\0001F600\\X0\\"), "😀");
        assert_eq!(decode(b"\\X\\E9\\S\\i"), "éé");
        assert_eq!(decode(b"Dach \xe4\xdf"), "Dach äß");
        assert_eq!(decode("Dach äß".as_bytes()), "Dach äß");
        for bad in ["\\X2\\00", "\\X2\\0\\X0\\", "\\X\\G", "\\S", "\\X4\\FFFFFFFF\\X0\\"] {
            assert_eq!(decode(bad.as_bytes()), bad);
        }
    }
}
