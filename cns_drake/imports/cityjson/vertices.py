"""Vertices of CityJSON files."""

from typing import Any

import numpy as np

from cns_drake.base.errors import InputError

# No place on Earth is farther than this from the origin of a survey grid [m].
FARTHEST = 1e8


def read_vertices(document: dict, transform: object, where: str) -> np.ndarray:
    """Returns the vertices (N, 3) of a document, in coordinates of the file.

    Args:
        document: the document, a JSON object.
        transform: the transform of the document, a JSON object with scale and
            translation; None if the vertices are coordinates.
        where: place of the document, for error messages.

    Raises:
        InputError: vertices or transform cannot be used.
    """
    points = to_triples(document.get("vertices", []), f"{where}: vertices")
    if transform is not None and not isinstance(transform, dict):
        raise InputError(f"{where}: transform: not an object")
    for key in (transform or {}).keys() - {"scale", "translate"}:
        raise InputError(f"{where}: transform.{key} is not read")
    if transform:
        scale, move = (
            to_triples([transform.get(key)], f"{where}: transform.{key}")
            for key in ("scale", "translate")
        )
        if not (scale > 0.0).all():
            raise InputError(f"{where}: transform.scale: not above 0")
        with np.errstate(over="ignore", invalid="ignore"):
            points = points * scale + move
    if not (np.abs(points) <= FARTHEST).all():  # NaN fails, too.
        raise InputError(
            f"{where}: vertices: a coordinate beyond {FARTHEST:g} m"
        )
    return points


def to_triples(values: Any, where: str) -> np.ndarray:
    """Returns a list of N triples of numbers as an array (N, 3).

    `where` is the place of the list in the file, for error messages.

    Raises:
        InputError: an item of the list is not a triple of numbers.
    """
    try:
        with np.errstate(over="ignore"):
            points = np.array(values, dtype=np.float64).reshape(-1, 3)
        if len(points) != len(values):
            raise ValueError
    except (TypeError, ValueError, OverflowError) as error:
        raise InputError(
            f"{where}: every item must be three numbers"
        ) from error
    return points
