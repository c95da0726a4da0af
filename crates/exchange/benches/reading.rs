//! Large files: a hundred megabytes of STEP and of OBJ.
#![allow(missing_docs, clippy::unwrap_used, reason = "a benchmark")]

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use std::fmt::Write;

const BYTES: usize = 100_000_000;

/// One STEP file with the instances of a small one many times over, each with numbers of its own.
fn step() -> String {
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../../fixtures/saddle.step");
    let text = std::fs::read_to_string(path).unwrap();
    let (header, rest) = text.split_once("DATA;").unwrap();
    let (data, end) = rest.split_once("ENDSEC;").unwrap();
    let pieces: Vec<&str> = data.split('#').collect();
    let number = |piece: &str| {
        let digits = piece.find(|c: char| !c.is_ascii_digit()).unwrap_or(piece.len());
        (piece[..digits].parse::<usize>().unwrap(), digits)
    };
    let numbers: Vec<(usize, usize)> = pieces[1..].iter().map(|piece| number(piece)).collect();
    let largest = numbers.iter().map(|(id, _)| *id).max().unwrap();
    let mut all = format!("{header}DATA;");
    for copy in 0..BYTES / data.len() {
        all.push_str(pieces[0]);
        for (piece, (id, digits)) in pieces[1..].iter().zip(&numbers) {
            write!(all, "#{}{}", id + copy * (largest + 1), &piece[*digits..]).unwrap();
        }
    }
    all + "ENDSEC;" + end
}

/// A height field of quads.
fn obj() -> String {
    let side = 1350;
    let mut all = String::new();
    for k in 0..side * side {
        let (x, y) = ((k / side) as f64 / 7.0, (k % side) as f64 / 11.0);
        writeln!(all, "v {x} {y} {}", (x * y).sin()).unwrap();
    }
    for k in (1..side * (side - 1)).filter(|k| k % side != 0) {
        writeln!(all, "f {k} {} {} {}", k + side, k + side + 1, k + 1).unwrap();
    }
    all
}

fn reading(c: &mut Criterion) {
    let mut group = c.benchmark_group("reading");
    group.sample_size(10);
    let text = step();
    group.throughput(Throughput::Bytes(text.len() as u64));
    group.bench_function("100 MB of STEP", |b| {
        b.iter(|| exchange::read_step(text.as_bytes()).unwrap().surfaces.len());
    });
    let text = obj();
    group.throughput(Throughput::Bytes(text.len() as u64));
    group.bench_function("100 MB of OBJ", |b| {
        b.iter(|| exchange::read_obj(&text).unwrap().meshes.len());
    });
    group.finish();
}

criterion_group!(benches, reading);
criterion_main!(benches);
