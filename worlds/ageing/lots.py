"""Lots of a city: the plots of its buildings, and free plots along streets."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace
import itertools

import numpy as np
import shapely
from shapely.geometry import LineString, Polygon
from shapely.geometry.base import BaseGeometry

from evaluation.base import InputError
from worlds.ageing.old_world import OldWorld
from worlds.ageing.plots import PARTY_WALL, Plot
from worlds.city import lines_along, lot_at
from worlds.shapes import Structure, polygons_of

# Widths of new plots along streets, tried in turn [m].
_PLOT_WIDTHS = (22.0, 16.0, 11.0)
# Greatest depth of new plots [m].
_PLOT_DEPTH = 14.0
# Distances of new plots from the street that are tried [m].
_SETBACKS = (3.0, 22.0)
# Greatest difference of heights on a new plot [m].
_STEEPEST = 0.6
# No building on a new plot is higher than this [m].
_HIGHEST_NEW = 20.0
# Free plots farther than this from all buildings are open country [m].
_IN_TOWN = 30.0
# The ground's height at a plot is taken this far in front of it [m].
_IN_FRONT = 1.0
# Ground that is farther than this below a building's lowest point is not the
# building's: something else lies in front of it [m].
_DEEPEST_BELOW = 0.5


@dataclass
class AgeingLot:
    """A plot and what stands on it.

    Attributes:
        number: number of the lot in the city.
        plot: the plot.
        height: usual height of buildings on the lot [m].
        building: name of the building; None without one.
        parts: names of the building's annexes, additional storeys and
            balconies; without a building, names of the structures on the lot.
        finished: year in which the building `coming` is finished; 0 if none is
            being built.
        coming: the building that is being built.
        old: name of the building that `coming` replaces; "" if there was none.
        is_raised: whether a storey was added to the building; at most one is
            added.
        has_balconies: whether balconies were added to the building.
    """

    number: int
    plot: Plot
    height: float
    building: str | None = None
    parts: list[str] = field(default_factory=list)
    finished: int = 0
    coming: Structure | None = None
    old: str = ""
    is_raised: bool = False
    has_balconies: bool = False


def find_lots(world: OldWorld, kept_free: BaseGeometry) -> list[AgeingLot]:
    """Returns the lots of a city: first lots with buildings, then free lots.

    Args:
        world: the city.
        kept_free: area in W [m] on which nothing is built.

    Raises:
        InputError: the city has no building.
    """
    lots = list(_lots_of_buildings(world, kept_free))
    if not lots:
        raise InputError(
            f"{world.path}: no structure of class building: a map without "
            "lots does not age"
        )
    return lots + _free_lots(world, kept_free, lots)


def _lots_of_buildings(
    world: OldWorld, kept_free: BaseGeometry
) -> Iterator[AgeingLot]:
    buildings = world.of_class("building")
    feet = [one.footprint for one in buildings]
    tree = shapely.STRtree(feet)
    for number, one in enumerate(buildings):
        near = tree.query(one.footprint, predicate="intersects")
        others = [feet[k] for k in near if k != number]
        ways = shapely.intersection(world.streets, one.footprint.buffer(1.0))
        blocked = shapely.union_all([*others, ways, kept_free])
        pieces = polygons_of(one.footprint.difference(blocked.buffer(0.02)))
        pieces = [p for p in pieces if p.area > 0.3 * one.footprint.area]
        if not pieces:
            continue
        area = max(pieces, key=lambda p: round(p.area, 6)).simplify(0.05)
        plot = Plot.facing(area, world.streets, one.bottom)
        z = _front_height(world, plot, one.bottom)
        yield AgeingLot(number, replace(plot, z=z), one.top - z, one.name)


def _front_height(world: OldWorld, plot: Plot, default: float) -> float:
    """Returns the height of the ground in front of a plot [m].

    A building may reach into the ground. `default` is the height of the
    building's lowest point [m]; it is returned where there is no ground in
    front, or where the ground there is much lower.
    """
    x0, y0, x1, _ = plot.inside(plot.area).bounds
    at = plot.place((x0 + x1) / 2, y0 - _IN_FRONT)
    z = world.ground.heights(np.array([at]))[0]
    is_known = np.isfinite(z) and z > default - _DEEPEST_BELOW
    return round(float(z), 3) if is_known else default


def _free_lots(
    world: OldWorld, kept_free: BaseGeometry, built_on: Sequence[AgeingLot]
) -> list[AgeingLot]:
    """Returns rectangles of open ground along streets as lots.

    Trees and furniture may stand on these lots.

    Args:
        world: the city.
        kept_free: area in W [m] on which nothing is built.
        built_on: the lots of buildings.
    """
    taken: list[BaseGeometry] = []
    streets = world.streets
    solid = [
        one.footprint.buffer(PARTY_WALL)
        for one in world.geometry.values()
        if one.semantic_class in ("building", "other-structure")
    ]
    open_ground = world.open_ground.difference(shapely.union_all(solid))
    open_ground = open_ground.difference(kept_free.buffer(2.0))
    usual = shapely.STRtree([lot.plot.area for lot in built_on])
    lots: list[AgeingLot] = []
    if open_ground.is_empty:
        return lots
    shapely.prepare(open_ground)
    for line in itertools.chain.from_iterable(
        lines_along(streets, open_ground, setback) for setback in _SETBACKS
    ):
        start = 0.0
        while start < line.length - _PLOT_WIDTHS[-1]:
            area = _fitting_plot(line, start, open_ground, taken)
            if area is None:
                start += 4.0
                continue
            z = world.ground.heights(shapely.get_coordinates(area))
            lot = built_on[int(usual.nearest(area))]
            is_town = lot.plot.area.distance(area) < _IN_TOWN
            if is_town and np.isfinite(z).all() and np.ptp(z) < _STEEPEST:
                plot = Plot.facing(area, streets, float(z.min()))
                taken.append(area)
                side = min(plot.room().bounds[2:])
                high = min(lot.height, _HIGHEST_NEW, 2.4 * side)
                lots.append(AgeingLot(len(built_on) + len(lots), plot, high))
            start += 24.0
    return lots


def _fitting_plot(
    line: LineString,
    start: float,
    within: BaseGeometry,
    taken: Sequence[BaseGeometry],
) -> Polygon | None:
    """Returns the widest free plot at a line; None if no plot fits.

    Args:
        line: edge of a street in W [m].
        start: distance along the line at which the plot begins [m].
        within: area in which the plot must lie, in W [m].
        taken: areas that the plot must not touch, in W [m].
    """
    for width in _PLOT_WIDTHS:
        lot = lot_at(line, start, width, min(_PLOT_DEPTH, width))
        if lot is None or not within.contains(lot.footprint_W):
            continue
        room = lot.footprint_W.buffer(PARTY_WALL)
        if not any(room.intersects(one) for one in taken):
            return lot.footprint_W
    return None
