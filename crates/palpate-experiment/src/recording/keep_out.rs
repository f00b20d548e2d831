//! Solids of a trial that arms of other programs avoid: the object up to the end of the band around
//! its believed surface, and the table.

use crate::simulation::Simulation;
use palpate_explore::backend::arm::KeepOutSolid;
use palpate_explore::backend::interlock::InterlockSettings;
use palpate_explore::belief::Belief;
use palpate_geometry::solids::box_mesh;

/// Name of the object's solid.
pub const OBJECT: &str = "palpate_object";
/// Name of the table's solid.
pub const TABLE: &str = "palpate_table";

/// Half of the side of a table without bounds, m.
// heuristic: an arm's reach.
const TABLE_M: f64 = 0.5;

/// Thickness of the table, and its distance from links that stand on it, m.
// heuristic: beyond a padding, and beyond the rounding of a model.
const THICKNESS_M: f64 = 0.05;
const GAP_M: f64 = 1e-3;

/// Returns the solids of a trial with this belief.
pub fn keep_out(simulation: &Simulation, belief: &Belief) -> Vec<KeepOutSolid> {
    let base_m = simulation.environment().chain().map(|chain| chain.base.translation.z);
    let table = table(&simulation.experiment().backend.interlocks, base_m);
    object(belief).into_iter().chain(table).collect()
}

/// Returns the solid that contains the object with the probability of the band, within the region;
/// before the first fit it fills the region. `None` for a zone without a depth.
pub fn object(belief: &Belief) -> Option<KeepOutSolid> {
    let (vertices_w, triangles) = belief.possible_solid()?;
    Some(KeepOutSolid { id: OBJECT, vertices_w, triangles })
}

/// Returns the bounds of the table in x and y, m: those of the workspace.
pub fn table_sides_m(interlocks: &InterlockSettings) -> [[f64; 2]; 2] {
    match interlocks.workspace_m {
        Some([x, y, _]) => [x, y],
        None => [[-TABLE_M, TABLE_M]; 2],
    }
}

/// Returns the table below the lowest height of the links. `None` if there is no limit, or the
/// base of the arm, which is `base_m` high, stands below it and would pass through the table.
pub fn table(interlocks: &InterlockSettings, base_m: Option<f64>) -> Option<KeepOutSolid> {
    let lowest_m = interlocks.lowest_m?;
    if base_m.is_some_and(|base_m| base_m < lowest_m) {
        return None;
    }
    let [x, y] = table_sides_m(interlocks);
    let high_m = lowest_m - GAP_M;
    let (vertices_w, triangles) =
        box_mesh([x[0], y[0], high_m - THICKNESS_M], [x[1], y[1], high_m]);
    Some(KeepOutSolid { id: TABLE, vertices_w, triangles })
}
