//! The data of a report as the page's script reads it.

use rayon::prelude::*;
use serde_json::{Value, json};

use crate::codec::Packer;
use crate::colormap::{self, NO_VALUE};
use crate::{FieldScale, LineRole, Report, SurfaceView};

/// The JSON the script starts from, and the packed arrays of each stage.
pub(crate) struct PageData {
    pub(crate) json: Value,
    pub(crate) packed_stages: Vec<String>,
}

/// Packs the stages of `report`; the order is that of the stages for any number of threads.
pub(crate) fn page_data(report: &Report) -> PageData {
    let packed: Vec<_> = report.stages.par_iter().map(pack_stage).collect();
    let (stages, packed_stages): (Vec<Value>, Vec<String>) = packed.into_iter().unzip();
    let all_groups = report.stages.iter().flat_map(|s| s.groups());
    let group_count = all_groups.map(|g| g.names.len()).max().unwrap_or(0);
    let group_colours = (0..group_count).map(|i| colormap::hex(colormap::group_colour(i)));
    let map = |scale| colormap::table(scale).into_iter().map(colormap::hex).collect::<Vec<_>>();
    let relations = report.relations.iter();
    let relations = relations.map(|r| json!({"name": r.name, "points": r.points}));
    let json = json!({
        "title": report.title,
        "lengthUnit": report.length_unit,
        "stages": stages,
        "maps": {"signed": map(FieldScale::Signed), "magnitude": map(FieldScale::Magnitude)},
        "noValue": colormap::hex(NO_VALUE),
        "groupColours": group_colours.collect::<Vec<_>>(),
        "relations": relations.collect::<Vec<_>>(),
        "seams": seams(report),
    });
    PageData { json, packed_stages }
}

fn pack_stage(view: &SurfaceView) -> (Value, String) {
    let mut packer = Packer::with_rows_of(row_length(view));
    let positions = packer.points(view.positions());
    let normals = packer.normals(view.normals());
    let corners: Vec<u32> = view.triangles().iter().flatten().copied().collect();
    let triangles = packer.integers(&corners);
    let mut fields = Vec::new();
    for f in view.fields() {
        fields.push(json!({
            "id": f.id, "label": f.label, "unit": f.unit,
            "signed": f.scale == FieldScale::Signed, "range": f.range,
            "values": packer.floats(f.values.iter().copied()),
        }));
    }
    let mut groups = Vec::new();
    for g in view.groups() {
        let of_triangle = packer.integers(&g.of_triangle);
        let (id, label, names) = (&g.id, &g.label, &g.names);
        groups.push(json!({"id": id, "label": label, "names": names, "ofTriangle": of_triangle}));
    }
    let mut lines = Vec::new();
    for l in view.lines() {
        let lengths: Vec<u32> = l.polylines.iter().map(|p| p.len() as u32).collect();
        let points: Vec<_> = l.polylines.iter().flatten().copied().collect();
        lines.push(json!({
            "id": l.id, "label": l.label, "role": role_name(l.role), "visible": l.visible,
            "lengths": packer.integers(&lengths), "points": packer.points(&points),
        }));
    }
    let stage = json!({
        "name": view.name(), "exactNormals": view.has_exact_normals(), "positions": positions, "normals": normals, "triangles": triangles,
        "fields": fields, "groups": groups, "lines": lines,
    });
    (stage, packer.into_text())
}

/// Vertices in a row if the first triangle is that of a grid; used for compression alone.
fn row_length(view: &SurfaceView) -> usize {
    let [a, b, c] = view.triangles()[0];
    let (least, most) = (a.min(b).min(c), a.max(b).max(c));
    (most - least).saturating_sub(1) as usize
}

fn role_name(role: LineRole) -> &'static str {
    match role {
        LineRole::ControlNet => "control-net",
        LineRole::Mesh => "mesh",
        LineRole::Isolines => "isolines",
        LineRole::Directions => "directions",
        LineRole::Curves => "curves",
    }
}

fn seams(report: &Report) -> Value {
    let Some(table) = &report.seams else { return Value::Null };
    let stage_of = |name: &str| report.stages.iter().position(|s| s.name() == name).unwrap_or(0);
    let rows = table.rows.iter().map(|seam| {
        let path: Vec<_> = seam.path.iter().map(|p| p.to_array()).collect();
        json!({
            "stage": stage_of(&seam.stage), "location": seam.location.to_array(),
            "size": seam.size, "path": path,
        })
    });
    Value::Array(rows.collect())
}
