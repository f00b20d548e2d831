//! What MuJoCo's own contacts say, where the finger has no skin.

use mujoco_rs::wrappers::mj_data::MjData;
use mujoco_rs::wrappers::mj_model::MjModel;
use nalgebra::{Isometry3, Point3, Vector3};
use palpate_explore::backend::IdealContact;
use std::sync::Arc;

/// The contacts as one, in `T`: centre weighted by force, sum of the forces and its direction; none
/// without force. Those of links with whatever else are left out.
///
/// To be asked while `data` holds the forces of the last step; `finger` is the finger's body.
pub(super) fn contact(
    data: &MjData<Arc<MjModel>>,
    finger: usize,
    x_wt: &Isometry3<f64>,
) -> Option<IdealContact> {
    let (mut moment, mut weight_n, mut sum_n) = (Vector3::zeros(), 0.0, Vector3::zeros());
    for (i, contact) in data.contact().iter().enumerate() {
        let force_n = data.try_contact_force(i).map_or(0.0, |[normal, ..]| normal);
        // From the first geom to the second, which come in the order of their kinds.
        let [x, y, z, ..] = contact.frame;
        let of = |geom: i32| data.model().geom_bodyid().get(geom as usize);
        let outward = match contact.geom.map(|geom| of(geom) == Some(&(finger as i32))) {
            [_, true] => 1.0,
            [true, false] => -1.0,
            [false, false] => continue,
        };
        moment += Vector3::from(contact.pos) * force_n;
        weight_n += force_n;
        sum_n += outward * force_n * Vector3::new(x, y, z);
    }
    let force_n = sum_n.norm();
    (weight_n > 0.0 && force_n > 0.0).then(|| IdealContact {
        p_tc: x_wt.inverse_transform_point(&Point3::from(moment / weight_n)),
        normal_t: x_wt.inverse_transform_vector(&(sum_n / force_n)),
        force_n,
    })
}
