"""Reads signals and objects beside a road from an OpenDRIVE file."""

from __future__ import annotations

from collections.abc import Iterator
import math

import numpy as np

from cns_drake.base.xml_elements import Element
from cns_drake.imports.import_faults import ImportFaults
from cns_drake.imports.opendrive.road_model import Thing

_MOST_REPEATS = 10_000
# An object repeated without a distance is cut into pieces of this length [m].
_PIECE = 4.0
_LARGEST = 1000.0  # [m]


def read_things(
    road: Element, name: str, faults: ImportFaults
) -> Iterator[Thing]:
    """Yields the signals and objects beside a road.

    Raises:
        ValueError: naming line and fault, if a text is not a number.
    """
    for k, one in enumerate(road.all("signals", "signal")):
        yield Thing(
            name=f"signal_{name}_{k}",
            is_signal=True,
            kind=one.text("type", "").lower(),
            s=one.number("s"),
            t=one.number("t"),
            z=one.number("zOffset", 0.0),
            heading=one.number("hOffset", 0.0),
            size=(0.0, one.number("width", 0.0), one.number("height", 0.0)),
            is_dynamic=one.text("dynamic", "no") == "yes",
            faces_back=one.text("orientation", "none") == "-",
        )
    for k, one in enumerate(road.all("objects", "object")):
        thing = _object(one, f"object_{name}_{k}")
        repeats = list(one.all("repeat"))
        if not repeats:
            yield thing
        for m, repeat in enumerate(repeats):
            yield from _repeated(thing, repeat, m, faults)


def _object(one: Element, name: str) -> Thing:
    radius = one.number("radius", 0.0)
    size = (
        one.number("length", 2.0 * radius),
        one.number("width", 2.0 * radius),
        one.number("height", 0.0),
    )
    if not all(0.0 <= side <= _LARGEST for side in size):
        raise ValueError(
            f"line {one.line}: object: a size of {size} m is not in 0 to "
            f"{_LARGEST:g} m"
        )
    outline = next(one.all("outlines", "outline"), one.first("outline"))
    corners = road_corners = None
    if outline is not None:
        corners = _corners(outline, "cornerLocal", "u", "v")
        road_corners = _corners(outline, "cornerRoad", "s", "t")
    return Thing(
        name=name,
        is_signal=False,
        kind=one.text("type", one.text("name", "none")).lower(),
        s=one.number("s"),
        t=one.number("t"),
        z=one.number("zOffset", 0.0),
        heading=one.number("hdg", 0.0),
        size=size,
        outline=corners,
        road_outline=road_corners,
    )


def _corners(
    outline: Element, tag: str, first: str, second: str
) -> np.ndarray | None:
    rows = [
        (one.number(first), one.number(second), one.number("height", 0.0))
        for one in outline.all(tag)
    ]
    return np.array(rows) if len(rows) >= 3 else None


def _repeated(
    thing: Thing, repeat: Element, number: int, faults: ImportFaults
) -> Iterator[Thing]:
    start, length = repeat.number("s"), repeat.number("length")
    distance = repeat.number("distance", 0.0)
    step = distance if distance > 0.0 else _PIECE
    count = math.floor(length / step + 1e-9) + (distance > 0.0)
    if distance <= 0.0:
        count = math.ceil(length / step)
    if count > _MOST_REPEATS:
        faults.add(
            f"object repeated more than {_MOST_REPEATS} times, left out",
            thing.name,
        )
        return
    for k in range(max(count, 1)):
        # A wall becomes pieces, each centred on its own middle.
        at = k * step if distance > 0.0 else (k + 0.5) * length / max(count, 1)
        part = min(1.0, at / length) if length > 0.0 else 0.0

        def value(name: str, default: float, part: float = part) -> float:
            first = repeat.number(f"{name}Start", default)
            last = repeat.number(f"{name}End", first)
            return first + part * (last - first)

        own = thing.size[0]
        if distance <= 0.0 and length > 0.0:
            own = length / count
        size = (
            own,
            value("width", thing.size[1]),
            value("height", thing.size[2]),
        )
        yield Thing(
            name=f"{thing.name}_{number}_{k}",
            is_signal=False,
            kind=thing.kind,
            s=start + at,
            t=value("t", thing.t),
            z=value("zOffset", thing.z),
            heading=thing.heading,
            size=size,
            outline=thing.outline,
        )
