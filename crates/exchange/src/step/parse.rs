//! The text of a STEP file as an index of instances, and a cursor that reads one of them.
//!
//! Nothing is kept as a tree: the index has 16 bytes an instance, and what is asked for is read
//! from the text. Nesting is checked once, when the index is made.

use crate::error::{ReadError, clip};
use crate::ron_text::MAX_DEPTH;

/// One `#id=…;`, by the position of its body.
#[derive(Clone, Copy, Debug)]
pub(super) struct Instance {
    pub(super) id: u64,
    /// First byte after the `=`.
    pub(super) body: usize,
}

/// All instances of a file.
#[derive(Debug)]
pub(super) struct Index<'a> {
    pub(super) text: &'a [u8],
    /// Sorted by id.
    by_id: Vec<Instance>,
}

impl<'a> Index<'a> {
    /// Finds every instance and checks that the file is whole.
    pub(super) fn new(text: &'a [u8]) -> Result<Self, ReadError> {
        let mut cursor = Cursor { text, at: 0 };
        cursor.space();
        if !cursor.take(b"ISO-10303-21") {
            let mend = "export the file again as STEP (ISO 10303-21)";
            return Err(cursor.error("the file does not begin with ISO-10303-21", mend));
        }
        let mut by_id = Vec::new();
        let mut in_data = false;
        let mut ended = false;
        loop {
            cursor.space();
            let Some(next) = cursor.peek() else { break };
            if next == b'#' && in_data {
                by_id.push(cursor.instance()?);
                continue;
            }
            let start = cursor.at;
            cursor.statement()?;
            let statement = &text[start..cursor.at];
            if statement.starts_with(b"DATA") {
                in_data = true;
            } else if statement.starts_with(b"ENDSEC") {
                in_data = false;
            } else if statement.starts_with(b"END-ISO-10303-21") {
                ended = true;
                break;
            } else if in_data {
                let word = clip(&String::from_utf8_lossy(&statement[..statement.len().min(100)]));
                cursor.at = start;
                return Err(cursor.error(
                    format!("`{word}` is not an instance of the form #1=…;"),
                    "remove it or export the file again",
                ));
            }
        }
        if !ended {
            let what = "the file ends before END-ISO-10303-21";
            return Err(cursor.error(what, "it is truncated; copy or export it again"));
        }
        by_id.sort_by_key(|i: &Instance| i.id);
        if let Some(pair) = by_id.windows(2).find(|pair| pair[0].id == pair[1].id) {
            let at = Cursor { text, at: pair[0].body.max(pair[1].body) };
            let what = format!("#{} is defined twice", pair[0].id);
            return Err(at.error(what, "give each instance a number of its own"));
        }
        Ok(Self { text, by_id })
    }

    /// Instances in the order of the file.
    pub(super) fn in_file_order(&self) -> Vec<Instance> {
        let mut all = self.by_id.clone();
        all.sort_by_key(|i| i.body);
        all
    }

    /// The position of an instance in the order of ids.
    pub(super) fn position(&self, id: u64) -> Option<usize> {
        self.by_id.binary_search_by_key(&id, |i| i.id).ok()
    }

    /// Instances in the order of ids.
    pub(super) fn by_id(&self) -> &[Instance] {
        &self.by_id
    }

    /// A cursor at the body of `#id`, wanted by `from`.
    pub(super) fn open(&self, id: u64, from: &Cursor<'a>) -> Result<Cursor<'a>, ReadError> {
        match self.position(id) {
            Some(k) => Ok(self.at(self.by_id[k])),
            None => {
                let what = format!("#{id} is named here and defined nowhere");
                Err(from.error(what, "the file is incomplete; export it again"))
            }
        }
    }

    /// A cursor at the body of an instance.
    pub(super) fn at(&self, instance: Instance) -> Cursor<'a> {
        Cursor { text: self.text, at: instance.body }
    }

    /// The keyword of a simple instance, or `(` of a complex one; empty if there is none.
    pub(super) fn keyword(&self, instance: Instance) -> &'a [u8] {
        let mut cursor = self.at(instance);
        cursor.space();
        if cursor.peek() == Some(b'(') { b"(" } else { cursor.word() }
    }
}

/// Bytes that a statement is made of: brackets, quotes, its end, and what a comment begins with.
const MEANT: [bool; 256] = table(b"();'\"/");
/// Bytes at which a search for references stops.
const STOPS: [bool; 256] = table(b"#;'\"/");

const fn table(bytes: &[u8]) -> [bool; 256] {
    let mut table = [false; 256];
    let mut k = 0;
    while k < bytes.len() {
        table[bytes[k] as usize] = true;
        k += 1;
    }
    table
}

/// A place in the text.
#[derive(Clone, Debug)]
pub(super) struct Cursor<'a> {
    text: &'a [u8],
    at: usize,
}

impl<'a> Cursor<'a> {
    pub(super) fn line(&self) -> usize {
        let end = self.at.min(self.text.len());
        1 + self.text[..end].iter().filter(|b| **b == b'\n').count()
    }

    pub(super) fn error(&self, what: impl Into<String>, mend: impl Into<String>) -> ReadError {
        ReadError::text(self.line(), what, mend)
    }

    fn unexpected(&self, wanted: &str) -> ReadError {
        let rest = &self.text[self.at.min(self.text.len())..];
        let end = rest.iter().position(|b| b",()\n;".contains(b)).unwrap_or(rest.len()).max(1);
        let found = String::from_utf8_lossy(&rest[..end.min(rest.len()).min(100)]).into_owned();
        let what = format!("expected {wanted}, found `{}`", clip(&found));
        self.error(what, "export the file again or correct this line")
    }

    fn peek(&self) -> Option<u8> {
        self.text.get(self.at).copied()
    }

    /// Moves to the next token, so that an error names its line.
    pub(super) fn skip_blanks(&mut self) {
        self.space();
    }

    /// Skips blanks and comments.
    fn space(&mut self) {
        // Most tokens follow one another.
        if self.peek().is_some_and(|b| b > b' ' && b != b'/') {
            return;
        }
        loop {
            while self.peek().is_some_and(|b| b.is_ascii_whitespace()) {
                self.at += 1;
            }
            if !self.text[self.at..].starts_with(b"/*") {
                return;
            }
            let rest = &self.text[self.at + 2..];
            let end = rest.windows(2).position(|pair| pair == b"*/").map_or(rest.len(), |k| k + 2);
            self.at += 2 + end;
        }
    }

    fn take(&mut self, token: &[u8]) -> bool {
        let found = self.text[self.at..].starts_with(token);
        if found {
            self.at += token.len();
        }
        found
    }

    fn expect(&mut self, token: u8) -> Result<(), ReadError> {
        self.space();
        if self.take(&[token]) {
            return Ok(());
        }
        Err(self.unexpected(&format!("`{}`", char::from(token))))
    }

    /// Letters, digits, `_` and `-`.
    fn word(&mut self) -> &'a [u8] {
        let start = self.at;
        while self.peek().is_some_and(|b| b.is_ascii_alphanumeric() || b"_-".contains(&b)) {
            self.at += 1;
        }
        &self.text[start..self.at]
    }

    /// Goes past the `;` that ends a statement, checking brackets and strings on the way.
    fn statement(&mut self) -> Result<(), ReadError> {
        let start = self.clone();
        let mut depth = 0_usize;
        loop {
            // Most bytes of a file are digits, and mean nothing here.
            let rest = &self.text[self.at..];
            let Some(ordinary) = rest.iter().position(|b| MEANT[usize::from(*b)]) else {
                let what = "the statement that begins here has no `;`";
                return Err(start.error(what, "the file is truncated; copy or export it again"));
            };
            self.at += ordinary;
            let b = rest[ordinary];
            match b {
                b'/' if rest[ordinary..].starts_with(b"/*") => self.space(),
                b'\'' | b'"' => self.skip_quoted(b)?,
                b';' if depth == 0 => {
                    self.at += 1;
                    return Ok(());
                }
                b';' => {
                    let what = "a `;` inside brackets";
                    return Err(self.error(what, "close the brackets before it"));
                }
                b'(' => {
                    depth += 1;
                    if depth > MAX_DEPTH {
                        let what = format!("the nesting is deeper than {MAX_DEPTH}");
                        return Err(self.error(what, "no surface needs that; export it again"));
                    }
                    self.at += 1;
                }
                b')' if depth == 0 => {
                    return Err(self.error("a `)` without its `(`", "remove it"));
                }
                b')' => {
                    depth -= 1;
                    self.at += 1;
                }
                _ => self.at += 1,
            }
        }
    }

    fn skip_quoted(&mut self, quote: u8) -> Result<(), ReadError> {
        let start = self.clone();
        self.at += 1;
        loop {
            match self.text[self.at..].iter().position(|b| *b == quote) {
                None => {
                    let what = "the text that begins here has no closing quote";
                    return Err(start.error(what, "the file is truncated; export it again"));
                }
                Some(k) => self.at += k + 1,
            }
            // A doubled quote stands for itself.
            if self.peek() != Some(quote) {
                return Ok(());
            }
            self.at += 1;
        }
    }

    fn instance(&mut self) -> Result<Instance, ReadError> {
        let id = self.reference()?;
        self.expect(b'=')?;
        let body = self.at;
        self.statement()?;
        Ok(Instance { id, body })
    }

    /// Every `#id` in the statement at the cursor.
    pub(super) fn references(mut self, mut visit: impl FnMut(u64)) {
        loop {
            let rest = &self.text[self.at..];
            let Some(ordinary) = rest.iter().position(|b| STOPS[usize::from(*b)]) else { return };
            self.at += ordinary;
            match rest[ordinary] {
                b';' => return,
                quote @ (b'\'' | b'"') => {
                    // Checked when the index was made.
                    if self.skip_quoted(quote).is_err() {
                        return;
                    }
                }
                b'#' => match self.try_reference() {
                    Some(id) => visit(id),
                    None => self.at += 1,
                },
                b'/' if rest[ordinary..].starts_with(b"/*") => self.space(),
                _ => self.at += 1,
            }
        }
    }

    /// Looks for the record `keyword` of the instance at the cursor, simple or complex, and stands
    /// behind its opening bracket.
    pub(super) fn record(&self, keyword: &str) -> Option<Self> {
        let mut cursor = self.clone();
        cursor.space();
        let complex = cursor.take(b"(");
        loop {
            cursor.space();
            let word = cursor.word();
            cursor.space();
            if word.is_empty() || !cursor.take(b"(") {
                return None;
            }
            if word.eq_ignore_ascii_case(keyword.as_bytes()) {
                return Some(cursor);
            }
            if !complex {
                return None;
            }
            cursor.skip_to_close();
        }
    }

    /// Goes past the bracket that closes the one just opened.
    fn skip_to_close(&mut self) {
        let mut depth = 1_usize;
        while depth > 0 {
            self.space();
            match self.peek() {
                None | Some(b';') => return,
                Some(quote @ (b'\'' | b'"')) => {
                    if self.skip_quoted(quote).is_err() {
                        return;
                    }
                }
                Some(b) => {
                    depth = depth + usize::from(b == b'(') - usize::from(b == b')');
                    self.at += 1;
                }
            }
        }
    }

    /// The comma before the next argument.
    pub(super) fn comma(&mut self) -> Result<(), ReadError> {
        self.expect(b',')
    }

    /// Goes past one argument of any kind.
    pub(super) fn skip_value(&mut self) -> Result<(), ReadError> {
        self.space();
        loop {
            self.space();
            match self.peek() {
                None | Some(b',' | b')' | b';') => return Ok(()),
                Some(quote @ (b'\'' | b'"')) => self.skip_quoted(quote)?,
                Some(b'(') => {
                    self.at += 1;
                    self.skip_to_close();
                }
                Some(_) => self.at += 1,
            }
        }
    }

    /// Goes past `n` arguments and the commas behind them.
    pub(super) fn skip_arguments(&mut self, n: usize) -> Result<(), ReadError> {
        for _ in 0..n {
            self.skip_value()?;
            self.comma()?;
        }
        Ok(())
    }

    /// A reference, or nothing for `$` and `*`.
    pub(super) fn optional_reference(&mut self) -> Result<Option<u64>, ReadError> {
        self.space();
        if self.take(b"$") || self.take(b"*") {
            return Ok(None);
        }
        self.reference().map(Some)
    }

    /// A list of references; `$` is an empty one.
    pub(super) fn reference_list(&mut self) -> Result<Vec<u64>, ReadError> {
        let mut ids = Vec::new();
        self.space();
        if self.take(b"$") {
            return Ok(ids);
        }
        self.list(|c| {
            ids.push(c.reference()?);
            Ok(())
        })?;
        Ok(ids)
    }

    /// A list of numbers.
    pub(super) fn real_list(&mut self) -> Result<Vec<f64>, ReadError> {
        let mut values = Vec::new();
        self.list(|c| {
            values.push(c.real()?);
            Ok(())
        })?;
        Ok(values)
    }

    /// A number, bare or with its type as in `LENGTH_MEASURE(25.4)`.
    pub(super) fn measure(&mut self) -> Result<f64, ReadError> {
        self.space();
        let mut typed = self.clone();
        let word = typed.word();
        typed.space();
        if word.first().is_some_and(u8::is_ascii_alphabetic) && typed.take(b"(") {
            let value = typed.real()?;
            typed.expect(b')')?;
            *self = typed;
            return Ok(value);
        }
        self.real()
    }

    /// Whether a reference comes next.
    pub(super) fn at_reference(&mut self) -> bool {
        self.space();
        self.peek() == Some(b'#')
    }

    pub(super) fn reference(&mut self) -> Result<u64, ReadError> {
        self.space();
        self.try_reference().ok_or_else(|| self.unexpected("a reference such as #12"))
    }

    fn try_reference(&mut self) -> Option<u64> {
        let start = self.at;
        let digits = if self.take(b"#") { self.word() } else { b"" };
        let id = std::str::from_utf8(digits).ok().and_then(|d| d.parse().ok());
        if id.is_none() {
            self.at = start;
        }
        id
    }

    pub(super) fn real(&mut self) -> Result<f64, ReadError> {
        self.try_real().ok_or_else(|| self.unexpected("a finite number"))
    }

    fn try_real(&mut self) -> Option<f64> {
        self.space();
        let start = self.at;
        while self.peek().is_some_and(|b| b.is_ascii_alphanumeric() || b"+-.".contains(&b)) {
            self.at += 1;
        }
        let word = std::str::from_utf8(&self.text[start..self.at]).unwrap_or_default();
        let value = word.parse::<f64>().ok().filter(|x| x.is_finite());
        if value.is_none() {
            self.at = start;
        }
        value
    }

    /// A name and three numbers in brackets: the arguments of a point in space. Unlike the other
    /// readers this one makes no message, which costs a walk through the file to count lines.
    pub(super) fn try_point(&mut self) -> Option<[f64; 3]> {
        self.skip_value().ok()?;
        let mut values = [0.0; 3];
        for (k, value) in values.iter_mut().enumerate() {
            self.space();
            let before: &[u8] = if k == 0 { b"," } else { b"" };
            if !self.take(before) {
                return None;
            }
            self.space();
            if !self.take(if k == 0 { b"(" } else { b"," }) {
                return None;
            }
            *value = self.try_real()?;
        }
        self.space();
        self.take(b")").then_some(values)
    }

    pub(super) fn integer(&mut self) -> Result<i64, ReadError> {
        self.space();
        let start = self.at;
        while self.peek().is_some_and(|b| b.is_ascii_digit() || b"+-".contains(&b)) {
            self.at += 1;
        }
        let word = std::str::from_utf8(&self.text[start..self.at]).unwrap_or_default();
        word.parse().map_err(|_| {
            self.at = start;
            self.unexpected("a whole number")
        })
    }

    /// `.T.` or not.
    pub(super) fn is_true(&mut self) -> Result<bool, ReadError> {
        self.space();
        let start = self.at;
        self.skip_value()?;
        Ok(self.text[start..self.at].trim_ascii_end().eq_ignore_ascii_case(b".T."))
    }

    /// The word between two dots, such as `MILLI`; empty for `$`.
    pub(super) fn enumeration(&mut self) -> Result<&'a [u8], ReadError> {
        self.space();
        if self.take(b"$") || self.take(b"*") {
            return Ok(b"");
        }
        self.expect(b'.')?;
        let word = self.word();
        self.expect(b'.')?;
        Ok(word)
    }

    /// A text, decoded; empty for `$`.
    pub(super) fn string(&mut self) -> Result<String, ReadError> {
        self.space();
        if self.take(b"$") || self.take(b"*") {
            return Ok(String::new());
        }
        if self.peek() != Some(b'\'') {
            return Err(self.unexpected("a text in quotes"));
        }
        let start = self.at + 1;
        self.skip_quoted(b'\'')?;
        Ok(super::text::decode(&self.text[start..self.at - 1]))
    }

    /// A bracketed list.
    pub(super) fn list(
        &mut self,
        mut item: impl FnMut(&mut Self) -> Result<(), ReadError>,
    ) -> Result<(), ReadError> {
        self.expect(b'(')?;
        self.space();
        if self.take(b")") {
            return Ok(());
        }
        loop {
            item(self)?;
            self.space();
            if self.take(b")") {
                return Ok(());
            }
            self.comma()?;
        }
    }

    /// A list of lists of equal length, row by row, with that length.
    pub(super) fn grid<T>(
        &mut self,
        mut item: impl FnMut(&mut Self) -> Result<T, ReadError>,
    ) -> Result<(Vec<T>, usize), ReadError> {
        let (mut all, mut columns, mut rows) = (Vec::new(), 0, 0_usize);
        self.list(|cursor| {
            let before = all.len();
            let here = cursor.clone();
            cursor.list(|c| {
                all.push(item(c)?);
                Ok(())
            })?;
            let found = all.len() - before;
            rows += 1;
            if rows == 1 {
                columns = found;
            }
            if found != columns || found == 0 {
                let what =
                    format!("row {rows} of the net has {found} entries, row 1 has {columns}");
                return Err(here.error(what, "make all rows equally long"));
            }
            Ok(())
        })?;
        if all.is_empty() {
            return Err(self.error("the net is empty", "give it control points"));
        }
        Ok((all, columns))
    }
}
