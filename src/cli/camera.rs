//! Option `--camera` of `palpate show`: what the scene's depth camera sees.

use crate::report::camera_view::{DepthImage, camera_views};
use crate::report::files;
use crate::sim::Environment;
use anyhow::{Context, ensure};
use palpate_explore::view::SeenSurface;
use palpate_gp::math::seed;
use std::path::Path;

/// Draws the view from each place of the camera into `path`, and describes them.
pub(super) fn draw(environment: &Environment, path: &Path) -> anyhow::Result<String> {
    let scene = environment.scene();
    let camera = scene.camera.as_ref().context("--camera: the scene has no table [camera]")?;
    let names = std::iter::once("camera").chain(camera.further.keys().map(String::as_str));
    let (mut images, mut text) = (Vec::new(), String::new());
    for (number, name) in names.enumerate() {
        let view = environment.look(number, &mut seed::stream(0, 0, &format!("view {number}")))?;
        let seen = SeenSurface::of_region(&view, environment.task().region());
        let elements: Vec<_> = seen.elements().collect();
        let sds_mm = elements.iter().map(|element| 1e3 * element.sd);
        let least_mm = sds_mm.clone().fold(f64::INFINITY, f64::min);
        text += &format!("{name}: {} points, {} surface elements", view.points_c.len(), seen.len());
        if !seen.is_empty() {
            let most_mm = sds_mm.fold(0.0, f64::max);
            text += &format!(" of the region, ± {least_mm:.2} to {most_mm:.2} mm");
        }
        text += "\n";
        let camera = camera.at(number);
        let place = |p_c| camera.pixel(&p_c);
        images.push(DepthImage {
            title: name.into(),
            depths_m: view.points_c.iter().map(|p_c| (place(*p_c), p_c.z)).collect(),
            elements: (elements.iter())
                .map(|element| place(view.x_wc.inverse_transform_point(&element.p_w)))
                .collect(),
        });
    }
    ensure!(
        images.iter().any(|image| !image.depths_m.is_empty()),
        "--camera: the camera sees nothing; check camera.position_m and rotation_deg"
    );
    files::write_as(path, &camera_views(&images))?;
    Ok(text + &format!("picture: {}\n", path.display()))
}
