//! Believed whole objects, planner by planner and touch by touch.

use super::figure::Figure;
use crate::experiment::store::Run;
use crate::report::solid::figure;
use crate::report::whole;

/// The figure; none of a run over a zone.
pub const FIGURE: Figure = Figure {
    name: "solids",
    caption: |run| {
        format!(
            "Believed surfaces of trial {} from the front and from behind, coloured by how far they \
             may lie from where they are believed, with the touches.",
            run.experiment.report.trial
        )
    },
    draw,
};

fn draw(run: &Run) -> anyhow::Result<Option<String>> {
    if run.experiment.scene.around.is_none() {
        return Ok(None);
    }
    let counts = run.experiment.drawn_touch_counts();
    let truth = whole::truth(run);
    let sequences =
        whole::sequences(run, &run.experiment.drawn_planners(), &counts, truth.as_ref())?;
    let mesh = truth.as_ref().map(|bvh| &**bvh.mesh());
    figure(&sequences, mesh, &counts)
}
