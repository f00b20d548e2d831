//! Simulated depth camera: rays on the exact mesh, and the errors that the scene calls for.

mod file;
mod intrinsics;
mod pcd;
pub mod settings;

pub use settings::CameraSettings;

use crate::finger::noise::normal;
use file::Seen;
use nalgebra::{Isometry3, Point3, UnitVector3, Vector3};
use palpate_explore::robot::Robot;
use palpate_explore::view::{LookOffer, PixelNoise, RigidError, View, corrected_pose};
use palpate_geometry::bvh::MeshBvh;
use palpate_geometry::primitives::nearest_of_segments;
use palpate_geometry::sweep::Capsule;
use palpate_input::error::InputError;
use rand::{Rng, RngExt};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use settings::FlyingPixels;

/// Largest depth, m.
// heuristic: beyond the range of every camera beside an arm.
const FARTHEST_M: f64 = 5.0;

/// Step of the depth between neighbouring pixels, as a fraction of it, that is an edge.
// heuristic: a surface at 75° to the ray has a step of a hundredth at 640 pixels.
const EDGE: f64 = 0.02;

/// Error of a simulated camera's stated pose, in the terms of [`RigidError`].
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct TrueError {
    /// Shift of the seen points at the middle of the region along x, y and z of the camera, m.
    pub shift_m: [f64; 3],
    /// Rotation of the seen points about the same axes, deg.
    pub turn_deg: [f64; 3],
    /// Relative error of the depths.
    pub scale: f64,
}

impl TrueError {
    /// Returns the differences of the six components of a found pose from the true ones, over their
    /// stated deviations; those without a deviation are left out.
    pub fn deviations(&self, found: &RigidError) -> Vec<f64> {
        let part = |found: &[f64; 3], truth: &[f64; 3], sds: &[f64; 3]| {
            let known = (0..3).filter(|i| sds[*i] > 0.0);
            known.map(|i| (found[i] - truth[i]) / sds[i]).collect::<Vec<f64>>()
        };
        let shifts = part(&found.shift_m, &self.shift_m, &found.shift_sd_m);
        let turns = part(&found.turn_deg, &self.turn_deg, &found.turn_sd_deg);
        shifts.into_iter().chain(turns).collect()
    }
}

/// Scene before a camera.
pub struct VisibleScene<'a> {
    /// Object.
    pub object: &'a MeshBvh,
    /// Middle of the region, at which the camera looks unless its rotation is given.
    pub middle_w: Point3<f64>,
    /// Capsules that may hide the object, in `W`.
    pub capsules_w: Vec<Capsule>,
}

/// Returns the capsules of an arm in its home posture.
pub fn capsules_at_home(robot: &Robot) -> Vec<Capsule> {
    let frames = robot.chain.frames(&robot.chain.home);
    robot.capsules().iter().map(|capsule| capsule.at(&frames[capsule.link])).collect()
}

/// Image of depths along the camera's axis; NaN without one.
struct Image {
    pixels: [usize; 2],
    depths_m: Vec<f64>,
}

impl CameraSettings {
    /// Returns a view of the scene, or that of the file. `rng` gives the error of the pose and the
    /// noise of a simulated one.
    ///
    /// # Errors
    /// If the file cannot be read.
    pub fn look(&self, scene: &VisibleScene, rng: &mut impl Rng) -> Result<View, InputError> {
        let stated = self.x_wc(&scene.middle_w);
        let (pivot_w, accuracy) = (self.target_w(&scene.middle_w), self.accuracy());
        if let Some(path) = &self.file {
            let Seen { points_c, image } = file::read(self, path, &stated)?;
            return Ok(View { x_wc: stated, points_c, image, pivot_w, accuracy });
        }
        let (x_wc, scale) = self.true_pose(&stated, &pivot_w, rng);
        let mut image = self.render(scene, &x_wc);
        if let Some(flying) = &self.flying_pixels {
            image.fly(flying, rng);
        }
        for depth_m in &mut image.depths_m {
            *depth_m *= scale;
        }
        if let Some(noise) = &self.noise {
            image.blur(noise, rng);
        }
        if let Some(step_m) = self.quantisation.as_ref().map(|quantisation| quantisation.step_m) {
            image.depths_m.iter_mut().for_each(|m| *m = (*m / step_m).round() * step_m);
        }
        let seen = image.depths_m.iter().enumerate().filter(|(_, depth_m)| depth_m.is_finite());
        let points_c = seen.map(|(i, depth_m)| (self.ray(i) * *depth_m).into()).collect();
        Ok(View { x_wc: stated, points_c, image: Some(self.image()), pivot_w, accuracy })
    }

    /// Returns (x/z, y/z) at the corners of its image.
    fn image(&self) -> [[f64; 2]; 2] {
        let [width, height] = self.pixels();
        [0, width * height - 1].map(|i| [self.ray(i).x, self.ray(i).y])
    }

    /// Returns the offer of view `number` from here.
    pub fn offer(&self, number: u32, middle_w: &Point3<f64>) -> LookOffer {
        let [width, height] = self.pixels().map(|count| count as f64);
        let [fx, fy, cx, cy] = self.intrinsics();
        let ends = |focal: f64, centre: f64, size: f64| {
            [-centre, size - 1.0 - centre].map(|px| px / focal)
        };
        LookOffer {
            number,
            x_wc: self.x_wc(middle_w),
            pivot_w: self.target_w(middle_w),
            accuracy: self.accuracy(),
            image: [ends(fx, cx, width), ends(fy, cy, height)],
            time_s: self.look_s,
        }
    }

    /// Returns the numbers of pixels along width and height.
    fn pixels(&self) -> [usize; 2] {
        self.pixels.unwrap_or(settings::PIXELS)
    }

    /// Returns focal lengths and principal point, pixels.
    fn intrinsics(&self) -> [f64; 4] {
        let [width, height] = self.pixels().map(|count| count as f64);
        let focal = 0.5 * width / (0.5 * self.fov_deg).to_radians().tan();
        // The middle of the image is between its pixels.
        let centred = [focal, focal, 0.5 * (width - 1.0), 0.5 * (height - 1.0)];
        self.intrinsics_px.unwrap_or(centred)
    }

    /// Returns the vector (x/z, y/z, 1) along pixel `i`.
    fn ray(&self, i: usize) -> Vector3<f64> {
        let columns = self.pixels()[0];
        let [column, row] = [i % columns, i / columns].map(|at| at as f64);
        let [fx, fy, cx, cy] = self.intrinsics();
        Vector3::new((column - cx) / fx, (row - cy) / fy, 1.0)
    }

    /// Returns the pixel, from the top left, of a point in the camera's frame.
    pub fn pixel(&self, p_c: &Point3<f64>) -> [f64; 2] {
        let [fx, fy, cx, cy] = self.intrinsics();
        [fx * p_c.x / p_c.z + cx, fy * p_c.y / p_c.z + cy]
    }

    /// Draws the error of the stated pose that a view with this `rng` has; `None` for a file.
    pub fn true_error(&self, rng: &mut impl Rng) -> Option<TrueError> {
        self.file.is_none().then(|| self.draw_error(rng))
    }

    fn draw_error(&self, rng: &mut impl Rng) -> TrueError {
        let Some(error) = &self.pose_error else { return TrueError::default() };
        let mut draw = |sds: [f64; 3]| sds.map(|sd| sd * normal(rng));
        let (shift_m, turn_deg) = (draw(error.position_sd_m), draw(error.rotation_sd_deg));
        TrueError { shift_m, turn_deg, scale: error.scale_sd * normal(rng) }
    }

    /// Draws where the camera is, and the scale of its depths; the inverse of the correction by
    /// [`SeenSurface`](palpate_explore::view::SeenSurface).
    fn true_pose(
        &self,
        stated: &Isometry3<f64>,
        pivot_w: &Point3<f64>,
        rng: &mut impl Rng,
    ) -> (Isometry3<f64>, f64) {
        if self.pose_error.is_none() {
            return (*stated, 1.0);
        }
        let TrueError { shift_m, turn_deg, scale } = self.draw_error(rng);
        let [shift, turn] =
            [shift_m, turn_deg.map(f64::to_radians)].map(|of| stated.rotation * Vector3::from(of));
        (corrected_pose(stated, pivot_w, &shift, &turn), 1.0 + scale)
    }

    /// Returns the exact depths from the pose `x_wc`.
    fn render(&self, scene: &VisibleScene, x_wc: &Isometry3<f64>) -> Image {
        let origin_w = Point3::from(x_wc.translation.vector);
        let steepest = self.holes.as_ref().map(|holes| holes.grazing_deg.to_radians().cos());
        let depth_m = |i: usize| {
            let ray_c = self.ray(i);
            let direction_w = UnitVector3::new_normalize(x_wc.rotation * ray_c);
            let hit = scene.object.ray(&origin_w, &direction_w, FARTHEST_M)?;
            let cosine = hit.normal.dot(&direction_w).abs();
            let is_hole = steepest.is_some_and(|least| cosine < least);
            let is_before = |capsule: &Capsule| {
                let axis = [&capsule.p0_w, &capsule.p1_w];
                let (a, b) = nearest_of_segments([&origin_w, &hit.point], axis);
                (a - b).norm() < capsule.radius_m
            };
            let is_hidden = scene.capsules_w.iter().any(is_before);
            (!is_hole && !is_hidden).then(|| hit.distance_m / ray_c.norm())
        };
        let pixels = self.pixels();
        let count = pixels[0] * pixels[1];
        let depths_m = (0..count).map(|i| depth_m(i).unwrap_or(f64::NAN)).collect();
        Image { pixels, depths_m }
    }
}

impl Image {
    /// Replaces pixels beside an edge of the depth by depths between those of its two sides.
    fn fly(&mut self, flying: &FlyingPixels, rng: &mut impl Rng) {
        let [width, height] = self.pixels;
        let exact = &self.depths_m.clone();
        let reach = flying.band_px;
        for (i, depth_m) in self.depths_m.iter_mut().enumerate() {
            if !depth_m.is_finite() {
                continue;
            }
            let [column, row] = [i % width, i / width];
            let columns = column.saturating_sub(reach)..(column + reach + 1).min(width);
            let beside = (row.saturating_sub(reach)..(row + reach + 1).min(height))
                .flat_map(|row| columns.clone().map(move |column| exact[row * width + column]))
                .filter(|other_m| other_m.is_finite())
                .max_by(|a, b| (a - *depth_m).abs().total_cmp(&(b - *depth_m).abs()));
            let Some(other_m) = beside.filter(|m| (m - *depth_m).abs() > EDGE * *depth_m) else {
                continue;
            };
            if rng.random_bool(flying.share) {
                *depth_m += rng.random_range(0.0..1.0) * (other_m - *depth_m);
            }
        }
    }

    /// Adds noise, equal over squares of pixels.
    fn blur(&mut self, noise: &PixelNoise, rng: &mut impl Rng) {
        let side = noise.noise_px;
        let columns = self.pixels[0].div_ceil(side);
        let squares = columns * self.pixels[1].div_ceil(side);
        let draws: Vec<f64> = (0..squares).map(|_| normal(rng)).collect();
        for (i, depth_m) in self.depths_m.iter_mut().enumerate() {
            let [column, row] = [i % self.pixels[0], i / self.pixels[0]].map(|at| at / side);
            *depth_m += noise.sd_m(*depth_m) * draws[row * columns + column];
        }
    }
}
