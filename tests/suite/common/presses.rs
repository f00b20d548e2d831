//! Presses of a soft finger on a shape, by its foundation or its shell of finite elements.

use nalgebra::{Isometry3, Point3, UnitQuaternion, Vector3};
use palpate::backend::Fault;
use palpate::geometry::bvh::MeshBvh;
use palpate::geometry::mesh::Mesh;
use palpate::math::seed::stream;
use palpate::robot::finger::TipMotion;
use palpate::robot::finger::frame::ELECTRODES;
use palpate::robot::finger::profile::Profile;
use palpate::sim::environment::Shape;
use palpate::sim::finger::effects::flex::FlexEffect;
use palpate::sim::finger::effects::skin::SkinEffect;
use palpate::sim::finger::samples::spread;
use palpate::sim::finger::{Effects, FingertipState, Load};
use palpate::sim::mujoco::FlexShell;
use palpate::sim::scene::Body;
use palpate::sim::simulated_finger::Shell;
use palpate::sim::{Environment, Scene};
use std::path::Path;
use std::sync::Arc;
use std::time::Instant;

const APPROACH_M_S: f64 = 0.01;
const TICK_S: f64 = 1e-3;
/// The finger begins this far in front of the shape.
const BEFORE_M: f64 = 3e-4;
/// It rests this long before it is read; the shell's slowest motion has died away then.
const REST_S: f64 = 0.1;

/// A finger with a shell of this resolution, with fluid and electrodes without noise.
pub fn shell(along: usize, around: usize) -> Effects {
    quiet(Effects {
        flex: Some(FlexEffect { along, around, ..FlexEffect::default() }),
        ..Effects::default()
    })
}

/// A finger with an elastic foundation of so many points, and the same sensors.
pub fn foundation(samples: usize) -> Effects {
    quiet(Effects {
        skin: Some(SkinEffect { samples, ..SkinEffect::default() }),
        ..Effects::default()
    })
}

fn quiet(mut effects: Effects) -> Effects {
    let electrodes = effects.electrodes.get_or_insert_default();
    (electrodes.noise, electrodes.drift_counts, electrodes.quantise) = (0.0, 0.0, false);
    let fluid = effects.fluid.get_or_insert_default();
    (fluid.noise_counts, fluid.quantise) = (0.0, false);
    effects
}

/// A plane across y at y = 0, facing the finger.
pub fn wall() -> Mesh {
    let corner = |x: f64, z: f64| Point3::new(0.1 * x, 0.0, 0.1 * z);
    let corners = [corner(-1.0, -1.0), corner(-1.0, 1.0), corner(1.0, 1.0), corner(1.0, -1.0)];
    Mesh::new(&corners, &[[0, 1, 2], [0, 2, 3]]).unwrap().0
}

/// Around a shape whose foremost point towards +y is the origin; the finger's axis rises by
/// `pitch_deg` from the way it goes.
pub fn environment(effects: Effects, mesh: Mesh, pitch_deg: f64) -> Arc<Environment> {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes/container_finger.toml");
    let mut scene = Scene::load(&path, &["zone.x_m=[-0.02,0.02]".into()]).unwrap();
    scene.zone.as_mut().unwrap().z_m = Some([-0.02, 0.02]);
    scene.zone.as_mut().unwrap().datum_y_m = Some(0.0);
    scene.body = Body::Dynamic;
    scene.finger.pitch_deg = pitch_deg;
    scene.effects = effects;
    let shape = Shape::Mesh { bvh: MeshBvh::new(mesh), report: Box::default() };
    Arc::new(Environment::around(scene, shape).unwrap())
}

/// What a press brought.
pub struct Press {
    pub load: Load,
    /// Change of each electrode.
    pub counts: [f64; ELECTRODES],
    pub wall_s: f64,
    pub simulated_s: f64,
}

/// Pressed `depth_m` deep with the skin's foremost point on the shape's, read at rest.
pub fn press(environment: &Arc<Environment>, depth_m: f64) -> Result<Press, Fault> {
    press_from(environment, depth_m, &Vector3::zeros())
}

/// The same `aside_w` of it.
pub fn press_from(
    environment: &Arc<Environment>,
    depth_m: f64,
    aside_w: &Vector3<f64>,
) -> Result<Press, Fault> {
    let Shape::Mesh { bvh, .. } = environment.shape() else { panic!("no mesh") };
    let (tip, finger) = (environment.fingertip().unwrap(), &environment.scene().finger);
    let rotation: UnitQuaternion<f64> = finger.r_at();
    let skin = spread(&Profile::biotac(finger), 16_000);
    let points = skin.iter().map(|sample| rotation * sample.point().coords);
    let front = points.min_by(|a, b| a.y.total_cmp(&b.y)).unwrap();
    // The skin is symmetric: what is foremost lies in its middle.
    let front = Vector3::new(0.0, front.y, front.z);
    let mut flex = FlexShell::model(environment).unwrap().map(|model| {
        let mut flex = FlexShell::new(Arc::clone(environment), model).unwrap();
        flex.reset();
        flex
    });
    let mut feel = FingertipState::new(tip, &stream(0, 0, "finger"));
    let steps = ((BEFORE_M + depth_m) / (APPROACH_M_S * TICK_S)).ceil();
    let rests = (REST_S / TICK_S) as usize;
    let mut load = Load::default();
    let (mut tare, mut last) = (None, [0.0; ELECTRODES]);
    let begun = Instant::now();
    for i in 0..=steps as usize + rests {
        let part = (i as f64 / steps).min(1.0);
        let y_m = BEFORE_M - part * (BEFORE_M + depth_m);
        let p_wt = aside_w + Vector3::y() * y_m - front;
        let motion = TipMotion::at(Isometry3::from_parts(p_wt.into(), rotation));
        load = match &mut flex {
            Some(flex) => feel.step_loaded(tip, flex.step(&motion.x_wt, TICK_S)?, &motion, TICK_S),
            None => feel.step(tip, bvh, &motion, TICK_S),
        }
        .unwrap();
        while let Some(frame) = feel.frame() {
            last = frame.electrode_counts.unwrap();
            tare.get_or_insert(last);
        }
    }
    let tare = tare.unwrap();
    Ok(Press {
        load,
        counts: std::array::from_fn(|i| last[i] - tare[i]),
        wall_s: begun.elapsed().as_secs_f64(),
        simulated_s: (steps + rests as f64) * TICK_S,
    })
}
