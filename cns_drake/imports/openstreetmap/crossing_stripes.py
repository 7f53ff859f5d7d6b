"""The stripes of zebra crossings."""

from collections.abc import Iterator, Mapping

import numpy as np
from shapely.geometry import Polygon

from cns_drake.imports import faces
from cns_drake.imports.colours import WHITE_PAINT
from cns_drake.imports.imported_objects import ImportedObject, make_object
from cns_drake.imports.openstreetmap.features import OsmFeatures
from cns_drake.imports.openstreetmap.local_metres import LocalMetres
from cns_drake.imports.openstreetmap.way_tags import is_tunnel, street_width

# Width of the stripes of a zebra crossing, and of the gaps between them [m].
_STRIPE_WIDTH = 0.5
# Length of the stripes [m].
_STRIPE_LENGTH = 3.0
# Height of the stripes above the street [m].
_STRIPE_HEIGHT = 0.01


def crossing_stripes(
    features: OsmFeatures, local: LocalMetres
) -> Iterator[ImportedObject]:
    """Yields the stripes of zebra crossings, slightly above their street."""
    marked = {number for number, tags in features.crossings if is_marked(tags)}
    for _, tags, line, nodes in features.ways:
        width = street_width(tags)
        if width is None or is_tunnel(tags):
            continue
        for k, number in enumerate(nodes):
            if number not in marked:
                continue
            marked.remove(number)
            places = local(line)
            along = places[min(k + 1, len(nodes) - 1)] - places[max(k - 1, 0)]
            if not along.any():
                continue
            stripes = _stripes(places[k], along / np.hypot(*along), width)
            name = f"n{number}"
            surface = [
                faces.flat_surface(s, _STRIPE_HEIGHT, name, features.faults)
                for s in stripes
            ]
            yield make_object(
                f"crossing_{name}",
                "road",
                "Crossing",
                {"stripes": np.concatenate(surface)},
                {"stripes": WHITE_PAINT},
            )


def _stripes(
    place: np.ndarray, along: np.ndarray, width: float
) -> list[Polygon]:
    """Returns the stripes across a street, around a place."""
    left = np.array([-along[1], along[0]])
    count = max(1, int((width - _STRIPE_WIDTH) / (2 * _STRIPE_WIDTH)))
    middles = (np.arange(count) - (count - 1) / 2) * 2 * _STRIPE_WIDTH
    corners = np.array([(-1, -1), (1, -1), (1, 1), (-1, 1)]) / 2
    return [
        Polygon(
            place
            + np.outer(corners[:, 0] * _STRIPE_LENGTH, along)
            + np.outer(corners[:, 1] * _STRIPE_WIDTH + middle, left)
        )
        for middle in middles
    ]


def is_marked(tags: Mapping[str, str]) -> bool:
    """Returns whether a crossing is marked by stripes."""
    markings = tags.get("crossing:markings")
    if markings is not None:
        return markings.startswith("zebra") or markings == "yes"
    return (
        tags.get("crossing") in ("zebra", "marked", "uncontrolled")
        or tags.get("crossing_ref") == "zebra"
    )
