//! What a body with the effect `collision` can bump into beside the object.

use super::text::{TABLE, list};
use crate::sim::Scene;

/// The table, and the pairs of links that are in each other wherever the joints stand.
pub(super) fn surroundings(scene: &Scene) -> String {
    let Some(collision) = &scene.effects.collision else { return String::new() };
    let place = list([0.0, 0.0, collision.table_m]);
    // The base stands still, and of such bodies MuJoCo keeps no neighbour away; the hand turns
    // between the tines of the forearm's fork.
    let apart = match scene.arm {
        Some(_) => {
            r#"
  <contact><exclude body1="base" body2="S1"/><exclude body1="E2" body2="W2"/></contact>"#
        }
        None => "",
    };
    format!(
        r#"  <worldbody><geom name="table" type="plane" pos="{place}" size="3 3 .1" {TABLE}/></worldbody>{apart}
"#
    )
}
