//! Parameters of a patch at an extraordinary vertex over which the surface is smooth.
//!
//! A blended surface is smooth over its characteristic map, but a patch runs through that map like a
//! power of the distance to the vertex, which no spline over equal spans follows. Over parameters
//! that are stretched evenly along the edges of the sector, a polynomial of the map is one of the
//! parameters.

use crate::chart::Chart;
use crate::chart_net::refinement;

/// Even parameters of the patch at the vertex in a sector of a blend.
///
/// They are those of the Coons patch of the characteristic map between the two edges of the sector,
/// run through evenly, and the two outer edges as they are: there the parameters are the surface's
/// own, and along the edges between sectors the neighbours have the same.
pub(crate) struct Straightened {
    chart: Chart,
    /// By how much the patch's own parameters shrink for half the distance in the map.
    power: f64,
}

impl Straightened {
    pub(crate) fn new(valence: usize) -> Self {
        let chart = Chart::new(valence, &refinement(valence));
        // Half the parameter is `ratio` times the distance.
        let power = -std::f64::consts::LN_2 / chart.ratio.ln();
        Self { chart, power }
    }

    /// The patch's own parameters at even ones.
    pub(crate) fn parameters(&self, [u, v]: [f64; 2]) -> [f64; 2] {
        if u == 1.0 || v == 1.0 {
            return [u, v];
        }
        let size = u.max(v);
        if size == 0.0 {
            return [0.0, 0.0];
        }
        let near = size.powf(self.power);
        // Both edges alike, to the last bit.
        let along = |t| self.chart.inverse(self.place([t, 0.0]), [near, 0.0])[0];
        match (u == 0.0, v == 0.0) {
            (_, true) => [along(u), 0.0],
            (true, _) => [0.0, along(v)],
            _ => self.chart.inverse(self.place([u, v]), [near * u / size, near * v / size]),
        }
    }

    /// The place in the characteristic map.
    fn place(&self, [u, v]: [f64; 2]) -> [f64; 2] {
        let at = |u: f64, v: f64| self.chart.point([u, v]).0;
        let (far, beside, above) = (at(1.0, 1.0), at(1.0, v), at(u, 1.0));
        // With both inner edges even, they cancel the corners that they share with the outer ones.
        [0, 1].map(|k| u * beside[k] + v * above[k] - u * v * far[k])
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use geom_core::assert_close;

    #[test]
    fn even_parameters_are_even_in_the_map() {
        for valence in [3, 5, 6, 9] {
            let map = Straightened::new(valence);
            let end = map.chart.point([1.0, 0.0]).0[0];
            assert_eq!(map.parameters([0.0, 0.0]), [0.0, 0.0]);
            for k in 1..=8 {
                let t = f64::from(k) / 8.0;
                let [u, v] = map.parameters([t, 0.0]);
                assert_close(map.chart.point([u, v]).0[0], t * end, 1e-9);
                assert_eq!(map.parameters([0.0, t]), [v, u]);
                assert_eq!(map.parameters([1.0, t]), [1.0, t]);
                assert_eq!(map.parameters([t, 1.0]), [t, 1.0]);
            }
            // Inside, every place is met.
            for [u, v] in [[0.1, 0.1], [0.3, 0.8], [0.9, 0.05], [0.02, 0.5]] {
                let ([x, y], [p, q]) =
                    (map.chart.point(map.parameters([u, v])).0, map.place([u, v]));
                assert_close((x - p).hypot(y - q), 0.0, 1e-9);
            }
        }
    }
}
