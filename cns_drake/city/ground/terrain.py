"""The ground of districts: lawns with relief, paving, water behind quays."""

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
import math

import numpy as np
import shapely
from shapely.geometry import MultiPolygon, Polygon
from shapely.geometry.base import BaseGeometry
from shapely.ops import unary_union

from cns_drake.city.geometry.mesh import Mesh, merge_meshes
from cns_drake.city.geometry.polygons import (
    HeightMap,
    polygons_of,
    snap,
    surface_mesh,
    tiles,
    wall_mesh,
)
from cns_drake.city.geometry.structures import Structure
from cns_drake.city.ground.districts import District
from cns_drake.city.ground.elevation import Ground
from cns_drake.city.ground.streets import TILE, as_structure, ground_structure

# Kind of ground -> semantic class and colour.
_LOOK = {
    "paved": ("other-ground", (0.70, 0.67, 0.62)),
    "lawn": ("terrain", (0.45, 0.56, 0.32)),
    "gravel": ("other-ground", (0.63, 0.58, 0.50)),
    "parking": ("parking", (0.38, 0.37, 0.38)),
    "water": ("other-ground", (0.25, 0.38, 0.45)),
}
_QUAY_RGB = (0.55, 0.53, 0.50)
# Meshes of ground with relief have vertices this far apart [m].
_SPACING = 4.0
# Where the streets around differ by more than this in height, the meshes have
# vertices this far apart [m].
_GENTLE, _FINE_SPACING = 4.0, 2.0
# Wavelengths of the swells [m].
_WAVELENGTHS = (22.0, 60.0)


@dataclass(frozen=True)
class _Swell:
    """The relief of one district's lawns.

    Attributes:
        area: where it acts.
        level: lines and areas at which the relief has faded to zero.
        amplitude: greatest height [m].
        margin: distance over which it rises from `level` [m].
        waves: rows of wave vector [rad/m] and phase [rad].
    """

    area: BaseGeometry
    level: BaseGeometry
    amplitude: float
    margin: float
    waves: np.ndarray

    def height(self, x: np.ndarray, y: np.ndarray) -> np.ndarray:
        """Returns the height above level ground at points in W [m]."""
        distance = shapely.distance(shapely.points(x, y), self.level)
        u = np.clip(distance / self.margin, 0.0, 1.0)
        rise = u * u * (3 - 2 * u)
        phase = np.outer(x, self.waves[:, 0]) + np.outer(y, self.waves[:, 1])
        wave = np.sin(phase + self.waves[:, 2]).mean(axis=1)
        # The relief is never below level, so that no hollow collects water.
        return self.amplitude * rise * (0.65 + 0.35 * wave)


class GroundShape:
    """Height of the finished ground inside and outside the streets."""

    def __init__(
        self,
        base: Ground,
        districts: Iterable[District],
        buildings: BaseGeometry,
        rng_of: Callable[[str], np.random.Generator],
    ):
        """Shapes the ground around the footprints of buildings in W."""
        self.base = base
        self._swells = [
            _make_swell(district, buildings, rng_of(district.plan.name))
            for district in districts
            if district.plan.relief > 0 and "lawn" in district.grounds
        ]

    def __call__(self, x: np.ndarray, y: np.ndarray) -> np.ndarray:
        """Returns the height of the ground at points in W [m]."""
        x, y = np.asarray(x, dtype=float), np.asarray(y, dtype=float)
        z = self.base(x, y)
        for swell in self._swells:
            inside = shapely.intersects_xy(swell.area, x, y)
            if inside.any():
                z[inside] += swell.height(x[inside], y[inside])
        return z


def ground_structures(
    districts: Sequence[District], shape: GroundShape, water_level: float
) -> list[Structure]:
    """Returns the ground of all districts.

    `shape` is the height of everything but water.
    """
    structures = []
    # Land within water is a bridge, and water passes below it.
    land = unary_union(
        [
            area
            for district in districts
            for ground, area in district.grounds.items()
            if ground != "water" and district.plan.ground != "water"
        ]
    )
    for district in districts:
        for ground, area in district.grounds.items():
            if area.is_empty:
                continue
            name = f"ground_{district.plan.name}_{ground}"
            semantic_class, rgb = _LOOK[ground]
            if ground == "water":
                structures.append(
                    ground_structure(
                        name, semantic_class, area, water_level, rgb
                    )
                )
                structures.append(
                    _quay(district, area, land, shape, water_level)
                )
                continue
            has_relief = ground == "lawn" and district.plan.relief > 0
            if shape.base.is_level:
                spacing = _SPACING if has_relief else 0.0
                structures.append(
                    ground_structure(
                        name, semantic_class, area, shape, rgb, spacing
                    )
                )
            else:
                structures.append(
                    _slope(name, semantic_class, area, shape, rgb)
                )
    return structures


def _slope(
    name: str,
    semantic_class: str,
    area: MultiPolygon,
    shape: GroundShape,
    rgb: tuple[float, float, float],
) -> Structure:
    """Returns ground that slopes between level pads, one part a tile."""
    spacing = _SPACING if _fall(area, shape.base) < _GENTLE else _FINE_SPACING
    pieces = {}
    for k, (_, _, piece) in enumerate(tiles(area, TILE)):
        meshes = []
        rest: BaseGeometry = piece
        for pad in shape.base.pads:
            if not pad.area.intersects(rest):
                continue
            level = snap(rest.intersection(pad.area))
            rest = snap(rest.difference(pad.area))
            meshes.append(surface_mesh(level, pad.height))
        meshes.append(surface_mesh(rest, shape, spacing))
        pieces[f"tile_{k:02d}"] = merge_meshes(*meshes)
    return as_structure(name, semantic_class, pieces, area, rgb)


def _fall(area: BaseGeometry, base: Ground) -> float:
    """Returns the difference between the heights on an area's outline [m]."""
    outline = shapely.segmentize(area, _SPACING)
    return float(np.ptp(base(*shapely.get_coordinates(outline).T)))


def _make_swell(
    district: District, buildings: BaseGeometry, rng: np.random.Generator
) -> _Swell:
    plan = district.plan
    waves = []
    for wavelength in rng.uniform(*_WAVELENGTHS, 5):
        heading, phase = rng.uniform(0, 2 * math.pi, 2)
        k = 2 * math.pi / wavelength
        waves.append((k * math.cos(heading), k * math.sin(heading), phase))
    lawn = district.grounds["lawn"]
    level = unary_union([lawn.boundary, buildings.intersection(lawn)])
    shapely.prepare(level)
    shapely.prepare(lawn)
    return _Swell(lawn, level, plan.relief, plan.relief_margin, np.array(waves))


def _quay(
    district: District,
    water: BaseGeometry,
    land: BaseGeometry,
    shape: GroundShape,
    water_level: float,
) -> Structure:
    """Returns the walls where water borders on land, one part a tile."""
    rim = water.boundary.buffer(0.3).intersection(land.buffer(0.6))
    pieces = {}
    for k, (_, _, piece) in enumerate(tiles(rim, TILE)):
        wall = wall_mesh(water, water_level, shape, along=piece)
        if wall.faces:
            pieces[f"tile_{k:02d}"] = wall
    return as_structure(
        f"quay_{district.plan.name}", "other-structure", pieces, rim, _QUAY_RGB
    )


# From the upper side of a bridge to its lower side [m].
_DEPTH = 1.0
# Distance of the piers from the banks, and how thick they are [m].
_SPAN = 10.5
_PIER = 1.2
# Edges that two polygons share are found within this distance [m].
_NEAR = 0.3
_BRIDGE_RGB = (0.62, 0.57, 0.50)
_WATER_RGB = (0.25, 0.38, 0.45)


def water_area(district: District, streets: BaseGeometry) -> BaseGeometry:
    """Returns all of a water district's water, also that below bridges."""
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

    Where a street crosses the area of a district of water, and where such a
    district has a patch of land, there is a bridge. Its upper side is that
    of the street or patch. `shape` is the height of everything but water.
    """
    structures = []
    for district in districts:
        if district.plan.ground != "water":
            continue
        water = water_area(district, streets)
        decks = polygons_of(snap(water.difference(district.grounds["water"])))
        for number, deck in enumerate(decks, start=1):
            name = f"bridge_{district.plan.name}_{number:02d}"
            structures += _bridge(
                name, deck, district, water, shape, water_level
            )
    return structures


def _bridge(
    name: str,
    deck: Polygon,
    district: District,
    water: BaseGeometry,
    shape: HeightMap,
    water_level: float,
) -> list[Structure]:
    """Returns a bridge and the water below it."""
    bottom = float(shape(*np.array([deck.centroid.coords[0]]).T)[0]) - _DEPTH
    inner = water.buffer(-_SPAN, join_style="mitre")
    piers = deck.intersection(
        inner.difference(inner.buffer(-_PIER, join_style="mitre"))
    )
    banks = water.boundary.buffer(_NEAR)
    surface = {"surface": surface_mesh(deck, water_level)}
    pieces = {
        "sides": wall_mesh(
            district.grounds["water"], bottom, shape, along=deck.buffer(_NEAR)
        ),
        "underside": _turned(surface_mesh(deck, bottom)),
        "abutments": wall_mesh(deck, water_level, bottom, along=banks),
        "piers": _turned(wall_mesh(snap(piers), water_level, bottom)),
    }
    pieces = {part: mesh for part, mesh in pieces.items() if mesh.faces}
    area = MultiPolygon([deck])
    return [
        as_structure(name, "other-structure", pieces, area, _BRIDGE_RGB),
        as_structure(
            f"{name}_water", "other-ground", surface, area, _WATER_RGB
        ),
    ]


def _turned(mesh: Mesh) -> Mesh:
    """Returns a mesh whose faces look to the other side."""
    return Mesh(mesh.vertices, tuple(face[::-1] for face in mesh.faces))
