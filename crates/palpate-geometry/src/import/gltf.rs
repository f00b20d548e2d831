//! glTF 2.0 import, `.gltf` or `.glb`: the triangles of the default scene, or of all root nodes if
//! there is none, in the pose that the file stores. Instances, morph targets and skins are applied;
//! animations, variants and coarser levels of detail are not.
//!
//! The format's up (+y) becomes z and its front (+z) becomes y, so that a model is upright and
//! faces the finger; without [`Source::upright`] it keeps the frame of the file.
//!
//! Only the JSON model of the `gltf` crate is used: its readers and its validation panic on some
//! invalid documents.

use gltf::json::accessor::{ComponentType, Type};
use gltf::json::deserialize::from_slice;
use gltf::json::mesh::{Mode, Primitive};
use gltf::json::scene::Node;
use gltf::json::serialize::to_vec;
use gltf::json::validation::Checked;
use gltf::json::{Index, Mesh, Root, Value};
use nalgebra::{Matrix4, Quaternion, UnitQuaternion, Vector3};

use super::accessor::{Document, Expected, find};
use super::deform::{Pose, QUANTIZATION, VECTORS, is_mirror, morphed};
use super::source::Source;
use crate::polygon::strip;
use crate::raw::RawMesh;
use palpate_input::error::InputError;
use palpate_input::files::without_bom;
use palpate_input::format;

/// Prefixes of extensions that do not affect the geometry, or that are applied.
const KNOWN_EXTENSIONS: [&str; 10] = [
    "KHR_materials_",
    "KHR_technique",
    "KHR_texture_",
    "KHR_lights_",
    "EXT_texture_",
    "EXT_lights_",
    LEVELS,
    INSTANCING,
    VISIBILITY,
    QUANTIZATION,
];
const INSTANCING: &str = "EXT_mesh_gpu_instancing";
const VISIBILITY: &str = "KHR_node_visibility";
const LEVELS: &str = "MSFT_lod";

const ROTATIONS: Expected = Expected {
    words: "VEC4 of floats or normalized integers",
    kind: Type::Vec4,
    accepts: |component, is_normalized| match component {
        ComponentType::F32 => !is_normalized,
        component => matches!(component, ComponentType::I8 | ComponentType::I16) && is_normalized,
    },
};

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
    let is_known = |name: &&String| KNOWN_EXTENSIONS.iter().any(|known| name.starts_with(known));
    if let Some(name) = root.extensions_required.iter().find(|name| !is_known(name)) {
        let problem = format!("needs the extension \"{name}\", which is not supported");
        return Err(InputError::new(problem));
    }
    let document = Document::load(source, root, chunk)?;
    let x_sf = if source.upright { UPRIGHT } else { Matrix4::identity() };
    let nodes = placed_nodes(&document.root, x_sf)?;
    let mut poses = vec![None; document.root.nodes.len()];
    nodes.iter().for_each(|node| poses[node.index.value()] = Some(node.x_sn));
    let mut raw = RawMesh::default();
    for placed in nodes.iter().filter(|placed| placed.is_visible) {
        let node = find(&document.root.nodes, "node", placed.index)?;
        let Some(mesh) = node.mesh else { continue };
        let pose = |skin| Pose::read(&document, skin, |joint| *poses.get(joint.value())?);
        let placement = match node.skin.map(pose).transpose()? {
            Some(pose) if extension(node, INSTANCING).is_none() => Placement::Skin(pose),
            Some(_) => {
                let node = placed.index;
                let problem =
                    format!("node {node} has a skin and \"{INSTANCING}\": use one of them");
                return Err(InputError::new(problem));
            }
            None => Placement::Poses(instances(&document, placed, node)?),
        };
        add_mesh(&document, placed.index, mesh, &placement, &mut raw)?;
    }
    Ok(raw)
}

fn parse(bytes: &[u8]) -> Result<(Root, Option<Vec<u8>>), InputError> {
    if !bytes.starts_with(b"glTF") {
        return Ok((root(without_bom(bytes))?, None));
    }
    let word = |place: usize| bytes.get(place..)?.first_chunk().map(|&it| u32::from_le_bytes(it));
    if let Some(version) = word(4).filter(|&version| version != 2) {
        return Err(wrong_version(&version.to_string()));
    }
    // The crate subtracts the header's size from the stated length without a check.
    if let Some(length) = word(8).filter(|&length| length < 12) {
        return Err(InputError::new(format!(
            "binary container: a length of {length} bytes is shorter than its header"
        )));
    }
    let container = gltf::Glb::from_slice(bytes)
        .map_err(|error| InputError::new(format!("binary container: {error}")))?;
    Ok((root(&container.json)?, container.bin.map(Into::into)))
}

fn root(json: &[u8]) -> Result<Root, InputError> {
    Root::from_slice(json).or_else(|error| {
        let document: Option<Value> = from_slice(json).ok();
        // Documents of glTF 1.0 have another structure.
        let version = document.as_ref().and_then(|it| it.get("asset")?.get("version")?.as_str());
        if let Some(version) = version.filter(|version| !version.starts_with('2')) {
            return Err(wrong_version(version));
        }
        let (line, column) = (error.line(), error.column());
        let words = format!("JSON: line {line}, column {column}: {}", format::json(&error));
        document.and_then(geometry_only).ok_or_else(|| InputError::new(words))
    })
}

/// Returns a document without the parts that hold no geometry: of these the crate requires
/// properties that are optional, like the target of an animation, and of scenes their nodes.
fn geometry_only(mut document: Value) -> Option<Root> {
    let parts = document.as_object_mut()?;
    for part in ["animations", "cameras", "images", "materials", "samplers", "textures"] {
        parts.remove(part);
    }
    for scene in parts.get_mut("scenes").and_then(Value::as_array_mut).into_iter().flatten() {
        scene.as_object_mut()?.entry("nodes").or_insert_with(|| Value::Array(Vec::new()));
    }
    Root::from_slice(&to_vec(&document).ok()?).ok()
}

fn wrong_version(version: &str) -> InputError {
    InputError::new(format!("is glTF of version {version}; supported is 2.0"))
}

/// A node of the scene: the point p of a node N is `x_sn` p in the scene's frame S.
struct PlacedNode {
    index: Index<Node>,
    x_sn: Matrix4<f64>,
    is_visible: bool,
}

/// Returns the nodes of the scene, parents before children. `x_sf` is the pose of the file's frame
/// in S.
fn placed_nodes(root: &Root, x_sf: Matrix4<f64>) -> Result<Vec<PlacedNode>, InputError> {
    let roots = match root.scene {
        Some(scene) => find(&root.scenes, "scene", scene)?.nodes.clone(),
        None => orphans(root)?,
    };
    let mut reached = vec![false; root.nodes.len()];
    let mut waiting: Vec<_> = roots.iter().rev().map(|&node| (node, x_sf, true)).collect();
    let mut placed = Vec::new();
    while let Some((index, parent, is_visible)) = waiting.pop() {
        let node = find(&root.nodes, "node", index)?;
        if std::mem::replace(&mut reached[index.value()], true) {
            return Err(not_a_tree(index.value()));
        }
        let x_sn = parent * local_pose(index, node)?;
        let hides = |it: &Value| it.get("visible").and_then(Value::as_bool) == Some(false);
        let is_visible = is_visible && !extension(node, VISIBILITY).is_some_and(hides);
        let children = node.children.iter().flatten().rev();
        waiting.extend(children.map(|&child| (child, x_sn, is_visible)));
        placed.push(PlacedNode { index, x_sn, is_visible });
    }
    Ok(placed)
}

/// Returns an extension of a node.
fn extension<'a>(node: &'a Node, name: &str) -> Option<&'a Value> {
    node.extensions.as_ref()?.others.get(name)
}

fn not_a_tree(node: usize) -> InputError {
    InputError::new(format!("node {node} is reached twice; nodes must form a tree"))
}

/// Returns the nodes without a parent that are no coarser level of detail of another. If every node
/// has a parent, they form a cycle.
fn orphans(root: &Root) -> Result<Vec<Index<Node>>, InputError> {
    let mut is_child = vec![false; root.nodes.len()];
    for &child in root.nodes.iter().flat_map(|node| node.children.iter().flatten()) {
        find(&root.nodes, "node", child)?;
        is_child[child.value()] = true;
    }
    let levels =
        root.nodes.iter().filter_map(|node| extension(node, LEVELS)?.get("ids")?.as_array());
    for level in levels.flatten().filter_map(|level| usize::try_from(level.as_u64()?).ok()) {
        is_child.get_mut(level).into_iter().for_each(|it| *it = true);
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
    let f64s = |vector: Option<[f32; 3]>| vector.map(|v| v.map(f64::from));
    let rotation = node.rotation.unwrap_or_default().0.map(f64::from);
    Ok(pose(f64s(node.translation), Some(rotation), f64s(node.scale)))
}

/// Returns the transform of a scale, a rotation (quaternion x, y, z, w) and a translation, in this
/// order.
fn pose(
    translation: Option<[f64; 3]>,
    rotation: Option<[f64; 4]>,
    scale: Option<[f64; 3]>,
) -> Matrix4<f64> {
    let [i, j, k, w] = rotation.unwrap_or([0.0, 0.0, 0.0, 1.0]);
    let rotation = UnitQuaternion::from_quaternion(Quaternion::new(w, i, j, k));
    Matrix4::new_translation(&translation.unwrap_or_default().into())
        * rotation.to_homogeneous()
        * Matrix4::new_nonuniform_scaling(&Vector3::from(scale.unwrap_or([1.0; 3])))
}

/// Returns the poses in which the mesh of a node appears: its own, or those of its instances.
fn instances(
    document: &Document,
    placed: &PlacedNode,
    node: &Node,
) -> Result<Vec<Matrix4<f64>>, InputError> {
    let Some(instancing) = extension(node, INSTANCING) else { return Ok(vec![placed.x_sn]) };
    let wrong =
        |what| InputError::new(format!("\"{INSTANCING}\" of node {} has {what}", placed.index));
    let accessor = |name| match instancing.get("attributes").and_then(|it| it.get(name)) {
        None => Ok(None),
        Some(index) => match index.as_u64().map(u32::try_from) {
            Some(Ok(index)) => Ok(Some(Index::new(index))),
            _ => Err(wrong("an attribute that is no index of an accessor")),
        },
    };
    let vectors = |name| accessor(name)?.map(|it| document.numbers::<3>(it, &VECTORS)).transpose();
    let (translations, scales) = (vectors("TRANSLATION")?, vectors("SCALE")?);
    let rotations = accessor("ROTATION")?.map(|it| document.numbers::<4>(it, &ROTATIONS));
    let rotations = rotations.transpose()?;
    let counts = [translations.as_ref().map(Vec::len), scales.as_ref().map(Vec::len)];
    let counts = counts.into_iter().chain([rotations.as_ref().map(Vec::len)]).flatten();
    let count = counts.clone().max().unwrap_or(1);
    if counts.clone().any(|other| other != count) {
        return Err(wrong("attributes of different counts"));
    }
    let instance = |i: usize| {
        let vector = |vectors: &Option<Vec<[f64; 3]>>| vectors.as_ref().map(|it| it[i]);
        let rotation = rotations.as_ref().map(|it| it[i]);
        placed.x_sn * pose(vector(&translations), rotation, vector(&scales))
    };
    Ok((0..count).map(instance).collect())
}

/// Placement of a mesh in the scene.
enum Placement {
    /// Once for each pose.
    Poses(Vec<Matrix4<f64>>),
    /// On the joints of a skin; the pose of the node does not count.
    Skin(Pose),
}

fn add_mesh(
    document: &Document,
    node: Index<Node>,
    index: Index<Mesh>,
    placement: &Placement,
    raw: &mut RawMesh,
) -> Result<(), InputError> {
    let mesh = find(&document.root.meshes, "mesh", index)?;
    let weights = find(&document.root.nodes, "node", node)?.weights.as_ref();
    let weights = weights.or(mesh.weights.as_ref()).map_or(&[][..], Vec::as_slice);
    for (number, primitive) in mesh.primitives.iter().enumerate() {
        let label = match &mesh.name {
            Some(name) => format!("primitive {number} of mesh {index} \"{name}\" at node {node}"),
            None => format!("primitive {number} of mesh {index} at node {node}"),
        };
        let Checked::Valid(mode) = primitive.mode else {
            return Err(InputError::new(format!("{label} has no known mode")));
        };
        if !matches!(mode, Mode::Triangles | Mode::TriangleStrip | Mode::TriangleFan) {
            raw.skipped_primitives += 1;
            continue;
        }
        let mut points = morphed(document, primitive, weights, &label)?;
        let corners = corners(document, primitive, points.len())?;
        let mut add = |label, points: &mut dyn ExactSizeIterator<Item = _>, is_mirrored| {
            let wound = |[a, b, c]: [u32; 3]| if is_mirrored { [a, c, b] } else { [a, b, c] };
            raw.add_part(label, points, assemble(mode, &corners).map(wound))
        };
        match placement {
            Placement::Skin(pose) => {
                pose.apply(document, primitive, &label, &mut points)?;
                add(label, &mut points.into_iter(), pose.is_mirrored())?;
            }
            Placement::Poses(poses) => {
                for (i, pose) in poses.iter().enumerate() {
                    let label = match poses.len() {
                        1 => label.clone(),
                        _ => format!("{label}, instance {i}"),
                    };
                    let mut placed = points.iter().map(|p| pose.transform_point(p));
                    add(label, &mut placed, is_mirror(pose))?;
                }
            }
        }
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
        Mode::TriangleStrip => Box::new(strip(corners)),
        Mode::TriangleFan => {
            let hub = corners.first().copied().unwrap_or_default();
            let rim = corners.get(1..).unwrap_or_default();
            Box::new(rim.array_windows().map(move |&[b, c]| [hub, b, c]))
        }
        _ => Box::new(corners.as_chunks().0.iter().copied()),
    }
}
