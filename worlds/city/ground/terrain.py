"""The ground of districts: lawns, paving, water, quays and bridges."""

from collections.abc import Callable, Iterable, Sequence
import math

import numpy as np
import shapely
from shapely.geometry import MultiPolygon, Polygon
from shapely.geometry.base import BaseGeometry
from shapely.ops import unary_union

from evaluation.base import sin
from worlds.city.ground.coverings import Covering, water
from worlds.city.ground.districts import District
from worlds.city.ground.elevation import Ground
from worlds.shapes import (
    HeightMap,
    Structure,
    merge_meshes,
    polygons_of,
    snap,
    surface_mesh,
    wall_mesh,
)

# Kind of dry ground -> semantic class, colour and material; None is the usual
# material of the class.
_LOOK = {
    "paved": ("other-ground", (0.70, 0.67, 0.62), None),
    "lawn": ("terrain", (0.45, 0.56, 0.32), None),
    "gravel": ("other-ground", (0.63, 0.58, 0.50), "gravel"),
    "parking": ("parking", (0.38, 0.37, 0.38), None),
}
_QUAY_RGB = (0.55, 0.53, 0.50)
# Distance between the vertices of meshes of ground with relief [m].
_SPACING = 4.0
# An area is gentle if the heights of the streets around it differ by less than
# this [m].
_GENTLE = 4.0
# Elsewhere, vertices are only this far apart [m].
_FINE_SPACING = 2.0
# Range of the wavelengths of the swells [m].
_WAVELENGTHS = (22.0, 60.0)
# From the upper side of a bridge to its lower side [m].
_DEPTH = 1.0
# Distance of the piers from the banks [m].
_SPAN = 10.5
# Thickness of the piers [m].
_PIER = 1.2
# Edges that two polygons share are found within this distance [m].
_NEAR = 0.3
_BRIDGE_RGB = (0.62, 0.57, 0.50)


class GroundShape:
    """The height of a city's finished ground, at any x and y in W [m].

    It is the height of `base`, plus the height of the swells on the lawns.
    """

    def __init__(
        self,
        base: Ground,
        districts: Iterable[District],
        buildings: BaseGeometry,
        rng_of: Callable[[str], np.random.Generator],
    ):
        """Shapes the ground around the footprints of buildings, in W."""
        self.base = base
        self._swells = [
            _make_swell(district, buildings, rng_of(district.plan.name))
            for district in districts
            if district.plan.relief > 0 and "lawn" in district.grounds
        ]

    def __call__(self, x: np.ndarray, y: np.ndarray) -> np.ndarray:
        """Returns the height of the finished ground at points in W [m]."""
        x, y = np.asarray(x, dtype=float), np.asarray(y, dtype=float)
        z = self.base(x, y)
        for lawn, swell in self._swells:
            inside = shapely.intersects_xy(lawn, x, y)
            if inside.any():
                z[inside] += swell(x[inside], y[inside])
        return z


def _make_swell(
    district: District, buildings: BaseGeometry, rng: np.random.Generator
) -> tuple[BaseGeometry, HeightMap]:
    """Returns the area of a district's lawn, and the height of its swells.

    The height above level ground is a function of x and y in W [m].
    """
    plan = district.plan
    rows = []
    for wavelength in rng.uniform(*_WAVELENGTHS, 5):
        heading, phase = rng.uniform(0, 2 * math.pi, 2)
        k = 2 * math.pi / wavelength
        rows.append((k * math.cos(heading), k * math.sin(heading), phase))
    # Each row: the wave vector [rad/m] and the phase [rad].
    waves = np.array(rows)
    lawn = district.grounds["lawn"]
    level = unary_union([lawn.boundary, buildings.intersection(lawn)])
    shapely.prepare(level)
    shapely.prepare(lawn)

    def height(x: np.ndarray, y: np.ndarray) -> np.ndarray:
        distance = shapely.distance(shapely.points(x, y), level)
        u = np.clip(distance / plan.relief_margin, 0.0, 1.0)
        rise = u * u * (3 - 2 * u)
        phase = np.outer(x, waves[:, 0]) + np.outer(y, waves[:, 1])
        wave = sin(phase + waves[:, 2]).mean(axis=1)
        # The relief is nowhere below the level ground, so that it has no
        # hollows where water would collect.
        return plan.relief * rise * (0.65 + 0.35 * wave)

    return lawn, height


def ground_structures(
    districts: Sequence[District], shape: GroundShape, water_level: float
) -> list[Structure]:
    """Returns the structures of the ground of all districts.

    Args:
        districts: the districts.
        shape: height of all ground except water.
        water_level: height of the water in W [m].
    """
    structures = []
    # Land within water is a bridge, below which there is water.
    land = unary_union(
        [
            area
            for district in districts
            for ground, area in district.grounds.items()
            if ground != "water" and district.plan.ground != "water"
        ]
    )
    for district in districts:
        for kind, area in district.grounds.items():
            if area.is_empty:
                continue
            name = f"ground_{district.plan.name}_{kind}"
            if kind == "water":
                structures.append(water(name, area).surface(water_level))
                structures.append(
                    _quay(district.plan.name, area, land, shape, water_level)
                )
                continue
            semantic_class, rgb, material = _LOOK[kind]
            ground = Covering(name, semantic_class, area, rgb, material)
            if shape.base.is_level:
                has_relief = kind == "lawn" and district.plan.relief > 0
                spacing = _SPACING if has_relief else 0.0
                structures.append(ground.surface(shape, spacing))
            else:
                structures.append(_slope(ground, shape))
    return structures


def _slope(ground: Covering, shape: GroundShape) -> Structure:
    """Returns ground that slopes between level pads, with one part per tile."""
    is_gentle = _height_difference(ground.area, shape.base) < _GENTLE
    spacing = _SPACING if is_gentle else _FINE_SPACING
    pieces = {}
    for part, piece in ground.tiles():
        meshes = []
        rest: BaseGeometry = piece
        for pad in shape.base.pads:
            if not pad.area.intersects(rest):
                continue
            level = snap(rest.intersection(pad.area))
            rest = snap(rest.difference(pad.area))
            meshes.append(surface_mesh(level, pad.height))
        meshes.append(surface_mesh(rest, shape, spacing))
        pieces[part] = merge_meshes(*meshes)
    return ground.structure(pieces)


def _height_difference(area: BaseGeometry, base: Ground) -> float:
    """Returns greatest minus least height along an area's outline [m]."""
    outline = shapely.segmentize(area, _SPACING)
    return float(np.ptp(base(*shapely.get_coordinates(outline).T)))


def _quay(
    district: str,
    water_surface: BaseGeometry,
    land: BaseGeometry,
    shape: GroundShape,
    water_level: float,
) -> Structure:
    """Returns the walls between land and water, with one part per tile."""
    rim = water_surface.boundary.buffer(0.3).intersection(land.buffer(0.6))
    quay = Covering(f"quay_{district}", "other-structure", rim, _QUAY_RGB)
    return quay.structure(
        {
            part: wall_mesh(water_surface, water_level, shape, along=piece)
            for part, piece in quay.tiles()
        }
    )


def _water_area(district: District, streets: BaseGeometry) -> BaseGeometry:
    """Returns a water district's area in W, with water below bridges [m]."""
    if district.plan.area is None:
        return district.area
    below = Polygon(district.plan.area).intersection(streets)
    return snap(shapely.union(district.area, below))


def bridge_structures(
    districts: Sequence[District],
    streets: BaseGeometry,
    shape: HeightMap,
    water_level: float,
) -> list[Structure]:
    """Returns the sides, undersides and piers of all bridges.

    There is a bridge wherever a street crosses a district of water, and
    wherever such a district has a patch of land. The street or the patch is the
    upper side of the bridge.

    Args:
        districts: all districts of the city.
        streets: area of the streets in W [m].
        shape: function that returns the heights of the ground at x and y in W
            [m].
        water_level: height of the water [m].
    """
    structures = []
    for district in districts:
        if district.plan.ground != "water":
            continue
        river = _water_area(district, streets)
        banks = river.boundary.buffer(_NEAR)
        inner = river.buffer(-_SPAN, join_style="mitre")
        ring = inner.difference(inner.buffer(-_PIER, join_style="mitre"))
        open_water = district.grounds["water"]
        decks = polygons_of(snap(river.difference(open_water)))
        for number, deck in enumerate(decks, start=1):
            name = f"bridge_{district.plan.name}_{number:02d}"
            middle = np.array([deck.centroid.coords[0]])
            bottom = float(shape(*middle.T)[0]) - _DEPTH
            low = water_level
            beside = deck.buffer(_NEAR)
            piers = snap(deck.intersection(ring))
            pieces = {
                "sides": wall_mesh(open_water, bottom, shape, along=beside),
                "underside": surface_mesh(deck, bottom).inside_out(),
                "abutments": wall_mesh(deck, low, bottom, along=banks),
                "piers": wall_mesh(piers, low, bottom).inside_out(),
            }
            area = MultiPolygon([deck])
            bridge = Covering(name, "other-structure", area, _BRIDGE_RGB)
            below = water(f"{name}_water", area)
            structures += [
                bridge.structure(pieces),
                below.structure({"surface": surface_mesh(deck, low)}),
            ]
    return structures
