"use strict";

// What the page has of pairs and drives, and what it shows just now.

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
  none: "no match",
  silent: "no candidate",
};
const byId = (id) => document.getElementById(id);
const state = { pair: 0, method: 0, query: 0, rank: 0, filter: "all", why: "" };

function element(name, text, className) {
  const made = document.createElement(name);
  if (text !== undefined) made.textContent = text;
  if (className) made.className = className;
  return made;
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

/** Whether the choice of queries to show holds for one. */
function fits(query) {
  const method = methodNow();
  if (state.why && method.why[query] !== state.why) return false;
  if (state.filter === "alone") {
    return pairNow().methods.every(
      (one) => (one.ranks[query] === 1) === (one === method));
  }
  return state.filter === "all" ||
    outcome(pairNow(), method, query) === state.filter;
}
