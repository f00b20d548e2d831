//! Hard cases of complete touches of a wall.

use super::case::{Case, Outcome, case, require};
use super::checked_touch::{CheckedTouch, environment_of, touch_solid};
use super::finger_on_wall::stiffen;
use super::solids::{mesh, wall};
use palpate::explore::evidence::{Contact, End};
use palpate::robot::finger::Finger;
use palpate::sim::Scene;
use palpate::sim::finger::Effects;
use palpate::sim::finger::effects::timing::TimingEffect;
use palpate::sim::scene::SimulatorKind;
use palpate::sim::simulator::Simulator;
use palpate::study::accuracy::touches::noise_free;
use palpate::task::Zone;
use palpate::task::touch::TouchSettings;
use std::sync::Arc;

pub const CASES: &[Case] = &[
    case(
        "fast approach to a wall",
        "the finger moves on during the frames that confirm contact",
        "m/s",
        (&[0.005, 0.02, 0.04, 0.06, 0.1, 0.2, 0.5, 1.0], 3),
        |approach_m_s, period_s| {
            let mut scene = scene(period_s);
            scene.touch.approach_m_s = approach_m_s;
            on_wall(scene)
        },
    )
    .timed(),
    case(
        "stiff skin",
        "force per tick of approach grows with the stiffness",
        "times stiffer",
        (&[1.0, 3.0, 10.0, 100.0, 1000.0], 4),
        |times, period_s| on_wall(skin(period_s, times)),
    )
    .timed(),
    case(
        "soft skin",
        "pressure rises too late for detection",
        "times softer",
        (&[1.0, 3.0, 10.0, 100.0, 1000.0], 3),
        |times, period_s| on_wall(skin(period_s, 1.0 / times)),
    )
    .known("its pressure stays below the threshold: lower touch.detection.threshold_counts")
    .timed(),
    case(
        "late frames",
        "frames come in batches long after the contact",
        "frames a batch",
        (&[1.0, 5.0, 10.0, 30.0, 100.0], 2),
        |batch, period_s| {
            let mut scene = scene(period_s);
            let batch_frames = batch as usize;
            scene.effects.timing = Some(TimingEffect { batch_frames, ..TimingEffect::default() });
            on_wall(scene)
        },
    )
    .timed(),
    case(
        "patient detection",
        "every frame that must agree is a frame of approach",
        "frames",
        (&[1.0, 3.0, 6.0, 20.0, 100.0], 3),
        |frames, period_s| {
            let mut scene = scene(period_s);
            scene.touch.detection.frames = frames as u32;
            on_wall(scene)
        },
    )
    .timed(),
    case(
        "noisy pressure",
        "noise triggers detection without contact",
        "times the noise",
        (&[1.0, 3.0, 10.0, 30.0, 100.0], 2),
        |times, period_s| {
            let mut scene = scene(period_s);
            scene.effects.fluid.get_or_insert_default().noise_counts *= times;
            on_wall(scene)
        },
    )
    .known("noise above a third of the threshold passes for contact: raise touch.detection"),
    case(
        "many touches",
        "errors of the servo that add up from touch to touch",
        "touches",
        (&[10.0, 100.0, 1000.0], 3),
        many,
    ),
    case(
        "refined time step",
        "a touch that changes with the period is not resolved",
        "times coarser",
        (&[1.0, 2.0, 4.0, 8.0], 4),
        refined,
    ),
    case(
        "too much force",
        "the limit is passed within one tick",
        "limit counts",
        (&[1500.0, 100.0, 10.0, 1.0], 4),
        |limit, period_s| {
            let mut scene = scene(period_s);
            scene.touch.pressure_limit_counts = limit;
            touch_wall(scene).on_surface_or_missed(1e-3)
        },
    )
    .timed(),
    case(
        "target off the object",
        "there is no surface",
        "beside it mm",
        (&[7.5, 20.0, 100.0], 3),
        |mm, period_s| {
            let mut scene = scene(period_s);
            scene.zone = Some(Zone::new([-0.2, 0.2], scene.zone.and_then(|zone| zone.z_m)));
            let Some(mesh) = mesh(wall(0.03), [0.0; 3]) else {
                return Outcome::Wrong("no mesh".into());
            };
            let touched = touch_solid(scene, mesh, &[0.03 + 1e-3 * mm, 0.0]);
            require(touched.end() == Ok(End::Miss), || format!("{:?}", touched.touch))
        },
    ),
];

/// A kinematic stage with a soft finger and exact contact points, before an object near the origin.
pub fn scene(period_s: f64) -> Scene {
    let mut effects = Effects { skin: Some(Default::default()), ..Effects::default() };
    effects.fluid = Some(Default::default());
    Scene {
        simulator: SimulatorKind::Kinematic,
        function: None,
        whole_object: None,
        zone: Some(Zone::new([-0.05, 0.05], Some([-0.05, 0.05]))),
        object: None,
        finger: Finger::default(),
        sensor: Default::default(),
        arm: None,
        camera: None,
        library: None,
        pose: None,
        effects,
        touch: TouchSettings { period_s: Some(period_s), ..TouchSettings::default() },
        solver: Default::default(),
    }
}

fn skin(period_s: f64, times: f64) -> Scene {
    let mut scene = scene(period_s);
    stiffen(&mut scene.effects, times);
    scene
}

pub fn touch_wall(scene: Scene) -> CheckedTouch {
    match mesh(wall(0.05), [0.0; 3]) {
        Some(mesh) => touch_solid(scene, mesh, &[0.0, 0.0]),
        None => CheckedTouch::not_done("no mesh"),
    }
}

pub fn on_wall(scene: Scene) -> Outcome {
    touch_wall(scene).on_surface(1e-3)
}

/// Repeated touches of a target give the same contact to within one tactile frame of approach: sums
/// of ticks are rounded, so a frame may fall on the previous or next tick.
fn many(count: f64, period_s: f64) -> Outcome {
    let mut scene = noise_free(&scene(period_s));
    scene.effects.skin.get_or_insert_default().samples = 125;
    let Some(mesh) = mesh(wall(0.05), [0.0; 3]) else { return Outcome::Wrong("no mesh".into()) };
    let Ok(environment) = environment_of(scene, mesh) else {
        return Outcome::Wrong("no environment".into());
    };
    let simulator = match Simulator::new(Arc::clone(&environment)) {
        Ok(simulator) => simulator,
        Err(error) => return Outcome::Faulted(error.to_string()),
    };
    let mut probe = match simulator.probe(1) {
        Ok(probe) => probe,
        Err(fault) => return Outcome::Faulted(fault.to_string()),
    };
    let mut first: Option<Contact> = None;
    let Some(approach) = environment.task().approach(&vec![0.0, 0.0].into()) else {
        return Outcome::Wrong("no approach".into());
    };
    for i in 0..count as u32 {
        let outcome = match probe.touch(&approach) {
            Ok(outcome) => outcome,
            Err(fault) => return Outcome::Faulted(fault.to_string()),
        };
        let Some(contact) = outcome.contact() else {
            return Outcome::Wrong(format!("{:?} at touch {i}", outcome.end));
        };
        let moved_m = (contact.p_wc - first.get_or_insert(contact.clone()).p_wc).norm();
        if moved_m > 3e-4 {
            return Outcome::Wrong(format!("moved by {moved_m} m at touch {i}"));
        }
    }
    Outcome::Stable
}

/// Requires the contact to within the finger's travel in one tick and one tactile frame of the
/// touch at 0.25 ms.
fn refined(times: f64, _: f64) -> Outcome {
    let [fine, coarse] =
        [0.00025, 0.0025 * times].map(|period_s| touch_wall(noise_free(&scene(period_s))));
    let depth =
        |touched: &CheckedTouch| touched.load.as_ref().map(|load| load.motion.x_wt.translation.y);
    let (Some(a), Some(b)) = (depth(&fine), depth(&coarse)) else {
        return Outcome::Wrong("no contact".into());
    };
    let travel_m = 0.02 * (0.0025 * times + 0.01);
    require((a - b).abs() <= 1.5 * travel_m, || format!("{:.3} mm apart", 1e3 * (a - b).abs()))
}
