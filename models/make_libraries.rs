//! Generator of two libraries for recognition: `models/lookalikes`, objects that differ little, and
//! `models/digits`, relief digits on plates in several hands.
//!
//! `cargo run --release --example make_libraries` writes the same bytes each time. All lengths are
//! heuristic.

mod fields;
mod meshing;

use anyhow::{Context, Result};
use fields::{EDGE_M, cuboid, cylinder, rod, together};
use meshing::{glb, nets};
use nalgebra::{Point3, Vector3, point, vector};
use palpate::geometry::implicit::{Field, ImplicitSolid};
use std::f64::consts::PI;
use std::fs;
use std::path::Path;

const CLAY: (&str, [f64; 3]) = ("clay", [0.75, 0.55, 0.4]);

/// Cells of the look-alikes and of the digits, metres.
const CELL_M: f64 = 0.004;
const DIGIT_CELL_M: f64 = 0.003;

/// Object in its own frame, origin in its middle, z up.
struct Shape<F: Fn(Point3<f64>) -> Field + Send + Sync> {
    name: String,
    half_m: [f64; 3],
    field: F,
}

impl<F: Fn(Point3<f64>) -> Field + Send + Sync> ImplicitSolid for Shape<F> {
    fn field(&self, p: Point3<f64>) -> Field {
        (self.field)(p)
    }

    fn bounds(&self) -> [Point3<f64>; 2] {
        let half_m = Vector3::from(self.half_m).add_scalar(EDGE_M);
        [Point3::from(-half_m), Point3::from(half_m)]
    }
}

fn write(
    folder: &Path,
    cell_m: f64,
    shape: &Shape<impl Fn(Point3<f64>) -> Field + Send + Sync>,
) -> Result<()> {
    let mesh = nets(shape, cell_m).with_context(|| shape.name.clone())?;
    let bytes = glb(&mesh, &shape.name, CLAY)?;
    println!("{}: {} triangles, {} bytes", shape.name, mesh.triangles.len(), bytes.len());
    Ok(fs::write(folder.join(format!("{}.glb", shape.name)), bytes)?)
}

fn main() -> Result<()> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("models");
    let [alike, digits] = ["lookalikes", "digits"].map(|folder| root.join(folder));
    [&alike, &digits].into_iter().try_for_each(fs::create_dir_all)?;
    // Boxes whose sides differ by 3 mm.
    for (name, sides_m) in [
        ("box", [0.060, 0.040, 0.080]),
        ("box-wider", [0.063, 0.040, 0.080]),
        ("box-deeper", [0.060, 0.043, 0.080]),
        ("box-higher", [0.060, 0.040, 0.083]),
    ] {
        let half_m = sides_m.map(|side_m| side_m / 2.0);
        let field = move |p| cuboid(p, Point3::origin(), half_m);
        write(&alike, CELL_M, &Shape { name: name.into(), half_m, field })?;
    }
    // Mugs whose handle is at another height, or larger.
    for (name, up_m, out_m) in [
        ("mug-low", -0.012, 0.045),
        ("mug-middle", 0.0, 0.045),
        ("mug-high", 0.012, 0.045),
        ("mug-large-handle", 0.0, 0.053),
    ] {
        let field = move |p| mug(p, up_m, out_m);
        let half_m = [0.065, 0.036, 0.05];
        write(&alike, CELL_M, &Shape { name: name.into(), half_m, field })?;
    }
    // Bottles whose neck is wider, longer, or on a lower shoulder.
    for (name, neck_m, shoulder_m) in [
        ("bottle", 0.011, 0.030),
        ("bottle-wide-neck", 0.014, 0.030),
        ("bottle-low-shoulder", 0.011, 0.015),
        ("bottle-narrow-neck", 0.008, 0.030),
    ] {
        let field = move |p| bottle(p, neck_m, shoulder_m);
        let half_m = [0.032, 0.032, 0.08];
        write(&alike, CELL_M, &Shape { name: name.into(), half_m, field })?;
    }
    for digit in 0..10 {
        for hand in &HANDS {
            let lines = digit_lines(digit, hand);
            let field = |p| plate(p, &lines, hand.stroke_m);
            let half_m = [0.035, 0.045, 0.006];
            let name = format!("{digit}-{}", hand.name);
            write(&digits, DIGIT_CELL_M, &Shape { name, half_m, field })?;
        }
    }
    Ok(())
}

fn mug(p: Point3<f64>, up_m: f64, out_m: f64) -> Field {
    let p = p + vector![0.025, 0.0, 0.0];
    let body = cylinder(p, 0.034, [-0.048, 0.048]);
    let ends = [[0.03, 0.022], [out_m + 0.02, 0.018], [out_m + 0.02, -0.018], [0.03, -0.022]];
    let at = |[x, z]: [f64; 2]| point![x, 0.0, z + up_m];
    let handle = ends.windows(2).map(|two| rod(p, at(two[0]), at(two[1]), 0.006));
    together([body].into_iter().chain(handle), 0.003)
}

fn bottle(p: Point3<f64>, neck_m: f64, shoulder_m: f64) -> Field {
    let body = cylinder(p, 0.03, [-0.078, shoulder_m]);
    let neck = cylinder(p, neck_m, [-0.02, 0.078]);
    together([body, neck], 0.012)
}

/// A way to write digits.
struct Hand {
    name: &'static str,
    /// Horizontal shift per height.
    slant: f64,
    /// Width over height.
    aspect: f64,
    /// Radius of the strokes, metres.
    stroke_m: f64,
    /// Share of the upper loop in the height.
    waist: f64,
    /// Whether a seven has a bar, a one a foot and a flag, a four an open top.
    is_ornate: bool,
}

const HANDS: [Hand; 6] = [
    Hand {
        name: "plain",
        slant: 0.0,
        aspect: 0.62,
        stroke_m: 0.0035,
        waist: 0.5,
        is_ornate: false,
    },
    Hand {
        name: "slanted",
        slant: 0.3,
        aspect: 0.6,
        stroke_m: 0.003,
        waist: 0.48,
        is_ornate: false,
    },
    Hand {
        name: "narrow",
        slant: 0.1,
        aspect: 0.48,
        stroke_m: 0.0035,
        waist: 0.45,
        is_ornate: true,
    },
    Hand {
        name: "wide",
        slant: 0.05,
        aspect: 0.78,
        stroke_m: 0.004,
        waist: 0.52,
        is_ornate: false,
    },
    Hand {
        name: "ornate",
        slant: 0.15,
        aspect: 0.65,
        stroke_m: 0.003,
        waist: 0.42,
        is_ornate: true,
    },
    Hand {
        name: "leaning",
        slant: -0.15,
        aspect: 0.66,
        stroke_m: 0.0032,
        waist: 0.55,
        is_ornate: true,
    },
];

/// Height of a digit, metres.
const HEIGHT_M: f64 = 0.06;

/// Returns the points of an arc around a centre, from one angle to another, deg, anticlockwise from
/// the right.
fn arc([x, y]: [f64; 2], [a, b]: [f64; 2], [from, to]: [f64; 2]) -> Vec<[f64; 2]> {
    let count = 10;
    let angle = |i: i32| (from + (to - from) * f64::from(i) / f64::from(count)) * PI / 180.0;
    (0..=count).map(|i| [x + a * angle(i).cos(), y + b * angle(i).sin()]).collect()
}

/// Returns the polylines of a digit, metres, in the unit square of a hand and then as it writes.
fn digit_lines(digit: u32, hand: &Hand) -> Vec<Vec<[f64; 2]>> {
    let w = hand.waist;
    // Half heights and middles of the upper and the lower loop, which meet at 1 − w.
    let (up, low) = (w / 2.0, (1.0 - w) / 2.0);
    let (up_y, low_y) = (1.0 - up, low);
    let half = 0.5;
    let lines: Vec<Vec<[f64; 2]>> = match digit {
        0 => vec![arc([half, 0.5], [half, 0.5], [0.0, 360.0])],
        1 if hand.is_ornate => {
            vec![vec![[0.15, 0.75], [0.55, 1.0], [0.55, 0.0]], vec![[0.2, 0.0], [0.9, 0.0]]]
        }
        1 => vec![vec![[0.5, 1.0], [0.5, 0.0]]],
        2 => {
            let mut line = arc([half, up_y], [half, up], [170.0, -30.0]);
            line.extend([[0.0, 0.0], [1.0, 0.0]]);
            vec![line]
        }
        3 => {
            let mut line = arc([0.45, up_y], [0.42, up], [150.0, -90.0]);
            line.extend(arc([0.45, low_y], [half, low], [90.0, -150.0]));
            vec![line]
        }
        4 if hand.is_ornate => {
            vec![vec![[0.1, 1.0], [0.05, 0.4], [1.0, 0.4]], vec![[0.75, 0.9], [0.75, 0.0]]]
        }
        4 => vec![vec![[0.75, 0.0], [0.75, 1.0], [0.0, 0.35], [1.0, 0.35]]],
        5 => {
            let mut line = vec![[0.9, 1.0], [0.15, 1.0], [0.1, 1.0 - w + 0.05]];
            line.extend(arc([0.45, low_y], [0.52, low + 0.02], [120.0, -150.0]));
            vec![line]
        }
        6 => {
            let mut line = vec![[0.75, 1.0], [0.35, 0.8]];
            line.extend(arc([half, low_y], [half, low], [165.0, 525.0]));
            vec![line]
        }
        7 if hand.is_ornate => {
            vec![vec![[0.0, 1.0], [1.0, 1.0], [0.35, 0.0]], vec![[0.25, 0.5], [0.95, 0.5]]]
        }
        7 => vec![vec![[0.0, 1.0], [1.0, 1.0], [0.35, 0.0]]],
        8 => vec![
            arc([half, up_y], [0.42, up], [0.0, 360.0]),
            arc([half, low_y], [half, low], [0.0, 360.0]),
        ],
        _ => {
            let mut line = arc([half, up_y], [half, up], [-15.0, 345.0]);
            line.extend([[0.9, 0.45], [0.6, 0.0]]);
            vec![line]
        }
    };
    let written = |[x, y]: [f64; 2]| {
        let across = (x - 0.5) * hand.aspect + (y - 0.5) * hand.slant;
        [HEIGHT_M * across, HEIGHT_M * (y - 0.5)]
    };
    lines.into_iter().map(|line| line.into_iter().map(written).collect()).collect()
}

/// Returns a plate with raised lines on its upper side.
fn plate(p: Point3<f64>, lines: &[Vec<[f64; 2]>], stroke_m: f64) -> Field {
    let slab = cuboid(p, point![0.0, 0.0, -0.002], [0.034, 0.044, 0.004]);
    let at = |[x, y]: [f64; 2]| point![x, y, 0.002];
    let strokes = lines
        .iter()
        .flat_map(|line| line.windows(2).map(|two| rod(p, at(two[0]), at(two[1]), stroke_m)));
    together([slab].into_iter().chain(strokes), 0.001)
}
