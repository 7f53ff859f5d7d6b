"""Bridges and tunnels of imported roads: where they are, and their surfaces."""

from collections import defaultdict
from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np
from scipy.spatial import cKDTree
import shapely
from shapely import STRtree
from shapely.geometry import LineString
from shapely.geometry.base import BaseGeometry

from worlds.city import Pad
from worlds.imports.faults import ImportFaults
from worlds.imports.imported_objects import make_object
from worlds.imports.opendrive.lanes import (
    LEAST_WIDTH,
    LaneBand,
    lane_class,
    lane_polygon,
)
from worlds.imports.opendrive.things import swept_surface
from worlds.shapes import Structure, snap

# The underside of a bridge is this far below its upper side [m].
_DECK_DEPTH = np.array([0.0, 0.0, 0.8])
# Triangles are dropped if twice their area is not greater than this [m^2].
_LEAST_TWICE_AREA = 1e-6
# How far the end of a bridge extends to both sides: wider than a kerb [m].
_END_REACH = 0.2
# A road at least this far above another one is a bridge, and there is at least
# this room below a bridge of the file [m].
_HEADROOM = 3.0
# Ground below a bridge is level over this length [m].
_PAD_LENGTH = 20.0
# Roads are above one another if more than this of both is there [m^2].
_OVERLAP = 1.0
# Height of a tunnel's walls, and thickness of its walls and roof [m].
_TUNNEL_HEIGHT = 4.5
_WALL = 0.4
# Roads that are above one another by less than this, as in junctions, are one
# [m].
_LEAST_RISE = 1.0
# Places are above one another if they are at most this far apart, as seen from
# above. Lanes are often half metres wide, and no last bit decides [m].
_ABOVE_WITHIN = 2.5001
# A bridge extends this far to both sides of the road that it crosses [m].
_BRIDGE_REACH = 8.0
# The arrays of a band, with one row for each place along the road.
_ARRAYS = (
    "inner", "outer", "middle", "heading", "roll", "grade", "rise", "s",
)  # fmt: skip


def split_levels(
    bands: Sequence[LaneBand], faults: ImportFaults
) -> tuple[list[LaneBand], list[LaneBand]]:
    """Returns the lanes on the ground and the lanes on bridges.

    A bridge is where the file says so, and where a road passes over another.
    A lane that leads onto a bridge is cut at the bridge's end. Of a network
    without ground, nothing is a bridge.
    """
    raised = _raised_places(bands, faults)
    ground: list[LaneBand] = []
    bridges: list[LaneBand] = []
    for band in bands:
        above = raised.get(band.road.name, np.zeros(0))
        low, high = np.searchsorted(
            above, [band.s - _BRIDGE_REACH, band.s + _BRIDGE_REACH]
        )
        is_bridge = (high > low) | _is_within(band, "bridge")
        for part, carried in _parts_of_one_level(band, is_bridge):
            (bridges if carried else ground).append(part)
    return (ground, bridges) if ground else (list(bands), [])


def _is_within(band: LaneBand, kind: str) -> np.ndarray:
    """Returns where a lane is on a bridge, or in a tunnel, of the file.

    The result is (N,) bool; `kind` is that of the spans.
    """
    spans = [span for span in band.road.spans if span.kind == kind]
    inside = [(span.start <= band.s) & (band.s <= span.end) for span in spans]
    return np.any([np.zeros(len(band.s), bool), *inside], axis=0)


def grounds_below(
    raised: Sequence[LaneBand], ground: Sequence[LaneBand]
) -> list[Pad]:
    """Returns the ground below the bridges of the file, where it has none.

    A bridge over a road has the ground of that road. Below another one, such
    as over a river, there is headroom.
    """
    # Name of a road and start of a bridge -> number of a piece -> its lanes.
    pieces: dict[tuple[str, float], dict[int, list[LaneBand]]] = {}
    for band in raised:
        for span in band.road.spans:
            if span.kind != "bridge":
                continue
            of_bridge = pieces.setdefault((band.road.name, span.start), {})
            inside = (span.start <= band.s) & (band.s <= span.end)
            at = np.where(inside, band.s // _PAD_LENGTH, -1.0)
            for number in np.unique(at[inside]).astype(int).tolist():
                for part, is_it in _parts_of_one_level(band, at == number):
                    if is_it:
                        of_bridge.setdefault(number, []).append(part)
    areas = np.array(list(map(lane_polygon, ground)))
    tree = STRtree(areas)
    found: list[Pad] = []
    for of_bridge in pieces.values():
        pads = []
        for parts in of_bridge.values():
            area = shapely.union_all(list(map(lane_polygon, parts)))
            near = areas[tree.query(area, "dwithin", _ABOVE_WITHIN)]
            if area.intersection(shapely.union_all(near)).area > _OVERLAP:
                break
            abutments = shapely.union_all(near).buffer(_ABOVE_WITHIN)
            low = min(float(part.middle[:, 2].min()) for part in parts)
            height = round(low - _DECK_DEPTH[2] - _HEADROOM, 3)
            pads.append(Pad(snap(area.difference(abutments)), height))
        else:
            found += [pad for pad in pads if not pad.area.is_empty]
    return found


def tunnel_shells(
    bands: Sequence[LaneBand], raised: Sequence[LaneBand]
) -> Iterator[Structure]:
    """Yields walls and a roof around each tunnel of the file.

    Its road and the ground beside it are at the heights of the road.

    Args:
        bands: all lanes.
        raised: the lanes on bridges, which are a roof of what is below them.
    """
    sections: dict[tuple[str, int], list[LaneBand]] = defaultdict(list)
    for band in bands:
        if _is_within(band, "tunnel").any():
            sections[band.road.name, band.section].append(band)
    if not sections:
        return
    bridges = shapely.union_all(list(map(lane_polygon, raised)))
    bridges = bridges.buffer(_ABOVE_WITHIN)
    up = np.array([0.0, 0.0, 1.0])
    for (road, section), lanes in sections.items():
        lanes.sort(key=lambda band: band.lane.number)
        first, last = lanes[0], lanes[-1]
        right = first.outer if first.lane.number < 0 else first.inner
        left = last.outer if last.lane.number > 0 else last.inner
        width = np.linalg.norm(left - right, axis=1)
        is_built = _is_within(first, "tunnel") & (width > LEAST_WIDTH)
        is_built &= ~shapely.contains_xy(bridges, first.inner[:, :2])
        for number, (run, is_it) in enumerate(
            _stretches_of_one_level(is_built)
        ):
            if not is_it:
                continue
            a, b = right[run], left[run]
            out = _WALL * (b - a) / width[run, None]
            foot, top = 0.0 * up, _TUNNEL_HEIGHT * up
            boxes = (
                (a - out, a, foot, top),
                (b, b + out, foot, top),
                (a - out, b + out, top, top + _WALL * up),
            )
            surfaces = [
                swept_surface(
                    np.stack([p + low, p + high, q + high, q + low], axis=1)
                )
                for p, q, low, high in boxes
            ]
            outline = np.concatenate([a - out, (b + out)[::-1]])[:, :2]
            yield make_object(
                f"tunnel_{road}_{section}_{number}",
                "other-structure",
                "Tunnel",
                {"shell": _without_slivers(np.concatenate(surfaces))},
                {},
                footprint=shapely.make_valid(shapely.Polygon(outline)),
            ).structure


def _without_slivers(triangles: np.ndarray) -> np.ndarray:
    """Returns triangles (M, 3, 3) without those that have no area [m]."""
    edges = np.cross(
        triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0]
    )
    return triangles[np.linalg.norm(edges, axis=1) > _LEAST_TWICE_AREA]


def _parts_of_one_level(
    band: LaneBand, is_bridge: np.ndarray
) -> Iterator[tuple[LaneBand, bool]]:
    """Yields the parts of a lane on one level, and whether it is a bridge.

    `is_bridge` (N,) says which places along the lane are on a bridge.
    """
    for run, carried in _stretches_of_one_level(is_bridge):
        parts = {name: getattr(band, name)[run] for name in _ARRAYS}
        yield replace(band, **parts), carried


def _raised_places(
    bands: Sequence[LaneBand], faults: ImportFaults
) -> dict[str, np.ndarray]:
    """Returns where each road passes over another road.

    The result maps the name of a road to increasing distances along it [m].
    Roads that pass over another with less than the headroom are counted.
    """
    # Roads are numbered by one of their bands.
    number_of = {band.road.name: number for number, band in enumerate(bands)}
    rows = [np.zeros((0, 5))]
    for band in bands:
        wide = band.width > LEAST_WIDTH
        for edge in (band.inner, band.middle, band.outer):
            numbers = np.full(len(band.s), number_of[band.road.name])
            rows.append(np.column_stack([edge, band.s, numbers])[wide])
    places = np.concatenate(rows)
    xy = places[:, :2]
    z, s, number = places[:, 2:].T
    if len(places) == 0:
        return {}
    tree = cKDTree(xy)
    raised: dict[str, list[float]] = {}
    merged: set[tuple[int, int]] = set()
    high = np.flatnonzero((z - z.min()).round(6) >= _LEAST_RISE)
    for place, near in zip(
        high, tree.query_ball_point(xy[high], _ABOVE_WITHIN), strict=True
    ):
        # Rounded, so that exactly this headroom is enough.
        above = (z[place] - z[near]).round(6)
        above[number[near] == number[place]] = 0.0
        own = int(number[place])
        if above.max() >= _HEADROOM:
            raised.setdefault(bands[own].road.name, []).append(float(s[place]))
        elif above.max() >= _LEAST_RISE:
            merged.add((own, int(number[near[above.argmax()]])))
    areas: dict[str, list[BaseGeometry]] = defaultdict(list)
    names = [tuple(bands[one].road.name for one in pair) for pair in merged]
    among = {name for pair in names for name in pair}
    among -= {b.road.name for b in bands if _is_within(b, "bridge").any()}
    for band in bands:
        if band.road.name in among:
            areas[band.road.name].append(lane_polygon(band))
    for upper, lower in sorted(names):
        over, under = (shapely.union_all(areas[k]) for k in (upper, lower))
        if upper not in raised and over.intersection(under).area > _OVERLAP:
            faults.add("road 1 to 3 m above another, merged with it", upper)
    return {road: np.unique(along) for road, along in raised.items()}


def _stretches_of_one_level(
    is_bridge: np.ndarray,
) -> Iterator[tuple[slice, bool]]:
    """Yields stretches of a lane with one level, and whether it is a bridge.

    `is_bridge` (N,) says which places along the lane are on a bridge.
    Neighbouring stretches share a place.
    """
    starts = np.flatnonzero(np.diff(is_bridge.astype(int), prepend=-1))
    for a, b in zip(starts, [*starts[1:], len(is_bridge)], strict=True):
        last = min(b + 1, len(is_bridge))
        if last - a > 1:
            yield slice(int(a), int(last)), bool(is_bridge[a])


def bridge_decks(bands: Sequence[LaneBand]) -> Iterator[Structure]:
    """Yields the structures of bridges: their upper sides and undersides.

    `bands` contains the lanes on bridges.
    """
    of_road: dict[tuple[str, str], list[np.ndarray]] = defaultdict(list)
    for band in bands:
        # The sides of parts without a lane are closed as well.
        semantic_class = lane_class(band.kind) or "other-ground"
        left, right = band.inner, band.outer
        if band.lane.number > 0:
            left, right = right, left
        upper = _triangles_between(right, left)
        of_road[band.road.name, semantic_class].append(upper)
        low_left, low_right = left - _DECK_DEPTH, right - _DECK_DEPTH
        of_road[band.road.name, "other-structure"] += [
            _triangles_between(low_left, low_right),
            _triangles_between(low_right, right),
            _triangles_between(left, low_left),
        ]
    for (road, semantic_class), pieces in of_road.items():
        triangles = _without_slivers(np.concatenate(pieces))
        if len(triangles):
            yield make_object(
                f"bridge_{road}_{semantic_class}",
                semantic_class,
                "Bridge",
                {"deck": triangles},
                {},
            ).structure


def bridge_ends(bands: Sequence[LaneBand]) -> BaseGeometry:
    """Returns narrow strips across the lanes at both ends of bridges, in W [m].

    `bands` contains the lanes on bridges.
    """
    lines = [
        LineString([band.inner[k, :2], band.outer[k, :2]])
        for band in bands
        for k in (0, -1)
    ]
    return shapely.union_all(lines).buffer(_END_REACH, cap_style="flat")


def _triangles_between(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Returns triangles between two lines (N, 3).

    The triangles look upwards if line `b` is to the left of line `a`.
    """
    return np.concatenate(
        [
            np.stack([a[:-1], a[1:], b[1:]], axis=1),
            np.stack([a[:-1], b[1:], b[:-1]], axis=1),
        ]
    )
