"""Figures of Matplotlib, a wall: its settings are ours, not the user's."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
import contextlib
import functools
from pathlib import Path
from typing import TYPE_CHECKING, Any
import warnings

from evaluation.base.complete_files import completing
from evaluation.base.errors import InputError, did_you_mean
from evaluation.base.terminal import note

if TYPE_CHECKING:
    from matplotlib.figure import Figure

# Formats whose files contain the time at which they were made -> its name.
_DATES = {"pdf": "CreationDate", "svg": "Date"}
# TrueType fonts stay text in PDF; ids of SVG follow the salt.
_FILES = {"pdf.fonttype": 42, "svg.hashsalt": "cns", "svg.fonttype": "path"}


# Fonts with the letters of many scripts, which are used where DejaVu Sans lacks
# a letter, if they are installed.
_FURTHER_FONTS = (
    "Noto Sans CJK JP",
    "Noto Sans CJK SC",
    "Source Han Sans",
    "WenQuanYi Micro Hei",
    "IPAexGothic",
    "Noto Sans Devanagari",
    "Noto Sans Thai",
    "Arial Unicode MS",
)
# Part of Matplotlib's warning about a letter that no font has.
_MISSING = "missing from font"

Rgb = tuple[int, int, int]

# What became of a place between two stages, the same colours in all pictures
# and pages. Grey: one of the two drives did not see the place, so that nothing
# is known of it.
NEW_RGB: Rgb = (226, 52, 44)
GONE_RGB: Rgb = (146, 96, 240)
UNSEEN_RGB: Rgb = (178, 182, 190)


@contextlib.contextmanager
def figure_style(changes: Mapping[str, Any] | None = None) -> Iterator[None]:
    """Makes Matplotlib's defaults apply, as a `with` block or a decorator.

    Whatever makes or saves a figure of ours is in such a block, so that neither
    a `matplotlibrc` nor `rcParams` of the user changes the figure.

    Args:
        changes: name -> value of the parameters that differ from Matplotlib's
            defaults.
    """
    # Imported here: they are slow to load.
    from matplotlib import font_manager, style

    there = {one.name for one in font_manager.fontManager.ttflist}
    fonts = ["DejaVu Sans", *(one for one in _FURTHER_FONTS if one in there)]
    settings = {"font.sans-serif": fonts, **(changes or {})}
    with (
        style.context(["default", settings]),
        warnings.catch_warnings(record=True) as caught,
    ):
        warnings.filterwarnings("always", f".*{_MISSING}")
        yield
    boxes = [one for one in caught if _MISSING in str(one.message)]
    for one in caught:
        if one not in boxes:
            warnings.warn_explicit(
                one.message, one.category, one.filename, one.lineno
            )
    if boxes:
        _note_boxes()


@functools.cache
def _note_boxes() -> None:
    """Notes, once in a process, that letters are missing."""
    note(
        "figures: no installed font has some letters of the names, and boxes"
        f" stand for them; install {_FURTHER_FONTS[0]}, for example"
    )


def font_settings(font: str) -> dict[str, Any]:
    """Returns Matplotlib's parameters of a font.

    `serif` is STIX, which resembles Times and comes with Matplotlib.

    Args:
        font: `serif`, `sans-serif`, `monospace` or the name of an installed
            font.

    Raises:
        InputError: no font of this name is installed.
    """
    # Imported here: they are slow to load.
    from matplotlib import font_manager

    there = {one.name for one in font_manager.fontManager.ttflist}
    known = {
        "serif": ["STIXGeneral", "DejaVu Serif"],
        "sans-serif": ["DejaVu Sans"],
        "monospace": ["DejaVu Sans Mono"],
    }
    if font not in known and font not in there:
        hint = did_you_mean(font, [*known, *there])
        raise InputError(
            f"--font: {font!r}: not installed (always there are"
            f" {', '.join(known)}){hint}"
        )
    # By their own names: text is made before its file, with other settings.
    fonts = [*known.get(font, [font, "DejaVu Sans"]), *_FURTHER_FONTS]
    formulas = "stix" if font == "serif" else "dejavusans"
    return {
        "font.family": [one for one in fonts if one in there],
        "mathtext.fontset": formulas,
    }


def save_figure(
    figure: Figure,
    path: Path,
    dpi: float,
    settings: Mapping[str, Any] | None = None,
    **options: Any,
) -> None:
    """Writes a figure to a file; equal figures give equal bytes.

    Args:
        figure: the figure.
        path: the file; its ending is the format.
        dpi: resolution [pixels/inch].
        settings: Matplotlib's parameters with which the figure was drawn.
        options: further options of `Figure.savefig`.

    Raises:
        InputError: the file cannot be written.
    """
    kind = path.suffix.removeprefix(".")
    if kind in _DATES:
        options.setdefault("metadata", {_DATES[kind]: None})
    with figure_style({**_FILES, **(settings or {})}), completing(path) as part:
        figure.savefig(part, dpi=dpi, format=kind, **options)
