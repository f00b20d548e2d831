//! A touched box, for tests.

use super::library::LibraryObject;
use super::measurement::{Measurement, NoiseModel, TouchMeasurement};
use super::pose_prior::{PosePrior, Turn};
use crate::evidence::{Contact, End, Evidence, FreeVolume, Outcome};
use crate::robot::Finger;
use crate::task::{Aim, Ball};
use nalgebra::{Point3, Vector3};
use palpate_geometry::mesh::Mesh;
use palpate_geometry::solids::box_mesh;
use std::sync::Arc;

/// Touches of a box whose front and right side are 2 mm and 3 mm off.
pub fn touches() -> Vec<Arc<Measurement>> {
    let ball = Ball { centre_w: Point3::origin(), radius_m: 0.15, lowest_m: None };
    let finger = Finger { pitch_deg: 0.0, ..Finger::default() };
    [([0.01, 0.032, 0.0], Vector3::y()), ([0.053, 0.0, 0.01], Vector3::x())]
        .into_iter()
        .map(|(p_w, normal_w)| {
            let aim = Aim::against(p_w.into(), &normal_w);
            let approach = ball.approach(&aim, &finger, 0.01, 0.0);
            let p_wt = aim.p_w + normal_w * finger.radius_m;
            let contact = Contact::new(aim.p_w, normal_w);
            let free = FreeVolume::new(finger.clone(), &approach, p_wt, End::Contact);
            let evidence = vec![Evidence::Points(contact.into()), Evidence::Free(free)];
            let outcome = Outcome::new(End::Contact, evidence);
            let evidence = TouchMeasurement::new(&outcome, 0.0, None, 0.1);
            Arc::new(Measurement::Touch(evidence.unwrap()))
        })
        .collect()
}

pub fn touched_box() -> LibraryObject {
    let (vertices, triangles) = box_mesh([-0.05, -0.03, -0.04], [0.05, 0.03, 0.04]);
    LibraryObject::new("box", &Mesh::new(&vertices, &triangles).unwrap().0)
}

pub fn prior() -> PosePrior {
    let half_width_m = [0.02, 0.02, 0.0];
    PosePrior { position_m: [0.0, 0.0, -0.04], half_width_m, turn: Turn::None }
}

pub const NOISE: NoiseModel = NoiseModel { contact_sd_m: 1e-3, normal_sd_rad: 0.2, outliers: 1e-3 };
