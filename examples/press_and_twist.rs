//! New action: the finger presses, holds and twists about its approach; the moment at which it
//! slips tells the friction of the surface there.
//!
//! `cargo run --release --example press_and_twist`

use palpate::backend::Fault;
use palpate::explore::belief::{Belief, HeightField};
use palpate::explore::episode::Episode;
use palpate::explore::evidence::Outcome;
use palpate::explore::gp_settings::GpSettings;
use palpate::explore::probe::Probe;
use palpate::sim::probe::exact_probe;
use palpate::sim::{Environment, Scene};
use palpate::task::{Action, Target};
use std::sync::Arc;

/// Name of the action.
pub const ACTION: &str = "press_and_twist";

/// Name of the measured friction coefficient.
pub const FRICTION: &str = "friction";

/// Radius of the patch of contact, m, and force of the press, N.
// heuristic: a soft fingertip at a firm press.
const PATCH_M: f64 = 3e-3;
const PRESS_N: f64 = 2.0;

/// Probe that can also twist; `probe` makes the touch.
struct TwistingProbe<P, F> {
    probe: P,
    /// Friction coefficient of the surface at a height z in `W`, m.
    friction: F,
}

impl<P: Probe, F: Fn(f64) -> f64 + Send> Probe for TwistingProbe<P, F> {
    fn execute(&mut self, action: &Action) -> Result<Outcome, Fault> {
        let Action::Custom { name, approach, .. } = action else {
            return self.probe.execute(action);
        };
        if name != ACTION {
            return self.probe.execute(action);
        }
        let mut outcome = self.probe.touch(approach)?;
        if let Some(contact) = outcome.contact() {
            // Moment of a uniformly loaded patch that slips (Howe & Cutkosky 1996): 2/3 μ F a.
            let slip_n_m = 2.0 / 3.0 * (self.friction)(contact.p_wc.z) * PRESS_N * PATCH_M;
            let friction = slip_n_m / (2.0 / 3.0 * PRESS_N * PATCH_M);
            outcome.measured.insert(FRICTION.into(), friction);
        }
        Ok(outcome)
    }
}

/// An executed target, with the friction that its twist has measured.
pub struct Twisted {
    /// Target.
    pub target: Target,
    /// Friction coefficient; `None` for a tap.
    pub friction: Option<f64>,
}

/// Taps and twists the container in turn at `places`; returns what was found, and the belief.
pub fn explore(
    places: &[[f64; 2]],
    friction: impl Fn(f64) -> f64 + Send,
) -> Result<(Vec<Twisted>, Belief), Box<dyn std::error::Error>> {
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/scenes/container.toml");
    let environment = Arc::new(Environment::build(Scene::load(path.as_ref(), &[])?)?);
    let zone = environment.task().zone().ok_or("no zone")?;
    let belief = Belief::from(HeightField::new(zone.clone(), GpSettings::default()));
    let probe = TwistingProbe { probe: exact_probe(Arc::clone(&environment)), friction };
    let mut episode = Episode::new(environment.task(), belief, probe);
    let mut found = Vec::new();
    for (i, place) in places.iter().enumerate() {
        let tap = Target::from(*place);
        let twist = Target::Custom {
            name: ACTION.into(),
            tap: Box::new(tap.clone()),
            parameters: vec![45.0],
        };
        let target = if i % 2 == 0 { tap } else { twist };
        let action = episode.action(&target)?;
        let outcome = episode.execute(&target, &action)?;
        found.push(Twisted { friction: outcome.measured.get(FRICTION).copied(), target });
    }
    episode.fit()?;
    Ok((found, episode.into_belief()))
}

#[allow(dead_code)]
fn main() -> Result<(), Box<dyn std::error::Error>> {
    let places = [[-0.02, 0.46], [0.0, 0.48], [0.02, 0.5], [0.01, 0.52]];
    let (found, _) = explore(&places, |z_m| 0.2 + 2.0 * (z_m - 0.4))?;
    for Twisted { target, friction } in found {
        match friction {
            Some(friction) => println!("{:?}: friction {friction:.2}", target.numbers()),
            None => println!("{:?}: tap", target.numbers()),
        }
    }
    Ok(())
}
