//! Looks of the scene's camera: those before the touches, and those that a planner asks for.

use super::row::ViewRow;
use crate::experiment::experiment::Experiment;
use crate::sim::Environment;
use palpate_explore::belief::Belief;
use palpate_explore::probe::Probe;
use palpate_explore::view::{Offer, View};
use palpate_gp::math::seed;

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
        let view = self.environment.look(number as usize, &mut random);
        let view = view.map_err(|error| error.to_string())?;
        self.taken.push(number);
        probe.rest(self.look_s());
        let seen = belief.observe_view(&view);
        if seen.is_empty() {
            return Err(nothing_seen(&view));
        }
        Ok(ViewRow { after, seen: seen.clone(), error: None })
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

/// Describes a view without a point of the region.
fn nothing_seen(view: &View) -> String {
    let mut depths_m: Vec<f64> = view.points_c.iter().map(|p_c| p_c.z).collect();
    depths_m.sort_by(f64::total_cmp);
    let ahead_m = view.x_wc.inverse_transform_point(&view.pivot_w).z;
    match depths_m.get(depths_m.len() / 2) {
        None => "the view has no points".into(),
        Some(middle_m) => format!(
            "the view shows nothing of the region: its points are {middle_m:.3} m ahead of the camera \
             (median of {}), the region {ahead_m:.3} m; check camera.position_m, unit and frame",
            depths_m.len()
        ),
    }
}
