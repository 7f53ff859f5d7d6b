"""A web page of two labelled maps, and of what changed between them."""

import base64
from collections.abc import Sequence
import io
from pathlib import Path

import jinja2
import numpy as np

from cns_drake.base import write_text
from evaluation.map_update import Label, SessionPair, StructureChange
from evaluation.results import GONE, NEW

# Drawing order of the labels: changes are on top.
_RGB = {
    Label.UNOBSERVED: (178, 182, 190),
    Label.NEWLY_SEEN: (120, 170, 230),
    Label.KEPT: (90, 96, 104),
    Label.GONE: GONE,
    Label.NEW: NEW,
}
_WORDS = {
    Label.UNOBSERVED: "unobserved: B's drive did not look there",
    Label.KEPT: "kept",
    Label.GONE: "gone",
    Label.NEW: "new",
    Label.NEWLY_SEEN: "newly seen: A's drive did not look there",
}
# Longest side of a picture [pixels].
_LONGEST_SIDE = 1600
# Smallest side of a pixel [m].
_SMALLEST_PIXEL = 0.2
# Structures in the page's table, the largest changes first.
_MOST_ROWS = 200


def write_page(
    path: Path,
    pair: SessionPair,
    truth: Sequence[np.ndarray],
    table: Sequence[StructureChange],
    names: tuple[str, str],
) -> None:
    """Writes a web page with two labelled maps and their changed structures.

    Args:
        path: path of the page.
        pair: the maps of A and B, which the page shows from above.
        truth: labels of the points of each map.
        table: the changed structures.
        names: names of the two drives.
    """
    low, step, shape = _picture_frame(pair)
    maps = []
    for session, labels, name in zip(pair, truth, names, strict=True):
        counts = ", ".join(
            f"{(labels == label).sum():,} "
            f"{label.name.lower().replace('_', ' ')}"
            for label in _RGB
            if (labels == label).any()
        )
        image = _map_image(session.points, labels, low, step, shape)
        maps.append((session.side, name, counts, _base64_png(image)))
    rows = sorted(
        (row for row in table if row.verdict in ("gone", "new")),
        key=lambda row: -row.changed,
    )[:_MOST_ROWS]
    template = Path(__file__).with_suffix(".html").read_text("utf-8")
    environment = jinja2.Environment(
        autoescape=True, undefined=jinja2.StrictUndefined
    )
    text = environment.from_string(template).render(
        names=names,
        legend=[(_RGB[label], words) for label, words in _WORDS.items()],
        maps=maps,
        rows=rows,
    )
    write_text(path, f"{text}\n")


def _picture_frame(
    pair: SessionPair,
) -> tuple[np.ndarray, float, tuple[int, int]]:
    """Returns the corner [m], pixel side [m], rows and columns of a picture."""
    points = np.concatenate([one.points[:, :2] for one in pair])
    if len(points) == 0:
        points = np.zeros((1, 2))
    # A few far points would make the streets small.
    low, high = np.percentile(points, (0.2, 99.8), axis=0)
    step = max(float((high - low).max()) / _LONGEST_SIDE, _SMALLEST_PIXEL)
    columns, rows = np.ceil((high - low) / step).astype(int) + 1
    return low, step, (int(rows), int(columns))


def _map_image(
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


def _base64_png(image: np.ndarray) -> str:
    from matplotlib.image import imsave

    stream = io.BytesIO()
    imsave(stream, image)
    return base64.b64encode(stream.getvalue()).decode()
