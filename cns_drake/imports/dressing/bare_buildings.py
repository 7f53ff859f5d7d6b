"""Imported buildings, split into the surfaces that get details."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from cns_drake.city.geometry import MeshShape, looks_up
from cns_drake.imports.dressing import roof_pieces
from cns_drake.imports.dressing.styles import Style, make_style
from cns_drake.imports.dressing.wall_panels import is_upright
from cns_drake.imports.ground import Ground
from cns_drake.imports.imported_objects import ImportedObject
from cns_drake.imports.named_randomness import random_generator

# A building whose feet are farther from the ground than this was sunk into it
# [m].
_MOST_SUNK = 2.0
# Share of the box around a footprint that the footprint is assumed to fill.
_FILLED_SHARE = 0.8
# Least height of a building that gets a style [m].
_LEAST_HEIGHT = 1.0


@dataclass(frozen=True)
class BareBuilding:
    """An imported building, split into surfaces that details can be added to.

    Attributes:
        imported: the building as imported, without details.
        walls: triangles (M, 3, 3) of the walls [m].
        roof: triangles (M, 3, 3) of the roof [m].
        rest: triangles (M, 3, 3) of all other surfaces [m].
        base: height of the lowest floor in W [m].
        style: appearance of the building.
        is_flat: whether the roof is flat.
        rng: random generator for the details.
    """

    imported: ImportedObject
    walls: np.ndarray
    roof: np.ndarray
    rest: np.ndarray
    base: float
    style: Style
    is_flat: bool
    rng: np.random.Generator


def split_buildings(
    buildings: Sequence[ImportedObject], ground: Ground, seed: int
) -> list[BareBuilding]:
    """Returns buildings, split into walls, roof and other surfaces.

    A variant of a building, such as a lower building in an earlier stage, has
    the style of the original.

    Args:
        buildings: the buildings.
        ground: the ground on which they stand.
        seed: seed of the random styles.
    """
    split = []
    styles: dict[str, Style] = {}
    variants_last = sorted(buildings, key=lambda one: one.original != "")
    for building in variants_last:
        style = styles.get(building.original)
        bare = _split_building(building, ground, seed, style)
        styles[building.draw_name] = bare.style
        split.append(bare)
    return split


def _split_building(
    building: ImportedObject,
    ground: Ground,
    seed: int,
    known: Style | None = None,
) -> BareBuilding:
    """Returns a building, split into walls, roof and other surfaces.

    For a variant, `known` is the style of the original. The other arguments are
    as for `split_buildings`.
    """
    surfaces = {"body": np.zeros((0, 3, 3)), "roof": np.zeros((0, 3, 3))}
    for part in building.structure.model.parts:
        if isinstance(part.shape, MeshShape):
            mesh = building.structure.model.meshes[part.shape.mesh]
            surfaces[part.name] = mesh.vertices[mesh.triangles()]
    body = surfaces["body"]
    upright, up = is_upright(body), looks_up(body)
    roof = np.concatenate([surfaces["roof"], body[up]])
    walls, rest = body[upright], body[~upright & ~up]
    corners = building.triangles.reshape(-1, 3)
    foot = float(corners[:, 2].min())
    below = float(ground.height(corners[:, :2]).min())
    base = foot if abs(foot - below) < _MOST_SUNK else below
    width, depth = np.ptp(corners[:, :2], axis=0)
    standing = walls if len(walls) else building.triangles
    height = max(_LEAST_HEIGHT, float(standing[:, :, 2].max()) - base)
    is_flat = bool(len(roof)) and roof_pieces.is_flat_roof(roof)
    rng = random_generator(seed, "dressing", building.draw_name)
    area = _FILLED_SHARE * float(width * depth)
    style = make_style(building.tags, building.year, area, height, is_flat, rng)
    if known is not None:
        storeys = max(1, round(height / known.storey))
        style = replace(known, storey=height / storeys)
    return BareBuilding(building, walls, roof, rest, base, style, is_flat, rng)
