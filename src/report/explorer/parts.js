// Shared parts of the views of surfaces: numbers from text, labels, colour scales, marks of touches,
// turning by hand. A script that uses them has the element `explorer`, the `data` and `draw`;
// `SHADING` has the light and the first view of the printed figures.
"use strict";

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

function unitVector(v) {
  const length = Math.hypot(...v);
  return v.map((part) => part / length);
}

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

// Returns a function that writes a text at a place, unless it would overlap one before it.
function writer(context) {
  const boxes = [];
  return (text, x, y, align) => {
    const { width } = context.measureText(text);
    const left = x - width * { left: 0, center: 0.5, right: 1 }[align];
    const box = [left - 3, y - 9, left + width + 3, y + 2];
    if (boxes.some(([a, b, c, d]) => box[0] < c && a < box[2] && box[1] < d && b < box[3])) return;
    boxes.push(box);
    context.textAlign = align;
    context.fillText(text, x, y);
  };
}

// Colour scale: its stops, the position of a value from 0 to 1, values to label, words.
function deviationScale([least, most], words = "standard deviation σ") {
  const at = (value) => Math.log(value / least) / Math.log(most / least);
  const powers = Array.from({ length: 13 }, (_, i) => 10 ** (i - 6));
  const ticks = most < 10 * least ? roundNumbers(least, most, 5) : powers.flatMap((power) => [power, 3 * power]);
  return { stops: data.colours.deviation, at, ticks, words };
}

// Finer towards zero, so that early and late errors can be distinguished on one scale.
function errorScale(limit, words) {
  const fine = (value) => Math.asinh(value / (0.03 * limit));
  const at = (value) => 0.5 + 0.5 * fine(value) / fine(limit);
  const powers = [100, 10, 1, 0.1, 0.01].filter((power) => power > 0.02 * limit && power <= limit);
  // The first ones have room for their numbers.
  const ticks = [0, ...powers.flatMap((power) => [-3 * power, 3 * power, -power, power])];
  return { stops: data.colours.error, at, ticks, words };
}

function colour({ stops }, fraction) {
  if (Number.isNaN(fraction)) return [205, 205, 205];
  const place = Math.min(Math.max(fraction, 0), 1) * (stops.length - 1);
  const below = Math.min(Math.floor(place), stops.length - 2);
  return stops[below].map((from, i) => from + (place - below) * (stops[below + 1][i] - from));
}

function drawColours(context, width, height, scale) {
  if (!scale.words) return;
  // Without room beside the bar, the words are above it.
  const length = Math.min(320, width - 40);
  const isNarrow = width < 720;
  const [left, top] = [(width - length) / 2, height - 44];
  const bar = context.createLinearGradient(left, 0, left + length, 0);
  scale.stops.forEach((stop, i) => bar.addColorStop(i / (scale.stops.length - 1), `rgb(${stop.map(Math.round)})`));
  context.fillStyle = bar;
  context.fillRect(left, top, length, 12);
  context.fillStyle = paint("ink");
  context.textAlign = isNarrow ? "center" : "right";
  const [wordsX, wordsY] = isNarrow ? [width / 2, top - 8] : [left - 12, top + 11];
  context.fillText(`${scale.words} (${data.unit})`, wordsX, wordsY);
  const write = writer(context);
  for (const tick of scale.ticks) {
    const fraction = scale.at(tick);
    if (fraction < -1e-9 || fraction > 1 + 1e-9) continue;
    context.fillRect(left + fraction * length - 0.5, top + 12, 1, 4);
    write(label(tick), left + fraction * length, top + 29, "center");
  }
}

// Draws a touch: full if visible, hollow if hidden, a diamond for a miss.
function drawTouch(context, [x, y], pair, kind, isLast) {
  // Points lie on the surface, which is as pale on dark paper.
  const ink = kind === "miss" ? onPaper(pair) : pair[0];
  context.beginPath();
  if (kind === "miss") {
    const arm = isLast ? 7 : 5;
    [[-arm, 0], [0, -arm], [arm, 0], [0, arm], [-arm, 0]].forEach(([dx, dy]) => context.lineTo(x + dx, y + dy));
  } else {
    context.arc(x, y, isLast ? 6 : 4, 0, 7);
  }
  context.fillStyle = kind === "seen" ? ink : "rgba(255, 255, 255, .35)";
  context.strokeStyle = kind === "seen" ? "#fff" : ink;
  context.lineWidth = 1.3;
  if (kind !== "miss") context.fill();
  context.stroke();
}

// Draws a stroke from a dot at its begin, pale where the surface hides it.
function drawStroke(context, points, pair, isHidden, isLast) {
  context.globalAlpha = 1;
  for (const [ink, more] of [["#fff", 2.4], [pair[0], 0]]) {
    context.strokeStyle = context.fillStyle = ink;
    context.lineWidth = (isLast ? 3.6 : 2) + more;
    points.slice(1).forEach((to, i) => {
      context.globalAlpha = isHidden(to) ? 0.3 : 1;
      context.beginPath();
      context.moveTo(points[i][0], points[i][1]);
      context.lineTo(to[0], to[1]);
      context.stroke();
    });
    context.globalAlpha = isHidden(points[0]) ? 0.3 : 1;
    context.beginPath();
    context.arc(points[0][0], points[0][1], (isLast ? 4.4 : 3) + more / 2, 0, 7);
    context.fill();
  }
  context.globalAlpha = 1;
}

// Shows probabilities of objects as bars.
function showBars(list, hypotheses = []) {
  list.replaceChildren(...hypotheses.map(([name, share]) => {
    const item = document.createElement("li");
    const number = document.createElement("span");
    number.textContent = share.toFixed(2);
    item.append(name, " ", number);
    item.style.setProperty("--share", `${100 * share}%`);
    return item;
  }));
}

// Draws where the next touch will be.
function drawNext(context, [x, y]) {
  for (const [ink, width] of [[paint("paper"), 4.5], [paint("link"), 2]]) {
    context.strokeStyle = ink;
    context.lineWidth = width;
    context.beginPath();
    context.arc(x, y, 9, 0, 7);
    [[-14, 0, -5, 0], [5, 0, 14, 0], [0, -14, 0, -5], [0, 5, 0, 14]].forEach(([ax, ay, bx, by]) => {
      context.moveTo(x + ax, y + ay);
      context.lineTo(x + bx, y + by);
    });
    context.stroke();
  }
}

// Turns the view by dragging and by the arrow keys; `turn.isDragged` is true during a drag.
function turnable(canvas, turn, turnBy) {
  canvas.addEventListener("pointerdown", (event) => {
    turn.isDragged = true;
    canvas.setPointerCapture(event.pointerId);
  });
  canvas.addEventListener("pointermove", (event) => {
    if (turn.isDragged) turnBy(-0.4 * event.movementX, 0.4 * event.movementY);
  });
  canvas.addEventListener("lostpointercapture", () => {
    turn.isDragged = false;
    turnBy(0, 0);
  });
  canvas.addEventListener("keydown", (event) => {
    const by = { ArrowLeft: [5, 0], ArrowRight: [-5, 0], ArrowUp: [0, 5], ArrowDown: [0, -5] }[event.key];
    if (!by) return;
    event.preventDefault();
    turnBy(...by);
  });
}
