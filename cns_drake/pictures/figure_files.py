"""Saves figures of Matplotlib."""

from pathlib import Path

from matplotlib.figure import Figure

from cns_drake.base import completing, make_folder


def save_figure(figure: Figure, path: Path, dpi: float) -> None:
    """Writes a figure to a file; the file's ending determines the format.

    Args:
        figure: the figure.
        path: the file; missing folders are made.
        dpi: resolution [pixels/inch].

    Raises:
        InputError: the file cannot be written.
    """
    make_folder(path.parent)
    with completing(path) as part:
        figure.savefig(part, dpi=dpi, format=path.suffix.removeprefix("."))
