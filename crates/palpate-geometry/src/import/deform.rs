//! Vertices of a glTF primitive in the default pose of its file: morph targets and skins.

use gltf::json::accessor::{ComponentType, Type};
use gltf::json::mesh::{Primitive, Semantic};
use gltf::json::scene::Node;
use gltf::json::validation::Checked;
use gltf::json::{Index, Skin};
use nalgebra::{Matrix4, Point3, Vector3, Vector4};

use super::accessor::{Document, Expected, find};
use palpate_input::error::InputError;

/// Extension that allows integer positions.
pub(super) const QUANTIZATION: &str = "KHR_mesh_quantization";

pub(super) const VECTORS: Expected = Expected {
    words: "float VEC3",
    kind: Type::Vec3,
    accepts: |component, is_normalized| component == ComponentType::F32 && !is_normalized,
};
const QUANTIZED_VECTORS: Expected = Expected {
    words: "VEC3 of floats, bytes or shorts",
    kind: Type::Vec3,
    accepts: |component, is_normalized| match component {
        ComponentType::F32 => !is_normalized,
        component => component != ComponentType::U32,
    },
};
const JOINTS: Expected = Expected {
    words: "VEC4 of unsigned bytes or shorts",
    kind: Type::Vec4,
    accepts: |component, is_normalized| {
        matches!(component, ComponentType::U8 | ComponentType::U16) && !is_normalized
    },
};
const WEIGHTS: Expected = Expected {
    words: "VEC4 of floats or normalized unsigned integers",
    kind: Type::Vec4,
    accepts: |component, is_normalized| match component {
        ComponentType::F32 => !is_normalized,
        component => matches!(component, ComponentType::U8 | ComponentType::U16) && is_normalized,
    },
};
const MATRICES: Expected = Expected { words: "float MAT4", kind: Type::Mat4, ..VECTORS };

/// Returns the positions of a primitive, morphed by `weights`: p + Σ wᵢ Δpᵢ.
pub(super) fn morphed(
    document: &Document,
    primitive: &Primitive,
    weights: &[f32],
    label: &str,
) -> Result<Vec<Point3<f64>>, InputError> {
    let names = [&document.root.extensions_used, &document.root.extensions_required];
    let is_quantized = names.iter().any(|names| names.iter().any(|name| name == QUANTIZATION));
    let expected = if is_quantized { &QUANTIZED_VECTORS } else { &VECTORS };
    let positions = primitive.attributes.get(&Checked::Valid(Semantic::Positions));
    let positions =
        *positions.ok_or_else(|| InputError::new(format!("{label} has no positions")))?;
    for accessor in primitive.indices.into_iter().chain([positions]) {
        if !document.has_data(accessor)? {
            return Err(without_data(primitive, label));
        }
    }
    let mut points: Vec<_> =
        document.numbers(positions, expected)?.into_iter().map(Point3::from).collect();
    for (target, &weight) in primitive.targets.iter().flatten().zip(weights) {
        let Some(moves) = target.positions.filter(|_| weight != 0.0) else { continue };
        let moves = document.numbers(moves, expected)?;
        if moves.len() != points.len() {
            let (moves, points) = (moves.len(), points.len());
            return Err(InputError::new(format!(
                "{label} has {points} vertices and a morph target of {moves}"
            )));
        }
        for (point, step) in points.iter_mut().zip(moves) {
            *point += f64::from(weight) * Vector3::from(step);
        }
    }
    Ok(points)
}

/// Returns the error of a primitive without data: an extension compresses them.
fn without_data(primitive: &Primitive, label: &str) -> InputError {
    let names = primitive.extensions.iter().flat_map(|all| all.others.keys());
    let names: Vec<_> = names.map(|name| format!("\"{name}\"")).collect();
    let reason = match names.is_empty() {
        true => "its accessors refer to none".into(),
        false => format!("the extension {} is not supported", names.join(" or ")),
    };
    InputError::new(format!("{label} has no data: {reason}"))
}

/// Skin of a node: the transform Jᵢ Bᵢ of each joint i, its pose after its inverse bind matrix.
pub(super) struct Pose {
    joints: Vec<Matrix4<f64>>,
}

impl Pose {
    /// Reads a skin; `x_sn` returns the pose of a node, if it is in the scene.
    pub fn read(
        document: &Document,
        skin: Index<Skin>,
        x_sn: impl Fn(Index<Node>) -> Option<Matrix4<f64>>,
    ) -> Result<Self, InputError> {
        let number = skin.value();
        let skin = find(&document.root.skins, "skin", skin)?;
        let binds = match skin.inverse_bind_matrices {
            Some(accessor) => document.numbers::<16>(accessor, &MATRICES)?,
            None => Vec::new(),
        };
        let joint = |(i, &joint): (usize, &Index<Node>)| {
            let pose = x_sn(joint).ok_or_else(|| {
                InputError::new(format!("skin {number}: joint {i} is outside the scene"))
            })?;
            let bind = match (skin.inverse_bind_matrices, binds.get(i)) {
                (_, Some(columns)) => Matrix4::from_column_slice(columns),
                (None, None) => Matrix4::identity(),
                (Some(_), None) => {
                    let (joints, binds) = (skin.joints.len(), binds.len());
                    return Err(InputError::new(format!(
                        "skin {number} has {joints} joints and {binds} inverse bind matrices"
                    )));
                }
            };
            Ok(pose * bind)
        };
        Ok(Self { joints: skin.joints.iter().enumerate().map(joint).collect::<Result<_, _>>()? })
    }

    /// Moves the vertices of a primitive: p becomes Σ wᵢ Jᵢ Bᵢ p / Σ wᵢ.
    pub fn apply(
        &self,
        document: &Document,
        primitive: &Primitive,
        label: &str,
        points: &mut [Point3<f64>],
    ) -> Result<(), InputError> {
        let mut sums = vec![(Vector4::zeros(), 0.0); points.len()];
        for set in 0.. {
            let attribute = |semantic| primitive.attributes.get(&Checked::Valid(semantic)).copied();
            let pair = (attribute(Semantic::Joints(set)), attribute(Semantic::Weights(set)));
            let (joints, weights) = match pair {
                (Some(joints), Some(weights)) => (joints, weights),
                _ if set > 0 => break,
                _ => {
                    let problem = format!("{label} has a skin, but not JOINTS_0 and WEIGHTS_0");
                    return Err(InputError::new(problem));
                }
            };
            let joints = document.numbers::<4>(joints, &JOINTS)?;
            let weights = document.numbers::<4>(weights, &WEIGHTS)?;
            let vertices = sums.iter_mut().zip(points.iter()).zip(joints.into_iter().zip(weights));
            for (((sum, total), point), (joints, weights)) in vertices {
                for (joint, weight) in joints.into_iter().zip(weights).filter(|it| it.1 != 0.0) {
                    let transform = self.joints.get(joint as usize).ok_or_else(|| {
                        let count = self.joints.len();
                        InputError::new(format!("{label} refers to joint {joint} of {count}"))
                    })?;
                    *sum += weight * (transform * point.to_homogeneous());
                    *total += weight;
                }
            }
        }
        for (vertex, (point, (sum, total))) in points.iter_mut().zip(sums).enumerate() {
            if total == 0.0 {
                return Err(InputError::new(format!(
                    "{label} has a skin, and the joint weights of its vertex {vertex} sum to 0"
                )));
            }
            *point = Point3::from(sum.xyz() / total);
        }
        Ok(())
    }

    /// Whether the first joint is mirrored.
    pub fn is_mirrored(&self) -> bool {
        self.joints.first().is_some_and(is_mirror)
    }
}

/// Whether a transform turns a right hand into a left one.
pub(super) fn is_mirror(transform: &Matrix4<f64>) -> bool {
    transform.fixed_view::<3, 3>(0, 0).determinant() < 0.0
}
