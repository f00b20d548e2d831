//! Viewer window that shows a model in a posture set from outside, in MuJoCo's viewer.

use super::{compile, lacking};
use crate::Environment;
use crate::mjcf;
use crate::mjcf::ModelPurpose;
use mujoco_rs::viewer::{MjViewer, MjViewerError};
use mujoco_rs::wrappers::mj_data::MjData;
use mujoco_rs::wrappers::mj_model::{MjModel, MjtGeom};
use palpate_explore::backend::live_view::ViewState;
use palpate_input::error::InputError;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::{Arc, PoisonError};

/// Largest number of marks drawn, the latest ones: that of touches with an exact fit.
const MARKS_MAX: usize = 2000;

// heuristic: radius and colour of a mark.
const MARK_M: f64 = 0.002;
const MARK_RGBA: [f32; 4] = [0.84, 0.37, 0.0, 1.0];

/// Viewer window; only the main thread may have one.
pub struct Window {
    viewer: MjViewer,
    data: MjData<Arc<MjModel>>,
}

impl Window {
    /// Opens a window with the picture of `environment`.
    ///
    /// # Errors
    /// If the environment has nothing to show, or there is no display with OpenGL.
    pub fn open(environment: &Environment, title: &str) -> Result<Self, InputError> {
        let picture = mjcf::scene(environment, ModelPurpose::Picture);
        let picture = picture.ok_or_else(|| lacking("an object"))?;
        let model = Arc::new(compile(&picture)?);
        let data = MjData::try_new(Arc::clone(&model))
            .map_err(|_| InputError::new("no memory for the state of the MuJoCo model"))?;
        let builder = MjViewer::builder().window_name(title.to_owned()).max_user_geoms(MARKS_MAX);
        // The viewer panics on a display without configurations.
        let viewer = catch_unwind(AssertUnwindSafe(|| builder.build_passive(&model)))
            .map_err(|_| {
                InputError::new("cannot open a window: the display has no OpenGL configuration")
            })?
            .map_err(no_display)?;
        Ok(Self { viewer, data })
    }

    /// Returns whether the window is still open.
    pub fn is_open(&self) -> bool {
        self.viewer.running()
    }

    /// Draws the model at the joint positions of `seen`, with a small ball at every mark.
    ///
    /// # Errors
    /// If the display fails.
    pub fn draw(&mut self, seen: &ViewState) -> Result<(), InputError> {
        if seen.q.len() == self.data.qpos().len() {
            self.data.qpos_mut().copy_from_slice(&seen.q);
        }
        self.data.set_time(seen.time_s);
        self.data.forward();
        let mut state = self.viewer.state().lock().unwrap_or_else(PoisonError::into_inner);
        state.sync_data(&mut self.data);
        let scene = state.user_scene_mut();
        scene.clear_geom();
        for mark in seen.marks_w.iter().rev().take(MARKS_MAX) {
            let (size, place) = (Some([MARK_M; 3]), Some(mark.coords.into()));
            let ball = MjtGeom::mjGEOM_SPHERE;
            // SAFETY: the ball keeps the default ids (none) of material, texture and object.
            let drawn = unsafe { scene.try_create_geom(ball, size, place, None, Some(MARK_RGBA)) };
            if drawn.is_err() {
                break;
            }
        }
        drop(state);
        self.viewer.render().map_err(no_display)
    }
}

fn no_display(cause: MjViewerError) -> InputError {
    InputError::new(format!("cannot open a window: {cause}; this needs X11 or Wayland with OpenGL"))
}
