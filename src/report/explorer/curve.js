// Curve with its 95 % band, and its standard deviation below.
"use strict";

function curveView(canvas) {
  const [LEFT, RIGHT, TOP, GAP, BOTTOM] = [62, 16, 14, 34, 46];
  let xs, unit;

  // Draws a frame with ticks; returns the function that maps a value into it.
  function panel(context, left, top, width, height, [x0, x1], [y0, y1], words) {
    const at = (x, y) => [left + width * (x - x0) / (x1 - x0), top + height * (y1 - y) / (y1 - y0)];
    context.lineWidth = 1;
    context.strokeStyle = paint("line");
    context.fillStyle = paint("ink");
    context.beginPath();
    const write = writer(context);
    for (const x of roundNumbers(x0, x1, Math.min(8, width / 50))) {
      context.moveTo(at(x, y0)[0], top);
      context.lineTo(at(x, y0)[0], top + height);
      write(label(x), at(x, y0)[0], top + height + 16, "center");
    }
    for (const y of roundNumbers(y0, y1, height / 50)) {
      context.moveTo(left, at(x0, y)[1]);
      context.lineTo(left + width, at(x0, y)[1]);
      write(label(y), left - 7, at(x0, y)[1] + 4, "right");
    }
    context.stroke();
    context.strokeStyle = paint("frame");
    context.strokeRect(left, top, width, height);
    context.save();
    context.translate(left - 46, top + height / 2);
    context.rotate(-Math.PI / 2);
    context.textAlign = "center";
    context.fillText(`${words} (${unit})`, 0, 0);
    context.restore();
    return at;
  }

  // A point that is not a number ends a line and starts another.
  function curve(context, at, values, ink, width) {
    context.beginPath();
    xs.forEach((x, i) => {
      if (Number.isNaN(values[i])) return;
      if (i > 0 && !Number.isNaN(values[i - 1])) context.lineTo(...at(x, values[i]));
      else context.moveTo(...at(x, values[i]));
    });
    context.strokeStyle = ink;
    context.lineWidth = width;
    context.stroke();
  }

  // A band is filled piece by piece, so that it ends with the belief.
  function band(context, at, { mean, band: ends }, ink) {
    const rim = (i, end) => at(xs[i], ends[end][i]);
    context.beginPath();
    for (let i = 1; i < xs.length; i++) {
      if (Number.isNaN(mean[i] + mean[i - 1])) continue;
      context.moveTo(...rim(i - 1, 1));
      for (const corner of [rim(i, 1), rim(i, 0), rim(i - 1, 0)]) context.lineTo(...corner);
    }
    context.fillStyle = ink;
    context.fill();
  }

  function within(context, left, top, width, height, draw) {
    context.save();
    context.beginPath();
    context.rect(left, top, width, height);
    context.clip();
    draw();
    context.restore();
  }

  function drawTouches(context, at, frame, planner) {
    const shown = data.planners[planner].contacts.slice(0, frame.touches);
    shown.forEach(([x, h], i) => {
      const pair = i < data.initial_touches ? data.colours.initial : data.colours.later;
      const path = data.planners[planner].paths[i].map(([x, h]) => at(x, h));
      if (path.length) return drawStroke(context, path, pair, () => false, i === shown.length - 1);
      const [left, top] = at(x, h === null ? data.space[0] : h);
      const arm = i === shown.length - 1 ? 6 : 4;
      for (const [ink, width] of [[paint("paper"), 4.5], [onPaper(pair), 2]]) {
        context.strokeStyle = ink;
        context.lineWidth = width;
        context.beginPath();
        context.moveTo(left - arm, top - arm);
        context.lineTo(left + arm, top + arm);
        context.moveTo(left - arm, top + arm);
        context.lineTo(left + arm, top - arm);
        context.stroke();
      }
    });
  }

  const draw = (state) => {
    ({ x: xs, unit } = data);
    const { context, width, height } = pen(canvas);
    const frame = frameOf(state);
    const ink = onPaper(data.planners[state.planner].colours);
    const inner = width - LEFT - RIGHT;
    const tall = 0.7 * (height - TOP - GAP - BOTTOM);
    const short = height - TOP - GAP - BOTTOM - tall;
    const sides = [xs[0], xs[xs.length - 1]];
    const at = panel(context, LEFT, TOP, inner, tall, sides, data.space, "height");
    within(context, LEFT, TOP, inner, tall, () => {
      band(context, at, frame, ink + "38");
      if (state.truth) curve(context, at, data.truth, `rgb(${data.colours.truth})`, 2.5);
      curve(context, at, frame.mean, paint("ink"), 1.8);
      drawTouches(context, at, frame, state.planner);
      if (state.next) drawNext(context, at(state.next[0], data.space[0] + 0.08 * (data.space[1] - data.space[0])));
    });
    const below = TOP + tall + GAP;
    const most = 1.05 * data.deviation_range[1];
    const low = panel(context, LEFT, below, inner, short, sides, [0, most], "σ");
    within(context, LEFT, below, inner, short, () => curve(context, low, frame.deviation.map((value, i) => (Number.isNaN(frame.mean[i]) ? NaN : value)), ink, 2));
    context.fillStyle = paint("ink");
    context.textAlign = "center";
    context.fillText(`x (${unit})`, LEFT + inner / 2, height - 8);
    draw.pick = (x) => {
      const share = (x - LEFT) / inner;
      return share < 0 || share > 1 ? null : [sides[0] + share * (sides[1] - sides[0])];
    };
  };
  return draw;
}
