//! Text made harmless for the places it is written to.

/// Text made harmless for the content and the attributes of HTML and SVG.
///
/// What no XML document may hold, such as a NUL or an escape character in the name of a file,
/// becomes U+FFFD, since a reader of SVG refuses the whole picture for it.
pub(crate) fn escape(text: &str) -> String {
    let mut safe = String::with_capacity(text.len());
    for c in text.chars() {
        match c {
            '&' => safe.push_str("&amp;"),
            '<' => safe.push_str("&lt;"),
            '>' => safe.push_str("&gt;"),
            '"' => safe.push_str("&quot;"),
            '\'' => safe.push_str("&#39;"),
            // A reader of XML would make a line feed or a blank of them.
            '\t' => safe.push_str("&#9;"),
            '\n' => safe.push_str("&#10;"),
            '\r' => safe.push_str("&#13;"),
            // XML 1.0, production 2, `Char`.
            ' '..='\u{fffd}' | '\u{10000}'.. => safe.push(c),
            _ => safe.push(char::REPLACEMENT_CHARACTER),
        }
    }
    safe
}

/// JSON that no text inside can end early, for a `<script>` element.
pub(crate) fn escape_script(json: &serde_json::Value) -> String {
    json.to_string().replace('<', "\\u003c")
}

/// The longest word in the name of a file; systems allow 255 bytes for the whole name.
const LONGEST_WORD: usize = 80;

/// Lower-case letters, digits and single hyphens, for names of files.
pub(crate) fn file_word(text: &str) -> String {
    let mut word = String::new();
    for c in text.chars().flat_map(char::to_lowercase) {
        if word.len() == LONGEST_WORD {
            break;
        }
        if c.is_ascii_alphanumeric() {
            word.push(c);
        } else if !word.is_empty() && !word.ends_with('-') {
            word.push('-');
        }
    }
    let word = word.trim_end_matches('-');
    if word.is_empty() { "view".to_owned() } else { word.to_owned() }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    #[test]
    fn file_words_are_plain() {
        assert_eq!(file_word("After (25x18)"), "after-25x18");
        assert_eq!(file_word("κ"), "view");
        assert_eq!(file_word(&"long ".repeat(100)).len(), LONGEST_WORD - 1);
    }

    #[test]
    fn scripts_cannot_be_ended_by_their_text() {
        let text = escape_script(&serde_json::json!({"a": "</script><!--"}));
        assert_eq!(text, r#"{"a":"\u003c/script>\u003c!--"}"#);
    }

    proptest! {
        #[test]
        fn escaped_text_comes_back(text in prop::collection::vec(any::<char>(), 0..40)) {
            let text: String = text.into_iter().collect();
            let safe = escape(&text);
            prop_assert!(!safe.contains(['<', '>', '"', '\'']));
            let document = format!("<a b=\"{safe}\">{safe}</a>");
            let document = roxmltree::Document::parse(&document).unwrap();
            let root = document.root_element();
            // What XML cannot hold has become a sign of its own.
            let shown = |c: char| match c {
                '\0'..='\u{8}' | '\u{b}' | '\u{c}' | '\u{e}'..='\u{1f}' => '\u{fffd}',
                '\u{fffe}' | '\u{ffff}' => '\u{fffd}',
                c => c,
            };
            let want: String = text.chars().map(shown).collect();
            prop_assert_eq!(root.text().unwrap_or_default(), &want);
            prop_assert_eq!(root.attribute("b").unwrap(), want);
        }

        #[test]
        fn scripts_hold_any_text(text in ".*") {
            let value = serde_json::Value::String(text);
            let script = escape_script(&value);
            prop_assert!(!script.contains('<'));
            prop_assert_eq!(serde_json::from_str::<serde_json::Value>(&script).unwrap(), value);
        }

        #[test]
        fn file_words_hold_nothing_special(text in ".*") {
            let word = file_word(&text);
            prop_assert!(!word.is_empty() && word.len() <= LONGEST_WORD);
            prop_assert!(!word.starts_with('-') && !word.ends_with('-') && !word.contains("--"));
            prop_assert!(word.bytes().all(|b| b.is_ascii_lowercase() || b.is_ascii_digit() || b == b'-'));
        }
    }
}
