"""Reflection of surfaces near 900 nm.

A structure's material follows from its class, or from the name of a part of
another material; its brightness follows from its colour. Reflectivities of
diffuse materials are those of the ECOSTRESS spectral library (Meerdink et al.,
2019) near 0.9 um, rounded; those of markings, signs and plates follow from the
minimum coefficients of EN 1436 (R_L 150 mcd/m2/lx at 30 m) and EN 12899-1
(class RA1, 70 cd/lx/m2), times pi.
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from cns_drake.scene.perception_geometry import PerceptionGeometry
from cns_drake.scene.structure_table import StructureTable
from cns_drake.scene.surfaces import HalfSpaceSurface, Surface, TriangleSurface

# Kinds of materials.
LAMBERT, RETRO, GLASS, LEAVES, BEADS, SPRAYS = range(6)

# Class -> reflectivity of a dark and of a bright colour; equal if the colour
# has no influence near 900 nm.
_BY_CLASS = {
    "unlabeled": (0.15, 0.65),
    "outlier": (0.15, 0.65),
    "car": (0.05, 0.80),
    "bicycle": (0.10, 0.50),
    "motorcycle": (0.10, 0.50),
    "bus": (0.05, 0.80),
    "truck": (0.05, 0.80),
    "other-vehicle": (0.05, 0.80),
    "person": (0.20, 0.60),
    "bicyclist": (0.20, 0.60),
    "motorcyclist": (0.20, 0.60),
    "road": (0.15, 0.15),
    "parking": (0.15, 0.15),
    "sidewalk": (0.30, 0.30),
    "other-ground": (0.25, 0.35),
    "building": (0.20, 0.60),
    "fence": (0.20, 0.50),
    "other-structure": (0.20, 0.60),
    "vegetation": (0.50, 0.50),
    "trunk": (0.30, 0.30),
    "terrain": (0.45, 0.45),
    "pole": (0.20, 0.50),
    "traffic-sign": (0.20, 0.50),
    "other-object": (0.10, 0.70),
}
# Classes of smooth surfaces, which reflect after Lambert, and those of leaves.
_SMOOTH = {c for c in _BY_CLASS if c.endswith("car") or "vehicle" in c} | {
    *("bus", "truck", "motorcycle", "traffic-sign", "vegetation")
}
# Rough surfaces follow Oren and Nayar (1994), with slopes of 30 deg: 0.77 times
# the cosine and 0.34 times the square of the sine, here over the first one.
_OREN_NAYAR = 0.44
# How far albedo differs from its mean within a surface, as a part of it, in
# grains, and more so in patches; and how far beams end in front of it and
# behind it [m]: in gravel, among leaves, on joints.
_TEXTURE = {
    "road": (0.25, 0.01),
    "parking": (0.25, 0.01),
    "sidewalk": (0.2, 0.015),
    "building": (0.25, 0.02),
    "terrain": (0.4, 0.02),
    "vegetation": (0.4, 0.2),
    "trunk": (0.3, 0.04),
}
_OTHER_TEXTURE, _SMOOTH_TEXTURE = (0.2, 0.02), (0.05, 0.0)
# Height of tufts of rough grass, and how far courses, sills and what hangs on
# fronts stand out [m].
_TUFTS, _FITTINGS = {"terrain": 0.15}, {"building": 0.35}
# Diffuse light from dust on a pane, and from water.
_GLASS_DUST = 0.02
_WATER = 0.02
_BARK = 0.30
_MARKINGS = 0.47
_SHEETING = 220.0
_PLATE = 160.0
# Leaf area in a volume of leaves [1/m]: crowns and hedges of cities (Hosoi
# and Omasa, 2006, found 0.5 to 2.5 in crowns).
_LEAF_AREA_DENSITY = 1.5
# Reflection of wet ground: a film of n = 1.33 reflects scattered light back to
# the rough surface (Angstrom, 1925).
_FILM_INNER = 1.0 - (1.0 - 0.066) / 1.33**2
_WET_CLASSES = {"road", "parking", "sidewalk", "other-ground"}


class Materials(NamedTuple):
    """The materials of G geometries.

    Attributes:
        kind: (G,) uint8, `LAMBERT`, `RETRO`, `GLASS`, `LEAVES` (for volumes of
            leaves), `SPRAYS` (for sheets that stand for leaves on a twig) or
            `BEADS`, the retro-reflector of road markings, which works at any
            angle: EN 1436 measures it 1.24 deg above the road.
        reflectivity: (G,) float32, of a retro-reflector in units of a
            Lambertian target of reflectivity 1 that faces the beam.
        leaf_area_density: (G,) float32 [1/m].
        rough: (G,) float32, how much the square of the sine of incidence adds
            to the cosine.
        contrast: (G,) float32, how far albedo differs within a surface.
        relief: (G,) float32, how far beams end off the surface [m].
        tufts: (G,) float32 height of what grows on it [m].
        fittings: (G,) float32, how far what hangs on it stands out [m].
    """

    kind: np.ndarray
    reflectivity: np.ndarray
    leaf_area_density: np.ndarray
    rough: np.ndarray
    contrast: np.ndarray
    relief: np.ndarray
    tufts: np.ndarray
    fittings: np.ndarray


def find_materials(
    geometries: Sequence[PerceptionGeometry],
    structures: StructureTable,
    *,
    is_wet: bool,
) -> Materials:
    """Returns the materials of geometries.

    The perception property ("lidar", "reflectivity") wins over the column
    `reflectivity` of a table of structures, and that over class and colour.
    Surfaces of a given reflectivity are even and reflect after Lambert.

    Args:
        geometries: geometries of the scene.
        structures: structures of all geometries.
        is_wet: whether the ground is wet.
    """
    table = [_material(geometry, structures) for geometry in geometries]
    if is_wet:
        table = [
            (kind, _wet(rho), density)
            if structures[geometry.structure].semantic_class in _WET_CLASSES
            and kind == LAMBERT
            else (kind, rho, density)
            for geometry, (kind, rho, density) in zip(
                geometries, table, strict=True
            )
        ]
    kinds, rhos, densities = zip(*table, strict=True) if table else ((),) * 3
    surfaces = [
        _surface(geometry, structures, kind)
        for geometry, kind in zip(geometries, kinds, strict=True)
    ]
    surface = np.array(surfaces, np.float32).reshape(-1, 5).T
    return Materials(
        np.array(kinds, np.uint8),
        np.array(rhos, np.float32),
        np.array(densities, np.float32),
        *np.ascontiguousarray(surface),
    )


def _surface(
    geometry: PerceptionGeometry, structures: StructureTable, kind: int
) -> tuple[float, ...]:
    """Returns `rough` and what follows it in `Materials`."""
    entry = structures[geometry.structure]
    given = geometry.reflectivity, entry.reflectivity
    if kind not in (LAMBERT, LEAVES, SPRAYS) or given != (None, None):
        return (0.0,) * 5
    name = entry.semantic_class
    smooth = name in _SMOOTH
    other = _SMOOTH_TEXTURE if smooth else _OTHER_TEXTURE
    contrast, relief = _TEXTURE.get(name, other)
    # A volume of leaves has depth in any case.
    if kind == LEAVES:
        relief = 0.0
    rough = 0.0 if smooth else _OREN_NAYAR
    standing = _TUFTS.get(name, 0.0), _FITTINGS.get(name, 0.0)
    return rough, contrast, relief, *standing


def _material(
    geometry: PerceptionGeometry, structures: StructureTable
) -> tuple[int, float, float]:
    entry = structures[geometry.structure]
    given = geometry.reflectivity
    if given is None:
        given = entry.reflectivity
    if given is not None:
        return LAMBERT, given, 0.0
    dark, bright = _BY_CLASS[entry.semantic_class]
    part = geometry.name.rpartition("/")[2]
    words = set(part.split("_"))
    if words & {"glass", "panes", "windows"}:
        return GLASS, _GLASS_DUST, 0.0
    if geometry.structure.startswith("markings"):
        return BEADS, _MARKINGS, 0.0
    if entry.semantic_class == "traffic-sign" and words & {"plate", "blade"}:
        return RETRO, _SHEETING, 0.0
    if "plate" in words:
        return RETRO, _PLATE, 0.0
    if "water" in words or geometry.structure.endswith("_water"):
        return LAMBERT, _WATER, 0.0
    if entry.semantic_class == "vegetation":
        if words & {"wood", "trunk", "box", "pot", "edge"}:
            return LAMBERT, _BARK, 0.0
        kind = LEAVES if is_closed(geometry.surface) else SPRAYS
        return kind, bright, _LEAF_AREA_DENSITY
    return LAMBERT, dark + (bright - dark) * _brightness(geometry.rgb), 0.0


def _brightness(rgb: tuple[float, float, float] | None) -> float:
    """Returns the reflected part of white light of a colour, 0 to 1."""
    if rgb is None:
        return 0.5
    return float(np.clip(np.dot(rgb, (0.2126, 0.7152, 0.0722)), 0.0, 1.0))


def _wet(reflectivity: float) -> float:
    """Returns the reflectivity of a surface under a film of water."""
    return (
        reflectivity * (1.0 - _FILM_INNER) / (1.0 - _FILM_INNER * reflectivity)
    )


def is_closed(surface: Surface) -> bool:
    """Returns whether a surface encloses a volume.

    Triangles do if each edge, by the places of its ends, belongs to an even
    number of them.
    """
    if isinstance(surface, HalfSpaceSurface):
        return False
    if not isinstance(surface, TriangleSurface):
        return True
    _, place = np.unique(
        np.round(surface.p_GVset, 6), axis=0, return_inverse=True
    )
    corners = np.reshape(place, -1)[surface.triangles]
    edges = np.sort(
        np.concatenate(
            [corners[:, [0, 1]], corners[:, [1, 2]], corners[:, [2, 0]]]
        ),
        axis=1,
    )
    _, count = np.unique(edges, axis=0, return_counts=True)
    return bool(len(edges) > 0 and np.all(count % 2 == 0))
