//! Whole touches of a wall.

use super::case::{Case, Outcome, hold};
use super::deed::{Deed, deed};
use super::solids::{mesh, wall};
use crate::conduct::probe::{self, Contact, Touch};
use crate::ground::geometry::bvh::MeshBvh;
use crate::things::finger::timing::TimingEffect;
use crate::things::finger::{Effects, Finger};
use crate::trials::fidelity::felt::quiet;
use crate::trials::fidelity::measure::stand;
use crate::world::scene::Body;
use crate::world::touch::TouchSettings;
use crate::world::world::Shape;
use crate::world::{Scene, World, Zone};
use std::sync::Arc;

pub(super) const CASES: &[Case] = &[
    Case {
        name: "fast approach to a wall",
        why: "the finger goes on while frames agree that there is contact",
        severity: "m/s",
        severities: &[0.005, 0.02, 0.04, 0.06, 0.1, 0.2, 0.5, 1.0],
        holds: 3,
        known: "",
        timed: true,
        law: |approach_m_s, period_s| {
            let mut scene = scene(period_s);
            scene.touch.approach_m_s = approach_m_s;
            on_wall(scene)
        },
    },
    Case {
        name: "stiff skin",
        why: "force per tick of approach grows with the stiffness",
        severity: "times stiffer",
        severities: &[1.0, 3.0, 10.0, 100.0, 1000.0],
        holds: 4,
        known: "",
        timed: true,
        law: |times, period_s| on_wall(skin(period_s, times)),
    },
    Case {
        name: "soft skin",
        why: "pressure rises too late to tell of contact",
        severity: "times softer",
        severities: &[1.0, 3.0, 10.0, 100.0, 1000.0],
        holds: 3,
        known: "its pressure stays below the threshold: lower touch.detection.threshold_counts",
        timed: true,
        law: |times, period_s| on_wall(skin(period_s, 1.0 / times)),
    },
    Case {
        name: "late frames",
        why: "frames come in batches long after the contact",
        severity: "frames a batch",
        severities: &[1.0, 5.0, 10.0, 30.0, 100.0],
        holds: 2,
        known: "",
        timed: true,
        law: |batch, period_s| {
            let mut scene = scene(period_s);
            let batch_frames = batch as usize;
            scene.effects.timing = Some(TimingEffect { batch_frames, ..TimingEffect::default() });
            on_wall(scene)
        },
    },
    Case {
        name: "patient detection",
        why: "every frame that must agree is a frame of approach",
        severity: "frames",
        severities: &[1.0, 3.0, 6.0, 20.0, 100.0],
        holds: 3,
        known: "",
        timed: true,
        law: |frames, period_s| {
            let mut scene = scene(period_s);
            scene.touch.detection.frames = frames as u32;
            on_wall(scene)
        },
    },
    Case {
        name: "noisy pressure",
        why: "noise passes for contact in the air",
        severity: "times the noise",
        severities: &[1.0, 3.0, 10.0, 30.0, 100.0],
        holds: 2,
        known: "noise above a third of the threshold passes for contact: raise touch.detection",
        timed: false,
        law: |times, period_s| {
            let mut scene = scene(period_s);
            scene.effects.fluid.get_or_insert_default().noise_counts *= times;
            on_wall(scene)
        },
    },
    Case {
        name: "many touches",
        why: "errors of the servo that add up from touch to touch",
        severity: "touches",
        severities: &[10.0, 100.0, 1000.0],
        holds: 3,
        known: "",
        timed: false,
        law: many,
    },
    Case {
        name: "refined time step",
        why: "a touch that changes with the period is not resolved",
        severity: "times coarser",
        severities: &[1.0, 2.0, 4.0, 8.0],
        holds: 4,
        known: "",
        timed: false,
        law: refined,
    },
    Case {
        name: "too much force",
        why: "the limit is passed within one tick",
        severity: "limit counts",
        severities: &[1500.0, 100.0, 10.0, 1.0],
        holds: 4,
        known: "",
        timed: true,
        law: |limit, period_s| {
            let mut scene = scene(period_s);
            scene.touch.pressure_limit_counts = limit;
            wall_deed(scene).on_surface_or_missed(1e-3)
        },
    },
    Case {
        name: "target off the object",
        why: "there is nothing to meet",
        severity: "beside it mm",
        severities: &[7.5, 20.0, 100.0],
        holds: 3,
        known: "",
        timed: false,
        law: |mm, period_s| {
            let mut scene = scene(period_s);
            scene.zone.x_m = [-0.2, 0.2];
            let Some(mesh) = mesh(wall(0.03), [0.0; 3]) else {
                return Outcome::Wrong("no mesh".into());
            };
            let deed = deed(scene, mesh, &[0.03 + 1e-3 * mm, 0.0]);
            hold(deed.touch == Ok(Touch::Miss), || format!("{:?}", deed.touch))
        },
    },
];

/// A kinematic stage with a soft finger whose point of contact is exact, before an object near
/// the origin.
pub(super) fn scene(period_s: f64) -> Scene {
    let mut effects = Effects { skin: Some(Default::default()), ..Effects::default() };
    effects.fluid = Some(Default::default());
    Scene {
        body: Body::Kinematic,
        function: None,
        zone: Zone { x_m: [-0.05, 0.05], z_m: Some([-0.05, 0.05]), datum_y_m: 0.0 },
        object: None,
        finger: Finger::default(),
        arm: None,
        effects,
        touch: TouchSettings { period_s: Some(period_s), ..TouchSettings::default() },
        solver: Default::default(),
    }
}

fn skin(period_s: f64, times: f64) -> Scene {
    let mut scene = scene(period_s);
    let skin = scene.effects.skin.get_or_insert_default();
    skin.modulus_pa *= times;
    skin.flatten_pa_m *= times;
    skin.inflate_pa_m *= times;
    skin.core_pa_m *= times;
    scene
}

fn wall_deed(scene: Scene) -> Deed {
    match mesh(wall(0.05), [0.0; 3]) {
        Some(mesh) => deed(scene, mesh, &[0.0, 0.0]),
        None => Deed::not_done("no mesh"),
    }
}

fn on_wall(scene: Scene) -> Outcome {
    wall_deed(scene).on_surface(1e-3)
}

/// The same target again and again gives the same contact, but for a tactile frame of approach:
/// sums of ticks round, and a frame falls to the tick before or after.
fn many(count: f64, period_s: f64) -> Outcome {
    let mut scene = quiet(&scene(period_s));
    scene.effects.skin.get_or_insert_default().samples = 125;
    let Some(mesh) = mesh(wall(0.05), [0.0; 3]) else { return Outcome::Wrong("no mesh".into()) };
    let shape = Shape::Mesh { bvh: MeshBvh::new(mesh), report: Box::default() };
    let Ok(world) = World::around(scene, shape).map(Arc::new) else {
        return Outcome::Wrong("no world".into());
    };
    let mut probe = match stand(&world).and_then(|stand| probe::open(&stand, 1)) {
        Ok(probe) => probe,
        Err(fault) => return Outcome::Faulted(fault.to_string()),
    };
    let mut first: Option<Contact> = None;
    for i in 0..count as u32 {
        match probe.touch(&[0.0, 0.0]) {
            Ok(Touch::Contact(contact)) => {
                let moved_m = (contact.p_wc - first.get_or_insert(contact.clone()).p_wc).norm();
                if moved_m > 3e-4 {
                    return Outcome::Wrong(format!("moved by {moved_m} m at touch {i}"));
                }
            }
            Ok(other) => return Outcome::Wrong(format!("{other:?} at touch {i}")),
            Err(fault) => return Outcome::Faulted(fault.to_string()),
        }
    }
    Outcome::Stable
}

/// Within what the finger travels in a tick and a tactile frame of the touch at 0.25 ms.
fn refined(times: f64, _: f64) -> Outcome {
    let [fine, coarse] =
        [0.00025, 0.0025 * times].map(|period_s| wall_deed(quiet(&scene(period_s))));
    let depth = |deed: &Deed| deed.felt.as_ref().map(|felt| felt.motion.x_wt.translation.y);
    let (Some(a), Some(b)) = (depth(&fine), depth(&coarse)) else {
        return Outcome::Wrong("no contact".into());
    };
    let travel_m = 0.02 * (0.0025 * times + 0.01);
    hold((a - b).abs() <= 1.5 * travel_m, || format!("{:.3} mm apart", 1e3 * (a - b).abs()))
}
