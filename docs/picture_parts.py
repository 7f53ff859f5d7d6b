"""What several pictures of these pages share: sizes, axes, names and rows."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from matplotlib.axes import Axes
from matplotlib.figure import Figure
import numpy as np
from PIL import Image, ImageDraw, ImageFont

from evaluation.results import FIGURE_STYLE, INK

ROOT = Path(__file__).resolve().parents[1]
# Charts are this wide [inches], and shown 830, 700 or 390 pixels wide.
WIDTH = 7.0
# The style of all charts, in letters for pages.
STYLE = {**FIGURE_STYLE, "font.size": 13}
DPI = 160
# Size of a camera's view [pixels].
TILE = (704, 396)


def add_heading(figure: Figure, finding: str) -> None:
    figure.suptitle(finding)


def make_plain(axes: Axes, grid: str = "x") -> None:
    axes.grid(axis=grid)
    axes.tick_params(length=0)
    axes.spines["left"].set_visible(False)


def set_dark_view(axes: Axes, middle: np.ndarray, span: float) -> None:
    axes.set_facecolor("black")
    axes.set_aspect("equal")
    axes.set_xlim(middle[0] - span, middle[0] + span)
    axes.set_ylim(middle[1] - span, middle[1] + span)
    axes.set_xticks([])
    axes.set_yticks([])


def with_name(picture: np.ndarray, name: str, size: int = 26) -> np.ndarray:
    """Returns a picture with its name in the corner, `size` pixels high."""
    image = Image.fromarray(picture)
    ImageDraw.Draw(image).text(
        (14, 8), name, INK, ImageFont.load_default(size),
        stroke_width=3, stroke_fill="white",
    )  # fmt: skip
    return np.asarray(image)


def write_tiles(
    rows: Sequence[Sequence[np.ndarray]], path: Path, width: int = TILE[0]
) -> None:
    """Writes pictures of one size, side by side and in rows."""
    height = width * rows[0][0].shape[0] // rows[0][0].shape[1]
    gap = 6
    size = len(rows[0]) * (width + gap) - gap, len(rows) * (height + gap) - gap
    whole = Image.new("RGB", size, "white")
    for i, row in enumerate(rows):
        for k, picture in enumerate(row):
            shown = Image.fromarray(picture).resize((width, height))
            whole.paste(shown, (k * (width + gap), i * (height + gap)))
    whole.save(path, quality=82 if path.suffix == ".jpg" else 70)
