"""Reads signals and objects beside roads from an OpenDRIVE file."""

from collections.abc import Iterator, Sequence
import math

import numpy as np

from cns_drake.base import Element
from cns_drake.imports.faults import ImportFaults
from cns_drake.imports.opendrive.road_model import Thing

# Greatest number of repetitions of an object.
_MOST_REPEATS = 10_000
# A last repetition may be beyond its stretch by this share of the distance.
_ROUNDING = 1e-9
# Distance of trees that are repeated without a distance [m].
_TREE_SPACING = 4.0
# Greatest length, width and height of an object [m].
_LARGEST_SIZE = 1000.0


def read_things(
    road: Element, name: str, faults: ImportFaults
) -> Iterator[Thing]:
    """Yields the signals and objects beside a road.

    `road` is the road in the file, and `name` its name. What is not read is
    counted in `faults`.

    Raises:
        ValueError: there is text in place of a number; the error names the
            line.
    """
    for number, signal in enumerate(road.all("signals", "signal")):
        yield _read_signal(signal, f"signal_{name}_{number}")
    for number, element in enumerate(road.all("objects", "object")):
        thing = _read_object(element, f"object_{name}_{number}")
        for _ in list(element.all("outlines", "outline"))[1:]:
            faults.add("further outline of an object, not read", thing.name)
        repeats = list(element.all("repeat"))
        if repeats:
            _count_unscaled(thing, repeats, faults)
        else:
            yield thing
        for number_of_repeat, repeat in enumerate(repeats):
            yield from _repetitions(thing, repeat, number_of_repeat, faults)


def _count_unscaled(
    thing: Thing, repeats: Sequence[Element], faults: ImportFaults
) -> None:
    """Counts outlines that the repetitions of an object change or lose."""
    if thing.road_outline is not None:
        faults.add("outline along the road, repeated as a box", thing.name)
    if thing.outline is not None and any(
        key.removesuffix("Start").removesuffix("End") in ("width", "height")
        for repeat in repeats
        for key in repeat.attrib
        if repeat.number("distance", 0.0) > 0.0
    ):
        faults.add("repeated outline, its sizes left as they are", thing.name)


def _read_signal(signal: Element, name: str) -> Thing:
    return Thing(
        name=name,
        is_signal=True,
        kind=signal.value("type", "").lower(),
        s=signal.number("s"),
        t=signal.number("t"),
        z=0.0,
        heading=signal.number("hOffset", 0.0),
        size=(0.0, 0.0, 0.0),
        is_dynamic=signal.value("dynamic", "no") == "yes",
        faces_back=signal.value("orientation", "none") == "-",
    )


def _read_object(element: Element, name: str) -> Thing:
    radius = element.number("radius", 0.0)
    size = (
        element.number("length", 2.0 * radius),
        element.number("width", 2.0 * radius),
        element.number("height", 0.0),
    )
    if not all(0.0 <= side <= _LARGEST_SIZE for side in size):
        raise ValueError(
            f"line {element.line}: object: a size of {size} m is not in 0 to "
            f"{_LARGEST_SIZE:g} m"
        )
    outline = next(element.all("outlines", "outline"), element.first("outline"))
    corners = _read_corners(outline, "cornerLocal", "uvz")
    road_corners = _read_corners(outline, "cornerRoad", ("s", "t", "dz"))
    return Thing(
        name=name,
        is_signal=False,
        kind=element.value("type", element.value("name", "none")).lower(),
        s=element.number("s"),
        t=element.number("t"),
        z=element.number("zOffset", 0.0),
        heading=element.number("hdg", 0.0),
        size=size,
        outline=corners,
        road_outline=road_corners,
        is_open=outline is not None and outline.value("closed", "") == "false",
    )


def _read_corners(
    outline: Element | None, tag: str, names: Sequence[str]
) -> np.ndarray | None:
    """Returns the corners (N, 4) of an outline, as in `Thing`, if it has any.

    Args:
        outline: the outline in the file; None if there is none.
        tag: tag of its corners.
        names: attributes of a corner with its coordinates.
    """
    if outline is None:
        return None
    x, y, z = names
    rows = [
        (
            corner.number(x),
            corner.number(y),
            corner.number(z, 0.0),
            corner.number("height", 0.0),
        )
        for corner in outline.all(tag)
    ]
    return np.array(rows) if len(rows) >= 2 else None


def _repetitions(
    thing: Thing, repeat: Element, number: int, faults: ImportFaults
) -> Iterator[Thing]:
    """Yields the repetitions of an object, or one object without gaps.

    Args:
        thing: the object.
        repeat: how the object is repeated, in the file.
        number: number of `repeat` among the object's repetitions. The new names
            contain this number.
        faults: counts objects that are left out.

    Raises:
        ValueError: a size is too large.
    """
    length = repeat.number("length")
    distance = repeat.number("distance", 0.0)
    if distance <= 0.0 < length and not thing.kind.startswith("tree"):
        yield _stretched(thing, repeat, number)
        return
    step = distance if distance > 0.0 else _TREE_SPACING
    count = max(math.floor(length / step + _ROUNDING), 0) + 1
    if count > _MOST_REPEATS:
        faults.add(
            f"object repeated more than {_MOST_REPEATS} times, left out",
            thing.name,
        )
        return
    for nth in range(count):
        yield _repeated(thing, repeat, nth * step)._replace(
            name=f"{thing.name}_{number}_{nth}"
        )


def _stretched(thing: Thing, repeat: Element, number: int) -> Thing:
    """Returns an object that is repeated without gaps, such as a wall.

    Raises:
        ValueError: a size is too large.
    """
    start, length = repeat.number("s"), repeat.number("length")
    _, width, height = thing.size
    if thing.outline is not None:
        width = width or float(np.ptp(thing.outline[:, 1]))
        height = height or float(thing.outline[:, 3].max())
    columns = (
        (start, start + length),
        _values_at_ends(repeat, "t", thing.t),
        _values_at_ends(repeat, "zOffset", thing.z),
        _values_at_ends(repeat, "width", width),
        _values_at_ends(repeat, "height", height),
    )
    swept = np.array(columns).T
    if swept[:, 3:].max() > _LARGEST_SIZE:
        raise ValueError(
            f"line {repeat.line}: repeat: a size of over {_LARGEST_SIZE:g} m"
        )
    begin = max(start, 0.0) if start + length > 0.0 else start
    return thing._replace(name=f"{thing.name}_{number}", s=begin, swept=swept)


def _repeated(thing: Thing, repeat: Element, distance: float) -> Thing:
    """Returns the repetition of an object, `distance` after the first [m]."""
    length = repeat.number("length")
    share = min(1.0, distance / length) if length > 0.0 else 0.0

    def between_ends(name: str, default: float) -> float:
        first, last = _values_at_ends(repeat, name, default)
        return first + share * (last - first)

    own_length, width, height = thing.size
    return thing._replace(
        s=repeat.number("s") + distance,
        t=between_ends("t", thing.t),
        z=between_ends("zOffset", thing.z),
        size=(
            own_length,
            between_ends("width", width),
            between_ends("height", height),
        ),
        road_outline=None,
    )


def _values_at_ends(
    repeat: Element, name: str, default: float
) -> tuple[float, float]:
    """Returns the values of an attribute at both ends of a repetition."""
    first = repeat.number(f"{name}Start", default)
    return first, repeat.number(f"{name}End", first)
