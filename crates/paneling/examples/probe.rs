use paneling::*;
fn main() {
    let args: Vec<String> = std::env::args().collect();
    let shape = fixtures::surfaces::Shape::from_name(&args[1]).unwrap();
    let n: usize = args[2].parse().unwrap();
    let k: f64 = args[3].parse().unwrap();
    let s = shape.surface(14, 14, 4, 4);
    let t = std::time::Instant::now();
    let layout = Layout::generate(Pattern::Quad, n, n, [shape.is_closed_u(), false]).unwrap();
    let set = PanelSet::new(&s, &layout).unwrap();
    eprintln!("set {:?}", t.elapsed());
    for (name, c, seam) in [
        ("grid", Clustering::Grid(DiagramAxis::SignedRoot), 0),
        ("grid", Clustering::Grid(DiagramAxis::SignedRoot), 8),
        ("own", Clustering::Own, 0),
        ("own", Clustering::Own, 8),
    ] {
        let mut o = Options::with_molds(mold_count(k, set.len()));
        o.clustering = c;
        o.seam_steps = seam;
        let t = std::time::Instant::now();
        let p = panel(&set, &o).unwrap();
        let m = &p.measures;
        let g = 100.0 / set.diagonal();
        eprintln!(
            "{name} seam {seam}: molds {} kink {:.4} {:.4} {:.4} gap% {:.6} {:.6} {:.6} dev% {:.5} rounds {} seam {:?} {:?}",
            p.molds.len(),
            m.kinks.median.to_degrees(),
            m.kinks.p95.to_degrees(),
            m.kinks.max.to_degrees(),
            m.gaps.median * g,
            m.gaps.p95 * g,
            m.gaps.max * g,
            m.max_deviation() * g,
            p.fit_history.len(),
            p.seam_history,
            t.elapsed()
        );
    }
}
