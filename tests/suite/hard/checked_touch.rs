//! A touch of a solid, and the laws that every touch must obey.

use super::case::{Outcome, all, require};
use palpate::backend::trace::{Tick, TracedBackend};
use palpate::backend::{Backend, Fault};
use palpate::error::InputError;
use palpate::explore::evidence::{self, Contact, End};
use palpate::explore::probe::Probe;
use palpate::geometry::bvh::MeshBvh;
use palpate::geometry::mesh::Mesh;
use palpate::sim::environment::ObjectShape;
use palpate::sim::simulator::Simulator;
use palpate::sim::{Environment, Scene};
use palpate::study::accuracy::touches::{ReferenceLoad, reference_load};
use std::sync::Arc;

/// A touch and its data.
pub struct CheckedTouch {
    /// Result of the touch.
    pub touch: Result<evidence::Outcome, Fault>,
    environment: Option<Arc<Environment>>,
    /// Load on the finger when the contact was read.
    pub load: Option<ReferenceLoad>,
    ticks: Vec<Tick>,
    refused: Option<String>,
}

/// Touches `target` of `mesh`, with noise-free sensors except for noise set in the scene.
pub fn touch_solid(scene: Scene, mesh: Mesh, target: &[f64]) -> CheckedTouch {
    touch_solid_with(scene, mesh, target, |body| body)
}

/// Touches as in [`touch_solid`], with the body wrapped.
pub fn touch_solid_with(
    scene: Scene,
    mesh: Mesh,
    target: &[f64],
    wrap: impl FnOnce(Box<dyn Backend>) -> Box<dyn Backend>,
) -> CheckedTouch {
    if let Some(limit_m_s) = scene.approach_limit_m_s()
        && scene.touch.approach_m_s > limit_m_s
    {
        return CheckedTouch::not_done(&format!(
            "refused: approach faster than {limit_m_s:.4} m/s"
        ));
    }
    let environment = match environment_of(scene, mesh) {
        Ok(environment) => environment,
        Err(error) => return CheckedTouch::not_done(&error.to_string()),
    };
    let simulator = match Simulator::new(Arc::clone(&environment)) {
        Ok(simulator) => simulator,
        Err(error) => return CheckedTouch::not_done(&error.to_string()),
    };
    let (Ok(Some(body)), Some(chain)) = (simulator.body(), environment.chain()) else {
        return CheckedTouch::not_done("no body");
    };
    let (trace, ticks) = TracedBackend::new(body, chain);
    let Some(approach) = environment.task().approach(&target.to_vec().into()) else {
        return CheckedTouch::not_done("no approach");
    };
    let touch =
        (simulator.servo(wrap(Box::new(trace)), 1)).and_then(|mut servo| servo.touch(&approach));
    let ticks = ticks.take();
    // The object is not in a file, so its environment cannot be rebuilt without noise; force and
    // pose need no sensor.
    let load = reference_load(&simulator, &ticks);
    CheckedTouch { touch, environment: Some(environment), load, ticks, refused: None }
}

/// Builds the environment of `scene` with `mesh` as its object.
pub fn environment_of(scene: Scene, mesh: Mesh) -> Result<Arc<Environment>, InputError> {
    let shape = ObjectShape::Mesh { bvh: MeshBvh::new(mesh), report: Box::default() };
    Environment::with_shape(scene, shape).map(Arc::new)
}

impl CheckedTouch {
    /// A touch that was not started, with the reason.
    pub fn not_done(why: &str) -> Self {
        Self {
            touch: Err(Fault::Refused { values: Vec::new() }),
            environment: None,
            load: None,
            ticks: Vec::new(),
            refused: Some(why.into()),
        }
    }

    /// Returns the contact, if there was one.
    pub fn contact(&self) -> Option<&Contact> {
        self.touch.as_ref().ok()?.contact()
    }

    /// Returns the end of the touch.
    pub fn end(&self) -> Result<End, &Fault> {
        self.touch.as_ref().map(|outcome| outcome.end)
    }

    /// Requires a contact within `tolerance_m` of the mesh.
    pub fn on_surface(&self, tolerance_m: f64) -> Outcome {
        match self.end() {
            Ok(End::Miss) => Outcome::Wrong("met nothing".into()),
            Ok(End::Overload) => Outcome::Faulted("broken off: too much pressure".into()),
            _ => self.on_surface_or_missed(tolerance_m),
        }
    }

    /// Requires such a contact or none, and a movement within the limits in either case.
    pub fn on_surface_or_missed(&self, tolerance_m: f64) -> Outcome {
        if let Some(why) = &self.refused {
            return Outcome::Faulted(why.clone());
        }
        let touched = match &self.touch {
            Ok(outcome) => outcome.contact().zip(self.off_surface_m()),
            Err(fault) => return Outcome::Faulted(fault.to_string()),
        };
        let near = match touched {
            Some((contact, off_m)) => all([
                require((contact.normal_w.norm() - 1.0).abs() < 1e-6, || "normal not unit".into()),
                require(off_m <= tolerance_m, || format!("{:.3} mm off the surface", 1e3 * off_m)),
            ]),
            None => Outcome::Stable,
        };
        all([near, self.keeps_speed(), self.keeps_apart()])
    }

    fn off_surface_m(&self) -> Option<f64> {
        let ObjectShape::Mesh { bvh, .. } = self.environment.as_ref()?.shape() else { return None };
        Some(bvh.closest_point(&self.contact()?.p_wc).distance_m)
    }

    /// The tip's speed is finite and at most the commanded speed.
    fn keeps_speed(&self) -> Outcome {
        let Some(environment) = &self.environment else { return Outcome::Stable };
        let touch = &environment.scene().touch;
        // Corrections of the path add to the travel speed.
        let limit_m_s = touch.travel_m_s.max(touch.approach_m_s) + CORRECTION_M_S;
        let fastest = self.ticks.iter().map(|tick| tick.motion.linear_w.norm()).fold(0.0, f64::max);
        require(fastest <= limit_m_s, || format!("{fastest:.3} m/s, allowed {limit_m_s:.3}"))
    }

    /// The tip's centre keeps a distance from the object of at least the core's radius.
    fn keeps_apart(&self) -> Outcome {
        let Some((environment, load)) = self.environment.as_ref().zip(self.load.as_ref()) else {
            return Outcome::Stable;
        };
        let ObjectShape::Mesh { bvh, .. } = environment.shape() else { return Outcome::Stable };
        let centre = load.motion.x_wt.translation.vector.into();
        let apart_m = bvh.closest_point(&centre).distance_m;
        let least_m = CORE_SHARE * environment.scene().finger.radius_m;
        require(apart_m >= least_m, || {
            format!("the tip is {:.2} mm from the object", 1e3 * apart_m)
        })
    }

    /// Requires that `other`, moved by `by_m` along x and y, has the same contact within
    /// `tolerance_m` and the same force within 0.1 %.
    pub fn agrees(&self, other: &Self, by_m: f64, tolerance_m: f64) -> Outcome {
        let (Some(a), Some(b)) = (self.contact(), other.contact()) else { return Outcome::Stable };
        let shift_m = (b.p_wc - a.p_wc - nalgebra::Vector3::new(by_m, by_m, 0.0)).norm();
        let [force, other_n] =
            [self, other].map(|touch| touch.load.as_ref().map_or(0.0, |load| load.force_n));
        all([
            require(shift_m <= tolerance_m, || format!("contact moved by {:.4} mm", 1e3 * shift_m)),
            require((force - other_n).abs() <= 1e-3 * force, || {
                format!("{other_n} N, not {force} N")
            }),
        ])
    }
}

/// Largest correction of the controller, with a margin for rounding.
const CORRECTION_M_S: f64 = 0.25 + 1e-6;

/// Share of the hull's radius that lies inside the core.
// heuristic: half of it.
const CORE_SHARE: f64 = 0.5;
