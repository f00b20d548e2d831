// Controls of the interactive view: they set `state`, and a view draws it.
"use strict";

const explorer = document.getElementById("explorer");
let data = JSON.parse(document.getElementById("explorer-data").textContent);
const state = { planner: 0, frame: 0, colour: null, truth: false };

const canvas = explorer.querySelector("canvas");
const slider = explorer.querySelector("input[type=range]");
prepare();
const view = viewOf(canvas);

let isDue = false;
function draw() {
  if (isDue) return;
  isDue = true;
  requestAnimationFrame(() => {
    isDue = false;
    view(state);
  });
}

// Returns the visible touches: the slider's count, or the nearest count of this planner.
function show(touches) {
  const { name, frames } = data.planners[state.planner];
  const later = frames.findIndex((frame) => frame.touches >= touches);
  state.frame = later < 0 ? frames.length - 1 : later;
  slider.max = frames.length - 1;
  slider.value = state.frame;
  const frame = frames[state.frame];
  const words = `${name} after ${frame.touches} ${frame.touches === 1 ? "touch" : "touches"}`;
  slider.setAttribute("aria-valuetext", words);
  explorer.querySelector("output").textContent = `${words}: ${frame.score}`;
  showBars(explorer.querySelector(".bars"), frame.hypotheses);
  canvas.setAttribute("aria-label", `The belief of ${words}`);
  draw();
}

const touches = () => data.planners[state.planner].frames[state.frame].touches;

slider.addEventListener("input", () => show(data.planners[state.planner].frames[slider.value].touches));
explorer.addEventListener("change", ({ target }) => {
  const shown = touches();
  if (target.name === "planner") state.planner = Number(target.value);
  if (target.name === "colour") state.colour = target.value;
  if (target.name === "truth") state.truth = target.checked;
  show(shown);
});

// Plays through the touches once; a second press stops.
const play = explorer.querySelector("button");
let timer = null;
function stop() {
  clearInterval(timer);
  timer = null;
  play.textContent = "Play";
}
play.addEventListener("click", () => {
  if (timer !== null) return stop();
  const { frames } = data.planners[state.planner];
  if (state.frame === frames.length - 1) show(0);
  play.textContent = "Stop";
  timer = setInterval(() => {
    const next = data.planners[state.planner].frames[state.frame + 1];
    if (next) show(next.touches);
    else stop();
  }, 160);
});

// Browsers restore inputs when a page is reloaded.
for (const input of explorer.querySelectorAll("input:checked")) {
  if (input.name === "planner") state.planner = Number(input.value);
  if (input.name === "colour") state.colour = input.value;
  if (input.name === "truth") state.truth = true;
}
new ResizeObserver(draw).observe(canvas);
show(data.planners[state.planner].frames[slider.value]?.touches ?? Infinity);
