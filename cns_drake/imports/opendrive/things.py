"""Signals and objects beside OpenDRIVE roads, as structures."""

from collections.abc import Iterator, Sequence
from dataclasses import replace
import math
import zlib

import numpy as np
from scipy.spatial import cKDTree
import shapely
from shapely.geometry import LineString, Polygon, box
from shapely.geometry.base import BaseGeometry

from cns_drake.base.xml_elements import Element
from cns_drake.city.geometry import Structure, placed
from cns_drake.city.placement.draft import name_stem
from cns_drake.city.placement.objects import OBJECTS
from cns_drake.city.plants.trees import tree
from cns_drake.imports.faces import extruded
from cns_drake.imports.foreign_city import make_imported
from cns_drake.imports.opendrive.lanes import TYPES, stations
from cns_drake.imports.opendrive.road_model import ImportedRoad, Thing
from cns_drake.imports.options import ImportFaults

_MOST_REPEATS = 10_000
# Distance of trees that are repeated without a distance [m].
_TREES = 4.0
_LARGEST = 1000.0  # [m]
# Things of these types are painted, or flat on the ground.
_FLAT = ("crosswalk", "roadmark", "patch", "parkingspace", "none.flat")
_LEAST_HEIGHT = 0.05
_LEAST_SIDE = 0.05
_LEAST_AREA = 1e-4
# Places that are closer than this are one place [m].
_SAME = 1e-4
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
    for k, one in enumerate(road.all("signals", "signal")):
        yield Thing(
            name=f"signal_{name}_{k}",
            is_signal=True,
            kind=one.value("type", "").lower(),
            s=one.number("s"),
            t=one.number("t"),
            z=one.number("zOffset", 0.0),
            heading=one.number("hOffset", 0.0),
            size=(0.0, one.number("width", 0.0), one.number("height", 0.0)),
            is_dynamic=one.value("dynamic", "no") == "yes",
            faces_back=one.value("orientation", "none") == "-",
        )
    for k, one in enumerate(road.all("objects", "object")):
        thing = _object(one, f"object_{name}_{k}")
        for _ in list(one.all("outlines", "outline"))[1:]:
            faults.add("further outline of an object, not read", thing.name)
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
    corners = _corners(outline, "cornerLocal", "uvz")
    road_corners = _corners(outline, "cornerRoad", ("s", "t", "dz"))
    return Thing(
        name=name,
        is_signal=False,
        kind=one.value("type", one.value("name", "none")).lower(),
        s=one.number("s"),
        t=one.number("t"),
        z=one.number("zOffset", 0.0),
        heading=one.number("hdg", 0.0),
        size=size,
        outline=corners,
        road_outline=road_corners,
        is_open=outline is not None and outline.value("closed", "") == "false",
    )


def _corners(
    outline: Element | None, tag: str, names: Sequence[str]
) -> np.ndarray | None:
    if outline is None:
        return None
    x, y, z = names
    rows = [
        (
            one.number(x),
            one.number(y),
            one.number(z, 0.0),
            one.number("height", 0.0),
        )
        for one in outline.all(tag)
    ]
    return np.array(rows) if len(rows) >= 2 else None


def _repeated(
    thing: Thing, repeat: Element, number: int, faults: ImportFaults
) -> Iterator[Thing]:
    start, length = repeat.number("s"), repeat.number("length")
    distance = repeat.number("distance", 0.0)
    _, width, height = thing.size
    if thing.outline is not None:
        width = width or float(np.ptp(thing.outline[:, 1]))
        height = height or float(thing.outline[:, 3].max())

    def ends(name: str, default: float) -> tuple[float, float]:
        first = repeat.number(f"{name}Start", default)
        return first, repeat.number(f"{name}End", first)

    if distance <= 0.0 < length and not thing.kind.startswith("tree"):
        columns = (
            (start, start + length),
            ends("t", thing.t),
            ends("zOffset", thing.z),
            ends("width", width),
            ends("height", height),
        )
        swept = np.array(columns).T
        if swept[:, 3:].max() > _LARGEST:
            raise ValueError(
                f"line {repeat.line}: repeat: a size of over {_LARGEST:g} m"
            )
        begin = max(start, 0.0) if start + length > 0.0 else start
        yield thing._replace(
            name=f"{thing.name}_{number}", s=begin, swept=swept
        )
        return
    step = distance if distance > 0.0 else _TREES
    count = max(math.floor(length / step + 1e-9), 0) + 1
    if count > _MOST_REPEATS:
        faults.add(
            f"object repeated more than {_MOST_REPEATS} times, left out",
            thing.name,
        )
        return
    for k in range(count):
        at = k * step
        part = min(1.0, at / length) if length > 0.0 else 0.0

        def value(name: str, default: float, part: float = part) -> float:
            first, last = ends(name, default)
            return first + part * (last - first)

        own, width, height = thing.size
        size = (own, value("width", width), value("height", height))
        yield thing._replace(
            name=f"{thing.name}_{number}_{k}",
            s=start + at,
            t=value("t", thing.t),
            z=value("zOffset", thing.z),
            size=size,
            road_outline=None,
        )


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
        if not 0.0 <= thing.s <= road.length + 1.0:
            faults.add(
                "object beyond the end of its road, left out", thing.name
            )
            continue
        name = thing.name
        x, y, z, heading = _place(road, thing)
        if thing.is_signal:
            key = _by_type(thing.kind, "signs", "sign_rectangular")
            if thing.is_dynamic:
                key = "traffic_light_post"
            builder = OBJECTS[key]
            facing = heading + thing.heading
            facing += 0.0 if thing.faces_back else _HALF_TURN
            if thing.is_dynamic:
                # The front of traffic lights in the file is their left side
                # here.
                facing -= _HALF_TURN / 2.0
            one = Structure(
                name,
                builder.semantic_class,
                builder.build(_rng(name)),
                (x, y, z),
                round(math.remainder(facing, 2.0 * math.pi), 5),
                ("signal",),
                name_stem(key),
            )
            if one.footprint_W.intersects(lanes):
                faults.add("signal over a lane, left out", name)
            else:
                yield one
        elif thing.kind.startswith(_FLAT):
            faults.add("object that is painted on the road, left out", name)
        elif thing.kind.startswith("tree"):
            model = tree(
                _rng(name), species="lime_tree", height=thing.size[2] or None
            )
            yield Structure(
                name, "vegetation", model, (x, y, z), 0.0, ("object",), "tree"
            )
        elif thing.swept is not None:
            solid = _swept(road, thing, thing.swept, faults)
            if solid is not None:
                yield solid
        else:
            solid = _solid(road, thing, name, (x, y, z, heading), faults)
            if solid is not None:
                yield solid


def _place(
    road: ImportedRoad, thing: Thing
) -> tuple[float, float, float, float]:
    """Returns x, y, z [m] of a thing's foot, and the heading of the road."""
    s = np.array([min(thing.s, road.length)])
    inside = np.clip(s, 1e-6, road.length - 1e-6)
    x, y, z = road.points(s, inside, np.array([thing.t]))[0].tolist()
    heading = float(road.reference(s, inside)[0, 3])
    low = 0.0 if thing.is_signal else thing.z
    return round(x, 3), round(y, 3), round(z + low, 3), heading


def _by_type(kind: str, table: str, otherwise: str) -> str:
    """Returns the name in a table whose beginnings match a type."""
    for name, beginnings in TYPES[table].items():
        if kind.startswith(tuple(beginnings)):
            return str(name)
    return otherwise


def _solid(
    road: ImportedRoad,
    thing: Thing,
    name: str,
    place: tuple[float, float, float, float],
    faults: ImportFaults,
) -> Structure | None:
    """Returns an object extruded from its outline; None without an outline."""
    x, y, z, heading = place
    length, width, high = thing.size
    is_open = thing.is_open
    if thing.road_outline is not None:
        s, t, rise, heights = thing.road_outline.T
        s = np.clip(s, 0.0, road.length)
        inside = np.clip(s, 1e-6, road.length - 1e-6)
        corners = road.points(s, inside, t)
        low = corners[:, 2] + rise
        line = LineString(corners[:, :2])
    elif thing.outline is None and length == width == 0.0:
        faults.add("object without a size, left out", name)
        return None
    else:
        half = max(length, _LEAST_SIDE) / 2, max(width, _LEAST_SIDE) / 2
        footprint: LineString = box(-half[0], -half[1], *half).exterior
        heights = rise = np.zeros(len(footprint.coords))
        if thing.outline is not None:
            footprint = LineString(thing.outline[:, :2])
            rise, heights = thing.outline[:, 2:].T
        else:
            is_open = False
        low = z + rise
        line = placed(footprint, (x, y), heading + thing.heading)
    if not heights.any():
        heights = np.full(len(low), high)
    if heights.max() < _LEAST_HEIGHT:
        faults.add("object without a height, left out", name)
        return None
    places = shapely.get_coordinates(line)
    if is_open or len(places) == 2:
        polygon = line.buffer(_LEAST_SIDE, cap_style="flat", join_style="mitre")
    else:
        polygon = Polygon(places)
    if not polygon.is_valid:
        faults.add("outline that crosses itself, repaired", name)
    pieces = [
        piece
        for piece in shapely.get_parts(
            shapely.set_precision(shapely.make_valid(polygon), 0.001)
        )
        if isinstance(piece, Polygon) and piece.area > _LEAST_AREA
    ]
    if not pieces:
        faults.add("object without an area, left out", name)
        return None
    foot = float(low.min())
    triangles = np.concatenate(
        [
            part
            for piece in pieces
            for part in extruded(piece, foot, foot + 1.0, name, faults)
        ]
    )
    # Each vertex has the heights of the nearest corner.
    _, nearest = cKDTree(places).query(triangles[..., :2])
    is_top = triangles[..., 2] > foot
    triangles[..., 2] = low[nearest] + is_top * heights[nearest]
    return _structure(thing, triangles, shapely.union_all(pieces))


def _swept(
    road: ImportedRoad, thing: Thing, ends: np.ndarray, faults: ImportFaults
) -> Structure | None:
    """Returns an object without gaps along a road, such as a wall.

    Its middle line is parallel to the reference line, or leads away from it,
    and its foot follows the road. `ends` is the thing's `swept`.
    """
    start, end = ends[:, 0]
    if end > road.length + 1.0 or start < 0.0:
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
    is_new = np.linalg.norm(np.diff(middle[:, :2], axis=0), axis=1) > _SAME
    kept = np.append(True, is_new)
    middle, rise, width, height = (
        one[kept] for one in (middle, rise, width, height)
    )
    if len(middle) < 2:
        faults.add("object without an area, left out", thing.name)
        return None
    half = np.maximum(width, _LEAST_SIDE)[:, None] / 2.0
    to_left = half * _to_left(middle[:, :2])
    edges = [middle[:, :2] - to_left, middle[:, :2] + to_left]
    low = middle[:, 2] + rise
    high = low + np.maximum(height, 0.0)
    # Corners around a cross-section, seen along the road.
    corners = np.stack(
        [
            np.c_[np.round(edges[side], 3), z]
            for side, z in ((0, low), (0, high), (1, high), (1, low))
        ],
        axis=1,
    )
    before, after = corners[:-1], corners[1:]
    quads = [
        np.stack([before[:, k], after[:, k], after[:, m], before[:, m]], axis=1)
        for k, m in ((0, 1), (1, 2), (2, 3), (3, 0))
    ]
    quads += [corners[:1], corners[-1:, ::-1]]
    around = np.concatenate(quads)
    triangles = np.concatenate([around[:, [0, 1, 2]], around[:, [0, 2, 3]]])
    below = np.concatenate([before[:, [0, 3]], after[:, [3, 0]]], axis=1)
    area = shapely.make_valid(shapely.polygons(below[..., :2]))
    return _structure(thing, triangles, shapely.union_all(area))


def _to_left(places: np.ndarray) -> np.ndarray:
    """Returns vectors (N, 2) from a line to a line 1 m on its left."""
    along = np.diff(places, axis=0)
    along /= np.linalg.norm(along, axis=1, keepdims=True)
    left = np.stack([-along[:, 1], along[:, 0]], axis=1)
    left = np.concatenate([left[:1], left[:-1] + left[1:], left[-1:]])
    # The corner of a mitre is farther away, but at most twice as far.
    left[1:-1] /= np.maximum(
        (left[1:-1] ** 2).sum(axis=1, keepdims=True) / 2.0, 1.0
    )
    return left


def _structure(
    thing: Thing, triangles: np.ndarray, footprint: BaseGeometry
) -> Structure:
    one = make_imported(
        thing.name,
        _by_type(thing.kind, "objects", "other-object"),
        "Object",
        {"body": triangles},
        {},
        narrower=thing.kind,
    ).structure
    model = replace(one.model, footprint=footprint)
    return replace(one, model=model, tags=("object",))


def _rng(name: str) -> np.random.Generator:
    return np.random.default_rng(zlib.crc32(name.encode()))
