//! Soft skin in contact with the exact mesh: an elastic foundation, or a shell, over the fluid.

use super::constants::effect;
use super::effect::{Effect, Requirement};
use crate::finger::foundation::{Column, Foundation, SkinContact};
use crate::finger::load::{ContactLoad, PressError};
use crate::finger::patches::{NearbyPatches, Patches, key};
use crate::finger::samples::{Lattice, SkinSample, spread};
use crate::finger::shell::elastic_sheet::Material;
use crate::finger::shell::membrane::{Membrane, ShellState};
use nalgebra::{Isometry3, Point3, Vector3};
use palpate_explore::robot::finger::profile::Profile;
use palpate_geometry::bvh::MeshBvh;
use palpate_input::config::Rules;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

// heuristic: smallest cosine between ray and normal; a grazing ray represents at most five times
// its section.
const COSINE_MIN: f64 = 0.2;

// heuristic: largest bulge of the free skin by fluid and neighbours, as a fraction of the hull's
// radius, to which rays extend; real skins bulge by 0.3 mm of 7.
const BULGE_MAX: f64 = 0.1;

/// Model of load transfer within the skin.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum SkinModel {
    /// Elastic foundation: each point is an independent column, coupled only by the fluid's
    /// pressure.
    #[default]
    Columns,
    /// Thin shell of silicone that carries load to its neighbours.
    Shell,
}

effect! {
    /// Table `[skin]`: a soft skin in contact with the exact mesh.
    SkinEffect in "skin"
    settings checked by check_resolution {
        /// Model of load transfer within the skin.
        model: SkinModel = SkinModel::Columns,
        /// Number of skin points; for a shell, of those on the back.
        samples: usize = 500,
        /// Shell cells along the finger, half over the cylinder and half over the tip's arc.
        cells_along: usize = 24,
        /// Shell cells around the finger, from nail to nail; even.
        cells_around: usize = 16,
    }
    constants {
        /// Modulus of the skin, in Pa; for columns only in compression between object and fluid.
        modulus_pa: f64, 1e3..=1e9;
        /// Poisson's ratio of a shell.
        poisson: f64, 0.0..=0.49;
        /// Membrane stiffness against flattening, in Pa per metre.
        flatten_pa_m: f64, 1e3..=1e12;
        /// Membrane stiffness against inflation, in Pa per metre.
        inflate_pa_m: f64, 1e5..=1e12;
        /// Stiffness of the core and of the ridges inside the skin, once the gap is closed.
        core_pa_m: f64, 1e3..=1e12;
    }
}

fn check_resolution(skin: &SkinEffect, rules: &mut Rules) {
    rules.require("samples", skin.samples, (10..=100_000).contains(&skin.samples), || {
        "10 to 100000".into()
    });
    rules.require("cells_along", skin.cells_along, (4..=48).contains(&skin.cells_along), || {
        "4 to 48".into()
    });
    let even = skin.cells_around.is_multiple_of(2) && (4..=32).contains(&skin.cells_around);
    rules.require("cells_around", skin.cells_around, even, || "an even number, 4 to 32".into());
}

impl Effect for SkinEffect {
    type State = ();

    const REQUIRES: Requirement = Requirement::Nothing;
}

/// Skin of a fingertip; constant.
#[derive(Clone, Debug)]
pub struct Skin {
    samples: Vec<SkinSample>,
    sections_m2: Vec<f64>,
    patches: Patches,
    foundation: Foundation,
    shell: Option<Membrane>,
    bulge_m: f64,
}

/// Buffers of one trial for [`Skin::press`], with the results of its last call.
#[derive(Clone, Debug, Default)]
pub struct SkinState {
    touches: Vec<SkinContact>,
    vicinity: NearbyPatches,
    /// Triangle that each sample's ray met last.
    met: Vec<Option<u32>>,
    shell: Option<ShellState>,
    /// Inward motion of the skin's inner side at each sample, in metres.
    pub inward_m: Vec<f64>,
    /// Compression of each sample's column by the object, in metres; 0 without contact.
    pub indentation_m: Vec<f64>,
}

impl SkinState {
    /// Returns the bytes held.
    pub fn bytes(&self) -> usize {
        let numbers = self.inward_m.capacity() + self.indentation_m.capacity();
        self.shell.as_ref().map_or(0, ShellState::bytes)
            + self.vicinity.bytes()
            + self.touches.capacity() * size_of::<SkinContact>()
            + self.met.capacity() * size_of::<Option<u32>>()
            + numbers * size_of::<f64>()
    }

    /// Returns `inward_m`, or an empty slice while the skin rests.
    pub fn inward_or_empty_m(&self) -> &[f64] {
        if self.touches.is_empty() { &[] } else { &self.inward_m }
    }
}

impl Skin {
    /// Creates a skin of this shape; `cavity_pa_m3` is the stiffness of the fluid, 0 for a dry
    /// finger.
    pub fn new(profile: &Profile, effect: &SkinEffect, cavity_pa_m3: f64) -> Self {
        let mut samples = spread(profile, effect.samples);
        let cells = [effect.cells_along, effect.cells_around];
        let lattice = (effect.model == SkinModel::Shell).then(|| Lattice::new(profile, cells));
        if let Some(lattice) = &lattice {
            samples.retain(|sample| !sample.layers.has_fluid);
            samples.splice(0..0, lattice.samples(profile));
        }
        samples.sort_by_cached_key(|sample| key(profile, sample));
        let bulges = cavity_pa_m3 > 0.0 || lattice.is_some();
        let bulge_m = if bulges { BULGE_MAX * profile.radius_m } else { 0.0 };
        let skin_m = samples.first().map_or(1.0, |sample| sample.layers.skin_m);
        let wet = samples.iter().filter(|sample| sample.layers.has_fluid);
        Self {
            shell: lattice.map(|lattice| {
                let (young_pa, poisson) = (effect.modulus_pa, effect.poisson);
                let material = Material { young_pa, poisson, thickness_m: skin_m };
                Membrane::new(&lattice, &material, effect.core_pa_m, cavity_pa_m3)
            }),
            sections_m2: samples.iter().map(SkinSample::section_m2).collect(),
            patches: Patches::new(profile, &samples, bulge_m),
            foundation: Foundation {
                column: Column {
                    skin_pa_m: effect.modulus_pa / skin_m,
                    flatten_pa_m: effect.flatten_pa_m,
                    inflate_pa_m: effect.inflate_pa_m,
                    core_pa_m: effect.core_pa_m,
                },
                wet_m2: wet.map(SkinSample::section_m2).sum(),
                cavity_pa_m3,
            },
            samples,
            bulge_m,
        }
    }

    /// Returns the points of the skin.
    pub fn samples(&self) -> &[SkinSample] {
        &self.samples
    }

    /// Returns the bytes held.
    pub fn bytes(&self) -> usize {
        self.shell.as_ref().map_or(0, Membrane::bytes)
            + self.samples.len() * (size_of::<SkinSample>() + size_of::<f64>())
            + self.patches.bytes()
    }

    /// Returns the stiffnesses of a column.
    pub fn column(&self) -> &Column {
        &self.foundation.column
    }

    /// Allocates a workspace for [`press`](Self::press).
    pub fn relaxed(&self) -> SkinState {
        SkinState {
            touches: Vec::with_capacity(self.samples.len()),
            vicinity: self.patches.nearby_patches(),
            met: vec![None; self.samples.len()],
            shell: self.shell.as_ref().map(Membrane::relaxed),
            inward_m: vec![0.0; self.samples.len()],
            indentation_m: vec![0.0; self.samples.len()],
        }
    }

    /// Computes the static equilibrium of the skin in pose `x_wt` against the object.
    ///
    /// The force is minus the gradient of [`ContactLoad::energy_j`] over the pose: each column
    /// presses along the object's normal n with its stress times section / cos(ray, n).
    ///
    /// # Errors
    /// If the pose is not finite, or the finger's axis is inside the object.
    pub fn press(
        &self,
        bvh: &MeshBvh,
        x_wt: &Isometry3<f64>,
        pressed: &mut SkinState,
    ) -> Result<ContactLoad, PressError> {
        if !x_wt.to_homogeneous().iter().all(|number| number.is_finite()) {
            return Err(PressError::NotFinite);
        }
        if bvh.is_enclosed(&x_wt.translation.vector.into()) {
            return Err(PressError::Inside);
        }
        let resting = pressed.touches.is_empty();
        pressed.touches.clear();
        self.collect_contacts(bvh, x_wt, pressed);
        if pressed.touches.is_empty() {
            if !resting {
                pressed.inward_m.fill(0.0);
                pressed.indentation_m.fill(0.0);
                if let (Some(shell), Some(state)) = (&self.shell, &mut pressed.shell) {
                    shell.rest(state);
                }
            }
            return Ok(ContactLoad::default());
        }
        Ok(self.balance(pressed))
    }

    /// Collects the rays that meet the object.
    fn collect_contacts(&self, bvh: &MeshBvh, x_wt: &Isometry3<f64>, pressed: &mut SkinState) {
        let SkinState { touches, vicinity, met, .. } = pressed;
        let (skipped_m, near) = self.patches.near(bvh, x_wt, vicinity);
        for (range, near) in near {
            for i in range.clone() {
                let sample = &self.samples[i];
                let outer_m = sample.layers.outer_m;
                let direction_w = x_wt.rotation * sample.direction;
                let start_w = x_wt * sample.start + direction_w.scale(skipped_m);
                let reach_m = outer_m + self.bulge_m - skipped_m;
                let hit = bvh.ray_near(near, met[i], &start_w, &direction_w, reach_m);
                if let Some(hit) = hit {
                    met[i] = Some(hit.triangle);
                    let slope = hit.normal.dot(&direction_w);
                    let facing = hit.normal * -slope.signum();
                    let indentation_m = outer_m - skipped_m - hit.distance_m;
                    let depth_m = outer_m - indentation_m;
                    touches.push(SkinContact {
                        sample: i,
                        point_t: sample.start + sample.direction.scale(depth_m),
                        section_m2: self.sections_m2[i],
                        gap_m: sample.layers.gap_m,
                        wet: sample.layers.has_fluid,
                        indentation_m,
                        normal_t: x_wt.rotation.inverse_transform_vector(&facing),
                        cosine: slope.abs().max(COSINE_MIN),
                        response: Default::default(),
                    });
                }
            }
        }
    }

    /// Solves for the columns' pressure, or for the shape of the shell.
    fn balance(&self, pressed: &mut SkinState) -> ContactLoad {
        let SkinState { touches, shell, inward_m, indentation_m, .. } = pressed;
        let balance = match (&self.shell, shell) {
            (Some(shell), Some(state)) => {
                shell.balance(touches, &self.samples, self.column(), state, inward_m)
            }
            _ => self.foundation.balance(touches, &self.samples, inward_m),
        };
        indentation_m.fill(0.0);
        let mut load = ContactLoad {
            pressure_pa: balance.pressure_pa,
            displaced_m3: balance.displaced_m3,
            energy_j: balance.energy_j,
            ..ContactLoad::default()
        };
        let (mut moment, mut weight_n) = (Vector3::zeros(), 0.0);
        for touch in touches.iter() {
            let (sample, response) = (&self.samples[touch.sample], &touch.response);
            indentation_m[touch.sample] = touch.indentation_m.max(0.0);
            load.energy_j += response.energy_j_m2 * touch.section_m2;
            if response.stress_pa <= 0.0 {
                continue;
            }
            let area_m2 = touch.section_m2 / touch.cosine;
            let force_n = touch.normal_t * (response.stress_pa * area_m2);
            load.force_n += force_n;
            load.torque_nm += touch.point_t.coords.cross(&force_n);
            load.area_m2 += area_m2;
            load.indentation_max_m = load.indentation_max_m.max(touch.indentation_m);
            load.is_core_loaded |= response.inward_m > sample.layers.gap_m;
            moment += touch.point_t.coords * force_n.norm();
            weight_n += force_n.norm();
        }
        if weight_n > 0.0 {
            load.centre_t = Point3::from(moment / weight_n);
            load.normal_t = load.force_n.try_normalize(0.0).unwrap_or_default();
        }
        load
    }
}
