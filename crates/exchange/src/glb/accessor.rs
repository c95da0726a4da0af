//! Numbers of accessors, after it is sure that they are where the accessor says.

use crate::error::ReadError;
use gltf::accessor::{DataType, Dimensions, Iter};
use gltf::{Accessor, Semantic};

const MEND: &str = "export the scene again";

/// The numbers of a file and where they are.
#[derive(Clone, Copy)]
pub(super) struct Numbers<'b> {
    pub(super) binary: &'b [u8],
}

impl<'b> Numbers<'b> {
    /// What readers of the library ask for: the only buffer is that of the file itself.
    pub(super) fn buffer(self, buffer: gltf::Buffer<'_>) -> Option<&'b [u8]> {
        (buffer.index() == 0).then_some(self.binary)
    }

    /// Vectors of three single-precision numbers.
    pub(super) fn vectors(self, accessor: Accessor<'_>) -> Result<Vec<[f32; 3]>, ReadError> {
        let found = (accessor.dimensions(), accessor.data_type());
        if found != (Dimensions::Vec3, DataType::F32) {
            let what = format!("accessor {} is not of three floats", accessor.index());
            return Err(ReadError::content(what, MEND));
        }
        self.check(&accessor)?;
        Ok(Iter::new(accessor, |b| self.buffer(b)).into_iter().flatten().collect())
    }

    /// Single-precision numbers; `None` if the accessor is of another type.
    pub(super) fn scalars(self, accessor: Accessor<'_>) -> Result<Option<Vec<f64>>, ReadError> {
        let found = (accessor.dimensions(), accessor.data_type());
        if found != (Dimensions::Scalar, DataType::F32) {
            return Ok(None);
        }
        self.check(&accessor)?;
        let values = Iter::<f32>::new(accessor, |b| self.buffer(b)).into_iter().flatten();
        Ok(Some(values.map(f64::from).collect()))
    }

    /// Colours of floats or normalised integers; `None` if they are neither.
    pub(super) fn colors(
        self,
        primitive: &gltf::Primitive<'_>,
    ) -> Result<Option<Vec<[f32; 3]>>, ReadError> {
        let Some(accessor) = primitive.get(&Semantic::Colors(0)) else { return Ok(None) };
        let known = matches!(accessor.dimensions(), Dimensions::Vec3 | Dimensions::Vec4)
            && matches!(accessor.data_type(), DataType::U8 | DataType::U16 | DataType::F32);
        if !known {
            return Ok(None);
        }
        self.check(&accessor)?;
        let reader = primitive.reader(|b| self.buffer(b));
        Ok(reader.read_colors(0).map(|colors| colors.into_rgb_f32().collect()))
    }

    /// Numbers of vertices, all below `vertices`.
    pub(super) fn indices(
        self,
        primitive: &gltf::Primitive<'_>,
        vertices: usize,
    ) -> Result<Option<Vec<u32>>, ReadError> {
        let Some(accessor) = primitive.indices() else { return Ok(None) };
        let index = accessor.index();
        let whole = matches!(accessor.data_type(), DataType::U8 | DataType::U16 | DataType::U32);
        if accessor.dimensions() != Dimensions::Scalar || !whole {
            let what = format!("accessor {index} is not of whole numbers");
            return Err(ReadError::content(what, MEND));
        }
        self.check(&accessor)?;
        let reader = primitive.reader(|b| self.buffer(b));
        let indices: Vec<u32> =
            reader.read_indices().into_iter().flat_map(|all| all.into_u32()).collect();
        match indices.iter().find(|i| **i as usize >= vertices) {
            None => Ok(Some(indices)),
            Some(wrong) => {
                let what = format!("accessor {index} names vertex {wrong} of {vertices}");
                Err(ReadError::content(what, MEND))
            }
        }
    }

    /// Refuses accessors whose numbers are not all within the file.
    pub(super) fn check(self, accessor: &Accessor<'_>) -> Result<(), ReadError> {
        let index = accessor.index();
        let fail = |what: String| Err(ReadError::content(format!("accessor {index} {what}"), MEND));
        let (count, size) = (accessor.count(), accessor.size());
        if count == 0 {
            return fail("has no items".to_owned());
        }
        match (accessor.view(), accessor.sparse()) {
            (None, None) => return fail("has no data".to_owned()),
            (Some(view), _) if !self.holds(&view, accessor.offset(), count, size) => {
                let have = view.length();
                return fail(format!("has {count} items outside its {have} bytes of data"));
            }
            _ => {}
        }
        let Some(sparse) = accessor.sparse() else { return Ok(()) };
        let (indices, values) = (sparse.indices(), sparse.values());
        let wide = indices.index_type().size();
        let sound = (1..=count).contains(&sparse.count())
            && self.holds(&indices.view(), indices.offset(), sparse.count(), wide)
            && self.holds(&values.view(), values.offset(), sparse.count(), size);
        if sound { Ok(()) } else { fail("has changes outside the data".to_owned()) }
    }

    /// Whether `count` items of `size` bytes from an offset on lie within a view, and the view in
    /// the file.
    fn holds(self, view: &gltf::buffer::View<'_>, from: usize, count: usize, size: usize) -> bool {
        let stride = view.stride().unwrap_or(size);
        let end = count.checked_sub(1).and_then(|n| n.checked_mul(stride));
        let end = end.and_then(|n| n.checked_add(size)?.checked_add(from));
        let view_end = view.offset().checked_add(view.length());
        stride >= size
            && view.buffer().index() == 0
            && end.is_some_and(|end| end <= view.length())
            && view_end.is_some_and(|end| end <= self.binary.len())
    }
}
