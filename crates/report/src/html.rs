//! Joins data and viewer into one page.

use std::fmt::Write as _;

use serde_json::Value;

use crate::Report;
use crate::page_data::page_data;

impl Report {
    /// The whole page: text, data and viewer in one file that loads nothing else.
    pub fn to_html(&self) -> String {
        let (_metrics, run) = self.split_metrics();
        let data = page_data(self);
        let mut page =
            String::from("<!doctype html>\n<html lang=\"en\"><meta charset=\"utf-8\">\n");
        let _ = write!(page, "<title>{0}</title>\n<h1>{0}</h1>\n", escape(&self.title));
        for histogram in &self.histograms {
            let _ = writeln!(page, "<h2>{}</h2>", escape(&histogram.title));
        }
        let _ = writeln!(page, "{}", json_block("data", &data.json));
        let _ = writeln!(page, "{}", json_block("run", &Value::Object(run)));
        for (i, text) in data.packed_stages.iter().enumerate() {
            let _ = writeln!(page, "<script type=\"text/plain\" id=\"stage-{i}\">{text}</script>");
        }
        page
    }
}

/// Text made harmless for HTML content and attributes.
pub(crate) fn escape(text: &str) -> String {
    let mut safe = String::with_capacity(text.len());
    for c in text.chars() {
        match c {
            '&' => safe.push_str("&amp;"),
            '<' => safe.push_str("&lt;"),
            '>' => safe.push_str("&gt;"),
            '"' => safe.push_str("&quot;"),
            '\'' => safe.push_str("&#39;"),
            c => safe.push(c),
        }
    }
    safe
}

/// A JSON block no text inside can end early.
fn json_block(id: &str, value: &Value) -> String {
    let text = value.to_string().replace('<', "\\u003c");
    format!("<script type=\"application/json\" id=\"{id}\">{text}</script>")
}
