//! Writing chunks: a type code, a length, content, and a checksum of what is not in inner chunks.

use super::codes::{ANONYMOUS, CHECKED, CLASS, CLASS_DATA, CLASS_END, CLASS_ID, ClassId, SHORT};
use geom_core::{BoundingBox, DVec3};
use miniz_oxide::deflate::compress_to_vec_zlib;

/// Buffers up to this size stay as they are, as other writers have it.
const SHORTEST_COMPRESSED: usize = 128;
/// Of zlib: small at a fair speed.
const COMPRESSION: u8 = 6;

/// A chunk that is being written.
struct Open {
    code: u32,
    /// Where its content begins.
    content: usize,
    checksum: crc32fast::Hasher,
    /// Where the bytes begin that are not in the checksum yet.
    unsummed: usize,
}

/// A file of nested chunks; numbers are little-endian.
pub(super) struct Chunks {
    bytes: Vec<u8>,
    open: Vec<Open>,
}

impl Chunks {
    /// Starts with the bytes before the first chunk.
    pub(super) fn new(head: &[u8]) -> Self {
        Self { bytes: head.to_vec(), open: Vec::new() }
    }

    /// The bytes so far.
    pub(super) fn len(&self) -> usize {
        self.bytes.len()
    }

    /// The bytes from a place on.
    pub(super) fn since(&self, start: usize) -> &[u8] {
        &self.bytes[start..]
    }

    /// All bytes.
    pub(super) fn finish(self) -> Vec<u8> {
        self.bytes
    }

    /// A chunk with the content that `fill` writes.
    pub(super) fn chunk(&mut self, code: u32, fill: impl FnOnce(&mut Self)) {
        if let Some(outer) = self.open.last_mut() {
            outer.checksum.update(&self.bytes[outer.unsummed..]);
        }
        self.u32(code);
        self.bytes.extend_from_slice(&[0; 8]);
        let content = self.bytes.len();
        let checksum = crc32fast::Hasher::new();
        self.open.push(Open { code, content, checksum, unsummed: content });
        fill(self);
        if let Some(mut done) = self.open.pop() {
            if done.code & CHECKED != 0 {
                done.checksum.update(&self.bytes[done.unsummed..]);
                self.u32(done.checksum.finalize());
            }
            let length = (self.bytes.len() - done.content) as u64;
            self.bytes[done.content - 8..done.content].copy_from_slice(&length.to_le_bytes());
        }
        if let Some(outer) = self.open.last_mut() {
            outer.unsummed = self.bytes.len();
        }
    }

    /// A chunk that is one number.
    pub(super) fn short(&mut self, code: u32, value: u64) {
        debug_assert!(code & SHORT != 0, "only some codes have no content");
        if let Some(outer) = self.open.last_mut() {
            outer.checksum.update(&self.bytes[outer.unsummed..]);
        }
        self.u32(code);
        self.bytes.extend_from_slice(&value.to_le_bytes());
        if let Some(outer) = self.open.last_mut() {
            outer.unsummed = self.bytes.len();
        }
    }

    /// A chunk without a name that states its version, 1.0.
    pub(super) fn versioned(&mut self, fill: impl FnOnce(&mut Self)) {
        self.chunk(ANONYMOUS, |file| {
            file.i32(1);
            file.i32(0);
            fill(file);
        });
    }

    /// An object of a class.
    pub(super) fn object(&mut self, class: &ClassId, fill: impl FnOnce(&mut Self)) {
        self.chunk(CLASS, |file| {
            file.chunk(CLASS_ID, |file| file.raw(class));
            file.chunk(CLASS_DATA, fill);
            file.short(CLASS_END, 0);
        });
    }

    pub(super) fn raw(&mut self, bytes: &[u8]) {
        self.bytes.extend_from_slice(bytes);
    }

    pub(super) fn u8(&mut self, x: u8) {
        self.bytes.push(x);
    }

    pub(super) fn u32(&mut self, x: u32) {
        self.raw(&x.to_le_bytes());
    }

    pub(super) fn i32(&mut self, x: i32) {
        self.raw(&x.to_le_bytes());
    }

    /// A count or an index.
    pub(super) fn int(&mut self, x: usize) {
        self.i32(x as i32);
    }

    pub(super) fn i32s(&mut self, list: &[i32]) {
        list.iter().for_each(|x| self.i32(*x));
    }

    /// Zero bytes.
    pub(super) fn zeros(&mut self, count: usize) {
        self.bytes.resize(self.bytes.len() + count, 0);
    }

    pub(super) fn f32s(&mut self, list: &[f32]) {
        list.iter().for_each(|x| self.raw(&x.to_le_bytes()));
    }

    pub(super) fn f64(&mut self, x: f64) {
        self.raw(&x.to_le_bytes());
    }

    pub(super) fn f64s(&mut self, list: &[f64]) {
        list.iter().for_each(|x| self.f64(*x));
    }

    pub(super) fn point(&mut self, p: DVec3) {
        self.f64s(&p.to_array());
    }

    /// The lowest and the highest corner around some points.
    pub(super) fn bounds(&mut self, points: impl IntoIterator<Item = DVec3>) {
        let zero = BoundingBox { min: DVec3::ZERO, max: DVec3::ZERO };
        let bounds = BoundingBox::of(points).unwrap_or(zero);
        self.point(bounds.min);
        self.point(bounds.max);
    }

    /// A count and numbers.
    pub(super) fn indices(&mut self, list: impl ExactSizeIterator<Item = usize>) {
        self.int(list.len());
        list.for_each(|x| self.int(x));
    }

    /// A count and numbers.
    pub(super) fn reals(&mut self, list: &[f64]) {
        self.int(list.len());
        self.f64s(list);
    }

    /// UTF-16 with a zero at the end, which the count includes; an empty text has neither.
    pub(super) fn text(&mut self, text: &str) {
        if text.is_empty() {
            return self.int(0);
        }
        let units: Vec<u16> = text.encode_utf16().filter(|unit| *unit != 0).chain([0]).collect();
        self.int(units.len());
        units.iter().for_each(|unit| self.raw(&unit.to_le_bytes()));
    }

    /// A buffer with its size and checksum, compressed if that is worth it.
    pub(super) fn buffer(&mut self, content: &[u8]) {
        self.u32(content.len() as u32);
        if content.is_empty() {
            return;
        }
        self.u32(crc32fast::hash(content));
        if content.len() <= SHORTEST_COMPRESSED {
            self.u8(0);
            self.raw(content);
        } else {
            self.u8(1);
            self.chunk(ANONYMOUS, |file| file.raw(&compress_to_vec_zlib(content, COMPRESSION)));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn checksums_leave_inner_chunks_out() {
        let mut file = Chunks::new(b"");
        file.chunk(ANONYMOUS, |file| {
            file.raw(b"ab");
            file.chunk(CLASS, |file| file.raw(b"inner"));
            file.raw(b"cd");
        });
        let bytes = file.finish();
        assert_eq!(bytes.len(), 12 + 2 + 12 + 5 + 2 + 4);
        assert_eq!(bytes[4..12], 25_u64.to_le_bytes());
        assert_eq!(bytes[bytes.len() - 4..], crc32fast::hash(b"abcd").to_le_bytes());
    }

    #[test]
    fn texts_are_utf_16() {
        let mut file = Chunks::new(b"");
        file.text("é");
        file.text("");
        assert_eq!(file.finish(), [2, 0, 0, 0, 0xE9, 0, 0, 0, 0, 0, 0, 0]);
    }
}
