// Height field in three dimensions. Every pixel is coloured here with a depth buffer, which needs
// neither WebGL nor a library and looks the same on every machine.
"use strict";

function reliefView(canvas) {
  const turn = { azimuth: SHADING.azimuth_deg, elevation: SHADING.elevation_deg, isDragged: false };
  const [LIGHT, AMBIENT] = [unitVector(SHADING.light), SHADING.ambient];
  let known, xs, zs, stretch, columns, count, low, high, ends, middle, sides, contourStep, scales, size;

  // Takes the present data.
  function take() {
    if (known === data) return;
    known = data;
    ({ x: xs, z: zs, stretch } = data);
    [columns, count] = [xs.length, xs.length * zs.length];
    [low, high] = data.space;
    ends = [[xs[0], xs[columns - 1]], [low, high], [zs[0], zs[zs.length - 1]]];
    middle = ends.map(([a, b]) => (a + b) / 2);
    sides = ends.map(([a, b]) => b - a);
    const contours = roundNumbers(low, high, 10);
    contourStep = contours[1] - contours[0];
    scales = {
      height: { stops: data.colours.height, at: (value) => (value - low) / (high - low), ticks: roundNumbers(low, high, 6), words: "height" },
      deviation: deviationScale(data.deviation_range),
      band: deviationScale(data.band_range, "width of the 95 % band"),
      error: errorScale(0.5 * (high - low), "error: belief too low | too high"),
    };
    size = Math.hypot(sides[0], sides[1] * stretch, sides[2]);
  }

  // Returns the mapping from space to canvas: orthographic, with the same scale from every
  // direction.
  function projection(width, height) {
    const [a, e] = [turn.azimuth, turn.elevation].map((degrees) => degrees * Math.PI / 180);
    const [sa, ca, se, ce] = [Math.sin(a), Math.cos(a), Math.sin(e), Math.cos(e)];
    const scale = Math.min((width - Math.min(190, 0.3 * width)) / (0.8 * sides[0] + 0.62 * sides[1] * stretch),
      (height - 130) / (0.25 * sides[0] + 0.32 * sides[1] * stretch + 0.91 * sides[2]));
    return (x, h, z) => {
      const [dx, dh, dz] = [x - middle[0], (h - middle[1]) * stretch, z - middle[2]];
      return [
        width / 2 + scale * (sa * dh - ca * dx),
        height / 2 - 26 - scale * (ce * dz - se * (sa * dx + ca * dh)),
        ce * (sa * dx + ca * dh) + se * dz,
      ];
    };
  }

  // Computes colours and depths of a height field; `tint` returns the colour of a place.
  function render(field, tint, project, width, height) {
    const layer = { depth: new Float32Array(width * height).fill(-Infinity), pixels: new Uint8ClampedArray(4 * width * height) };
    // Per corner: x, y and depth on the canvas, light, height, red, green, blue.
    const corners = Array.from({ length: 8 }, () => new Float32Array(count));
    const at = (i, j) => field[Math.min(Math.max(j, 0), zs.length - 1) * columns + Math.min(Math.max(i, 0), columns - 1)];
    const [stepX, stepZ] = [sides[0] / (columns - 1), sides[2] / (zs.length - 1)];
    for (let k = 0; k < count; k++) {
      const [i, j] = [k % columns, Math.floor(k / columns)];
      const h = Math.min(Math.max(field[k], low), high);
      const slope = (a, b, step) => (Number.isNaN(a - b) ? 0 : stretch * (a - b) / (2 * step));
      const normal = unitVector([-slope(at(i + 1, j), at(i - 1, j), stepX), 1, -slope(at(i, j + 1), at(i, j - 1), stepZ)]);
      const facing = normal.reduce((sum, part, axis) => sum + part * LIGHT[axis], 0);
      const values = [...project(xs[i], h, zs[j]), AMBIENT + (1 - AMBIENT) * Math.max(facing, 0), h, ...tint(k)];
      values.forEach((value, axis) => { corners[axis][k] = value; });
    }
    for (let j = 1; j < zs.length; j++) {
      for (let i = 1; i < columns; i++) {
        const [a, b, c, d] = [(j - 1) * columns + i - 1, (j - 1) * columns + i, j * columns + i, j * columns + i - 1];
        fill(layer, corners, width, height, a, b, c);
        fill(layer, corners, width, height, a, c, d);
      }
    }
    return layer;
  }

  // Rasterises one triangle: each property is a plane over the canvas.
  function fill({ depth, pixels }, corners, width, height, a, b, c) {
    const [xs, ys, nearness] = corners;
    const [ux, uy, vx, vy] = [xs[b] - xs[a], ys[b] - ys[a], xs[c] - xs[a], ys[c] - ys[a]];
    const area = ux * vy - vx * uy;
    if (!(Math.abs(area) > 1e-9) || Number.isNaN(corners[4][a] + corners[4][b] + corners[4][c])) return;
    const value = new Array(8);
    const [left, right] = [Math.max(Math.ceil(Math.min(xs[a], xs[b], xs[c])), 0), Math.min(Math.floor(Math.max(xs[a], xs[b], xs[c])), width - 1)];
    const [top, bottom] = [Math.max(Math.ceil(Math.min(ys[a], ys[b], ys[c])), 0), Math.min(Math.floor(Math.max(ys[a], ys[b], ys[c])), height - 1)];
    const heightAt = corners[4];
    const gradient = Math.hypot(
      (heightAt[b] - heightAt[a]) * vy - (heightAt[c] - heightAt[a]) * uy,
      (heightAt[c] - heightAt[a]) * ux - (heightAt[b] - heightAt[a]) * vx) / Math.abs(area);
    for (let y = top; y <= bottom; y++) {
      for (let x = left; x <= right; x++) {
        const [px, py] = [x - xs[a], y - ys[a]];
        const [s, t] = [(px * vy - vx * py) / area, (ux * py - px * uy) / area];
        if (s < -1e-6 || t < -1e-6 || s + t > 1 + 1e-6) continue;
        const pixel = y * width + x;
        const near = nearness[a] + s * (nearness[b] - nearness[a]) + t * (nearness[c] - nearness[a]);
        if (near <= depth[pixel]) continue;
        depth[pixel] = near;
        for (let axis = 3; axis < 8; axis++) {
          const property = corners[axis];
          value[axis] = property[a] + s * (property[b] - property[a]) + t * (property[c] - property[a]);
        }
        // A contour line has the same width on a slope as on flat ground.
        const off = Math.abs(value[4] / contourStep - Math.round(value[4] / contourStep)) * contourStep;
        const isLine = off < 0.8 * gradient;
        const light = value[3] * (isLine ? 0.8 : 1);
        for (let channel = 0; channel < 3; channel++) pixels[4 * pixel + channel] = value[5 + channel] * light;
        pixels[4 * pixel + 3] = 255;
      }
    }
  }

  // Overlays the true surface in front of the belief.
  function overlay(belief, truth) {
    const lift = 0.003 * size;
    for (let pixel = 0; pixel < belief.depth.length; pixel++) {
      if (!(truth.depth[pixel] > belief.depth[pixel] + lift)) continue;
      const share = belief.pixels[4 * pixel + 3] ? 0.72 : 1;
      for (let channel = 0; channel < 3; channel++) {
        const index = 4 * pixel + channel;
        belief.pixels[index] += share * (truth.pixels[index] - belief.pixels[index]);
      }
      belief.pixels[4 * pixel + 3] = 255;
    }
  }

  function line(context, points) {
    context.beginPath();
    points.forEach(([x, y], i) => (i ? context.lineTo(x, y) : context.moveTo(x, y)));
    context.stroke();
  }

  // Draws the zone behind the surface and the floor below it, with the ends of their axes.
  function drawSpace(context, project) {
    const [[x0, x1], [h0, h1], [z0, z1]] = ends;
    context.strokeStyle = paint("frame");
    context.lineWidth = 1;
    line(context, [[x0, z0], [x1, z0], [x1, z1], [x0, z1], [x0, z0]].map(([x, z]) => project(x, h0, z)));
    line(context, [[x0, h0], [x0, h1], [x1, h1], [x1, h0]].map(([x, h]) => project(x, h, z0)));
    context.fillStyle = paint("faint");
    const free = writer(context);
    const write = (text, [x, y], dx, dy, align) => free(text, x + dx, y + dy, align);
    write(`x (${data.unit})`, project((x0 + x1) / 2, h1, z0), 26, 38, "center");
    write(`z (${data.unit})`, project(x1, h0, z1), -8, -14, "right");
    for (const x of roundNumbers(x0, x1, 4)) write(label(x), project(x, h1, z0), 0, 16, "center");
    for (const z of roundNumbers(z0, z1, 5)) write(label(z), project(x1, h0, z), -8, 4, "right");
  }

  // Draws the silhouette: the edge between places that are believed to have a surface and the others.
  function drawSilhouette(context, project, frame, isHidden) {
    const isDrawn = (i, j) => [0, 1, columns, columns + 1].every((k) => !Number.isNaN(frame.mean[j * columns + i + k]));
    const corner = (i, j) => project(xs[i], Math.min(Math.max(frame.mean[j * columns + i], low), high), zs[j]);
    context.strokeStyle = paint("ink");
    context.lineWidth = 1.4;
    for (let j = 0; j < zs.length - 1; j++) {
      for (let i = 0; i < columns - 1; i++) {
        // The cell to the right and the one above; an edge belongs to the cell that is drawn.
        for (const [di, dj] of [[1, 0], [0, 1]]) {
          if (i + di > columns - 2 || j + dj > zs.length - 2 || isDrawn(i, j) === isDrawn(i + di, j + dj)) continue;
          const edge = [corner(i + di, j + dj), corner(i + 1, j + 1)];
          if (!edge.some(isHidden)) line(context, edge);
        }
      }
    }
  }

  // Draws the touches so far: full in front of the surface, hollow behind it, a diamond for a miss.
  function drawTouches(context, project, frame, planner, isHidden) {
    const shown = data.planners[planner].contacts.slice(0, frame.touches);
    shown.forEach(([x, h, z], i) => {
      const pair = i < data.initial_touches ? data.colours.initial : data.colours.later;
      const at = (h) => Math.min(Math.max(h, low), high);
      const path = data.planners[planner].paths[i].map(([x, h, z]) => project(x, at(h), z));
      if (path.length) return drawStroke(context, path, pair, isHidden, i === shown.length - 1);
      const point = project(x, h === null ? low : at(h), z);
      const kind = h === null ? "miss" : isHidden(point) ? "hidden" : "seen";
      drawTouch(context, point, pair, kind, i === shown.length - 1);
    });
  }

  function draw(state) {
    take();
    const { context, width, height, ratio } = pen(canvas);
    const frame = frameOf(state);
    const scale = scales[state.colour];
    const shown = {
      height: (k) => frame.mean[k],
      deviation: (k) => frame.deviation[k],
      band: (k) => frame.band[1][k] - frame.band[0][k],
      error: (k) => frame.mean[k] - data.truth[k],
    }[state.colour];
    const project = projection(width, height);
    // Four pixels are computed for one of an ordinary screen, which smooths the edges; one while
    // the view is dragged.
    const dense = turn.isDragged ? 1 : Math.max(ratio, 2);
    const [wide, tall] = [Math.round(width * dense), Math.round(height * dense)];
    const fine = (...point) => project(...point).map((part, axis) => (axis < 2 ? part * dense : part));
    const outOfReach = { ...scale, stops: data.colours.out_of_reach };
    const isHigh = state.colour === "height";
    const tint = (k) => colour(isHigh && frame.reach[k] === "0" ? outOfReach : scale, scale.at(shown(k)));
    const layer = render(frame.mean, tint, fine, wide, tall);
    if (state.truth) overlay(layer, render(data.truth, () => data.colours.truth, fine, wide, tall));
    const sheet = document.createElement("canvas");
    [sheet.width, sheet.height] = [wide, tall];
    sheet.getContext("2d").putImageData(new ImageData(layer.pixels, wide, tall), 0, 0);
    drawSpace(context, project);
    context.drawImage(sheet, 0, 0, width, height);
    const isHidden = ([x, y, depth]) => {
      const pixel = Math.round(y * dense) * wide + Math.round(x * dense);
      return layer.depth[pixel] > depth + 0.02 * size;
    };
    drawSilhouette(context, project, frame, isHidden);
    drawTouches(context, project, frame, state.planner, isHidden);
    if (state.next) drawNext(context, project(state.next[0], heightAt(frame, state.next), state.next[1]));
    drawColours(context, width, height, scale);
    draw.pick = (x, y) => pick(project, frame, x, y);
  }

  // Returns the believed height at a place: that of the nearest place of the grid.
  function heightAt(frame, [x, z]) {
    const index = (at, [a, b], length) => Math.min(Math.max(Math.round((at - a) / (b - a) * (length - 1)), 0), length - 1);
    const h = frame.mean[index(z, ends[2], zs.length) * columns + index(x, ends[0], columns)];
    return Number.isNaN(h) ? low : Math.min(Math.max(h, low), high);
  }

  // Returns the place (x, z) of the front of the surface at a point of the canvas, or null beside it.
  function pick(project, frame, px, py) {
    const [FINE, NEAR] = [4, 6];
    let best = null;
    for (let j = 0; j <= FINE * (zs.length - 1); j++) {
      for (let i = 0; i <= FINE * (columns - 1); i++) {
        const place = [ends[0][0] + sides[0] * i / FINE / (columns - 1), ends[2][0] + sides[2] * j / FINE / (zs.length - 1)];
        const [x, y, depth] = project(place[0], heightAt(frame, place), place[1]);
        const away = Math.hypot(x - px, y - py);
        if (away > NEAR || best && depth - 0.02 * size * away < best.rank) continue;
        best = { place, rank: depth - 0.02 * size * away };
      }
    }
    return best && best.place;
  }

  // Turning keeps the front in front, because the object's back was never touched.
  function turnBy(right, up) {
    turn.azimuth = Math.min(Math.max(turn.azimuth + right, -80), 80);
    turn.elevation = Math.min(Math.max(turn.elevation + up, -30), 85);
    window.draw();
  }
  turnable(canvas, turn, turnBy);
  return draw;
}
