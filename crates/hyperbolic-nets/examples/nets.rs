//! Writes the generated asymptotic nets, jittered by 5 % of an edge, as OBJ files into a folder.
//! Run with `cargo run -p hyperbolic-nets --example nets -- FOLDER [SEED]`; see `fixtures/nets`.

use fixtures::asymptotic_nets::{self as nets, AsymptoticNet};
use std::fmt::Write as _;
use std::path::Path;

fn main() -> std::io::Result<()> {
    let mut args = std::env::args().skip(1);
    let folder = args.next().unwrap_or_else(|| "fixtures/nets".to_owned());
    let seed = args.next().and_then(|s| s.parse().ok()).unwrap_or(1);
    let all = [
        ("helicoid", nets::helicoid()),
        ("scherk", nets::scherk(12)),
        ("enneper", nets::enneper()),
        ("enneper-holes", nets::enneper_with_holes()),
        ("mass-spring", nets::mass_spring()),
        ("catenoid-ring", nets::catenoid(44, 32)),
        ("catenoid-odd", nets::catenoid_odd()),
        ("bumped-ring", nets::bumped_catenoid(44, 32)),
        ("p-disc", nets::schwarz_p_disc(5)),
        ("p-cell", nets::schwarz_p_cell(4)),
    ];
    for (name, net) in all {
        let path = Path::new(&folder).join(format!("{name}.obj"));
        std::fs::write(path, obj(name, &net.jittered(0.05, seed)))?;
    }
    Ok(())
}

fn obj(name: &str, net: &AsymptoticNet) -> String {
    let mut text = format!("# {name}: quads along asymptotic lines, jittered by 5 % of an edge\n");
    for p in &net.positions {
        // Nine decimals: the jitter is fifty million times coarser.
        let _ = writeln!(text, "v {:.9} {:.9} {:.9}", p.x, p.y, p.z);
    }
    for [a, b, c, d] in &net.quads {
        let _ = writeln!(text, "f {} {} {} {}", a + 1, b + 1, c + 1, d + 1);
    }
    text
}
