//! What MuJoCo's own contacts say, where the finger has no skin.

use crate::bodies::backend::IdealContact;
use mujoco_rs::wrappers::mj_data::MjData;
use mujoco_rs::wrappers::mj_model::MjModel;
use nalgebra::{Isometry3, Point3, Vector3};
use std::sync::Arc;

/// The contacts as one, in `T`: centre weighted by force, sum of the forces and its direction; none
/// without force. All of them are the object's on the finger: nothing else collides.
///
/// To be asked while `data` holds the forces of the last step.
pub(super) fn contact(data: &MjData<Arc<MjModel>>, x_wt: &Isometry3<f64>) -> Option<IdealContact> {
    let (mut moment, mut weight_n, mut sum_n) = (Vector3::zeros(), 0.0, Vector3::zeros());
    for (i, contact) in data.contact().iter().enumerate() {
        let force_n = data.try_contact_force(i).map_or(0.0, |[normal, ..]| normal);
        let [x, y, z, ..] = contact.frame;
        moment += Vector3::from(contact.pos) * force_n;
        weight_n += force_n;
        sum_n += Vector3::new(x, y, z) * force_n;
    }
    let force_n = sum_n.norm();
    (weight_n > 0.0 && force_n > 0.0).then(|| IdealContact {
        p_tc: x_wt.inverse_transform_point(&Point3::from(moment / weight_n)),
        normal_t: x_wt.inverse_transform_vector(&(sum_n / force_n)),
        force_n,
    })
}
