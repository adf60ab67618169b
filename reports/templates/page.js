// @ts-check
// Everything here only adds: the drawings and tables it replaces stand in the page without it.

/** @typedef {[number | null, string | null, string]} Rung error, cost in ms (empty: not timed), step */
/** @typedef {{measures: string[], units: string[], rows: any[][]}} Rungs policy, step, step text, cost, one a measure */

const page = JSON.parse(document.getElementById("page").textContent);
const FLOOR = 1e-12; // as in the report: round-off
let goal = page.target;

/** @param {Element} box @returns {any} */
const jsonOf = (box) => JSON.parse(box.textContent);

/** Put a live drawing in place of what the box shows; on failure that stays. @param {Element} box @param {object} spec */
async function draw(box, spec) {
  const turn = (box.turn = (box.turn || 0) + 1);
  const live = document.createElement("div");
  live.className = "live";
  box.append(live);
  try {
    const result = await window.vegaEmbed(live, spec, { renderer: "svg", actions: false });
    if (turn !== box.turn) return live.remove(); // another drawing was asked for meanwhile
    // The view's own size would stop the drawing from following the width of the page.
    const svg = live.querySelector("svg");
    // One picture with a name: the table below holds its marks.
    for (const part of live.querySelectorAll("[role], [aria-label]")) {
      for (const name of ["role", "aria-label", "aria-roledescription"]) part.removeAttribute(name);
    }
    svg.setAttribute("role", "img");
    svg.setAttribute("aria-label", box.getAttribute("aria-label") || "chart");
    svg.setAttribute("viewBox", svg.getAttribute("viewBox") || `0 0 ${svg.getAttribute("width")} ${svg.getAttribute("height")}`);
    for (const old of box.querySelectorAll(".static, .live")) if (old !== live) old.remove();
    box.dataset.drawn = "script";
    box.view = result.view;
    result.view.addEventListener("click", (_, item) => choose(box, item && item.datum));
    return result;
  } catch (problem) {
    live.remove();
    throw problem;
  }
}

/** A point stands for a run: whoever shows runs (the replay) opens it. @param {Element} box @param {any} point */
function choose(box, point) {
  const figure = box.closest("[data-case]");
  if (!figure || !point || !point.policy) return;
  const detail = { scene: figure.dataset.case, policy: point.policy, step: point.step_text || "" };
  document.dispatchEvent(new CustomEvent("impactbench-point", { detail }));
}

/** @param {Element} box */
async function drawSpeed(box) {
  await draw(box, jsonOf(box.querySelector(".spec")));
  if (goal !== page.target) aim(box);
}

/** Move the line at the target of a chart that has one. @param {Element} box */
function aim(box) {
  if (box.view && "target" in (box.view.getState().signals || {})) box.view.signal("target", goal).run();
}

// Charts are drawn as they come near the window, so that a page of many can be read and scrolled at once.
const charts = [...document.querySelectorAll(".chart:has(.spec)")];
const watcher = new IntersectionObserver((entries) => {
  for (const entry of entries) {
    if (!entry.isIntersecting) continue;
    watcher.unobserve(entry.target);
    if (entry.target.scrollWidth > entry.target.clientWidth) entry.target.tabIndex = 0; // keys scroll it
    drawSpeed(entry.target);
  }
}, { rootMargin: "300px" });

/** Same rule as the report's: the cheapest rung that meets the target together with every finer one.
 * @param {Rung[]} ladder @param {number} target */
function score(ladder, target) {
  let best = null;
  for (const rung of ladder) {
    if (rung[0] === null || rung[0] > target) break;
    // Not timed: steps are all there is to save, and the ladder runs from fine to coarse.
    if (rung[1] !== null && (best === null || rung[1] === "" || Number(rung[1]) < Number(best[1]))) best = rung;
  }
  return best;
}

/** Seconds of a step such as 1/240; none for what moves from event to event. @param {string} text */
function seconds(text) {
  const [above, below] = text.split("/").map(Number);
  return (below ? above / below : above) || Infinity;
}
/** @param {Rung} rung */
const cost = (rung) => (rung[1] ? `${rung[1]} ms` : rung[2] || "any step");
/** @param {Rung} rung */
function price(rung) {
  const step = /^\d/.test(rung[2]) ? `${rung[2]} s` : "no fixed step";
  return rung[1] ? `${rung[1]} (${step})` : step;
}
/** @param {number} target */
const percent = (target) => `${Number((100 * target).toPrecision(3))} %`;
// As in the report: letters that run from right to left, and marks that change the direction.
const TURNING = /[\u0590-\u08ff\u200e\u200f\u202a-\u202e\u2066-\u2069\ufb1d-\ufdff\ufe70-\ufefc\u{10800}-\u{10fff}\u{1e800}-\u{1efff}]/u;
/** @param {string} name */
const isolated = (name) => (TURNING.test(name) ? `\u2068${name}\u2069` : name);
/** @param {string[]} names */
const listing = (names) => names.slice(0, 20).map(isolated).join(", ") + (names.length > 20 ? ` and ${names.length - 20} more` : "");

/** The report's sentence for one row of the scoreboard. @param {HTMLTableRowElement} row @param {number} target */
function sentence(row, target) {
  const reached = [], missed = [], silent = [];
  [...row.cells].slice(1).forEach((cell, index) => {
    const policy = page.policies[index];
    if (cell.className === "state") silent.push(policy);
    const ladder = page.ladders[row.dataset.row][index];
    if (!ladder) return;
    const best = score(ladder, target);
    if (best) reached.push({ cost: Number(best[1]) || Number((1 / seconds(best[2])).toPrecision(3)), policy, price: price(best) });
    else missed.push(policy);
  });
  reached.sort((a, b) => a.cost - b.cost || (a.policy < b.policy ? -1 : 1));
  const what = row.dataset.unit === "1" ? `${percent(target)} error` : `an error of ${target} ${row.dataset.unit}`;
  const scale = row.dataset.timed === "1" ? "ms per simulated second" : "coarsest step that does";
  const best = reached.map((item) => `${isolated(item.policy)} ${item.price}`).join("; ");
  let text = best ? `To stay below ${what}, ${scale}: ${best}.` : `No policy stays below ${what}.`;
  if (missed.length && best) text += ` ${listing(missed)} ${missed.length === 1 ? "does" : "do"} not get there.`;
  return text + (silent.length ? ` No result: ${listing(silent)}.` : "");
}

const rows = [...document.querySelectorAll("#scores tbody tr")];
rows.forEach((row, index) => (row.dataset.row = String(index)));
/** Show everything for another target. @param {number} index */
function retarget(index) {
  goal = page.targets[index];
  for (const slider of document.querySelectorAll("input.target")) {
    slider.value = String(index);
    slider.setAttribute("aria-valuetext", percent(goal));
  }
  for (const text of document.querySelectorAll(".target-text")) text.textContent = percent(goal);
  for (const row of rows) {
    page.ladders[row.dataset.row].forEach((ladder, index) => {
      if (!ladder) return;
      const best = score(ladder, goal), cell = row.cells[index + 1];
      cell.className = best ? "met" : "missed";
      cell.textContent = best ? `✓ ${cost(best)}` : "✕ not reached";
    });
  }
  for (const text of document.querySelectorAll(".reach")) {
    const row = rows.find((one) => one.dataset.case === text.dataset.case);
    if (row) text.textContent = sentence(row, goal);
  }
  charts.forEach(aim);
}

/** Points of a chart without rails. @param {Rungs} rungs @param {number} pick @param {(rung: any[]) => [number, number]} place */
function points(rungs, pick, place) {
  const found = [];
  for (const rung of rungs.rows) {
    const [policy, step, text, cost] = rung, error = rung[4 + pick];
    if (error === null || cost === null) continue;
    const [x, y] = place([step, cost, Math.max(error, FLOOR)]);
    const name = page.policies[policy];
    const first = !found.some((one) => one.policy === name); // rungs come finest first
    const profile = name.includes("/default") ? "default" : "other";
    found.push({ policy: name, engine: name.split("/")[0], profile, step, step_text: text, error, cost, x, y, label: first ? name : "" });
  }
  return found;
}

/** Powers of ten around the values, at most nine. @param {number[]} values */
function decades(values) {
  const logs = values.map(Math.log10), low = Math.floor(Math.min(...logs)), high = Math.ceil(Math.max(...logs));
  const stride = 1 + Math.floor((high - low) / 9);
  return Array.from({ length: Math.floor((high - low) / stride) + 1 }, (_, k) => 10 ** (low + k * stride));
}

/** Move the names of lines that end at one height apart. @param {any[]} values */
function spread(values) {
  const logs = values.map((one) => Math.log10(one.y)), line = 0.055 * Math.max(1e-9, Math.max(...logs) - Math.min(...logs));
  let last = -Infinity;
  for (const one of values.filter((value) => value.label).sort((a, b) => a.y - b.y)) {
    last = Math.max(Math.log10(one.y), last + line);
    one.label_y = 10 ** last;
  }
}

/** @param {any[]} values @param {string} x @param {string} y */
function plain(values, x, y) {
  const spec = structuredClone(page.blank);
  spread(values);
  spec.datasets = { ...spec.datasets, points: values };
  for (const layer of spec.layer) {
    if (!layer.encoding.x.axis || !layer.encoding.y.axis) continue;
    Object.assign(layer.encoding.x.axis, { title: x, values: decades(values.map((one) => one.x)) });
    Object.assign(layer.encoding.y.axis, { title: y, values: decades(values.map((one) => one.y)) });
  }
  return spec;
}

/** Show a measure in the table behind the chart. @param {Element} section @param {Rungs} rungs @param {number} pick @param {string} name */
function tabulate(section, rungs, pick, name) {
  const table = section.querySelector(".points table");
  table.tHead.rows[0].cells[2].textContent = name;
  [...table.tBodies[0].rows].forEach((row, index) => {
    const value = rungs.rows[index][4 + pick];
    row.cells[2].textContent = value === null ? "–" : String(value);
  });
}

/** Draw a family's charts with another error measure. @param {HTMLSelectElement} select */
async function remeasure(select) {
  const figure = select.closest("figure"), section = document.querySelector(`section[data-case="${CSS.escape(figure.dataset.case)}"]`);
  const rungs = jsonOf(figure.querySelector(".rungs")), pick = select.selectedIndex;
  const name = select.value + (rungs.units[pick] === "1" ? " (1 = the scene's own scale)" : ` [${rungs.units[pick]}]`);
  const box = [...figure.querySelectorAll(".chart")].find((one) => one.offsetParent); // the wide or the narrow one
  const spec = jsonOf(box.querySelector(".spec"));
  const spent = spec.layer[0].encoding.y.axis.title;
  watcher.unobserve(box);
  if (pick === 0) await drawSpeed(box);
  else await draw(box, plain(points(rungs, pick, ([, used, error]) => [error, used]), name, spent));
  const order = section && section.querySelector(".plain");
  if (order) {
    const steps = { ...rungs, rows: rungs.rows.filter((rung) => rung[1] > 0) };
    await draw(order, plain(points(steps, pick, ([step, , error]) => [step, error]), "step [s]", name));
  }
  tabulate(section, rungs, pick, name);
  if (pick) box.dataset.measure = select.value;
  else delete box.dataset.measure;
}

/** Follow #scenario=NAME to the case's section, or to its row where no chart shows it; #...&t= is the replay's. */
function follow() {
  const wanted = new URLSearchParams(location.hash.slice(1));
  const name = wanted.get("scenario");
  if (!name || wanted.has("t")) return;
  const has = (one) => one.dataset.case === name || one.dataset.family === name;
  const target = [...document.querySelectorAll("section[data-case]"), ...rows].find(has);
  if (target) target.scrollIntoView();
}

for (const slider of document.querySelectorAll("input.target")) slider.addEventListener("input", () => retarget(Number(slider.value)));
for (const select of document.querySelectorAll("select.measure")) select.addEventListener("change", () => remeasure(select));
const filter = document.getElementById("filter");
filter.addEventListener("input", () => {
  for (const row of rows) row.hidden = !row.cells[0].textContent.toLowerCase().includes(filter.value.toLowerCase());
});
window.addEventListener("hashchange", follow);
for (const control of document.querySelectorAll(".control")) control.hidden = false;
charts.forEach((box) => watcher.observe(box));
follow();
