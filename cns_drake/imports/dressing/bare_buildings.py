"""Imported buildings by their surfaces, each with its style."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from cns_drake.city.geometry.structures import MeshShape
from cns_drake.imports.dressing.roof_pieces import is_flat_roof
from cns_drake.imports.dressing.styles import Style, make_style
from cns_drake.imports.dressing.upper_sides import looks_up
from cns_drake.imports.dressing.wall_panels import is_upright
from cns_drake.imports.foreign_city import Imported, lot_generator
from cns_drake.imports.ground import Ground

# A building whose feet are farther from the ground was sunk into it [m].
_LET_IN = 2.0


@dataclass(frozen=True)
class Bare:
    """A building by its surfaces, (M, 3, 3) each [m]."""

    one: Imported
    walls: np.ndarray
    roof: np.ndarray
    rest: np.ndarray
    base: float
    style: Style
    is_flat: bool
    rng: np.random.Generator


def all_laid_bare(
    buildings: Sequence[Imported], ground: Ground, seed: int
) -> list[Bare]:
    """Returns all buildings, lower variants in the style of the original."""
    whole = [
        _laid_bare(one, ground, seed) for one in buildings if not one.original
    ]
    styles = {some.one.lot_name: some.style for some in whole}
    lower = [
        _laid_bare(one, ground, seed, styles.get(one.original))
        for one in buildings
        if one.original
    ]
    return whole + lower


def _laid_bare(
    one: Imported, ground: Ground, seed: int, known: Style | None = None
) -> Bare:
    surfaces = {"body": np.zeros((0, 3, 3)), "roof": np.zeros((0, 3, 3))}
    for part in one.structure.model.parts:
        if isinstance(part.shape, MeshShape):
            mesh = one.structure.model.meshes[part.shape.mesh]
            surfaces[part.name] = mesh.vertices[mesh.triangles()]
    body = surfaces["body"]
    upright, up = is_upright(body), looks_up(body)
    roof = np.concatenate([surfaces["roof"], body[up]])
    walls, rest = body[upright], body[~upright & ~up]
    corners = one.triangles.reshape(-1, 3)
    foot = float(corners[:, 2].min())
    below = float(ground.height(corners[:, :2]).min())
    base = foot if abs(foot - below) < _LET_IN else below
    width, depth = np.ptp(corners[:, :2], axis=0)
    top = walls if len(walls) else one.triangles
    height = max(1.0, float(top[:, :, 2].max()) - base)
    is_flat = bool(len(roof)) and is_flat_roof(roof)
    rng = lot_generator(seed, "dressing", one.lot_name)
    area = 0.8 * float(width * depth)
    style = make_style(one.tags, one.year, area, height, is_flat, rng)
    if known is not None:
        storeys = max(1, round(height / known.storey))
        style = replace(known, storey=height / storeys)
    return Bare(one, walls, roof, rest, base, style, is_flat, rng)
