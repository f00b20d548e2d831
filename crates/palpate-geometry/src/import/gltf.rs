//! glTF 2.0 import, `.gltf` or `.glb`: the triangles of the default scene, or of all root nodes if
//! there is none. The format's up (+y) becomes z and its front (+z) becomes y, so that a model is
//! upright and faces the finger. Skins, morph targets and animations are not applied.
//!
//! Only the JSON model of the `gltf` crate is used: its readers and its validation panic on some
//! invalid documents.

use gltf::json::mesh::{Mode, Primitive, Semantic};
use gltf::json::scene::Node;
use gltf::json::validation::Checked;
use gltf::json::{Index, Mesh, Root};
use nalgebra::{Matrix4, Point3, Quaternion, UnitQuaternion, Vector3};

use super::accessor::{Document, find};
use super::source::Source;
use crate::raw::RawMesh;
use palpate_input::error::InputError;
use palpate_input::files::without_bom;
use palpate_input::format;

/// Prefixes of extensions that do not affect the geometry.
const HARMLESS_EXTENSIONS: [&str; 4] =
    ["KHR_materials_", "KHR_texture_", "KHR_lights_", "EXT_texture_"];

/// Transform from glTF's frame to this crate's: (x, y, z) becomes (-x, z, y).
#[rustfmt::skip]
const UPRIGHT: Matrix4<f64> = Matrix4::new(
    -1.0, 0.0, 0.0, 0.0,
     0.0, 0.0, 1.0, 0.0,
     0.0, 1.0, 0.0, 0.0,
     0.0, 0.0, 0.0, 1.0,
);

/// Reads a glTF file.
pub(super) fn read(source: &Source) -> Result<RawMesh, InputError> {
    let (root, chunk) = parse(source.bytes)?;
    let harmless = |name: &&String| HARMLESS_EXTENSIONS.iter().any(|known| name.starts_with(known));
    if let Some(name) = root.extensions_required.iter().find(|name| !harmless(name)) {
        let problem = format!("needs the extension \"{name}\", which is not supported");
        return Err(InputError::new(problem));
    }
    let document = Document::load(source, root, chunk)?;
    let mut raw = RawMesh::default();
    for (node, x_sn) in placed_nodes(&document.root)? {
        if let Some(mesh) = find(&document.root.nodes, "node", node)?.mesh {
            add_mesh(&document, node, mesh, &x_sn, &mut raw)?;
        }
    }
    Ok(raw)
}

fn parse(bytes: &[u8]) -> Result<(Root, Option<Vec<u8>>), InputError> {
    if !bytes.starts_with(b"glTF") {
        return Ok((root(without_bom(bytes))?, None));
    }
    // The crate subtracts the header's size from the stated length without a check.
    if let Some(&[a, b, c, d]) = bytes.get(8..12).and_then(<[u8]>::first_chunk) {
        let length = u32::from_le_bytes([a, b, c, d]);
        if length < 12 {
            return Err(InputError::new(format!(
                "binary container: a length of {length} bytes is shorter than its header"
            )));
        }
    }
    let container = gltf::Glb::from_slice(bytes)
        .map_err(|error| InputError::new(format!("binary container: {error}")))?;
    Ok((root(&container.json)?, container.bin.map(Into::into)))
}

fn root(json: &[u8]) -> Result<Root, InputError> {
    Root::from_slice(json).map_err(|error| {
        let (line, column) = (error.line(), error.column());
        InputError::new(format!("JSON: line {line}, column {column}: {}", format::json(&error)))
    })
}

/// A node with its pose.
type PlacedNode = (Index<Node>, Matrix4<f64>);

/// Returns the nodes of the scene, parents before children, each with its pose in the upright frame
/// S: the point p of a node N is `x_sn` p in S.
fn placed_nodes(root: &Root) -> Result<Vec<PlacedNode>, InputError> {
    let roots = match root.scene {
        Some(scene) => find(&root.scenes, "scene", scene)?.nodes.clone(),
        None => orphans(root)?,
    };
    let mut reached = vec![false; root.nodes.len()];
    let mut waiting: Vec<_> = roots.iter().rev().map(|&node| (node, UPRIGHT)).collect();
    let mut placed = Vec::new();
    while let Some((index, parent)) = waiting.pop() {
        let node = find(&root.nodes, "node", index)?;
        if std::mem::replace(&mut reached[index.value()], true) {
            return Err(not_a_tree(index.value()));
        }
        let x_sn = parent * local_pose(index, node)?;
        let children = node.children.iter().flatten().rev();
        waiting.extend(children.map(|&child| (child, x_sn)));
        placed.push((index, x_sn));
    }
    Ok(placed)
}

fn not_a_tree(node: usize) -> InputError {
    InputError::new(format!("node {node} is reached twice; nodes must form a tree"))
}

/// Returns the nodes without a parent. If every node has one, they form a cycle.
fn orphans(root: &Root) -> Result<Vec<Index<Node>>, InputError> {
    let mut is_child = vec![false; root.nodes.len()];
    for &child in root.nodes.iter().flat_map(|node| node.children.iter().flatten()) {
        find(&root.nodes, "node", child)?;
        is_child[child.value()] = true;
    }
    let orphans: Vec<_> = (0u32..)
        .zip(&is_child)
        .filter(|&(_, is_child)| !is_child)
        .map(|(node, _)| Index::new(node))
        .collect();
    if orphans.is_empty() && !is_child.is_empty() {
        return Err(not_a_tree(0));
    }
    Ok(orphans)
}

/// Returns the pose of a node in its parent.
fn local_pose(index: Index<Node>, node: &Node) -> Result<Matrix4<f64>, InputError> {
    if let Some(columns) = node.matrix {
        let matrix = Matrix4::from_column_slice(&columns.map(f64::from));
        let last_row = [matrix[(3, 0)], matrix[(3, 1)], matrix[(3, 2)], matrix[(3, 3)]];
        if last_row != [0.0, 0.0, 0.0, 1.0] {
            return Err(InputError::new(format!(
                "the matrix of node {index} is not affine: its last row is {last_row:?}"
            )));
        }
        return Ok(matrix);
    }
    let f64s = |vector: Option<[f32; 3]>| vector.map(|v| Vector3::from(v.map(f64::from)));
    let [i, j, k, w] = node.rotation.unwrap_or_default().0.map(f64::from);
    let rotation = UnitQuaternion::from_quaternion(Quaternion::new(w, i, j, k));
    let translation = f64s(node.translation).unwrap_or_default();
    let scale = f64s(node.scale).unwrap_or_else(|| Vector3::repeat(1.0));
    Ok(Matrix4::new_translation(&translation)
        * rotation.to_homogeneous()
        * Matrix4::new_nonuniform_scaling(&scale))
}

fn add_mesh(
    document: &Document,
    node: Index<Node>,
    index: Index<Mesh>,
    x_sn: &Matrix4<f64>,
    raw: &mut RawMesh,
) -> Result<(), InputError> {
    let mesh = find(&document.root.meshes, "mesh", index)?;
    let mirrored = x_sn.fixed_view::<3, 3>(0, 0).determinant() < 0.0;
    for (number, primitive) in mesh.primitives.iter().enumerate() {
        let label = match &mesh.name {
            Some(name) => format!("primitive {number} of mesh {index} \"{name}\" at node {node}"),
            None => format!("primitive {number} of mesh {index} at node {node}"),
        };
        let incomplete = |what| InputError::new(format!("{label} has no {what}"));
        let Checked::Valid(mode) = primitive.mode else {
            return Err(incomplete("known mode"));
        };
        if !matches!(mode, Mode::Triangles | Mode::TriangleStrip | Mode::TriangleFan) {
            raw.skipped_primitives += 1;
            continue;
        }
        let positions = primitive.attributes.get(&Checked::Valid(Semantic::Positions));
        let positions = document.positions(*positions.ok_or_else(|| incomplete("positions"))?)?;
        let corners = corners(document, primitive, positions.len())?;
        let place = |p: [f32; 3]| x_sn.transform_point(&Point3::from(p.map(f64::from)));
        let triangles =
            assemble(mode, &corners).map(|[a, b, c]| if mirrored { [a, c, b] } else { [a, b, c] });
        raw.add_part(label, positions.into_iter().map(place), triangles)?;
    }
    Ok(())
}

/// Returns the vertices of a primitive in drawing order.
fn corners(
    document: &Document,
    primitive: &Primitive,
    vertices: usize,
) -> Result<Vec<u32>, InputError> {
    match primitive.indices {
        Some(indices) => document.indices(indices),
        None => Ok((0..vertices as u32).collect()),
    }
}

/// Returns the triangles of a list, strip or fan. Corners that do not fill a triangle are dropped.
fn assemble(mode: Mode, corners: &[u32]) -> Box<dyn Iterator<Item = [u32; 3]> + '_> {
    match mode {
        Mode::TriangleStrip => {
            let windows = corners.array_windows().enumerate();
            Box::new(windows.map(|(i, &[a, b, c])| if i % 2 == 0 { [a, b, c] } else { [a, c, b] }))
        }
        Mode::TriangleFan => {
            let hub = corners.first().copied().unwrap_or_default();
            let rim = corners.get(1..).unwrap_or_default();
            Box::new(rim.array_windows().map(move |&[b, c]| [hub, b, c]))
        }
        _ => Box::new(corners.as_chunks().0.iter().copied()),
    }
}
