//! Scene → MJCF, the text a MuJoCo model is compiled from. Numbers are SI, in `W`.

mod fingertip;
mod height_field;
mod robot;
mod scenery;
mod text;

use super::collision::Collision;
use super::environment::Environment;
use super::scene::Scene;
use super::solver::Integrator;
use std::fmt::Write;
use text::{CONTACT, TABLE, list, mesh_asset};

/// Time step of a model that is only looked at; chosen, the period of the PA-10's servo.
const PICTURE_STEP_S: f64 = 0.002;

/// What a model is for.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Mode {
    /// To look at: everything in the scene.
    Picture,
    /// To step: what moves and nothing else. Shapes would cost time at every step, and contact is
    /// the skin's matter, not MuJoCo's; only a finger without a skin meets the object, as the
    /// scene's [`Collision`], and links whatever is in their way if the scene asks for that.
    Dynamic {
        /// Time step; the servos' gains are chosen for 2 ms and less.
        step_s: f64,
    },
}

/// What MuJoCo works out for `[effects.wrench]` alone.
const SENSOR: &str = r#"  <sensor>
    <force name="force" site="mount"/>
    <torque name="torque" site="mount"/>
  </sensor>
"#;

/// The scene as MJCF: the arm or stage at its home (keyframe `home`) with the finger on it, the
/// site `mount`, with a force/torque sensor if the scene has one, and `T` at the site `tip`; in a
/// picture also the object at its pose on a vertical board, the floor, a camera and lights. None
/// for a scene without a mesh, and for a stage that turns the finger, of which there is no model.
pub fn scene(environment: &Environment, mode: Mode) -> Option<String> {
    let mesh = environment.mesh()?;
    let chain = environment.chain()?;
    let has_model = match environment.scene().arm {
        Some(_) => environment.arm_mjcf().is_some(),
        None => !chain.turns(),
    };
    if !has_model {
        return None;
    }
    let shown = mode == Mode::Picture;
    let collides = !shown && environment.scene().collides();
    let bumps = !shown && environment.scene().effects.collision.is_some();
    let scenery = match shown {
        true => scenery::scenery(mesh, environment.task(), &chain),
        false if bumps => obstacle(environment)? + &table(environment.scene()),
        false if collides => obstacle(environment)?,
        false => String::new(),
    };
    let step_s = match mode {
        Mode::Picture => PICTURE_STEP_S,
        Mode::Dynamic { step_s } => step_s,
    };
    let is_soft = shown && environment.scene().effects.skin.is_some();
    let skin = match is_soft {
        true => format!("  <asset>{}</asset>\n", fingertip::assets(&environment.scene().finger)),
        false => String::new(),
    };
    let senses = environment.scene().effects.wrench.is_some();
    let mut text = String::new();
    // Writing to a String cannot fail. A diverging state must be seen, not reset in silence. One
    // arm is one island: to look for others costs a twentieth of a step.
    let _ = write!(
        text,
        r#"<mujoco model="palpate">
{robot}
  <compiler discardvisual="{discard}"/>
  <option timestep="{step_s}" integrator="{integrator}"><flag autoreset="disable" island="disable"/></option>
{sensor}  <keyframe><key name="home" qpos="{home}"/></keyframe>
{skin}{scenery}</mujoco>
"#,
        robot = robot::robot(
            environment.scene(),
            (&chain, environment.arm_mjcf()),
            (collides, bumps),
            is_soft,
        ),
        sensor = if senses { SENSOR } else { "" },
        discard = !shown,
        integrator = keyword(environment.scene().solver.integrator),
        home = list(chain.home.iter().take(chain.joints.len())),
    );
    Some(text)
}

/// What collides with a finger without skin.
fn obstacle(environment: &Environment) -> Option<String> {
    match environment.scene().solver.collision.unwrap_or_default() {
        Collision::HeightField => height_field::obstacle(environment),
        Collision::Hull => hull(environment),
        Collision::Sdf => sdf(environment),
    }
}

/// The object as the convex hull of its mesh, which MuJoCo computes: every hollow is filled.
fn hull(environment: &Environment) -> Option<String> {
    let asset = mesh_asset(environment.mesh()?, "object");
    Some(format!(
        r#"  <asset>{asset}</asset>
  <worldbody><geom name="object" type="mesh" mesh="object" {CONTACT}/></worldbody>
"#
    ))
}

/// The object as the signed distance field of its mesh, interpolated in MuJoCo's octree, with the
/// options of the search for contact.
fn sdf(environment: &Environment) -> Option<String> {
    let sdf = environment.scene().solver.sdf.clone().unwrap_or_default();
    let asset = mesh_asset(environment.mesh()?, "object");
    Some(format!(
        r#"  <option sdf_iterations="{}" sdf_initpoints="{}"/>
  <asset>{asset}</asset>
  <worldbody><geom name="object" type="sdf" mesh="object" {CONTACT}/></worldbody>
"#,
        sdf.iterations, sdf.initpoints,
    ))
}

/// The table of `[effects.collision]`.
fn table(scene: &Scene) -> String {
    let Some(collision) = &scene.effects.collision else { return String::new() };
    let place = list([0.0, 0.0, collision.table_m]);
    format!(
        r#"  <worldbody><geom name="table" type="plane" pos="{place}" size="3 3 .1" {TABLE}/></worldbody>
"#
    )
}

/// As MJCF spells it.
fn keyword(integrator: Integrator) -> &'static str {
    match integrator {
        Integrator::ImplicitFast => "implicitfast",
        Integrator::Implicit => "implicit",
        Integrator::Euler => "Euler",
        Integrator::Rk4 => "RK4",
    }
}
