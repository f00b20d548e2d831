//! The space that a touch has found free: what the finger's hull swept on its way.

use crate::robot::Finger;
use crate::task::Zone;
use nalgebra::Point3;

/// Where an approach along the zone's axis ended; the hull came there straight, so no surface is
/// above its front.
#[derive(Clone, Debug, PartialEq)]
pub struct Swept {
    /// The hull.
    pub finger: Finger,
    /// The centre of the fingertip's hemisphere in `W`: at rest on the surface, or for a miss where
    /// the finger turned back.
    pub p_wt: Point3<f64>,
}

impl Swept {
    /// The greatest height above the datum that the surface can have at each of `places` of `zone`;
    /// none where the hull did not pass.
    pub fn ceilings_m<'a>(
        &'a self,
        zone: &'a Zone,
        places: impl Iterator<Item = &'a [f64]> + 'a,
    ) -> impl Iterator<Item = Option<f64>> + 'a {
        let p_zt = zone.x_wz().inverse_transform_point(&self.p_wt);
        let front = self.finger.front();
        places.map(move |place| {
            let p_z = zone.local(place, 0.0);
            let front_m = front.y_m(p_z.x - p_zt.x, p_z.z - p_zt.z)?;
            Some(p_zt.y + front_m - zone.datum_y_m())
        })
    }
}
