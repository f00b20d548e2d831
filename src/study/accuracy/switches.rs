//! Switches of a scene: all effects of the finger, the arm, and the masses.

use crate::sim::Scene;
use crate::sim::finger::Effects;
use crate::sim::finger::effects::effect::Switch;
use crate::sim::scene::Body;
use palpate_input::config::Rules;

/// Returns all switches of a scene: the effects in the order of their table, then arm and masses.
pub fn switches() -> Vec<Switch<Scene>> {
    let mut all: Vec<_> = Effects::switches().into_iter().map(of_scene).collect();
    all.push(Switch::table().within("arm", |scene: &Scene| &scene.arm, |scene| &mut scene.arm));
    #[cfg(feature = "mujoco")]
    all.push(Switch::new(
        "masses",
        |scene: &Scene| scene.body == Body::Dynamic,
        |scene, on| scene.body = if on { Body::Dynamic } else { Body::Kinematic },
    ));
    all
}

/// Returns `scene` with one switch toggled, and without the effects that then have nothing to act
/// on.
pub fn switched(scene: &Scene, switch: &Switch<Scene>) -> Scene {
    let mut scene = scene.clone();
    let (was_soft, was_on) = (scene.effects.skin.is_some(), switch.is_on(&scene));
    let had_masses = scene.body == Body::Dynamic;
    switch.set(&mut scene, !was_on);
    scene.effects.drop_unsupported();
    // A finger without its skin is a rigid hull; body `cast` is the simplest simulation of its
    // touches.
    if was_soft && scene.effects.skin.is_none() {
        scene.body = Body::Cast;
    }
    let Scene { body, effects, solver, .. } = &mut scene;
    if had_masses && *body != Body::Dynamic {
        effects.collision = None;
        (solver.collision, solver.sdf) = (None, None);
    }
    scene
}

/// Returns `scene` with every effect that its body supports.
pub fn full(scene: &Scene) -> Scene {
    let effects = || Effects::switches().into_iter().map(of_scene);
    effects().fold(scene.clone(), |scene, switch| {
        let with = if switch.is_on(&scene) { scene.clone() } else { switched(&scene, &switch) };
        if Rules::hold(&with) { with } else { scene }
    })
}

fn of_scene(switch: Switch<Effects>) -> Switch<Scene> {
    switch.within("", |scene: &Scene| &scene.effects, |scene| &mut scene.effects)
}
