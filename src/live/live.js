// Page of a running exploration: shows what the server tells, and sends a person's orders. Beliefs
// are asked for when they are to be seen, so that a slow browser only skips some.
"use strict";

const explorer = document.getElementById("explorer");
const find = (id) => document.getElementById(id);
let data = null;
let told = null;
const shared = { colour: null, truth: false };
const panels = new Map();
// Number of touches to show; null for the last one.
let chosen = null;
let target = null;

function say(words) {
  find("alert").textContent = words;
}

async function post(path, body, headers = {}) {
  try {
    const answer = await fetch(path, { method: "POST", body, headers });
    const found = await answer.json();
    say(answer.ok ? "" : found.error);
    return answer.ok ? found : null;
  } catch {
    say("The server does not answer.");
    return null;
  }
}
const order = (name, fields = {}) => post("/order", JSON.stringify({ order: name, ...fields }));

// Beliefs, one request at a time.
let isAsked = false;
let isStale = false;
async function refresh() {
  if (isAsked) {
    isStale = true;
    return;
  }
  isAsked = true;
  try {
    const answer = await fetch(`/beliefs?touches=${chosen ?? 4294967295}`);
    const found = answer.ok ? await answer.json() : null;
    if (found) {
      data = found;
      prepare();
      showForm();
      showLegend();
      draw();
    }
  } catch {
    // The stream of events reports a lost connection.
  }
  isAsked = false;
  if (isStale) {
    isStale = false;
    refresh();
  }
}

// What a person has chosen, else what is about to be touched, in the numbers of the view.
function nextOf(planner) {
  const numbers = target && target.planner === planner.name ? target.numbers : chosen === null && planner.next;
  if (!numbers) return null;
  if (!told.is_around) return numbers.slice(0, 2).map((metres) => metres * data.per_m);
  const aim = numbers.slice(0, 3).map((metres, axis) => (metres - data.middle_m[axis]) * data.per_m);
  return { aim, along: numbers.slice(3, 6) };
}

let isDue = false;
function draw() {
  if (isDue || !data || !told) return;
  isDue = true;
  requestAnimationFrame(() => {
    isDue = false;
    for (const planner of told.planners) {
      const panel = panels.get(planner.name);
      const index = data.planners.findIndex(({ name }) => name === planner.name);
      // Without a belief, as of the planners against a person, there is nothing to show.
      if (panel) panel.canvas.hidden = index < 0;
      if (!panel?.canvas.clientWidth) continue;
      const frame = data.planners[index].frames[0];
      panel.view ??= viewOf(panel.canvas);
      panel.view({ ...shared, planner: index, frame: 0, next: nextOf(planner) });
      panel.score.textContent = ` Belief after ${frame.touches} touches${frame.score ? `: ${frame.score}` : ""}`;
    }
  });
}
window.draw = draw;

const WORDS = {
  waiting: "has not begun", planning: "plans", your_turn: "your turn: choose a target", asks: "asks for your approval",
  held: "is held", touching: "touches", done: "is finished", failed: "has failed",
};

function panelOf(planner) {
  let panel = panels.get(planner.name);
  if (panel) return panel;
  const figure = document.createElement("figure");
  const canvas = document.createElement("canvas");
  canvas.className = told.is_line ? "curve" : "surface";
  canvas.tabIndex = 0;
  canvas.setAttribute("role", "img");
  const caption = document.createElement("figcaption");
  const [name, status, score, bars] = ["strong", "span", "span", "ol"].map((kind) => document.createElement(kind));
  bars.className = "bars";
  name.textContent = planner.name;
  caption.append(name, status, score);
  figure.append(canvas, caption, bars);
  find("panels").append(figure);
  // The view needs a first belief.
  panel = { figure, canvas, name, status, score, bars, view: null };
  panels.set(planner.name, panel);
  new ResizeObserver(draw).observe(canvas);
  // A click, not the end of a turn.
  let from = null;
  canvas.addEventListener("pointerdown", ({ offsetX, offsetY }) => { from = [offsetX, offsetY]; });
  canvas.addEventListener("pointerup", ({ offsetX, offsetY }) => {
    if (!from || Math.hypot(offsetX - from[0], offsetY - from[1]) > 4) return;
    choose(planner.name, panel.view?.pick?.(offsetX, offsetY));
  });
  return panel;
}

// Takes a place or an aim of a view as the target of a planner that waits.
function choose(name, picked) {
  const planner = told.planners.find((it) => it.name === name);
  if (!picked || !planner?.asks) return;
  const numbers = Array.isArray(picked) ? picked.map((number) => number / data.per_m)
    : [...picked.aim.map((number, axis) => number / data.per_m + data.middle_m[axis]), ...picked.along];
  find("target").dataset.planner = name;
  showForm();
  setTarget(name, numbers);
}

function setTarget(name, numbers) {
  target = { planner: name, numbers };
  [...find("numbers").querySelectorAll("input")].forEach((input, i) => { input.value = shownNumber(i, numbers[i]); });
  draw();
}

// Places are shown in the unit of the view, directions as they are.
const factor = (i) => (i < 3 || !told.is_around ? data?.per_m ?? 1000 : 1);
const shownNumber = (i, number) => Number((number * factor(i)).toPrecision(6));

// The form of the target is that of the first planner that waits.
function showForm() {
  const asking = told.planners.filter((it) => it.asks);
  const planner = asking.find(({ name }) => name === find("target").dataset.planner) ?? asking.find((it) => it.is_human) ?? asking[0];
  for (const id of ["target", "exact"]) find(id).hidden = !planner;
  for (const [name, { figure }] of panels) figure.classList.toggle("mine", name === planner?.name);
  if (!planner) {
    target = null;
    return;
  }
  find("whose").textContent = `${planner.name}: click on the surface, or set the numbers below.`;
  find("confirm").hidden = planner.status !== "asks";
  const names = told.is_around ? ["x", "y", "z", "along x", "along y", "along z"] : told.is_line ? ["x"] : ["x", "z"];
  if (find("numbers").dataset.names !== names.join()) {
    find("numbers").dataset.names = names.join();
    find("numbers").replaceChildren(...names.map((name, i) => {
      const label = document.createElement("label");
      const input = document.createElement("input");
      Object.assign(input, { type: "number", step: "any", required: true });
      input.setAttribute("form", "target");
      input.addEventListener("input", () => {
        const inputs = [...find("numbers").querySelectorAll("input")];
        if (inputs.every((it) => it.value !== "")) target = { planner: find("target").dataset.planner, numbers: inputs.map((it, k) => Number(it.value) / factor(k)) };
        draw();
      });
      label.append(`${name}${i < 3 ? ` (${data?.unit ?? "mm"})` : ""} `, input, " ");
      return label;
    }));
  }
  if (target?.planner !== planner.name) {
    find("target").dataset.planner = planner.name;
    if (planner.next || data) setTarget(planner.name, planner.next?.slice(0, names.length) ?? middle());
  }
}

// Returns the middle of the region, around an object from above.
function middle() {
  if (told.is_around) return [...data.middle_m, 0, 0, -1];
  return [data.x, data.z].filter(Boolean).map((places) => (places[0] + places.at(-1)) / 2 / data.per_m);
}

// Shows the entries of the legend that this experiment has.
function showLegend() {
  find("hidden").hidden = !told.is_played;
  const hidden = explorer.querySelectorAll("input[name=truth], input[value=error]");
  for (const input of hidden) input.disabled = told.is_played;
  const paths = data?.planners.flatMap(({ paths, touches }) => paths ?? touches.map(({ path }) => path)) ?? [];
  const has = {
    surface: !told.is_line, line: told.is_line, around: told.is_around, ring: !told.is_around,
    zone: !told.is_line && !told.is_around, truth: shared.truth && !told.is_played, stroke: paths.some((path) => path.length),
  };
  for (const item of document.querySelectorAll("[data-when]")) item.hidden = !has[item.dataset.when];
}

// Errors over touches, on a logarithmic axis.
function showCurves() {
  const all = told.planners.flatMap(({ errors }) => errors.map(([, value]) => value)).filter((value) => value > 0);
  for (const id of ["curves", "curve"]) find(id).toggleAttribute("hidden", !all.length);
  if (!all.length) return;
  const wide = find("curve").getBoundingClientRect().width || 720;
  find("curve").setAttribute("viewBox", `0 0 ${wide} 220`);
  const [LEFT, RIGHT, TOP, BOTTOM] = [56, wide - 10, 12, 184];
  const [low, high] = [Math.min(...all) / 1.1, Math.max(...all) * 1.1];
  const x = (touches) => LEFT + (RIGHT - LEFT) * touches / told.touches;
  const y = (value) => BOTTOM - (BOTTOM - TOP) * Math.log(value / low) / Math.log(high / low);
  const digits = high > 300 * low ? [1] : [1, 2, 5];
  const powers = Array.from({ length: 10 }, (_, i) => 10 ** (i - 5)).flatMap((power) => digits.map((digit) => digit * power));
  const ticks = powers.filter((value) => value > low && value < high);
  const parts = ticks.map((value) => `<line x1="${LEFT}" x2="${RIGHT}" y1="${y(value)}" y2="${y(value)}"/><text x="${LEFT - 6}" y="${y(value) + 4}" text-anchor="end">${label(value)}</text>`);
  for (const touches of roundNumbers(0, told.touches, Math.min(8, wide / 60))) parts.push(`<text x="${x(touches)}" y="${BOTTOM + 18}" text-anchor="middle">${touches}</text>`);
  for (const { colours, errors } of told.planners) {
    const points = errors.filter(([, value]) => value > 0).map(([touches, value]) => `${x(touches).toFixed(1)},${y(value).toFixed(1)}`);
    parts.push(`<polyline fill="none" stroke="${onPaper(colours)}" stroke-width="2" points="${points.join(" ")}"/>`);
    const [left, top] = points.at(-1)?.split(",") ?? [];
    if (top) parts.push(`<circle cx="${left}" cy="${top}" r="3" fill="${onPaper(colours)}"/>`);
  }
  parts.push(`<text x="${(LEFT + RIGHT) / 2}" y="${BOTTOM + 34}" text-anchor="middle">touches</text>`);
  find("curve").innerHTML = parts.join("");
  find("curve").setAttribute("aria-label", `${told.measure} over touches`);
  find("curves").textContent = told.measure;
}

function show(state) {
  const before = told;
  told = state;
  find("bring").hidden = state.phase === "running";
  explorer.hidden = !state.planners;
  if (!state.planners) return;
  find("question").textContent = state.question;
  const others = state.trials > 1 ? `Trial ${state.trial} of 0 to ${state.trials - 1}. ` : "";
  const real = state.is_real ? "A real arm. It holds when no page is visible. " : "";
  const phase = { running: state.is_held ? "Held." : "Running.", ended: "Ended." }[state.phase];
  find("status").textContent = `${others}${real}${phase}`;
  find("report").hidden = state.phase !== "ended";
  for (const button of explorer.querySelectorAll("[data-order]")) button.disabled = state.phase !== "running";
  explorer.querySelector("[data-order=hold]").setAttribute("aria-pressed", state.is_held);
  explorer.querySelector("[name=approve]").checked = state.approves;
  explorer.querySelector("[name=speed]").value = state.speed ?? "";
  if (before && before.trial !== state.trial) chosen = null;
  find("trials").hidden = state.phase !== "ended" || state.trials < 2;
  Object.assign(find("trial"), { min: 0, max: state.trials - 1, value: state.trial });
  for (const planner of state.planners) {
    const panel = panelOf(planner);
    panel.figure.style.setProperty("--own", onPaper(planner.colours));
    panel.status.textContent = ` ${WORDS[planner.status]}, ${planner.touches} of ${state.touches}${planner.last ? `, ${planner.last}` : ""}${planner.time_s ? `, ${planner.time_s.toFixed(1)} s` : ""}.`;
    showBars(panel.bars, planner.hypotheses ?? []);
    panel.canvas.setAttribute("aria-label", `The belief of ${planner.name} after ${planner.touches} touches`);
  }
  const most = Math.max(...state.planners.map(({ touches }) => touches));
  find("slider").max = most;
  if (chosen === null) find("slider").value = most;
  find("events").hidden = !state.log.length;
  find("log").textContent = state.log.join("\n");
  showForm();
  showLegend();
  showCurves();
  const count = (it) => it?.planners?.map(({ touches }) => touches).join();
  if (count(before) !== count(state) || before.phase !== state.phase || before.trial !== state.trial) refresh();
  draw();
}

// Force and sensor of the last ten seconds.
const SPAN = 250;
const traces = [];
function trace(readings) {
  if (readings.every((reading) => reading === null)) return;
  readings.forEach((reading, i) => {
    if (!reading) return;
    traces[i] ??= [];
    if (traces[i].at(-1)?.[0] !== reading[0]) traces[i].push(reading);
    traces[i].splice(0, traces[i].length - SPAN);
  });
  const place = find("force");
  let canvas = place.querySelector("canvas");
  if (!canvas) {
    const title = document.createElement("h2");
    title.textContent = "Force (N) and sensor";
    canvas = document.createElement("canvas");
    canvas.setAttribute("role", "img");
    canvas.setAttribute("aria-label", "Force and sensor of the running touch");
    place.append(title, canvas);
  }
  const { context, width, height } = pen(canvas);
  context.clearRect(0, 0, width, height);
  traces.forEach((rows, i) => {
    const ink = onPaper(told.planners[i].colours);
    [[1, []], [2, [3, 3]]].forEach(([column, dash]) => {
      const values = rows.map((row) => row[column]).filter((value) => value !== null);
      if (!values.length) return;
      const [low, high] = [Math.min(0, ...values), Math.max(1e-3, ...values)];
      context.strokeStyle = ink;
      context.setLineDash(dash);
      context.beginPath();
      values.forEach((value, k) => context.lineTo(k / SPAN * width, height - 4 - (height - 18) * (value - low) / (high - low)));
      context.stroke();
      context.fillStyle = paint("ink");
      const words = `${column === 1 ? "force" : "sensor"} ${label(Number(values.at(-1).toPrecision(3)))}`;
      context.fillText(words, 8 + 140 * (column - 1), 12 + 14 * i);
    });
    context.setLineDash([]);
  });
}

// Steering.
for (const button of explorer.querySelectorAll("[data-order]")) {
  button.addEventListener("click", () => order(button.dataset.order));
}
explorer.querySelector("[name=speed]").addEventListener("change", ({ target: { value } }) => order("speed", { times: value === "" ? null : Number(value) }));
explorer.querySelector("[name=approve]").addEventListener("change", ({ target: { checked } }) => order("approve", { each: checked }));
find("target").addEventListener("submit", async (event) => {
  event.preventDefault();
  const planner = find("target").dataset.planner;
  const numbers = [...find("numbers").querySelectorAll("input")].map((input, i) => Number(input.value) / factor(i));
  if (await order("touch", { planner, target: numbers })) target = null;
});
find("confirm").addEventListener("click", () => order("confirm", { planner: find("target").dataset.planner }));
find("trial").addEventListener("change", ({ target: { value } }) => order("trial", { number: Number(value) }));
find("slider").addEventListener("input", ({ target: { value, max } }) => {
  chosen = value === max ? null : Number(value);
  refresh();
});
find("latest").addEventListener("click", () => {
  chosen = null;
  find("slider").value = find("slider").max;
  refresh();
});
explorer.addEventListener("change", ({ target: input }) => {
  if (input.name === "colour") shared.colour = input.value;
  if (input.name === "truth") shared.truth = input.checked;
  showLegend();
  draw();
});
new ResizeObserver(() => told?.planners && showCurves()).observe(find("explorer"));

// A mesh of one's own.
const drop = document.querySelector(".drop");
const file = drop.querySelector("input");
for (const kind of ["dragover", "dragleave", "drop"]) {
  document.addEventListener(kind, (event) => {
    event.preventDefault();
    drop.classList.toggle("over", kind === "dragover");
    if (kind !== "drop" || find("bring").hidden || !event.dataTransfer.files.length) return;
    file.files = event.dataTransfer.files;
    find("mesh").requestSubmit();
  });
}
find("mesh").addEventListener("submit", async (event) => {
  event.preventDefault();
  const form = new FormData(find("mesh"));
  const mesh = file.files[0];
  if (!mesh) return say("Choose a file first.");
  const unit = form.get("unit");
  const wish = { name: mesh.name.replace(/[^\x20-\x7e]/g, "_"), unit: unit === "" ? null : unit, side: form.get("side"), finger: form.get("finger"), around: form.has("around") };
  say("Reading the mesh …");
  const found = await post("/mesh", mesh, { "x-mesh": JSON.stringify(wish) });
  if (!found) return;
  find("picture").src = `data:image/svg+xml;base64,${found.picture}`;
  find("words").textContent = found.words;
  find("brought").hidden = false;
});
find("start").addEventListener("click", () => {
  const names = [...document.querySelectorAll("[name=with]:checked")].map(({ value }) => value);
  post("/start", JSON.stringify(names));
});

// Events. The browser connects again by itself.
const source = new EventSource("/events");
source.addEventListener("state", ({ data: text }) => show(JSON.parse(text)));
source.addEventListener("alert", ({ data: text }) => say(JSON.parse(text)));
source.addEventListener("reload", () => location.reload());
source.addEventListener("readings", ({ data: text }) => told?.planners && trace(JSON.parse(text)));
source.addEventListener("error", () => {
  // A refused connection is closed.
  const remedy = source.readyState === EventSource.CLOSED ? " Open the address that palpate live printed." : "";
  say(`The connection is lost. A real arm finishes its touch and holds.${remedy}`);
});
source.addEventListener("open", () => say(""));

// A visible page lets a real arm move.
const beat = () => !document.hidden && told?.is_real && fetch("/seen", { method: "POST" }).catch(() => null);
setInterval(beat, 1000);
document.addEventListener("visibilitychange", beat);

for (const input of explorer.querySelectorAll("input:checked")) {
  if (input.name === "colour") shared.colour = input.value;
  if (input.name === "truth") shared.truth = true;
}
