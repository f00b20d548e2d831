//! The object as the convex hull of its mesh, as MuJoCo collides any mesh: every hollow is filled.

use super::{CONTACT, mesh};
use crate::world::World;

/// Asset and geom of the hull, which MuJoCo computes.
pub(super) fn obstacle(world: &World) -> Option<String> {
    let asset = mesh::asset(world.mesh()?, "object");
    Some(format!(
        r#"  <asset>{asset}</asset>
  <worldbody><geom name="object" type="mesh" mesh="object" {CONTACT}/></worldbody>
"#
    ))
}
