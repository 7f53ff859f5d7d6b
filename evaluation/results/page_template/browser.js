// Controls and lists of the query browser, and its state in the address.

// Web browsers let a page change its address only so often [ms].
const ADDRESS_DELAY = 300;
const MARKS = { right: "✓ ", wrong: "✗ ", none: "", silent: "" };

const metres = (query, place) =>
  distance(pairNow(), query, place).toFixed(1) + " m";

function showStatus() {
  const pair = pairNow(), method = methodNow();
  const kind = outcome(pair, method, state.query);
  byId("status").replaceChildren(
    `Query ${state.query + 1} of ${pair.queries.length}, ${method.title}: `,
    element("span", WORDS[kind], kind));
  const best = method.best[state.query];
  if (best.length) {
    byId("status").append(
      ` – top-ranked place ${metres(state.query, best[0])} away, score ` +
      method.scores[state.query][0].toFixed(4));
  }
  const why = method.why[state.query];
  if (kind === "wrong" && why)
    byId("status").append(
      ` – ${byId("why").querySelector(`[value="${why}"]`).textContent}`);
  byId("query").value = state.query;
  byId("query").setAttribute(
    "aria-valuetext", `query ${state.query + 1}: ${WORDS[kind]}`);
  const count = pair.queries.filter((_, query) => fits(query)).length;
  byId("filtered").textContent = `${count} of ${pair.queries.length}`;
  byId("no-query").hidden = count > 0;
  if (!count) byId("status").replaceChildren();
  showCaption(
    "query", "Query", pair.query, pair.queries[state.query]);
  const place = best[state.rank];
  showCaption(
    "match", `Place ${state.rank + 1}`, pair.database, pair.places[place]);
}

/** Says below a scan which it is; an index of undefined stands for none. */
function showCaption(id, what, name, index) {
  const caption = byId(id + "-caption"), drive = data.drives[name];
  caption.textContent = index === undefined
    ? "No candidate" : `${what}: ${name}, frame ${drive.frames[index]} `;
  showImage(byId(id + "-image"), caption, drive.images, index);
  if (drive.page && index !== undefined) {
    const link = element("a", "look around in 3-D");
    link.href = drive.page;
    caption.append(link);
  }
}

/** Shows the camera image nearest in time to a scan, if the drive has any. */
function showImage(image, caption, images, index) {
  image.hidden = !images || index === undefined;
  if (image.hidden) return;
  image.src = "data:image/jpeg;base64," + images.files[images.nearest[index]];
  const later = images.later[index];
  if (later) caption.append(
    `(image ${Math.abs(later)} s ${later > 0 ? "later" : "earlier"}) `);
}

/** Fills a list whose rows can be chosen; the choice keeps the focus. */
function fill(id, rows, chosen, choose) {
  const body = byId(id).tBodies[0];
  const focused = body.contains(document.activeElement);
  body.replaceChildren(...rows.map(([first, ...others], index) => {
    const row = element("tr", undefined, index === chosen ? "chosen" : "");
    const button = element("button", first);
    button.type = "button";
    button.setAttribute("aria-pressed", index === chosen);
    const cell = element("td");
    cell.append(button);
    row.append(cell, ...others.map((text) => element("td", text)));
    row.addEventListener("click", () => choose(index));
    return row;
  }));
  if (focused) body.querySelector(".chosen button")?.focus();
}

function showBest() {
  const pair = pairNow(), method = methodNow();
  const rows = method.best[state.query].map((place, rank) => {
    const right = pair.matches[state.query].includes(place);
    return [
      String(rank + 1),
      "frame " + databaseNow().frames[pair.places[place]],
      right ? "✓ right" : "✗ wrong",
      metres(state.query, place),
      method.scores[state.query][rank].toFixed(4)];
  });
  fill("best", rows, state.rank, (rank) => {
    state.rank = rank;
    show();
  });
}

function showMethods() {
  const pair = pairNow();
  const rows = pair.methods.map((method) => {
    const kind = outcome(pair, method, state.query);
    const place = method.best[state.query][0];
    return [
      method.title,
      MARKS[kind] + WORDS[kind],
      place === undefined ? "–" : metres(state.query, place),
      String(method.ranks[state.query] ?? "–")];
  });
  fill("all-methods", rows, state.method, (index) => {
    state.method = index;
    byId("method").value = index;
    go(state.query);
  });
}

/** Shows the state; of several calls at once only the last draws. */
let drawing = 0;
async function show() {
  const mine = ++drawing;
  showStatus();
  showBest();
  showMethods();
  drawStrip();
  const pair = pairNow();
  const place = methodNow().best[state.query][state.rank];
  await Promise.all([
    viewOf(pair.database), scansOf(databaseNow()), scansOf(queryDriveNow())]);
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

/** Goes to the query that is to be shown and nearest to one, if any is. */
function go(query) {
  const count = pairNow().queries.length;
  const wanted = Math.min(count - 1, Math.max(0, query));
  state.query = wanted;
  for (let away = 0; away < count; away++) {
    const near = [wanted - away, wanted + away].find(
      (one) => one >= 0 && one < count && fits(one));
    if (near === undefined) continue;
    state.query = near;
    break;
  }
  state.rank = 0;
  show();
  writeAddress();
}

/** Goes on to the next query to be shown, or with -1 to the previous. */
function step(direction) {
  const count = pairNow().queries.length;
  let query = state.query + direction;
  while (query >= 0 && query < count && !fits(query)) query += direction;
  if (query >= 0 && query < count) go(query);
}

const addressOf = (pair) =>
  ["#query", encodeURIComponent(pair.database), encodeURIComponent(pair.query)]
    .join("/");

let writing;
function writeAddress() {
  clearTimeout(writing);
  writing = setTimeout(() => {
    const frame = queryDriveNow().frames[pairNow().queries[state.query]];
    const method = encodeURIComponent(methodNow().name);
    history.replaceState(
      null, "", `${addressOf(pairNow())}/${method}/${frame}`);
  }, ADDRESS_DELAY);
}

/** Goes to the query that the address leads to; false if it leads to none. */
function readAddress() {
  const [method, frame] = location.hash.split("/").slice(3);
  const pair = data.pairs.findIndex(
    (one) => location.hash.startsWith(addressOf(one) + "/"));
  if (pair < 0) return false;
  state.pair = pair;
  state.method = Math.max(0, pairNow().methods.findIndex(
    (one) => encodeURIComponent(one.name) === method));
  state.filter = byId("filter").value = "all";
  state.why = byId("why").value = "";
  const frames = queryDriveNow().frames;
  state.query = Math.max(0, pairNow().queries.findIndex(
    (index) => frames[index] >= Number(frame)));
  state.rank = 0;
  showPair();
  byId("browser").scrollIntoView({ behavior: "instant" });
  return true;
}

/** The first query that has a match; else the first. */
function firstPlaced() {
  return Math.max(0, pairNow().matches.findIndex((places) => places.length));
}

/** Offers the pair's methods and queries; shows the state. */
function showPair() {
  const methods = pairNow().methods.map((method, index) => {
    const option = element(
      "option", `${method.title} (AUC ${method.auc.toFixed(3)})`);
    option.value = index;
    return option;
  });
  byId("method").replaceChildren(...methods);
  state.method = Math.min(state.method, methods.length - 1);
  byId("pair").value = state.pair;
  byId("method").value = state.method;
  byId("query").max = pairNow().queries.length - 1;
  show();
}

function nearestQuery(event) {
  const canvas = byId("map"), box = canvas.getBoundingClientRect();
  const frame = mapFrame(canvas.clientWidth, canvas.clientHeight);
  const drive = queryDriveNow();
  let best = [Infinity, 0];
  pairNow().queries.forEach((index, query) => {
    if (!fits(query)) return;
    const [x, y] = frame.at(drive.x[index], drive.y[index]);
    const away = Math.hypot(
      x - event.clientX + box.left, y - event.clientY + box.top);
    if (away < best[0]) best = [away, query];
  });
  go(best[1]);
}

/** Arrow keys, where they have nothing else to do. */
function onKey(event) {
  const target = event.target, slider = target === byId("query");
  if (event.altKey || event.ctrlKey || event.metaKey || event.shiftKey) return;
  if (target.closest("select, .scrolling")) return;
  const box = byId("browser").getBoundingClientRect();
  if (box.bottom < 0 || box.top > window.innerHeight) return;
  const directions = { ArrowLeft: -1, ArrowRight: 1 };
  if (slider) Object.assign(directions, { ArrowDown: -1, ArrowUp: 1 });
  if (!directions[event.key]) return;
  event.preventDefault();
  step(directions[event.key]);
}

function start() {
  data.pairs.forEach((pair, index) => {
    const option = element("option", pair.label);
    option.value = index;
    byId("pair").append(option);
  });
  byId("pair").addEventListener("change", (event) => {
    state.pair = Number(event.target.value);
    state.query = firstPlaced();
    state.rank = 0;
    showPair();
    go(state.query);
  });
  byId("method").addEventListener("change", (event) => {
    state.method = Number(event.target.value);
    go(state.query);
  });
  for (const choice of ["filter", "why"]) {
    byId(choice).addEventListener("change", (event) => {
      state[choice] = event.target.value;
      go(state.query);
    });
  }
  byId("query").addEventListener(
    "input", (event) => go(Number(event.target.value)));
  byId("previous").addEventListener("click", () => step(-1));
  byId("next").addEventListener("click", () => step(1));
  byId("heading").addEventListener("change", show);
  byId("map").addEventListener("click", nearestQuery);
  byId("strip").addEventListener("click", (event) => {
    const box = event.target.getBoundingClientRect();
    const part = (event.clientX - box.left) / box.width;
    go(Math.floor(part * pairNow().queries.length));
  });
  document.addEventListener("keydown", onKey);
  window.addEventListener("hashchange", readAddress);
  let waiting;
  window.addEventListener("resize", () => {
    clearTimeout(waiting);
    waiting = setTimeout(show, 100);
  });
  if (!readAddress()) {
    const areas = pairNow().methods.map((one) => one.auc);
    state.method = areas.indexOf(Math.max(...areas));
    state.query = firstPlaced();
    showPair();
  }
}

if (typeof DecompressionStream === "undefined") {
  byId("status").textContent =
    "The query browser needs a web browser of 2023 or later.";
} else {
  // Then all pictures have their sizes, and a linked query its place.
  window.addEventListener("load", start);
}
