//! A finger in front of a wall, placed in given poses without servo or body.

use super::case::Outcome;
use super::solids::{mesh, wall};
use nalgebra::{Isometry3, Vector3};
use palpate::backend::Fault;
use palpate::geometry::bvh::MeshBvh;
use palpate::geometry::mesh::Mesh;
use palpate::math::seed;
use palpate::robot::finger::Finger;
use palpate::robot::finger::TipMotion;
use palpate::robot::finger::profile::Profile;
use palpate::sim::finger::samples::spread;
use palpate::sim::finger::{ContactLoad, Effects, Fingertip, FingertipState};

/// A finger over a wall, its tip pointing at it as in a touch.
pub struct FingerOnWall {
    tip: Fingertip,
    wall: MeshBvh,
    /// Hull of the finger.
    pub finger: Finger,
    /// Distance of the tip's centre from the wall at first contact of the skin.
    touching_m: f64,
}

impl FingerOnWall {
    /// Creates the finger with these effects, `size` times as large as a BioTac.
    pub fn new(effects: &Effects, size: f64) -> Option<Self> {
        Self::before(mesh(wall(0.05 * size), [0.0; 3])?, effects, size)
    }

    /// Creates the finger before another object, whose foremost point is the origin.
    pub fn before(object: Mesh, effects: &Effects, size: f64) -> Option<Self> {
        let standard = Finger::default();
        let finger = Finger {
            radius_m: size * standard.radius_m,
            length_m: size * standard.length_m,
            ..standard
        };
        let wall = MeshBvh::new(object);
        let mut setup =
            Self { tip: Fingertip::new(&finger, effects), wall, finger, touching_m: 0.0 };
        let rotation = setup.finger.r_at();
        // With more points than any case, so that depth has the same meaning for all.
        let fine = spread(&Profile::biotac(&setup.finger), 16_000);
        let lowest = fine.iter().map(|sample| (rotation * sample.point()).y);
        setup.touching_m = -lowest.fold(0.0, f64::min);
        Some(setup)
    }

    /// Pose `depth_m` inside the wall, `x_m` beside its middle.
    pub fn at(&self, depth_m: f64, x_m: f64) -> TipMotion {
        let p_wt = Vector3::new(x_m, self.touching_m - depth_m, 0.0);
        TipMotion::at(Isometry3::from_parts(p_wt.into(), self.finger.r_at()))
    }

    /// State of a finger without contact.
    pub fn untouched(&self) -> FingertipState {
        FingertipState::new(&self.tip, &seed::stream(0, 0, "finger"))
    }

    /// Applies the wall to the finger.
    pub fn press(
        &self,
        state: &mut FingertipState,
        motion: &TipMotion,
        dt_s: f64,
    ) -> Result<ContactLoad, Fault> {
        state.step(&self.tip, &self.wall, motion, dt_s)
    }

    /// Force at a depth.
    pub fn force_n(&self, depth_m: f64) -> Result<f64, Fault> {
        Ok(self.press(&mut self.untouched(), &self.at(depth_m, 0.0), 0.01)?.force_n.norm())
    }
}

/// Runs `law`; a fault is the outcome.
pub fn with_finger(
    effects: &Effects,
    law: impl FnOnce(&FingerOnWall) -> Result<Outcome, Fault>,
) -> Outcome {
    with_finger_of_size(effects, 1.0, law)
}

/// Runs `law` with a finger of another size.
pub fn with_finger_of_size(
    effects: &Effects,
    size: f64,
    law: impl FnOnce(&FingerOnWall) -> Result<Outcome, Fault>,
) -> Outcome {
    match FingerOnWall::new(effects, size) {
        Some(setup) => law(&setup).unwrap_or_else(|fault| Outcome::Faulted(fault.to_string())),
        None => Outcome::Wrong("no wall".into()),
    }
}

/// Multiplies all stiffnesses of the skin.
pub fn stiffen(effects: &mut Effects, times: f64) {
    if let Some(skin) = &mut effects.skin {
        let resists = [
            &mut skin.modulus_pa,
            &mut skin.flatten_pa_m,
            &mut skin.inflate_pa_m,
            &mut skin.core_pa_m,
        ];
        resists.into_iter().for_each(|constant| *constant *= times);
    }
}
