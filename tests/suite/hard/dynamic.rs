//! Hard cases of complete touches by a body with masses.

use super::arm::reach;
use super::case::{Case, Outcome, case};
use super::shapes::{graze, slot, twins};
use super::wall;
use super::wall::on_wall;
use palpate::robot::arm::ArmSettings;
use palpate::sim::Scene;
use palpate::sim::scene::SimulatorKind;

pub const CASES: &[Case] = &[
    case(
        "soft finger into a wall",
        "servos need time to stop the arm after contact",
        "m/s",
        (&[0.005, 0.015, 0.02, 0.05, 0.1, 0.3, 1.0], 2),
        |approach_m_s, step_s| approach(approach_m_s, on_arm(step_s)),
    )
    .stepped(),
    case(
        "rigid finger into a wall",
        "without a skin, only the solver's contact is compliant",
        "m/s",
        (&[0.005, 0.015, 0.02, 0.05, 0.1, 0.3, 1.0], 1),
        |approach_m_s, step_s| {
            let mut scene = on_arm(step_s);
            scene.effects = Default::default();
            approach(approach_m_s, scene)
        },
    )
    .stepped(),
    case(
        "light tool",
        "an arm of 27 kg and a finger of grams share one mass matrix",
        "kg",
        (&[0.15, 0.027, 0.0027, 2.7e-4, 2.7e-5], 3),
        tool,
    )
    .stepped(),
    case(
        "heavy tool",
        "motors saturate, and finally the load exceeds the arm's capacity",
        "kg",
        (&[0.15, 1.0, 3.0, 10.0, 30.0], 4),
        tool,
    )
    .stepped(),
    case(
        "joint limit, with masses",
        "the object lies at a joint limit",
        "to the side m",
        (&[0.0, 0.2, 0.4, 0.6, 0.8], 5),
        |x_m, step_s| reach(with_masses(step_s), [x_m, -0.6, 0.5], ArmSettings::default()),
    )
    .stepped(),
    case(
        "wrist singularity, with masses",
        "two wrist axes align on the path",
        "W1 away from it deg",
        (&[60.0, 20.0, 5.0, 1.0, 0.0], 5),
        |away_deg, step_s| {
            let home_deg = [-90.0, 15.0, 0.0, 120.0, 0.0, -away_deg, 0.0];
            let arm = ArmSettings { home_deg: Some(home_deg.into()), ..ArmSettings::default() };
            reach(with_masses(step_s), [0.0, -0.65, 0.5], arm)
        },
    )
    .stepped(),
    case(
        "graze along an edge, with masses",
        "a lateral force moves a compliant arm",
        "overlap mm",
        (&[3.0, 1.0, 0.3, 0.1, 0.01, 1e-6], 6),
        |overlap_mm, step_s| graze(overlap_mm, with_masses(step_s)),
    )
    .stepped(),
    case(
        "slot narrower than the finger, with masses",
        "two edges stop a finger that one edge would not",
        "width mm",
        (&[14.0, 10.0, 6.0, 3.0, 1.0, 0.1], 6),
        |width_mm, step_s| slot(width_mm, with_masses(step_s)),
    )
    .stepped(),
    case(
        "two contacts at once, with masses",
        "two forces turn the finger",
        "one lower by mm",
        (&[1.0, 0.3, 0.1, 0.01, 0.0], 5),
        |lower_mm, step_s| twins(lower_mm, with_masses(step_s)),
    )
    .stepped(),
];

/// Approach speed of scenes with masses: the arm's servos take 0.04 s to stop.
pub const APPROACH_M_S: f64 = 0.015;

/// A soft finger on a stage with masses.
pub fn with_masses(step_s: f64) -> Scene {
    let mut scene = wall::scene(0.002);
    scene.simulator = SimulatorKind::Dynamic;
    scene.solver.step_s = step_s;
    scene.touch.approach_m_s = APPROACH_M_S;
    scene
}

/// The finger on a PA-10 at the same distance from the origin as from an object in its own scenes.
pub fn on_arm(step_s: f64) -> Scene {
    let arm = ArmSettings { base_position_m: Some([0.0, 0.65, -0.5]), ..ArmSettings::default() };
    Scene { arm: Some(arm), ..with_masses(step_s) }
}

fn approach(approach_m_s: f64, mut scene: Scene) -> Outcome {
    scene.touch.approach_m_s = approach_m_s;
    on_wall(scene)
}

fn tool(tool_kg: f64, step_s: f64) -> Outcome {
    let mut scene = on_arm(step_s);
    scene.arm.get_or_insert_default().tool_kg = tool_kg;
    on_wall(scene)
}
