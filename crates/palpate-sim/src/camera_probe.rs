//! Probe with a camera: it looks itself, and passes touches on.

use crate::Environment;
use crate::camera::TrueError;
use palpate_explore::backend::Fault;
use palpate_explore::evidence::{End, Outcome};
use palpate_explore::probe::Probe;
use palpate_explore::task::{Action, Region};
use palpate_explore::view::{LookOffer, SeenSurface, View};
use palpate_gp::math::seed;
use palpate_input::error::InputError;
use palpate_input::format::counted;
use rand::Rng;
use rand_chacha::ChaCha8Rng;
use std::sync::Arc;

/// Probe with the camera of a scene.
pub struct CameraProbe<P> {
    probe: P,
    environment: Arc<Environment>,
    /// Seeds of each view: root and trial.
    seeds: [u64; 2],
    /// Number of views up to which it offers looks.
    most: usize,
    /// Numbers of the views so far.
    taken: Vec<u32>,
}

impl<P: Probe> CameraProbe<P> {
    /// Adds the camera of `environment` to `probe`; a view depends on the `seeds`, root and trial,
    /// and on its number. It offers no looks.
    pub fn new(probe: P, environment: &Arc<Environment>, seeds: [u64; 2]) -> Self {
        Self { probe, environment: Arc::clone(environment), seeds, most: 0, taken: Vec::new() }
    }

    /// Offers looks up to `most` views.
    pub fn with_offers(self, most: usize) -> Self {
        Self { most, ..self }
    }

    fn look_s(&self) -> f64 {
        self.environment.scene().camera.as_ref().map_or(0.0, |camera| camera.look_s)
    }
}

impl<P: Probe> Probe for CameraProbe<P> {
    fn execute(&mut self, action: &Action) -> Result<Outcome, Fault> {
        let Action::Look { camera } = action else { return self.probe.execute(action) };
        let mut random = stream(self.seeds, *camera);
        let seen = seen(&self.environment, *camera, &mut random)?;
        self.taken.push(*camera);
        self.probe.rest(self.look_s());
        let outcome = Outcome::new(End::Looked, vec![seen.into()]);
        Ok(Outcome { time_s: self.time_s(), ..outcome })
    }

    fn looks(&self) -> Vec<LookOffer> {
        match self.taken.len() < self.most {
            true => self.environment.looks(&self.taken),
            false => Vec::new(),
        }
    }

    fn looked_s(&self) -> f64 {
        self.look_s() * self.taken.len() as f64
    }

    fn time_s(&self) -> Option<f64> {
        self.probe.time_s()
    }

    fn rest(&mut self, time_s: f64) {
        self.probe.rest(time_s);
    }
}

/// Returns the random numbers of a view.
fn stream([root, trial]: [u64; 2], number: u32) -> ChaCha8Rng {
    seed::stream(root, trial, &format!("view {number}"))
}

/// Returns the true error of the camera's pose in view `number` of a trial with the `seeds`, root
/// and trial; `None` for a file.
pub fn true_error(environment: &Environment, number: u32, seeds: [u64; 2]) -> Option<TrueError> {
    let camera = environment.scene().camera.as_ref()?.at(number as usize);
    camera.true_error(&mut stream(seeds, number))
}

/// Returns what view `number` shows of the region.
///
/// # Errors
/// If the view cannot be read, or shows nothing of the region.
pub fn seen(
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
