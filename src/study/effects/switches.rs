//! What of a scene can be switched: every effect of the finger, its arm, and the masses.

use crate::sim::Scene;
use crate::sim::finger::Effects;
use crate::sim::finger::effects::switch::Switch;
use crate::sim::scene::Body;

/// Every switch of a scene, the effects first, in the order of their table.
pub fn switches() -> Vec<Switch<Scene>> {
    let of_scene = |switch: Switch<Effects>| {
        switch.within("", |scene: &Scene| &scene.effects, |scene| &mut scene.effects)
    };
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

/// `scene` with one switch the other way round, and without what then has nothing to act on.
pub fn switched(scene: &Scene, switch: &Switch<Scene>) -> Scene {
    let mut scene = scene.clone();
    let (was_soft, was_on) = (scene.effects.is_soft(), switch.is_on(&scene));
    switch.set(&mut scene, !was_on);
    scene.effects.drop_unsupported();
    // A finger that has lost its skin is a rigid hull, and the simplest touch with one is a cast.
    if was_soft && !scene.effects.is_soft() {
        scene.body = Body::Cast;
    }
    scene
}
