"""Reflection of surfaces near 900 nm.

The material of a geometry follows from the class of its structure or, if a part
consists of another material, from the name of the part; the brightness follows
from the colour. Reflectivities of diffuse materials are those of the ECOSTRESS
spectral library (Meerdink et al., 2019) near 0.9 um, rounded; those of
markings, signs and plates follow from the minimum coefficients of EN 1436 (R_L
150 mcd/m2/lx at 30 m) and EN 12899-1 (class RA1, 70 cd/lx/m2), times pi.
"""

from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np

from cns_drake.base.yaml_files import parse_yaml
from cns_drake.scene.perception_geometry import PerceptionGeometry
from cns_drake.scene.structure_table import StructureEntry, StructureTable
from cns_drake.scene.surfaces import HalfSpaceSurface, Surface, TriangleSurface

# Kinds of materials.
LAMBERT, RETRO, GLASS, LEAVES, BEADS, SPRAYS = range(6)

# Class -> its fields; the YAML file explains them.
_CLASSES = parse_yaml(Path(__file__).with_name("materials.yaml").read_bytes())
# Diffuse reflectivity of the dust on a pane.
_GLASS_DUST = 0.02
# Diffuse reflectivity of water.
_WATER = 0.02
# Diffuse reflectivity of bark.
_BARK = 0.30
# Diffuse reflectivity of road markings, without their beads.
_MARKINGS = 0.47
# Reflectivity of the retro-reflective sheeting of a traffic sign.
_SHEETING = 220.0
# Reflectivity of a retro-reflective number plate.
_PLATE = 160.0
# Leaf area in a volume of leaves [1/m]: crowns have 0.5 to 2.5 (Hosoi and
# Omasa, 2006), clipped hedges more. Fitted to the first place of KITTI.
_LEAF_AREA_DENSITY = 3.0
# Reflection of wet ground: a film of n = 1.33 reflects scattered light back to
# the rough surface (Angstrom, 1925).
_FILM_INNER = 1.0 - (1.0 - 0.066) / 1.33**2


class Materials(NamedTuple):
    """The materials of G geometries.

    Attributes:
        kind: (G,) uint8, `LAMBERT`, `RETRO`, `GLASS`, `LEAVES` (for volumes of
            leaves), `SPRAYS` (for sheets that stand for leaves on a twig) or
            `BEADS` (for the beads of road markings, which reflect light back to
            its source even if it grazes the road; EN 1436 measures them at
            1.24 deg).
        reflectivity: (G,) float32 reflectivity. That of a retro-reflector is
            relative to a Lambertian target of reflectivity 1 that faces the
            beam.
        leaf_area_density: (G,) float32 [1/m].
        rough: (G,) float32 factor k of rough surfaces: the cosine of incidence
            is replaced by cos + k sin^2.
        contrast: (G,) float32, how much the albedo varies within a surface.
        relief: (G,) float32, distance from the nominal surface at which beams
            end [m].
        tufts: (G,) float32 height of the plants on the surface [m].
        swell: (G,) float32, how far the surface rises and falls over some
            metres [m].
        fittings: (G,) float32, how far objects on the surface protrude [m].
        stains: (G,) float32, the part of the surface that is stained.
    """

    kind: np.ndarray
    reflectivity: np.ndarray
    leaf_area_density: np.ndarray
    rough: np.ndarray
    contrast: np.ndarray
    relief: np.ndarray
    tufts: np.ndarray
    swell: np.ndarray
    fittings: np.ndarray
    stains: np.ndarray


def find_materials(
    geometries: Sequence[PerceptionGeometry],
    structures: StructureTable,
    *,
    is_wet: bool,
) -> Materials:
    """Returns the materials of geometries.

    The reflectivity of a geometry is its perception property ("lidar",
    "reflectivity") or, without this property, the value for its structure in
    the column `reflectivity` of `structures`. In both cases, the geometry is a
    smooth Lambertian reflector. Without either value, the material follows from
    the class and the colour, and from words in the names.

    Args:
        geometries: the geometries.
        structures: table of structures. A structure that is not in the table
            has no class.
        is_wet: whether the ground is wet.
    """
    names = [geometry.structure for geometry in geometries]
    table = structures.completed(names)
    rows = [
        _material(geometry, table[name], is_wet)
        for geometry, name in zip(geometries, names, strict=True)
    ]
    empty: list[tuple] = [()] * len(Materials._fields)
    kinds, *others = zip(*rows, strict=True) if rows else empty
    return Materials(
        np.array(kinds, np.uint8),
        *(np.array(values, np.float32) for values in others),
    )


def _material(
    geometry: PerceptionGeometry, entry: StructureEntry, is_wet: bool
) -> tuple[float, ...]:
    """Returns the values of the fields of `Materials` for one geometry."""
    kind, reflectivity, density = _reflection(geometry, entry)
    fields = _CLASSES[entry.semantic_class]
    if is_wet and kind == LAMBERT and fields.get("gets_wet"):
        reflectivity = _wet(reflectivity)
    given = geometry.reflectivity, entry.reflectivity
    if kind not in (LAMBERT, LEAVES, SPRAYS) or given != (None, None):
        return kind, reflectivity, density, *[0.0] * 7
    return (
        kind,
        reflectivity,
        density,
        fields["rough"],
        fields["contrast"],
        # A volume of leaves needs no relief: it has depth anyway.
        0.0 if kind == LEAVES else fields["relief"],
        fields.get("tufts", 0.0),
        fields.get("swell", 0.0),
        fields.get("fittings", 0.0),
        fields.get("stains", 0.0),
    )


def _reflection(
    geometry: PerceptionGeometry, entry: StructureEntry
) -> tuple[int, float, float]:
    """Returns kind, reflectivity and leaf area density of a geometry."""
    given = geometry.reflectivity
    if given is None:
        given = entry.reflectivity
    if given is not None:
        return LAMBERT, given, 0.0
    fields = _CLASSES[entry.semantic_class]
    dark, bright = fields["reflectivity"]
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
    if "trim" in words and "trim" in fields:
        return LAMBERT, fields["trim"], 0.0
    return LAMBERT, dark + (bright - dark) * _brightness(geometry.rgb), 0.0


def _brightness(rgb: tuple[float, float, float] | None) -> float:
    """Returns the fraction of white light that a colour reflects, 0 to 1.

    sRGB values are about the square roots of the light (IEC 61966-2-1).
    """
    if rgb is None:
        return 0.5
    light = np.square(np.clip(rgb, 0.0, 1.0))
    return float(np.dot(light, (0.2126, 0.7152, 0.0722)))


def _wet(reflectivity: float) -> float:
    """Returns the reflectivity of a surface under a film of water."""
    return (
        reflectivity * (1.0 - _FILM_INNER) / (1.0 - _FILM_INNER * reflectivity)
    )


def is_closed(surface: Surface) -> bool:
    """Returns whether a surface encloses a volume.

    A surface of triangles is closed if each edge belongs to an even number of
    triangles. Edges are compared by the positions of their ends.
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
