"""The height of the ground in an imported city, from its file or guessed."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np
from scipy.interpolate import LinearNDInterpolator, NearestNDInterpolator
from scipy.ndimage import correlate1d
import shapely
from shapely.geometry import Point

from evaluation.base import exp
from worlds.imports.faces import joined_triangles
from worlds.imports.imported_objects import Base, ImportedObject
from worlds.imports.surface_samples import surface_samples
from worlds.shapes import Mesh, MeshShape, Model, Part, Structure, hull_of

# Cell size of a guessed ground [m].
CELL = 4.0
# A guessed ground extends this far beyond the city [m].
MARGIN = 40.0
# Above this number of cells along a side, cells are larger.
_MOST_CELLS = 500
# Weights of the Gaussian that smooths a guessed ground, with a standard
# deviation of 1.5 cells, up to four times as far.
_SMOOTHING = exp(-0.5 / 1.5**2 * np.arange(-6, 7) ** 2)
# The mesh of the ground is this much lower than the ground itself, so that
# pavements at the height of the ground can be seen [m].
_MESH_DEPTH = 0.1
# Beyond this distance from the convex hull of the feet, heights are not
# interpolated between feet [m].
_BESIDE_HULL = 1.0
# Feet in a smaller hull are in a line [m^2].
_LEAST_HULL = 1e-3
# Every seventh corner of streets and other ground gives the height of the
# guessed ground.
_CORNER_STRIDE = 7


# Places beyond a grid are moved to this far before its end, so that there is
# another row and column behind them [cells].
_BEFORE_END = 1.001


class Ground:
    """The ground of an imported city: heights on an evenly spaced grid.

    The constructor takes the coordinates `xs` (C,) and `ys` (R,) of the grid in
    W, and the heights `z` (R, C) at its points [m].

    Attributes:
        xs, ys: coordinates of the grid in W, (C,) and (R,) [m].
        z: (R, C) heights at the points of the grid [m].
        cell: distance between neighbouring points of the grid [m].
    """

    def __init__(self, xs: np.ndarray, ys: np.ndarray, z: np.ndarray):
        self.xs, self.ys, self.z = xs, ys, z
        self.cell = float(xs[1] - xs[0])

    def height(self, xy: np.ndarray) -> np.ndarray:
        """Returns the heights (N,) of the ground at places (N, 2) [m].

        Heights are interpolated between the points of the grid. A place outside
        of the grid has the height of the nearest edge.
        """
        column, row = (
            np.clip(
                (coordinate - grid[0]) / self.cell, 0, len(grid) - _BEFORE_END
            )
            for coordinate, grid in zip(
                xy[:, :2].T, (self.xs, self.ys), strict=True
            )
        )
        c, r = column.astype(int), row.astype(int)
        u, v = column - c, row - r
        z = self.z
        return (
            (1 - u) * (1 - v) * z[r, c]
            + u * (1 - v) * z[r, c + 1]
            + (1 - u) * v * z[r + 1, c]
            + u * v * z[r + 1, c + 1]
        )

    def below(self, places: Iterable[np.ndarray]) -> Ground:
        """Returns the ground, lowered where it would cover one of given places.

        `places` contains arrays of places (N, 3) [m].
        """
        z = self.z.copy()
        for points in places:
            c = ((points[:, 0] - self.xs[0]) // self.cell).astype(int)
            r = ((points[:, 1] - self.ys[0]) // self.cell).astype(int)
            for row in (r, r + 1):
                for column in (c, c + 1):
                    np.minimum.at(z, (row, column), points[:, 2])
        return Ground(self.xs, self.ys, z)

    def to_mesh(self) -> Mesh:
        """Returns the ground as a mesh, lowered by 0.1 m.

        Otherwise the mesh would hide pavements at the height of the ground.
        """
        x, y = np.meshgrid(self.xs, self.ys)
        vertices = np.stack([x, y, self.z - _MESH_DEPTH], axis=-1).reshape(
            -1, 3
        )
        number = np.arange(len(vertices)).reshape(self.z.shape)
        a, b = number[:-1, :-1].ravel(), number[:-1, 1:].ravel()
        c, d = number[1:, 1:].ravel(), number[1:, :-1].ravel()
        faces = np.concatenate([np.c_[a, b, c], np.c_[a, c, d]])
        return Mesh(vertices, tuple(map(tuple, faces.tolist())))


def guess_ground(
    feet: np.ndarray, grid: tuple[np.ndarray, np.ndarray]
) -> Ground:
    """Returns a smooth ground through given points.

    Args:
        feet: (N, 3) points on the ground, such as the lowest points of
            structures [m].
        grid: coordinates of the grid, as of `Ground`.
    """
    x, y = np.meshgrid(*grid)
    z = np.full(x.shape, np.nan)
    hull = hull_of(feet[:, :2])
    if len(feet) >= 4 and hull.area > _LEAST_HULL:
        # SciPy takes long for places outside of the convex hull.
        near = shapely.contains_xy(hull.buffer(_BESIDE_HULL), x, y)
        z[near] = LinearNDInterpolator(feet[:, :2], feet[:, 2])(
            x[near], y[near]
        )
    outside = np.isnan(z)
    nearest = NearestNDInterpolator(feet[:, :2], feet[:, 2])
    z[outside] = nearest(x[outside], y[outside])
    for axis in (0, 1):
        z = correlate1d(z, _SMOOTHING / _SMOOTHING.sum(), axis, mode="nearest")
    return Ground(*grid, z)


def _grid_over(corners: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Returns the coordinates of a grid that extends beyond corners (M, 3)."""
    low, high = corners[:, :2].min(axis=0), corners[:, :2].max(axis=0)
    cell = CELL * np.ceil(max(1.0, (high - low).max() / CELL / _MOST_CELLS))
    low = np.floor((low - MARGIN) / cell) * cell
    high = high + MARGIN
    return (
        np.arange(low[0], high[0] + cell, cell),
        np.arange(low[1], high[1] + cell, cell),
    )


def ground_of(
    objects: Sequence[ImportedObject], level: float | None = None
) -> Ground:
    """Returns the ground of a city: known, its terrain or, at last, a guess.

    The guess is a smooth ground through the lowest points of structures on the
    ground, and through streets and other ground. Of a city in which nothing
    stands on the ground, all structures count.

    Args:
        objects: objects of the city.
        level: height of the ground [m]; None if it is not known to be level.
    """
    surfaces = joined_triangles(one.triangles for one in objects)
    grid = _grid_over(surfaces.reshape(-1, 3))
    if level is not None:
        return Ground(*grid, np.full((len(grid[1]), len(grid[0])), level))
    terrain = [one for one in objects if one.object_type == "TINRelief"]
    if terrain:
        points = [one.triangles.reshape(-1, 3) for one in terrain]
    else:
        standing = [one for one in objects if one.base is Base.GROUND]
        points = [
            one.triangles.reshape(-1, 3)[::_CORNER_STRIDE]
            if one.is_ground
            else one.foot[None]
            for one in standing or objects
        ]
    return guess_ground(np.concatenate(points), grid)


def ground_structures(
    objects: Sequence[ImportedObject], ground: Ground
) -> list[Structure]:
    """Returns the guessed ground of a city, as a list of one structure.

    The list is empty if the imported file contains a terrain, because
    `objects` then contains this terrain.

    Args:
        objects: objects of the city.
        ground: the guessed ground, see `ground_of`.
    """
    if any(one.object_type == "TINRelief" for one in objects):
        return []
    taken = {one.structure.name for one in objects}
    name = "ground"
    while name in taken:
        name += "_"
    # The guessed ground must not hide streets and water.
    covered = joined_triangles(
        one.triangles for one in objects if one.is_ground
    )
    samples = surface_samples(covered, ground.cell / 2.0)
    lowered = ground.below(points for points, _ in samples)
    model = Model(
        (Part("surface", MeshShape(name)),),
        {name: lowered.to_mesh()},
        Point(0.0, 0.0).buffer(1.0),
    )
    origin = (0.0, 0.0, 0.0)
    return [Structure(name, "terrain", model, origin, kind="ground")]
