//! The object as the signed distance field of its mesh, interpolated in MuJoCo's octree.

use super::mesh;
use super::text::CONTACT;
use crate::sim::Environment;

/// Options of the search for contact, asset and geom.
pub(super) fn obstacle(environment: &Environment) -> Option<String> {
    let sdf = environment.scene().solver.sdf.clone().unwrap_or_default();
    let asset = mesh::asset(environment.mesh()?, "object");
    Some(format!(
        r#"  <option sdf_iterations="{}" sdf_initpoints="{}"/>
  <asset>{asset}</asset>
  <worldbody><geom name="object" type="sdf" mesh="object" {CONTACT}/></worldbody>
"#,
        sdf.iterations, sdf.initpoints,
    ))
}
