"""Areas of a road network: carriageway, sidewalks, medians, bays, lanes."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
import itertools
import math

import numpy as np
from shapely import GEOSException, make_valid, set_precision, unary_union
from shapely.geometry import LineString, MultiPolygon, Point, Polygon
from shapely.geometry.base import BaseGeometry

from worlds.roads.road import Arm, Junction, Road

# Segments per quarter circle in rounded outlines: a kerb of 13 m radius is then
# exact to 6 cm.
_QUADRANT_SEGMENTS = 8
# Outlines have their vertices on a grid of this size [m].
_GRID = 0.001
# Vertices closer to an outline than this are dropped [m].
_SIMPLIFY = 0.01
# Slits between areas are closed up to twice this width. They remain where roads
# end beside one another at an angle [m].
_SEAM = 0.25
# Junctions extend this far into their roads before they are cut off at the
# roads' ends [m].
_OVERLAP = 0.5
# Pieces of a junction beside its roads are dropped if they are thinner than
# twice this [m].
_HALF_SPLINTER = 0.5
# A parking bay keeps clear of the junction at each end of its road [m].
_BAY_CLEARANCE = 3.0


@dataclass(frozen=True)
class Areas:
    """The areas of all streets of a road network, seen from above [m].

    Attributes:
        carriageway: the area between the kerbs, where vehicles drive or park.
        lane_area: the carriageway without parking bays.
        sidewalks: areas beside the roads and around all corners, at kerb
            height.
        medians: strips with kerbs between the two directions of a road.
        parking_bays: maps (name of the road, side) to the area of the bays. The
            side is "left" or "right", as seen in the road's direction
            `forward`.
    """

    carriageway: MultiPolygon
    lane_area: MultiPolygon
    sidewalks: MultiPolygon
    medians: MultiPolygon
    parking_bays: Mapping[tuple[str, str], BaseGeometry] = field(
        default_factory=dict
    )


def corner_setback(
    half_width: float, other_half_width: float, angle: float, kerb_radius: float
) -> float:
    """Returns the distance from a junction at which a road must end [m].

    The kerb at the corner between the road and its neighbour is rounded by an
    arc. The road ends where this arc begins. The edges of both roads meet at
    the distance (b + a cos(angle)) / sin(angle) along the road, and the arc
    begins r / tan(angle / 2) beyond this point. The result is at least r.

    Args:
        half_width: a, half the width of the road [m].
        other_half_width: b, half the width of the neighbouring road [m].
        angle: angle between both roads [rad].
        kerb_radius: r, radius of the kerb at the corner [m].
    """
    # Roads on top of one another never separate.
    if angle < 1e-6:
        return np.inf
    # Towards a straight angle, the corner and thus the distance vanish.
    if angle > np.radians(150.0):
        return kerb_radius
    edge = (other_half_width + half_width * math.cos(angle)) / math.sin(angle)
    return max(kerb_radius, edge + kerb_radius / math.tan(angle / 2))


def road_strip(road: Road) -> BaseGeometry:
    """Returns a road's carriageway, without junctions and parking bays."""
    return _band(road, -road.half_width, road.half_width)


def _band(
    road: Road, right: float, left: float, clearance: float = 0.0
) -> BaseGeometry:
    """Returns the area between two lateral offsets from the centreline [m].

    The area ends `clearance` before each end of the road [m].
    """
    stations = road.stations(clearance=clearance)
    outline = [
        road.evaluate(stations, left)[:, :2],
        road.evaluate(stations, right)[::-1, :2],
    ]
    return _simplified(Polygon(np.concatenate(outline)))


def junction_area(
    roads: Mapping[str, Road], junction: Junction
) -> BaseGeometry:
    """Returns the area between the ends of a junction's roads.

    The area is made in three steps. First, all roads are extended to the
    junction's position and united. Second, the corners between the roads are
    filled, so that kerbs have the junction's radius. Third, the roads outside
    the junction are cut off. At a dead end, the area is a disc around the end
    of the road.
    """
    radius = junction.kerb_radius
    area = _extended_roads(roads, junction)
    area = area.buffer(radius, quad_segs=4 * _QUADRANT_SEGMENTS).buffer(
        -radius, quad_segs=_QUADRANT_SEGMENTS
    )
    for arm in junction.arms:
        area = area.difference(road_strip(roads[arm.road]))
    # Cutting can leave splinters beside a road's end.
    area = area.buffer(-_HALF_SPLINTER, join_style="mitre").buffer(
        _HALF_SPLINTER, join_style="mitre"
    )
    pieces = getattr(area, "geoms", [area])
    centre = Point(junction.position)
    return _simplified(
        min(pieces, key=lambda piece: round(piece.distance(centre), 6))
    )


def _extended_roads(
    roads: Mapping[str, Road], junction: Junction
) -> BaseGeometry:
    """Returns the union of all roads, each extended to the junction's position.

    A dead end includes the disc in which its road ends.
    """
    stubs = [_arm_centreline(roads[arm.road], arm) for arm in junction.arms]
    parts = [
        line.buffer(arm.half_width, cap_style="flat")
        for line, arm in zip(stubs, junction.arms, strict=True)
    ]
    if len(stubs) == 1:
        parts.append(
            Point(junction.position).buffer(
                junction.kerb_radius, quad_segs=_QUADRANT_SEGMENTS
            )
        )
    # Where a through road bends, the stubs leave a wedge on the outside, which
    # is closed.
    for (a, line_a), (b, line_b) in itertools.combinations(
        zip(junction.arms, stubs, strict=True), 2
    ):
        through = LineString([*line_a.coords[::-1], *line_b.coords[1:]])
        width = min(a.half_width, b.half_width)
        parts.append(through.buffer(width, cap_style="flat"))
    return unary_union(parts)


def _arm_centreline(road: Road, arm: Arm) -> LineString:
    """Returns an arm's centreline, from the junction to beyond its setback."""
    reach = arm.setback + _OVERLAP
    stations = np.linspace(0.0, reach, int(np.ceil(reach)) + 1)
    if arm.end == "end":
        stations = road.full_length - stations
    return LineString(road.evaluate(stations)[:, :2])


def make_areas(
    roads: Mapping[str, Road], junction_areas: Mapping[str, BaseGeometry]
) -> Areas:
    """Returns the areas of a road network, from its roads and junctions.

    Args:
        roads: name of each road -> the road.
        junction_areas: name of each junction -> its area, seen from above [m].
    """
    strips = {name: road_strip(road) for name, road in roads.items()}
    bays = _parking_bays(roads)
    wide = [r for r in roads.values() if 0 < r.median < r.length]
    medians = unary_union([_median(road) for road in wide])
    without_bays = union_without_slits(
        [*strips.values(), *junction_areas.values()], _SEAM
    )
    carriageway = union_without_slits([without_bays, *bays.values()], _SEAM)
    widened = [
        strips[name].buffer(road.sidewalk, quad_segs=_QUADRANT_SEGMENTS)
        for name, road in roads.items()
    ]
    for name, area in junction_areas.items():
        arms = [r for r in roads.values() if name in (r.start, r.end)]
        width = min(road.sidewalk for road in arms)
        widened.append(area.buffer(width, quad_segs=_QUADRANT_SEGMENTS))
    outline = _simplified(union_without_slits(widened, _SEAM))
    return Areas(
        carriageway=_multi_polygon(carriageway.difference(medians)),
        lane_area=_multi_polygon(without_bays.difference(medians)),
        sidewalks=_multi_polygon(outline.difference(carriageway)),
        medians=_multi_polygon(medians),
        parking_bays=bays,
    )


def _parking_bays(
    roads: Mapping[str, Road],
) -> dict[tuple[str, str], BaseGeometry]:
    """Returns the area of the parking bays on each side of each road.

    The result maps (name of the road, side) to the area.
    """
    bays = {}
    for name, road in roads.items():
        if road.parking > 0 and road.length > 2 * _BAY_CLEARANCE:
            edge = road.half_width
            far = road.half_width + road.parking
            bays[name, "right"] = _band(road, -far, -edge, _BAY_CLEARANCE)
            bays[name, "left"] = _band(road, edge, far, _BAY_CLEARANCE)
    return bays


def _median(road: Road) -> BaseGeometry:
    """Returns a road's median, which is rounded at both ends of the road."""
    half = road.median / 2
    shift = (
        road.lane_width * (road.lanes["forward"] - road.lanes["backward"]) / 2
    )
    stations = road.stations(clearance=half)
    line = LineString(road.evaluate(stations, shift)[:, :2])
    return _simplified(line.buffer(half, quad_segs=_QUADRANT_SEGMENTS))


def _simplified(area: BaseGeometry) -> BaseGeometry:
    """Returns an area without unnecessary vertices of its outline.

    Coordinates are rounded first. Otherwise their last bits, which differ
    between versions of the numerical libraries, would decide which vertices are
    removed: on an evenly sampled arc, many vertices are equally unnecessary.

    Raises:
        ValueError: if the outline crosses itself.
    """
    try:
        return set_precision(area, _GRID).simplify(_SIMPLIFY)
    except GEOSException as error:
        raise ValueError(
            f"the outline crosses itself, as in too tight a bend ({error})"
        ) from error


def union_without_slits(
    parts: Iterable[BaseGeometry], seam: float
) -> BaseGeometry:
    """Returns the union of areas, with the slits between neighbours closed.

    Slits are closed up to a width of 2 `seam` [m].
    """
    # GEOS divides by zero at edges that fold back, but its result is right.
    with np.errstate(divide="ignore", invalid="ignore"):
        grown = unary_union(
            [part.buffer(seam, join_style="mitre") for part in parts]
        )
        joined = grown.buffer(-seam, join_style="mitre")
    if joined.is_valid:
        return joined
    # At a sharp corner, GEOS may return an outline that crosses itself.
    return make_valid(joined, method="structure", keep_collapsed=False)


def _multi_polygon(area: BaseGeometry) -> MultiPolygon:
    """Returns the polygons of an area, without lines and points."""
    pieces = getattr(area, "geoms", [area])
    full = [p for p in pieces if isinstance(p, Polygon) and not p.is_empty]
    return MultiPolygon(full)
