//! The words of a Rust source that matter for paths: names and marks, without comments, literals
//! and test code.

/// Names, `::` and single marks of `text` in order; comments, literals and lifetimes are left out.
pub(crate) fn tokens(text: &str) -> Vec<&str> {
    scan(text, false)
}

/// As [`tokens`], with the string literals in their places.
pub(crate) fn tokens_and_texts(text: &str) -> Vec<&str> {
    scan(text, true)
}

fn scan(text: &str, with_texts: bool) -> Vec<&str> {
    let mut out = Vec::new();
    let mut rest = text;
    while let Some(first) = rest.chars().next() {
        let taken = if rest.starts_with("//") {
            rest.find('\n').unwrap_or(rest.len())
        } else if rest.starts_with("/*") {
            block_comment(rest)
        } else if let Some(length) = raw_string(rest) {
            out.extend(with_texts.then_some(&rest[..length]));
            length
        } else if first == '"' {
            let length = quoted(rest, '"');
            out.extend(with_texts.then_some(&rest[..length]));
            length
        } else if first == '\'' {
            character_or_lifetime(rest)
        } else if is_word(first) {
            let length = rest.find(|c| !is_word(c)).unwrap_or(rest.len());
            if !first.is_ascii_digit() {
                out.push(&rest[..length]);
            }
            length
        } else if rest.starts_with("::") {
            out.push(&rest[..2]);
            2
        } else {
            let length = first.len_utf8();
            if !first.is_whitespace() {
                out.push(&rest[..length]);
            }
            length
        };
        rest = &rest[taken..];
    }
    out
}

/// Tokens without the items that are compiled for tests only, and the names of the modules among
/// these that have files of their own.
pub(crate) fn without_tests<'a>(tokens: &[&'a str]) -> (Vec<&'a str>, Vec<&'a str>) {
    let (mut kept, mut files) = (Vec::new(), Vec::new());
    let mut at = 0;
    while at < tokens.len() {
        if !is_test_attribute(&tokens[at..]) {
            kept.push(tokens[at]);
            at += 1;
            continue;
        }
        while tokens[at..].starts_with(&["#", "["]) {
            at += 1 + group(&tokens[at + 1..]);
        }
        let item = &tokens[at..];
        if let Some(name) = item.iter().position(|t| *t == "mod").and_then(|m| item.get(m + 1))
            && item.iter().find(|t| [";", "{"].contains(t)) == Some(&";")
        {
            files.push(*name);
        }
        while at < tokens.len() {
            let length = group(&tokens[at..]);
            let last = tokens[at + length - 1];
            at += length;
            if last == ";" || last == "}" {
                break;
            }
        }
    }
    (kept, files)
}

/// Whether the tokens begin with `#[cfg(test)]`, alone or among other conditions.
fn is_test_attribute(tokens: &[&str]) -> bool {
    tokens.starts_with(&["#", "[", "cfg", "("]) && {
        let condition = &tokens[3..3 + group(&tokens[3..])];
        condition.contains(&"test") && !condition.contains(&"not")
    }
}

/// Number of tokens of the bracketed group that the tokens begin with; 1 if they begin with none.
fn group(tokens: &[&str]) -> usize {
    let mut depth = 0_usize;
    for (k, token) in tokens.iter().enumerate() {
        match *token {
            "(" | "[" | "{" => depth += 1,
            ")" | "]" | "}" => depth = depth.saturating_sub(1),
            _ => {}
        }
        if depth == 0 {
            return k + 1;
        }
    }
    tokens.len()
}

fn is_word(c: char) -> bool {
    c.is_alphanumeric() || c == '_'
}

fn block_comment(text: &str) -> usize {
    let mut depth = 0_usize;
    let mut at = 0;
    while at < text.len() {
        let rest = &text[at..];
        if rest.starts_with("/*") {
            depth += 1;
            at += 2;
        } else if rest.starts_with("*/") {
            depth -= 1;
            at += 2;
            if depth == 0 {
                break;
            }
        } else {
            at += rest.chars().next().map_or(1, char::len_utf8);
        }
    }
    at
}

/// Length of the raw string that `text` begins with.
fn raw_string(text: &str) -> Option<usize> {
    let start = ["r", "br", "cr"].into_iter().find(|prefix| {
        let rest = text.strip_prefix(prefix);
        rest.is_some_and(|r| r.trim_start_matches('#').starts_with('"'))
    })?;
    let hashes = text[start.len()..].find('"')?;
    let end = format!("\"{}", "#".repeat(hashes));
    let body = start.len() + hashes + 1;
    Some(text[body..].find(&end).map_or(text.len(), |k| body + k + end.len()))
}

/// Length of a literal between two quotes.
fn quoted(text: &str, quote: char) -> usize {
    let mut escaped = false;
    for (at, c) in text.char_indices().skip(1) {
        match c {
            _ if escaped => escaped = false,
            '\\' => escaped = true,
            c if c == quote => return at + c.len_utf8(),
            _ => {}
        }
    }
    text.len()
}

fn character_or_lifetime(text: &str) -> usize {
    let mut chars = text.chars().skip(1);
    match (chars.next(), chars.next()) {
        (Some('\\'), _) | (Some(_), Some('\'')) => quoted(text, '\''),
        _ => 1 + text[1..].find(|c| !is_word(c)).unwrap_or(text.len() - 1),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn comments_literals_and_lifetimes_are_left_out() {
        let text = r####"
            /// crate::a::B
            fn f<'a>(x: &'a str) -> char { /* crate::c /* nested */ */
                g("crate::d \" still", r#"crate::e "quoted""#, b"crate::f", 1.5e3, '\'', '"', 'ü');
                crate::h::i()
            }
        "####;
        let names: Vec<&str> =
            tokens(text).into_iter().filter(|t| t.starts_with(char::is_alphabetic)).collect();
        assert_eq!(names, ["fn", "f", "x", "str", "char", "g", "b", "crate", "h", "i"]);
    }

    #[test]
    fn test_code_is_left_out() {
        let text = "use a::b; #[cfg(test)] mod checks; #[cfg(all(test, unix))] #[allow(x)] mod tests \
                    { use c::d; fn e() { f::g(); } } #[cfg(not(test))] fn h() {}";
        let all = tokens(text);
        let (kept, files) = without_tests(&all);
        assert_eq!(files, ["checks"]);
        let kept = kept.concat();
        assert_eq!(kept, "usea::b;#[cfg(not(test))]fnh(){}");
    }
}
