"""Signals and objects beside OpenDRIVE roads: read, and as structures."""

from collections.abc import Iterator, Sequence
from dataclasses import replace
import math
from typing import NamedTuple
import zlib

import numpy as np
from scipy.spatial import cKDTree
import shapely
from shapely.geometry import LineString, Polygon, box
from shapely.geometry.base import BaseGeometry

from evaluation.base import Element, step_lengths
from worlds.city import name_stem
from worlds.imports.faces import repaired
from worlds.imports.faults import ImportFaults
from worlds.imports.imported_objects import make_object
from worlds.imports.opendrive.lanes import TYPES, stations
from worlds.imports.opendrive.road_model import ImportedRoad, Thing
from worlds.imports.solids import extruded
from worlds.shapes import GRID, OBJECTS, Structure, placed, tree

# A last repetition may be beyond its stretch by this share of the distance.
_ROUNDING = 1e-9
# Distance of trees that are repeated without a distance [m].
_TREE_SPACING = 4.0
# Greatest length, width and height of an object [m].
_LARGEST_SIZE = 1000.0
# Things of these types are painted, or flat on the ground.
_FLAT = ("crosswalk", "roadmark", "patch", "parkingspace", "none.flat")
# Lower objects are left out [m].
_LEAST_HEIGHT = 0.05
# Least length and width of an object [m].
_LEAST_SIDE = 0.05
# Smaller pieces of an outline are dropped [m^2].
_LEAST_AREA = 1e-4
# Places that are closer than this are one place [m].
_SAME_PLACE = 1e-4
# Objects may be this far beyond the end of their road [m].
_BEYOND_ROAD = 1.0
# Places at an end of a road are on the piece of the road this far inside [m].
_INSIDE = 1e-6
_HALF_TURN = math.pi


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
            yield from _repetitions(thing, repeat, number_of_repeat)


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


def _repetitions(thing: Thing, repeat: Element, number: int) -> Iterator[Thing]:
    """Yields the repetitions of an object, or one object without gaps.

    Args:
        repeat: how the object is repeated, in the file.
        number: number of `repeat` among the object's repetitions. The new names
            contain this number.

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


class _Foot(NamedTuple):
    """Where a thing stands.

    Attributes:
        x, y, z: the place in W [m].
        heading: heading of the road there, in W [rad].
    """

    x: float
    y: float
    z: float
    heading: float


class _PlacedOutline(NamedTuple):
    """The outline of an object, with N corners.

    Attributes:
        line: the outline in W [m].
        low: (N,) z of the foot below each corner in W [m].
        is_raised: whether any of these feet is above the road.
        heights: (N,) heights of the corners above this foot [m].
    """

    line: LineString
    low: np.ndarray
    is_raised: bool
    heights: np.ndarray


def thing_structures(
    road: ImportedRoad, lanes: BaseGeometry, faults: ImportFaults
) -> Iterator[Structure]:
    """Yields structures of the signals and objects beside a road.

    Args:
        road: the road.
        lanes: area of all lanes in W [m]; signs inside this area are left out.
        faults: counts what is left out.
    """
    for thing in road.things:
        if not 0.0 <= thing.s <= road.length + _BEYOND_ROAD:
            faults.add(
                "object beyond the end of its road, left out", thing.name
            )
            continue
        structure: Structure | None
        if thing.is_signal:
            structure = _signal(road, thing)
            if structure.footprint_W.intersects(lanes):
                faults.add("signal over a lane, left out", thing.name)
                continue
        elif thing.kind.startswith(_FLAT):
            kind = "object that is painted on the road, left out"
            faults.add(kind, thing.name)
            continue
        elif thing.kind.startswith("tree"):
            structure = _tree(road, thing)
        elif thing.swept is not None:
            structure = _swept_object(road, thing, thing.swept, faults)
        else:
            structure = _extruded_object(road, thing, faults)
        if structure is not None:
            yield structure


def _signal(road: ImportedRoad, thing: Thing) -> Structure:
    """Returns a traffic light or a sign, which faces its traffic."""
    foot = _foot_of(road, thing)
    key = _name_by_type(thing.kind, "signs", "sign_rectangular")
    if thing.is_dynamic:
        key = "traffic_light_post"
    builder = OBJECTS[key]
    facing = foot.heading + thing.heading
    facing += 0.0 if thing.faces_back else _HALF_TURN
    if thing.is_dynamic:
        # The front of traffic lights in the file is their left side here.
        facing -= _HALF_TURN / 2.0
    return Structure(
        thing.name,
        builder.semantic_class,
        builder.build(_generator_of(thing.name)),
        (foot.x, foot.y, foot.z),
        round(math.remainder(facing, 2.0 * math.pi), 5),
        ("signal",),
        name_stem(key),
    )


def _tree(road: ImportedRoad, thing: Thing) -> Structure:
    """Returns a tree of the height in the file or, without one, any height."""
    foot = _foot_of(road, thing)
    model = tree(
        _generator_of(thing.name),
        species="lime_tree",
        height=thing.size[2] or None,
    )
    return Structure(
        thing.name,
        "vegetation",
        model,
        (foot.x, foot.y, foot.z),
        0.0,
        ("object",),
        "tree",
    )


def _foot_of(road: ImportedRoad, thing: Thing) -> _Foot:
    """Returns where a thing stands, in whole millimetres.

    A signal stands on the road; its own height is that of its plate.
    """
    s = np.array([min(thing.s, road.length)])
    inside = np.clip(s, _INSIDE, road.length - _INSIDE)
    x, y, z = road.points(s, inside, np.array([thing.t]))[0].tolist()
    heading = float(road.reference(s, inside)[0, 3])
    return _Foot(round(x, 3), round(y, 3), round(z + thing.z, 3), heading)


def _name_by_type(kind: str, table: str, otherwise: str) -> str:
    """Returns the first name in a table whose beginnings match a type.

    `table` is the name of a table of `types.yaml`. The result is `otherwise` if
    no beginning matches.
    """
    for name, beginnings in TYPES[table].items():
        if kind.startswith(tuple(beginnings)):
            return str(name)
    return otherwise


def _extruded_object(
    road: ImportedRoad, thing: Thing, faults: ImportFaults
) -> Structure | None:
    """Returns an object that is extruded from its outline.

    The result is None if the object has no size, height or area.
    """
    name = thing.name
    outline = _placed_outline(road, thing)
    if outline is None:
        faults.add("object without a size, left out", name)
        return None
    heights = outline.heights
    if not heights.any():
        heights = np.full(len(heights), thing.size[2])
    if heights.max() < _LEAST_HEIGHT:
        faults.add("object without a height, left out", name)
        return None
    polygon = _area_of_outline(thing, outline.line)
    pieces = [
        piece
        for piece in shapely.get_parts(
            shapely.set_precision(
                repaired(polygon, "outline", name, faults), GRID
            )
        )
        if isinstance(piece, Polygon) and piece.area > _LEAST_AREA
    ]
    if not pieces:
        faults.add("object without an area, left out", name)
        return None
    low = outline.low
    foot = float(low.min())
    # Any height will do, because each vertex gets that of the nearest corner.
    triangles = np.concatenate(
        [
            part
            for piece in pieces
            for part in extruded(
                piece,
                foot,
                foot + 1.0,
                name,
                faults,
                is_raised=outline.is_raised,
            )
        ]
    )
    corners = shapely.get_coordinates(outline.line)
    _, nearest = cKDTree(corners).query(triangles[..., :2])
    is_top = triangles[..., 2] > foot
    triangles[..., 2] = low[nearest] + is_top * heights[nearest]
    return _object_structure(thing, triangles, shapely.union_all(pieces))


def _area_of_outline(thing: Thing, line: LineString) -> Polygon:
    """Returns the area of an object with an outline [m], perhaps invalid.

    An object whose outline is open, or has just two corners, is narrow.
    """
    has_outline = thing.outline is not None or thing.road_outline is not None
    corners = shapely.get_coordinates(line)
    if (thing.is_open and has_outline) or len(corners) == 2:
        return line.buffer(_LEAST_SIDE, cap_style="flat", join_style="mitre")
    return Polygon(corners)


def _placed_outline(road: ImportedRoad, thing: Thing) -> _PlacedOutline | None:
    """Returns the outline of an object in W; None if the object has no size.

    Without an outline in the file, the outline is the box of the object, and
    the heights of its corners are 0.
    """
    if thing.road_outline is not None:
        s, t, rise, heights = thing.road_outline.T
        s = np.clip(s, 0.0, road.length)
        inside = np.clip(s, _INSIDE, road.length - _INSIDE)
        corners = road.points(s, inside, t)
        line = LineString(corners[:, :2])
        is_raised = bool(rise.max() > 0.0)
        return _PlacedOutline(line, corners[:, 2] + rise, is_raised, heights)
    length, width, _ = thing.size
    if thing.outline is not None:
        footprint = LineString(thing.outline[:, :2])
        rise, heights = thing.outline[:, 2:].T
    elif length == width == 0.0:
        return None
    else:
        half = max(length, _LEAST_SIDE) / 2, max(width, _LEAST_SIDE) / 2
        footprint = box(-half[0], -half[1], *half).exterior
        heights = rise = np.zeros(len(footprint.coords))
    foot = _foot_of(road, thing)
    line = placed(footprint, (foot.x, foot.y), foot.heading + thing.heading)
    is_raised = bool(thing.z + rise.max() > 0.0)
    return _PlacedOutline(line, foot.z + rise, is_raised, heights)


def _swept_object(
    road: ImportedRoad, thing: Thing, ends: np.ndarray, faults: ImportFaults
) -> Structure | None:
    """Returns an object without gaps along a road, such as a wall.

    The middle line of the object is parallel to the reference line or leads
    away from this line; the foot of the object follows the road. `ends` is the
    thing's `swept`. The result is None if the object has no height or no area.
    """
    start, end = ends[:, 0]
    if end > road.length + _BEYOND_ROAD or start < 0.0:
        faults.add("object beyond the end of its road, cut", thing.name)
    s, inside = stations(road, max(start, 0.0), min(end, road.length))
    t, rise, width, height = (
        np.interp(s, ends[:, 0], column) for column in ends.T[1:]
    )
    if height.max() < _LEAST_HEIGHT:
        faults.add("object without a height, left out", thing.name)
        return None
    middle = road.points(s, inside, t)
    # Joints of the road are there twice.
    is_new = step_lengths(middle[:, :2]) > _SAME_PLACE
    kept = np.append(True, is_new)
    middle, rise, width, height = (
        values[kept] for values in (middle, rise, width, height)
    )
    if len(middle) < 2:
        faults.add("object without an area, left out", thing.name)
        return None
    half = np.maximum(width, _LEAST_SIDE)[:, None] / 2.0
    to_left = half * _to_left(middle[:, :2])
    right, left = middle[:, :2] - to_left, middle[:, :2] + to_left
    low = middle[:, 2] + rise
    high = low + np.maximum(height, 0.0)
    # Corners around a cross-section, seen along the road.
    sections = np.stack(
        [
            np.c_[np.round(edge, 3), z]
            for edge, z in (
                (right, low),
                (right, high),
                (left, high),
                (left, low),
            )
        ],
        axis=1,
    )
    before, after = sections[:-1], sections[1:]
    below = np.concatenate([before[:, [0, 3]], after[:, [3, 0]]], axis=1)
    area = shapely.make_valid(shapely.polygons(below[..., :2]))
    return _object_structure(
        thing, swept_surface(sections), shapely.union_all(area)
    )


def swept_surface(sections: np.ndarray) -> np.ndarray:
    """Returns the surface through cross-sections, as triangles (M, 3, 3) [m].

    `sections` (N, 4, 3) are the corners of each cross-section [m], counted
    counter-clockwise as seen along the object. The surface is closed at both
    ends.
    """
    before, after = sections[:-1], sections[1:]
    quads = [
        np.stack([before[:, a], after[:, a], after[:, b], before[:, b]], axis=1)
        for a, b in ((0, 1), (1, 2), (2, 3), (3, 0))
    ]
    quads += [sections[:1], sections[-1:, ::-1]]
    around = np.concatenate(quads)
    return np.concatenate([around[:, [0, 1, 2]], around[:, [0, 2, 3]]])


def _to_left(places: np.ndarray) -> np.ndarray:
    """Returns vectors (N, 2) from a line to the line 1 m to its left [m].

    `places` (N, 2) are the corners of the line [m].
    """
    along = np.diff(places, axis=0)
    along /= np.linalg.norm(along, axis=1, keepdims=True)
    left = np.stack([-along[:, 1], along[:, 0]], axis=1)
    left = np.concatenate([left[:1], left[:-1] + left[1:], left[-1:]])
    # The corner of a mitre is farther away, but at most twice as far.
    left[1:-1] /= np.maximum(
        (left[1:-1] ** 2).sum(axis=1, keepdims=True) / 2.0, 1.0
    )
    return left


def _object_structure(
    thing: Thing, triangles: np.ndarray, footprint: BaseGeometry
) -> Structure:
    """Returns the structure of an object made of triangles (M, 3, 3) [m].

    `footprint` is its area in W [m].
    """
    structure = make_object(
        thing.name,
        _name_by_type(thing.kind, "objects", "other-object"),
        "Object",
        {"body": triangles},
        {},
        kind=thing.kind,
        footprint=footprint,
    ).structure
    return replace(structure, tags=("object",))


def _generator_of(name: str) -> np.random.Generator:
    """Returns a random generator that depends only on a name."""
    return np.random.default_rng(zlib.crc32(name.encode()))
