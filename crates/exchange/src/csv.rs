//! Tables for spreadsheets (RFC 4180).

/// A table as comma-separated values: a header and rows of cells already written as text. Cells
/// with commas, quotes or line ends are quoted.
///
/// # Example
/// ```
/// let rows = [vec!["P1".to_owned(), 0.5.to_string()], vec!["a,b".to_owned(), String::new()]];
/// assert_eq!(exchange::write_csv(&["panel", "kink_deg"], rows), "panel,kink_deg\r\nP1,0.5\r\n\"a,b\",\r\n");
/// ```
pub fn write_csv(header: &[&str], rows: impl IntoIterator<Item = Vec<String>>) -> String {
    let mut text = String::new();
    let mut row = |cells: &mut dyn Iterator<Item = &str>| {
        for (k, cell) in cells.enumerate() {
            if k > 0 {
                text.push(',');
            }
            if cell.contains([',', '"', '\n', '\r']) {
                text.push('"');
                text.push_str(&cell.replace('"', "\"\""));
                text.push('"');
            } else {
                text.push_str(cell);
            }
        }
        text.push_str("\r\n");
    };
    row(&mut header.iter().copied());
    for cells in rows {
        row(&mut cells.iter().map(String::as_str));
    }
    text
}
