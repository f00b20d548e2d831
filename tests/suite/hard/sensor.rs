//! Hard cases of a sensor or joint that fails in the middle of a touch.

use super::case::{Case, Outcome, case};
use super::checked_touch::touch_solid_with;
use super::solids::{mesh, wall};
use super::wall::scene;
use crate::common::fault_injector::{Failure, FaultInjector};

/// Ticks after which a sensor fails: at rest, during travel, near contact, after the touch.
const FROM: (&[f64], usize) = (&[1e6, 120.0, 60.0, 20.0, 3.0, 0.0], 1);

pub const CASES: &[Case] = &[
    case("pressure is NaN", "NaN compares as no contact", "from tick", FROM, |from, p| {
        broken(Failure::NanPressure, from, p)
    }),
    case("joint is NaN", "NaN goes into every command", "from tick", FROM, |from, p| {
        broken(Failure::NanJoint, from, p)
    }),
    case("frozen sensor", "it never reports contact", "from tick", FROM, |from, p| {
        broken(Failure::Frozen, from, p)
    }),
    case("saturated sensor", "it always reports contact", "from tick", FROM, |from, p| {
        broken(Failure::Saturated, from, p)
    })
    .known("a sensor that saturates at once looks like contact: only another sensor can tell"),
    case(
        "lost frames",
        "contact is reported late or never",
        "share",
        (&[0.0, 0.1, 0.3, 0.6, 0.9, 1.0], 3),
        |share, p| broken(Failure::Lost(share), 0.0, p),
    ),
    case(
        "delayed frames",
        "the finger moves on during the delay",
        "ticks",
        (&[0.0, 2.0, 5.0, 10.0, 20.0], 3),
        |ticks, p| broken(Failure::Late(ticks as usize), 0.0, p),
    )
    .known("frames later than touch.settle_s are of the way in: rest for longer"),
    case(
        "spikes of pressure",
        "single values that look like contact or too much of it",
        "share",
        (&[0.0, 0.01, 0.1, 0.5, 1.0], 1),
        |share, p| broken(Failure::Spikes(share), 0.0, p),
    ),
    case(
        "weak joints",
        "joints do not reach commanded velocities",
        "share followed",
        (&[1.0, 0.9, 0.5, 0.1, 0.0], 2),
        |share, p| broken(Failure::Weak(share), 0.0, p),
    ),
];

/// Requires a contact on the surface or a fault; a contact elsewhere is wrong.
fn broken(failure: Failure, from_tick: f64, period_s: f64) -> Outcome {
    let Some(mesh) = mesh(wall(0.05), [0.0; 3]) else { return Outcome::Wrong("no mesh".into()) };
    let wrap = |body| Box::new(FaultInjector::new(body, failure, from_tick as u64)) as Box<_>;
    // Includes electrodes, so that only the sensor detects the contact; their centroid has the
    // accuracy of a real BioTac, 3 mm.
    let mut scene = scene(period_s);
    scene.effects.electrodes = Some(Default::default());
    touch_solid_with(scene, mesh, &[0.02, 0.01], wrap).on_surface(3e-3)
}
