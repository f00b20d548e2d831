//! Switches of a scene: all effects of the finger, the arm, and the masses.

use crate::sim::Scene;
use crate::sim::finger::Effects;
use crate::sim::finger::effects::effect::EffectSwitch;
use crate::sim::scene::SimulatorKind;
use palpate_input::config::Rules;

/// Returns all switches of a scene: the effects in the order of their table, then arm and masses.
pub fn switches() -> Vec<EffectSwitch<Scene>> {
    let mut all: Vec<_> = Effects::switches().into_iter().map(for_scene).collect();
    all.push(EffectSwitch::table().within(
        "arm",
        |scene: &Scene| &scene.arm,
        |scene| &mut scene.arm,
    ));
    #[cfg(feature = "mujoco")]
    all.push(EffectSwitch::new(
        "masses",
        |scene: &Scene| scene.simulator == SimulatorKind::Dynamic,
        |scene, on| {
            scene.simulator = if on { SimulatorKind::Dynamic } else { SimulatorKind::Kinematic }
        },
    ));
    all
}

/// Returns `scene` with one switch toggled, and without the effects that then have nothing to act
/// on.
pub fn toggle(scene: &Scene, switch: &EffectSwitch<Scene>) -> Scene {
    let mut scene = scene.clone();
    let (was_soft, was_on) = (scene.effects.skin.is_some(), switch.is_on(&scene));
    let had_masses = scene.simulator == SimulatorKind::Dynamic;
    switch.set(&mut scene, !was_on);
    scene.effects.remove_orphans();
    // A finger without its skin is a rigid hull; simulator `swept` is the simplest simulation of
    // its touches.
    if was_soft && scene.effects.skin.is_none() {
        scene.simulator = SimulatorKind::Swept;
    }
    let Scene { simulator: body, effects, solver, .. } = &mut scene;
    if had_masses && *body != SimulatorKind::Dynamic {
        effects.collision = None;
        (solver.collision, solver.sdf) = (None, None);
    }
    scene
}

/// Returns `scene` with every effect that its simulator supports.
pub fn with_all_effects(scene: &Scene) -> Scene {
    let effects = || Effects::switches().into_iter().map(for_scene);
    effects().fold(scene.clone(), |scene, switch| {
        let with = if switch.is_on(&scene) { scene.clone() } else { toggle(&scene, &switch) };
        if Rules::is_satisfied(&with) { with } else { scene }
    })
}

fn for_scene(switch: EffectSwitch<Effects>) -> EffectSwitch<Scene> {
    switch.within("", |scene: &Scene| &scene.effects, |scene| &mut scene.effects)
}
