"""Snow on a world: a layer on surfaces, and banks along the carriageway."""

import numpy as np
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components

from cns_drake.scene import ScenePart
from cns_drake.transient.effect import Effect, Phase
from cns_drake.transient.scene_editing import SceneEditing, SurfaceLook
from cns_drake.transient.surroundings import Surroundings, change_rng
from evaluation.base import sin
from worlds.shapes import GROUND_CLASSES, GroundSurface, turned_up, unit_normals

# Cause of these changes in the structure table.
_CAUSE = "snow"
# Reflectivity of snow near 900 nm: Warren, "Optical properties of snow", 1982.
_LOOK = SurfaceLook((0.93, 0.95, 0.97), 0.9, "snow")
# Snow slides off steeper surfaces: cosine of 45 degrees.
_LEAST_UP = 0.707
# Smaller surfaces bear no snow [m^2].
_LEAST_AREA = 0.3
_BARE = frozenset(
    {"vegetation", "trunk", "pole", "traffic-sign", "fence", "bicycle", "road"}
)
# Longest side of triangles at the edge of a cleared road [m].
_FINE = 0.7
# Distance from the kerb of the edge of a snow bank on the road [m].
_BANK_ON_ROAD = 0.3
# Distance from the kerb of the bank's crest, beyond the kerb [m].
_BANK_CREST = 0.3
# Distance from the kerb of the bank's edge beyond the kerb [m].
_BANK_BEYOND = 1.1
# Greatest height of the bank as a multiple of the depth of snow.
_BANK_RATIO = 2.5
# Greatest height of the bank above the snow [m].
_BANK_ABOVE_SNOW = 0.9
# Distance between points along a kerb [m].
_SPACING = 1.5
# Wavelengths of the bank's height along the street [m].
_WAVES = (9.0, 3.7)


def lay_snow(around: Surroundings, depth: float) -> None:
    """Covers surfaces with snow, except roads, plants and thin objects.

    Roads are cleared, and get banks of snow along their kerbs.

    Args:
        around: surroundings of the drive, which are changed.
        depth: depth of the snow [m].
    """
    ground = around.bare_ground
    editing = around.editing
    for structure in around.structures.values():
        if structure.semantic_class in _BARE:
            continue
        is_ground = structure.semantic_class in GROUND_CLASSES
        if not is_ground and not structure.outline.intersects(ground.near):
            continue
        changed = False
        for part in structure.parts:
            if is_ground and not ground.is_below_road(part):
                editing.cover_part(part, np.array([0.0, 0.0, depth]), _LOOK)
                changed = True
            else:
                changed |= _cover_with_snow(
                    editing, part, ground, depth, is_ground
                )
        if changed:
            editing.record_cause(structure.name, _CAUSE)
    if ground.carriageway.is_empty:
        editing.note(
            "snow: no structure of class road along the drive: no road is "
            "cleared, and no bank lies along a kerb"
        )
    else:
        _lay_banks(around, ground, depth)


EFFECT = Effect("snow", Phase.COVER, lay_snow)


def _cover_with_snow(
    editing: SceneEditing,
    part: ScenePart,
    ground: GroundSurface,
    depth: float,
    is_ground: bool,
) -> bool:
    """Covers with snow the faces of a part that are open to the sky.

    Returns:
        Whether there are such faces.
    """
    corners = part.triangle_corners
    if is_ground:
        corners = turned_up(corners)
    corners = corners[unit_normals(corners)[:, 2] > _LEAST_UP]
    if is_ground:
        corners = ground.triangles_beside_road(corners, _FINE)
    if len(corners) == 0:
        return False
    vertices, triangles = _merge_corners(corners)
    triangles = triangles[_on_large_areas(vertices, triangles)]
    if len(triangles) == 0:
        return False
    slab = _slab(vertices, triangles, depth)
    editing.add_triangles(part, f"{part.name}_snow", *slab, _LOOK)
    return True


def _slab(
    vertices: np.ndarray, triangles: np.ndarray, depth: float
) -> tuple[np.ndarray, np.ndarray]:
    """Returns vertices and triangles of a layer: its top and its sides."""
    edges = triangles[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2)
    _, first, count = np.unique(
        np.sort(edges, axis=1), axis=0, return_index=True, return_counts=True
    )
    rim = edges[first[count == 1]]
    up = len(vertices)
    slab = np.concatenate(
        [
            triangles + up,
            np.column_stack([rim[:, 0], rim[:, 1], rim[:, 1] + up]),
            np.column_stack([rim[:, 0], rim[:, 1] + up, rim[:, 0] + up]),
        ]
    )
    risen = vertices + np.array([0.0, 0.0, depth])
    return np.concatenate([vertices, risen]), slab


def _merge_corners(corners: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Returns vertices and triangles; equal corners become one vertex."""
    rounded = np.round(corners.reshape(-1, 3), 4)
    _, first, inverse = np.unique(
        rounded, axis=0, return_index=True, return_inverse=True
    )
    return corners.reshape(-1, 3)[first], inverse.reshape(-1, 3)


def _on_large_areas(vertices: np.ndarray, triangles: np.ndarray) -> np.ndarray:
    """Returns which triangles belong to areas large enough to bear snow."""
    edges = triangles[:, [0, 1, 1, 2]].reshape(-1, 2)
    graph = coo_matrix(
        (np.ones(len(edges)), (edges[:, 0], edges[:, 1])),
        (len(vertices),) * 2,
    )
    piece = connected_components(graph, directed=False)[1][triangles[:, 0]]
    a, b, c = np.moveaxis(vertices[triangles], 1, 0)
    areas = np.linalg.norm(np.cross(b - a, c - a), axis=1) / 2
    return np.bincount(piece, areas)[piece] >= _LEAST_AREA


def _lay_banks(
    around: Surroundings, ground: GroundSurface, depth: float
) -> None:
    """Adds banks of snow along all kerbs, except where the vehicle drives."""
    phases = change_rng(around.seed, _CAUSE, "banks").uniform(0, 2 * np.pi, 4)
    meshes = []
    for kerb in ground.kerbs(_SPACING):
        xy, out = kerb.points, kerb.outwards
        road = ground.heights(xy - 0.1 * out, of_road=True)
        beside = ground.heights(xy + _BANK_BEYOND * out, of_road=False)
        beside = np.where(np.isfinite(beside), beside, road)
        waves = (
            sin(2 * np.pi * (xy / _WAVES[0]) + phases[:2]).sum(axis=1)
            + sin(2 * np.pi * (xy / _WAVES[1]) + phases[2:]).sum(axis=1)
        ) / 4
        most = min(_BANK_RATIO * depth, _BANK_ABOVE_SNOW + depth)
        crest = beside + depth + (most - depth) * (0.6 + 0.4 * waves)
        # The profile of the bank: on the road, on the crest, on the snow beside
        # it.
        profile = np.stack(
            [
                np.column_stack([xy - _BANK_ON_ROAD * out, road]),
                np.column_stack([xy, (road + crest) / 2]),
                np.column_stack([xy + _BANK_CREST * out, crest]),
                np.column_stack(
                    [xy + _BANK_BEYOND * out, beside + depth - 0.01]
                ),
            ],
            axis=1,
        )
        free = np.isfinite(road) & ~around.drive.covers(xy, 1.4 + _BANK_ON_ROAD)
        use = np.flatnonzero(free[:-1] & free[1:])
        here, there = profile[use], profile[use + 1]
        for k in range(3):
            a, b = here[:, k], there[:, k]
            c, d = there[:, k + 1], here[:, k + 1]
            meshes += [np.stack([a, d, c], 1), np.stack([a, c, b], 1)]
    if meshes:
        corners = np.concatenate(meshes)
        if np.median(unit_normals(corners)[:, 2]) < 0.0:
            corners = corners[:, ::-1]
        around.editing.add_mesh(
            "snow_banks", "terrain", *_merge_corners(corners), _LOOK, _CAUSE
        )
