//! Why a mesh was refused.

use std::io;
use std::path::PathBuf;

use thiserror::Error;

use super::element::Element;
use crate::words;

/// A file that gave no mesh: which file, and what is wrong with it.
#[derive(Debug, Error)]
#[error("{}: {fault}", path.display())]
pub struct MeshError {
    /// The file that was asked for.
    pub path: PathBuf,
    /// What is wrong with it.
    pub fault: MeshFault,
}

/// What is wrong with a mesh, or with the file that should hold one.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum MeshFault {
    /// The file cannot be opened or read: it is missing, forbidden, a folder, a pipe.
    #[error("cannot be read: {0}")]
    Unreadable(#[from] io::Error),
    /// No importer knows this extension.
    #[error("is a \".{extension}\" file; supported: {}", supported.join(", "))]
    UnsupportedExtension {
        /// What follows the last dot of the file name, in lower case.
        extension: String,
        /// The extensions that have an importer.
        supported: Vec<&'static str>,
    },
    /// The scale is not a positive, finite number.
    #[error("the scale is {metres_per_unit} metres per unit; it must be positive and finite")]
    BadScale {
        /// The scale asked for.
        metres_per_unit: f64,
    },
    /// A line of a text format cannot be parsed.
    #[error("line {line}: expected {expected}, found \"{found}\"")]
    Line {
        /// The line, from 1.
        line: usize,
        /// What should be there.
        expected: &'static str,
        /// What is there, cut if long.
        found: String,
    },
    /// A binary STL file is not as long as its number of triangles asks for.
    #[error(
        "STL: {actual} bytes, which is no text that begins with \"solid\", and binary with {count} triangles \
         takes {needed}"
    )]
    StlLength {
        /// The number of triangles it states, or 0 if it is too short to.
        count: u32,
        /// The bytes these take.
        needed: u64,
        /// The bytes that are there.
        actual: usize,
    },
    /// The STL parser refuses the file as a whole.
    #[error("STL: {0}")]
    Stl(io::Error),
    /// The PLY file itself is at fault.
    #[error(transparent)]
    Ply(#[from] PlyFault),
    /// A cloud of points, as a scan writes it.
    #[error(
        "holds {points} points and no faces, as a scan does; to be touched it needs a surface: a mesh"
    )]
    PointsOnly {
        /// How many points.
        points: usize,
    },
    /// The OBJ parser refuses the file as a whole.
    #[error("OBJ: {0}")]
    Obj(#[from] tobj::LoadError),
    /// A face of a text format names a vertex that is not there.
    #[error("line {line}: vertex {index} of a face is out of range: there are {vertices} vertices")]
    FaceIndexOutOfRange {
        /// The line, from 1.
        line: usize,
        /// The index as written: from 1, or negative from the latest vertex.
        index: i64,
        /// How many vertices it could name.
        vertices: usize,
    },
    /// The glTF document itself is at fault.
    #[error(transparent)]
    Gltf(#[from] GltfFault),
    /// There is no triangle.
    #[error("holds no triangles ({skipped_primitives} primitives of points or lines were skipped)")]
    Empty {
        /// How many primitives were left out because they hold points or lines.
        skipped_primitives: usize,
    },
    /// There are more elements than any real scan holds.
    #[error("holds more than {limit} {what}")]
    TooLarge {
        /// "vertices" or "triangles".
        what: &'static str,
        /// The most that is accepted.
        limit: usize,
    },
    /// A triangle names a vertex that is not there.
    #[error("triangle {triangle} names vertex {index}, but there are {vertices}")]
    IndexOutOfRange {
        /// The triangle at fault.
        triangle: Element,
        /// The index it holds.
        index: u32,
        /// How many vertices it could name.
        vertices: usize,
    },
    /// A coordinate is infinite or not a number.
    #[error("vertex {vertex} is not finite: {position_m:?}")]
    NonFinite {
        /// The vertex at fault.
        vertex: Element,
        /// Its coordinates, in metres.
        position_m: [f64; 3],
    },
    /// A coordinate is too large for anything a finger could touch.
    #[error(
        "vertex {vertex} lies {coordinate_m:e} m from the origin, more than {limit_m} m{}",
        likely_unit.map(|unit| format!("; for a file in {unit} say unit = \"{unit}\"")).unwrap_or_default()
    )]
    TooFar {
        /// The vertex at fault.
        vertex: Element,
        /// Its coordinate of largest magnitude, in metres.
        coordinate_m: f64,
        /// The largest magnitude that is accepted.
        limit_m: f64,
        /// The unit that would bring it in range, if there is one.
        likely_unit: Option<&'static str>,
    },
    /// No triangle has an area.
    #[error("all {triangles} triangles are degenerate")]
    AllDegenerate {
        /// How many triangles there were.
        triangles: usize,
    },
}

/// What is wrong with a PLY file.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum PlyFault {
    /// An element is declared more often than the file has bytes.
    #[error("PLY: declares {count} of element \"{element}\", more than the file has bytes")]
    Count {
        /// The element.
        element: String,
        /// How many are declared.
        count: usize,
    },
    /// An element lacks what it is read for.
    #[error("PLY: element \"{element}\" must have {needed}")]
    Lacks {
        /// The element.
        element: String,
        /// The properties it needs.
        needed: &'static str,
    },
    /// Binary elements cannot be parsed.
    #[error("PLY: {0}")]
    Binary(String),
    /// The header declares less than the file holds.
    #[error("PLY: holds {left} bytes more than its header declares")]
    Rest {
        /// How many bytes are left over.
        left: usize,
    },
}

/// What is wrong with a glTF document. Numbers count from 0, as in the document.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum GltfFault {
    /// The JSON cannot be parsed.
    #[error("JSON: line {}, column {}: {}", .0.line(), .0.column(), words::json(.0))]
    Json(#[from] gltf::json::Error),
    /// The binary container is broken.
    #[error("binary container: {0}")]
    Container(gltf::Error),
    /// The binary container says it is shorter than its own header.
    #[error("binary container: a length of {length} bytes is shorter than its header")]
    ContainerLength {
        /// The length it states.
        length: u32,
    },
    /// The document needs an extension that changes geometry.
    #[error("needs the extension \"{0}\", which is not supported")]
    Extension(String),
    /// Something refers to an object that is not in the document.
    #[error("{kind} {index} does not exist")]
    Missing {
        /// What kind of object.
        kind: &'static str,
        /// Its index.
        index: usize,
    },
    /// A primitive has no usable positions or no usable mode.
    #[error("{primitive} has no {what}")]
    Incomplete {
        /// The primitive at fault.
        primitive: String,
        /// What it lacks.
        what: &'static str,
    },
    /// A node is its own ancestor, or has two parents.
    #[error("node {node} is reached twice; nodes must form a tree")]
    NotATree {
        /// The node.
        node: usize,
    },
    /// A node's matrix is not an affine transform.
    #[error("the matrix of node {node} is not affine: its last row is {last_row:?}")]
    NotAffine {
        /// The node.
        node: usize,
        /// The last row of its matrix.
        last_row: [f64; 4],
    },
    /// A buffer's bytes cannot be had.
    #[error("buffer {buffer}: {reason}")]
    Buffer {
        /// The buffer.
        buffer: usize,
        /// Why not.
        reason: BufferFault,
    },
    /// An accessor has the wrong type for its purpose.
    #[error("accessor {accessor} must hold {expected}")]
    AccessorType {
        /// The accessor.
        accessor: usize,
        /// What it should hold.
        expected: &'static str,
    },
    /// An accessor reaches outside the bytes it refers to.
    #[error(
        "accessor {accessor} needs {needed} bytes of buffer view {view}, which has {available}"
    )]
    AccessorOutOfRange {
        /// The accessor.
        accessor: usize,
        /// The buffer view it reads.
        view: usize,
        /// Bytes needed from the start of the view.
        needed: u128,
        /// Bytes that are there.
        available: usize,
    },
    /// An accessor without a buffer view declares more elements than the file has bytes.
    #[error("accessor {accessor} declares {count} elements and no data")]
    AccessorCount {
        /// The accessor.
        accessor: usize,
        /// The elements it declares.
        count: u64,
    },
    /// A sparse accessor replaces an element that is not there.
    #[error("accessor {accessor} replaces element {index} of {count}")]
    SparseIndex {
        /// The accessor.
        accessor: usize,
        /// The element it replaces.
        index: u32,
        /// How many elements it has.
        count: usize,
    },
    /// A buffer view reaches outside its buffer.
    #[error("buffer view {view} reaches byte {end} of a buffer of {available}")]
    ViewOutOfRange {
        /// The buffer view.
        view: usize,
        /// Where it ends.
        end: u128,
        /// Bytes in the buffer.
        available: usize,
    },
}

/// Why a glTF buffer's bytes cannot be had.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum BufferFault {
    /// The document refers to the binary chunk, and there is none.
    #[error("the file has no binary chunk")]
    NoChunk,
    /// The URI is neither a base64 data URI nor a path.
    #[error("its URI is neither base64 data nor a path")]
    Uri,
    /// The data URI is not valid base64.
    #[error("base64: {0}")]
    Base64(#[from] base64::DecodeError),
    /// The file lies outside the document's folder.
    #[error(
        "{} lies outside the mesh's folder; if that is meant, allow it by object.outside_buffers = true in a \
         scene, or by --outside-buffers", path.display()
    )]
    Outside {
        /// The file, without links.
        path: PathBuf,
    },
    /// The file cannot be read.
    #[error("{} cannot be read: {error}", path.display())]
    File {
        /// The file.
        path: PathBuf,
        /// What went wrong.
        error: io::Error,
    },
    /// There are fewer bytes than the document declares.
    #[error("{declared} bytes declared, {actual} present")]
    Short {
        /// Bytes declared.
        declared: u64,
        /// Bytes present.
        actual: usize,
    },
}
