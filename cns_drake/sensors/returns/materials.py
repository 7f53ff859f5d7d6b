"""Reflection of surfaces near 900 nm, for the beams of a LiDAR."""

from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np

from cns_drake.scene import PerceptionGeometry, Surface, is_closed
from worlds.shapes import StructureEntry, StructureTable

# Kinds of materials.
LAMBERT, RETRO, GLASS, LEAVES, BEADS, SPRAYS = range(6)

_KINDS = {"lambert": LAMBERT, "retro": RETRO, "glass": GLASS, "beads": BEADS}
# Reflection of wet ground: a film of n = 1.33 reflects scattered light back to
# the rough surface (Angstrom, 1925).
_FILM_INNER = 1.0 - (1.0 - 0.066) / 1.33**2


class Materials(NamedTuple):
    """The materials of G geometries.

    Attributes:
        kind: (G,) uint8, `LAMBERT`, `RETRO`, `GLASS`, `LEAVES` (for volumes of
            leaves), `SPRAYS` (for sheets that stand for leaves on a twig) or
            `BEADS` (for the beads of road markings, which reflect light back to
            its source even at grazing incidence; EN 1436 measures road markings
            at 1.24 deg).
        reflectivity: (G,) float32 reflectivity. The reflectivity of a
            retro-reflector is relative to a Lambertian target of reflectivity 1
            that faces the beam.
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
    smooth Lambertian reflector. Without either value, the reflectivity follows
    from the material of the part, see `worlds.shapes.materials`, and from the
    colour.

    Args:
        geometries: the geometries.
        structures: table of structures. A structure that is not in the table
            has no class.
        is_wet: whether the ground is wet.
    """
    names = [geometry.structure for geometry in geometries]
    table = structures.completed(names)
    closed: dict[int, bool] = {}

    def encloses(surface: Surface) -> bool:
        # Thousands of plants are copies of one mesh in other sizes, which
        # share their triangles.
        key = id(getattr(surface, "triangles", surface))
        if key not in closed:
            closed[key] = is_closed(surface)
        return closed[key]

    rows = [
        _field_values(geometry, table[name], is_wet, encloses)
        for geometry, name in zip(geometries, names, strict=True)
    ]
    empty: list[tuple] = [()] * len(Materials._fields)
    kinds, *others = zip(*rows, strict=True) if rows else empty
    return Materials(
        np.array(kinds, np.uint8),
        *(np.array(values, np.float32) for values in others),
    )


def _field_values(
    geometry: PerceptionGeometry,
    entry: StructureEntry,
    is_wet: bool,
    encloses: Callable[[Surface], bool],
) -> tuple[float, ...]:
    """Returns the values of the fields of `Materials` for one geometry.

    `encloses` returns whether a surface encloses a volume.
    """
    material = entry.material(geometry.part)
    given = geometry.reflectivity
    if given is None:
        given = entry.reflectivity
    if given is not None:
        kind = LAMBERT
        reflectivity = given
        density = 0.0
    else:
        if material.kind != "leaves":
            kind = _KINDS[material.kind]
        else:
            # An open surface is a sheet, which stands for leaves on a twig.
            kind = LEAVES if encloses(geometry.surface) else SPRAYS
        dark, bright = material.reflectivity
        reflectivity = dark + (bright - dark) * _brightness(geometry.rgb)
        density = material.leaf_area_density
    if is_wet and kind == LAMBERT and material.gets_wet:
        reflectivity = _wet_reflectivity(reflectivity)
    if kind not in (LAMBERT, LEAVES, SPRAYS) or given is not None:
        return kind, reflectivity, density, *[0.0] * 7
    return (
        kind,
        reflectivity,
        density,
        material.rough,
        material.contrast,
        # A volume of leaves needs no relief: it has depth anyway.
        0.0 if kind == LEAVES else material.relief,
        material.tufts,
        material.swell,
        material.fittings,
        material.stains,
    )


def _brightness(rgb: tuple[float, float, float] | None) -> float:
    """Returns the fraction of white light that a colour reflects, 0 to 1.

    sRGB values are about the square roots of the light (IEC 61966-2-1). Without
    a colour, the fraction is 0.5.
    """
    if rgb is None:
        return 0.5
    light = np.square(np.clip(rgb, 0.0, 1.0))
    return float(np.dot(light, (0.2126, 0.7152, 0.0722)))


def _wet_reflectivity(reflectivity: float) -> float:
    """Returns the reflectivity of a surface under a film of water."""
    return (
        reflectivity * (1.0 - _FILM_INNER) / (1.0 - _FILM_INNER * reflectivity)
    )
