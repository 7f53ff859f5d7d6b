// The canvases of the query browser.

// Half of the length that a scan's picture shows [m], and of a bar [m].
const SCAN_REACH = 50;
const BAR = { map: 100, scan: 20 };
const HIGHEST = 15;

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

/** Takes the map from above out of the section that shows it. */
async function viewOf(name) {
  const drive = data.drives[name];
  if (!drive.picture) {
    const picture = new Image();
    picture.src = byId("view-" + name).href.baseVal;
    drive.picture = picture.decode().then(() => picture);
  }
  return drive.picture;
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
  context.fillStyle = "#ffffffd0";
  context.fillRect(
    end - scale * length - 5, base - 20, scale * length + 10, 26);
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
  const picture = await viewOf(pairNow().database);
  const { context, width, height } = prepare(byId("map"));
  const frame = mapFrame(width, height);
  const pair = pairNow(), method = methodNow();
  const database = databaseNow(), drive = queryDriveNow();
  const [left, right, bottom, top] = database.extent;
  context.drawImage(
    picture, ...frame.at(left, top),
    frame.scale * (right - left), frame.scale * (top - bottom));
  drawRoute(context, frame, database.route, "#5a6472");
  const of = (d, i) => frame.at(d.x[i], d.y[i]);
  const size = Math.max(2, Math.min(4, 2.2 * frame.scale));
  pair.queries.forEach((index, query) => {
    context.globalAlpha = fits(query) ? 1 : 0.2;
    drawOutcome(
      context, outcome(pair, method, query), ...of(drive, index), size);
  });
  context.globalAlpha = 1;
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
    context.globalAlpha = fits(query) ? 1 : 0.2;
    context.fillRect(
      query * step, height * (1 - part), Math.max(1, step - 0.6),
      height * part);
  }
  context.globalAlpha = 1;
  context.strokeStyle = "#000";
  context.lineWidth = 2;
  context.strokeRect(
    state.query * step - 1, 1, Math.max(3, step + 1), height - 2);
}
