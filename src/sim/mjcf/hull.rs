//! The object as the convex hull of its mesh, as MuJoCo collides any mesh: every hollow is filled.

use super::mesh;
use super::text::CONTACT;
use crate::sim::Environment;

/// Asset and geom of the hull, which MuJoCo computes.
pub(super) fn obstacle(environment: &Environment) -> Option<String> {
    let asset = mesh::asset(environment.mesh()?, "object");
    Some(format!(
        r#"  <asset>{asset}</asset>
  <worldbody><geom name="object" type="mesh" mesh="object" {CONTACT}/></worldbody>
"#
    ))
}
