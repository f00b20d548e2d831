//! Binary data of a glTF document: buffers, buffer views, accessors.
//!
//! Every offset, stride and count is checked against the available bytes before anything is read or
//! allocated.

use std::io;
use std::path::{Path, PathBuf, absolute};

use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use gltf::json::accessor::{Accessor, ComponentType, Type};
use gltf::json::validation::Checked;
use gltf::json::{Buffer, Index, Root};

use super::source::{BYTES_MAX, Source};
use palpate_input::error::InputError;
use palpate_input::files;

/// A glTF document with the bytes of its buffers.
pub(super) struct Document {
    pub root: Root,
    buffers: Vec<Vec<u8>>,
}

/// Type that the elements of an accessor must have.
pub(super) struct Expected {
    pub words: &'static str,
    pub kind: Type,
    /// Whether a type of the components is accepted, normalized or not.
    pub accepts: fn(ComponentType, bool) -> bool,
}

/// Type of vertex indices.
const INDICES: Expected = Expected {
    words: "unsigned SCALAR",
    kind: Type::Scalar,
    accepts: |component, is_normalized| unsigned_size(component).is_some() && !is_normalized,
};

/// Elements of an accessor in memory.
struct Elements<'a> {
    bytes: &'a [u8],
    stride: usize,
    size: usize,
    count: usize,
}

impl<'a> Elements<'a> {
    fn iter(&self) -> impl Iterator<Item = &'a [u8]> {
        let (bytes, stride, size) = (self.bytes, self.stride, self.size);
        (0..self.count).filter_map(move |element| bytes.get(element * stride..)?.get(..size))
    }
}

impl Document {
    /// Loads the buffers of `root`: from the binary chunk, from data URIs, or from files.
    pub fn load(
        source: &Source,
        root: Root,
        mut chunk: Option<Vec<u8>>,
    ) -> Result<Self, InputError> {
        let mut buffers = Vec::with_capacity(root.buffers.len());
        let mut left = BYTES_MAX;
        for (number, buffer) in root.buffers.iter().enumerate() {
            let bytes = match &buffer.uri {
                Some(uri) => fetch(source, uri, left),
                None => chunk.take().ok_or_else(|| without_data(buffer)),
            };
            let declared = buffer.byte_length.0;
            let checked = bytes.and_then(|bytes| match bytes.len() {
                actual if declared > actual as u64 => {
                    Err(InputError::new(format!("{declared} bytes declared, {actual} present")))
                }
                _ => Ok(bytes),
            });
            let bytes =
                checked.map_err(|reason| InputError::new(format!("buffer {number}: {reason}")))?;
            // Several buffers may refer to one large file.
            left = left.saturating_sub(bytes.len() as u64);
            buffers.push(bytes);
        }
        Ok(Self { root, buffers })
    }

    /// Returns the elements of an accessor, each of `N` numbers.
    pub fn numbers<const N: usize>(
        &self,
        index: Index<Accessor>,
        expected: &Expected,
    ) -> Result<Vec<[f64; N]>, InputError> {
        let values = self.values(index, expected)?;
        let component = self.component(index)?;
        let is_normalized = find(&self.root.accessors, "accessor", index)?.normalized;
        let numbers = values.chunks_exact(component.size());
        let numbers: Vec<f64> = numbers.map(|it| number(it, component, is_normalized)).collect();
        Ok(numbers.as_chunks().0.to_vec())
    }

    /// Returns vertex indices.
    pub fn indices(&self, index: Index<Accessor>) -> Result<Vec<u32>, InputError> {
        let values = self.values(index, &INDICES)?;
        let size = self.component(index)?.size();
        Ok(values.chunks_exact(size).map(unsigned).collect())
    }

    /// Whether an accessor refers to data; without them all its elements are zero.
    pub fn has_data(&self, index: Index<Accessor>) -> Result<bool, InputError> {
        let accessor = find(&self.root.accessors, "accessor", index)?;
        Ok(accessor.buffer_view.is_some() || accessor.sparse.is_some())
    }

    fn component(&self, index: Index<Accessor>) -> Result<ComponentType, InputError> {
        let accessor = find(&self.root.accessors, "accessor", index)?;
        match accessor.component_type {
            Checked::Valid(component) => Ok(component.0),
            Checked::Invalid => Err(wrong_type(index.value(), "a known component type")),
        }
    }

    /// Returns all elements of an accessor, tightly packed, with sparse values in place.
    fn values(&self, index: Index<Accessor>, expected: &Expected) -> Result<Vec<u8>, InputError> {
        let number = index.value();
        let wrong_type = || wrong_type(number, expected.words);
        let accessor = find(&self.root.accessors, "accessor", index)?;
        let component = self.component(index)?;
        let Checked::Valid(kind) = accessor.type_ else { return Err(wrong_type()) };
        if kind != expected.kind || !(expected.accepts)(component, accessor.normalized) {
            return Err(wrong_type());
        }
        let size = component.size() * kind.multiplicity();
        let count = accessor.count.0;
        let mut values = match accessor.buffer_view {
            Some(view) => {
                let offset = accessor.byte_offset.unwrap_or_default().0;
                self.elements(number, view, offset, size, count)?
                    .iter()
                    .flatten()
                    .copied()
                    .collect()
            }
            // Zeros, to be replaced by sparse values: the count is not backed by data, so it may
            // not exceed the bytes of the whole file.
            None if count > self.buffers.iter().map(Vec::len).sum::<usize>() as u64 => {
                return Err(InputError::new(format!(
                    "accessor {number} declares {count} elements and no data"
                )));
            }
            None => vec![0; count as usize * size],
        };
        self.replace_sparse(number, accessor, size, &mut values)?;
        Ok(values)
    }

    fn replace_sparse(
        &self,
        number: usize,
        accessor: &Accessor,
        size: usize,
        values: &mut [u8],
    ) -> Result<(), InputError> {
        let Some(sparse) = &accessor.sparse else { return Ok(()) };
        let (places, news) = (&sparse.indices, &sparse.values);
        let component = match places.component_type {
            Checked::Valid(component) => unsigned_size(component.0),
            Checked::Invalid => None,
        };
        let place_size = component.ok_or_else(|| wrong_type(number, "unsigned sparse indices"))?;
        let count = sparse.count.0;
        let places =
            self.elements(number, places.buffer_view, places.byte_offset.0, place_size, count)?;
        let news = self.elements(number, news.buffer_view, news.byte_offset.0, size, count)?;
        let elements = values.len() / size;
        for (place, new) in places.iter().map(unsigned).zip(news.iter()) {
            let old = values.chunks_exact_mut(size).nth(place as usize);
            let out_of_range = || {
                InputError::new(format!("accessor {number} replaces element {place} of {elements}"))
            };
            old.ok_or_else(out_of_range)?.copy_from_slice(new);
        }
        Ok(())
    }

    /// Returns `count` elements of `size` bytes from `offset` within a buffer view.
    fn elements(
        &self,
        accessor: usize,
        view: Index<gltf::json::buffer::View>,
        offset: u64,
        size: usize,
        count: u64,
    ) -> Result<Elements<'_>, InputError> {
        let number = view.value();
        let view = find(&self.root.buffer_views, "buffer view", view)?;
        let buffer = find(&self.buffers, "buffer", view.buffer)?;
        let start = view.byte_offset.unwrap_or_default().0;
        let end = u128::from(start) + u128::from(view.byte_length.0);
        let bytes = usize::try_from(end)
            .ok()
            .and_then(|end| buffer.get(start as usize..end))
            .ok_or_else(|| {
                let available = buffer.len();
                InputError::new(format!(
                    "buffer view {number} reaches byte {end} of a buffer of {available}"
                ))
            })?;
        let stride = view.byte_stride.map_or(0, |stride| stride.0).max(size);
        let needed = match count {
            0 => 0,
            _ => u128::from(offset) + u128::from(count - 1) * stride as u128 + size as u128,
        };
        if needed > bytes.len() as u128 {
            let available = bytes.len();
            return Err(InputError::new(format!(
                "accessor {accessor} needs {needed} bytes of buffer view {number}, which has \
                 {available}"
            )));
        }
        let bytes = bytes.get(offset as usize..).unwrap_or_default();
        Ok(Elements { bytes, stride, size, count: count as usize })
    }
}

/// Returns the error of a buffer without data: an extension compresses them, or they are missing.
fn without_data(buffer: &Buffer) -> InputError {
    match buffer.extensions.as_ref().and_then(|all| all.others.keys().next()) {
        Some(name) => {
            InputError::new(format!("has no data: the extension \"{name}\" is not supported"))
        }
        None => InputError::new("the file has no binary chunk"),
    }
}

/// Returns the object at a document's index.
pub(super) fn find<'a, T, K>(
    objects: &'a [T],
    kind: &str,
    index: Index<K>,
) -> Result<&'a T, InputError> {
    let missing = || InputError::new(format!("{kind} {} does not exist", index.value()));
    objects.get(index.value()).ok_or_else(missing)
}

fn wrong_type(accessor: usize, expected: &str) -> InputError {
    InputError::new(format!("accessor {accessor} must hold {expected}"))
}

fn unsigned_size(component: ComponentType) -> Option<usize> {
    match component {
        ComponentType::U8 | ComponentType::U16 | ComponentType::U32 => Some(component.size()),
        ComponentType::I8 | ComponentType::I16 | ComponentType::F32 => None,
    }
}

/// Decodes a little-endian number of one to four bytes.
fn unsigned(bytes: &[u8]) -> u32 {
    bytes.iter().rev().fold(0, |number, &byte| (number << 8) | u32::from(byte))
}

/// Decodes a component. A normalized integer is divided by its largest value, as section 3.6.2.2 of
/// the specification of glTF 2.0 says.
fn number(bytes: &[u8], component: ComponentType, is_normalized: bool) -> f64 {
    let bits = unsigned(bytes);
    let (number, largest): (f64, f64) = match component {
        ComponentType::I8 => (f64::from(bits as i8), i8::MAX.into()),
        ComponentType::U8 => (f64::from(bits as u8), u8::MAX.into()),
        ComponentType::I16 => (f64::from(bits as i16), i16::MAX.into()),
        ComponentType::U16 => (f64::from(bits as u16), u16::MAX.into()),
        ComponentType::U32 => (f64::from(bits), u32::MAX.into()),
        ComponentType::F32 => return f32::from_bits(bits).into(),
    };
    if is_normalized { f64::max(number / largest, -1.0) } else { number }
}

fn fetch(source: &Source, uri: &str, most: u64) -> Result<Vec<u8>, InputError> {
    let unknown = || InputError::new("its URI is neither base64 data nor a path");
    if let Some(data) = uri.strip_prefix("data:") {
        let (_, encoded) = data.split_once(";base64,").ok_or_else(unknown)?;
        let decoded = STANDARD.decode(encoded);
        return decoded.map_err(|error| InputError::new(format!("base64: {error}")));
    }
    let name = percent_decoded(uri).filter(|name| !name.contains("://")).ok_or_else(unknown)?;
    let path = source.path.with_file_name("").join(&name);
    let unreadable = |error| InputError::new(format!("{} cannot be read: {error}", path.display()));
    // The actual location: `..` and links may lead anywhere.
    let real = path.canonicalize().map_err(unreadable)?;
    let folder = folder(source.path).map_err(unreadable)?;
    if !source.allow_external_buffers && !real.starts_with(folder) {
        return Err(InputError::new(format!(
            "{} lies outside the mesh's folder; to allow it, set \
             object.allow_external_buffers = true in the scene, or use --allow-external-buffers",
            real.display()
        )));
    }
    files::bytes(&real, most).map_err(unreadable)
}

/// Returns the folder of a file, with links resolved.
fn folder(file: &Path) -> io::Result<PathBuf> {
    absolute(file)?.with_file_name("").canonicalize()
}

/// Decodes percent escapes such as `%20`; returns `None` if the result is not UTF-8.
fn percent_decoded(uri: &str) -> Option<String> {
    let mut parts = uri.split('%');
    let mut bytes = parts.next()?.as_bytes().to_vec();
    for part in parts {
        bytes.push(u8::from_str_radix(part.get(..2)?, 16).ok()?);
        bytes.extend_from_slice(part.get(2..)?.as_bytes());
    }
    String::from_utf8(bytes).ok()
}
