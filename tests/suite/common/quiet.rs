//! A finger with ideal readings, and a plane for it.

use super::shapes::square;
use palpate::geometry::bvh::MeshBvh;
use palpate::sim::finger::Effects;
use palpate::sim::finger::effects::electrodes::ElectrodesEffect;
use palpate::sim::finger::effects::fluid::FluidEffect;
use palpate::sim::finger::effects::skin::SkinEffect;

pub fn plane() -> MeshBvh {
    MeshBvh::new(square(0.1, 2))
}

/// Effects without any non-ideal reading.
pub fn quiet() -> Effects {
    Effects {
        skin: Some(SkinEffect::default()),
        fluid: Some(FluidEffect { noise_counts: 0.0, quantise: false, ..Default::default() }),
        electrodes: Some(ElectrodesEffect {
            noise: 0.0,
            drift_counts: 0.0,
            quantise: false,
            ..Default::default()
        }),
        ..Effects::default()
    }
}
