// Shared parts of the views of surfaces: colour scales, marks of touches, turning by hand.
"use strict";

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
  const powers = [0.01, 0.1, 1, 10, 100].filter((power) => power > 0.02 * limit && power <= limit);
  const ticks = [...powers.flatMap((power) => [-3 * power, -power, power, 3 * power]), 0];
  return { stops: data.colours.error, at, ticks, words };
}

function colour({ stops }, fraction) {
  if (Number.isNaN(fraction)) return [205, 205, 205];
  const place = Math.min(Math.max(fraction, 0), 1) * (stops.length - 1);
  const below = Math.min(Math.floor(place), stops.length - 2);
  return stops[below].map((from, i) => from + (place - below) * (stops[below + 1][i] - from));
}

function drawColours(context, width, height, scale) {
  // Without room beside the bar, the words are above it.
  const length = Math.min(320, width - 40);
  const isNarrow = width < 720;
  const [left, top] = [(width - length) / 2, height - 44];
  for (let i = 0; i < length; i++) {
    context.fillStyle = `rgb(${colour(scale, i / (length - 1)).map(Math.round)})`;
    context.fillRect(left + i, top, 1.5, 12);
  }
  context.fillStyle = paint("ink");
  context.textAlign = isNarrow ? "center" : "right";
  const [wordsX, wordsY] = isNarrow ? [width / 2, top - 8] : [left - 12, top + 11];
  context.fillText(`${scale.words} (${data.unit})`, wordsX, wordsY);
  context.textAlign = "center";
  for (const tick of scale.ticks) {
    const fraction = scale.at(tick);
    if (fraction < -1e-9 || fraction > 1 + 1e-9) continue;
    context.fillRect(left + fraction * length - 0.5, top + 12, 1, 4);
    context.fillText(label(tick), left + fraction * length, top + 29);
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
