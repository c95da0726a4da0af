//! Straight strips for builders.
//!
//! A strip along an asymptotic curve and orthogonal to the surface is the rectifying developable
//! of the curve, because the normal curvature is zero: it unrolls to a straight piece whose length
//! is the arc length and whose node marks are arc lengths. It bends about its weak axis with the
//! curvature `κ` and twists with `τ`, `τ² = −K`.

use geom_core::DVec3;

use crate::boundary::solve::Boundary;
use crate::curve::bezier::{BezierCurve, JetTable};
use crate::data::corners::AsymptoticNet;

/// Samples per curve.
const SAMPLES: usize = 201;
/// Through-going arms make at least this angle's cosine (about 25 degrees off straight).
const STRAIGHT_COSINE: f64 = -0.9;

/// Size and material of the strips; lengths in model units, stresses in one unit of your choice.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LamellaOptions {
    /// Width `w`, across the surface.
    pub width: f64,
    /// Thickness `h`.
    pub thickness: f64,
    /// Young's modulus `E` and shear modulus `G`, for stresses and energies.
    pub moduli: Option<[f64; 2]>,
}

/// A node on a lamella.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LamellaNode {
    /// Vertex of the net.
    pub vertex: usize,
    /// Distance along the unrolled strip.
    pub arc: f64,
    /// Angle `ω` between the crossing curves, radians; NaN where no curve crosses.
    pub angle: f64,
    /// Width of the slot for the crossing lamella, `h / sin ω`.
    pub slot_width: f64,
    /// Depth of the slot, half the strip.
    pub slot_depth: f64,
    /// Surface normal at the node, the direction of the strip's width.
    pub normal: DVec3,
    /// Direction of the curve.
    pub direction: DVec3,
}

/// One strip, through as many curves as continue one another.
#[derive(Clone, Debug, PartialEq)]
pub struct Lamella {
    /// Curves with their direction of traversal (`true` is backwards).
    pub curves: Vec<(usize, bool)>,
    /// `+1` or `−1`: the family, which decides from which edge the slots are cut.
    pub family: f64,
    /// Length of the straight piece.
    pub length: f64,
    /// Nodes from start to end.
    pub nodes: Vec<LamellaNode>,
    /// Largest curvature, the bending about the weak axis.
    pub curvature: f64,
    /// Largest absolute torsion, the twist per length.
    pub torsion: f64,
    /// `∫ |τ| ds` in radians.
    pub twist: f64,
    /// Widest strip that is regular: `w |d(τ/κ)/ds| < 2`.
    pub width_bound: f64,
    /// `E h κ / 2`, with moduli given.
    pub bending_stress: Option<f64>,
    /// `G h |τ|`.
    pub shear_stress: Option<f64>,
    /// `E τ² w² / 12`, from the edges being longer than the middle.
    pub edge_stress: Option<f64>,
    /// `∫ (E I κ² + G J τ²)/2 ds` with `I = w h³/12`, `J = w h³/3`.
    pub elastic_energy: Option<f64>,
}

/// Strips along all curves of a net.
#[must_use]
pub fn lamellas(
    net: &AsymptoticNet,
    boundary: &Boundary,
    options: &LamellaOptions,
) -> Vec<Lamella> {
    chains(net, boundary).into_iter().map(|chain| measure(net, boundary, chain, options)).collect()
}

/// Drawing of one unrolled strip: lengths along x, widths along y.
#[derive(Clone, Debug, PartialEq)]
pub struct StripLayout {
    /// Number of the lamella.
    pub lamella: usize,
    /// Closed outline with the slots cut in.
    pub outline: Vec<DVec3>,
    /// Lines across the strip at its nodes.
    pub marks: Vec<[DVec3; 2]>,
    /// Where the names of the nodes go, with their vertices.
    pub labels: Vec<(DVec3, usize)>,
}

/// Lays the strips out one above the other; `gap` is the distance between them.
///
/// Slots come from the upper edge in one family and from the lower in the other, so that the
/// lamellas plug into one another.
#[must_use]
pub fn strip_layout(lamellas: &[Lamella], options: &LamellaOptions, gap: f64) -> Vec<StripLayout> {
    let w = options.width;
    lamellas
        .iter()
        .enumerate()
        .map(|(k, lamella)| {
            let base = -(k as f64) * (w + gap);
            let at = |x: f64, y: f64| DVec3::new(x, base + y, 0.0);
            // The slotted edge runs from the start of the strip to its end.
            let (slotted, plain) = if lamella.family > 0.0 { (w, 0.0) } else { (0.0, w) };
            let mut outline = vec![at(0.0, plain), at(0.0, slotted)];
            for node in &lamella.nodes {
                if node.slot_width.is_nan() {
                    continue;
                }
                // A slot at the end of a strip is cut open.
                let from = (node.arc - 0.5 * node.slot_width).max(0.0);
                let to = (node.arc + 0.5 * node.slot_width).min(lamella.length);
                let floor = slotted + (plain - slotted) * node.slot_depth / w;
                outline.extend([
                    at(from, slotted),
                    at(from, floor),
                    at(to, floor),
                    at(to, slotted),
                ]);
            }
            outline.extend([at(lamella.length, slotted), at(lamella.length, plain)]);
            outline.dedup();
            StripLayout {
                lamella: k,
                outline,
                marks: lamella.nodes.iter().map(|n| [at(n.arc, 0.0), at(n.arc, w)]).collect(),
                labels: lamella.nodes.iter().map(|n| (at(n.arc, 0.5 * w), n.vertex)).collect(),
            }
        })
        .collect()
}

/// Follows each curve through its vertices as long as one of the same family goes straight on.
fn chains(net: &AsymptoticNet, boundary: &Boundary) -> Vec<Vec<(usize, bool)>> {
    let mut arms: Vec<Vec<(usize, usize)>> = vec![Vec::new(); net.positions().len()];
    for (i, curve) in net.curves().iter().enumerate() {
        for e in 0..2 {
            arms[curve.ends[e]].push((i, e));
        }
    }
    // The arm that continues arm (i, e) beyond its vertex.
    let onward = |i: usize, e: usize| {
        let v = net.curves()[i].ends[e];
        let d = net.curves()[i].arms[e].normalize();
        arms[v]
            .iter()
            .filter(|(j, f)| {
                (*j, *f) != (i, e) && boundary.torsion_sign(*j, *f) == boundary.torsion_sign(i, e)
            })
            .map(|(j, f)| (*j, *f, net.curves()[*j].arms[*f].normalize().dot(d)))
            .filter(|(_, _, cosine)| *cosine < STRAIGHT_COSINE)
            .min_by(|a, b| a.2.total_cmp(&b.2))
            .map(|(j, f, _)| (j, f))
    };
    let mut used = vec![false; net.curves().len()];
    let mut out = Vec::new();
    for seed in 0..used.len() {
        if used[seed] {
            continue;
        }
        // Back to the beginning, or once around a closed line.
        let (mut first, mut start_end) = (seed, 0);
        while let Some((j, f)) = onward(first, start_end) {
            (first, start_end) = (j, 1 - f);
            if first == seed {
                break;
            }
        }
        let mut chain = Vec::new();
        let mut here = Some((first, start_end));
        while let Some((i, e)) = here {
            if used[i] {
                break;
            }
            used[i] = true;
            chain.push((i, e == 1));
            here = onward(i, 1 - e);
        }
        out.push(chain);
    }
    out
}

fn measure(
    net: &AsymptoticNet,
    boundary: &Boundary,
    chain: Vec<(usize, bool)>,
    options: &LamellaOptions,
) -> Lamella {
    let (w, h) = (options.width, options.thickness);
    let (i0, b0) = chain[0];
    let mut lamella = Lamella {
        family: boundary.torsion_sign(i0, usize::from(b0)),
        length: 0.0,
        nodes: vec![node(net, boundary, i0, usize::from(b0), 0.0, options)],
        curvature: 0.0,
        torsion: 0.0,
        twist: 0.0,
        width_bound: f64::INFINITY,
        bending_stress: None,
        shear_stress: None,
        edge_stress: None,
        elastic_energy: None,
        curves: Vec::new(),
    };
    let (mut bending, mut twisting) = (0.0, 0.0);
    for &(i, backwards) in &chain {
        let curve = &boundary.curves[i];
        let curve = if backwards { curve.reversed() } else { curve.clone() };
        let line = net.curves()[i].line;
        let measured = Profile::new(&curve, line);
        lamella.length += measured.length;
        lamella.curvature = lamella.curvature.max(measured.curvature);
        lamella.torsion = lamella.torsion.max(measured.torsion);
        lamella.twist += measured.twist;
        lamella.width_bound = lamella.width_bound.min(measured.width_bound);
        bending += measured.bending;
        twisting += measured.twisting;
        let end = usize::from(!backwards);
        lamella.nodes.push(node(net, boundary, i, end, lamella.length, options));
    }
    if let Some([e, g]) = options.moduli {
        lamella.bending_stress = Some(e * h * lamella.curvature / 2.0);
        lamella.shear_stress = Some(g * h * lamella.torsion);
        lamella.edge_stress = Some(e * (lamella.torsion * w).powi(2) / 12.0);
        let cube = w * h.powi(3);
        lamella.elastic_energy =
            Some(0.5 * (e * cube / 12.0 * bending + g * cube / 3.0 * twisting));
    }
    lamella.curves = chain;
    lamella
}

fn node(
    net: &AsymptoticNet,
    boundary: &Boundary,
    curve: usize,
    end: usize,
    arc: f64,
    options: &LamellaOptions,
) -> LamellaNode {
    let vertex = net.curves()[curve].ends[end];
    let arm = net.curves()[curve].arms[end].normalize();
    let crossing = net.curves().iter().enumerate().find_map(|(j, c)| {
        let f = c.ends.iter().position(|v| *v == vertex)?;
        let other = boundary.torsion_sign(j, f) != boundary.torsion_sign(curve, end);
        (j != curve && other).then(|| c.arms[f].normalize())
    });
    // The angle of two lines, at most a right angle.
    let angle = crossing.map_or(f64::NAN, |d| {
        let angle = d.cross(arm).length().atan2(d.dot(arm).abs());
        if angle == 0.0 { f64::NAN } else { angle }
    });
    LamellaNode {
        vertex,
        arc,
        angle,
        slot_width: options.thickness / angle.sin(),
        slot_depth: 0.5 * options.width,
        normal: boundary.normals[vertex],
        direction: if end == 0 { arm } else { -arm },
    }
}

/// Sampled integrals and extremes of one curve.
struct Profile {
    length: f64,
    curvature: f64,
    torsion: f64,
    twist: f64,
    width_bound: f64,
    bending: f64,
    twisting: f64,
}

impl Profile {
    fn new(curve: &BezierCurve, line: bool) -> Self {
        let table = JetTable::new(curve);
        let mut out = Self {
            length: 0.0,
            curvature: 0.0,
            torsion: 0.0,
            twist: 0.0,
            width_bound: f64::INFINITY,
            bending: 0.0,
            twisting: 0.0,
        };
        let step = 1.0 / (SAMPLES - 1) as f64;
        let mut last: Option<(f64, f64)> = None;
        for k in 0..SAMPLES {
            let t = k as f64 * step;
            let jet = table.at(t);
            // Simpson's rule: fourth order, and the samples are needed for the extremes anyway.
            let share = match k {
                0 => 1.0,
                _ if k == SAMPLES - 1 => 1.0,
                _ if k % 2 == 1 => 4.0,
                _ => 2.0,
            };
            let ds = share * step / 3.0 * jet.first.length();
            out.length += ds;
            if line {
                continue;
            }
            let (kappa, tau) = (jet.curvature(), table.torsion(t, &jet));
            out.curvature = out.curvature.max(kappa);
            out.torsion = out.torsion.max(tau.abs());
            out.twist += ds * tau.abs();
            out.bending += ds * kappa * kappa;
            out.twisting += ds * tau * tau;
            let ratio = tau / kappa;
            if let Some((before, speed)) = last {
                let length = 0.5 * (speed + jet.first.length()) * step;
                out.width_bound = out.width_bound.min(2.0 * length / (ratio - before).abs());
            }
            last = Some((ratio, jet.first.length()));
        }
        out
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn profile_of_a_helix_has_its_constant_curvature_and_torsion() {
        // Radius 1, pitch slope 0.5, one radian, interpolated by a degree-nine polynomial.
        let n = 9;
        let points: Vec<DVec3> = {
            let mut matrix = geom_core::linalg::Matrix::zeros(n + 1, n + 1);
            for r in 0..=n {
                let basis = crate::curve::bernstein::bernstein(n, r as f64 / n as f64);
                matrix.row_mut(r).copy_from_slice(&basis);
            }
            let helix = |t: f64| DVec3::new(t.cos(), t.sin(), 0.5 * t);
            let solve = |axis: usize| {
                let b: Vec<f64> = (0..=n).map(|r| helix(r as f64 / n as f64)[axis]).collect();
                geom_core::linalg::affine_space(&matrix, &b, &[1.0; 10], 1e-14).particular
            };
            let (x, y, z) = (solve(0), solve(1), solve(2));
            (0..=n).map(|k| DVec3::new(x[k], y[k], z[k])).collect()
        };
        let profile = Profile::new(&BezierCurve::new(points), false);
        let c = 1.25_f64;
        assert!((profile.length - c.sqrt()).abs() < 1e-7);
        assert!((profile.curvature - 1.0 / c).abs() < 1e-4);
        assert!((profile.torsion - 0.5 / c).abs() < 1e-2);
        assert!((profile.twisting - (0.5 / c).powi(2) * c.sqrt()).abs() < 1e-5);
    }
}
