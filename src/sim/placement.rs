//! Where a mesh that nobody has prepared could stand, and which zone of it could be explored.

use super::scene::Unit;
use clap::ValueEnum;
use nalgebra::{Matrix3, Rotation3, Vector3};
use palpate_explore::task::Zone;
use palpate_geometry::bvh::MeshBvh;
use palpate_geometry::mesh::Mesh;

/// A side of an object, as somebody names it who sees its front upright.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum)]
pub enum Side {
    /// Towards +z where y is up, as in glTF; towards −y where z is up.
    #[default]
    Front,
    /// The other one.
    Back,
    /// At the left hand of whoever sees the front.
    Left,
    /// At his right hand: towards +x.
    Right,
    /// Upwards.
    Top,
    /// Downwards.
    Bottom,
}

/// The axis of a mesh file that is up.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Up {
    /// As glTF prescribes, and most programs write OBJ.
    Y,
    /// As is usual in CAD.
    Z,
}

/// A size that a finger can explore, largest extent, in m; chosen: from a mouse to a bucket.
const EXPLORABLE_M: [f64; 2] = [0.03, 0.4];

/// Largest extent given to an object of another size; chosen.
const SIZE_M: f64 = 0.15;

/// The unit, and a factor on top of it, with which a mesh of this `extent`, the largest in its
/// file's numbers, has a size that a finger can explore: without a `unit` the first of mm, m and cm
/// in which it does, and metres with another factor than 1 where none does.
pub fn size(extent: f64, unit: Option<Unit>) -> (Unit, f64) {
    let fits = |unit: &Unit| {
        let size_m = extent * unit.metres();
        (EXPLORABLE_M[0]..=EXPLORABLE_M[1]).contains(&size_m)
    };
    let usual = [Unit::Mm, Unit::M, Unit::Cm];
    match unit.or_else(|| usual.into_iter().find(fits)) {
        Some(unit) if fits(&unit) => (unit, 1.0),
        unit => {
            let unit = unit.unwrap_or_default();
            (unit, two_digits(SIZE_M / (extent * unit.metres())))
        }
    }
}

/// Rounded to two digits, so that a person can read it.
fn two_digits(value: f64) -> f64 {
    let digit = 10f64.powf(value.log10().floor() - 1.0);
    let (count, inverse) = ((value / digit).round(), (1.0 / digit).round());
    // A power of ten below 1 is exact as a divisor only.
    if digit < 1.0 { count / inverse } else { count * digit }
}

/// Where the front of the object stands, in `W`: within a PA-10's reach, at the height of its
/// shoulder and elbow; chosen.
const FRONT_Y_M: f64 = -0.6;
const MIDDLE_Z_M: f64 = 0.5;

/// Which way an object's front and top look in the frame of its mesh.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Facing {
    front_o: Vector3<f64>,
    up_o: Vector3<f64>,
}

impl Facing {
    /// Of a file whose axis `up` is up, by the convention of programs that have it so: the front
    /// towards +z where y is up, towards −y where z is.
    pub fn of(up: Up) -> Self {
        match up {
            Up::Y => Self { front_o: Vector3::z(), up_o: Vector3::y() },
            Up::Z => Self { front_o: -Vector3::y(), up_o: Vector3::z() },
        }
    }

    /// The same of a glTF file, whose y has become z and whose z has become y when it was read.
    pub fn of_gltf(up: Up) -> Self {
        let turned = |v: Vector3<f64>| Vector3::new(-v.x, v.z, v.y);
        let Self { front_o, up_o } = Self::of(up);
        Self { front_o: turned(front_o), up_o: turned(up_o) }
    }
}

/// Turns about the fixed axes x, y, z of `W`, in degrees, with which `side` of an object faces the
/// finger, towards +y, and what was up stays up; if its top faces it, its back is up, and if its
/// bottom does, its front.
pub fn rotation_deg(Facing { front_o, up_o }: Facing, side: Side) -> [f64; 3] {
    let right_o = up_o.cross(&front_o);
    let (faces_o, above_o) = match side {
        Side::Front => (front_o, up_o),
        Side::Back => (-front_o, up_o),
        Side::Left => (-right_o, up_o),
        Side::Right => (right_o, up_o),
        Side::Top => (up_o, -front_o),
        Side::Bottom => (-up_o, front_o),
    };
    let beside_o = faces_o.cross(&above_o);
    let r_wo = Matrix3::from_columns(&[beside_o, faces_o, above_o]).transpose();
    let (x, y, z) = Rotation3::from_matrix_unchecked(r_wo).euler_angles();
    // Quarter turns all; a zero without a sign.
    [x, y, z].map(|angle: f64| angle.to_degrees().round() + 0.0)
}

/// Where the origin of a mesh, turned already, must stand in `W` for its front to be in the
/// finger's way, in whole tenths of a millimetre.
pub fn position_m(turned: &Mesh) -> [f64; 3] {
    let (low, high) = turned.bounds();
    let middle = |axis: usize| 0.5 * (low[axis] + high[axis]);
    [-middle(0), FRONT_Y_M - high.y, MIDDLE_Z_M - middle(2)].map(tenth_mm)
}

fn tenth_mm(length_m: f64) -> f64 {
    (length_m * 1e4).round() / 1e4 + 0.0
}

/// Rays along each side of an object's silhouette; chosen.
const RAYS: usize = 61;

/// Share of a zone that has a surface; chosen, so that a rounded corner costs no row of places and
/// no touch is spent on a rim.
const FILLED: f64 = 0.98;

/// Room behind the farthest surface of a zone; chosen.
const BEHIND_M: f64 = 0.005;

/// A zone on an object, and how much of it the object fills.
#[derive(Clone, Debug, PartialEq)]
pub struct Found {
    /// The zone, with datum and depth.
    pub zone: Zone,
    /// Share of its places with a surface.
    pub filled: f64,
}

/// The largest rectangle of the silhouette, seen along −y, of which almost all has a surface; its
/// datum in the middle of that surface, its depth from the object's front to a little behind the
/// farthest surface. None if there is no surface along the approach.
pub fn zone(bvh: &MeshBvh) -> Option<Found> {
    let (low, high) = bvh.mesh().bounds();
    let whole = Zone::new([low.x, high.x], Some([low.z, high.z]));
    let [width_m, height_m] = [high.x - low.x, high.z - low.z];
    if width_m <= 0.0 || height_m <= 0.0 {
        return None;
    }
    // In the middles of cells, so that none is asked on the very rim.
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
    Some(Found { zone, filled: met().count() as f64 / inside().count() as f64 })
}

/// First and last column, first and last row (the last ones beyond) of the largest rectangle, by
/// its area, that is filled; none if nothing is.
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
                // The widest that is larger than the best one and full enough.
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
