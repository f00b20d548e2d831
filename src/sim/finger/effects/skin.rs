//! The soft skin: an elastic foundation against the exact mesh, coupled by the fluid under it.

use super::effect::{Effect, Needs};
use crate::config::{Checked, Rules};
use crate::geometry::bvh::MeshBvh;
use crate::geometry::sweep::Capsule;
use crate::robot::finger::profile::Profile;
use crate::sim::finger::cavity;
use crate::sim::finger::cavity::SkinContact;
use crate::sim::finger::column::Column;
use crate::sim::finger::load::{Load, PressError};
use crate::sim::finger::samples::{SkinSample, spread};
use nalgebra::{Isometry3, Point3, Vector3};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::ops::Range;

/// A surface met at a flatter angle than this cosine counts as met at this one: a ray that grazes
/// stands for no more than five times its section (chosen).
const FLATTEST: f64 = 0.2;

/// The fluid pushes the free skin out by no more than this part of the hull's radius: how far
/// beyond the skin rays look (chosen; real skins bulge by 0.3 mm of 7).
const BULGE: f64 = 0.1;

/// The samples are culled in this many slabs along the finger times sectors around it (chosen).
const SLABS: usize = 8;
const SECTORS: usize = 8;

/// As long as nothing enters this part of the hull's radius around the axis, rays start there
/// instead of on the axis (chosen: inside the core).
const INNER: f64 = 0.5;

/// Table `[skin]`: an elastic foundation over the exact mesh.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct SkinEffect {
    /// Points of the skin.
    pub samples: usize,
    /// Modulus of the skin in compression between object and fluid, in Pa.
    pub modulus_pa: f64,
    /// Stiffness of the membrane against being flattened, in Pa per metre.
    pub flatten_pa_m: f64,
    /// Stiffness of the membrane against being blown up, in Pa per metre.
    pub inflate_pa_m: f64,
    /// Stiffness of the core and of the ridges inside the skin, once the gap is closed.
    pub core_pa_m: f64,
}

impl Default for SkinEffect {
    /// Modulus E: NVlabs/biotac_sim. Inflation: that of a thin-walled tube, E t / R², with the
    /// skin's thickness t = 1.6 mm and the sides' radius R = 7 mm. Flattening and core: fitted by
    /// `calibration` to the MiaoLi/syntouchcontact recordings of sensor F2 on a flat plate. The fit
    /// is flat: half or twice a value costs a few counts.
    fn default() -> Self {
        Self {
            samples: 500,
            modulus_pa: 1.552e6,
            flatten_pa_m: 3.5e6,
            inflate_pa_m: 5.07e7,
            core_pa_m: 1.4e9,
        }
    }
}

impl Checked for SkinEffect {
    fn check(&self, rules: &mut Rules) {
        rules.require("samples", self.samples, (10..=100_000).contains(&self.samples), || {
            "10 to 100000".into()
        });
        rules.number("modulus_pa", self.modulus_pa, 1e3..=1e9);
        rules.number("flatten_pa_m", self.flatten_pa_m, 1e3..=1e12);
        rules.number("inflate_pa_m", self.inflate_pa_m, 1e5..=1e12);
        rules.number("core_pa_m", self.core_pa_m, 1e3..=1e12);
    }
}

impl SkinEffect {
    /// The same of silicone `factor` times as stiff; the core stays.
    pub fn stiffened(&self, factor: f64) -> Self {
        Self {
            modulus_pa: factor * self.modulus_pa,
            flatten_pa_m: factor * self.flatten_pa_m,
            inflate_pa_m: factor * self.inflate_pa_m,
            ..self.clone()
        }
    }
}

impl Effect for SkinEffect {
    type State = ();

    const NEEDS: Needs = Needs::Nothing;

    fn start(&self) {}
}

/// A fingertip's skin; never changes.
#[derive(Clone, Debug)]
pub struct Skin {
    samples: Vec<SkinSample>,
    sections_m2: Vec<f64>,
    /// Section of all columns that stand in the fluid.
    wet_m2: f64,
    patches: Vec<Patch>,
    whole: Ball,
    inner: Capsule,
    column: Column,
    bulge_m: f64,
    /// Pressure per displaced volume, in Pa/m³; 0 without fluid.
    cavity_pa_m3: f64,
}

/// Neighbouring samples and a ball around their rays.
#[derive(Clone, Debug)]
struct Patch {
    range: Range<usize>,
    /// Around rays from the axis, and around rays from the inner capsule.
    from_axis: Ball,
    from_inner: Ball,
}

#[derive(Clone, Debug)]
struct Ball {
    centre: Point3<f64>,
    radius_m: f64,
}

/// One trial's memory for [`Skin::press`].
#[derive(Clone, Debug, Default)]
pub struct Pressed {
    touches: Vec<SkinContact>,
    /// How far the inner side of the skin moved in at each sample, in metres.
    pub inward_m: Vec<f64>,
    /// How far the object compresses each sample's column, in metres; 0 where it is not met.
    pub indentation_m: Vec<f64>,
}

impl Pressed {
    /// Bytes held.
    pub fn bytes(&self) -> usize {
        let numbers = self.inward_m.capacity() + self.indentation_m.capacity();
        self.touches.capacity() * size_of::<SkinContact>() + numbers * size_of::<f64>()
    }

    /// Whether no ray met anything: the skin is untouched and the fluid at rest.
    pub fn is_resting(&self) -> bool {
        self.touches.is_empty()
    }

    /// `inward_m`, or nothing while the skin rests.
    pub fn moved_m(&self) -> &[f64] {
        if self.is_resting() { &[] } else { &self.inward_m }
    }
}

impl Skin {
    /// A skin of this shape; `cavity_pa_m3` is the stiffness of the fluid, 0 for a dry finger.
    pub fn new(profile: &Profile, effect: &SkinEffect, cavity_pa_m3: f64) -> Self {
        let mut samples = spread(profile, effect.samples);
        let patch = |sample: &SkinSample| {
            let p = sample.point();
            let along = (p.x + profile.length_m) / (profile.length_m + profile.radius_m);
            let turn = (p.y.atan2(p.z) / std::f64::consts::TAU + 0.5) * SECTORS as f64;
            let slab = ((along * SLABS as f64).max(0.0) as usize).min(SLABS - 1);
            slab * SECTORS + (turn as usize).min(SECTORS - 1)
        };
        samples.sort_by_key(patch);
        let bulge_m = if cavity_pa_m3 > 0.0 { BULGE * profile.radius_m } else { 0.0 };
        let inner = Capsule {
            p0_w: Point3::origin(),
            p1_w: Point3::new(-profile.length_m, 0.0, 0.0),
            radius_m: INNER * profile.radius_m,
        };
        let mut patches = Vec::new();
        let mut first = 0;
        for group in samples.chunk_by(|a, b| patch(a) == patch(b)) {
            patches.push(Patch {
                range: first..first + group.len(),
                from_axis: Ball::around(group, 0.0, bulge_m),
                from_inner: Ball::around(group, inner.radius_m, bulge_m),
            });
            first += group.len();
        }
        let skin_m = samples.first().map_or(1.0, |sample| sample.layers.skin_m);
        let wet = samples.iter().filter(|sample| sample.layers.wet);
        Self {
            wet_m2: wet.map(SkinSample::section_m2).sum(),
            sections_m2: samples.iter().map(SkinSample::section_m2).collect(),
            whole: Ball::around(&samples, 0.0, bulge_m),
            inner,
            column: Column {
                skin_pa_m: effect.modulus_pa / skin_m,
                flatten_pa_m: effect.flatten_pa_m,
                inflate_pa_m: effect.inflate_pa_m,
                core_pa_m: effect.core_pa_m,
            },
            samples,
            patches,
            bulge_m,
            cavity_pa_m3,
        }
    }

    /// The points of the skin.
    pub fn samples(&self) -> &[SkinSample] {
        &self.samples
    }

    /// Bytes held.
    pub fn bytes(&self) -> usize {
        self.samples.len() * (size_of::<SkinSample>() + size_of::<f64>())
            + self.patches.len() * size_of::<Patch>()
    }

    /// The law of a column.
    pub fn column(&self) -> &Column {
        &self.column
    }

    /// Memory for [`press`](Self::press).
    pub fn relaxed(&self) -> Pressed {
        Pressed {
            touches: Vec::with_capacity(self.samples.len()),
            inward_m: vec![0.0; self.samples.len()],
            indentation_m: vec![0.0; self.samples.len()],
        }
    }

    /// Static equilibrium of the skin in pose `x_wt` against the object.
    ///
    /// The force is minus the gradient of [`Load::energy_j`] over the pose: each column presses
    /// along the object's normal n with its stress times section / cos(ray, n).
    ///
    /// # Errors
    /// If a pose is not finite, or the finger's axis is inside the object.
    pub fn press(
        &self,
        bvh: &MeshBvh,
        x_wt: &Isometry3<f64>,
        pressed: &mut Pressed,
    ) -> Result<Load, PressError> {
        if !x_wt.to_homogeneous().iter().all(|number| number.is_finite()) {
            return Err(PressError::NotFinite);
        }
        if bvh.surrounds(&x_wt.translation.vector.into()) {
            return Err(PressError::Inside);
        }
        let resting = pressed.is_resting();
        pressed.touches.clear();
        if self.whole.meets(bvh, x_wt) {
            self.meet(bvh, x_wt, &mut pressed.touches);
        }
        if pressed.is_resting() {
            if !resting {
                pressed.inward_m.fill(0.0);
                pressed.indentation_m.fill(0.0);
            }
            return Ok(Load::default());
        }
        Ok(self.balance(pressed))
    }

    /// Collects the rays that meet the object.
    fn meet(&self, bvh: &MeshBvh, x_wt: &Isometry3<f64>, touches: &mut Vec<SkinContact>) {
        let Capsule { p0_w, p1_w, radius_m } = self.inner;
        let deep = bvh.enters(&Capsule { p0_w: x_wt * p0_w, p1_w: x_wt * p1_w, radius_m });
        let skipped_m = if deep { 0.0 } else { radius_m };
        let near = self.patches.iter().filter(|patch| {
            let ball = if deep { &patch.from_axis } else { &patch.from_inner };
            ball.meets(bvh, x_wt)
        });
        for patch in near {
            for i in patch.range.clone() {
                let sample = &self.samples[i];
                let outer_m = sample.layers.outer_m;
                let direction_w = x_wt.rotation * sample.direction;
                let start_w = x_wt * sample.start + direction_w.scale(skipped_m);
                let hit = bvh.ray(&start_w, &direction_w, outer_m + self.bulge_m - skipped_m);
                if let Some(hit) = hit {
                    let slope = hit.normal.dot(&direction_w);
                    let facing = hit.normal * -slope.signum();
                    touches.push(SkinContact {
                        sample: i,
                        section_m2: self.sections_m2[i],
                        gap_m: sample.layers.gap_m,
                        wet: sample.layers.wet,
                        indentation_m: outer_m - skipped_m - hit.distance_m,
                        normal_t: x_wt.rotation.inverse_transform_vector(&facing),
                        cosine: slope.abs().max(FLATTEST),
                        response: Default::default(),
                    });
                }
            }
        }
    }

    /// Finds the pressure and adds up what the columns do.
    fn balance(&self, pressed: &mut Pressed) -> Load {
        let wet = pressed.touches.iter().filter(|touch| touch.wet);
        let free_m2 = self.wet_m2 - wet.map(|touch| touch.section_m2).sum::<f64>();
        let pressure_pa =
            cavity::balance(&mut pressed.touches, &self.column, free_m2, self.cavity_pa_m3);
        let free = self.column.respond(f64::NEG_INFINITY, 0.0, pressure_pa);
        for (inward_m, sample) in pressed.inward_m.iter_mut().zip(&self.samples) {
            *inward_m = if sample.layers.wet { free.inward_m } else { 0.0 };
        }
        pressed.indentation_m.fill(0.0);
        let mut load = Load { pressure_pa, ..Load::default() };
        load.energy_j = free.energy_j_m2 * free_m2;
        if self.cavity_pa_m3 > 0.0 {
            load.energy_j += 0.5 * pressure_pa * pressure_pa / self.cavity_pa_m3;
        }
        let mut moment = Vector3::zeros();
        let mut weight_n = 0.0;
        for touch in &pressed.touches {
            let (sample, response) = (&self.samples[touch.sample], &touch.response);
            pressed.inward_m[touch.sample] = response.inward_m;
            pressed.indentation_m[touch.sample] = touch.indentation_m.max(0.0);
            load.energy_j += response.energy_j_m2 * touch.section_m2;
            if sample.layers.wet {
                load.displaced_m3 += response.inward_m.max(0.0) * touch.section_m2;
            }
            if response.stress_pa <= 0.0 {
                continue;
            }
            let area_m2 = touch.section_m2 / touch.cosine;
            let force_n = touch.normal_t * (response.stress_pa * area_m2);
            let depth_m = sample.layers.outer_m - touch.indentation_m;
            let point = sample.start + sample.direction.scale(depth_m);
            load.force_n += force_n;
            load.torque_nm += point.coords.cross(&force_n);
            load.area_m2 += area_m2;
            load.indentation_max_m = load.indentation_max_m.max(touch.indentation_m);
            load.on_core |= response.inward_m > sample.layers.gap_m;
            moment += point.coords * force_n.norm();
            weight_n += force_n.norm();
        }
        if weight_n > 0.0 {
            load.centre_t = Point3::from(moment / weight_n);
            load.normal_t = load.force_n.try_normalize(0.0).unwrap_or_default();
        }
        load
    }
}

impl Ball {
    /// Around the rays of `samples`, from `from_m` off the axis to `bulge_m` above the skin.
    fn around(samples: &[SkinSample], from_m: f64, bulge_m: f64) -> Self {
        let ends = || {
            samples.iter().flat_map(|sample| {
                let to_m = sample.layers.outer_m + bulge_m;
                [from_m, to_m].map(|at_m| sample.start + sample.direction.scale(at_m))
            })
        };
        let sum: Vector3<f64> = ends().map(|end| end.coords).sum();
        let centre = Point3::from(sum / ends().count().max(1) as f64);
        let radius_m = ends().map(|end| (end - centre).norm()).fold(0.0, f64::max);
        Self { centre, radius_m }
    }

    fn meets(&self, bvh: &MeshBvh, x_wt: &Isometry3<f64>) -> bool {
        bvh.touches(&(x_wt * self.centre), self.radius_m)
    }
}
