//! What stands around: the object on its board, the floor, the camera, the lights.

use super::list;
use super::mesh::asset;
use crate::ground::geometry::mesh::Mesh;
use crate::things::arm::Chain;
use nalgebra::{Point3, Vector3};

/// Thickness of the board that the object is fixed to.
const BOARD_M: f64 = 0.02;

/// Two cameras: `front` sees the object from in front and above, `whole` from beside the finger
/// all there is.
pub(super) fn scenery(mesh: &Mesh, chain: &Chain) -> String {
    let (low, high) = mesh.bounds();
    let middle = nalgebra::center(&low, &high);
    let half = (high - low) / 2.0;
    // The board stands on the floor and overlaps the object.
    let (foot_z, top_z) = ((low.z - 0.05).min(0.0), high.z + 0.05);
    let board = Point3::new(middle.x, low.y - BOARD_M / 2.0, (foot_z + top_z) / 2.0);
    let front = middle + Vector3::new(0.9, 2.2, 0.7) * (4.0 * half.norm());
    // From the robot's foot to the object, or the object alone if the stage carries the finger.
    let foot = if chain.turns() { Point3::from(chain.base.translation.vector) } else { middle };
    let between = nalgebra::center(&foot, &middle) + Vector3::z() * (0.3 * (foot - middle).norm());
    let size = (foot - middle).norm() + 4.0 * half.norm();
    let whole = between + Vector3::new(1.15, 0.3, 0.4) * size;
    let asset = asset(mesh, "object");
    format!(
        r#"  <statistic center="{between}" extent="{size}"/>
  <visual><global offwidth="1280" offheight="960"/><quality shadowsize="8192" offsamples="8"/></visual>
  <asset>
    {asset}
    <texture name="sky" type="skybox" builtin="gradient" rgb1="1 1 1" rgb2=".6 .7 .8" width="64" height="64"/>
  </asset>
  <worldbody>
    <light pos="{front}" dir="-1 -2 -2" directional="true"/>
    <body name="between" pos="{between}"/>
    <camera name="front" mode="targetbodycom" target="object" pos="{front}"/>
    <camera name="whole" mode="targetbody" target="between" pos="{whole}"/>
    <geom name="floor" type="plane" size="2 2 .1" rgba=".9 .9 .88 1"/>
    <body name="object">
      <geom name="object" type="mesh" mesh="object" rgba=".75 .75 .78 1"/>
    </body>
    <geom name="board" type="box" pos="{board}" size="{board_size}" rgba=".55 .45 .35 1"/>
  </worldbody>
"#,
        front = list(front.iter()),
        between = list(between.iter()),
        whole = list(whole.iter()),
        board = list(board.iter()),
        board_size = list([half.x + 0.05, BOARD_M / 2.0, (top_z - foot_z) / 2.0]),
    )
}
