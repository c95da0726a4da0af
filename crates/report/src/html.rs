//! Joins data and viewer into one page.

use std::fmt::Write as _;

use base64::Engine as _;
use base64::engine::general_purpose::STANDARD;
use serde_json::{Map, Value, json};

use crate::energies::energies_svg;
use crate::histogram::histogram_svg;
use crate::numbers::format_number;
use crate::page_data::page_data;
use crate::sha256::sha256;
use crate::text::{escape, escape_script};
use crate::{Report, SeamTable};

const STYLE: &str = include_str!("viewer/style.css");
const EXPLORER: &str = include_str!("viewer/explorer.html");

/// The viewer's script in the order its parts build on one another.
const SCRIPTS: [&str; 12] = [
    include_str!("viewer/js/decode.js"),
    include_str!("viewer/js/math.js"),
    include_str!("viewer/js/mesh.js"),
    include_str!("viewer/js/gl.js"),
    include_str!("viewer/js/state.js"),
    include_str!("viewer/js/scene.js"),
    include_str!("viewer/js/look.js"),
    include_str!("viewer/js/legend.js"),
    include_str!("viewer/js/diagram.js"),
    include_str!("viewer/js/navigate.js"),
    include_str!("viewer/js/selection.js"),
    include_str!("viewer/js/controls.js"),
];
const MAIN: &str = include_str!("viewer/js/main.js");

const SHADERS: [(&str, &str); 10] = [
    ("surface.vert", include_str!("viewer/glsl/surface.vert")),
    ("surface.frag", include_str!("viewer/glsl/surface.frag")),
    ("colour.glsl", include_str!("viewer/glsl/colour.glsl")),
    ("diagram.vert", include_str!("viewer/glsl/diagram.vert")),
    ("diagram.frag", include_str!("viewer/glsl/diagram.frag")),
    ("line.vert", include_str!("viewer/glsl/line.vert")),
    ("thin.vert", include_str!("viewer/glsl/thin.vert")),
    ("line.frag", include_str!("viewer/glsl/line.frag")),
    ("pick.vert", include_str!("viewer/glsl/pick.vert")),
    ("pick.frag", include_str!("viewer/glsl/pick.frag")),
];

/// What a page may run and load: its own script and style, known by their hashes, and pictures that
/// stand in it. Whatever else got into the page would stay text.
fn policy(script: &str, style: &str) -> String {
    let hash = |text: &str| STANDARD.encode(sha256(text.as_bytes()));
    format!(
        "default-src 'none'; script-src 'sha256-{}'; style-src 'sha256-{}'; img-src data:; \
         base-uri 'none'; form-action 'none'",
        hash(script),
        hash(style)
    )
}

impl Report {
    /// The whole page: text, data and viewer in one file that loads nothing else.
    pub fn to_html(&self) -> String {
        let (metrics, run) = self.split_metrics();
        let data = page_data(self);
        let title = escape(&self.title);
        let (script, style) = (script(), format!("\n{STYLE}"));
        let policy = policy(&script, &style);
        let mut page = format!(
            "<!doctype html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n\
             <meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n\
             <meta http-equiv=\"Content-Security-Policy\" content=\"{policy}\">\n\
             <title>Loading {title}</title>\n<style>{style}</style>\n</head>\n<body>\n"
        );
        page += &self.head();
        if !self.stages.is_empty() {
            page += EXPLORER;
        }
        page += "<main class=\"cards\">\n";
        page += &self.plots();
        if let Some(seams) = &self.seams {
            page += &card("wide", title_or(&seams.title, "Worst seams"), &seam_rows(self, seams));
        }
        if !metrics.is_empty() {
            let (single, compared) = split_comparable(metrics);
            if compared.len() > 1 {
                page += &card("wide", "Compared", &comparison(&compared));
            }
            page += &card("", "Metrics", &table(&flat_rows(&single)));
        }
        if !self.options.is_empty() {
            page += &card("", "Options", &table(&self.options));
        }
        if !run.is_empty() {
            let rows = "<table><tbody id=\"run-rows\"></tbody></table>";
            page += &card("", "This run", rows);
        }
        page += "</main>\n<footer>Written by Umbilic. Nothing in this page is loaded from elsewhere.</footer>\n";
        let _ = writeln!(page, "{}", json_block("data", &data.json));
        let run = json!({"command": self.command_line, "rows": run});
        let _ = writeln!(page, "{}", json_block("run", &run));
        for (i, text) in data.packed_stages.iter().enumerate() {
            let _ = writeln!(page, "<script type=\"text/plain\" id=\"stage-{i}\">{text}</script>");
        }
        let _ = writeln!(page, "<script>{script}</script>");
        page += "</body>\n</html>\n";
        page
    }

    fn head(&self) -> String {
        let mut head = format!("<header>\n<h1>{}</h1>\n", escape(&self.title));
        if !self.status.is_empty() {
            // Steps that were asked for and made are no cause for alarm.
            let is_fine = matches!(self.status.as_str(), "converged" | "iteration_limit");
            let class = if is_fine { "status" } else { "status attention" };
            let status = escape(&self.status.replace('_', " "));
            let _ = writeln!(head, "<span class=\"{class}\">{status}</span>");
        }
        // Filled by the script: paths and thread counts in it change from run to run.
        head += "<code id=\"command\"></code>\n";
        head += "</header>\n";
        if !self.warnings.is_empty() {
            head += "<ul class=\"warnings\" aria-label=\"Warnings\">\n";
            for warning in &self.warnings {
                let _ = writeln!(head, "<li>{}</li>", escape(warning));
            }
            head += "</ul>\n";
        }
        head
    }

    fn plots(&self) -> String {
        let mut cards = String::new();
        for histogram in &self.histograms {
            cards += &card("", &histogram.title, &histogram_svg(histogram));
        }
        if let Some(history) = &self.energies {
            cards += &card("", "Energies per iteration", &energies_svg(history));
        }
        cards
    }
}

/// What stands between the tags of the page's one script.
fn script() -> String {
    let mut shaders = Map::new();
    for (name, source) in SHADERS {
        shaders.insert(name.to_owned(), Value::from(source));
    }
    let shaders = escape_script(&Value::Object(shaders));
    let parts = SCRIPTS.join("\n");
    format!("\n\"use strict\";\n(() => {{\nconst SHADERS = {shaders};\n{parts}\n{MAIN}}})();\n")
}

fn card(class: &str, title: &str, content: &str) -> String {
    let title = escape(title);
    format!("<section class=\"card {class}\">\n<h2>{title}</h2>\n{content}\n</section>\n")
}

fn title_or<'a>(title: &'a str, otherwise: &'a str) -> &'a str {
    if title.is_empty() { otherwise } else { title }
}

fn table(rows: &[(String, String)]) -> String {
    let mut text = String::from("<table><tbody>\n");
    for (name, value) in rows {
        let (name, value) = (escape(name), escape(value));
        let _ = writeln!(text, "<tr><th scope=\"row\">{name}</th><td>{value}</td></tr>");
    }
    text + "</tbody></table>"
}

/// Takes out nested metrics that have the same keys, if there are several.
fn split_comparable(metrics: Map<String, Value>) -> (Map<String, Value>, Vec<(String, Value)>) {
    let keys = |value: &Value| -> Option<Vec<String>> {
        value.as_object().map(|object| object.keys().cloned().collect())
    };
    let first = metrics.values().find_map(keys);
    let is_like = |value: &Value| first.is_some() && keys(value) == first;
    if metrics.values().filter(|value| is_like(value)).count() < 2 {
        return (metrics, Vec::new());
    }
    let (mut single, mut compared) = (Map::new(), Vec::new());
    for (name, value) in metrics {
        if is_like(&value) {
            compared.push((name, value));
        } else {
            single.insert(name, value);
        }
    }
    (single, compared)
}

/// Objects of the same keys side by side.
fn comparison(objects: &[(String, Value)]) -> String {
    let rows = objects.iter().map(|(_, v)| v.as_object().map(flat_rows).unwrap_or_default());
    let columns: Vec<Vec<(String, String)>> = rows.collect();
    let mut text = String::from("<div class=\"scroll\"><table>\n<thead><tr><th></th>");
    for (name, _) in objects {
        let _ = write!(text, "<th class=\"number\">{}</th>", escape(name));
    }
    text += "</tr></thead>\n<tbody>\n";
    for (i, (name, _)) in columns[0].iter().enumerate() {
        let _ = write!(text, "<tr><th scope=\"row\">{}</th>", escape(name));
        for column in &columns {
            let value = column.get(i).map_or("", |(_, value)| value);
            let _ = write!(text, "<td>{}</td>", escape(value));
        }
        text += "</tr>\n";
    }
    text + "</tbody></table></div>"
}

/// Nested metrics as rows named by their dotted path.
fn flat_rows(metrics: &Map<String, Value>) -> Vec<(String, String)> {
    let mut rows = Vec::new();
    for (key, value) in metrics {
        if let Value::Object(inner) = value {
            let inner = flat_rows(inner).into_iter();
            rows.extend(inner.map(|(name, text)| (format!("{key}.{name}"), text)));
        } else {
            rows.push((key.clone(), value_text(value)));
        }
    }
    rows
}

fn value_text(value: &Value) -> String {
    match value {
        Value::Number(n) if n.is_f64() => format_number(n.as_f64().unwrap_or(f64::NAN), 5),
        Value::String(text) => text.clone(),
        Value::Null => "–".to_owned(),
        Value::Array(items) => items.iter().map(value_text).collect::<Vec<_>>().join(", "),
        other => other.to_string(),
    }
}

fn seam_rows(report: &Report, seams: &SeamTable) -> String {
    let mut text =
        String::from("<div class=\"scroll\"><table>\n<thead><tr><th class=\"words\">seam</th>");
    for column in &seams.columns {
        let _ = write!(text, "<th class=\"number\">{}</th>", escape(column));
    }
    text += "<th></th></tr></thead>\n<tbody>\n";
    for (i, seam) in seams.rows.iter().enumerate() {
        let _ = write!(text, "<tr><td class=\"words\">{}</td>", escape(&seam.label));
        for (column, &value) in seam.values.iter().enumerate() {
            let bound = seams.tolerances.get(column).copied().flatten();
            let beyond = bound.is_some_and(|b| !(value <= b));
            let class = if beyond { " class=\"beyond\"" } else { "" };
            let _ = write!(text, "<td{class}>{}</td>", format_number(value, 3));
        }
        let show = format!(
            "<button type=\"button\" data-seam=\"{i}\" aria-label=\"Show {}\">show</button>",
            escape(&seam.label)
        );
        let show = if report.stages.is_empty() { "" } else { &show };
        let _ = writeln!(text, "<td>{show}</td></tr>");
    }
    text + "</tbody></table></div>"
}

/// A JSON block no text inside can end early.
fn json_block(id: &str, value: &Value) -> String {
    let text = escape_script(value);
    format!("<script type=\"application/json\" id=\"{id}\">{text}</script>")
}
