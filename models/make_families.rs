//! Generator of four classes of objects, twelve of each with drawn dimensions: mugs, bottles,
//! brackets and drills, for libraries that lack the object that is touched.
//!
//! `cargo run --release --example make_families -- FOLDER` writes the same bytes each time. All
//! lengths are heuristic. Mugs are filled.

mod fields;
mod meshing;

use anyhow::{Context, Result};
use fields::{cuboid, cylinder, rod, together};
use meshing::{glb, nets};
use nalgebra::{Point3, Vector3, point};
use palpate::geometry::implicit::{Field, ImplicitSolid};
use palpate::gp::math::seed;
use rand::RngExt;
use std::fs;
use std::path::PathBuf;

const CLAY: (&str, [f64; 3]) = ("clay", [0.75, 0.55, 0.4]);

/// Cells, metres.
const CELL_M: f64 = 0.004;

/// Objects of each class.
const COUNT: u64 = 12;

/// Half sides of a box that contains any of the objects, metres.
const HALF_M: [f64; 3] = [0.11, 0.06, 0.13];

/// Returns the field of an object at a point, with its dimensions at numbers from 0 to 1.
type Class = fn(Point3<f64>, &[f64; 8]) -> Field;

const CLASSES: [(&str, Class); 4] =
    [("mug", mug), ("bottle", bottle), ("bracket", bracket), ("drill", drill)];

struct Object {
    class: Class,
    numbers: [f64; 8],
}

impl ImplicitSolid for Object {
    fn field(&self, p: Point3<f64>) -> Field {
        (self.class)(p, &self.numbers)
    }

    fn bounds(&self) -> [Point3<f64>; 2] {
        let half_m = Vector3::from(HALF_M);
        [Point3::from(-half_m), Point3::from(half_m)]
    }
}

fn main() -> Result<()> {
    let folder: PathBuf = std::env::args_os().nth(1).context("name a folder")?.into();
    fs::create_dir_all(&folder)?;
    for (name, class) in CLASSES {
        for number in 0..COUNT {
            let numbers = seed::stream(1, number, name).random();
            let name = format!("{name}-{:02}", number + 1);
            let mesh = nets(&Object { class, numbers }, CELL_M).with_context(|| name.clone())?;
            println!("{name}: {} triangles", mesh.triangles.len());
            fs::write(folder.join(format!("{name}.glb")), glb(&mesh, &name, CLAY)?)?;
        }
    }
    Ok(())
}

fn between(low: f64, high: f64, share: f64) -> f64 {
    low + share * (high - low)
}

fn mug(p: Point3<f64>, numbers: &[f64; 8]) -> Field {
    let [radius, height, reach, thickness, top, bottom, ..] = *numbers;
    let radius_m = between(0.028, 0.045, radius);
    let half_m = between(0.035, 0.06, height);
    let out_m = radius_m + between(0.02, 0.036, reach);
    let [up_m, down_m] = [between(0.45, 0.8, top), between(0.45, 0.8, bottom)].map(|x| x * half_m);
    let at = |x_m: f64, z_m: f64| point![x_m, 0.0, z_m];
    let inside_m = radius_m - 0.004;
    let line = [
        at(inside_m, up_m),
        at(out_m, 0.85 * up_m),
        at(out_m, -0.85 * down_m),
        at(inside_m, -down_m),
    ];
    let radius_of_handle_m = between(0.0045, 0.0075, thickness);
    let handle = line.windows(2).map(|two| rod(p, two[0], two[1], radius_of_handle_m));
    together([cylinder(p, radius_m, [-half_m, half_m])].into_iter().chain(handle), 0.003)
}

fn bottle(p: Point3<f64>, numbers: &[f64; 8]) -> Field {
    let [radius, height, neck, shoulder, blend, ..] = *numbers;
    let half_m = between(0.07, 0.115, height);
    let shoulder_m = half_m * between(0.0, 0.5, shoulder);
    let body = cylinder(p, between(0.024, 0.04, radius), [-half_m, shoulder_m]);
    let neck = cylinder(p, between(0.009, 0.016, neck), [0.0, half_m]);
    together([body, neck], between(0.006, 0.02, blend))
}

fn bracket(p: Point3<f64>, numbers: &[f64; 8]) -> Field {
    let [width, height, depth, thickness, brace, place, ..] = *numbers;
    let [width_m, height_m] = [between(0.02, 0.045, width), between(0.035, 0.065, height)];
    let (depth_m, thick_m) = (between(0.025, 0.05, depth), between(0.004, 0.007, thickness));
    let wall = cuboid(p, point![0.0, thick_m - depth_m, 0.0], [width_m, thick_m, height_m]);
    let foot = cuboid(p, point![0.0, 0.0, thick_m - height_m], [width_m, depth_m, thick_m]);
    let x_m = width_m * between(-0.6, 0.6, place);
    let rib = rod(
        p,
        point![x_m, thick_m - depth_m, 0.6 * height_m],
        point![x_m, 0.7 * depth_m, thick_m - height_m],
        between(0.004, 0.009, brace),
    );
    together([wall, foot, rib], 0.002)
}

fn drill(p: Point3<f64>, numbers: &[f64; 8]) -> Field {
    let [length, radius, height, grip, lean, foot, chuck, _] = *numbers;
    let length_m = between(0.045, 0.075, length);
    let radius_m = between(0.019, 0.026, radius);
    let half_m = between(0.07, 0.095, height);
    let top_m = half_m - radius_m;
    let body = rod(p, point![-0.02, 0.0, top_m], point![length_m - 0.03, 0.0, top_m], radius_m);
    let end = point![length_m + between(0.0, 0.02, chuck), 0.0, top_m];
    let chuck = Field::round_cone(p, [point![length_m - 0.03, 0.0, top_m], end], [0.016, 0.008]);
    let back_m = between(0.0, 0.02, lean);
    let grip = rod(
        p,
        point![-0.01, 0.0, top_m],
        point![-0.01 - back_m, 0.0, 0.015 - half_m],
        between(0.014, 0.018, grip),
    );
    let foot_m = between(0.025, 0.04, foot);
    let foot = cuboid(p, point![-0.01 - back_m, 0.0, 0.01 - half_m], [foot_m, 0.024, 0.01]);
    together([body, chuck, grip, foot], 0.004)
}
