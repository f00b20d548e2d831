//! Hard cases of complete touches by a body with masses and a shell skin.

use super::case::{Case, case};
use super::dynamic::{on_arm, with_masses};
use super::shapes::{graze, slot, twins};
use super::wall::on_wall;
use palpate::sim::Scene;
use palpate::sim::finger::effects::skin::SkinModel;

pub const CASES: &[Case] = &[
    case(
        "shell into a wall, with masses",
        "servos need time to stop the arm after contact",
        "m/s",
        (&[0.005, 0.015, 0.02, 0.05, 0.1, 0.3, 1.0], 2),
        |approach_m_s, step_s| {
            let mut scene = shell(on_arm(step_s));
            scene.touch.approach_m_s = approach_m_s;
            on_wall(scene)
        },
    )
    .stepped(),
    case(
        "shell grazes along an edge, with masses",
        "a lateral force moves a compliant arm",
        "overlap mm",
        (&[3.0, 1.0, 0.3, 0.1, 0.01, 1e-6], 6),
        |overlap_mm, step_s| graze(overlap_mm, shell(with_masses(step_s))),
    )
    .stepped(),
    case(
        "shell in a slot, with masses",
        "two edges stop a finger that one edge would not",
        "width mm",
        (&[14.0, 10.0, 6.0, 3.0, 1.0, 0.1], 6),
        |width_mm, step_s| slot(width_mm, shell(with_masses(step_s))),
    )
    .stepped(),
    case(
        "shell between two contacts, with masses",
        "two forces turn the finger",
        "one lower by mm",
        (&[1.0, 0.3, 0.1, 0.01, 0.0], 5),
        |lower_mm, step_s| twins(lower_mm, shell(with_masses(step_s))),
    )
    .stepped(),
];

fn shell(mut scene: Scene) -> Scene {
    scene.effects.skin.get_or_insert_default().model = SkinModel::Shell;
    scene
}
