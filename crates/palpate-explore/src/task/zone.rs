//! Zone: the rectangle to explore.

use nalgebra::{Isometry3, Point3, UnitVector3, Vector3};
use palpate_gp::math::pose::pose;
use palpate_input::config::{Rules, Validate};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// An interval of x, or a rectangle of (x, z), in the frame `Z` of the zone. Heights are y above a
/// datum, and the finger approaches along −y.
///
/// `Z` is at [`position_m`](Self::position_m) in `W`, rotated by
/// [`rotation_deg`](Self::rotation_deg). By default it is `W`: the object is then explored along −y
/// of the robot's base. A zone rotated by −90° about z explores the object's side towards +x.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Zone {
    /// Smallest and largest x, m.
    pub x_m: [f64; 2],
    /// Smallest and largest z, m; if omitted, the zone is an interval of x.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub z_m: Option<[f64; 2]>,
    /// Height datum (y), m; default: middle of a simulated object's surface, 0 for functions and
    /// real robots.
    // A zero-mean belief returns to it far from all touches, and Eq. 5 depends on it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub datum_y_m: Option<f64>,
    /// Nearest and farthest depth (−y) of the surface, m; default in a simulation: the object's.
    /// Required for a real robot.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub depth_m: Option<[f64; 2]>,
    /// Origin of `Z` in `W`, m.
    #[serde(default)]
    pub position_m: [f64; 3],
    /// Rotation of `Z` about the fixed axes x, then y, then z of `W`, deg.
    #[serde(default)]
    pub rotation_deg: [f64; 3],
}

/// Largest coordinate of a zone; far beyond any arm's reach.
const REACH_M: f64 = 1e3;

/// Smallest side of a zone; below it, places differ by rounding only.
const SIDE_MIN_M: f64 = 1e-6;

impl Validate for Zone {
    fn check(&self, rules: &mut Rules) {
        rules.interval("x_m", self.x_m, -REACH_M..=REACH_M);
        if let Some(z_m) = self.z_m {
            rules.interval("z_m", z_m, -REACH_M..=REACH_M);
        }
        for (key, side) in ["x_m", "z_m"].iter().zip(self.sides()) {
            let wide = side[1] - side[0] >= SIDE_MIN_M;
            rules.require(key, format!("{side:?}"), wide, || {
                format!("at least {SIDE_MIN_M} m wide")
            });
        }
        rules.optional_number("datum_y_m", self.datum_y_m, -REACH_M..=REACH_M);
        if let Some(depth_m) = self.depth_m {
            rules.interval("depth_m", depth_m, -REACH_M..=REACH_M);
        }
        rules.numbers("position_m", &self.position_m, -REACH_M..=REACH_M);
        rules.numbers("rotation_deg", &self.rotation_deg, -360.0..=360.0);
    }
}

impl Zone {
    /// Creates an interval of x or a rectangle of (x, z) in `W`, with the datum y = 0.
    pub const fn new(x_m: [f64; 2], z_m: Option<[f64; 2]>) -> Self {
        let (position_m, rotation_deg) = ([0.0; 3], [0.0; 3]);
        Self { x_m, z_m, datum_y_m: None, depth_m: None, position_m, rotation_deg }
    }

    /// The datum y from which heights are measured; 0 if not given.
    pub fn datum_y_m(&self) -> f64 {
        self.datum_y_m.unwrap_or(0.0)
    }

    /// Number of coordinates of a place: 1 or 2.
    pub fn dimension(&self) -> usize {
        self.sides().count()
    }

    /// The bounds [smallest, largest] of each coordinate.
    pub fn sides(&self) -> impl Iterator<Item = [f64; 2]> + Clone {
        std::iter::once(self.x_m).chain(self.z_m)
    }

    /// Size along each coordinate.
    pub fn extents_m(&self) -> Vec<f64> {
        self.sides().map(|[low, high]| high - low).collect()
    }

    /// Length of the longest side.
    pub fn widest_m(&self) -> f64 {
        self.extents_m().into_iter().fold(0.0, f64::max)
    }

    /// Whether `place` has as many coordinates as the zone and lies in it, edges included.
    pub fn contains(&self, place: &[f64]) -> bool {
        place.len() == self.dimension()
            && self.sides().zip(place).all(|([low, high], at)| (low..=high).contains(at))
    }

    /// Whether a point of `W` lies within the sides and the depth, or at most `margin_m` outside.
    pub fn is_near(&self, p_w: &Point3<f64>, margin_m: f64) -> bool {
        let is_within =
            |[low, high]: [f64; 2], at: f64| (low - margin_m..=high + margin_m).contains(&at);
        let y_m = self.x_wz().inverse_transform_point(p_w).y;
        self.sides().zip(self.place(p_w)).all(|(side, at)| is_within(side, at))
            && self.depth_m.is_none_or(|[near_m, far_m]| is_within([-far_m, -near_m], y_m))
    }

    /// Returns the place at fractions 0..1 of the sides, which rounding does not put outside.
    pub fn at(&self, fractions: &[f64]) -> Vec<f64> {
        let between = |([low, high], t): ([f64; 2], &f64)| (low + (high - low) * t).min(high);
        self.sides().zip(fractions).map(between).collect()
    }

    /// Pose of `Z` in `W`.
    pub fn x_wz(&self) -> Isometry3<f64> {
        pose(self.position_m, self.rotation_deg)
    }

    /// Returns the place (x) or (x, z) of a point in `W`.
    pub fn place(&self, p_w: &Point3<f64>) -> Vec<f64> {
        let p_z = self.x_wz().inverse_transform_point(p_w);
        [p_z.x, p_z.z].into_iter().take(self.dimension()).collect()
    }

    /// Height of a point of `W` above the datum.
    pub fn height_m(&self, p_w: &Point3<f64>) -> f64 {
        self.x_wz().inverse_transform_point(p_w).y - self.datum_y_m()
    }

    /// Returns the point of `W` at `place` and `height_m` above the datum.
    pub fn point(&self, place: &[f64], height_m: f64) -> Point3<f64> {
        self.x_wz() * self.local(place, self.datum_y_m() + height_m)
    }

    /// Returns the point of `Z` at `place` and `y_m`; z = 0 for an interval.
    pub fn local(&self, place: &[f64], y_m: f64) -> Point3<f64> {
        let z = place.get(1).copied().unwrap_or(0.0);
        Point3::new(place.first().copied().unwrap_or(0.0), y_m, z)
    }

    /// Describes the frame of this zone's points and the direction of touch, for the head of a
    /// file.
    pub fn frame_description(&self) -> String {
        let [x, y, z] = self.ahead_w().into_inner().into();
        let tidy = |part: f64| (part * 1e6).round() / 1e6 + 0.0;
        let (x, y, z) = (tidy(x), tidy(y), tidy(z));
        format!("metres in the frame W of the robot's base: z up, touched along ({x}, {y}, {z})")
    }

    /// Direction of the finger's motion, in `W`: opposite to increasing heights.
    pub fn ahead_w(&self) -> UnitVector3<f64> {
        UnitVector3::new_unchecked(self.x_wz().rotation * -Vector3::y())
    }

    /// Returns a regular grid with `per_side` places along each side, edges included, x varying
    /// fastest.
    pub fn grid(&self, per_side: usize) -> Vec<Vec<f64>> {
        let step = |i: usize| i as f64 / (per_side.max(2) - 1) as f64;
        match self.z_m {
            None => (0..per_side).map(|i| self.at(&[step(i)])).collect(),
            Some(_) => (0..per_side * per_side)
                .map(|k| self.at(&[step(k % per_side), step(k / per_side)]))
                .collect(),
        }
    }

    /// Whether `place` lies in the outer tenth: within a tenth of a side from its ends.
    pub fn is_edge(&self, place: &[f64]) -> bool {
        self.sides().zip(place).any(|([low, high], &at)| {
            let margin = 0.1 * (high - low);
            at <= low + margin || at >= high - margin
        })
    }

    /// Distance between two places in units of the sides.
    pub fn distance(&self, a: &[f64], b: &[f64]) -> f64 {
        let squares = self.sides().zip(a.iter().zip(b)).map(|([low, high], (a, b))| {
            let step = (a - b) / (high - low);
            step * step
        });
        squares.sum::<f64>().sqrt()
    }
}

/// Returns the triangles between `columns` × `rows` places, the columns varying fastest, as of a
/// [`grid`](Zone::grid) over two sides: indices, counter-clockwise as seen by the approaching
/// finger.
pub fn grid_triangles(columns: usize, rows: usize) -> impl Iterator<Item = [usize; 3]> {
    let cells = (1..rows).flat_map(move |j| (1..columns).map(move |i| j * columns + i));
    cells.flat_map(move |here| {
        let [before, below, both] = [here - 1, here - columns, here - columns - 1];
        [[both, before, here], [both, here, below]]
    })
}
