//! Conversion of a scene to MJCF, the text that MuJoCo compiles into a model. Numbers are in SI
//! units, in `W`.

mod robot;
mod scenery;
mod text;

use super::arm_mjcf::list;
use super::environment::{CLEARANCE_M, Environment, ObjectShape};
use super::scene::Scene;
use super::solver::{Collision, Integrator, Sdf};
use nalgebra::{Isometry3, Point3, Translation3, UnitQuaternion, Vector3};
use std::f64::consts::FRAC_PI_2;
use text::{CONTACT, TABLE, mesh_asset, pose};

// heuristic: time step of a model for viewing, the period of the PA-10's servo.
const PICTURE_STEP_S: f64 = 0.002;

/// Samples of the height field along each side. On the bird, 101 placed a finger's contact within
/// 0.004 mm in the median and 0.03 mm at most; 51 within 0.012 and 0.12 mm.
const PER_SIDE: usize = 101;

// heuristic: thickness of the ground under the lowest height.
const GROUND_M: f64 = 0.01;

/// Purpose of a model.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum ModelPurpose {
    /// Model for viewing: everything in the scene.
    Picture,
    /// Model for stepping: only the moving parts. Shapes would cost time at every step, and the
    /// contact force comes from the skin, not from MuJoCo. Only a finger without a skin collides
    /// with the object, as the scene's [`Collision`]; links collide with everything if the scene
    /// asks for it.
    Dynamic {
        /// Time step, s; the servo gains are tuned for 2 ms and less.
        step_s: f64,
    },
}

/// Sensors that MuJoCo computes only for `[effects.wrench]`.
const SENSOR: &str = r#"  <sensor>
    <force name="force" site="mount"/>
    <torque name="torque" site="mount"/>
  </sensor>
"#;

/// Returns the scene as MJCF: the arm or stage at its home (keyframe `home`) with the finger, the
/// site `mount`, with a force/torque sensor if the scene has one, and `T` at the site `tip`. A
/// picture also has the object at its pose on a vertical board, the floor, a camera and lights.
/// Returns `None` for a scene without a mesh, and for a stage that turns the finger, which has no
/// model.
pub fn scene(environment: &Environment, mode: ModelPurpose) -> Option<String> {
    let mesh = environment.mesh()?;
    let chain = environment.chain()?;
    let has_model = match environment.scene().arm {
        Some(_) => environment.arm_mjcf().is_some(),
        None => !chain.has_revolute(),
    };
    if !has_model {
        return None;
    }
    let shown = mode == ModelPurpose::Picture;
    let collides = !shown && environment.scene().collides();
    let bumps = !shown && environment.scene().effects.collision.is_some();
    let scenery = match shown {
        true => scenery::scenery(mesh, environment.task(), &chain),
        false if bumps => collision_geometry(environment)? + &table(environment.scene()),
        false if collides => collision_geometry(environment)?,
        false => String::new(),
    };
    let step_s = match mode {
        ModelPurpose::Picture => PICTURE_STEP_S,
        ModelPurpose::Dynamic { step_s } => step_s,
    };
    let is_soft = shown && environment.scene().effects.skin.is_some();
    let skin = match is_soft {
        true => format!("  <asset>{}</asset>\n", robot::skin_assets(&environment.scene().finger)),
        false => String::new(),
    };
    let senses = environment.scene().effects.wrench.is_some();
    // `autoreset` is off so that a diverging state is reported. `island` is off because one arm is
    // one island, and the search for others costs a twentieth of a step.
    Some(format!(
        r#"<mujoco model="palpate">
{robot}
  <compiler discardvisual="{discard}"/>
  <option timestep="{step_s}" integrator="{integrator}"><flag autoreset="disable" island="disable"/></option>
{sensor}  <keyframe><key name="home" qpos="{home}"/></keyframe>
{skin}{scenery}</mujoco>
"#,
        robot = robot::robot(
            environment.scene(),
            &chain,
            environment.arm_mjcf(),
            [collides, bumps],
            is_soft,
        ),
        sensor = if senses { SENSOR } else { "" },
        discard = !shown,
        integrator = keyword(environment.scene().solver.integrator),
        home = list(chain.home.iter().take(chain.joints.len())),
    ))
}

/// Returns the collision geometry for a finger without skin, with the options of the contact
/// search. It is a height field, the convex hull of the mesh (computed by MuJoCo, so every hollow
/// is filled), or its signed distance field (interpolated in MuJoCo's octree).
fn collision_geometry(environment: &Environment) -> Option<String> {
    let solver = &environment.scene().solver;
    let (kind, option) = match solver.collision.unwrap_or_default() {
        Collision::HeightField => return height_field(environment),
        Collision::Hull => ("mesh", String::new()),
        Collision::Sdf => {
            let Sdf { iterations, initpoints } = solver.sdf.clone().unwrap_or_default();
            let searched =
                format!(r#"sdf_iterations="{iterations}" sdf_initpoints="{initpoints}""#);
            ("sdf", format!("  <option {searched}/>\n"))
        }
    };
    let asset = mesh_asset(environment.mesh()?, "object");
    Some(format!(
        r#"{option}  <asset>{asset}</asset>
  <worldbody><geom name="object" type="{kind}" mesh="object" {CONTACT}/></worldbody>
"#
    ))
}

/// Returns the object as a height field over the zone. A surface explored along one direction is a
/// height field, and MuJoCo collides it without change. It has every surface point that the finger
/// can meet from targets in the zone; places where the approach meets nothing get the lowest
/// height.
fn height_field(environment: &Environment) -> Option<String> {
    let ObjectShape::Mesh { bvh, .. } = environment.shape() else { return None };
    let (scene, zone) = (environment.scene(), environment.task().zone()?);
    let margin_m = scene.finger.radius_m + scene.finger.length_m;
    let side = |[low, high]: [f64; 2]| [low - margin_m, high + margin_m];
    let (x_m, z_m) = (side(zone.x_m), side(zone.z_m.unwrap_or_default()));
    let at =
        |[low, high]: [f64; 2], i: usize| low + (high - low) * i as f64 / (PER_SIDE - 1) as f64;
    let x_wz = zone.x_wz();
    let ahead_w = zone.ahead_w();
    let [near_m, far_m] = environment.task().depth_m();
    let start_y_m = -near_m + CLEARANCE_M;
    let heights: Vec<Option<f64>> = (0..PER_SIDE * PER_SIDE)
        .map(|k| {
            let from_z = Point3::new(at(x_m, k % PER_SIDE), start_y_m, at(z_m, k / PER_SIDE));
            let way_m = start_y_m + far_m + CLEARANCE_M;
            let hit = bvh.ray(&(x_wz * from_z), &ahead_w, way_m);
            hit.map(|hit| x_wz.inverse_transform_point(&hit.point).y)
        })
        .collect();
    let lowest = heights.iter().flatten().copied().reduce(f64::min)?;
    let highest = heights.iter().flatten().copied().fold(lowest, f64::max);
    // MuJoCo stretches heights to 0..1 and refuses a field of constant height.
    let rise_m = (highest - lowest).max(1e-6);
    let values = heights.iter().map(|height| height.map_or(0.0, |y| (y - lowest) / rise_m));
    let half = |[low, high]: [f64; 2]| (high - low) / 2.0;
    let middle = |[low, high]: [f64; 2]| (high + low) / 2.0;
    // Rows of a field run against z and its heights along y: turned by −90° about x.
    let turned = UnitQuaternion::from_axis_angle(&Vector3::x_axis(), -FRAC_PI_2);
    let middle_z = Translation3::new(middle(x_m), lowest, middle(z_m));
    Some(format!(
        r#"  <asset><hfield name="object" nrow="{PER_SIDE}" ncol="{PER_SIDE}" size="{} {} {rise_m} {GROUND_M}" elevation="{}"/></asset>
  <worldbody><geom name="object" type="hfield" hfield="object" {} {CONTACT}/></worldbody>
"#,
        half(x_m),
        half(z_m),
        list(values),
        pose(&(x_wz * Isometry3::from_parts(middle_z, turned))),
    ))
}

/// Returns the table of `[effects.collision]`.
fn table(scene: &Scene) -> String {
    let Some(collision) = &scene.effects.collision else { return String::new() };
    let place = list([0.0, 0.0, collision.table_m]);
    format!(
        r#"  <worldbody><geom name="table" type="plane" pos="{place}" size="3 3 .1" {TABLE}/></worldbody>
"#
    )
}

/// Returns MuJoCo's keyword of an integrator.
fn keyword(integrator: Integrator) -> &'static str {
    match integrator {
        Integrator::ImplicitFast => "implicitfast",
        Integrator::Implicit => "implicit",
        Integrator::Euler => "Euler",
        Integrator::Rk4 => "RK4",
    }
}
