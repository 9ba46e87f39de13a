//! Accessors as typed vectors: stride, sparse values, normalised and quantised components, compressed views.

use glam::{Mat4, Vec2, Vec3, Vec4};
use serde_json::Value;

use crate::check::layout::{column_bytes, columns_and_rows, component_bytes, element_bytes, view_stride};
use crate::check::{array, count, index};
use crate::container::GltfFile;
use crate::error::{Code, Error, Issue};

const UNSIGNED_BYTE: u64 = 5121;
const UNSIGNED_SHORT: u64 = 5123;
const UNSIGNED_INT: u64 = 5125;

/// Readers of accessors by index. All fail with the pointer of the accessor if it does not exist, has another type than
/// asked for, or cannot be decompressed; none panics or allocates more than the file's data justifies.
impl GltfFile {
    /// Positions (VEC3), in the units of the file. Refuses values that are not finite.
    pub fn read_positions(&self, accessor: usize) -> Result<Vec<Vec3>, Error> {
        let positions = self.read_vec3(accessor)?;
        match positions.iter().position(|position| !position.is_finite()) {
            None => Ok(positions),
            Some(element) => Err(self.refuse(
                Code::VertexNotFinite,
                accessor,
                format!("the position of element {element} is {}", positions[element]),
            )),
        }
    }

    /// A VEC3 accessor; the values may be anything, NaN included.
    pub fn read_vec3(&self, accessor: usize) -> Result<Vec<Vec3>, Error> {
        Ok(self.vectors::<3>(accessor, "VEC3")?.into_iter().map(Vec3::from).collect())
    }

    /// A VEC2 accessor; the values may be anything, NaN included.
    pub fn read_vec2(&self, accessor: usize) -> Result<Vec<Vec2>, Error> {
        Ok(self.vectors::<2>(accessor, "VEC2")?.into_iter().map(Vec2::from).collect())
    }

    /// A VEC4 accessor; the values may be anything, NaN included.
    pub fn read_vec4(&self, accessor: usize) -> Result<Vec<Vec4>, Error> {
        Ok(self.vectors::<4>(accessor, "VEC4")?.into_iter().map(Vec4::from).collect())
    }

    /// Linear colours with alpha (VEC3 or VEC4; alpha is 1 where there is none).
    pub fn read_colors(&self, accessor: usize) -> Result<Vec<Vec4>, Error> {
        if self.accessor_type(accessor) == "VEC3" {
            return Ok(self.read_vec3(accessor)?.into_iter().map(|color| color.extend(1.0)).collect());
        }
        self.read_vec4(accessor)
    }

    /// A MAT4 accessor, column-major; the values may be anything, NaN included.
    pub fn read_mat4(&self, accessor: usize) -> Result<Vec<Mat4>, Error> {
        Ok(self.vectors::<16>(accessor, "MAT4")?.iter().map(Mat4::from_cols_array).collect())
    }

    /// The components of an accessor of any type, element by element, without padding. Normalised integers become
    /// 0 to 1 or -1 to 1, others keep their value.
    pub fn read_floats(&self, accessor: usize) -> Result<Vec<f32>, Error> {
        self.floats(accessor).map_err(|issue| issue.in_file(self.name()))
    }

    /// Unsigned integers (SCALAR of u8, u16 or u32).
    pub fn read_u32(&self, accessor: usize) -> Result<Vec<u32>, Error> {
        let read = || {
            let (json, bytes) = self.packed(accessor)?;
            let kind = count(json, "componentType").unwrap_or_default();
            if self.accessor_type(accessor) != "SCALAR"
                || ![UNSIGNED_BYTE, UNSIGNED_SHORT, UNSIGNED_INT].contains(&kind)
            {
                return Err(Issue::error(
                    Code::AccessorType,
                    pointer(accessor),
                    "not a SCALAR of unsigned integers",
                ));
            }
            Ok(unsigned(&bytes, kind))
        };
        read().map_err(|issue| issue.in_file(self.name()))
    }

    /// The bytes of a SCALAR accessor of unsigned bytes.
    pub(crate) fn read_bytes(&self, accessor: usize) -> Result<Vec<u8>, Error> {
        let (json, bytes) = self.packed(accessor).map_err(|issue| issue.in_file(self.name()))?;
        if self.accessor_type(accessor) != "SCALAR" || count(json, "componentType") != Some(UNSIGNED_BYTE) {
            let message = String::from("not a SCALAR of unsigned bytes");
            return Err(self.refuse(Code::AccessorType, accessor, message));
        }
        Ok(bytes)
    }

    /// Indices of vertices, each below `vertex_count`.
    pub fn read_indices(&self, accessor: usize, vertex_count: usize) -> Result<Vec<u32>, Error> {
        let indices = self.read_u32(accessor)?;
        match indices.iter().position(|&index| index as usize >= vertex_count) {
            None => Ok(indices),
            Some(element) => Err(self.refuse(
                Code::VertexIndex,
                accessor,
                format!("element {element} is vertex {}, but there are {vertex_count}", indices[element]),
            )),
        }
    }

    fn refuse(&self, code: Code, accessor: usize, message: String) -> Error {
        Issue::error(code, pointer(accessor), message).in_file(self.name())
    }

    fn accessor_type(&self, accessor: usize) -> &str {
        let json = array(self.json(), "/accessors").get(accessor);
        json.and_then(|json| json.get("type")?.as_str()).unwrap_or_default()
    }

    fn vectors<const N: usize>(&self, accessor: usize, kind: &str) -> Result<Vec<[f32; N]>, Error> {
        let found = self.accessor_type(accessor);
        if found != kind && !found.is_empty() {
            return Err(self.refuse(
                Code::AccessorType,
                accessor,
                format!("the type is {found}, not {kind}"),
            ));
        }
        let floats = self.read_floats(accessor)?;
        Ok(floats.chunks_exact(N).filter_map(|chunk| chunk.try_into().ok()).collect())
    }

    fn floats(&self, accessor: usize) -> Result<Vec<f32>, Issue> {
        let (json, bytes) = self.packed(accessor)?;
        let kind = count(json, "componentType").unwrap_or_default();
        let normalized = json.get("normalized").and_then(Value::as_bool).unwrap_or(false);
        let (columns, rows) = columns_and_rows(self.accessor_type(accessor));
        let (padded, used) =
            (column_bytes(columns, rows, component_bytes(kind)), rows * component_bytes(kind));
        if padded == used {
            return Ok(to_floats(&bytes, kind, normalized));
        }
        let columns = bytes.chunks_exact(padded as usize).flat_map(|column| &column[..used as usize]);
        Ok(to_floats(&columns.copied().collect::<Vec<u8>>(), kind, normalized))
    }

    /// The elements of an accessor one after the other, sparse values in their places.
    fn packed(&self, accessor: usize) -> Result<(&Value, Vec<u8>), Issue> {
        let pointer = pointer(accessor);
        let json = array(self.json(), "/accessors").get(accessor).ok_or_else(|| {
            Issue::error(Code::IndexOutOfRange, "/accessors", format!("there is no accessor {accessor}"))
        })?;
        let elements = count(json, "count").unwrap_or_default() as usize;
        let bytes = element_bytes(json) as usize;
        let mut packed = match index(json, "bufferView") {
            Some(view) => {
                self.gather(&Run { owner: json, view, elements, bytes, may_stride: true }, &pointer)?
            }
            None => vec![0; elements * bytes],
        };
        if let Some(sparse) = json.get("sparse") {
            self.apply_sparse(sparse, bytes, &mut packed, &pointer)?;
        }
        Ok((json, packed))
    }

    fn apply_sparse(
        &self,
        sparse: &Value,
        bytes: usize,
        packed: &mut [u8],
        pointer: &str,
    ) -> Result<(), Issue> {
        let elements = count(sparse, "count").unwrap_or_default() as usize;
        let run = |key: &str, bytes| {
            let owner = sparse.get(key).unwrap_or(&Value::Null);
            let view = index(owner, "bufferView").unwrap_or(usize::MAX);
            self.gather(
                &Run { owner, view, elements, bytes, may_stride: false },
                &format!("{pointer}/sparse/{key}"),
            )
        };
        let kind =
            sparse.get("indices").and_then(|indices| count(indices, "componentType")).unwrap_or_default();
        let indices = unsigned(&run("indices", component_bytes(kind) as usize)?, kind);
        let values = run("values", bytes)?;
        for (&index, value) in indices.iter().zip(values.chunks_exact(bytes)) {
            let start = (index as usize).saturating_mul(bytes);
            let Some(element) = packed.get_mut(start..start.saturating_add(bytes)) else {
                let message = format!("index {index} is beyond the accessor's elements");
                return Err(Issue::error(Code::SparseIndex, format!("{pointer}/sparse/indices"), message));
            };
            element.copy_from_slice(value);
        }
        Ok(())
    }

    /// Copies elements out of a buffer view, without the gaps between them.
    fn gather(&self, run: &Run<'_>, pointer: &str) -> Result<Vec<u8>, Issue> {
        let Run { owner, view, elements, bytes, may_stride } = *run;
        let data = self.view_bytes(view)?;
        let json = array(self.json(), "/bufferViews").get(view).unwrap_or(&Value::Null);
        let stride = may_stride.then(|| view_stride(json)).flatten().map_or(bytes, |stride| stride as usize);
        let offset = count(owner, "byteOffset").unwrap_or_default() as usize;
        let short = || Issue::error(Code::AccessorOutOfRange, pointer, "the data is cut off");
        let data = data.get(offset..).ok_or_else(short)?;
        if stride == bytes {
            return Ok(data.get(..elements * bytes).ok_or_else(short)?.to_vec());
        }
        let mut packed = Vec::with_capacity(elements * bytes);
        for element in 0..elements {
            let start = element * stride;
            packed.extend_from_slice(data.get(start..start + bytes).ok_or_else(short)?);
        }
        Ok(packed)
    }
}

/// A run of elements in a buffer view.
struct Run<'a> {
    /// Has the `byteOffset`.
    owner: &'a Value,
    view: usize,
    elements: usize,
    /// Bytes of one element.
    bytes: usize,
    may_stride: bool,
}

fn pointer(accessor: usize) -> String {
    format!("/accessors/{accessor}")
}

fn unsigned(bytes: &[u8], component_type: u64) -> Vec<u32> {
    match component_type {
        UNSIGNED_BYTE => bytes.iter().map(|&byte| u32::from(byte)).collect(),
        UNSIGNED_SHORT => words(bytes, u16::from_le_bytes).map(u32::from).collect(),
        _ => words(bytes, u32::from_le_bytes).collect(),
    }
}

/// glTF 2.0 specification, section 3.6.2.2: how normalised integers are decoded.
fn to_floats(bytes: &[u8], component_type: u64, normalized: bool) -> Vec<f32> {
    let signed = |max: f32| move |value: f32| if normalized { (value / max).max(-1.0) } else { value };
    let unsigned = |max: f32| move |value: f32| if normalized { value / max } else { value };
    match component_type {
        5120 => bytes.iter().map(|&byte| f32::from(byte as i8)).map(signed(127.0)).collect(),
        UNSIGNED_BYTE => bytes.iter().map(|&byte| f32::from(byte)).map(unsigned(255.0)).collect(),
        5122 => words(bytes, i16::from_le_bytes).map(f32::from).map(signed(32767.0)).collect(),
        UNSIGNED_SHORT => words(bytes, u16::from_le_bytes).map(f32::from).map(unsigned(65535.0)).collect(),
        UNSIGNED_INT => words(bytes, u32::from_le_bytes).map(|value| value as f32).collect(),
        _ => words(bytes, f32::from_le_bytes).collect(),
    }
}

fn words<const N: usize, T>(bytes: &[u8], convert: fn([u8; N]) -> T) -> impl Iterator<Item = T> {
    bytes.as_chunks::<N>().0.iter().map(move |&word| convert(word))
}
