//! A skin whose edges along one curve all have the same length: a constraint of one's own, once
//! with a hand-written Jacobian and once with derivatives by dual numbers. Writes the input and,
//! beside it, the smooth result, each with the curve as a line.
//! `cargo run -p hyperbolic-nets --example equal_edges -- [hand|dual] [skin.obj]`
#![allow(clippy::print_stdout, reason = "an example tells what it found")]

use std::error::Error as StdError;
use std::fmt::Write as _;

use geom_core::{DVec3, PolyMesh};
use gp_solver::{
    DualBlock, ElementFunction, Elements, Group, Problem, ResidualBlock, Stage, Variables,
};
use hyperbolic_nets::{
    Error, Input, Options, POSITIONS, PatchJet, QuadNet, SampledPatches, Solution, solve_with,
};
use numerics::Number;

/// Rows `|b − a| − |c − b|` for all three vertices in a row along a curve.
struct EqualEdges(Elements);

impl EqualEdges {
    fn corners(&self, row: usize, x: &[f64]) -> [DVec3; 3] {
        let c = self.0.columns(row);
        [0, 3, 6].map(|k| DVec3::new(x[c[k]], x[c[k + 1]], x[c[k + 2]]))
    }
}

impl ResidualBlock for EqualEdges {
    fn name(&self) -> &str {
        "equal edges"
    }
    fn elements(&self) -> &Elements {
        &self.0
    }
    fn residuals(&self, x: &[f64], residuals: &mut [f64]) {
        for (row, r) in residuals.iter_mut().enumerate() {
            let [a, b, c] = self.corners(row, x);
            *r = a.distance(b) - b.distance(c);
        }
    }
    fn linearize(&self, x: &[f64], residuals: &mut [f64], jacobian: &mut [f64]) {
        self.residuals(x, residuals);
        for (row, values) in jacobian.chunks_exact_mut(9).enumerate() {
            let [a, b, c] = self.corners(row, x);
            let (u, v) = ((b - a).normalize(), (c - b).normalize());
            values.copy_from_slice([-u, u + v, -v].map(|d| d.to_array()).as_flattened());
        }
    }
}

/// The same rows, written for any kind of number.
struct EqualLengths;

impl ElementFunction for EqualLengths {
    fn rows<T: Number>(&self, _row: usize, x: &[T], rows: &mut [T]) {
        let length = |k: usize| {
            let [a, b, c] = [0, 1, 2].map(|i| x[k + 3 + i] - x[k + i]);
            (a * a + b * b + c * c).sqrt()
        };
        rows[0] = length(0) - length(3);
    }
}

fn elements(positions: Group, curve: &[usize]) -> Elements {
    let mut elements = Elements::new();
    for three in curve.windows(3) {
        let columns: Vec<usize> = three.iter().flat_map(|&v| positions.columns::<3>(v)).collect();
        elements.push(&columns, 1);
    }
    elements
}

/// Solves `net` with equal edges along `curve`; the same closure serves the weighted stages, where
/// the rows are terms, and the polishing, where they are equations.
pub(crate) fn solve(net: &QuadNet, curve: &[usize], by_dual: bool) -> Result<Solution, Error> {
    let weight = 10.0 / net.mesh().mean_edge_length();
    let mut equal = |_: &Stage, variables: &Variables, problem: &mut Problem<'_>| {
        let elements = elements(variables.group(POSITIONS)?, curve);
        let block = if by_dual {
            problem.add(DualBlock::new("equal edges", elements, EqualLengths))
        } else {
            problem.add(EqualEdges(elements))
        };
        Ok(problem.set_weight(block, weight)?)
    };
    solve_with(&Input::new(net), &Options::default(), &mut equal, &mut ())
}

/// A jittered piece of Scherk's surface and the curve through its middle.
pub(crate) fn scene() -> Result<(QuadNet, Vec<usize>), Box<dyn StdError>> {
    let n = 12;
    let model = fixtures::asymptotic_nets::scherk(n).jittered(0.05, 1);
    let net = QuadNet::new(&PolyMesh::new(model.positions, &model.quads)?)?;
    let row = n as usize + 1;
    Ok((net, (0..row).map(|i| i * row + row / 2).collect()))
}

/// Shortest and longest edge along a curve.
pub(crate) fn range(net: &QuadNet, curve: &[usize]) -> [f64; 2] {
    let at = |v: usize| net.positions()[v];
    let lengths = curve.windows(2).map(|e| at(e[0]).distance(at(e[1])));
    lengths.fold([f64::INFINITY, 0.0], |[low, high], d| [low.min(d), high.max(d)])
}

fn main() -> Result<(), Box<dyn StdError>> {
    let mut arguments = std::env::args().skip(1);
    let by_dual = arguments.next().is_some_and(|how| how == "dual");
    let file = arguments.next().unwrap_or_else(|| "equal-edges.obj".to_owned());
    let (net, curve) = scene()?;
    let solution = solve(&net, &curve, by_dual)?;
    let skin = &solution.result;
    let [before, after] = [&net, skin.net()].map(|n| range(n, &curve));
    println!("edges along the curve: {before:?} before, {after:?} after");
    println!("{}: kinks to {:.1e}°", solution.report.status, solution.metrics.kink_max_deg);

    let sampled = SampledPatches::new(skin, 6, PatchJet::sample)?;
    let points: Vec<DVec3> = sampled.samples.iter().map(|s| s.point).collect();
    let along = |net: &QuadNet| curve.iter().map(|&v| net.positions()[v]).collect::<Vec<_>>();
    let aside = DVec3::X
        * 1.2
        * geom_core::BoundingBox::of(points.iter().copied()).map_or(1.0, |b| b.diagonal());
    let mut text = String::new();
    let mut first = 1;
    let parts = [
        ("input", net.positions(), net.quads().to_vec(), along(&net), DVec3::ZERO),
        ("skin", points.as_slice(), sampled.quads(), along(skin.net()), aside),
    ];
    for (name, points, faces, curve, shift) in parts {
        writeln!(text, "o {name}")?;
        for p in points.iter().chain(&curve).map(|p| *p + shift) {
            writeln!(text, "v {} {} {}", p.x, p.y, p.z)?;
        }
        for [a, b, c, d] in faces.iter().map(|f| f.map(|v| v as usize + first)) {
            writeln!(text, "f {a} {b} {c} {d}")?;
        }
        let line = (0..curve.len()).map(|k| (first + points.len() + k).to_string());
        writeln!(text, "l {}", line.collect::<Vec<_>>().join(" "))?;
        first += points.len() + curve.len();
    }
    std::fs::write(&file, text)?;
    println!("wrote {file}");
    Ok(())
}
