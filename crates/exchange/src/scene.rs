//! The RON scene: B-spline surfaces and point grids as people write them by hand.

use crate::error::ReadError;
use crate::model::{Model, NamedSurface, PointGrid};
use crate::ron_text::{from_ron, to_ron};
use crate::unit::LengthUnit;
use bspline::{
    BsplineCurve, BsplineSurface, Degree, KnotVector, SplineError, Trim, TrimCurve, TrimError,
    TrimLoop,
};
use geom_core::DVec3;
use serde::{Deserialize, Serialize};

/// Ends of trim curves that meet to within this share of the domain are one corner.
const SAME_CORNER: f64 = 1e-9;

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Scene {
    #[serde(default = "millimetre")]
    unit: String,
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    surfaces: Vec<SurfaceText>,
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    grids: Vec<GridText>,
}

fn millimetre() -> String {
    "mm".to_owned()
}

type Point = (f64, f64, f64);

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct SurfaceText {
    #[serde(default, skip_serializing_if = "String::is_empty")]
    name: String,
    u: DirectionText,
    v: DirectionText,
    /// One row per control point in u; a row runs along v.
    control_points: Vec<Vec<Point>>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    weights: Option<Vec<Vec<f64>>>,
    /// Linear RGB in 0..=1.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    color: Option<(f32, f32, f32)>,
    /// Loops of curves around the part that counts.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    trims: Vec<Vec<TrimText>>,
}

/// A curve in the parameter plane, and the same curve in space if that is known.
#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct TrimText {
    degree: usize,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    knots: Option<Vec<f64>>,
    points: Vec<(f64, f64)>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    weights: Option<Vec<f64>>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    edge: Option<EdgeText>,
}

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct EdgeText {
    degree: usize,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    knots: Option<Vec<f64>>,
    points: Vec<Point>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    weights: Option<Vec<f64>>,
}

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct DirectionText {
    degree: usize,
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    periodic: bool,
    /// All knots, or those of one period; without them they are uniform on `[0, 1]`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    knots: Option<Vec<f64>>,
}

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct GridText {
    #[serde(default, skip_serializing_if = "String::is_empty")]
    name: String,
    points: Vec<Vec<Point>>,
}

/// Reads a scene, see `docs/formats.md`.
///
/// # Errors
/// [`ReadError`] names the line, or the surface at fault.
pub fn read_scene(text: &str) -> Result<Model, ReadError> {
    let scene: Scene = from_ron(text)?;
    let Some(unit) = LengthUnit::from_symbol(&scene.unit) else {
        let what = format!("`{}` is not a unit of length", crate::error::clip(&scene.unit));
        return Err(ReadError::content(what, "use mm, cm, dm, m, km, in, ft, yd or mi"));
    };
    let mut model = Model { unit, ..Model::default() };
    for (k, text) in scene.surfaces.into_iter().enumerate() {
        let title = title("surface", &text.name, k);
        model.surfaces.push(surface(text, &title)?);
    }
    for (k, text) in scene.grids.into_iter().enumerate() {
        let title = title("grid", &text.name, k);
        let (points, n_v) = rows(text.points, &title, "points")?;
        let points: Vec<DVec3> = points.into_iter().map(DVec3::from).collect();
        if let Some(k) = points.iter().position(|p| !p.is_finite()) {
            let what = format!("{title} has a point {} that is not finite", points[k]);
            return Err(ReadError::content(what, "write three numbers"));
        }
        model.grids.push(PointGrid { name: text.name, n_u: points.len() / n_v, n_v, points });
    }
    if model.surfaces.is_empty() && model.grids.is_empty() {
        let what = "the scene is empty";
        return Err(ReadError::content(what, "give it `surfaces: [..]` or `grids: [..]`"));
    }
    Ok(model)
}

fn title(kind: &str, name: &str, k: usize) -> String {
    if name.is_empty() { format!("{kind} {}", k + 1) } else { format!("{kind} `{name}`") }
}

fn surface(text: SurfaceText, title: &str) -> Result<NamedSurface, ReadError> {
    let refused = |error: SplineError| {
        let message = error.to_string();
        // The library's message already ends with how to mend.
        let (what, mend) = message.split_once("; ").unwrap_or((&message, "correct the surface"));
        ReadError::content(format!("{title}: {what}"), mend)
    };
    let n_u = text.control_points.len();
    let (points, n_v) = rows(text.control_points, title, "control points")?;
    let weights = match text.weights {
        None => None,
        Some(weights) => {
            let (weights, columns) = rows(weights, title, "weights")?;
            if weights.len() != points.len() || columns != n_v {
                let found = weights.len() / columns;
                let what = format!(
                    "{title} has {found} x {columns} weights for {n_u} x {n_v} control points"
                );
                return Err(ReadError::content(what, "give one weight for each, or none"));
            }
            Some(weights)
        }
    };
    let knots_u = knots(text.u, n_u).map_err(refused)?;
    let knots_v = knots(text.v, n_v).map_err(refused)?;
    let given = |knots: &KnotVector, n: usize, direction: &str| {
        let needed = knots.control_count();
        let what = format!("{title} has {n} control points in {direction}");
        let mend = format!("its knots need {needed}; change the knots or the control points");
        if needed == n { Ok(()) } else { Err(ReadError::content(what, mend)) }
    };
    given(&knots_u, n_u, "u")?;
    given(&knots_v, n_v, "v")?;
    let points = points.into_iter().map(DVec3::from).collect();
    let surface = BsplineSurface::new(knots_u, knots_v, points, weights).map_err(refused)?;
    let trim = trim(text.trims, &surface).map_err(|error| {
        let message = error.to_string();
        let (what, mend) = message.split_once("; ").unwrap_or((&message, "correct the trims"));
        ReadError::content(format!("{title}: {what}"), mend)
    })?;
    let color = text.color.map(|(r, g, b)| [r, g, b]);
    Ok(NamedSurface { trim, color, ..NamedSurface::new(text.name, surface) })
}

fn trim(loops: Vec<Vec<TrimText>>, surface: &BsplineSurface) -> Result<Option<Trim>, TrimError> {
    if loops.is_empty() {
        return Ok(None);
    }
    let curve = |degree: usize, knots: Option<Vec<f64>>, points: Vec<DVec3>, weights| {
        let degree = Degree::new(degree).map_err(SplineError::from)?;
        let knots = match knots {
            Some(knots) => KnotVector::new(degree, knots),
            None => KnotVector::clamped_uniform(degree, points.len()),
        };
        BsplineCurve::new(knots.map_err(SplineError::from)?, points, weights)
    };
    let [(u0, u1), (v0, v1)] = [surface.knots_u().domain(), surface.knots_v().domain()];
    let slack = SAME_CORNER * (u1 - u0).max(v1 - v0);
    let mut made = Vec::with_capacity(loops.len());
    for texts in loops {
        let mut curves = Vec::with_capacity(texts.len());
        for text in texts {
            let flat = text.points.into_iter().map(|(u, v)| DVec3::new(u, v, 0.0)).collect();
            let parameters = curve(text.degree, text.knots, flat, text.weights)?;
            let edge = match text.edge {
                None => None,
                Some(edge) => {
                    let points = edge.points.into_iter().map(DVec3::from).collect();
                    Some(curve(edge.degree, edge.knots, points, edge.weights)?)
                }
            };
            curves.push(TrimCurve { parameters, edge });
        }
        made.push(TrimLoop::new(curves, slack)?);
    }
    Trim::new(made).map(Some)
}

/// Rows of equal, positive length as one list, and that length.
fn rows<T>(rows: Vec<Vec<T>>, title: &str, kind: &str) -> Result<(Vec<T>, usize), ReadError> {
    let columns = rows.first().map_or(0, Vec::len);
    if columns == 0 {
        let what = format!("{title} has no {kind}");
        return Err(ReadError::content(what, "give rows of them"));
    }
    if let Some(k) = rows.iter().position(|row| row.len() != columns) {
        let what = format!(
            "{title}: row {} of the {kind} has {} entries and row 1 has {columns}",
            k + 1,
            rows[k].len()
        );
        return Err(ReadError::content(what, "make all rows equally long"));
    }
    Ok((rows.into_iter().flatten().collect(), columns))
}

fn knots(text: DirectionText, count: usize) -> Result<KnotVector, SplineError> {
    let degree = Degree::new(text.degree)?;
    Ok(match (text.knots, text.periodic) {
        (None, false) => KnotVector::clamped_uniform(degree, count)?,
        (None, true) => KnotVector::periodic_uniform(degree, count)?,
        (Some(knots), false) => KnotVector::new(degree, knots)?,
        (Some(knots), true) => KnotVector::periodic(degree, &knots)?,
    })
}

/// Writes surfaces and grids so that they read back bit-equal.
///
/// # Errors
/// [`ron::Error`] never happens for finite numbers.
pub fn write_scene(model: &Model) -> Result<String, ron::Error> {
    let surfaces = model.surfaces.iter().map(|named| SurfaceText {
        name: named.name.clone(),
        u: direction(named.surface.knots_u()),
        v: direction(named.surface.knots_v()),
        control_points: points(named.surface.control_points(), named.surface.n_v()),
        weights: named
            .surface
            .weights()
            .map(|weights| weights.chunks(named.surface.n_v()).map(<[f64]>::to_vec).collect()),
        color: named.color.map(|[r, g, b]| (r, g, b)),
        trims: named.trim.as_ref().map(trim_texts).unwrap_or_default(),
    });
    let grids = model
        .grids
        .iter()
        .map(|grid| GridText { name: grid.name.clone(), points: points(&grid.points, grid.n_v) });
    let unit = match &model.unit {
        // A scene has no custom units; the metre stands for them, and the caller is told.
        LengthUnit::Other { .. } => "m".to_owned(),
        known => known.to_string(),
    };
    to_ron(&Scene { unit, surfaces: surfaces.collect(), grids: grids.collect() })
}

fn trim_texts(trim: &Trim) -> Vec<Vec<TrimText>> {
    let text = |curve: &TrimCurve| {
        let c = &curve.parameters;
        TrimText {
            degree: c.knots().degree().get(),
            knots: listed_knots(c.knots()),
            points: c.control_points().iter().map(|p| (p.x, p.y)).collect(),
            weights: c.weights().map(<[f64]>::to_vec),
            edge: curve.edge.as_ref().map(|e| EdgeText {
                degree: e.knots().degree().get(),
                knots: listed_knots(e.knots()),
                points: e.control_points().iter().map(|p| (p.x, p.y, p.z)).collect(),
                weights: e.weights().map(<[f64]>::to_vec),
            }),
        }
    };
    trim.loops().iter().map(|made| made.curves().iter().map(text).collect()).collect()
}

/// The knots of a curve, unless they are the default.
fn listed_knots(knots: &KnotVector) -> Option<Vec<f64>> {
    let uniform = KnotVector::clamped_uniform(knots.degree(), knots.control_count());
    (uniform.as_ref() != Ok(knots)).then(|| knots.knots().to_vec())
}

fn points(points: &[DVec3], n_v: usize) -> Vec<Vec<Point>> {
    points.chunks(n_v).map(|row| row.iter().map(|p| (p.x, p.y, p.z)).collect()).collect()
}

fn direction(knots: &KnotVector) -> DirectionText {
    let (d, n) = (knots.degree().get(), knots.control_count());
    let uniform = if knots.is_periodic() {
        KnotVector::periodic_uniform(knots.degree(), n)
    } else {
        KnotVector::clamped_uniform(knots.degree(), n)
    };
    let listed = if knots.is_periodic() { &knots.knots()[d..=d + n] } else { knots.knots() };
    let knots_text = if uniform.as_ref() == Ok(knots) { None } else { Some(listed.to_vec()) };
    DirectionText { degree: d, periodic: knots.is_periodic(), knots: knots_text }
}

#[cfg(test)]
mod tests {
    use super::*;

    const BILINEAR: &str = "(surfaces: [(name: \"s\", u: (degree: 1), v: (degree: 1), \
        control_points: [[(0, 0, 0), (0, 1, 0)], [(1, 0, 0), (1, 1, 1)]])])";

    #[test]
    fn a_scene_by_hand_and_back() {
        let model = read_scene(BILINEAR).unwrap();
        assert_eq!(model.unit, LengthUnit::Millimetre);
        assert_eq!(model.surfaces[0].surface.point(0.5, 0.5), DVec3::new(0.5, 0.5, 0.25));
        assert_eq!(read_scene(&write_scene(&model).unwrap()).unwrap(), model);
    }

    #[test]
    fn trims_and_colours_come_back() {
        let triangle = "color: (0.25, 0.5, 1), trims: [[\
            (degree: 1, points: [(0, 0), (1, 0)]), \
            (degree: 2, knots: [0, 0, 0, 3, 3, 3], points: [(1, 0), (0.9, 0.7), (0, 1)], \
             weights: [1, 0.8, 1], edge: (degree: 1, points: [(1, 0, 0), (0, 1, 0)])), \
            (degree: 1, points: [(0, 1), (0, 0)])]], control_points";
        let model = read_scene(&BILINEAR.replace("control_points", triangle)).unwrap();
        let trim = model.surfaces[0].trim.as_ref().unwrap();
        assert!(trim.contains(0.1, 0.1) && !trim.contains(0.9, 0.9));
        assert_eq!(read_scene(&write_scene(&model).unwrap()).unwrap(), model);
        let open = BILINEAR.replace(
            "control_points",
            "trims: [[(degree: 1, points: [(0, 0), (1, 0)])]], control_points",
        );
        let message = read_scene(&open).unwrap_err().to_string();
        assert!(
            message.starts_with("surface `s`: curve 0 ends 1 (in parameters) away"),
            "{message}"
        );
    }

    #[test]
    fn faults_say_what_and_where() {
        let change = |from: &str, to: &str| {
            assert!(BILINEAR.contains(from), "{from}");
            read_scene(&BILINEAR.replace(from, to)).unwrap_err().to_string()
        };
        let cases = [
            (
                ("u: (degree: 1)", "u: (degree: 3)"),
                "surface `s`: degree 3 needs at least 4 control points, found 2",
            ),
            (
                ("u: (degree: 1)", "u: (degree: 16)"),
                "surface `s`: degree 16 is not between 1 and 15",
            ),
            (
                ("u: (degree: 1)", "u: (degree: 1, knots: [0, 0, 1])"),
                "surface `s`: degree 1 needs 4 knots, found 3",
            ),
            (
                ("u: (degree: 1)", "u: (degree: 1, knots: [0, 0, 1, 0])"),
                "surface `s`: knot 2 is 1 and the next 0",
            ),
            (
                ("u: (degree: 1)", "u: (degree: 1, knots: [0, 0, 1, 2, 2])"),
                "surface `s` has 2 control points in u; its knots need 3",
            ),
            (
                ("[(0, 0, 0), (0, 1, 0)]", "[(0, 0, 0)]"),
                "surface `s`: row 2 of the control points has 2 entries and row 1 has 1",
            ),
            (("(1, 1, 1)", "(1, NaN, 1)"), "line 1: column 114: `NaN` is not a finite number"),
            (("name:", "nam:"), "line 1: column 14"),
            (("(surfaces", "(unit: \"ell\", surfaces"), "`ell` is not a unit of length; use mm"),
            (
                ("control_points", "weights: [[1, 1], [1, 0]], control_points"),
                "surface `s`: weight 3 is 0",
            ),
            (
                ("control_points", "weights: [[1, 1]], control_points"),
                "surface `s` has 1 x 2 weights for 2 x 2 control points",
            ),
        ];
        for ((from, to), want) in cases {
            let message = change(from, to);
            assert!(message.starts_with(want), "{message}");
        }
        assert!(read_scene("()").unwrap_err().to_string().starts_with("the scene is empty"));
    }
}
