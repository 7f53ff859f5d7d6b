"""New buildings on plots, and the building sites where they are built."""

from collections.abc import Sequence
from dataclasses import replace
import itertools
import math

import numpy as np
from shapely.geometry import Polygon, box
from shapely.geometry.base import BaseGeometry

from cns_drake.ageing.plots import PARTY_WALL, Plot
from cns_drake.city import (
    ARCHETYPES,
    OBJECTS,
    Model,
    Structure,
    building_site,
    largest_rectangle,
    lot_objects,
    lowered,
    placed,
    polygons_of,
    sample,
    top_of,
)

# Archetypes that are built today -> their weight in the random choice among
# those that fit.
_BUILT_TODAY = {
    "balcony_flats": 4,
    "gallery_flats": 2,
    "garden_flats": 3,
    "walk_up": 2,
    "brick_block": 2,
    "office": 3,
    "court_block": 2,
    "terrace": 2,
    "row_house": 2,
    "shop_house": 1,
    "semi_detached": 1,
    "detached_house": 1,
    "bungalow": 1,
    "grid_tower": 2,
    "banded_tower": 2,
    "slab_tower": 1,
    "podium_tower": 1,
}
# A frame is at least this high, about one storey [m].
_LEAST_FRAME = 4.0
# The height of each attempt to build, as a share of that of the attempt before,
# in three rounds over all archetypes. The aged cities of published results were
# made with these shares.
_FALLS = (1.0, 0.7, 0.45)


def new_building(
    plot: Plot,
    height: float,
    banned: str,
    neighbours: Sequence[BaseGeometry],
    rng: np.random.Generator,
    ending: str,
) -> Structure | None:
    """Returns a random new building for a plot; None if none fits.

    Args:
        plot: plot on which the building stands.
        height: approximate height of the building [m].
        banned: archetype (kind of building) that must not be used.
        neighbours: footprints of the neighbouring buildings in W.
        rng: random generator for the choice of the building.
        ending: end of the building's name, after the archetype.
    """
    x0, y0, x1, y1 = plot.room().bounds
    names = [name for name in _BUILT_TODAY if name != banned]
    weights = np.array([_BUILT_TODAY[name] for name in names], float)
    order = rng.choice(len(names), len(names), False, weights / weights.sum())
    near = [plot.inside(one) for one in neighbours]
    # The ground of a tower may have room for a lower building only. Therefore,
    # all archetypes are tried at the full height, and then again with a height
    # that falls from attempt to attempt.
    for fall, k in itertools.product(_FALLS, order):
        height *= fall
        name = names[k]
        kind = ARCHETYPES[name]
        w, d = (
            math.floor(10 * min(side, kind.widths[1])) / 10
            for side in (x1 - x0, y1 - y0)
        )
        h = round(float(np.clip(height, *kind.heights)), 1)
        if min(w, d) < kind.widths[0] or not 0.75 < h / height < 1.3:
            continue
        # The front of the new building is at the street, like that of the old
        # one.
        middle = ((x0 + x1) / 2, y0 + d / 2)
        footprint = box(-w / 2, -d / 2, w / 2, d / 2)
        blind = _blind_edges(placed(footprint, middle, 0.0), near)
        try:
            model = sample(name, footprint, h, rng, f"{name}_{ending}", blind)
        except ValueError:
            continue
        at = replace(plot, xy=plot.place(*middle))
        built = at.structure(f"{name}_{ending}", "building", model)
        return replace(built, tags=(name,))
    return None


def _blind_edges(footprint: Polygon, near: Sequence[BaseGeometry]) -> set[int]:
    """Returns the numbers of a rectangle's edges that have a neighbour.

    Edge 0 is the front; the others follow counter-clockwise.
    """
    x0, y0, x1, y1 = footprint.bounds
    g, e = PARTY_WALL, 0.5
    strips = (
        box(x0 + e, y0 - g, x1 - e, y0),
        box(x1, y0 + e, x1 + g, y1 - e),
        box(x0 + e, y1, x1 - e, y1 + g),
        box(x0 - g, y0 + e, x0, y1 - e),
    )
    return {
        k for k, strip in enumerate(strips) if any(map(strip.intersects, near))
    }


def building_site_on(
    plot: Plot, name: str, rng: np.random.Generator
) -> list[Structure]:
    """Returns the structures of a building site: fences, machines and so on."""
    inner = plot.inside(plot.area.buffer(-0.4))
    lot = largest_rectangle(max(polygons_of(inner), key=lambda one: one.area))
    x0, y0, x1, y1 = lot.bounds
    structures = []
    for k, (x, y, turn, length) in enumerate(
        (
            ((x0 + x1) / 2, y0, 0.0, x1 - x0),
            (x1, (y0 + y1) / 2, math.pi / 2, y1 - y0),
            ((x0 + x1) / 2, y1, math.pi, x1 - x0),
            (x0, (y0 + y1) / 2, -math.pi / 2, y1 - y0),
        )
    ):
        fence = OBJECTS["site_fence"].build(rng, length=length)
        moved = Plot(plot.area, plot.place(x, y), plot.yaw + turn, plot.z)
        structures.append(moved.structure(f"{name}_fence_{k}", "fence", fence))
    empty = plot.structure(name, "building", Model((), {}, lot.buffer(-0.8)))
    digger = OBJECTS["excavator"]
    middle = plot.place(*lot.centroid.coords[0])
    turned = Plot(plot.area, middle, float(rng.uniform(-3.1, 3.1)), plot.z)
    model = digger.build(rng)
    digging = turned.structure(f"{name}_digger", digger.semantic_class, model)
    if plot.area.buffer(-0.8).contains(digging.footprint_W):
        structures.append(digging)
    return structures + list(lot_objects(empty, "yard", {}, rng))


def unfinished_frame(building: Structure, seed: int) -> Model:
    """Returns the unfinished frame of a building under construction."""
    model, name = building.model, building.name
    height = max(0.55 * top_of(model), _LEAST_FRAME)
    try:
        return building_site(model, height, name, seed)
    except ValueError:  # The plot is too small for a crane.
        return lowered(model, height, f"{name}_frame", seed)
