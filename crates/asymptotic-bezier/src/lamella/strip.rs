//! Straight strips for builders.
//!
//! A strip along an asymptotic curve and orthogonal to the surface is the rectifying developable
//! of the curve, because the normal curvature is zero: it unrolls to a straight piece whose length
//! is the arc length and whose node marks are arc lengths. It bends about its weak axis with the
//! curvature `κ` and twists with `τ`, `τ² = −K`.

use geom_core::DVec3;

use crate::boundary::solved::Boundary;
use crate::data::corners::AsymptoticNet;
use crate::lamella::profile::Profile;

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
