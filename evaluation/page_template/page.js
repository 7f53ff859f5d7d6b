"use strict";

const data = JSON.parse(document.getElementById("data").textContent);

const COLOURS = {
  right: "#0072b2",
  wrong: "#d55e00",
  none: "#777777",
  silent: "#777777",
};
const WORDS = {
  right: "right",
  wrong: "wrong",
  none: "no true place",
  silent: "no candidate",
};
// Half of the length that a scan's picture shows [m], and of a bar [m].
const SCAN_REACH = 50;
const BAR = { map: 100, scan: 20 };
const HIGHEST = 15;

const byId = (id) => document.getElementById(id);
const state = { pair: 0, method: 0, query: 0, rank: 0 };

function element(name, text, className) {
  const made = document.createElement(name);
  if (text !== undefined) made.textContent = text;
  if (className) made.className = className;
  return made;
}

function bytesOf(base64) {
  return Uint8Array.from(atob(base64), (letter) => letter.charCodeAt(0));
}

/** Unpacks the scans of a drive when they are first wanted. */
async function scansOf(drive) {
  if (!drive.unpacked) {
    const packed = new Blob([bytesOf(drive.points)]).stream();
    const plain = packed.pipeThrough(new DecompressionStream("deflate"));
    drive.unpacked = new Response(plain).arrayBuffer().then((buffer) => {
      const planes = new Uint8Array(buffer);
      const size = planes.length / 3;
      const starts = [0];
      for (const count of drive.counts) starts.push(starts.at(-1) + count);
      return { planes, size, starts };
    });
  }
  return drive.unpacked;
}

async function viewOf(drive) {
  if (!drive.picture) {
    const picture = new Image();
    picture.src = "data:image/webp;base64," + drive.view;
    drive.picture = picture.decode().then(() => picture);
  }
  return drive.picture;
}

const pairNow = () => data.pairs[state.pair];
const methodNow = () => pairNow().methods[state.method];
const databaseNow = () => data.drives[pairNow().database];
const queryDriveNow = () => data.drives[pairNow().query];

/** What became of a query: right, wrong, none (to be found) or silent. */
function outcome(pair, method, query) {
  if (method.ranks[query] === 1) return "right";
  if (!method.best[query].length) return "silent";
  return pair.matches[query].length ? "wrong" : "none";
}

function distance(pair, query, place) {
  const a = data.drives[pair.query], b = data.drives[pair.database];
  const i = pair.queries[query], j = pair.places[place];
  return Math.hypot(a.x[i] - b.x[j], a.y[i] - b.y[j], a.z[i] - b.z[j]);
}

/** Fits a canvas to its size on the screen; returns what to draw with. */
function prepare(canvas) {
  const scale = window.devicePixelRatio || 1;
  const width = canvas.clientWidth, height = canvas.clientHeight;
  canvas.width = Math.max(1, Math.round(width * scale));
  canvas.height = Math.max(1, Math.round(height * scale));
  const context = canvas.getContext("2d");
  context.scale(scale, scale);
  context.clearRect(0, 0, width, height);
  return { context, width, height };
}

/** Scale and offset from metres to the pixels of the map's canvas. */
function mapFrame(width, height) {
  const database = databaseNow(), query = queryDriveNow();
  let [left, right, bottom, top] = database.extent;
  for (const [x, y] of query.route) {
    left = Math.min(left, x - 10);
    right = Math.max(right, x + 10);
    bottom = Math.min(bottom, y - 10);
    top = Math.max(top, y + 10);
  }
  const scale = Math.min(width / (right - left), height / (top - bottom));
  const x0 = 0.5 * (width - scale * (right - left)) - scale * left;
  const y0 = 0.5 * (height + scale * (top - bottom)) + scale * bottom;
  return { scale, at: (x, y) => [x0 + scale * x, y0 - scale * y] };
}

function drawBar(context, width, height, scale, length) {
  const end = width - 10, base = height - 10;
  context.strokeStyle = context.fillStyle = "#000";
  context.lineWidth = 2;
  context.beginPath();
  context.moveTo(end - scale * length, base);
  context.lineTo(end, base);
  context.stroke();
  context.font = "12px system-ui, sans-serif";
  context.textAlign = "right";
  context.fillText(length + " m", end, base - 5);
}

function drawOutcome(context, kind, x, y, size) {
  context.strokeStyle = context.fillStyle = COLOURS[kind];
  context.lineWidth = 2;
  context.beginPath();
  if (kind === "right") {
    context.arc(x, y, size, 0, 2 * Math.PI);
    context.fill();
  } else if (kind === "none") {
    context.arc(x, y, size, 0, 2 * Math.PI);
    context.stroke();
  } else if (kind === "silent") {
    context.fillRect(x - size, y - 1.5, 2 * size, 3);
  } else {
    context.moveTo(x - size, y - size);
    context.lineTo(x + size, y + size);
    context.moveTo(x + size, y - size);
    context.lineTo(x - size, y + size);
    context.stroke();
  }
}

function drawRoute(context, frame, route, colour) {
  context.strokeStyle = colour;
  context.lineWidth = 1.5;
  context.beginPath();
  for (const [x, y] of route) context.lineTo(...frame.at(x, y));
  context.stroke();
}

async function drawMap() {
  const picture = await viewOf(databaseNow());
  const { context, width, height } = prepare(byId("map"));
  const frame = mapFrame(width, height);
  const pair = pairNow(), method = methodNow();
  const database = databaseNow(), drive = queryDriveNow();
  const [left, right, bottom, top] = database.extent;
  context.drawImage(
    picture, ...frame.at(left, top),
    frame.scale * (right - left), frame.scale * (top - bottom));
  drawRoute(context, frame, database.route, "#ffffff");
  const of = (d, i) => frame.at(d.x[i], d.y[i]);
  pair.queries.forEach((index, query) => {
    const size = Math.max(2, Math.min(4, 2.2 * frame.scale));
    drawOutcome(
      context, outcome(pair, method, query), ...of(drive, index), size);
  });
  const [x, y] = of(drive, pair.queries[state.query]);
  context.strokeStyle = "#009e73";
  context.lineWidth = 2.5;
  for (const place of pair.matches[state.query]) {
    const [u, v] = of(database, pair.places[place]);
    context.strokeRect(u - 5, v - 5, 10, 10);
  }
  const chosen = method.best[state.query][state.rank];
  if (chosen !== undefined) {
    const [u, v] = of(database, pair.places[chosen]);
    context.strokeStyle = "#000";
    context.lineWidth = 2;
    context.setLineDash([6, 4]);
    context.beginPath();
    context.moveTo(x, y);
    context.lineTo(u, v);
    context.stroke();
    context.setLineDash([]);
    context.fillStyle = "#e69f00";
    context.beginPath();
    context.arc(u, v, 6, 0, 2 * Math.PI);
    context.fill();
    context.stroke();
  }
  drawHeading(context, x, y, -drive.yaw[pair.queries[state.query]], 11);
  drawBar(context, width, height, frame.scale, BAR.map);
}

/** Draws an arrow head; the angle is from the right, clockwise. */
function drawHeading(context, x, y, angle, size) {
  context.save();
  context.translate(x, y);
  context.rotate(angle);
  context.fillStyle = "#000";
  context.strokeStyle = "#fff";
  context.lineWidth = 1.5;
  context.beginPath();
  context.moveTo(size, 0);
  context.lineTo(-0.7 * size, 0.65 * size);
  context.lineTo(-0.35 * size, 0);
  context.lineTo(-0.7 * size, -0.65 * size);
  context.closePath();
  context.fill();
  context.stroke();
  context.restore();
}

async function drawScan(canvas, drive, index) {
  const scans = index === undefined ? null : await scansOf(drive);
  const { context, width, height } = prepare(canvas);
  if (!scans) {
    context.fillStyle = "#777";
    context.textAlign = "center";
    context.font = "15px system-ui, sans-serif";
    context.fillText("no candidate", width / 2, height / 2);
    return;
  }
  const scale = Math.min(width, height) / (2 * SCAN_REACH);
  // Driving direction up, or the world's y axis up.
  const turn = byId("heading").checked ? Math.PI / 2 : drive.yaw[index];
  const c = scale * Math.cos(turn), s = scale * Math.sin(turn);
  const { planes, size, starts } = scans;
  const dot = Math.max(1.4, 0.9 * data.cell * scale);
  for (let i = starts[index]; i < starts[index + 1]; i++) {
    const x = (planes[i] - 127.5) * data.cell;
    const y = (planes[size + i] - 127.5) * data.cell;
    const part = Math.min(
      1, planes[2 * size + i] * data.heightStep / HIGHEST);
    // The higher, the darker.
    context.fillStyle =
      `hsl(${205 + 35 * part}, ${60 + 25 * part}%, ${66 - 48 * part}%)`;
    context.fillRect(
      width / 2 + c * x - s * y - dot / 2,
      height / 2 - s * x - c * y - dot / 2, dot, dot);
  }
  drawHeading(context, width / 2, height / 2, -turn, 9);
  drawBar(context, width, height, scale, BAR.scan);
}

function drawStrip() {
  const { context, width, height } = prepare(byId("strip"));
  const pair = pairNow(), method = methodNow();
  const count = pair.queries.length, step = width / count;
  for (let query = 0; query < count; query++) {
    const kind = outcome(pair, method, query);
    // Heights differ too, for those who do not see the colours.
    const part = { right: 1, wrong: 0.6, none: 0.25, silent: 0.12 }[kind];
    context.fillStyle = COLOURS[kind];
    context.fillRect(
      query * step, height * (1 - part), Math.max(1, step - 0.6),
      height * part);
  }
  context.strokeStyle = "#000";
  context.lineWidth = 2;
  context.strokeRect(
    state.query * step - 1, 1, Math.max(3, step + 1), height - 2);
}

function showStatus() {
  const pair = pairNow(), method = methodNow();
  const kind = outcome(pair, method, state.query);
  const status = byId("status");
  status.replaceChildren(
    `Query ${state.query + 1} of ${pair.queries.length}, ${method.title}: `,
    element("span", WORDS[kind], kind));
  const best = method.best[state.query];
  if (best.length) {
    const metres = distance(pair, state.query, best[0]).toFixed(1);
    status.append(
      ` – best match ${metres} m away, score ` +
      method.scores[state.query][0].toFixed(4));
  }
  const counts = { right: 0, wrong: 0, none: 0, silent: 0 };
  pair.queries.forEach(
    (_, query) => { counts[outcome(pair, method, query)] += 1; });
  byId("query").setAttribute(
    "aria-valuetext", `query ${state.query + 1}: ${WORDS[kind]}`);
  const change = pair.change === null ? "" : `, TCR_sym ${pair.change}`;
  byId("query-caption").textContent =
    `Query: ${pair.query}, frame ` +
    queryDriveNow().frames[pair.queries[state.query]];
  const place = best[state.rank];
  byId("match-caption").textContent = place === undefined
    ? "No candidate"
    : `Match ${state.rank + 1}: ${pair.database}, frame ` +
      databaseNow().frames[pair.places[place]];
  byId("strip").title =
    `${counts.right} right, ${counts.wrong} wrong, ${counts.none} without a` +
    ` true place, ${counts.silent} without a candidate${change}`;
}

function showBest() {
  const pair = pairNow(), method = methodNow();
  const rows = method.best[state.query].map((place, rank) => {
    const right = pair.matches[state.query].includes(place);
    const row = element("tr", undefined, rank === state.rank ? "chosen" : "");
    const button = element("button", String(rank + 1));
    button.type = "button";
    const first = element("td");
    first.append(button);
    row.append(
      first,
      element("td", "frame " + databaseNow().frames[pair.places[place]]),
      element("td", method.scores[state.query][rank].toFixed(4)),
      element("td", distance(pair, state.query, place).toFixed(1) + " m"),
      element("td", right ? "✓ right" : "✗ wrong"));
    row.addEventListener("click", () => {
      state.rank = rank;
      show();
    });
    return row;
  });
  byId("best").tBodies[0].replaceChildren(...rows);
}

function showMethods() {
  const pair = pairNow();
  const rows = pair.methods.map((method) => {
    const kind = outcome(pair, method, state.query);
    const place = method.best[state.query][0];
    const rank = method.ranks[state.query];
    const row = element("tr");
    row.append(
      element("td", method.title),
      element("td", place === undefined
        ? "–" : "frame " + databaseNow().frames[pair.places[place]]),
      element("td", place === undefined
        ? "–" : distance(pair, state.query, place).toFixed(1) + " m"),
      element("td", WORDS[kind]),
      element("td", rank === null ? "–" : String(rank)));
    return row;
  });
  byId("all-methods").tBodies[0].replaceChildren(...rows);
}

/** Shows the state; of several calls at once only the last draws. */
let drawing = 0;
async function show() {
  const mine = ++drawing;
  byId("query").value = state.query;
  showStatus();
  showBest();
  showMethods();
  drawStrip();
  const pair = pairNow();
  const place = methodNow().best[state.query][state.rank];
  await Promise.all([
    viewOf(databaseNow()), scansOf(databaseNow()), scansOf(queryDriveNow())]);
  if (mine !== drawing) return;
  await drawMap();
  await drawScan(
    byId("query-scan"), queryDriveNow(), pair.queries[state.query]);
  await drawScan(
    byId("match-scan"), databaseNow(),
    place === undefined ? undefined : pair.places[place]);
  document.body.dataset.shown =
    `${state.pair}/${state.method}/${state.query}/${state.rank}`;
}

function go(query) {
  const count = pairNow().queries.length;
  state.query = Math.min(count - 1, Math.max(0, query));
  state.rank = 0;
  show();
}

function choosePair() {
  const methods = pairNow().methods.map((method, index) => {
    const option = element(
      "option", `${method.title} (AUC ${method.metrics.all.auc.toFixed(3)})`);
    option.value = index;
    return option;
  });
  byId("method").replaceChildren(...methods);
  state.method = Math.min(state.method, methods.length - 1);
  byId("method").value = state.method;
  byId("query").max = pairNow().queries.length - 1;
  go(0);
}

function nextWrong() {
  const pair = pairNow(), count = pair.queries.length;
  for (let step = 1; step <= count; step++) {
    const query = (state.query + step) % count;
    if (outcome(pair, methodNow(), query) === "wrong") return go(query);
  }
}

function nearestQuery(event) {
  const canvas = byId("map"), box = canvas.getBoundingClientRect();
  const frame = mapFrame(canvas.clientWidth, canvas.clientHeight);
  const drive = queryDriveNow();
  let best = [Infinity, 0];
  pairNow().queries.forEach((index, query) => {
    const [x, y] = frame.at(drive.x[index], drive.y[index]);
    const away = Math.hypot(
      x - event.clientX + box.left, y - event.clientY + box.top);
    if (away < best[0]) best = [away, query];
  });
  go(best[1]);
}

function start() {
  data.pairs.forEach((pair, index) => {
    const change = pair.change === null ? "" : ` (TCR_sym ${pair.change})`;
    const option = element("option", pair.label + change);
    option.value = index;
    byId("pair").append(option);
  });
  byId("pair").addEventListener("change", (event) => {
    state.pair = Number(event.target.value);
    choosePair();
  });
  byId("method").addEventListener("change", (event) => {
    state.method = Number(event.target.value);
    go(state.query);
  });
  byId("query").addEventListener(
    "input", (event) => go(Number(event.target.value)));
  byId("previous").addEventListener("click", () => go(state.query - 1));
  byId("next").addEventListener("click", () => go(state.query + 1));
  byId("next-wrong").addEventListener("click", nextWrong);
  byId("heading").addEventListener("change", show);
  byId("map").addEventListener("click", nearestQuery);
  byId("strip").addEventListener("click", (event) => {
    const box = event.target.getBoundingClientRect();
    const part = (event.clientX - box.left) / box.width;
    go(Math.floor(part * pairNow().queries.length));
  });
  let waiting;
  window.addEventListener("resize", () => {
    clearTimeout(waiting);
    waiting = setTimeout(show, 100);
  });
  choosePair();
}

if (data) {
  if (typeof DecompressionStream === "undefined") {
    byId("status").textContent =
      "The query browser needs a web browser of 2023 or later.";
  } else {
    start();
  }
}
