//! Electrodes of a BioTac: positions, normals and values at rest.

use super::frame::ELECTRODES;
use nalgebra::{Point3, UnitVector3, Vector3};

/// Positions on the core in `T`, mm; E1 first.
///
/// The digits agree in TAMS-Group/biotac_gazebo_plugin, balakumar-s/biotac_force_net and
/// tams_biotac.
const POSITIONS_MM: [[f64; 3]; ELECTRODES] = [
    [0.993, -4.855, -1.116],
    [-2.700, -3.513, -3.670],
    [-6.200, -3.513, -3.670],
    [-8.000, -4.956, -1.116],
    [-10.500, -3.513, -3.670],
    [-13.400, -4.956, -1.116],
    [4.763, 0.000, -2.330],
    [3.031, -1.950, -3.330],
    [3.031, 1.950, -3.330],
    [1.299, 0.000, -4.330],
    [0.993, 4.855, -1.116],
    [-2.700, 3.513, -3.670],
    [-6.200, 3.513, -3.670],
    [-8.000, 4.956, -1.116],
    [-10.500, 3.513, -3.670],
    [-13.400, 4.956, -1.116],
    [-2.800, 0.000, -5.080],
    [-9.800, 0.000, -5.080],
    [-13.600, 0.000, -5.080],
];

/// Normals of the core at the electrodes. E7 to E10 lie on the facet; the rest as corrected in
/// balakumar-s/biotac_force_net (the printed rows 5 and 6 are swapped and E1 has a wrong sign).
const NORMALS: [[f64; 3]; ELECTRODES] = [
    [0.196, -0.956, -0.220],
    [0.0, -0.692, -0.722],
    [0.0, -0.692, -0.722],
    [0.0, -0.976, -0.220],
    [0.0, -0.692, -0.722],
    [0.0, -0.976, -0.220],
    [0.5, 0.0, -0.866],
    [0.5, 0.0, -0.866],
    [0.5, 0.0, -0.866],
    [0.5, 0.0, -0.866],
    [0.196, 0.956, -0.220],
    [0.0, 0.692, -0.722],
    [0.0, 0.692, -0.722],
    [0.0, 0.976, -0.220],
    [0.0, 0.692, -0.722],
    [0.0, 0.976, -0.220],
    [0.0, 0.0, -1.0],
    [0.0, 0.0, -1.0],
    [0.0, 0.0, -1.0],
];

/// Medians of a sensor at rest, counts (MiaoLi/syntouchcontact recordings, F2).
pub const BASELINES_COUNTS: [f64; ELECTRODES] = [
    2297.0, 3157.0, 3212.0, 2956.0, 3156.0, 2856.0, 2374.0, 2592.0, 2569.0, 2748.0, 2033.0, 3086.0,
    3135.0, 2812.0, 3108.0, 2702.0, 2989.0, 3172.0, 3209.0,
];

/// Standard deviations over the same recording, counts.
pub const NOISE_COUNTS: [f64; ELECTRODES] = [
    7.54, 4.27, 3.94, 5.43, 4.39, 6.13, 7.32, 7.0, 6.99, 6.4, 7.19, 4.57, 4.29, 5.71, 4.29, 5.73,
    5.18, 4.15, 3.56,
];

/// Standard deviation of the sensing area of an electrode in the fluid (fitted by `palpate
/// calibrate` to MiaoLi/syntouchcontact's sensor F2 on a flat plate).
pub const SPREAD_M: f64 = 2.1e-3;

/// Positions on the core in `T`, m, of a finger `scale` times as large as a BioTac.
pub fn positions_t(scale: f64) -> [Point3<f64>; ELECTRODES] {
    POSITIONS_MM.map(|p| Point3::from(Vector3::from(p) * 1e-3 * scale))
}

/// Outward normals of the core at the electrodes, in `T`.
pub fn normals_t() -> [UnitVector3<f64>; ELECTRODES] {
    NORMALS.map(|n| UnitVector3::new_normalize(Vector3::from(n)))
}
