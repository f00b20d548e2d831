//! Sample points of the fingertip's outer skin: spread evenly over it, or over the nodes of a
//! triangle lattice above the fluid.

use nalgebra::{Point3, UnitVector3, Vector3};
use palpate_explore::robot::finger::profile::{Layers, Profile};
use std::f64::consts::{FRAC_PI_2, PI, TAU};

/// Golden angle as a fraction of a turn: successive points never line up.
const GOLDEN_TURN: f64 = 0.381_966_011_250_105_1;

/// Step of the central differences over the skin: along it as a fraction of the distance between
/// samples, which near the apex is where the profile bends; around it in radians.
const STEP: f64 = 0.05;
const STEP_RAD: f64 = 1e-4;

/// Point of the skin with the ray from the axis through it, in `T`.
#[derive(Clone, Debug, PartialEq)]
pub struct SkinSample {
    /// Start of the ray on the axis.
    pub start: Point3<f64>,
    /// Direction of the ray.
    pub direction: UnitVector3<f64>,
    /// Layers along the ray.
    pub layers: Layers,
    /// Outward normal of the skin.
    pub normal: UnitVector3<f64>,
    /// Area of skin that the sample represents.
    pub area_m2: f64,
    /// Node of the shell; `None` without a shell.
    pub node: Option<usize>,
}

impl SkinSample {
    /// Returns the point of the skin.
    pub fn point(&self) -> Point3<f64> {
        self.start + self.direction.scale(self.layers.outer_m)
    }

    /// Returns the sample's area seen along the ray; times a displacement along the ray, it is a
    /// volume.
    pub fn section_m2(&self) -> f64 {
        self.area_m2 * self.normal.dot(&self.direction).max(0.0)
    }
}

/// Returns `count` samples, deterministic.
///
/// Equal steps in x cut equal areas out of a cylinder and out of a sphere (Archimedes), so a
/// Fibonacci lattice over x and the turn is even over a capsule; the profile then scales each area
/// by the local ratio of surfaces.
pub fn spread(profile: &Profile, count: usize) -> Vec<SkinSample> {
    let (length_m, radius_m) = (profile.length_m, profile.radius_m);
    let cell_m = (length_m + radius_m) / count as f64;
    let step_m = STEP * cell_m;
    (0..count)
        .map(|i| {
            let x_m = -length_m + (i as f64 + 0.5) * cell_m;
            let turn = TAU * (i as f64 * GOLDEN_TURN).fract();
            let at = |dx_m: f64, dturn: f64| profile.skin_t(x_m + dx_m, turn + dturn);
            let along: Vector3<f64> = (at(step_m, 0.0) - at(-step_m, 0.0)) / (2.0 * step_m);
            let around = (at(0.0, STEP_RAD) - at(0.0, -STEP_RAD)) / (2.0 * STEP_RAD);
            let (start, direction) = profile.ray(x_m, turn);
            let stretched = around.cross(&along);
            let normal = UnitVector3::try_new(stretched, 0.0).unwrap_or(direction);
            let normal = if normal.dot(&direction) < 0.0 { -normal } else { normal };
            SkinSample {
                start,
                direction,
                layers: profile.layers(start.x, &direction),
                normal,
                area_m2: stretched.norm() * cell_m * TAU,
                node: None,
            }
        })
        .collect()
}

/// Node of the shell, in the middle of the skin's thickness, in `T`.
#[derive(Clone, Debug)]
pub struct Node {
    /// Position at rest.
    pub point: Point3<f64>,
    /// Start of the ray from the axis through the node.
    pub start: Point3<f64>,
    /// Direction of that ray.
    pub direction: UnitVector3<f64>,
    /// Thickness of the fluid under the node, m.
    pub gap_m: f64,
    /// Area that the node represents, along its outward normal, in m².
    pub area_m2: Vector3<f64>,
    /// Whether the nail or the back end clamps the node.
    pub clamped: bool,
    /// Index of the node's mirror image across y = 0.
    pub mirror: usize,
}

/// Lattice of a shell over the half of the fingertip that has fluid under it; constant.
#[derive(Clone, Debug)]
pub struct Lattice {
    nodes: Vec<Node>,
    triangles: Vec<[usize; 3]>,
}

impl Lattice {
    /// Creates the lattice with the given numbers of cells along and around it, an even number
    /// around; the lines of all angles meet at the apex.
    ///
    /// Half of the cells are before the origin of `T`, where the profile bends most, in equal steps
    /// of an arc. Their number is even, so that the corner at 45° is a node.
    pub fn new(profile: &Profile, [along, around]: [usize; 2]) -> Self {
        let (radius_m, length_m) = (profile.radius_m, profile.length_m);
        let arc = 2 * along.div_ceil(4);
        let straight = if length_m > 0.0 { along - arc } else { 0 };
        let behind = (0..straight).map(|i| -length_m * (1.0 - i as f64 / straight as f64));
        let before = (0..=arc).map(|i| radius_m * (FRAC_PI_2 * i as f64 / arc as f64).sin());
        let last = straight + arc;
        let node_at = |i: usize, j: usize| i * (around + 1) + if i == last { 0 } else { j };
        let mut nodes = Vec::new();
        for (i, x_m) in behind.chain(before).enumerate() {
            let angles = if i == last { 0..=0 } else { 0..=around };
            for j in angles {
                let turn = PI * (j as f64 / around as f64 - 0.5);
                let (start, direction) = profile.ray(x_m, turn);
                let layers = profile.layers(start.x, &direction);
                nodes.push(Node {
                    point: start + direction.scale(layers.outer_m - layers.skin_m / 2.0),
                    start,
                    direction,
                    gap_m: layers.gap_m,
                    area_m2: Vector3::zeros(),
                    clamped: i == 0 || (i < last && (j == 0 || j == around)),
                    mirror: node_at(i, around - j),
                });
            }
        }
        let mut triangles = Vec::new();
        for (i, j) in (0..last).flat_map(|i| (0..around).map(move |j| (i, j))) {
            let [a, b, c, d] =
                [(i, j), (i + 1, j), (i + 1, j + 1), (i, j + 1)].map(|(i, j)| node_at(i, j));
            // Diagonals mirrored at the middle keep left and right alike.
            let split = match j < around / 2 {
                true => [[a, b, c], [a, c, d]],
                false => [[a, b, d], [b, c, d]],
            };
            for [p, q, r] in split.into_iter().filter(|[p, q, r]| p != q && q != r && r != p) {
                let corner = |k: usize| nodes[k].point;
                let area_m2 = (corner(q) - corner(p)).cross(&(corner(r) - corner(p))) / 2.0;
                let outward = area_m2.dot(&nodes[p].direction) > 0.0;
                triangles.push(if outward { [p, q, r] } else { [p, r, q] });
                let area_m2 = if outward { area_m2 } else { -area_m2 };
                [p, q, r].into_iter().for_each(|k| nodes[k].area_m2 += area_m2 / 3.0);
            }
        }
        Self { nodes, triangles }
    }

    /// Returns the nodes.
    pub fn nodes(&self) -> &[Node] {
        &self.nodes
    }

    /// Returns the corners of the triangles, counterclockwise seen from outside.
    pub fn triangles(&self) -> &[[usize; 3]] {
        &self.triangles
    }

    /// Returns the skin's point over each node.
    pub fn samples(&self, profile: &Profile) -> impl Iterator<Item = SkinSample> {
        self.nodes.iter().enumerate().map(|(k, node)| SkinSample {
            start: node.start,
            direction: node.direction,
            layers: profile.layers(node.start.x, &node.direction),
            normal: UnitVector3::try_new(node.area_m2, 0.0).unwrap_or(node.direction),
            area_m2: node.area_m2.norm(),
            node: Some(k),
        })
    }
}
