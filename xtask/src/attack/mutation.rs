//! Files made worse at random.

use super::random::Random;
use std::ops::Range;

/// Numbers that readers have fallen over somewhere.
const NUMBERS: &[&str] = &[
    "0",
    "-1",
    "1e308",
    "-1e308",
    "1e-308",
    "5e-324",
    "nan",
    "NaN",
    "inf",
    "-inf",
    "1e999",
    "4294967295",
    "4294967296",
    "18446744073709551615",
    "-9223372036854775808",
    "0.1",
    "1e15",
    "--1",
    "1..2",
    "",
    "99999999999999999999999999",
];
/// A file does not grow beyond this.
const LONGEST: usize = 1 << 20;
/// How often a piece is repeated.
const REPEATS: &[usize] = &[2, 10, 1000];

/// One to four faults of random kinds and places.
pub(super) fn mutated(file: &[u8], random: &mut Random) -> Vec<u8> {
    let mut bytes = file.to_vec();
    for _ in 0..=random.below(4) {
        mutate(&mut bytes, random);
    }
    bytes
}

fn mutate(bytes: &mut Vec<u8>, random: &mut Random) {
    let at = random.below(bytes.len());
    match random.below(9) {
        0 => bytes.truncate(at),
        1 => bytes.iter_mut().skip(at).take(1).for_each(|b| *b ^= 1 << random.below(8)),
        2 => {
            let byte = random.byte();
            bytes.iter_mut().skip(at).take(1).for_each(|b| *b = byte);
        }
        3 => {
            // A count or an offset of a binary file.
            let value: [u8; 4] =
                *random.one(&[[0xff; 4], [0; 4], [0, 0, 0, 0x80], [0xff, 0, 0, 0]]);
            bytes.iter_mut().skip(at & !3).zip(value).for_each(|(b, v)| *b = v);
        }
        4 => {
            bytes.drain(line(bytes, at));
        }
        5 => {
            let piece = bytes[line(bytes, at)].to_vec();
            let times = (*random.one(REPEATS)).min(LONGEST / piece.len().max(1));
            bytes.splice(at..at, piece.repeat(times));
        }
        6 => {
            let other = random.below(bytes.len());
            let (a, b) = (line(bytes, at), line(bytes, other));
            let piece = bytes[b].to_vec();
            bytes.splice(a, piece);
        }
        _ => {
            let number = random.one(NUMBERS).as_bytes().to_vec();
            bytes.splice(word(bytes, at), number);
        }
    }
    bytes.truncate(LONGEST);
}

/// The line around a place, with its end.
fn line(bytes: &[u8], at: usize) -> Range<usize> {
    let start = bytes[..at].iter().rposition(|b| *b == b'\n').map_or(0, |k| k + 1);
    let end = bytes[at..].iter().position(|b| *b == b'\n').map_or(bytes.len(), |k| at + k + 1);
    start..end
}

/// The word around a place: what numbers are made of.
fn word(bytes: &[u8], at: usize) -> Range<usize> {
    let is_part = |b: &u8| b.is_ascii_alphanumeric() || b"+-._".contains(b);
    let start = bytes[..at].iter().rposition(|b| !is_part(b)).map_or(0, |k| k + 1);
    let end = bytes[at..].iter().position(|b| !is_part(b)).map_or(bytes.len(), |k| at + k);
    start..end
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn mutations_change_files_and_never_fail() {
        let file = b"v 1.0 -2.5e3 0\nv 1 2 3\nf 1 2 3\n";
        let mut random = Random::new(3);
        let changed = (0..500).filter(|_| mutated(file, &mut random) != file).count();
        assert!(changed > 400, "{changed}");
        assert!((0..50).all(|_| mutated(b"", &mut random).len() <= LONGEST));
    }

    #[test]
    fn lines_and_words_are_found() {
        let text = b"a b\n-1.5e3,7\n";
        assert_eq!(line(text, 6), 4..13);
        assert_eq!(&text[word(text, 6)], b"-1.5e3");
    }
}
