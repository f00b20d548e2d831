//! Whole touches of a wall, and what every touch is held to.

use super::case::{Case, Outcome, all, hold};
use super::solids::{mesh, wall};
use crate::bodies::backend::{Backend, Fault};
use crate::conduct::probe::servo::Servo;
use crate::conduct::probe::{self, Contact, Probe, Touch};
use crate::ground::geometry::bvh::MeshBvh;
use crate::ground::geometry::mesh::Mesh;
use crate::ground::geometry::report::MeshReport;
use crate::things::finger::{Effects, Finger};
use crate::trials::fidelity::felt::{Felt, felt, quiet};
use crate::trials::fidelity::trace::{Tick, Trace};
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
        holds: 2,
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
        holds: 1,
        known: "",
        timed: true,
        law: |times, period_s| on_wall(skin(period_s, times)),
    },
    Case {
        name: "soft skin",
        why: "pressure rises too late to tell of contact",
        severity: "times softer",
        severities: &[1.0, 3.0, 10.0, 100.0, 1000.0],
        holds: 2,
        known: "",
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
            scene.effects.timing =
                Some(crate::things::finger::timing::TimingEffect { batch_frames });
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
        touch: TouchSettings { period_s, ..TouchSettings::default() },
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

/// One touch and what came of it.
pub(super) struct Deed {
    /// What it returned.
    pub touch: Result<Touch, Fault>,
    world: Option<Arc<World>>,
    felt: Option<Felt>,
    ticks: Vec<Tick>,
    refused: Option<String>,
}

/// Touches `target` of `mesh`, with sensors without noise but for what the scene raises.
pub(super) fn deed(scene: Scene, mesh: Mesh, target: &[f64]) -> Deed {
    deed_with(scene, mesh, target, |body| body)
}

/// As [`deed`], with the body put into another.
pub(super) fn deed_with(
    scene: Scene,
    mesh: Mesh,
    target: &[f64],
    wrap: impl FnOnce(Box<dyn Backend>) -> Box<dyn Backend>,
) -> Deed {
    if let Some(limit_m_s) = scene.approach_limit_m_s()
        && scene.touch.approach_m_s > limit_m_s
    {
        return Deed::not_done(&format!("refused: approach faster than {limit_m_s:.4} m/s"));
    }
    let shape = Shape::Mesh { bvh: MeshBvh::new(mesh), report: Box::new(MeshReport::default()) };
    let world = match World::around(scene, shape) {
        Ok(world) => Arc::new(world),
        Err(error) => return Deed::not_done(&error.to_string()),
    };
    let fault = Fault::Refused { values: Vec::new() };
    let (Ok(Some(body)), Some(chain)) = (probe::body(&world), world.chain()) else {
        return Deed { touch: Err(fault), ..Deed::not_done("no body") };
    };
    let (trace, ticks) = Trace::new(body, chain);
    let touch = Servo::new(Arc::clone(&world), wrap(Box::new(trace)), 1)
        .and_then(|mut servo| servo.touch(target));
    let ticks = ticks.take();
    // The object is not in a file, so its world cannot be built again without noise; force and
    // pose need no sensor.
    let felt = felt(&world, &ticks);
    Deed { touch, world: Some(world), felt, ticks, refused: None }
}

impl Deed {
    fn not_done(why: &str) -> Self {
        Self {
            touch: Err(Fault::Refused { values: Vec::new() }),
            world: None,
            felt: None,
            ticks: Vec::new(),
            refused: Some(why.into()),
        }
    }

    /// The contact, if there was one.
    pub(super) fn contact(&self) -> Option<&Contact> {
        match &self.touch {
            Ok(Touch::Contact(contact)) => Some(contact),
            _ => None,
        }
    }

    /// A contact within `tolerance_m` of the mesh.
    pub(super) fn on_surface(&self, tolerance_m: f64) -> Outcome {
        match &self.touch {
            Ok(Touch::Miss) => Outcome::Wrong("met nothing".into()),
            Ok(Touch::Overload) => Outcome::Faulted("broken off: too much pressure".into()),
            _ => self.on_surface_or_missed(tolerance_m),
        }
    }

    /// The same, or no contact; in either case a movement within the laws.
    pub(super) fn on_surface_or_missed(&self, tolerance_m: f64) -> Outcome {
        if let Some(why) = &self.refused {
            return Outcome::Faulted(why.clone());
        }
        let near = match (&self.touch, self.off_surface_m()) {
            (Err(fault), _) => return Outcome::Faulted(fault.to_string()),
            (Ok(Touch::Contact(contact)), Some(off_m)) => all([
                hold((contact.normal_w.norm() - 1.0).abs() < 1e-6, || "normal not unit".into()),
                hold(off_m <= tolerance_m, || format!("{:.3} mm off the surface", 1e3 * off_m)),
            ]),
            _ => Outcome::Stable,
        };
        all([near, self.keeps_speed(), self.keeps_apart()])
    }

    fn off_surface_m(&self) -> Option<f64> {
        let Shape::Mesh { bvh, .. } = self.world.as_ref()?.shape() else { return None };
        Some(bvh.closest_point(&self.contact()?.p_wc).distance_m)
    }

    /// The tip is never faster than any speed that was asked for, nor anything else than finite.
    fn keeps_speed(&self) -> Outcome {
        let Some(world) = &self.world else { return Outcome::Stable };
        let touch = &world.scene().touch;
        // Corrections of the path come on top of travel.
        let limit_m_s = touch.travel_m_s.max(touch.approach_m_s) + CORRECTION_M_S;
        let fastest = self.ticks.iter().map(|tick| tick.motion.linear_w.norm()).fold(0.0, f64::max);
        hold(fastest <= limit_m_s, || format!("{fastest:.3} m/s, allowed {limit_m_s:.3}"))
    }

    /// The tip's centre keeps away from the object by what the core measures.
    fn keeps_apart(&self) -> Outcome {
        let Some((world, felt)) = self.world.as_ref().zip(self.felt.as_ref()) else {
            return Outcome::Stable;
        };
        let Shape::Mesh { bvh, .. } = world.shape() else { return Outcome::Stable };
        let centre = felt.motion.x_wt.translation.vector.into();
        let apart_m = bvh.closest_point(&centre).distance_m;
        let least_m = CORE_SHARE * world.scene().finger.radius_m;
        hold(apart_m >= least_m, || format!("the tip is {:.2} mm from the object", 1e3 * apart_m))
    }

    /// Whether `other`, moved by `by_m` along x and y, met the same within `tolerance_m` and a
    /// thousandth of the force.
    pub(super) fn agrees(&self, other: &Self, by_m: f64, tolerance_m: f64) -> Outcome {
        let (Some(a), Some(b)) = (self.contact(), other.contact()) else { return Outcome::Stable };
        let shift_m = (b.p_wc - a.p_wc - nalgebra::Vector3::new(by_m, by_m, 0.0)).norm();
        let [force, other_n] = [self, other].map(|d| d.felt.as_ref().map_or(0.0, |f| f.force_n));
        all([
            hold(shift_m <= tolerance_m, || format!("contact moved by {:.4} mm", 1e3 * shift_m)),
            hold((force - other_n).abs() <= 1e-3 * force, || format!("{other_n} N, not {force} N")),
        ])
    }
}

/// Largest correction of the controller, and a margin for rounding.
const CORRECTION_M_S: f64 = 0.25 + 1e-6;

/// Of the hull's radius: half of it, inside the core (chosen).
const CORE_SHARE: f64 = 0.5;

/// The same target again and again gives the same contact.
fn many(count: f64, period_s: f64) -> Outcome {
    let mut scene = quiet(&scene(period_s));
    scene.effects.skin.get_or_insert_default().samples = 125;
    let Some(mesh) = mesh(wall(0.05), [0.0; 3]) else { return Outcome::Wrong("no mesh".into()) };
    let shape = Shape::Mesh { bvh: MeshBvh::new(mesh), report: Box::default() };
    let Ok(world) = World::around(scene, shape).map(Arc::new) else {
        return Outcome::Wrong("no world".into());
    };
    let mut probe = match probe::open(&world, 1) {
        Ok(probe) => probe,
        Err(fault) => return Outcome::Faulted(fault.to_string()),
    };
    let mut first: Option<Contact> = None;
    for i in 0..count as u32 {
        match probe.touch(&[0.0, 0.0]) {
            Ok(Touch::Contact(contact)) => {
                let moved_m = (contact.p_wc - first.get_or_insert(contact.clone()).p_wc).norm();
                if moved_m > 5e-5 {
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
