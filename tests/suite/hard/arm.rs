//! Hard cases of the PA-10 with the finger, in difficult postures.

use super::case::{Case, Outcome, case};
use super::checked_touch::touch_solid;
use super::solids::{mesh, wall};
use super::wall::scene;
use palpate::robot::arm::ArmSettings;
use palpate::sim::Scene;
use palpate::task::Zone;

pub const CASES: &[Case] = &[
    case(
        "straight elbow",
        "at full reach no joint moves the tip outwards",
        "distance m",
        (&[0.65, 0.75, 0.85, 0.95, 1.05, 1.2], 5),
        |distance_m, period_s| {
            reach(scene(period_s), [0.0, -distance_m, 0.5], ArmSettings::default())
        },
    )
    .timed(),
    case(
        "wrist singularity",
        "two wrist axes align on the path",
        "W1 away from it deg",
        (&[60.0, 20.0, 5.0, 1.0, 0.0], 5),
        |away_deg, period_s| {
            let home_deg = [-90.0, 15.0, 0.0, 120.0, 0.0, -away_deg, 0.0];
            let arm = ArmSettings { home_deg: Some(home_deg.into()), ..ArmSettings::default() };
            reach(scene(period_s), [0.0, -0.65, 0.5], arm)
        },
    )
    .timed(),
    case(
        "joint limit",
        "the object lies at a joint limit",
        "to the side m",
        (&[0.0, 0.2, 0.4, 0.6, 0.8], 5),
        |x_m, period_s| reach(scene(period_s), [x_m, -0.6, 0.5], ArmSettings::default()),
    )
    .timed(),
    case(
        "close to the base",
        "the elbow reaches its limit, and finally home is inside the object",
        "distance m",
        (&[0.65, 0.6, 0.5, 0.4, 0.3, 0.2], 2),
        |distance_m, period_s| {
            reach(scene(period_s), [0.0, -distance_m, 0.5], ArmSettings::default())
        },
    )
    .timed(),
    case(
        "high and low",
        "shoulder and wrist share the remaining reach",
        "height m",
        (&[0.5, 0.3, 0.8, 0.1, 1.1], 5),
        |z_m, period_s| reach(scene(period_s), [0.0, -0.6, z_m], ArmSettings::default()),
    )
    .timed(),
    case(
        "base turned away",
        "the first joint starts at its limit",
        "deg",
        (&[0.0, 30.0, 60.0, 87.0, 120.0], 5),
        |deg, period_s| {
            let arm = ArmSettings { base_rotation_deg: [0.0, 0.0, deg], ..ArmSettings::default() };
            reach(scene(period_s), [0.0, -0.65, 0.5], arm)
        },
    )
    .timed(),
    case(
        "base far away",
        "kinematics a kilometre from the origin",
        "m",
        (&[0.0, 10.0, 100.0, 900.0], 4),
        |far_m, period_s| {
            let arm =
                ArmSettings { base_position_m: Some([far_m, 0.0, 0.0]), ..ArmSettings::default() };
            reach(scene(period_s), [far_m, -0.65, 0.5], arm)
        },
    )
    .timed(),
];

/// Touches the middle of a small wall at `place_m` with the arm; an unreachable wall must give an
/// error.
pub fn reach(scene: Scene, [x, y, z]: [f64; 3], arm: ArmSettings) -> Outcome {
    let zone = Zone::new([x - 0.03, x + 0.03], Some([z - 0.03, z + 0.03]));
    let zone = Some(Zone { datum_y_m: Some(y), ..zone });
    let Some(mesh) = mesh(wall(0.03), [x, y, z]) else { return Outcome::Wrong("no mesh".into()) };
    touch_solid(Scene { zone, arm: Some(arm), ..scene }, mesh, &[x, z]).on_surface(1e-3)
}
