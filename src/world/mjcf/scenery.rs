//! What stands around: the object on its board, the floor, the camera, the lights.

use super::list;
use crate::ground::geometry::mesh::Mesh;
use nalgebra::{Point3, Vector3};
use std::fmt::Write;

/// Thickness of the board that the object is fixed to.
const BOARD_M: f64 = 0.02;

pub(super) fn scenery(mesh: &Mesh) -> String {
    let (low, high) = mesh.bounds();
    let middle = nalgebra::center(&low, &high);
    let half = (high - low) / 2.0;
    let board = Point3::new(middle.x, low.y - BOARD_M / 2.0, middle.z);
    // Beside the arm and looking back at the object.
    let camera = middle + Vector3::new(0.9, 2.2, 0.7) * (4.0 * half.norm());
    let mut vertices = String::new();
    for p in mesh.vertices() {
        // Writing to a String cannot fail.
        let _ = write!(vertices, "{} {} {} ", p.x, p.y, p.z);
    }
    let mut faces = String::new();
    for [a, b, c] in mesh.triangles() {
        let _ = write!(faces, "{a} {b} {c} ");
    }
    format!(
        r#"  <statistic center="{middle}" extent="{extent}"/>
  <visual><global offwidth="1280" offheight="960"/></visual>
  <asset>
    <mesh name="object" inertia="shell" vertex="{vertices}" face="{faces}"/>
    <texture name="sky" type="skybox" builtin="gradient" rgb1="1 1 1" rgb2=".6 .7 .8" width="64" height="64"/>
  </asset>
  <worldbody>
    <light pos="{camera}" dir="-1 -2 -2" directional="true"/>
    <camera name="front" mode="targetbodycom" target="object" pos="{camera}"/>
    <geom name="floor" type="plane" size="2 2 .1" rgba=".9 .9 .88 1"/>
    <body name="object">
      <geom name="object" type="mesh" mesh="object" rgba=".75 .75 .78 1"/>
    </body>
    <geom name="board" type="box" pos="{board}" size="{board_size}" rgba=".55 .45 .35 1"/>
  </worldbody>
"#,
        middle = list(middle.iter()),
        extent = 2.0 * half.norm(),
        camera = list(camera.iter()),
        board = list(board.iter()),
        board_size = list([half.x + 0.05, BOARD_M / 2.0, half.z + 0.05]),
    )
}
