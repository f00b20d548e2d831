//! Scenery of a rendered scene: backing board of the object, floor, cameras, lights.

use super::text::{mesh_asset, pose};
use crate::arm_mjcf::list;
use nalgebra::{Isometry3, Point3, Translation3, Vector3};
use palpate_explore::robot::arm::Chain;
use palpate_explore::task::{Task, Zone};
use palpate_geometry::mesh::Mesh;

/// Thickness of the board that carries the object, and its margin around the object.
const BOARD_M: f64 = 0.02;
const RIM_M: f64 = 0.1;

/// Direction from the middle of the scene to the camera beside the finger, which also shows the
/// object's front.
const CAMERA_DIRECTION: Vector3<f64> = Vector3::new(1.08, 0.45, 0.36);

/// Returns the scenery with two cameras: `front` shows the object from the front and above, `whole`
/// shows the whole scene from beside the finger.
pub(super) fn scenery(mesh: &Mesh, task: &Task, chain: &Chain) -> String {
    // The board is behind the object, seen from the finger.
    let x_wz = task.zone().map_or_else(Isometry3::identity, Zone::x_wz);
    let (low, high) = mesh.transformed(&x_wz.inverse()).bounds();
    let middle_z = nalgebra::center(&low, &high);
    let half = (high - low) / 2.0;
    // An upright board reaches down to the floor; every board overlaps the object.
    let is_upright = (x_wz.rotation * Vector3::z()).z > 1.0 - 1e-9;
    let floor_z = if is_upright { -x_wz.translation.z } else { f64::INFINITY };
    let (foot_z, top_z) = ((low.z - RIM_M).min(floor_z), high.z + RIM_M);
    let board = Translation3::new(middle_z.x, low.y - BOARD_M / 2.0, (foot_z + top_z) / 2.0);
    let board_half_m = [half.x + RIM_M, BOARD_M / 2.0, (top_z - foot_z) / 2.0];
    // A whole object has a support from its lowest plane to the floor, or none.
    let (board, board_half_m) = match task.ball().map(|ball| ball.lowest_m) {
        None => (Some(board), board_half_m),
        Some(lowest_m) => {
            let height_m = lowest_m.filter(|lowest_m| *lowest_m > 0.0);
            let stand = height_m.map(|z_m| Translation3::new(middle_z.x, middle_z.y, z_m / 2.0));
            (stand, [half.x / 2.0, half.y / 2.0, height_m.unwrap_or(0.0) / 2.0])
        }
    };
    let board = board.map_or_else(String::new, |board| {
        format!(
            r#"<geom name="board" type="box" {} size="{}" material="wood"/>"#,
            pose(&(x_wz * board)),
            list(board_half_m)
        )
    });
    let middle = x_wz * middle_z;
    let front = middle + x_wz.rotation * Vector3::new(0.9, 2.2, 0.7) * (4.0 * half.norm());
    // From the robot's foot to the object, or the object alone if the stage carries the finger.
    let foot =
        if chain.has_revolute() { Point3::from(chain.base.translation.vector) } else { middle };
    let between = nalgebra::center(&foot, &middle) + Vector3::z() * (0.3 * (foot - middle).norm());
    let size = (foot - middle).norm() + 4.0 * half.norm();
    let whole = between + CAMERA_DIRECTION * size;
    // View direction of the viewer's free camera, which starts in the same place.
    let azimuth = (-CAMERA_DIRECTION.y).atan2(-CAMERA_DIRECTION.x).to_degrees();
    let elevation = (-CAMERA_DIRECTION.z).atan2(CAMERA_DIRECTION.xy().norm()).to_degrees();
    let asset = mesh_asset(mesh, "object");
    format!(
        r#"  <statistic center="{between}" extent="{size}"/>
  <visual>
    <global offwidth="1280" offheight="960" azimuth="{azimuth}" elevation="{elevation}"/>
    <headlight ambient=".45 .45 .45" diffuse=".25 .25 .25" specular="0 0 0"/>
    <quality shadowsize="8192" offsamples="8"/>
  </visual>
  <asset>
    {asset}
    <texture name="sky" type="skybox" builtin="gradient" rgb1="1 1 1" rgb2=".75 .8 .85" width="64" height="64"/>
    <texture name="tiles" type="2d" builtin="checker" rgb1=".86 .87 .87" rgb2=".82 .83 .83" width="256" height="256"/>
    <material name="tiles" texture="tiles" texrepeat="8 8" texuniform="true"/>
    <material name="porcelain" rgba=".95 .95 .93 1" specular=".6" shininess=".7"/>
    <material name="wood" rgba=".7 .55 .4 1"/>
  </asset>
  <worldbody>
    <light pos="{front}" dir="-1 -1.2 -2.5" directional="true" diffuse=".45 .45 .45" specular=".2 .2 .2"/>
    <body name="between" pos="{between}"/>
    <camera name="front" mode="targetbodycom" target="object" pos="{front}"/>
    <camera name="whole" mode="targetbody" target="between" pos="{whole}"/>
    <geom name="floor" type="plane" size="3 3 .1" material="tiles"/>
    <body name="object">
      <geom name="object" type="mesh" mesh="object" material="porcelain"/>
    </body>
    {board}
  </worldbody>
"#,
        front = list(front.iter()),
        between = list(between.iter()),
        whole = list(whole.iter()),
    )
}
