//! Generator of the suite's objects: `models/suite/NAME.glb` and their scenes,
//! `scenes/suite/NAME.toml` from one side and `scenes/suite/around/NAME.toml` from all sides.
//!
//! `cargo run --release --example make_suite` writes the same bytes each time. All lengths are
//! heuristic, so that the objects differ: full faces and silhouettes over a third of their zone,
//! holes, thin parts, steps, undercuts, reliefs, several pieces, tilted, small and large ones.

mod fields;
mod meshing;

use anyhow::{Context, Result};
use fields::{EDGE_M, ball, cuboid, disc, ellipsoid, half_space, rod, together, without};
use meshing::{glb, nets};
use nalgebra::{Point3, Vector3, point, vector};
use palpate::geometry::implicit::{Field, ImplicitSolid};
use std::fs;
use std::path::Path;

/// Cells along the longest side of an object without narrow parts.
const CELLS: f64 = 36.0;
/// Cell of an object with narrow parts, metres.
const FINE_M: f64 = 0.0025;
/// Base colour.
const CLAY: (&str, [f64; 3]) = ("clay", [0.75, 0.55, 0.4]);

/// Object in its own frame, origin in its middle, front towards +y, z up, metres.
struct Shape {
    name: &'static str,
    /// Half of its extents.
    half_m: [f64; 3],
    /// Zone as a fraction of the object's extents in x and z.
    zone: f64,
    field: fn(Point3<f64>) -> Field,
    /// Whether it has parts or gaps narrower than a fingertip.
    is_fine: bool,
}

const SHAPES: &[Shape] = &[
    // For the development of planners.
    Shape { name: "bumps", half_m: [0.055, 0.034, 0.055], zone: 0.9, field: bumps, is_fine: false },
    Shape { name: "ring", half_m: [0.055, 0.014, 0.055], zone: 1.0, field: ring, is_fine: false },
    Shape { name: "mug", half_m: [0.065, 0.036, 0.05], zone: 1.0, field: mug, is_fine: false },
    Shape { name: "relief", half_m: [0.05, 0.014, 0.05], zone: 0.9, field: relief, is_fine: false },
    Shape { name: "pair", half_m: [0.06, 0.025, 0.05], zone: 1.0, field: pair, is_fine: false },
    Shape {
        name: "stairs",
        half_m: [0.05, 0.036, 0.06],
        zone: 0.95,
        field: stairs,
        is_fine: false,
    },
    Shape { name: "hammer", half_m: [0.05, 0.016, 0.08], zone: 1.0, field: hammer, is_fine: false },
    Shape { name: "block", half_m: [0.06, 0.05, 0.055], zone: 1.0, field: block, is_fine: false },
    Shape { name: "star", half_m: [0.06, 0.016, 0.06], zone: 1.0, field: star, is_fine: false },
    Shape { name: "cone", half_m: [0.021, 0.021, 0.024], zone: 1.0, field: cone, is_fine: false },
    Shape {
        name: "boulder",
        half_m: [0.125, 0.08, 0.11],
        zone: 1.0,
        field: boulder,
        is_fine: false,
    },
    Shape { name: "cross", half_m: [0.05, 0.012, 0.06], zone: 1.0, field: cross, is_fine: false },
    Shape {
        name: "grooves",
        half_m: [0.055, 0.024, 0.05],
        zone: 0.95,
        field: grooves,
        is_fine: true,
    },
    Shape { name: "pits", half_m: [0.05, 0.02, 0.055], zone: 0.95, field: pits, is_fine: true },
    Shape { name: "grille", half_m: [0.055, 0.012, 0.06], zone: 1.0, field: grille, is_fine: true },
    Shape { name: "comb", half_m: [0.06, 0.01, 0.045], zone: 1.0, field: comb, is_fine: true },
    Shape { name: "hook", half_m: [0.045, 0.012, 0.1], zone: 1.0, field: hook, is_fine: true },
    Shape { name: "shell", half_m: [0.06, 0.04, 0.06], zone: 1.0, field: shell, is_fine: true },
    Shape { name: "bracket", half_m: [0.05, 0.04, 0.06], zone: 1.0, field: bracket, is_fine: true },
    Shape { name: "pole", half_m: [0.022, 0.022, 0.15], zone: 1.0, field: pole, is_fine: true },
    // For reported results.
    Shape { name: "waves", half_m: [0.06, 0.025, 0.05], zone: 0.9, field: waves, is_fine: false },
    Shape {
        name: "horseshoe",
        half_m: [0.055, 0.016, 0.06],
        zone: 1.0,
        field: horseshoe,
        is_fine: false,
    },
    Shape {
        name: "bottle",
        half_m: [0.032, 0.032, 0.08],
        zone: 1.0,
        field: bottle,
        is_fine: false,
    },
    Shape { name: "coin", half_m: [0.05, 0.014, 0.05], zone: 0.7, field: coin, is_fine: false },
    Shape { name: "trio", half_m: [0.07, 0.03, 0.05], zone: 1.0, field: trio, is_fine: false },
    Shape {
        name: "terrace",
        half_m: [0.055, 0.03, 0.055],
        zone: 1.0,
        field: terrace,
        is_fine: false,
    },
    Shape { name: "fork", half_m: [0.04, 0.01, 0.08], zone: 1.0, field: fork, is_fine: false },
    Shape { name: "slope", half_m: [0.05, 0.045, 0.055], zone: 0.9, field: slope, is_fine: false },
    Shape { name: "gear", half_m: [0.06, 0.014, 0.06], zone: 1.0, field: gear, is_fine: false },
    Shape { name: "knob", half_m: [0.018, 0.022, 0.018], zone: 1.0, field: knob, is_fine: false },
    Shape { name: "bowl", half_m: [0.09, 0.06, 0.09], zone: 1.0, field: bowl, is_fine: false },
    Shape { name: "vase", half_m: [0.045, 0.045, 0.07], zone: 1.0, field: vase, is_fine: false },
    Shape {
        name: "channels",
        half_m: [0.06, 0.022, 0.055],
        zone: 0.95,
        field: channels,
        is_fine: true,
    },
    Shape {
        name: "trellis",
        half_m: [0.055, 0.012, 0.055],
        zone: 1.0,
        field: trellis,
        is_fine: true,
    },
    Shape { name: "chair", half_m: [0.045, 0.045, 0.075], zone: 1.0, field: chair, is_fine: true },
    Shape { name: "pipe", half_m: [0.05, 0.02, 0.13], zone: 1.0, field: pipe, is_fine: true },
];

fn main() -> Result<()> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let [models, scenes] = ["models/suite", "scenes/suite"].map(|folder| root.join(folder));
    [&models, &scenes.join("around")].into_iter().try_for_each(fs::create_dir_all)?;
    for shape in SHAPES {
        let longest_m = shape.half_m.into_iter().fold(0.0, f64::max);
        let cell_m = if shape.is_fine { FINE_M } else { 2.0 * longest_m / CELLS };
        let mesh = nets(shape, cell_m).with_context(|| shape.name)?;
        let bytes = glb(&mesh, shape.name, CLAY)?;
        fs::write(models.join(format!("{}.glb", shape.name)), &bytes)?;
        fs::write(scenes.join(format!("{}.toml", shape.name)), scene(shape))?;
        let around = scenes.join("around").join(format!("{}.toml", shape.name));
        fs::write(around, scene_around(shape))?;
        println!("{}: {} triangles, {} bytes", shape.name, mesh.triangles.len(), bytes.len());
    }
    Ok(())
}

/// Returns the scene: the object half a metre up, 0.65 m in front of the robot, like container and
/// bird.
fn scene(shape: &Shape) -> String {
    let [x, _, z] = shape.half_m.map(|half_m| half_m * shape.zone);
    format!(
        "# Object of the suite; generated by models/make_suite.rs.\nsimulator = \"swept\"\n\n[object]\n\
         mesh = \"../../models/suite/{}.glb\"\nposition_m = [0, -0.65, 0.5]\n\n[zone]\n\
         x_m = [{:.4}, {:.4}]\nz_m = [{:.4}, {:.4}]\ndatum_y_m = -0.65\n",
        shape.name,
        -x,
        x,
        0.5 - z,
        0.5 + z
    )
}

/// Returns the scene from all sides, with a finger that touches with its apex.
fn scene_around(shape: &Shape) -> String {
    format!(
        "# Whole object of the suite; generated by models/make_suite.rs.\nsimulator = \"swept\"\n\n[object]\n\
         mesh = \"../../../models/suite/{}.glb\"\nposition_m = [0, -0.65, 0.5]\n\n[whole_object]\n\n\
         [finger]\npitch_deg = 0\n",
        shape.name
    )
}

impl ImplicitSolid for Shape {
    fn field(&self, p: Point3<f64>) -> Field {
        (self.field)(p)
    }

    fn bounds(&self) -> [Point3<f64>; 2] {
        // Room for the blends.
        let half_m = Vector3::from(self.half_m).add_scalar(EDGE_M);
        [Point3::from(-half_m), Point3::from(half_m)]
    }
}

/// Eight directions around, the first up, of unit length up to rounding.
const AROUND: [[f64; 2]; 8] = [
    [0.0, 1.0],
    [0.6, 0.8],
    [1.0, 0.0],
    [0.8, -0.6],
    [0.0, -1.0],
    [-0.6, -0.8],
    [-1.0, 0.0],
    [-0.8, 0.6],
];

fn bumps(p: Point3<f64>) -> Field {
    let slab = cuboid(p, point![0.0, -0.015, 0.0], [0.055, 0.008, 0.055]);
    let hills = [
        (point![-0.028, -0.006, 0.02], [0.018, 0.016, 0.022]),
        (point![0.022, -0.006, 0.028], [0.014, 0.026, 0.014]),
        (point![0.012, -0.006, -0.022], [0.026, 0.014, 0.018]),
    ];
    together([slab].into_iter().chain(hills.map(|(at, radii)| ellipsoid(p, at, radii))), 0.008)
}

fn ring(p: Point3<f64>) -> Field {
    let side = Field::ellipsoid(p.coords, vector![0.042, f64::INFINITY, 0.042]);
    side.tube(Field::plane(p, Point3::origin(), Vector3::y()), 0.012)
}

fn mug(p: Point3<f64>) -> Field {
    let side = Field::ellipsoid(p - point![-0.025, 0.0, 0.0], vector![0.034, 0.034, f64::INFINITY]);
    let [top, bottom] = [Vector3::z(), -Vector3::z()]
        .map(|outward| Field::plane(p, Point3::origin() + outward * 0.048, outward));
    let body = side.intersection(top, 0.006).intersection(bottom, 0.006);
    let handle = [
        rod(p, point![0.005, 0.0, 0.03], point![0.045, 0.0, 0.025], 0.006),
        rod(p, point![0.045, 0.0, 0.025], point![0.05, 0.0, -0.015], 0.006),
        rod(p, point![0.05, 0.0, -0.015], point![0.005, 0.0, -0.03], 0.006),
    ];
    together([body].into_iter().chain(handle), 0.006)
}

fn relief(p: Point3<f64>) -> Field {
    let slab = cuboid(p, point![0.0, -0.004, 0.0], [0.05, 0.009, 0.05]);
    let dots = AROUND
        .map(|[x, z]| ellipsoid(p, point![0.028 * x, 0.004, 0.028 * z], [0.009, 0.003, 0.009]));
    let bar = rod(p, point![-0.012, 0.002, -0.01], point![0.014, 0.002, 0.012], 0.005);
    together([slab, bar].into_iter().chain(dots), 0.003)
}

fn pair(p: Point3<f64>) -> Field {
    let balls = [(point![-0.033, 0.0, -0.022], 0.024), (point![0.034, 0.002, 0.024], 0.022)];
    together(balls.map(|(at, radius_m)| ball(p, at, radius_m)), EDGE_M)
}

fn stairs(p: Point3<f64>) -> Field {
    let step = |i: usize| {
        let i = i as f64;
        cuboid(
            p,
            point![0.0, -0.012 + 0.006 * i, 0.042 - 0.028 * i],
            [0.05, 0.01 + 0.006 * i, 0.016],
        )
    };
    together((0..4).map(step), 0.002)
}

fn hammer(p: Point3<f64>) -> Field {
    let handle = rod(p, point![0.0, 0.0, -0.07], point![0.0, 0.0, 0.06], 0.008);
    let head = cuboid(p, point![0.0, 0.0, 0.06], [0.046, 0.014, 0.015]);
    handle.union(head, EDGE_M)
}

/// Returns a box on one corner.
fn block(p: Point3<f64>) -> Field {
    let axes = [vector![0.8, 0.36, 0.48], vector![-0.6, 0.48, 0.64], vector![0.0, -0.8, 0.6]];
    let planes = axes.into_iter().zip([0.034, 0.03, 0.036]).flat_map(|(axis, half_m)| {
        [axis, -axis]
            .map(|outward| half_space(p, Point3::origin() + outward.normalize() * half_m, outward))
    });
    planes.reduce(|a, b| a.intersection(b, EDGE_M)).unwrap_or(ball(p, Point3::origin(), 0.03))
}

fn star(p: Point3<f64>) -> Field {
    let arms = [[0.0, 1.0], [0.951, 0.309], [0.588, -0.809], [-0.588, -0.809], [-0.951, 0.309]];
    let arm = |[x, z]: [f64; 2]| {
        Field::round_cone(p, [Point3::origin(), point![0.054 * x, 0.0, 0.054 * z]], [0.015, 0.005])
    };
    together(arms.map(arm), 0.006)
}

fn cone(p: Point3<f64>) -> Field {
    Field::round_cone(p, [point![0.0, 0.0, -0.004], point![0.0, 0.0, 0.019]], [0.019, 0.004])
}

fn boulder(p: Point3<f64>) -> Field {
    let parts = [
        (point![-0.01, -0.01, -0.02], [0.11, 0.07, 0.085]),
        (point![0.05, 0.015, 0.03], [0.06, 0.05, 0.06]),
        (point![-0.05, 0.01, 0.06], [0.05, 0.05, 0.042]),
    ];
    together(parts.map(|(at, radii)| ellipsoid(p, at, radii)), 0.03)
}

fn cross(p: Point3<f64>) -> Field {
    let post = cuboid(p, Point3::origin(), [0.012, 0.01, 0.058]);
    post.union(cuboid(p, point![0.0, 0.0, 0.02], [0.048, 0.01, 0.011]), EDGE_M)
}

fn waves(p: Point3<f64>) -> Field {
    let slab = cuboid(p, point![0.0, -0.014, 0.0], [0.06, 0.01, 0.05]);
    let ridge = |i: usize| {
        let x = 0.024 * (i as f64 - 2.0);
        let height_m = [0.008, 0.012, 0.016, 0.011, 0.006][i];
        ellipsoid(p, point![x, -0.006, 0.0], [0.01, height_m + 0.006, f64::INFINITY])
            .intersection(Field::plane(p, point![0.0, 0.0, 0.048], Vector3::z()), EDGE_M)
            .intersection(Field::plane(p, point![0.0, 0.0, -0.048], -Vector3::z()), EDGE_M)
    };
    together([slab].into_iter().chain((0..5).map(ridge)), 0.006)
}

fn horseshoe(p: Point3<f64>) -> Field {
    let ends = [
        [-0.038, -0.05],
        [-0.042, -0.01],
        [-0.028, 0.03],
        [0.0, 0.045],
        [0.028, 0.03],
        [0.042, -0.01],
        [0.038, -0.05],
    ];
    let parts = ends.windows(2).map(|two| {
        rod(p, point![two[0][0], 0.0, two[0][1]], point![two[1][0], 0.0, two[1][1]], 0.011)
    });
    together(parts, 0.004)
}

fn bottle(p: Point3<f64>) -> Field {
    let body =
        Field::round_cone(p, [point![0.0, 0.0, -0.05], point![0.0, 0.0, 0.012]], [0.028, 0.027]);
    let neck = rod(p, point![0.0, 0.0, 0.03], point![0.0, 0.0, 0.066], 0.011);
    let lip = ellipsoid(p, point![0.0, 0.0, 0.066], [0.016, 0.016, 0.007]);
    body.union(neck, 0.02).union(lip, 0.004)
}

fn coin(p: Point3<f64>) -> Field {
    let plate = disc(p, point![0.0, -0.004, 0.0], 0.049, 0.008);
    let side = Field::ellipsoid(p.coords, vector![0.03, f64::INFINITY, 0.03]);
    let rim = side.tube(Field::plane(p, point![0.0, 0.003, 0.0], Vector3::y()), 0.004);
    let face = ellipsoid(p, point![0.004, 0.003, 0.002], [0.012, 0.004, 0.016]);
    let nose = rod(p, point![-0.014, 0.002, 0.006], point![0.002, 0.002, -0.012], 0.004);
    together([plate, rim, face, nose], EDGE_M)
}

fn trio(p: Point3<f64>) -> Field {
    together(
        [
            ball(p, point![-0.045, 0.004, 0.02], 0.022),
            rod(p, point![0.0, 0.0, -0.038], point![0.004, 0.006, 0.036], 0.01),
            ellipsoid(p, point![0.045, -0.004, -0.015], [0.02, 0.026, 0.03]),
        ],
        EDGE_M,
    )
}

fn terrace(p: Point3<f64>) -> Field {
    let floors = [(0.053, -0.02), (0.038, -0.008), (0.022, 0.004), (0.01, 0.016)];
    together(floors.map(|(radius_m, y)| disc(p, point![0.0, y, 0.0], radius_m, 0.009)), 0.002)
}

fn fork(p: Point3<f64>) -> Field {
    let handle = rod(p, point![0.0, 0.0, -0.072], point![0.0, 0.0, 0.0], 0.007);
    let bridge = rod(p, point![-0.03, 0.0, 0.005], point![0.03, 0.0, 0.005], 0.008);
    let tines = [-0.03, 0.0, 0.03].map(|x| {
        Field::round_cone(p, [point![x, 0.0, 0.005], point![x, 0.0, 0.073]], [0.007, 0.004])
    });
    together([handle, bridge].into_iter().chain(tines), 0.004)
}

fn slope(p: Point3<f64>) -> Field {
    let front = half_space(p, Point3::origin(), vector![0.3, 0.8, 0.4]);
    let body = cuboid(p, Point3::origin(), [0.05, 0.042, 0.055]).intersection(front, EDGE_M);
    let knob = ball(p, point![0.012, 0.004, -0.02], 0.012);
    body.union(knob, 0.004)
}

fn gear(p: Point3<f64>) -> Field {
    let wheel = disc(p, Point3::origin(), 0.046, 0.01);
    let teeth = AROUND.map(|[x, z]| {
        rod(p, point![0.04 * x, 0.0, 0.04 * z], point![0.05 * x, 0.0, 0.05 * z], 0.008)
    });
    let hub = disc(p, point![0.0, 0.006, 0.0], 0.024, 0.007);
    let body = together([wheel, hub].into_iter().chain(teeth), EDGE_M);
    without(body, Field::ellipsoid(p.coords, vector![0.012, f64::INFINITY, 0.012]))
}

fn knob(p: Point3<f64>) -> Field {
    let foot = disc(p, point![0.0, -0.016, 0.0], 0.016, 0.005);
    let stem = rod(p, point![0.0, -0.014, 0.0], point![0.0, 0.008, 0.0], 0.006);
    together([foot, stem, ball(p, point![0.0, 0.01, 0.0], 0.011)], EDGE_M)
}

fn bowl(p: Point3<f64>) -> Field {
    let whole = ellipsoid(p, point![0.0, -0.01, 0.0], [0.087, 0.05, 0.087]);
    let rim = Field::plane(p, point![0.0, 0.02, 0.0], Vector3::y());
    let hollow = ellipsoid(p, point![0.0, 0.02, 0.0], [0.06, 0.05, 0.06]);
    without(whole.intersection(rim, EDGE_M), hollow)
}

fn vase(p: Point3<f64>) -> Field {
    together(
        [
            ball(p, point![0.0, 0.0, -0.022], 0.04),
            rod(p, point![0.0, 0.0, 0.0], point![0.0, 0.0, 0.05], 0.015),
            ellipsoid(p, point![0.0, 0.0, 0.058], [0.032, 0.032, 0.008]),
            disc_up(p, -0.062),
        ],
        0.008,
    )
}

/// Returns a block with vertical grooves of different widths and depths.
fn grooves(p: Point3<f64>) -> Field {
    let block = cuboid(p, Point3::origin(), [0.053, 0.022, 0.048]);
    let groove = |(x, half_m, depth_m): (f64, f64, f64)| {
        cuboid(p, point![x, 0.03, 0.0], [half_m, 0.008 + depth_m, 0.06])
    };
    let cuts = [
        (-0.036, 0.004, 0.01),
        (-0.01, 0.006, 0.016),
        (0.02, 0.0045, 0.022),
        (0.042, 0.003, 0.008),
    ];
    cuts.map(groove).into_iter().fold(block, without)
}

/// Returns a plate with round pits, some of them wider than a fingertip.
fn pits(p: Point3<f64>) -> Field {
    let plate = cuboid(p, Point3::origin(), [0.048, 0.018, 0.053]);
    let pit = |(x, z, radius_m, depth_m): (f64, f64, f64, f64)| {
        disc(p, point![x, 0.03, z], radius_m, 0.012 + depth_m)
    };
    let holes = [
        (-0.028, 0.03, 0.006, 0.012),
        (0.008, 0.034, 0.009, 0.016),
        (0.034, 0.014, 0.005, 0.02),
        (-0.012, 0.0, 0.012, 0.01),
        (0.02, -0.022, 0.0065, 0.024),
        (-0.03, -0.034, 0.008, 0.008),
    ];
    holes.map(pit).into_iter().fold(plate, without)
}

/// Returns narrow bars in a frame; one can look through between them.
fn grille(p: Point3<f64>) -> Field {
    let bar = |a: [f64; 2], b: [f64; 2], radius_m| {
        rod(p, point![a[0], 0.0, a[1]], point![b[0], 0.0, b[1]], radius_m)
    };
    let frame = [
        bar([-0.048, -0.053], [-0.048, 0.053], 0.006),
        bar([0.048, -0.053], [0.048, 0.053], 0.006),
        bar([-0.048, -0.053], [0.048, -0.053], 0.006),
        bar([-0.048, 0.053], [0.048, 0.053], 0.006),
    ];
    let bars = [-0.03, -0.006, 0.022].map(|x| bar([x, -0.053], [x, 0.053], 0.0035));
    together(frame.into_iter().chain(bars), 0.002)
}

fn comb(p: Point3<f64>) -> Field {
    let spine = cuboid(p, point![0.0, 0.0, 0.033], [0.058, 0.008, 0.01]);
    let teeth = (0..6).map(|i| {
        let x = 0.022 * (f64::from(i) - 2.5);
        Field::round_cone(p, [point![x, 0.0, 0.03], point![x, 0.0, -0.041]], [0.005, 0.003])
    });
    together([spine].into_iter().chain(teeth), 0.003)
}

fn hook(p: Point3<f64>) -> Field {
    let ends = [
        [-0.02, 0.092],
        [-0.02, -0.04],
        [-0.012, -0.072],
        [0.008, -0.086],
        [0.028, -0.074],
        [0.036, -0.05],
        [0.036, -0.03],
    ];
    let parts = ends.windows(2).map(|two| {
        rod(p, point![two[0][0], 0.0, two[0][1]], point![two[1][0], 0.0, two[1][1]], 0.0065)
    });
    together(parts, 0.003)
}

/// Returns a thin bowl that opens towards +y.
fn shell(p: Point3<f64>) -> Field {
    let outside = ellipsoid(p, point![0.0, 0.03, 0.0], [0.058, 0.066, 0.058]);
    let inside = ellipsoid(p, point![0.0, 0.03, 0.0], [0.052, 0.06, 0.052]);
    let rim = Field::plane(p, point![0.0, 0.034, 0.0], Vector3::y());
    without(outside, inside).intersection(rim, EDGE_M)
}

/// Returns two thin sheets at a right angle, with a brace.
fn bracket(p: Point3<f64>) -> Field {
    let sheets = [
        cuboid(p, point![0.0, -0.033, 0.0], [0.048, 0.004, 0.058]),
        cuboid(p, point![0.0, 0.0, -0.052], [0.048, 0.037, 0.005]),
    ];
    let brace = rod(p, point![0.0, -0.032, 0.03], point![0.0, 0.028, -0.05], 0.005);
    together(sheets.into_iter().chain([brace]), 0.002)
}

fn pole(p: Point3<f64>) -> Field {
    let shaft = rod(p, point![0.0, 0.0, -0.138], point![0.0, 0.0, 0.138], 0.009);
    let knots = [(-0.11, 0.02), (-0.02, 0.015), (0.07, 0.019)]
        .map(|(z, radius_m)| ellipsoid(p, point![0.0, 0.0, z], [radius_m, radius_m, 0.008]));
    together([shaft].into_iter().chain(knots), 0.004)
}

/// Returns a block with two families of channels that cross.
fn channels(p: Point3<f64>) -> Field {
    let block = cuboid(p, Point3::origin(), [0.058, 0.02, 0.053]);
    let cut = |across: Vector3<f64>, offset_m: f64, half_m: f64, depth_m: f64| {
        let across = across.normalize();
        let [one, other] = [across, -across].map(|side| {
            Field::plane(p, Point3::origin() + across * offset_m + side * half_m, side)
        });
        let floor = Field::plane(p, point![0.0, 0.02 - depth_m, 0.0], -Vector3::y());
        one.intersection(other, 0.001).intersection(floor, EDGE_M)
    };
    let (a, b) = (vector![0.9, 0.0, 0.35], vector![-0.3, 0.0, 0.9]);
    let cuts = [
        cut(a, -0.03, 0.005, 0.014),
        cut(a, 0.018, 0.0035, 0.02),
        cut(b, -0.02, 0.0055, 0.01),
        cut(b, 0.024, 0.004, 0.018),
    ];
    cuts.into_iter().fold(block, without)
}

/// Returns narrow bars that cross at an angle.
fn trellis(p: Point3<f64>) -> Field {
    let bar =
        |a: [f64; 2], b: [f64; 2]| rod(p, point![a[0], 0.0, a[1]], point![b[0], 0.0, b[1]], 0.0045);
    let bars = [
        bar([-0.05, -0.03], [0.02, 0.05]),
        bar([-0.02, -0.05], [0.05, 0.03]),
        bar([-0.05, 0.01], [0.0, -0.05]),
        bar([-0.03, 0.05], [0.05, -0.04]),
        bar([-0.05, -0.05], [0.05, -0.05]),
        bar([-0.05, -0.05], [-0.05, 0.05]),
    ];
    together(bars, 0.002)
}

fn chair(p: Point3<f64>) -> Field {
    let seat = cuboid(p, point![0.0, 0.0, -0.005], [0.042, 0.042, 0.005]);
    let back = cuboid(p, point![0.0, -0.038, 0.035], [0.042, 0.005, 0.037]);
    let legs = [[-1.0, -1.0], [1.0, -1.0], [-1.0, 1.0], [1.0, 1.0]].map(|[x, y]| {
        rod(p, point![0.036 * x, 0.036 * y, -0.068], point![0.036 * x, 0.036 * y, -0.005], 0.0055)
    });
    together([seat, back].into_iter().chain(legs), 0.002)
}

/// Returns a long bent pipe, open at both ends.
fn pipe(p: Point3<f64>) -> Field {
    let path = [[-0.034, -0.12], [-0.034, 0.03], [-0.02, 0.062], [0.0, 0.08], [0.034, 0.09]];
    let along = |radius_m: f64, beyond_m: f64| {
        let ends = path.windows(2).enumerate().map(|(i, two)| {
            let z = if i == 0 { two[0][1] - beyond_m } else { two[0][1] };
            let x = if i == 3 { two[1][0] + beyond_m } else { two[1][0] };
            rod(p, point![two[0][0], 0.0, z], point![x, 0.0, two[1][1]], radius_m)
        });
        together(ends, 0.002)
    };
    let bottom = Field::plane(p, point![0.0, 0.0, -0.12], -Vector3::z());
    let side = Field::plane(p, point![0.038, 0.0, 0.0], Vector3::x());
    let whole = along(0.014, 0.02).intersection(bottom, EDGE_M).intersection(side, EDGE_M);
    without(whole, along(0.009, 0.03))
}

/// Returns a foot: a horizontal disc at a height.
fn disc_up(p: Point3<f64>, z: f64) -> Field {
    ellipsoid(p, point![0.0, 0.0, z], [0.03, 0.03, 0.007])
}
