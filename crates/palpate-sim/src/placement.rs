//! Automatic placement: pose, size and zone for a mesh without a scene.

use super::scene::Unit;
use clap::ValueEnum;
use nalgebra::{Matrix3, Point3, Rotation3, Vector3};
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

/// Direction in a mesh file that points up.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum UpAxis {
    /// The x axis.
    X,
    /// The y axis: the rule of glTF, and usual in OBJ files.
    Y,
    /// The z axis, usual in CAD.
    Z,
    /// Opposite to the x axis.
    #[value(name = "-x")]
    MinusX,
    /// Opposite to the y axis.
    #[value(name = "-y")]
    MinusY,
    /// Opposite to the z axis.
    #[value(name = "-z")]
    MinusZ,
}

impl UpAxis {
    /// Returns the axis, 0 to 2 for x to z, and its sign.
    fn parts(self) -> (usize, f64) {
        match self {
            Self::X => (0, 1.0),
            Self::Y => (1, 1.0),
            Self::Z => (2, 1.0),
            Self::MinusX => (0, -1.0),
            Self::MinusY => (1, -1.0),
            Self::MinusZ => (2, -1.0),
        }
    }

    /// Returns the unit vector in the frame of the file.
    pub fn direction(self) -> Vector3<f64> {
        let (axis, sign) = self.parts();
        Vector3::ith(axis, sign)
    }
}

/// Range of the largest extent of an object that a finger can explore.
// heuristic: from a mouse to a bucket.
pub const EXPLORABLE_M: [f64; 2] = [0.03, 0.4];

// heuristic: largest extent that an object of another size is scaled to.
const SIZE_M: f64 = 0.15;

/// Smallest extent of a part in millimetres; of one in an STL file, whose usual unit they are.
// heuristic: a screw, and a model for a 3D printer.
const SMALLEST_M: [f64; 2] = [0.005, 0.001];

/// Units that mesh files without a stated unit use. An inch is one only if it is stated.
pub const USUAL_UNITS: [Unit; 3] = [Unit::Mm, Unit::Cm, Unit::M];

fn is_explorable(size_m: f64) -> bool {
    (EXPLORABLE_M[0]..=EXPLORABLE_M[1]).contains(&size_m)
}

/// Returns the usual units in which an object has a size that a finger can explore, and millimetres
/// if it is a small part in them, the most plausible first: millimetres in an STL file, then units
/// of an explorable size, then by the ratio to the size of a hand. `extent` is the largest in the
/// file's numbers.
pub fn plausible_units(extent: f64, is_stl: bool) -> Vec<Unit> {
    let size_m = |unit: &Unit| extent * unit.metres_per_unit();
    let smallest_m = SMALLEST_M[usize::from(is_stl)];
    let is_plausible = |unit: &Unit| {
        let is_part = *unit == Unit::Mm && (smallest_m..=EXPLORABLE_M[1]).contains(&size_m(unit));
        is_part || is_explorable(size_m(unit))
    };
    let mut units: Vec<Unit> = USUAL_UNITS.into_iter().filter(is_plausible).collect();
    let rank = |unit: &Unit| match *unit {
        Unit::Mm if is_stl => -1.0,
        Unit::Mm if is_explorable(size_m(unit)) => 0.0,
        Unit::Mm => f64::INFINITY,
        _ => (size_m(unit) / SIZE_M).ln().abs(),
    };
    units.sort_by(|a, b| rank(a).total_cmp(&rank(b)));
    units
}

/// Returns the factor that gives an object of this size one that a finger can explore: 1 if it has
/// one, otherwise a readable number that makes it 0.15 m.
pub fn explorable_scale(size_m: f64) -> f64 {
    if is_explorable(size_m) { 1.0 } else { two_digits(SIZE_M / size_m) }
}

/// Smallest share of an object's underside that is flat if it stands on it.
// heuristic: the foot of a mug has half of its square.
const FLAT_SHARE: f64 = 0.3;

/// Ratio of the areas of the largest base and the largest base along another axis, above which the
/// object rests on the first.
// heuristic: a box may stand on its narrow side, a plate does not.
const REST_RATIO: f64 = 2.5;

/// Returns the up axis of a mesh that clearly rests on a flat base, with the share of its underside
/// that is flat; `None` if it has no flat base, or several.
pub fn resting_axis(mesh: &Mesh) -> Option<(UpAxis, f64)> {
    let (low, high) = mesh.bounds();
    let size_m = high - low;
    let near_m = 0.01 * size_m.max();
    let base = |up: UpAxis| {
        let (axis, sign) = up.parts();
        let floor_m = if sign > 0.0 { low[axis] } else { high[axis] };
        let is_floor = |corners: &[Point3<f64>; 3]| {
            corners.iter().all(|p| (p[axis] - floor_m).abs() <= near_m)
        };
        let on_floor = mesh.iter_corners().filter(is_floor);
        let area_m2: f64 =
            on_floor.map(|[a, b, c]| 0.5 * (b - a).cross(&(c - a))[axis].abs()).sum();
        let side_m2 = size_m[(axis + 1) % 3] * size_m[(axis + 2) % 3];
        // Both faces of a thin plate lie near its floor.
        (up, area_m2.min(side_m2), area_m2 / side_m2)
    };
    let mut bases: Vec<_> = UpAxis::value_variants().iter().map(|up| base(*up)).collect();
    // Stable, so that of two equal ends the first variant is up.
    bases.sort_by(|a, b| b.1.total_cmp(&a.1));
    let (up, area_m2, share) = *bases.first()?;
    let other = bases.iter().find(|(other, ..)| other.parts().0 != up.parts().0);
    let is_clear = other.is_none_or(|(_, other_m2, _)| area_m2 >= REST_RATIO * other_m2);
    (share >= FLAT_SHARE && is_clear).then_some((up, share.min(1.0)))
}

/// Largest distance of an object's lowest point from a plane of its file that it stands on, as a
/// share of its largest extent.
// heuristic: a scan has parts below its table.
const GROUND_SHARE: f64 = 0.05;

/// Returns the positive up axes of the coordinate planes of its file on which a mesh stands. A
/// design or a scan is usually placed on one of them.
pub fn ground_axes(mesh: &Mesh) -> Vec<UpAxis> {
    let (low, high) = mesh.bounds();
    let near = GROUND_SHARE * (high - low).max();
    let stands = |up: &UpAxis| low[up.parts().0].abs() <= near && high[up.parts().0] > near;
    [UpAxis::X, UpAxis::Y, UpAxis::Z].into_iter().filter(stands).collect()
}

/// Number of directions in which an object is tilted.
// heuristic: 5° apart; a support polygon has few corners.
const TILTS: u32 = 72;

/// Returns the smallest angle, in degrees, by which a mesh that stands with `up` upwards must be
/// tilted to fall: atan of the distance from below the centre of its surface to the edge of the
/// support polygon, over the centre's height. Negative if it falls by itself.
pub fn stability_deg(mesh: &Mesh, up: UpAxis) -> f64 {
    let (axis, sign) = up.parts();
    let (low, high) = mesh.bounds();
    let floor = if sign > 0.0 { low[axis] } else { high[axis] };
    let near = 0.01 * (high - low).max();
    let (mut area, mut moment) = (0.0, Vector3::zeros());
    for [a, b, c] in mesh.iter_corners() {
        let part = (b - a).cross(&(c - a)).norm();
        area += part;
        moment += (a.coords + b.coords + c.coords) * (part / 3.0);
    }
    let centre = Point3::from(moment / area);
    let offset = |p: &Point3<f64>| {
        let off = p - centre;
        [off[(axis + 1) % 3], off[(axis + 2) % 3]]
    };
    let supports = mesh.vertices().iter().filter(|p| (p[axis] - floor).abs() <= near);
    let supports: Vec<[f64; 2]> = supports.map(offset).collect();
    let reach = |tilt: u32| {
        let (sin, cos) = (std::f64::consts::TAU * f64::from(tilt) / f64::from(TILTS)).sin_cos();
        supports.iter().map(|[x, y]| x * cos + y * sin).fold(f64::NEG_INFINITY, f64::max)
    };
    let edge = (0..TILTS).map(reach).fold(f64::INFINITY, f64::min);
    edge.atan2(sign * (centre[axis] - floor)).to_degrees()
}

/// Difference between the stabilities of two poses above which the second is not considered.
// heuristic: of the 78 scans of YCB, 22 are more stable in another pose, mostly upside down.
const CLEARLY_DEG: f64 = 10.0;

/// Returns the most stable of the poses with these axes upwards, with its stability in degrees;
/// `None` if it falls, or another pose is about as stable.
pub fn stable_axis(mesh: &Mesh, axes: &[UpAxis]) -> Option<(UpAxis, f64)> {
    let mut poses: Vec<_> = axes.iter().map(|up| (*up, stability_deg(mesh, *up))).collect();
    poses.sort_by(|a, b| b.1.total_cmp(&a.1));
    let (up, first_deg) = *poses.first()?;
    let is_clear = poses.get(1).is_none_or(|(_, next_deg)| first_deg - next_deg > CLEARLY_DEG);
    (first_deg > 0.0 && is_clear).then_some((up, first_deg))
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
    /// Returns the directions for a file in which `up` points up, by the usual convention: the
    /// front is towards −y if z is up or down, otherwise towards +z.
    pub fn of(up: UpAxis) -> Self {
        let front_o = match up {
            UpAxis::Z | UpAxis::MinusZ => -Vector3::y(),
            _ => Vector3::z(),
        };
        Self { front_o, up_o: up.direction() }
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

/// Centre in `W` of a whole object that a stage explores.
pub const STAGE_CENTRE_M: [f64; 3] = [0.0, -0.65, 0.5];

/// Centre in `W` of a whole object that a PA-10 explores.
// heuristic: the place of the bird in scenes/bird_around_pa10.toml, reached from most sides.
pub const ARM_CENTRE_M: [f64; 3] = [0.0, -0.6, 0.6];

/// Returns the position in `W` of the origin of a mesh, already rotated, that puts the middle of
/// its bounds at `centre_m`, rounded to 0.1 mm.
pub fn centred_m(turned: &Mesh, centre_m: [f64; 3]) -> [f64; 3] {
    let (low, high) = turned.bounds();
    std::array::from_fn(|i| tenth_mm(centre_m[i] - 0.5 * (low[i] + high[i])))
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
