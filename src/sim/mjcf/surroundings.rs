//! What a body with the effect `collision` can bump into beside the object.

use super::text::{TABLE, list};
use crate::sim::Scene;

/// The table.
pub(super) fn surroundings(scene: &Scene) -> String {
    let Some(collision) = &scene.effects.collision else { return String::new() };
    let place = list([0.0, 0.0, collision.table_m]);
    format!(
        r#"  <worldbody><geom name="table" type="plane" pos="{place}" size="3 3 .1" {TABLE}/></worldbody>
"#
    )
}
