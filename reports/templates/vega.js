// Vega, Vega-Lite and Vega-Embed, deflated to a third in the page: unpacked when the first chart is drawn.

/** @type {Promise<Function> | undefined} */
let library;

/** @returns {Promise<Function>} vegaEmbed */
async function unpack() {
  const bytes = Uint8Array.from(atob(document.getElementById("vega").textContent), (letter) => letter.charCodeAt(0));
  const stream = new Blob([bytes]).stream().pipeThrough(new DecompressionStream("deflate"));
  new Function(`"use strict";${await new Response(stream).text()}`)();
  return window.vegaLibrary;
}

/** @param {...any} given what vegaEmbed takes */
window.vegaEmbed = async (...given) => (await (library ??= unpack()))(...given);
