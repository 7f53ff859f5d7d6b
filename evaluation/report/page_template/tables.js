// Sections that unfold, and tables that a click on a heading sorts.

/** Unfolds the section to which a link leads. */
function unfold(hash) {
  const part = /^#\w+$/.test(hash) &&
    document.querySelector(`${hash} > details.part`);
  if (part) part.open = true;
}
addEventListener("hashchange", () => unfold(location.hash));
document.querySelectorAll('a[href^="#"]').forEach((link) =>
  link.addEventListener("click", () => unfold(link.hash)));
unfold(location.hash);
addEventListener("beforeprint", () => document
  .querySelectorAll("details.part").forEach((part) => { part.open = true; }));

/** Sorts by a column: numbers first, the greatest on top, then the least. */
function sortBy(heading) {
  const body = heading.closest("table").tBodies[0];
  const down = heading.ariaSort !== "descending";
  const key = (row) => {
    const text = row.cells[heading.cellIndex].innerText;
    const number = parseFloat(text);
    return Number.isNaN(number) ? text : number;
  };
  const before = (a, b) => typeof a === typeof b
    ? (a > b) - (a < b) : typeof a === "number" ? 1 : -1;
  const rows = [...body.rows].sort((a, b) => before(key(a), key(b)));
  body.replaceChildren(...(down ? rows.reverse() : rows));
  for (const one of heading.parentElement.cells) one.ariaSort = null;
  heading.ariaSort = down ? "descending" : "ascending";
}
document.querySelectorAll(".table thead tr:last-child th, .board thead th")
  .forEach((heading) => {
    heading.tabIndex = 0;
    heading.addEventListener("click", () => sortBy(heading));
    heading.addEventListener("keydown", (event) => {
      if (event.key === "Enter") sortBy(heading);
    });
  });
