//! Elastomer pad with a camera behind it, pressed by an object: its load and its depth images.

pub mod half_space;
pub mod window;

use super::effects::gel::GelEffect;
use super::effects::rigid_tip::RigidTipEffect;
use super::load::{ContactLoad, PressError};
use super::noise::normal;
use half_space::{HalfSpace, Indentation};
use nalgebra::{Isometry3, Point3, Vector3};
use palpate_explore::robot::finger::Finger;
use palpate_explore::robot::sensor::{DepthImage, GelPad};
use palpate_geometry::bvh::MeshBvh;
use rand_chacha::ChaCha8Rng;
use std::f64::consts::PI;
use window::Window;

/// Cells of the grid on which pressures are computed.
// heuristic: the force of a sphere is within 1 % of Hertz's.
const CELLS: [usize; 2] = [24, 18];

/// Side of the blocks of cells that count as one point force for the surface beside the grid.
// heuristic: the displacement there is a few per cent of the deepest.
const BLOCK: usize = 6;

/// Pad of a fingertip: constant, shared by trials.
#[derive(Clone, Debug)]
pub struct Gel {
    effect: GelEffect,
    pad: GelPad,
    x_tp: Isometry3<f64>,
    space: HalfSpace,
    /// Rigid hull behind the pad, which carries it.
    core: RigidTipEffect,
    hull: Finger,
}

/// State of a pad during one trial.
#[derive(Clone, Debug)]
pub struct GelState {
    rng: ChaCha8Rng,
    /// Factor of the depths of this trial.
    scale: f64,
    next_frame_s: f64,
    x_wt: Option<Isometry3<f64>>,
    load: ContactLoad,
    window: Window,
    found: Indentation,
    heights_m: Vec<f64>,
    demanded_m: Vec<f64>,
    image: Option<DepthImage>,
    spare_m: Vec<f32>,
}

impl GelState {
    /// Creates the state at the start of a trial; `rng` is its only randomness.
    pub fn new(effect: &GelEffect, mut rng: ChaCha8Rng) -> Self {
        Self {
            scale: effect.scale * (1.0 + effect.scale_sd * normal(&mut rng)),
            rng,
            next_frame_s: effect.frame_s,
            x_wt: None,
            load: ContactLoad::default(),
            window: Window::default(),
            found: Indentation::default(),
            heights_m: Vec::new(),
            demanded_m: Vec::new(),
            image: None,
            spare_m: Vec::new(),
        }
    }

    /// Returns the bytes held.
    pub fn bytes(&self) -> usize {
        let numbers = self.heights_m.capacity() + self.demanded_m.capacity();
        let spare = self.spare_m.capacity() * size_of::<f32>();
        size_of_val(self) + self.found.bytes() + numbers * size_of::<f64>() + spare
    }

    /// Returns the last image, if it was not read yet.
    pub fn image(&mut self) -> Option<DepthImage> {
        self.image.take()
    }

    /// Takes back the memory of an image.
    pub fn reuse(&mut self, image: DepthImage) {
        self.spare_m = image.depths_m;
    }
}

impl Gel {
    /// Creates the pad at the tip of `finger`.
    pub fn new(finger: &Finger, effect: &GelEffect) -> Self {
        Self {
            pad: effect.pad(),
            x_tp: GelPad::x_tp(finger),
            space: HalfSpace::new(CELLS),
            core: RigidTipEffect::default(),
            hull: finger.clone(),
            effect: effect.clone(),
        }
    }

    /// Advances to `time_s`, with the tip at `x_wt`: computes the load, and the image if its time
    /// has come.
    ///
    /// # Errors
    /// If the pose is not finite, or the object encloses the core.
    pub fn step(
        &self,
        object: &MeshBvh,
        x_wt: &Isometry3<f64>,
        time_s: f64,
        state: &mut GelState,
    ) -> Result<ContactLoad, PressError> {
        if state.x_wt != Some(*x_wt) {
            state.load = self.press(object, x_wt, state)?;
            state.x_wt = Some(*x_wt);
        }
        if time_s + 1e-9 >= state.next_frame_s {
            state.next_frame_s += self.effect.frame_s;
            let depths_m = self.image(object, x_wt, state);
            state.image = Some(DepthImage { time_s, pixels: self.effect.pixels, depths_m });
        }
        Ok(state.load)
    }

    /// Smallest z in `P` of an object's near side; deeper than twice the gel is its far side.
    fn back_m(&self) -> f64 {
        let corner_m = self.pad.size_m.map(|side| 0.5 * side);
        self.pad.surface_m(corner_m) - 2.0 * self.effect.thickness_m
    }

    /// Whether the object comes near the pad.
    fn is_near(&self, object: &MeshBvh, x_wp: &Isometry3<f64>) -> bool {
        let [width, height] = self.pad.size_m.map(|side| 0.5 * side);
        let reach_m = width.hypot(height).hypot(self.back_m());
        object.touches(&Point3::from(x_wp.translation.vector), reach_m)
    }

    fn press(
        &self,
        object: &MeshBvh,
        x_wt: &Isometry3<f64>,
        state: &mut GelState,
    ) -> Result<ContactLoad, PressError> {
        state.found.clear();
        let back_t = -self.x_tp.rotation.transform_vector(&Vector3::z()) * self.effect.thickness_m;
        let behind = Isometry3::translation(back_t.x, back_t.y, back_t.z);
        let mut load = self.core.press(&self.hull, object, &(x_wt * behind))?;
        load.is_core_loaded = load.force_n.norm() > 0.0;
        load.torque_nm += back_t.cross(&load.force_n);
        load.centre_t += back_t;
        load.indentation_max_m = 0.0;
        let x_wp = x_wt * self.x_tp;
        if !self.is_near(object, &x_wp) {
            return Ok(load);
        }
        let half_m = self.pad.size_m.map(|side| 0.5 * side);
        let whole = Window::around(half_m.map(|half| -half), half_m, CELLS);
        let x_pw = x_wp.inverse();
        self.demand(object, &x_pw, &whole, state);
        let Some([low_m, high_m]) = whole.bounds_of_positive(&state.demanded_m, whole.step_m[0])
        else {
            return Ok(load);
        };
        let within = |at: [f64; 2]| [0, 1].map(|axis| at[axis].clamp(-half_m[axis], half_m[axis]));
        state.window = Window::around(within(low_m), within(high_m), CELLS);
        let window = state.window;
        self.demand(object, &x_pw, &window, state);
        let GelState { found, demanded_m, .. } = state;
        match self.effect.spread {
            true => self.space.press(self.effect.modulus_pa, window.step_m[0], demanded_m, found),
            false => {
                let stiffness_pa_m = self.effect.modulus_pa / self.effect.thickness_m;
                found.displaced_m.extend(demanded_m.iter().map(|d| d.max(0.0)));
                found.pressure_pa.extend(found.displaced_m.iter().map(|u| u * stiffness_pa_m));
            }
        }
        let force_n = found.force_n(&window);
        if force_n <= 0.0 {
            return Ok(load);
        }
        let mut centre = Vector3::zeros();
        let mut energy_pa_m = 0.0;
        for (cell, (pressure_pa, u)) in found.pressure_pa.iter().zip(&found.displaced_m).enumerate()
        {
            let [x, y] = window.centre_m(cell);
            centre += Vector3::new(x, y, self.pad.surface_m([x, y]) - u) * *pressure_pa;
            energy_pa_m += 0.5 * pressure_pa * u;
            load.indentation_max_m = load.indentation_max_m.max(demanded_m[cell]);
        }
        let cell_m2 = window.cell_m2();
        let pressed = found.pressure_pa.iter().filter(|p| **p > 0.0).count();
        let normal_t = -(self.x_tp.rotation * Vector3::z());
        let centre_t = self.x_tp * Point3::from(centre * (cell_m2 / force_n));
        load.torque_nm += centre_t.coords.cross(&(normal_t * force_n));
        load.force_n += normal_t * force_n;
        (load.centre_t, load.normal_t) = (centre_t, normal_t);
        load.area_m2 = pressed as f64 * cell_m2;
        load.energy_j += energy_pa_m * cell_m2;
        Ok(load)
    }

    /// Writes how far the object is inside the unloaded pad at every cell; nothing beside the pad.
    fn demand(
        &self,
        object: &MeshBvh,
        x_pw: &Isometry3<f64>,
        window: &Window,
        state: &mut GelState,
    ) {
        let GelState { heights_m, demanded_m, .. } = state;
        window.heights(object, x_pw, self.back_m(), heights_m);
        demanded_m.clear();
        demanded_m.extend(heights_m.iter().enumerate().map(|(cell, height)| {
            let at = window.centre_m(cell);
            let is_on = [0, 1].iter().all(|&axis| at[axis].abs() <= 0.5 * self.pad.size_m[axis]);
            if is_on { self.pad.surface_m(at) - height } else { f64::NEG_INFINITY }
        }));
    }

    /// Returns the depths at the pixels: exact where the object presses, elsewhere those of the
    /// surface around it.
    fn image(&self, object: &MeshBvh, x_wt: &Isometry3<f64>, state: &mut GelState) -> Vec<f32> {
        let [columns, rows] = self.effect.pixels;
        let mut depths_m = std::mem::take(&mut state.spare_m);
        depths_m.clear();
        depths_m.resize(columns * rows, 0.0);
        if !state.found.is_empty() {
            self.draw(object, x_wt, state, &mut depths_m);
        }
        for depth_m in &mut depths_m {
            let noise_m = self.effect.noise_m * normal(&mut state.rng);
            *depth_m = (f64::from(*depth_m) * state.scale + noise_m) as f32;
        }
        depths_m
    }

    fn draw(
        &self,
        object: &MeshBvh,
        x_wt: &Isometry3<f64>,
        state: &mut GelState,
        depths_m: &mut [f32],
    ) {
        let x_pw = (x_wt * self.x_tp).inverse();
        let pixels = Window::over(self.pad.size_m, self.effect.pixels);
        pixels.heights(object, &x_pw, self.back_m(), &mut state.heights_m);
        let GelState { found, window, heights_m, .. } = state;
        let blocks =
            if self.effect.spread { blocks(window, &found.pressure_pa) } else { Vec::new() };
        for (index, depth_m) in depths_m.iter_mut().enumerate() {
            let at = pixels.centre_m(index);
            let inside_m = self.pad.surface_m(at) - heights_m[index];
            let is_pressed = inside_m > 0.0 && window.is_positive(&found.pressure_pa, at);
            let around_m = match self.effect.spread && !is_pressed {
                true => window
                    .interpolate(&found.displaced_m, at)
                    .unwrap_or_else(|| self.beside_m(&blocks, at)),
                false => 0.0,
            };
            *depth_m = inside_m.max(around_m) as f32;
        }
    }

    /// Displacement of the surface beside the grid, by point forces (Boussinesq): F / (π E* r).
    fn beside_m(&self, blocks: &[[f64; 3]], at: [f64; 2]) -> f64 {
        let per_force = 1.0 / (PI * self.effect.modulus_pa);
        let parts = blocks
            .iter()
            .map(|[x, y, force_n]| force_n / ((at[0] - x).powi(2) + (at[1] - y).powi(2)).sqrt());
        per_force * parts.sum::<f64>()
    }
}

/// Returns the centre and the force of every loaded block of cells.
fn blocks(window: &Window, pressure_pa: &[f64]) -> Vec<[f64; 3]> {
    let columns = window.counts[0].div_ceil(BLOCK);
    let mut sums = vec![[0.0; 3]; columns * window.counts[1].div_ceil(BLOCK)];
    for (cell, pressure_pa) in pressure_pa.iter().enumerate() {
        let force_n = pressure_pa * window.cell_m2();
        let [x, y] = window.centre_m(cell);
        let (column, row) = (cell % window.counts[0], cell / window.counts[0]);
        let sum = &mut sums[row / BLOCK * columns + column / BLOCK];
        *sum = [sum[0] + force_n * x, sum[1] + force_n * y, sum[2] + force_n];
    }
    sums.retain(|sum| sum[2] > 0.0);
    sums.iter().map(|[x, y, force_n]| [x / force_n, y / force_n, *force_n]).collect()
}
