//! Planner `pose_information`; see [`information`](super::information).

use super::information::{Goal, planner};
use super::plan::PlannerEntry;

pub(super) const ENTRY: PlannerEntry = PlannerEntry {
    name: "pose_information",
    about: "most expected information about the pose, with a library",
    zone_only: None,
    needs_library: true,
    plans_strokes: false,
    make: |settings, rng| planner(Goal::Pose, settings, rng),
};
