//! Differences along the curves of a net: what fairness makes small.

use crate::QuadNet;

/// Vertices with coefficients.
pub type Combination = Vec<(usize, f64)>;

/// Second differences along the curves of a net, and at irregular vertices the distance to the
/// mean of the neighbours (opposite edges belong to different families there).
#[must_use]
pub fn second_differences(net: &QuadNet) -> Vec<Combination> {
    let mut rows: Vec<Combination> =
        net.curve_triples().iter().map(|&[a, v, b]| vec![(a, 1.0), (v, -2.0), (b, 1.0)]).collect();
    for v in net.irregular_vertices() {
        let ring: Vec<usize> = net.ring(v).collect();
        let mut row: Vec<(usize, f64)> =
            ring.iter().map(|&w| (w, 1.0 / ring.len() as f64)).collect();
        row.push((v, -1.0));
        rows.push(row);
    }
    rows
}

/// Third differences along the curves of a net, and second ones where a curve is too short.
#[must_use]
pub fn third_differences(net: &QuadNet) -> Vec<Combination> {
    let mut rows: Vec<Combination> = net
        .curve_quadruples()
        .iter()
        .map(|&[a, b, c, d]| vec![(a, -1.0), (b, 3.0), (c, -3.0), (d, 1.0)])
        .collect();
    for v in net.irregular_vertices() {
        let ring: Vec<usize> = net.ring(v).collect();
        let mut row: Vec<(usize, f64)> =
            ring.iter().map(|&w| (w, 1.0 / ring.len() as f64)).collect();
        row.push((v, -1.0));
        rows.push(row);
    }
    rows
}
