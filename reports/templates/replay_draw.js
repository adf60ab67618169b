// Replay, first part: packed tracks decoded, and bodies drawn on Canvas 2D. No WebGL, so that it works without a GPU.

/**
 * @typedef { {kind: string, size: number[], name: string, static: boolean, position?: number[], orientation?: number[]} } Body
 * @typedef { {frames: number, turning: boolean, low: number[], span: number[], data: string} } Track
 * @typedef { {places: Float64Array, turns: Float32Array|null, rest: Int16Array[], frames: number} } Motion
 *   places [frame][body][3] in metres, turns [frame][body][4] as (w, x, y, z); rest: the words that follow, by group
 * @typedef { {right: number[], up: number[], toward: number[], scale: number, u: number, v: number, width: number, height: number} } Camera
 */

const UNKNOWN = -32768; // the word for "no value"

/** @param {string} text @returns {Promise<Uint16Array>} words of a packed text: base64, deflate, two byte planes */
async function wordsOf(text) {
  const bytes = Uint8Array.from(atob(text), (letter) => letter.charCodeAt(0));
  const stream = new Blob([bytes]).stream().pipeThrough(new DecompressionStream("deflate"));
  const planes = new Uint8Array(await new Response(stream).arrayBuffer());
  const words = new Uint16Array(planes.length / 2);
  for (let i = 0; i < words.length; i++) words[i] = planes[i] | (planes[words.length + i] << 8);
  return words;
}

/** Rows of a group again: zigzag undone, then differences summed `times` times; sums wrap around at 16 bits.
 *  @param {Uint16Array} words @param {number} start @param {number} rows @param {number} count @param {number} times */
function rowsOf(words, start, rows, count, times) {
  const found = new Int16Array(rows * count);
  for (let i = 0; i < found.length; i++) found[i] = (words[start + i] >>> 1) ^ -(words[start + i] & 1);
  for (let turn = 0; turn < times; turn++)
    for (let row = 0; row < rows; row++)
      for (let i = row * count + 1; i < (row + 1) * count; i++) found[i] += found[i - 1];
  return found;
}

/** @param {Track} track @param {number} bodies @param {number[]} rest rows of the groups after the motion
 *  @returns {Promise<Motion>} */
async function motionOf(track, bodies, rest) {
  const words = await wordsOf(track.data);
  const count = track.frames;
  const columns = track.turning ? 7 : 3;
  const rows = rowsOf(words, 0, columns * bodies, count, 2);
  const places = new Float64Array(count * bodies * 3);
  const turns = track.turning ? new Float32Array(count * bodies * 4) : null;
  for (let column = 0; column < columns; column++)
    for (let body = 0; body < bodies; body++)
      for (let frame = 0; frame < count; frame++) {
        const word = rows[(column * bodies + body) * count + frame];
        const at = frame * bodies + body;
        if (column < 3) places[at * 3 + column] = ((word + 32767) / 65534) * track.span[column] + track.low[column];
        else if (turns) turns[at * 4 + column - 3] = word / 32767;
      }
  let start = columns * bodies * count;
  const groups = rest.map((n) => {
    const group = rowsOf(words, start, n, count, 1);
    start += n * count;
    return group;
  });
  return { places, turns, rest: groups, frames: count };
}

/** @param {number} word @returns {number} value of a logarithmic word; NaN where there is none */
function valueOf(word) {
  if (word === UNKNOWN) return NaN;
  return word === 0 ? 0 : Math.sign(word) * 1e-16 * 10 ** (Math.abs(word) / 1000);
}

const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];

/** Look along the axis that is not in the picture, or obliquely from above; the box [m] fills the panel.
 *  @param {any} scene @param {number} angle degrees about the vertical @param { {low: number[], high: number[]} } box
 *  @returns {Camera} */
function cameraOf(scene, angle, width, height, box) {
  let right, up, toward;
  if (scene.axes.length < 3) {
    [right, up] = scene.picture.map((axis) => [0, 1, 2].map((k) => Number(k === axis)));
    toward = [0, 1, 2].map((k) => Number(!scene.picture.includes(k)));
    if (toward[1]) toward = [0, -1, 0]; // x right and z up are seen from -y
  } else {
    const [a, e] = [(angle * Math.PI) / 180, 0.42];
    toward = [Math.cos(e) * Math.cos(a), Math.cos(e) * Math.sin(a), Math.sin(e)];
    right = [-Math.sin(a), Math.cos(a), 0];
    up = [-Math.sin(e) * Math.cos(a), -Math.sin(e) * Math.sin(a), Math.cos(e)];
  }
  const { low, high } = box;
  const corners = [...Array(8).keys()].map((i) => [0, 1, 2].map((k) => ((i >> k) & 1 ? high[k] : low[k])));
  const [us, vs] = [right, up].map((axis) => corners.map((corner) => dot(corner, axis)));
  const [u, v] = [us, vs].map((all) => (Math.min(...all) + Math.max(...all)) / 2);
  const wide = Math.max(...us) - Math.min(...us), tall = Math.max(...vs) - Math.min(...vs);
  return { right, up, toward, scale: Math.min((width - 16) / wide, (height - 16) / tall), u, v, width, height };
}

/** The part of the scene's box that the bodies fill at a time, as in the poster.
 *  @param {any} scene @param {Motion[]} motions @param {number} time */
function closer(scene, motions, time) {
  const low = [...scene.camera.high], high = [...scene.camera.low];
  for (const motion of motions)
    for (const { place, body, row } of posesAt(scene, motion, time)) {
      if (row < 0) continue;
      const reach = body.kind === "box" ? Math.hypot(...body.size) : body.size.reduce((sum, size) => sum + size);
      for (let k = 0; k < 3; k++) {
        low[k] = Math.min(low[k], Math.max(place[k] - reach, scene.camera.low[k]));
        high[k] = Math.max(high[k], Math.min(place[k] + reach, scene.camera.high[k]));
      }
    }
  return low.every((value, k) => value < high[k]) ? { low, high } : scene.camera; // all have left the picture
}

const acrossOf = (camera, p) => camera.width / 2 + (dot(p, camera.right) - camera.u) * camera.scale;
const downOf = (camera, p) => camera.height / 2 - (dot(p, camera.up) - camera.v) * camera.scale;

/** Columns of the rotation matrix of a unit quaternion (w, x, y, z): the body's own axes. */
function axesOf([w, x, y, z]) {
  return [
    [1 - 2 * (y * y + z * z), 2 * (x * y + w * z), 2 * (x * z - w * y)],
    [2 * (x * y - w * z), 1 - 2 * (x * x + z * z), 2 * (y * z + w * x)],
    [2 * (x * z + w * y), 2 * (y * z - w * x), 1 - 2 * (x * x + y * y)],
  ];
}

const UPRIGHT = [1, 0, 0, 0];

/** Place and turn of every body at a time: straight lines between frames.
 *  @param {any} scene @param {Motion} motion @param {number} time @returns { {place: number[], turn: number[], body: Body, row: number}[] } */
function posesAt(scene, motion, time) {
  const at = Math.min(Math.max(time / scene.frame, 0), motion.frames - 1);
  const before = Math.floor(at), after = Math.min(before + 1, motion.frames - 1), part = at - before;
  const n = scene.movable.length;
  return scene.bodies.map((body, index) => {
    const row = scene.rows[index];
    if (row < 0) return { place: body.position, turn: body.orientation, body, row };
    const mix = (values, k, size) =>
      values[(before * n + row) * size + k] * (1 - part) + values[(after * n + row) * size + k] * part;
    const place = [0, 1, 2].map((k) => mix(motion.places, k, 3));
    if (!motion.turns) return { place, turn: UPRIGHT, body, row };
    const turn = [0, 1, 2, 3].map((k) => mix(motion.turns, k, 4));
    const length = Math.hypot(...turn) || 1;
    return { place, turn: turn.map((q) => q / length), body, row };
  });
}

/** Outline of one body as a path; boxes show the faces that look this way.
 *  @param {CanvasRenderingContext2D} pen @param {Camera} camera */
function trace(pen, camera, { place, turn, body }) {
  const x = acrossOf(camera, place), y = downOf(camera, place), size = body.size;
  pen.beginPath();
  if (body.kind === "sphere") return pen.arc(x, y, size[0] * camera.scale, 0, 2 * Math.PI);
  const axes = axesOf(turn);
  const across = axes.map((axis) => dot(axis, camera.right) * camera.scale);
  const down = axes.map((axis) => -dot(axis, camera.up) * camera.scale);
  if (body.kind === "capsule") {
    // Two half circles about the ends; seen end on, a circle.
    const r = size[0] * camera.scale, angle = Math.atan2(down[2], across[2]);
    const dx = across[2] * size[1], dy = down[2] * size[1];
    pen.arc(x + dx, y + dy, r, angle - Math.PI / 2, angle + Math.PI / 2);
    pen.arc(x - dx, y - dy, r, angle + Math.PI / 2, angle + 1.5 * Math.PI);
    return pen.closePath();
  }
  for (let k = 0; k < 3; k++) {
    const facing = dot(axes[k], camera.toward);
    if (Math.abs(facing) < 1e-3) continue;
    const i = (k + 1) % 3, j = (k + 2) % 3, s = Math.sign(facing) * size[k];
    const cx = x + across[k] * s, cy = y + down[k] * s;
    const ix = across[i] * size[i], iy = down[i] * size[i], jx = across[j] * size[j], jy = down[j] * size[j];
    pen.moveTo(cx + ix + jx, cy + iy + jy);
    pen.lineTo(cx - ix + jx, cy - iy + jy);
    pen.lineTo(cx - ix - jx, cy - iy - jy);
    pen.lineTo(cx + ix - jx, cy + iy - jy);
    pen.closePath();
  }
}

/** A half-space: what lies behind its plane is shaded; one that is seen obliquely is a square of it. */
function drawPlane(pen, camera, scene, body, ink) {
  const n = body.size, { low, high } = scene.camera;
  const centre = [0, 1, 2].map((k) => (low[k] + high[k]) / 2);
  const off = dot(n, centre) - dot(n, body.position);
  const foot = centre.map((c, k) => c - off * n[k]);
  const far = Math.hypot(...high.map((h, k) => h - low[k]));
  if (scene.axes.length < 3) {
    const [a, b] = [dot(n, camera.right), -dot(n, camera.up)];
    if (Math.hypot(a, b) < 1e-6) return;
    const x = acrossOf(camera, foot), y = downOf(camera, foot), reach = 2 * far * camera.scale + camera.width;
    pen.beginPath();
    pen.moveTo(x - b * reach, y + a * reach);
    pen.lineTo(x + b * reach, y - a * reach);
    pen.lineTo(x + (b - a) * reach, y - (a + b) * reach);
    pen.lineTo(x - (a + b) * reach, y + (a - b) * reach);
  } else {
    const side = Math.abs(n[2]) < 0.9 ? [-n[1], n[0], 0] : [1, 0, 0];
    const t = side.map((s, k) => s - dot(side, n) * n[k]), size = Math.hypot(...t);
    const e = t.map((s) => (s / size) * far * 0.5);
    const f = [n[1] * e[2] - n[2] * e[1], n[2] * e[0] - n[0] * e[2], n[0] * e[1] - n[1] * e[0]];
    pen.beginPath();
    for (const [i, j] of [[1, 1], [-1, 1], [-1, -1], [1, -1]]) {
      const p = foot.map((c, k) => c + i * e[k] + j * f[k]);
      pen.lineTo(acrossOf(camera, p), downOf(camera, p));
    }
  }
  pen.closePath();
  pen.strokeStyle = ink.soft;
  pen.lineWidth = 1;
  if (dot(n, camera.toward) > -1e-6) {
    pen.fillStyle = ink.ground;
    pen.fill();
  }
  pen.stroke();
}

/** Farthest first. */
const painted = (camera, poses) =>
  poses
    .filter((pose) => pose.body.kind !== "plane")
    .map((pose) => ({ ...pose, depth: dot(pose.place, camera.toward) }))
    .sort((a, b) => a.depth - b.depth);

/** A run's panel: ground, bodies coloured and hatched by their error, the truth's outlines, contact marks. */
function drawPanel(pen, camera, scene, run, ghost, time, ink, still) {
  const frame = Math.min(Math.round(time / scene.frame), run.motion.frames - 1);
  const poses = posesAt(scene, run.motion, time);
  pen.clearRect(0, 0, camera.width, camera.height);
  for (const pose of poses) if (pose.body.kind === "plane") drawPlane(pen, camera, scene, pose.body, ink);
  for (const pose of painted(camera, poses)) {
    const level = pose.row < 0 ? 0 : run.motion.rest[0][pose.row * run.motion.frames + frame];
    trace(pen, camera, pose);
    pen.fillStyle = pose.row < 0 ? ink.ground : ink.fills[level];
    pen.fill();
    const reach = pose.body.size[0] * camera.scale, small = reach < 4; // pixels; edges and hatchings would cover it
    if (ink.hatches[level] && !small) {
      pen.fillStyle = ink.hatches[level];
      pen.fill();
    }
    if (small && level < 3) continue;
    pen.strokeStyle = ink.line;
    pen.lineWidth = (level > 3 ? 2.5 : 1.2) * Math.min(1, reach / 8);
    pen.stroke();
    if (run.motion.turns && pose.body.kind === "sphere") drawSpoke(pen, camera, pose);
  }
  if (ghost) drawOutlines(pen, camera, scene, ghost, time, ink.ghost, [4, 3]);
  drawContacts(pen, camera, poses, run.contacts, time, ink, still);
}

/** From a ball's centre to its surface along its own x axis (z where x points away), so that turning shows. */
function drawSpoke(pen, camera, { place, turn, body }) {
  const axis = axesOf(turn)[camera.toward[0] ? 2 : 0];
  const tip = place.map((c, k) => c + axis[k] * body.size[0]);
  pen.beginPath();
  pen.moveTo(acrossOf(camera, place), downOf(camera, place));
  pen.lineTo(acrossOf(camera, tip), downOf(camera, tip));
  pen.stroke();
}

const CROWD = 100; // bodies from which outlines over one another would show nothing, and dashes would cost most

/** Outlines of the movable bodies; of a crowd their centres. */
function drawOutlines(pen, camera, scene, motion, time, colour, dash) {
  if (scene.movable.length > CROWD) {
    pen.fillStyle = colour;
    for (const { place, row } of posesAt(scene, motion, time))
      if (row >= 0) pen.fillRect(acrossOf(camera, place) - 2, downOf(camera, place) - 2, 4, 4);
    return;
  }
  pen.strokeStyle = colour;
  pen.lineWidth = 1.5;
  pen.setLineDash(dash);
  for (const pose of posesAt(scene, motion, time)) {
    if (pose.row < 0) continue;
    trace(pen, camera, pose);
    pen.stroke();
  }
  pen.setLineDash([]);
}

const FLASH = 0.12; // s a contact's ring is shown

/** A ring where a contact begins, then a cross for as long as it lasts. */
function drawContacts(pen, camera, poses, contacts, time, ink, still) {
  pen.strokeStyle = ink.contact;
  pen.lineWidth = 2;
  for (const [start, end, , , on, ...offset] of contacts) {
    if (start > time) break; // they are in order of their start
    if (time > Math.max(end, start + FLASH)) continue;
    const { place, turn, body } = poses[on];
    const axes = body.kind === "sphere" ? null : axesOf(turn); // a ball rolls over what it touches
    const arm = axes ? [0, 1, 2].map((k) => axes[0][k] * offset[0] + axes[1][k] * offset[1] + axes[2][k] * offset[2]) : offset;
    const point = place.map((c, k) => c + arm[k]);
    const x = acrossOf(camera, point), y = downOf(camera, point), age = (time - start) / FLASH;
    pen.beginPath();
    if (age <= 1) pen.arc(x, y, still ? 7 : 4 + 7 * age, 0, 2 * Math.PI);
    else for (const s of [-1, 1]) {
      pen.moveTo(x - 3, y - 3 * s);
      pen.lineTo(x + 3, y + 3 * s);
    }
    pen.stroke();
  }
}

/** Colours of the page's own scheme, and hatchings: the second sign of an error. */
function inkOf(element) {
  const style = getComputedStyle(element);
  const of = (name) => style.getPropertyValue(name).trim();
  const hatch = (crossed) => {
    const tile = document.createElement("canvas");
    tile.width = tile.height = 6;
    const pen = tile.getContext("2d");
    pen.strokeStyle = of("--ink");
    pen.beginPath();
    for (const [x, y, a, b] of [[-1, 1, 1, -1], [0, 6, 6, 0], [5, 7, 7, 5]]) pen.moveTo(x, y), pen.lineTo(a, b);
    if (crossed) for (const [x, y, a, b] of [[-1, 5, 1, 7], [0, 0, 6, 6], [5, -1, 7, 1]]) pen.moveTo(x, y), pen.lineTo(a, b);
    pen.stroke();
    return pen.createPattern(tile, "repeat");
  };
  return {
    line: of("--ink"), soft: of("--soft"), ground: of("--panel"), ghost: of("--link"), contact: of("--bad"),
    fills: ["--level-0", "--level-1", "--level-2", "--level-3", "--level-4"].map(of),
    hatches: [null, null, null, hatch(false), hatch(true)],
  };
}
