// Estimated surface of a whole object, to turn and to zoom.
"use strict";

function frameOf(state) {
  const frame = data.planners[state.planner].frames[state.frame];
  if (!frame.mesh) {
    frame.mesh = meshOf(frame);
    frame.deviation = deviations(frame.deviation);
    frame.error = frame.error === null ? null : numbers(frame.error, data.error_range);
  }
  return frame;
}

function viewOf(canvas) {
  // Initial view and direction of light (to the right, up and towards the viewer), as in the
  // printed figures, with more ambient light, so that colours are readable on a slope.
  const FIRST = { azimuth: 38, elevation: 24, zoom: 1 };
  const turn = { ...FIRST, isDragged: false };
  const [LIGHT, STRENGTH] = [[0.08, 0.17, 0.98], [0.45, 0.6]];
  // Opacity of the true surface in front of the belief, and the least distance for it, relative to
  // the size.
  const [OPACITY, LIFT] = [0.62, 0.004];
  const FOOT = 74;
  const truth = data.truth && meshOf(data.truth);
  const truthTints = truth && Uint8Array.from(truth.positions, (_, i) => data.colours.truth[i % 3]);
  const scales = {
    deviation: deviationScale(data.deviation_range),
    error: data.error_range && errorScale(data.error_range[1], "error: inside the true surface | outside"),
  };
  const paintAll = painter(() => window.draw());
  if (!paintAll) {
    explorer.classList.add("lacking");
    const words = "This view needs WebGL, which this browser does not provide; the figures do not.";
    canvas.insertAdjacentHTML("beforebegin", `<p class="notices">${words}</p>`);
  }

  // Returns the mapping from space to canvas: orthographic, with the same scale from every
  // direction.
  function camera(width, height) {
    const [a, e] = [turn.azimuth, turn.elevation].map((degrees) => degrees * Math.PI / 180);
    const [sa, ca, se, ce] = [Math.sin(a), Math.cos(a), Math.sin(e), Math.cos(e)];
    const rows = [[-ca, sa, 0], [-se * sa, -se * ca, ce], [sa * ce, ca * ce, se]];
    const middle = [width / 2, (height - FOOT) / 2];
    const scale = turn.zoom * Math.min(width, height - FOOT) / (2.06 * data.reach);
    const along = (row, p) => row[0] * p[0] + row[1] * p[1] + row[2] * p[2];
    return {
      rows, middle, scale,
      at: (p) => [middle[0] + scale * along(rows[0], p), middle[1] - scale * along(rows[1], p), along(rows[2], p)],
    };
  }

  // Draws the surface, and the true one in front of it if it is selected.
  function surface({ rows, middle, scale }, frame, values, [width, height, ratio], isTruthShown) {
    const tints = new Uint8Array(3 * values.length);
    const shown = scales[state.colour];
    values.forEach((value, i) => tints.set(colour(shown, shown.at(value)), 3 * i));
    const view = {
      width: Math.round(width * ratio), height: Math.round(height * ratio),
      turn: [0, 1, 2].flatMap((column) => rows.map((row) => row[column])),
      scale: [2 * scale / width, 2 * scale / height, -0.4 / data.reach],
      shift: [2 * middle[0] / width - 1, 1 - 2 * middle[1] / height, 0],
      light: LIGHT, strength: STRENGTH,
    };
    const over = isTruthShown && { mesh: truth, tints: truthTints, opacity: OPACITY, lift: 0.4 * LIFT };
    return paintAll(view, { mesh: frame.mesh, tints }, over);
  }

  // Returns whether the surface hides a point on it or behind it.
  function hider({ positions, indices }, at) {
    const corners = [];
    for (let i = 0; i < positions.length; i += 3) corners.push(at(positions.subarray(i, i + 3)));
    return ([x, y, depth]) => {
      const front = depth + 0.03 * data.reach;
      for (let i = 0; i < indices.length; i += 3) {
        const [a, b, c] = [corners[indices[i]], corners[indices[i + 1]], corners[indices[i + 2]]];
        if (a[2] < front && b[2] < front && c[2] < front) continue;
        const area = (b[0] - a[0]) * (c[1] - a[1]) - (c[0] - a[0]) * (b[1] - a[1]);
        const s = ((x - a[0]) * (c[1] - a[1]) - (c[0] - a[0]) * (y - a[1])) / area;
        const t = ((b[0] - a[0]) * (y - a[1]) - (x - a[0]) * (b[1] - a[1])) / area;
        if (s >= 0 && t >= 0 && s + t <= 1 && a[2] + s * (b[2] - a[2]) + t * (c[2] - a[2]) > front) return true;
      }
      return false;
    };
  }

  // Draws the path of the finger to its target, pale where the surface hides it.
  function drawArrow(context, { aim, along }, at, isHidden, ink) {
    const [PIECES, HEAD] = [40, 9];
    // It begins outside, farther from the middle than any point.
    const ahead = aim[0] * along[0] + aim[1] * along[1] + aim[2] * along[2];
    const square = aim[0] ** 2 + aim[1] ** 2 + aim[2] ** 2 - (1.2 * data.reach) ** 2;
    const length = Math.max(ahead + Math.sqrt(Math.max(ahead ** 2 - square, 0)), 0.3 * data.reach);
    const points = Array.from({ length: PIECES + 1 }, (_, i) => at(aim.map((part, axis) => part - length * (1 - i / PIECES) * along[axis])));
    const [from, to] = [points[0], points[PIECES]];
    const direction = Math.atan2(to[1] - from[1], to[0] - from[0]);
    context.strokeStyle = ink;
    context.lineWidth = 2;
    const line = (ends, isPale) => {
      context.globalAlpha = isPale ? 0.3 : 1;
      context.beginPath();
      ends.forEach(([x, y]) => context.lineTo(x, y));
      context.stroke();
    };
    for (let i = 0; i < PIECES; i++) line([points[i], points[i + 1]], isHidden(points[i + 1]));
    // Seen along its axis, it has no length.
    if (Math.hypot(to[0] - from[0], to[1] - from[1]) > HEAD) {
      const side = (angle) => [to[0] - HEAD * Math.cos(direction + angle), to[1] - HEAD * Math.sin(direction + angle)];
      line([side(0.45), to, side(-0.45)], isHidden(to));
    }
    context.globalAlpha = 1;
  }

  // Draws the axes of W and a scale bar of a round number of millimetres.
  function drawFrame(context, { rows, scale }, height) {
    const [ARM, x0, y0] = [26, 46, height - FOOT - 22];
    context.lineWidth = 1.5;
    context.strokeStyle = context.fillStyle = paint("faint");
    context.textAlign = "center";
    ["x", "y", "z"].forEach((name, axis) => {
      const [dx, dy] = [rows[0][axis], -rows[1][axis]];
      context.beginPath();
      context.moveTo(x0, y0);
      context.lineTo(x0 + ARM * dx, y0 + ARM * dy);
      context.stroke();
      context.fillText(name, x0 + (ARM + 9) * dx, y0 + (ARM + 9) * dy + 4);
    });
    const length = roundNumbers(0, 120 / scale, 3)[1];
    context.beginPath();
    context.moveTo(16, 15);
    context.lineTo(16, 20);
    context.lineTo(16 + length * scale, 20);
    context.lineTo(16 + length * scale, 15);
    context.stroke();
    context.fillText(`${label(length)} ${data.unit}`, 16 + length * scale / 2, 36);
  }

  function draw(state) {
    if (!paintAll) return;
    const { context, width, height, ratio } = pen(canvas);
    const frame = frameOf(state);
    const values = frame[state.colour] ?? new Float32Array(frame.deviation.length).fill(NaN);
    const eye = camera(width, height);
    const isHidden = hider(frame.mesh, eye.at);
    // At any zoom, the colour bar below stays visible.
    context.save();
    context.rect(0, 0, width, height - FOOT + 6);
    context.clip();
    context.drawImage(surface(eye, frame, values, [width, height, ratio], state.truth), 0, 0, width, height);
    const shown = data.planners[state.planner].touches.slice(0, frame.touches);
    shown.forEach((touch, i) => {
      const pair = touch.is_initial ? data.colours.initial : data.colours.later;
      const isLast = i === shown.length - 1;
      const point = eye.at(touch.contact ?? touch.aim);
      if (isLast) drawArrow(context, touch, eye.at, isHidden, onPaper(pair));
      const kind = touch.contact === null ? "miss" : isHidden(point) ? "hidden" : "seen";
      drawTouch(context, point, pair, kind, isLast);
    });
    context.restore();
    drawFrame(context, eye, height);
    drawColours(context, width, height, scales[state.colour]);
  }

  function turnBy(right, up) {
    turn.azimuth = (turn.azimuth + right) % 360;
    turn.elevation = Math.min(Math.max(turn.elevation + up, -90), 90);
    window.draw();
  }
  function zoomBy(factor) {
    turn.zoom = Math.min(Math.max(turn.zoom * factor, 0.5), 20);
    window.draw();
  }
  turnable(canvas, turn, turnBy);
  canvas.addEventListener("keydown", ({ key }) => {
    if (key === "+" || key === "=") zoomBy(1.2);
    if (key === "-" || key === "−") zoomBy(1 / 1.2);
    if (key === "0") {
      Object.assign(turn, FIRST);
      window.draw();
    }
  });
  // Scrolling the page does not zoom the view; a pinch on a touch pad is a wheel event with Ctrl.
  canvas.addEventListener("wheel", (event) => {
    if (!event.ctrlKey && document.activeElement !== canvas) return;
    event.preventDefault();
    zoomBy(Math.exp(-0.0015 * event.deltaY * (event.deltaMode === 1 ? 16 : 1)));
  }, { passive: false });
  const fingers = new Map();
  const spread = () => {
    const [[ax, ay], [bx, by]] = fingers.values();
    return Math.hypot(ax - bx, ay - by);
  };
  canvas.addEventListener("pointerdown", ({ pointerId, clientX, clientY }) => fingers.set(pointerId, [clientX, clientY]));
  canvas.addEventListener("lostpointercapture", ({ pointerId }) => fingers.delete(pointerId));
  canvas.addEventListener("pointermove", ({ pointerId, clientX, clientY }) => {
    if (!fingers.has(pointerId)) return;
    const before = fingers.size === 2 && spread();
    fingers.set(pointerId, [clientX, clientY]);
    if (before) zoomBy(spread() / before);
  });
  return draw;
}
