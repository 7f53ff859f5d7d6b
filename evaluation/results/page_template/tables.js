// Sections that unfold, tables that a click on a heading sorts, and pictures
// that the escape key makes small again.

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

/** Sorts by a column: the greatest number on top, then the least.
    Words come after numbers, and empty cells are last, both ways. */
function sortBy(heading) {
  const body = heading.closest("table").tBodies[0];
  const down = heading.ariaSort !== "descending";
  // A p-value "< 0.0001" is sorted by its limit.
  const text = (row) =>
    row.cells[heading.cellIndex].innerText.trim().replace(/^< /, "");
  const kind = (value) => !value || value === "–" ? 2
    : Number.isNaN(parseFloat(value)) ? 1 : 0;
  const compare = (a, b) => kind(a) ? a.localeCompare(b)
    : parseFloat(a) - parseFloat(b);
  const order = (a, b) =>
    kind(a) - kind(b) || (down ? -1 : 1) * compare(a, b);
  body.replaceChildren(...[...body.rows].sort(
    (one, other) => order(text(one), text(other))));
  for (const one of heading.parentElement.cells) one.ariaSort = null;
  heading.ariaSort = down ? "descending" : "ascending";
}
document.querySelectorAll(".sortable thead th").forEach((heading) => {
  heading.tabIndex = 0;
  heading.addEventListener("click", () => sortBy(heading));
  heading.addEventListener("keydown", (event) => {
    if (event.key === "Enter") sortBy(heading);
  });
});

document.addEventListener("keydown", (event) => {
  if (event.key !== "Escape") return;
  for (const box of document.querySelectorAll(".enlarge :checked"))
    box.checked = false;
});
