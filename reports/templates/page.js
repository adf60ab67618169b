// Everything here only adds: the drawings and tables it replaces stand in the page without it.
async function draw(box) {
  const spec = JSON.parse(box.querySelector("script").textContent);
  const live = document.createElement("div");
  live.className = "live";
  box.append(live);
  try {
    const result = await window.vegaEmbed(live, spec, { renderer: "svg", actions: false });
    // The view's own size would stop the drawing from following the width of the page.
    const svg = live.querySelector("svg");
    svg.setAttribute("viewBox", svg.getAttribute("viewBox") || `0 0 ${svg.getAttribute("width")} ${svg.getAttribute("height")}`);
    box.querySelector(".static").remove();
    box.dataset.drawn = "script";
    return result;
  } catch (problem) {
    live.remove(); // the static drawing stays
    throw problem;
  }
}

// One after another with a pause between, so that the page can be read and scrolled meanwhile.
async function drawAll() {
  for (const box of document.querySelectorAll(".chart")) {
    await draw(box);
    await new Promise((done) => setTimeout(done, 0));
  }
}

// Same rule as the report's: the cheapest rung that meets the target together with every finer one.
function score(ladder, target) {
  let best = null;
  for (const [error, cost, text] of ladder) {
    if (error === null || error > target) break;
    if (cost !== null && (best === null || cost < best.cost)) best = { cost, text };
  }
  return best;
}

const select = document.getElementById("target");
const filter = document.getElementById("filter");
const rows = [...document.querySelectorAll("#scores tbody tr")];
function update() {
  document.getElementById("target-text").textContent = select.selectedOptions[0].textContent;
  for (const cell of document.querySelectorAll("#scores td[data-ladder]")) {
    const best = score(JSON.parse(cell.dataset.ladder), Number(select.value));
    cell.className = best ? "met" : "missed";
    cell.textContent = best ? `✓ ${best.text}` : "✕ not reached";
  }
}
select.addEventListener("change", update);
filter.addEventListener("input", () => {
  for (const row of rows) row.hidden = !row.cells[0].textContent.toLowerCase().includes(filter.value.toLowerCase());
});
document.querySelector(".control").hidden = false;
await drawAll();
