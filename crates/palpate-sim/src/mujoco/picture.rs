//! Rendering of a model to a PNG, off-screen through EGL: no window and no display is needed.

use mujoco_rs::renderer::{MjRenderer, RendererError, png::Compression};
use mujoco_rs::wrappers::mj_data::MjData;
use mujoco_rs::wrappers::mj_model::{MjModel, MjtObjBase};
use mujoco_rs::wrappers::mj_visualization::MjvCamera;
use palpate_input::error::InputError;
use std::path::Path;

/// Renders `model` from `camera` at its first keyframe, or at q = 0 without one, and writes a PNG
/// of the size of the model's off-screen buffer to `path`.
///
/// # Errors
/// If the camera is unknown, EGL is missing or the file cannot be written.
pub fn picture(model: &MjModel, camera: &str, path: &Path) -> Result<(), InputError> {
    let id = model
        .name_to_id(MjtObjBase::mjOBJ_CAMERA, camera)
        .ok_or_else(|| InputError::new(format!("the model has no camera \"{camera}\"")))?;
    let draw = |cause: RendererError| {
        InputError::new(format!(
            "cannot draw: {cause}; this needs EGL (Debian: libegl1 and libgl1-mesa-dri)"
        ))
    };
    let mut data = MjData::try_new(model)
        .map_err(|_| InputError::new("no memory for the state of the MuJoCo model"))?;
    if model.nkey() > 0 {
        // Key 0 exists.
        let _ = data.reset_keyframe(0);
    }
    data.forward();
    let mut renderer = MjRenderer::builder()
        .camera(MjvCamera::new_fixed(id))
        .png_compression(Compression::Balanced)
        .build(model)
        .map_err(draw)?;
    renderer.sync_data(&mut data).map_err(draw)?;
    renderer.render().map_err(draw)?;
    renderer.save_rgb(path).map_err(|cause| match cause {
        RendererError::IoError(cause) => {
            InputError::new(format!("cannot write the picture: {cause}"))
        }
        cause => draw(cause),
    })
}
