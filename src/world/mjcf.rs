//! Scene → MJCF, the text a MuJoCo model is compiled from.

use super::world::{Shape, World};
use nalgebra::{Point3, Vector3};
use std::fmt::Write;

/// Thickness of the board that the object is fixed to.
const BOARD_M: f64 = 0.02;

/// The scene as MJCF: the object at its pose on a vertical board, the finger's hull in front of
/// the zone's middle, a camera and lights. Numbers are SI, in `W`. None for a scene without a
/// mesh.
///
/// The object is drawn and does not collide: MuJoCo would collide its convex hull.
pub fn scene(world: &World) -> Option<String> {
    let Shape::Mesh { bvh, .. } = world.shape() else { return None };
    let mesh = bvh.mesh();
    let (low, high) = mesh.bounds();
    let middle = nalgebra::center(&low, &high);
    let half = (high - low) / 2.0;
    let finger = &world.scene().finger;
    let zone = &world.scene().zone;
    let mut tip = zone.point(&zone.at(&[0.5, 0.5]), 0.0);
    tip.y = high.y + 2.0 * finger.radius_m;
    let heel = tip + finger.axis_w();
    // MuJoCo refuses a capsule without length.
    let hull = match finger.length_m > 1e-9 {
        true => {
            format!(r#"type="capsule" fromto="{} {}""#, triple(&tip.coords), triple(&heel.coords))
        }
        false => format!(r#"type="sphere" pos="{}""#, triple(&tip.coords)),
    };
    let board = Point3::new(middle.x, low.y - BOARD_M / 2.0, middle.z);
    let camera = middle + Vector3::new(0.9, 2.2, 0.7) * (4.0 * half.norm());
    let mut vertices = String::new();
    for p in mesh.vertices() {
        // Writing to a String cannot fail.
        let _ = write!(vertices, "{} ", triple(&p.coords));
    }
    let mut faces = String::new();
    for [a, b, c] in mesh.triangles() {
        let _ = write!(faces, "{a} {b} {c} ");
    }
    let mut text = String::new();
    let _ = write!(
        text,
        r#"<mujoco model="palpate">
  <statistic center="{middle}" extent="{extent}"/>
  <visual><global offwidth="1280" offheight="960"/></visual>
  <default><geom contype="0" conaffinity="0"/></default>
  <asset>
    <mesh name="object" inertia="shell" vertex="{vertices}" face="{faces}"/>
    <texture name="sky" type="skybox" builtin="gradient" rgb1="1 1 1" rgb2=".6 .7 .8" width="64" height="64"/>
  </asset>
  <worldbody>
    <light pos="{light}" dir="-1 -2 -2" directional="true"/>
    <camera name="front" mode="targetbodycom" target="object" pos="{camera}"/>
    <body name="object">
      <geom name="object" type="mesh" mesh="object" rgba=".75 .75 .78 1"/>
    </body>
    <geom name="board" type="box" pos="{board}" size="{board_size}" rgba=".55 .45 .35 1"/>
    <body name="finger" mocap="true">
      <geom name="finger" {hull} size="{radius}" rgba=".2 .35 .6 1"/>
    </body>
  </worldbody>
</mujoco>
"#,
        middle = triple(&middle.coords),
        extent = 2.0 * half.norm(),
        light = triple(&camera.coords),
        camera = triple(&camera.coords),
        board = triple(&board.coords),
        board_size = triple(&Vector3::new(half.x + 0.05, BOARD_M / 2.0, half.z + 0.05)),
        radius = finger.radius_m,
    );
    Some(text)
}

fn triple(v: &Vector3<f64>) -> String {
    format!("{} {} {}", v.x, v.y, v.z)
}
