// Beliefs of heights over a zone, decoded when they are first shown.
"use strict";

function frameOf(state) {
  const frame = data.planners[state.planner].frames[state.frame];
  if (typeof frame.mean === "string") {
    frame.mean = numbers(frame.mean, data.height_range);
    frame.deviation = deviations(frame.deviation);
    frame.band = frame.band.map((ends) => numbers(ends, data.height_range));
  }
  return frame;
}

// Decodes what is not of a frame.
function prepare() {
  data.truth = numbers(data.truth, data.height_range);
}

function viewOf(canvas) {
  return data.z ? reliefView(canvas) : curveView(canvas);
}
