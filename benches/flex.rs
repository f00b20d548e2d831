//! The skin as finite elements beside the elastic foundation: `cargo bench --bench flex`. Prints
//! the table of `docs/dynamic.md`.

#[path = "../tests/suite/common/presses.rs"]
#[allow(dead_code)]
mod presses;
#[path = "../tests/suite/common/shapes.rs"]
#[allow(dead_code)]
mod shapes;

use nalgebra::Point3;
use palpate::geometry::mesh::Mesh;
use palpate::sim::finger::Effects;
use presses::{Press, environment, foundation, press, shell, wall};

const DEPTHS_M: [f64; 2] = [0.5e-3, 1e-3];

/// The finest comes first: what the electrodes of the others are compared with.
fn skins() -> Vec<(String, Effects)> {
    let shells = [(24, 16), (18, 12), (12, 8)]
        .map(|(along, around)| (format!("flex {along} × {around}"), shell(along, around)));
    let foundations =
        [4000, 500].map(|samples| (format!("foundation {samples}"), foundation(samples)));
    shells.into_iter().chain(foundations).collect()
}

fn report(shape: &str, mesh: &Mesh, pitch_deg: f64) {
    let mut finest: Option<Press> = None;
    for (name, effects) in skins() {
        let environment = environment(effects, mesh.clone(), pitch_deg);
        let presses: Result<Vec<Press>, _> =
            DEPTHS_M.iter().map(|&depth_m| press(&environment, depth_m)).collect();
        let mut presses = match presses {
            Ok(presses) => presses,
            Err(fault) => {
                println!("| {shape}, {pitch_deg}° | {name} | {fault} | | | | |");
                continue;
            }
        };
        let Some(deepest) = presses.pop() else { continue };
        let forces = presses.iter().chain([&deepest]).map(|press| press.load.force_n.norm());
        let forces: Vec<String> = forces.map(|force_n| format!("{force_n:.2}")).collect();
        let off = finest.as_ref().map_or("reference".into(), |finest| {
            let off = deepest.counts.iter().zip(&finest.counts).map(|(a, b)| (a - b).abs());
            format!("{:.1}", off.sum::<f64>() / deepest.counts.len() as f64)
        });
        let changed: f64 = deepest.counts.iter().map(|change| change.abs()).sum();
        println!(
            "| {shape}, {pitch_deg}° | {name} | {} | {:.1} | {:.0} | {off} | {:.3} |",
            forces.join(" / "),
            deepest.load.pressure_pa / 1e3,
            changed / deepest.counts.len() as f64,
            deepest.wall_s / deepest.simulated_s,
        );
        finest.get_or_insert(deepest);
    }
}

fn main() {
    println!(
        "| pressed on, at pitch | skin | force at 0.5 / 1 mm, N | pressure, kPa | electrodes, mean change, counts | off the finest, counts | wall ms per simulated ms |"
    );
    println!("|---|---|---|---|---|---|---|");
    let ball = shapes::sphere_mesh(Point3::new(0.0, -0.02, 0.0), 0.02, 120);
    for pitch_deg in [90.0, 70.0, 45.0] {
        report("plane", &wall(), pitch_deg);
        report("sphere of 20 mm", &ball, pitch_deg);
    }
}
