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

// Decodes what is not of a frame: nothing.
function prepare() {}

function viewOf(canvas) {
  const FIRST = { azimuth: SHADING.azimuth_deg, elevation: SHADING.elevation_deg, zoom: 1 };
  const turn = { ...FIRST, isDragged: false };
  // Direction of the light to the right, up and towards the viewer.
  const LIGHT = axes(FIRST).map((row) => dot(row, unitVector(SHADING.light)));
  // Opacity of the true surface in front of the belief, and the least distance for it, relative to
  // the size.
  const [OPACITY, LIFT, VEIL] = [0.62, 0.004, 0.4];
  const FOOT = 74;
  let known, truth, truthTints, scales;
  const paintAll = painter(() => window.draw());
  if (!paintAll) {
    explorer.classList.add("lacking");
    const words = "This view needs WebGL, which this browser does not provide; the figures do not.";
    canvas.insertAdjacentHTML("beforebegin", `<p class="notices">${words}</p>`);
  }

  // Takes the present data.
  function take() {
    if (known === data) return;
    known = data;
    truth = data.truth && meshOf(data.truth);
    truthTints = truth && Uint8Array.from(truth.positions, (_, i) => data.colours.truth[i % 3]);
    scales = {
      plain: { stops: data.colours.height, at: () => 0.6, ticks: [] },
      deviation: deviationScale(data.deviation_range),
      error: data.error_range && errorScale(data.error_range[1], "error: inside the true surface | outside"),
    };
  }

  // Returns the directions to the right, up and towards the viewer.
  function axes({ azimuth, elevation }) {
    const [a, e] = [azimuth, elevation].map((degrees) => degrees * Math.PI / 180);
    const [sa, ca, se, ce] = [Math.sin(a), Math.cos(a), Math.sin(e), Math.cos(e)];
    return [[-ca, sa, 0], [-se * sa, -se * ca, ce], [sa * ce, ca * ce, se]];
  }

  function dot(row, p) {
    return row[0] * p[0] + row[1] * p[1] + row[2] * p[2];
  }

  // Returns the mapping from space to canvas: orthographic, with the same scale from every
  // direction.
  function camera(width, height) {
    const rows = axes(turn);
    const middle = [width / 2, (height - FOOT) / 2];
    const scale = turn.zoom * Math.min(width, height - FOOT) / (2.06 * data.reach);
    return {
      rows, middle, scale,
      at: (p) => [middle[0] + scale * dot(rows[0], p), middle[1] - scale * dot(rows[1], p), dot(rows[2], p)],
    };
  }

  // Draws the surface coloured by `shown`, and the true one in front of it if it is selected.
  function surface({ rows, middle, scale }, frame, [shown, values], [width, height, ratio], isTruthShown) {
    if (frame.painted !== shown) {
      frame.painted = shown;
      frame.tints = new Uint8Array(3 * values.length);
      values.forEach((value, i) => frame.tints.set(colour(shown, shown.at(value)), 3 * i));
    }
    const { tints } = frame;
    const view = {
      width: Math.round(width * ratio), height: Math.round(height * ratio),
      turn: [0, 1, 2].flatMap((column) => rows.map((row) => row[column])),
      scale: [2 * scale / width, 2 * scale / height, -0.4 / data.reach],
      shift: [2 * middle[0] / width - 1, 1 - 2 * middle[1] / height, 0],
      light: LIGHT, ambient: SHADING.ambient,
    };
    // The true object is a veil over the whole of a recognised one.
    const [opacity, lift] = frame.hypotheses.length ? [VEIL, -0.5] : [OPACITY, 0.4 * LIFT];
    const over = isTruthShown && { mesh: truth, tints: truthTints, opacity, lift };
    return paintAll(view, { mesh: frame.mesh, tints }, over);
  }

  // Returns a function that tells whether the surface hides a point on it or behind it. Triangles are
  // sorted into cells of the canvas, so that a point is compared with few.
  function hider({ positions, indices }, at) {
    const CELL = 16;
    const corners = [];
    for (let i = 0; i < positions.length; i += 3) corners.push(at(positions.subarray(i, i + 3)));
    const cells = new Map();
    const cellOf = (x, y) => 65536 * Math.floor(y / CELL) + Math.floor(x / CELL);
    const span = (a, b, c) => [Math.floor(Math.min(a, b, c) / CELL), Math.floor(Math.max(a, b, c) / CELL)];
    for (let i = 0; i < indices.length; i += 3) {
      const [a, b, c] = [corners[indices[i]], corners[indices[i + 1]], corners[indices[i + 2]]];
      const [[left, right], [top, bottom]] = [0, 1].map((axis) => span(a[axis], b[axis], c[axis]));
      for (let row = top; row <= bottom; row++) {
        for (let column = left; column <= right; column++) {
          const cell = 65536 * row + column;
          if (cells.has(cell)) cells.get(cell).push(i);
          else cells.set(cell, [i]);
        }
      }
    }
    return ([x, y, depth]) => {
      const front = depth + 0.03 * data.reach;
      return (cells.get(cellOf(x, y)) ?? []).some((i) => {
        const [a, b, c] = [corners[indices[i]], corners[indices[i + 1]], corners[indices[i + 2]]];
        if (a[2] < front && b[2] < front && c[2] < front) return false;
        const area = (b[0] - a[0]) * (c[1] - a[1]) - (c[0] - a[0]) * (b[1] - a[1]);
        const s = ((x - a[0]) * (c[1] - a[1]) - (c[0] - a[0]) * (y - a[1])) / area;
        const t = ((b[0] - a[0]) * (y - a[1]) - (x - a[0]) * (b[1] - a[1])) / area;
        return s >= 0 && t >= 0 && s + t <= 1 && a[2] + s * (b[2] - a[2]) + t * (c[2] - a[2]) > front;
      });
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
    take();
    const { context, width, height, ratio } = pen(canvas);
    const frame = frameOf(state);
    const values = frame[state.colour] ?? frame.deviation.map(() => NaN);
    const eye = camera(width, height);
    const isHidden = hider(frame.mesh, eye.at);
    // At any zoom, the colour bar below stays visible.
    context.save();
    context.rect(0, 0, width, height - FOOT + 6);
    context.clip();
    // Coarser while it is dragged, because a browser without a graphics card takes 30 ms for all pixels.
    const dense = turn.isDragged ? 0.6 * ratio : ratio;
    context.drawImage(surface(eye, frame, [scales[state.colour], values], [width, height, dense], state.truth), 0, 0, width, height);
    const shown = data.planners[state.planner].touches.slice(0, frame.touches);
    shown.forEach((touch, i) => {
      const pair = touch.is_initial ? data.colours.initial : data.colours.later;
      const isLast = i === shown.length - 1;
      const point = eye.at(touch.contact ?? touch.aim);
      if (isLast) drawArrow(context, touch, eye.at, isHidden, onPaper(pair));
      if (touch.path.length) return drawStroke(context, touch.path.map(eye.at), pair, isHidden, isLast);
      const kind = touch.contact === null ? "miss" : isHidden(point) ? "hidden" : "seen";
      drawTouch(context, point, pair, kind, isLast);
    });
    if (state.next) drawArrow(context, state.next, eye.at, isHidden, paint("link"));
    context.restore();
    drawFrame(context, eye, height);
    drawColours(context, width, height, scales[state.colour]);
    draw.pick = (x, y) => pick(frame.mesh, eye.at, x, y);
  }

  // Returns the front of the surface at a point of the canvas, from the middle of everything, and
  // the direction against its normal; null beside it.
  function pick({ positions, indices, normals }, at, px, py) {
    let best = null;
    for (let i = 0; i < indices.length; i += 3) {
      const corners = [0, 1, 2].map((corner) => 3 * indices[i + corner]);
      const [a, b, c] = corners.map((start) => at(positions.subarray(start, start + 3)));
      const area = (b[0] - a[0]) * (c[1] - a[1]) - (c[0] - a[0]) * (b[1] - a[1]);
      const s = ((px - a[0]) * (c[1] - a[1]) - (c[0] - a[0]) * (py - a[1])) / area;
      const t = ((b[0] - a[0]) * (py - a[1]) - (px - a[0]) * (b[1] - a[1])) / area;
      const depth = a[2] + s * (b[2] - a[2]) + t * (c[2] - a[2]);
      if (!(s >= 0 && t >= 0 && s + t <= 1) || best && depth <= best.depth) continue;
      const mean = (values, axis) => (1 - s - t) * values[corners[0] + axis] + s * values[corners[1] + axis] + t * values[corners[2] + axis];
      const aim = [0, 1, 2].map((axis) => mean(positions, axis));
      const normal = [0, 1, 2].map((axis) => mean(normals, axis));
      best = { depth, aim, along: normal.map((part) => -part / Math.hypot(...normal)) };
    }
    return best && { aim: best.aim, along: best.along };
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
