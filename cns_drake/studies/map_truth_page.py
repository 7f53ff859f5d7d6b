"""A page that shows two maps in the colours of their labels."""

from collections.abc import Sequence
from html import escape
import io
from pathlib import Path

import numpy as np

from cns_drake.base.files import write_text
from evaluation.map_update.sessions import Label, Pair
from evaluation.map_update.structures import StructureChange

# Drawn in this order: what changed lies on top.
_RGB = {
    Label.UNOBSERVED: (178, 182, 190),
    Label.NEWLY_SEEN: (120, 170, 230),
    Label.KEPT: (90, 96, 104),
    Label.GONE: (214, 48, 49),
    Label.NEW: (0, 150, 80),
}
_WORDS = {
    Label.UNOBSERVED: "unobserved: B's drive did not look there",
    Label.KEPT: "kept",
    Label.GONE: "gone",
    Label.NEW: "new",
    Label.NEWLY_SEEN: "newly seen: A's drive did not look there",
}
# Longest side of a picture [pixels], and the smallest side of a pixel [m].
_PIXELS, _FINEST = 1600, 0.2
# Structures in the page's table, the largest changes first.
_MOST_ROWS = 200


def write_page(
    path: Path,
    pair: Pair,
    truth: Sequence[np.ndarray],
    table: Sequence[StructureChange],
    names: tuple[str, str],
) -> None:
    """Writes the page: both maps from above, and the changed structures."""
    low, step, shape = _frame(pair)
    figures = []
    for session, labels, name in zip(pair, truth, names, strict=True):
        image = _draw(session.points, labels, low, step, shape)
        counts = ", ".join(
            f"{(labels == label).sum():,} "
            f"{label.name.lower().replace('_', ' ')}"
            for label in _RGB
            if (labels == label).any()
        )
        figures.append(
            f"<h2>{session.side}: {escape(name)}</h2><p>{counts}</p>"
            f'<img alt="Map of {escape(name)} from above, in the colours of '
            f'the labels" src="data:image/png;base64,{_png(image)}">'
        )
    legend = "".join(
        f'<li><span style="background:rgb{_RGB[label]}"></span>{words}</li>'
        for label, words in _WORDS.items()
    )
    rows = sorted(
        (row for row in table if row.verdict in ("gone", "new")),
        key=lambda row: -row.changed,
    )[:_MOST_ROWS]
    body = "".join(
        f"<tr><td>{row.side}</td><td>{escape(row.structure)}</td>"
        f"<td>{escape(row.semantic_class)}</td><td>{row.verdict}</td>"
        f"<td>{row.points:,}</td><td>{row.observed:,}</td>"
        f"<td>{row.changed:,}</td></tr>"
        for row in rows
    )
    title = f"{escape(names[0])} and {escape(names[1])}: what changed"
    text = f"""<!DOCTYPE html>
<html lang="en"><head><meta charset="utf-8"><title>{title}</title>
<style>
body {{ font: 15px/1.5 system-ui, sans-serif; margin: 2rem auto;
  max-width: 70rem; padding: 0 1rem; color: #1d2129; background: #fff }}
img {{ max-width: 100%; background: #f7f8fa; border: 1px solid #dde0e5 }}
ul {{ list-style: none; padding: 0 }}
li span {{ display: inline-block; width: 1em; height: 1em;
  margin-right: .5em; vertical-align: -.1em }}
table {{ border-collapse: collapse }}
td, th {{ padding: .15rem .6rem; text-align: left;
  border-bottom: 1px solid #e3e6ea }}
td:nth-child(n+5) {{ text-align: right }}
</style></head><body>
<h1>{title}</h1>
<p>Both maps from above. The label of each point is exact: rays decide it in the
worlds of both drives.</p>
<ul>{legend}</ul>
{"".join(figures)}
<h2>Structures that are gone or new</h2>
<table><tr><th>map</th><th>structure</th><th>class</th><th>verdict</th>
<th>points</th><th>observed</th><th>changed</th></tr>{body}</table>
</body></html>
"""
    write_text(path, text)


def _frame(pair: Pair) -> tuple[np.ndarray, float, tuple[int, int]]:
    """Returns corner [m], side of a pixel [m], and pixels (rows, columns)."""
    points = np.concatenate([one.points[:, :2] for one in pair])
    if len(points) == 0:
        points = np.zeros((1, 2))
    # A few far points would make the streets small.
    low, high = np.percentile(points, (0.2, 99.8), axis=0)
    step = max(float((high - low).max()) / _PIXELS, _FINEST)
    columns, rows = np.ceil((high - low) / step).astype(int) + 1
    return low, step, (int(rows), int(columns))


def _draw(
    points: np.ndarray,
    labels: np.ndarray,
    low: np.ndarray,
    step: float,
    shape: tuple[int, int],
) -> np.ndarray:
    """Returns the map from above, (rows, columns, 3) uint8, north up."""
    image = np.full((*shape, 3), 255, np.uint8)
    columns, rows = ((points[:, :2] - low) / step).astype(int).T
    inside = (columns >= 0) & (columns < shape[1])
    inside &= (rows >= 0) & (rows < shape[0])
    for label, rgb in _RGB.items():
        chosen = inside & (labels == label)
        image[shape[0] - 1 - rows[chosen], columns[chosen]] = rgb
    return image


def _png(image: np.ndarray) -> str:
    import base64

    from matplotlib.image import imsave

    stream = io.BytesIO()
    imsave(stream, image)
    return base64.b64encode(stream.getvalue()).decode()
