//! Outcomes of touches of a zone, so that no probe has to make them.

use nalgebra::Point3;
use palpate::explore::evidence::{Contact, End, Evidence, FreeVolume, Outcome};
use palpate::robot::Finger;
use palpate::task::Zone;

/// Returns the volume that `finger` has swept along the axis of `zone` up to `p_wt`.
pub fn free_volume(zone: &Zone, finger: &Finger, p_wt: Point3<f64>, end: End) -> FreeVolume {
    let length_m = 0.1;
    FreeVolume {
        finger: finger.clone(),
        p_wt,
        r_wt: zone.x_wz().rotation * finger.r_at(),
        ahead_w: zone.ahead_w(),
        way_m: length_m,
        approach_m: length_m,
        end,
    }
}

/// Returns the outcome of a touch that ended with the fingertip at `p_wt`: a miss if there is no
/// contact.
pub fn outcome(
    zone: &Zone,
    finger: &Finger,
    p_wt: Point3<f64>,
    contact: Option<Contact>,
) -> Outcome {
    let end = if contact.is_some() { End::Contact } else { End::Miss };
    let free = Evidence::Free(free_volume(zone, finger, p_wt, end));
    let points = contact.map(|contact| Evidence::Points(contact.into()));
    Outcome::new(end, points.into_iter().chain([free]).collect())
}
