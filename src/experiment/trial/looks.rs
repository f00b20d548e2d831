//! Looks of the scene's camera: those before the touches, and those that a planner asks for.

use super::row::ViewRow;
use crate::experiment::experiment::Experiment;
use crate::sim::Environment;
use palpate_explore::belief::Belief;
use palpate_explore::evidence::{End, Evidence, Outcome};
use palpate_explore::probe::Probe;
use palpate_explore::task::{Region, Target};
use palpate_explore::view::{Offer, SeenSurface, View};
use palpate_gp::math::seed;
use palpate_input::error::InputError;
use palpate_input::format::counted;
use rand::Rng;

/// Time of a touch of a probe that does not move, and of the first touch, s.
// heuristic: a simulated PA-10 takes five to eight.
pub(super) const TOUCH_S: f64 = 6.0;

/// Camera of a trial.
pub(super) struct Looks<'a> {
    experiment: &'a Experiment,
    environment: &'a Environment,
    trial: u32,
    /// Numbers of the views so far.
    taken: Vec<u32>,
}

impl<'a> Looks<'a> {
    pub(super) fn new(
        experiment: &'a Experiment,
        environment: &'a Environment,
        trial: u32,
    ) -> Self {
        Self { experiment, environment, trial, taken: Vec::new() }
    }

    /// Takes view `number` after `after` touches and adds it to the belief.
    ///
    /// # Errors
    /// If the view cannot be read, or shows nothing of the region.
    pub(super) fn look(
        &mut self,
        (number, after): (u32, u32),
        probe: &mut dyn Probe,
        belief: &mut Belief,
    ) -> Result<ViewRow, String> {
        let purpose = format!("view {number}");
        let mut random = seed::stream(self.experiment.seed, self.trial.into(), &purpose);
        let seen = seen(self.environment, number, &mut random);
        let seen = seen.map_err(|error| error.to_string())?;
        let target = Target::Look { camera: number };
        let outcome = Outcome::new(End::Looked, vec![Evidence::Seen(seen)]);
        belief.observe(&target, &outcome);
        self.taken.push(number);
        probe.rest(self.look_s());
        Ok(ViewRow { after, target, outcome, error: None })
    }

    /// Returns the looks that a planner may ask for after `after` touches.
    pub(super) fn offers(&self, probe: &dyn Probe, after: u32) -> Vec<Offer> {
        let most = self.experiment.views + self.experiment.further_views;
        if self.experiment.further_views == 0 || self.taken.len() >= most as usize {
            return Vec::new();
        }
        let mean_s = probe.time_s().map(|time_s| (time_s - self.looked_s()) / f64::from(after));
        let touch_s = mean_s.filter(|_| after > 0).unwrap_or(TOUCH_S);
        self.environment.offers(&self.taken, touch_s)
    }

    /// Time of the looks so far, s.
    pub(super) fn looked_s(&self) -> f64 {
        self.look_s() * self.taken.len() as f64
    }

    fn look_s(&self) -> f64 {
        self.environment.scene().camera.as_ref().map_or(0.0, |camera| camera.look_s)
    }
}

/// Checks the views that an experiment reads from files.
///
/// # Errors
/// If a file cannot be read, or shows nothing of the region.
pub(in crate::experiment) fn check(
    experiment: &Experiment,
    environment: &Environment,
) -> Result<(), InputError> {
    let scene = environment.scene();
    let Some(camera) = &scene.camera else { return Ok(()) };
    let places = match experiment.further_views {
        0 => experiment.views,
        _ => u32::MAX,
    };
    let places = places.min(1 + camera.further.len() as u32);
    for number in (0..places).filter(|number| camera.at(*number as usize).file.is_some()) {
        let mut random = seed::stream(experiment.seed, 0, "check of a view");
        seen(environment, number, &mut random)?;
    }
    Ok(())
}

/// Returns what view `number` shows of the region.
///
/// # Errors
/// If the view cannot be read, or shows nothing of the region.
fn seen(
    environment: &Environment,
    number: u32,
    random: &mut impl Rng,
) -> Result<SeenSurface, InputError> {
    let view = environment.look(number as usize, random)?;
    let seen = SeenSurface::of_region(&view, environment.task().region());
    if seen.is_empty() {
        let camera = environment.scene().camera.as_ref().map(|camera| camera.at(number as usize));
        let file = camera.and_then(|camera| camera.file.clone());
        let error = nothing_seen(&view, environment.task().region());
        return Err(match file {
            Some(file) => error.at(file.display()),
            None => error,
        });
    }
    Ok(seen)
}

/// Describes a view of which a belief takes nothing.
fn nothing_seen(view: &View, region: &Region) -> InputError {
    let mut depths_m: Vec<f64> = view.points_c.iter().map(|p_c| p_c.z).collect();
    depths_m.sort_by(f64::total_cmp);
    let all = counted(depths_m.len(), "point");
    let Some(middle_m) = depths_m.get(depths_m.len() / 2) else {
        return InputError::new("the view has no points");
    };
    let margin_m = view.margin_m();
    let points_w = view.points_c.iter().map(|p_c| view.x_wc * p_c);
    let inside = points_w.filter(|p_w| region.is_near(p_w, margin_m)).count();
    if inside > 0 {
        return InputError::new(format!(
            "{inside} of the {all} of the view lie in the region, and no part of them is a surface: \
             a part needs 12 neighbouring points that are not an edge, less than 80° from the ray"
        ))
        .remedy("use a view with more points of the region");
    }
    let ahead_m = view.x_wc.inverse_transform_point(&view.pivot_w).z;
    InputError::new(format!(
        "the view shows nothing of the region: its points are {middle_m:.3} m ahead of the camera \
         (median of {}), the region {ahead_m:.3} m",
        depths_m.len()
    ))
    .remedy("check camera.position_m, unit and frame")
}
