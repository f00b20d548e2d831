// Controls of the interactive view: they set `state`, and a view draws it.
"use strict";

const explorer = document.getElementById("explorer");
const data = JSON.parse(document.getElementById("explorer-data").textContent);
const state = { planner: 0, frame: 0, colour: null, truth: false };

const bytes = (text) => Uint8Array.from(atob(text), (character) => character.charCodeAt(0));
const codes = (text) => new Uint16Array(bytes(text).buffer);

// Decodes numbers of sixteen bits between two ends; the highest code is null.
function numbers(text, [low, high]) {
  return Float32Array.from(codes(text), (code) => (code === 65535 ? NaN : low + (high - low) * code / 65534));
}

// Decodes numbers between the ends of the logarithm of their range.
function deviations(text) {
  const [low, high] = data.deviation_range;
  return Float32Array.from(codes(text), (code) => (code === 65535 ? NaN : low * Math.pow(high / low, code / 65534)));
}

// Page colours for light or dark paper; the data has a pair of each of its colours.
const dark = window.matchMedia("(prefers-color-scheme: dark)");
const paint = (name) => getComputedStyle(explorer).getPropertyValue(`--${name}`).trim();
const onPaper = (pair) => pair[dark.matches ? 1 : 0];
dark.addEventListener("change", () => draw());

// Returns about `aim` round numbers between two ends.
function roundNumbers(low, high, aim) {
  const rough = (high - low) / aim;
  const power = Math.pow(10, Math.floor(Math.log10(rough)));
  const step = [1, 2, 5, 10].map((digit) => digit * power).find((step) => step >= rough);
  const numbers = [];
  for (let i = Math.ceil(low / step - 1e-9); i * step <= high + 1e-9 * step; i++) numbers.push(i * step);
  return numbers;
}

// Formats a number as a label, with the minus sign of the printed figures.
function label(number) {
  return String(Number(number.toPrecision(6))).replace("-", "−");
}

// Sizes a canvas to its place on the page, in screen pixels; returns its context, scaled to page
// pixels.
function pen(canvas) {
  const ratio = window.devicePixelRatio || 1;
  const [width, height] = [canvas.clientWidth, canvas.clientHeight];
  canvas.width = Math.round(width * ratio);
  canvas.height = Math.round(height * ratio);
  const context = canvas.getContext("2d");
  context.scale(ratio, ratio);
  context.font = "12px system-ui, 'Segoe UI', Helvetica, Arial, sans-serif";
  context.lineJoin = context.lineCap = "round";
  return { context, width, height, ratio };
}

const canvas = explorer.querySelector("canvas");
const slider = explorer.querySelector("input[type=range]");
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
