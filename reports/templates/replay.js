// Replay, third part: one time and one camera for every panel, controls, keys, deep links, conservation over time.

/** @typedef { {scene: string, runs: string[], focus: string, time: number, playing: boolean, speed: number, angle: number} } State */

const recorded = JSON.parse(document.getElementById("replays").textContent);
const part = (name) => document.getElementById(`replay-${name}`);
const player = part("player");
const still = matchMedia("(prefers-reduced-motion: reduce)");
/** @type {State} */
const state = { scene: "", runs: [], focus: "", time: 0, playing: false, speed: 1, angle: -60 };
const decoded = new Map(); // case name -> scene with runs and truths decoded
let ink, panels = [];

/** A case with its tracks decoded: once, when it is first looked at. */
function sceneOf(name) {
  if (!decoded.has(name)) decoded.set(name, decode(recorded.cases.find((scene) => scene.case === name)));
  return decoded.get(name);
}

async function decode(scene) {
  const n = scene.movable.length;
  const runs = scene.runs.map(async (run) => ({ ...run, motion: await motionOf(run, n, [n, recorded.series.length]) }));
  const truths = Object.entries(scene.truths).map(async ([law, track]) => [law, await motionOf(track, n, [2])]);
  const rows = scene.bodies.map((_, index) => scene.movable.indexOf(index));
  return { ...scene, rows, runs: await Promise.all(runs), truths: Object.fromEntries(await Promise.all(truths)) };
}

/** The truth of a run's law at a time, where it is known. */
function ghostAt(scene, law, time) {
  const truth = scene.truths[law];
  const frame = Math.min(Math.round(time / scene.frame), truth.frames - 1);
  return truth.rest[0][frame] ? truth : null;
}

const endOf = (scene) => (scene.frames - 1) * scene.frame;

// Panels ------------------------------------------------------------------------------------------------------------

function panelFor(title, describe) {
  const box = document.createElement("figure");
  const caption = document.createElement("figcaption");
  const name = document.createElement("strong"), text = document.createElement("span");
  const canvas = document.createElement("canvas");
  name.textContent = title;
  canvas.setAttribute("role", "img");
  canvas.setAttribute("aria-label", describe);
  caption.append(name, document.createElement("br"), text);
  box.append(canvas, caption);
  part("panels").append(box);
  return { canvas, text, pen: canvas.getContext("2d") };
}

/** Panels for the runs that are shown, and one that lays them over one another. */
async function layOut() {
  const scene = await sceneOf(state.scene);
  part("panels").replaceChildren();
  panels = state.runs.map((name) => {
    const run = scene.runs.find((r) => r.contestant === name);
    return { run, ...panelFor(name, `${name} in ${scene.case}; its error is in the text below`) };
  });
  if (panels.length > 1) panels.push({ run: null, ...panelFor("all, overlaid", `outlines of all panels in ${scene.case}`) });
  for (const panel of panels) {
    const { canvas } = panel, ratio = Math.min(devicePixelRatio || 1, 2);
    const width = canvas.clientWidth || 300, height = canvas.clientHeight || 240;
    canvas.width = width * ratio;
    canvas.height = height * ratio;
    panel.pen.setTransform(ratio, 0, 0, ratio, 0, 0);
    panel.width = width;
    panel.height = height;
  }
  ink = inkOf(player);
  draw(scene);
}

/** Of the panels' runs and, where they are known, of their truths. */
function shownMotions(scene) {
  const runs = panels.filter((panel) => panel.run).map((panel) => panel.run);
  const truths = [...new Set(runs.map((run) => run.law))].map((law) => ghostAt(scene, law, state.time));
  return [...runs.map((run) => run.motion), ...truths.filter(Boolean)];
}

/** Every panel at the present time. */
function draw(scene) {
  const box = part("close").checked ? closer(scene, shownMotions(scene), state.time) : scene.camera;
  for (const panel of panels) {
    const { pen, run, width, height } = panel;
    const camera = cameraOf(scene, state.angle, width, height, box);
    if (run) {
      drawPanel(pen, camera, scene, run, ghostAt(scene, run.law, state.time), state.time, ink, still.matches);
      panel.text.textContent = caption(scene, run);
    } else drawOverlay(pen, camera, scene);
  }
  part("time").value = state.time;
  part("clock").textContent = secondsText(state.time);
}

function caption(scene, run) {
  const ended = state.time > (run.motion.frames - 1) * scene.frame + 1e-9;
  if (ended) return `${run.state} after ${secondsText((run.motion.frames - 1) * scene.frame)}`;
  const parts = [["error", "position_error"], ["energy", "energy"], ["overlap", "penetration"]];
  const texts = parts.map(([word, name]) => `${word} ${percentText(seriesAt(scene, run, name, state.time))}`);
  return `${run.step_text}: ${texts.join(", ")}`;
}

function drawOverlay(pen, camera, scene) {
  const shown = panels.filter((panel) => panel.run).map((panel) => panel.run);
  pen.clearRect(0, 0, camera.width, camera.height);
  for (const body of scene.bodies) {
    if (body.kind === "plane") drawPlane(pen, camera, scene, body, ink);
    else if (body.static) trace(pen, camera, { body, place: body.position, turn: body.orientation }), pen.stroke();
  }
  for (const law of new Set(shown.map((run) => run.law))) {
    const ghost = ghostAt(scene, law, state.time);
    if (ghost) drawOutlines(pen, camera, scene, ghost, state.time, ink.ghost, [4, 3]);
  }
  for (const run of shown) {
    const { colour, dash } = recorded.styles[run.contestant];
    drawOutlines(pen, camera, scene, run.motion, state.time, colour, dash);
  }
}

// Time --------------------------------------------------------------------------------------------------------------

/** Go to a time [s]; the address follows unless it is a frame of a playing replay. */
async function seek(time, quiet = false) {
  const scene = await sceneOf(state.scene);
  state.time = Math.min(Math.max(time, 0), endOf(scene));
  draw(scene);
  if (quiet) return;
  remember();
  moveCursor();
}

function play(on) {
  state.playing = on;
  part("play").textContent = on ? "Pause" : "Play";
  part("play").setAttribute("aria-pressed", String(on));
  if (on) sceneOf(state.scene).then((scene) => run(scene, performance.now()));
  else seek(state.time);
}

/** One turn of the clock; with reduced motion whole frames at a quarter of a second instead of a moving picture. */
function run(scene, before) {
  if (state.time >= endOf(scene) - 1e-9) state.time = 0;
  const tick = (now) => {
    if (!state.playing || scene.case !== state.scene) return;
    state.time += ((now - before) / 1000) * state.speed;
    before = now;
    if (state.time >= endOf(scene)) {
      state.time = endOf(scene);
      return play(false);
    }
    draw(scene);
    if (now - moved > 150) moveCursor();
    if (still.matches) setTimeout(() => requestAnimationFrame(tick), 250);
    else requestAnimationFrame(tick);
  };
  requestAnimationFrame(tick);
}

/** Jump to an event of the run in focus, and say what it is. */
async function jump(name) {
  const scene = await sceneOf(state.scene);
  const found = focused(scene).events[name];
  if (!found) return;
  if (state.playing) play(false);
  await seek(found.time);
  say(`${state.focus}: ${eventText(name, found)}`);
}

function eventText(name, found) {
  const who = found.bodies.length ? ` (${found.bodies.join(", ")})` : "";
  const size = found.value === null ? "" : ` ${found.what.replaceAll("_", " ")} ${percentText(found.value)}`;
  return `${name.replace("_", " ")} at ${secondsText(found.time)}:${size}${who}`;
}

const say = (text) => { part("status").textContent = text; };
const focused = (scene) => scene.runs.find((r) => r.contestant === state.focus);

// Choice of scene and runs ------------------------------------------------------------------------------------------

/** Show a case: its runs, the one in focus, a time. `note` is said once it is there. */
async function open(name, focus, time, note = "") {
  const plain = recorded.cases.find((scene) => scene.case === name);
  if (!plain) return say(`${name} was not recorded.`);
  const known = plain.runs.map((r) => r.contestant);
  state.playing = false;
  if (name !== state.scene || !known.includes(state.focus)) state.runs = [...recorded.usual[name]];
  state.scene = name;
  if (focus && !known.includes(focus)) {
    const silent = plain.not_recorded.find((entry) => entry.contestant === focus);
    note = `${focus} has no replay here${silent ? `: ${silent.reason}` : ""}.`;
    focus = "";
  }
  state.focus = focus || (state.runs.includes(state.focus) ? state.focus : state.runs[0]);
  if (!state.runs.includes(state.focus)) state.runs = [...state.runs.slice(0, -1), state.focus];
  state.time = time;
  choices(plain);
  part("play").textContent = "Play";
  await layOut();
  await seek(state.time, true);
  say(note);
  await plot();
}

/** Controls follow the case: runs to show, run in focus, length of the scrubber, buttons of events that exist. */
function choices(scene) {
  part("scene").value = scene.case;
  part("time").max = endOf(scene);
  part("time").step = scene.frame;
  part("turn").hidden = scene.axes.length < 3;
  part("focus").replaceChildren(...scene.runs.map((r) => new Option(r.contestant, r.contestant, false, r.contestant === state.focus)));
  part("runs").replaceChildren(...scene.runs.map((r) => {
    const label = document.createElement("label"), box = document.createElement("input");
    box.type = "checkbox";
    box.value = r.contestant;
    box.checked = state.runs.includes(r.contestant);
    label.append(box, ` ${r.contestant}`);
    return label;
  }));
  const found = focused(scene).events;
  for (const button of player.querySelectorAll("[data-event]")) button.disabled = !found[button.dataset.event];
  const loss = Math.max(...scene.runs.map((r) => r.loss));
  part("loss").textContent =
    `Recorded at ${scene.step_text} s, drawn from a picture every ${secondsText(scene.frame)}; places are rounded by at most ${Number((1e6 * loss).toPrecision(2))} µm.`;
}

// Links -------------------------------------------------------------------------------------------------------------

let written = 0, resized = 0;
function remember() {
  clearTimeout(written);
  written = setTimeout(() => history.replaceState(null, "", addressOf(state.scene, state.focus, state.time)), 150);
}

const addressOf = (scene, engine, time) =>
  `#scenario=${encodeURIComponent(scene)}&engine=${encodeURIComponent(engine)}&t=${Number(time.toFixed(4))}` +
  (part("close").checked ? "&close=1" : "");

/** Follow `#scenario=...&engine=...&t=...`, seen close up with `&close=1`; false where the address holds none. */
function follow() {
  const wanted = new URLSearchParams(location.hash.slice(1));
  if (!wanted.has("scenario")) return false;
  const time = Number(wanted.get("t") ?? 0);
  part("close").checked = wanted.has("close");
  open(wanted.get("scenario"), wanted.get("engine") ?? "", Number.isFinite(time) ? time : 0);
  part("section").scrollIntoView();
  player.focus({ preventScroll: true });
  return true;
}

/** A point of a speed-against-error chart: that policy's recorded run, opened where it goes wrong. */
async function openPoint({ detail }) {
  const plain = recorded.cases.find((scene) => scene.case === detail.scene);
  part("section").scrollIntoView();
  player.focus({ preventScroll: true });
  if (!plain) return say(`${detail.scene} was not recorded.`);
  const found = plain.runs.find((r) => r.contestant === detail.policy);
  const other = found && detail.step && found.step_text !== detail.step && found.step_text !== "no step";
  const at = found?.events.first_violation ?? found?.events.first_contact;
  await open(detail.scene, detail.policy, at ? at.time : 0, other ? `Step ${detail.step} was not recorded: this is ${found.step_text}.` : "");
  remember();
}

// Events ------------------------------------------------------------------------------------------------------------

const KEYS = { ArrowLeft: -1, ",": -1, ArrowRight: 1, ".": 1, PageUp: -10, PageDown: 10 };

/** Keys of the whole player; lists, boxes and buttons keep the keys they need themselves. */
async function onKey(event) {
  const { target, key } = event;
  const own = target.tagName === "SELECT" || target === part("angle")
    || (key === " " && (target.tagName === "BUTTON" || target.type === "checkbox"));
  if (own || event.ctrlKey || event.altKey || event.metaKey || ![" ", "Home", "End", ...Object.keys(KEYS)].includes(key)) return;
  event.preventDefault();
  const scene = await sceneOf(state.scene);
  if (key === " ") return play(!state.playing);
  if (state.playing) play(false);
  if (key in KEYS) seek((Math.round(state.time / scene.frame) + KEYS[key]) * scene.frame);
  else seek(key === "Home" ? 0 : endOf(scene));
}

function start() {
  for (const scene of recorded.cases) part("scene").add(new Option(scene.case, scene.case));
  player.addEventListener("keydown", onKey);
  part("play").addEventListener("click", () => play(!state.playing));
  part("time").addEventListener("input", () => { if (state.playing) play(false); seek(Number(part("time").value)); });
  part("speed").addEventListener("change", () => { state.speed = Number(part("speed").value); });
  part("angle").addEventListener("input", async () => { state.angle = Number(part("angle").value); draw(await sceneOf(state.scene)); });
  part("close").addEventListener("change", () => seek(state.time));
  part("scene").addEventListener("change", () => open(part("scene").value, "", 0).then(remember));
  part("focus").addEventListener("change", () => open(state.scene, part("focus").value, state.time).then(remember));
  part("runs").addEventListener("change", () => {
    const chosen = [...part("runs").querySelectorAll(":checked")].map((box) => box.value);
    if (!chosen.length) return choices(recorded.cases.find((scene) => scene.case === state.scene)); // one is always shown
    state.runs = chosen;
    open(state.scene, chosen.includes(state.focus) ? state.focus : chosen[0], state.time);
  });
  for (const button of player.querySelectorAll("[data-event]")) button.addEventListener("click", () => jump(button.dataset.event));
  document.addEventListener("impactbench-point", openPoint);
  addEventListener("hashchange", follow);
  addEventListener("resize", () => { clearTimeout(resized); resized = setTimeout(layOut, 200); });
  matchMedia("(prefers-color-scheme: dark)").addEventListener("change", layOut);
  player.hidden = false;
  const poster = recorded.poster ?? { case: recorded.cases[0].case, time: 0 };
  part("close").checked = true; // what the poster shows
  if (!follow()) open(poster.case, poster.focus ?? "", poster.time);
}

start();
