//! A finger with ideal readings, and a plane for it.

use super::shapes::square;
use palpate::geometry::bvh::MeshBvh;
use palpate::sim::finger::effects::electrodes::ElectrodesEffect;
use palpate::sim::finger::effects::fluid::FluidEffect;
use palpate::sim::finger::effects::skin::SkinEffect;
use palpate::sim::finger::{ContactLoad, Effects};

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

/// Whether every number of a load is finite.
pub fn is_finite(load: &ContactLoad) -> bool {
    let vectors = [&load.force_n, &load.torque_nm, &load.normal_t, &load.centre_t.coords];
    vectors.iter().all(|vector| vector.iter().all(|number| number.is_finite()))
        && load.energy_j.is_finite()
        && load.pressure_pa.is_finite()
}
