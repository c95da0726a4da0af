//! Reading chunks: a place in a file between two ends.

use super::codes::{ANONYMOUS, CHECKED, CLASS, CLASS_DATA, CLASS_ID, ClassId, SHORT};
use crate::error::ReadError;
use geom_core::DVec3;
use miniz_oxide::inflate::decompress_to_vec_zlib_with_limit;

const MEND: &str = "the file is truncated or damaged; save it again";

/// A type code with its content.
pub(super) struct Chunk<'a> {
    pub(super) code: u32,
    pub(super) content: Cursor<'a>,
}

/// A place within the content of a chunk.
#[derive(Clone)]
pub(super) struct Cursor<'a> {
    bytes: &'a [u8],
    at: usize,
    end: usize,
    /// The checksum behind the content, and that of the bytes read so far without inner chunks.
    stored: Option<u32>,
    checksum: crc32fast::Hasher,
    unsummed: usize,
}

impl<'a> Cursor<'a> {
    /// The whole of a file from a place on.
    pub(super) fn new(bytes: &'a [u8], at: usize) -> Self {
        Self::within(bytes, at, bytes.len(), None)
    }

    fn within(bytes: &'a [u8], at: usize, end: usize, stored: Option<u32>) -> Self {
        Self { bytes, at, end, stored, checksum: crc32fast::Hasher::new(), unsummed: at }
    }

    /// A fault here.
    pub(super) fn error(&self, what: impl Into<String>) -> ReadError {
        ReadError::binary(self.at, what, MEND)
    }

    pub(super) fn is_at_end(&self) -> bool {
        self.at >= self.end
    }

    /// The bytes left.
    pub(super) fn left(&self) -> usize {
        self.end - self.at
    }

    pub(super) fn take(&mut self, count: usize) -> Result<&'a [u8], ReadError> {
        if count > self.left() {
            let what = format!("{count} bytes are missing, {} are left of the part", self.left());
            return Err(self.error(what));
        }
        let taken = &self.bytes[self.at..self.at + count];
        self.at += count;
        Ok(taken)
    }

    fn array<const N: usize>(&mut self) -> Result<[u8; N], ReadError> {
        let mut array = [0; N];
        array.copy_from_slice(self.take(N)?);
        Ok(array)
    }

    pub(super) fn u8(&mut self) -> Result<u8, ReadError> {
        Ok(self.array::<1>()?[0])
    }

    pub(super) fn u32(&mut self) -> Result<u32, ReadError> {
        Ok(u32::from_le_bytes(self.array()?))
    }

    pub(super) fn i32(&mut self) -> Result<i32, ReadError> {
        Ok(i32::from_le_bytes(self.array()?))
    }

    pub(super) fn f64(&mut self) -> Result<f64, ReadError> {
        Ok(f64::from_le_bytes(self.array()?))
    }

    pub(super) fn f64s<const N: usize>(&mut self) -> Result<[f64; N], ReadError> {
        let mut list = [0.0; N];
        for x in &mut list {
            *x = self.f64()?;
        }
        Ok(list)
    }

    pub(super) fn point(&mut self) -> Result<DVec3, ReadError> {
        Ok(DVec3::from_array(self.f64s()?))
    }

    pub(super) fn id(&mut self) -> Result<ClassId, ReadError> {
        self.array()
    }

    /// A number of items that take at least `bytes` each, which the rest must hold.
    pub(super) fn count(&mut self, bytes: usize) -> Result<usize, ReadError> {
        let count = self.i32()?;
        let known = usize::try_from(count).ok();
        known.filter(|n| n.saturating_mul(bytes) <= self.left()).ok_or_else(|| {
            let what = format!("{count} items do not fit into the {} bytes left", self.left());
            self.error(what)
        })
    }

    /// An index, or none for a negative number.
    pub(super) fn index(&mut self) -> Result<Option<usize>, ReadError> {
        Ok(usize::try_from(self.i32()?).ok())
    }

    pub(super) fn indices(&mut self) -> Result<Vec<Option<usize>>, ReadError> {
        let count = self.count(4)?;
        (0..count).map(|_| self.index()).collect()
    }

    pub(super) fn reals(&mut self) -> Result<Vec<f64>, ReadError> {
        let count = self.count(8)?;
        (0..count).map(|_| self.f64()).collect()
    }

    pub(super) fn text(&mut self) -> Result<String, ReadError> {
        let count = self.count(2)?;
        let bytes = self.take(2 * count)?;
        let units = bytes.chunks_exact(2).map(|b| u16::from_le_bytes([b[0], b[1]]));
        let text: String = char::decode_utf16(units.take_while(|unit| *unit != 0))
            .map(|c| c.unwrap_or(char::REPLACEMENT_CHARACTER))
            .collect();
        Ok(text)
    }

    /// The next chunk.
    pub(super) fn chunk(&mut self) -> Result<Chunk<'a>, ReadError> {
        self.checksum.update(&self.bytes[self.unsummed..self.at]);
        let code = self.u32()?;
        let value = u64::from_le_bytes(self.array()?);
        let (start, mut end) = (self.at, self.at);
        let mut stored = None;
        if code & SHORT == 0 {
            let length = usize::try_from(value).unwrap_or(usize::MAX);
            self.take(length)?;
            end = self.at;
            if code & CHECKED != 0 {
                let Some(tail) = end.checked_sub(4).filter(|tail| *tail >= start) else {
                    return Err(self.error("a part is too short for its checksum"));
                };
                let sum = [0, 1, 2, 3].map(|k| self.bytes[tail + k]);
                (stored, end) = (Some(u32::from_le_bytes(sum)), tail);
            }
        }
        self.unsummed = self.at;
        Ok(Chunk { code, content: Self::within(self.bytes, start, end, stored) })
    }

    /// The content of the next chunk, which must have this code.
    pub(super) fn expect(&mut self, code: u32) -> Result<Self, ReadError> {
        let at = self.at;
        let chunk = self.chunk()?;
        if chunk.code == code {
            return Ok(chunk.content);
        }
        let what = format!("a part {:08x} where {code:08x} belongs", chunk.code);
        Err(ReadError::binary(at, what, MEND))
    }

    /// A chunk without a name that begins with a version.
    pub(super) fn versioned(&mut self) -> Result<Self, ReadError> {
        let mut content = self.expect(ANONYMOUS)?;
        content.i32()?;
        content.i32()?;
        Ok(content)
    }

    /// Class and data of the next object; what else is in its chunk is passed over.
    pub(super) fn object(&mut self) -> Result<(ClassId, Self), ReadError> {
        let mut object = self.expect(CLASS)?;
        let class = object.expect(CLASS_ID)?.id()?;
        Ok((class, object.expect(CLASS_DATA)?))
    }

    /// The major and the minor version in one byte.
    pub(super) fn version(&mut self) -> Result<(u8, u8), ReadError> {
        let version = self.u8()?;
        Ok((version >> 4, version & 15))
    }

    /// Refuses content that is read to its end and does not have its checksum.
    pub(super) fn check(mut self) -> Result<(), ReadError> {
        self.checksum.update(&self.bytes[self.unsummed..self.at]);
        let sum = self.checksum.clone().finalize();
        match self.stored {
            Some(stored) if self.is_at_end() && stored != sum => {
                Err(self.error("the checksum of a part is wrong"))
            }
            _ => Ok(()),
        }
    }

    /// A buffer of `size` bytes or none; `size` must be covered by what the caller may use.
    pub(super) fn buffer(&mut self, size: usize) -> Result<Option<Vec<u8>>, ReadError> {
        let (found, packed, sum) = self.packed()?;
        if found == 0 {
            return Ok(None);
        }
        if found != size {
            return Err(self.error(format!("a buffer of {found} bytes where {size} belong")));
        }
        let content = match packed {
            Packed::Plain(bytes) => bytes.to_vec(),
            Packed::Zlib(bytes) => decompress_to_vec_zlib_with_limit(bytes, size)
                .map_err(|_| self.error("a compressed buffer cannot be unpacked"))?,
        };
        if content.len() != size || crc32fast::hash(&content) != sum {
            return Err(self.error("the checksum of a buffer is wrong"));
        }
        Ok(Some(content))
    }

    /// Passes over a buffer.
    pub(super) fn skip_buffer(&mut self) -> Result<(), ReadError> {
        self.packed().map(drop)
    }

    fn packed(&mut self) -> Result<(usize, Packed<'a>, u32), ReadError> {
        let size = self.u32()? as usize;
        if size == 0 {
            return Ok((0, Packed::Plain(&[]), 0));
        }
        let sum = self.u32()?;
        let packed = match self.u8()? {
            0 => Packed::Plain(self.take(size)?),
            1 => {
                let mut content = self.expect(ANONYMOUS)?;
                Packed::Zlib(content.take(content.left())?)
            }
            _ => return Err(self.error("a buffer packed in an unknown way")),
        };
        Ok((size, packed, sum))
    }
}

enum Packed<'a> {
    Plain(&'a [u8]),
    Zlib(&'a [u8]),
}
