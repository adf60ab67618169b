// Replay, second part: conservation over time of the run in focus, drawn by Vega-Lite from the packed series.

let plots = null, pending = 0;
const FLOOR = 1e-12; // as in the report: round-off
const percentText = (x) =>
  Number.isNaN(x) ? "–" : `${Math.abs(x) < FLOOR ? 0 : Number((100 * x).toPrecision(2))} %`.replace(/^-/, "−");
const secondsText = (t) => `${t.toFixed(3)} s`;

/** Value of a series of a run at a time; NaN where there is none. */
function seriesAt(scene, run, name, time) {
  const frame = Math.min(Math.ceil(time / scene.frame - 1e-6), run.motion.frames - 1);
  return valueOf(run.motion.rest[1][recorded.series.indexOf(name) * run.motion.frames + frame]);
}

/** The focused run's conservation, the other shown runs faint behind it, the energy its law leaves dashed. */
async function plot() {
  const ticket = ++pending;
  const scene = await sceneOf(state.scene), spec = JSON.parse(part("plots-spec").textContent);
  const focus = focused(scene), truth = scene.truths[focus.law];
  const others = scene.runs.filter((r) => state.runs.includes(r.contestant) && r !== focus);
  const rows = (name, some) => some.flatMap((r) => [...Array(r.motion.frames).keys()].map((frame) => ({
    t: frame * scene.frame, run: r.contestant, value: seriesAt(scene, r, name, frame * scene.frame),
  }))).filter((row) => !Number.isNaN(row.value));
  const expected = [...Array(truth.frames).keys()].map((frame) => ({
    t: frame * scene.frame, value: valueOf(truth.rest[0][truth.frames + frame]) })).filter((row) => !Number.isNaN(row.value));
  const limit = recorded.limit;
  spec.datasets = {
    once: [{}],
    contacts: focus.contacts.map(([start]) => ({ t: start })),
    expected: expected.map((row) => ({ ...row, low: row.value - limit, high: row.value + limit })),
    ...Object.fromEntries(recorded.series.map((name) => [name, rows(name, [focus])])),
    ...Object.fromEntries(recorded.series.map((name) => [`${name} of others`, rows(name, others)])),
  };
  spec.vconcat = spec.vconcat.filter((child) => spec.datasets[child.name].length);
  for (const child of spec.vconcat) child.layer = child.layer.filter((layer) => spec.datasets[layer.data.name].length);
  part("plots-title").textContent = `Conservation over time: ${focus.contestant} in ${scene.case}`;
  const place = document.createElement("div");
  const made = await window.vegaEmbed(place, spec, { renderer: "svg", actions: false });
  if (ticket !== pending) return made.finalize(); // another run was chosen meanwhile
  if (plots) plots.finalize();
  plots = made;
  part("plots").replaceChildren(place);
  moveCursor();
}

/** The upright line at the replay's time, not more often than the eye needs. */
let moved = 0;
function moveCursor() {
  moved = performance.now();
  if (plots) plots.view.signal("now", state.time).runAsync();
}
