//! Automatic placement: pose, size and zone for a mesh without a scene.

use super::scene::Unit;
use clap::ValueEnum;
use nalgebra::{Matrix3, Rotation3, Vector3};
use palpate_explore::task::Zone;
use palpate_geometry::bvh::MeshBvh;
use palpate_geometry::mesh::Mesh;

/// Side of an object, as seen from its front.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum)]
pub enum ObjectSide {
    /// Front: towards +z if y is up, as in glTF; towards −y if z is up.
    #[default]
    Front,
    /// Back, opposite to the front.
    Back,
    /// Left, seen from the front: towards −x.
    Left,
    /// Right, seen from the front: towards +x.
    Right,
    /// Top.
    Top,
    /// Bottom.
    Bottom,
}

/// Axis of a mesh file that points up.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum UpAxis {
    /// The y axis: the rule of glTF, and usual in OBJ files.
    Y,
    /// The z axis, usual in CAD.
    Z,
}

// heuristic: range of the largest extent, in m, that a finger can explore: from a mouse to a
// bucket.
const EXPLORABLE_M: [f64; 2] = [0.03, 0.4];

// heuristic: largest extent that an object of another size is scaled to.
const SIZE_M: f64 = 0.15;

/// Returns the unit and scale factor that give a mesh a size that a finger can explore. `extent` is
/// the largest in the file's numbers. Without a `unit` it is the first of mm, m and cm that fits
/// with a scale of 1; if none fits, metres with another scale.
pub fn propose_size(extent: f64, unit: Option<Unit>) -> (Unit, f64) {
    let fits = |unit: &Unit| {
        let size_m = extent * unit.metres_per_unit();
        (EXPLORABLE_M[0]..=EXPLORABLE_M[1]).contains(&size_m)
    };
    let usual = [Unit::Mm, Unit::M, Unit::Cm];
    match unit.or_else(|| usual.into_iter().find(fits)) {
        Some(unit) if fits(&unit) => (unit, 1.0),
        unit => {
            let unit = unit.unwrap_or_default();
            (unit, two_digits(SIZE_M / (extent * unit.metres_per_unit())))
        }
    }
}

/// Returns the value rounded to two significant digits, for readability.
fn two_digits(value: f64) -> f64 {
    let digit = 10f64.powf(value.log10().floor() - 1.0);
    let (count, inverse) = ((value / digit).round(), (1.0 / digit).round());
    // A power of ten below 1 is exact as a divisor only.
    if digit < 1.0 { count / inverse } else { count * digit }
}

// heuristic: position of the object's front in `W`, within a PA-10's reach, at the height of its
// shoulder and elbow.
const FRONT_Y_M: f64 = -0.6;
const MIDDLE_Z_M: f64 = 0.5;

/// Directions of an object's front and top in the frame of its mesh.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ObjectAxes {
    front_o: Vector3<f64>,
    up_o: Vector3<f64>,
}

impl ObjectAxes {
    /// Returns the directions for a file whose axis `up` is up, by the usual convention: the front
    /// is towards +z if y is up, towards −y if z is up.
    pub fn of(up: UpAxis) -> Self {
        match up {
            UpAxis::Y => Self { front_o: Vector3::z(), up_o: Vector3::y() },
            UpAxis::Z => Self { front_o: -Vector3::y(), up_o: Vector3::z() },
        }
    }

    /// Returns the directions for a glTF file, whose y axis became z, and z became y, on import.
    pub fn of_gltf(up: UpAxis) -> Self {
        let turned = |v: Vector3<f64>| Vector3::new(-v.x, v.z, v.y);
        let Self { front_o, up_o } = Self::of(up);
        Self { front_o: turned(front_o), up_o: turned(up_o) }
    }
}

/// Returns the rotation about the fixed axes x, y, z of `W`, in degrees, that turns `side` of an
/// object towards the finger (+y) and keeps its top up. If the top faces the finger, the back is
/// up; if the bottom does, the front.
pub fn rotation_deg(ObjectAxes { front_o, up_o }: ObjectAxes, side: ObjectSide) -> [f64; 3] {
    let right_o = up_o.cross(&front_o);
    let (faces_o, above_o) = match side {
        ObjectSide::Front => (front_o, up_o),
        ObjectSide::Back => (-front_o, up_o),
        ObjectSide::Left => (-right_o, up_o),
        ObjectSide::Right => (right_o, up_o),
        ObjectSide::Top => (up_o, -front_o),
        ObjectSide::Bottom => (-up_o, front_o),
    };
    let beside_o = faces_o.cross(&above_o);
    let r_wo = Matrix3::from_columns(&[beside_o, faces_o, above_o]).transpose();
    let (x, y, z) = Rotation3::from_matrix_unchecked(r_wo).euler_angles();
    // All are quarter turns; adding 0.0 turns −0 into 0.
    [x, y, z].map(|angle: f64| angle.to_degrees().round() + 0.0)
}

/// Returns the position in `W` of the origin of a mesh, already rotated, that puts its front in the
/// finger's path, rounded to 0.1 mm.
pub fn position_m(turned: &Mesh) -> [f64; 3] {
    let (low, high) = turned.bounds();
    let middle = |axis: usize| 0.5 * (low[axis] + high[axis]);
    [-middle(0), FRONT_Y_M - high.y, MIDDLE_Z_M - middle(2)].map(tenth_mm)
}

fn tenth_mm(length_m: f64) -> f64 {
    (length_m * 1e4).round() / 1e4 + 0.0
}

// heuristic: rays along each side of an object's silhouette.
const RAYS: usize = 61;

// heuristic: minimum share of a zone that has a surface, so that a rounded corner costs no row of
// places and no touch is spent on a rim.
const FILLED: f64 = 0.98;

// heuristic: margin behind the farthest surface of a zone.
const BEHIND_M: f64 = 0.005;

/// Zone on an object, with the share of it that the object fills.
#[derive(Clone, Debug, PartialEq)]
pub struct ZoneProposal {
    /// The zone, with datum and depth.
    pub zone: Zone,
    /// Share of the zone's places with a surface.
    pub fill_fraction: f64,
}

/// Returns the largest rectangle of the silhouette, seen along −y, in which almost every place has
/// a surface. Its datum is the middle of that surface; its depth reaches from the object's front to
/// a little behind the farthest surface. Returns `None` if there is no surface along the approach.
pub fn propose_zone(bvh: &MeshBvh) -> Option<ZoneProposal> {
    let (low, high) = bvh.mesh().bounds();
    let whole = Zone::new([low.x, high.x], Some([low.z, high.z]));
    let [width_m, height_m] = [high.x - low.x, high.z - low.z];
    if width_m <= 0.0 || height_m <= 0.0 {
        return None;
    }
    // Rays go through the middles of cells, so that none hits the very rim.
    let at = |i: usize, j: usize| {
        whole.at(&[(i as f64 + 0.5) / RAYS as f64, (j as f64 + 0.5) / RAYS as f64])
    };
    let met_y_m: Vec<Option<f64>> = (0..RAYS * RAYS)
        .map(|k| {
            let start = whole.local(&at(k % RAYS, k / RAYS), high.y + BEHIND_M);
            let reach_m = high.y - low.y + 2.0 * BEHIND_M;
            Some(start.y - bvh.ray(&start, &whole.ahead_w(), reach_m)?.distance_m)
        })
        .collect();
    let ([x0, x1], [z0, z1]) = largest(&met_y_m, [width_m, height_m])?;
    let inside = || (z0..z1).flat_map(|j| met_y_m[j * RAYS + x0..j * RAYS + x1].iter());
    let met = || inside().copied().flatten();
    let (lowest, highest) = (met().reduce(f64::min)?, met().reduce(f64::max)?);
    let edge = |low: f64, side: f64, count: usize| low + side * count as f64 / RAYS as f64;
    let mut zone = Zone::new(
        [tenth_mm(edge(low.x, width_m, x0)), tenth_mm(edge(low.x, width_m, x1))],
        Some([tenth_mm(edge(low.z, height_m, z0)), tenth_mm(edge(low.z, height_m, z1))]),
    );
    zone.datum_y_m = Some(tenth_mm(0.5 * (lowest + highest)));
    zone.depth_m = Some([tenth_mm(-high.y - 1e-4), tenth_mm(-lowest + BEHIND_M)]);
    Some(ZoneProposal { zone, fill_fraction: met().count() as f64 / inside().count() as f64 })
}

/// Returns the columns and rows (first, and one past the last) of the filled rectangle with the
/// largest area; `None` if there is none.
fn largest(met: &[Option<f64>], [width, height]: [f64; 2]) -> Option<([usize; 2], [usize; 2])> {
    // sums[j][i]: cells with a surface before column i and row j.
    let mut sums = vec![0i64; (RAYS + 1) * (RAYS + 1)];
    let index = |i: usize, j: usize| j * (RAYS + 1) + i;
    for j in 0..RAYS {
        for i in 0..RAYS {
            let here = i64::from(met[j * RAYS + i].is_some());
            let before = sums[index(i, j + 1)] + sums[index(i + 1, j)] - sums[index(i, j)];
            sums[index(i + 1, j + 1)] = here + before;
        }
    }
    let mut best = (0.0, None);
    for z0 in 0..RAYS {
        for z1 in z0 + 1..=RAYS {
            for x0 in 0..RAYS {
                // The widest rectangle that is larger than the best one and full enough.
                for x1 in (x0 + 1..=RAYS).rev() {
                    let cells = (x1 - x0) * (z1 - z0);
                    let area = cells as f64 * width * height;
                    if area <= best.0 {
                        break;
                    }
                    let filled = sums[index(x1, z1)] + sums[index(x0, z0)]
                        - sums[index(x0, z1)]
                        - sums[index(x1, z0)];
                    if filled as f64 >= FILLED * cells as f64 {
                        best = (area, Some(([x0, x1], [z0, z1])));
                    }
                }
            }
        }
    }
    best.1
}
