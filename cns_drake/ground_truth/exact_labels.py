"""Exact labels of two maps of one place: gone, new, kept or not observed.

Rays that are cast in the worlds of both drives determine the labels.

- A drive **observes** a point if the LiDAR can see it from one of the drive's
    poses: the point is within the LiDAR's ranges and field of view, and no
    surface occludes it. A surface occludes a point that lies more than `NEAR`
    behind the surface along the line of sight. At grazing angles, the point
    must lie farther behind the surface, so that a wall that has moved a little
    does not occlude its old position.
- A surface is **there** if the surface passes within `NEAR` of the point,
  measured perpendicular to the surface. Moving objects do not count.

A point of the older map A is `kept` if B's drive observes it and a surface of
B's world is there, `gone` if B's drive observes it and no surface is there, and
`unobserved` if B's drive does not observe it. In the same way, A's drive and
A's world decide whether a point of the newer map B is `kept`, `new` or `newly
seen`.

The poses of a drive are the poses of the scans that make its map. Surfaces are
ideal: glass and leaves count as solid geometry.
"""

from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
import itertools

import numpy as np

from cns_drake.ground_truth.exact_overlap import Sight, sights_of
from cns_drake.ground_truth.labelled import LabelledDrive
from cns_drake.ray_casting import RayCastingScene
from cns_drake.simulation import SimulatedDrive
from evaluation.base import cos, num_cores, sin, track
from evaluation.drives import sample_frames
from evaluation.map_update import SIDES, Session

# A surface this near to a point is its own [m].
NEAR = 0.1
# At grazing angles, a surface hides points that lie this far behind,
# perpendicular to it [m].
_SKIN = 0.3
# Greatest distance behind a surface, along the line of sight, up to which
# `_SKIN` applies [m].
_GRAZING = 1.0
# Distance driven between the first poses to be tried [m]; most points are seen
# from these.
_FIRST_LOOKS = 32.0
# Number of points per cast.
_CHUNK = 1 << 15
# Side of the tiles in which points are found [m].
_TILE = 16.0
# Side of the cubes in which rays to points are neighbours [m].
_RAY_CUBE = 1.0
# One of each two opposite directions to the neighbours of a cube's middle.
# Every direction is within 28 deg of one of them: a ray of 1.25 times `NEAR`
# meets any plane within `NEAR`.
_AXES = np.array(
    [
        axis
        for axis in itertools.product((-1.0, 0.0, 1.0), repeat=3)
        if axis > (0.0, 0.0, 0.0)
    ]
)
_REACH = 1.25 * NEAR
# Edges and small parts lie in other directions: a spiral over half a sphere has
# one within 15 deg of each.
_SPIRAL = 64


def label_points(
    session: Session, other: LabelledDrive, frames: np.ndarray
) -> np.ndarray:
    """Returns the exact label of each point of a drive's map, (N,) uint8.

    The labels are values of `evaluation.map_update.labels.Label`. A label
    states whether the other drive observes the point and, if so, whether the
    world of the other drive has a surface there.

    Args:
        session: the drive whose map of N points is labelled.
        other: the other drive.
        frames: (K,) numbers of the other drive's frames from whose poses points
            can be observed.
    """
    unobserved, kept, changed = SIDES[session.side]
    labels = np.full(len(session.points), unobserved, np.uint8)
    seen = observed_points(session.points, other.simulated, frames)
    rows = np.flatnonzero(seen)
    there = is_there(session.points[rows], other.still())
    labels[rows] = np.where(there, kept, changed)
    return labels


def observed_points(
    points: np.ndarray,
    drive: SimulatedDrive,
    frames: np.ndarray,
) -> np.ndarray:
    """Returns which points a simulated drive observes, (N,) bool.

    A point is observed if the LiDAR can see it at one of the given frames: the
    point is within the LiDAR's ranges and field of view, and no surface
    occludes it.

    Args:
        points: (N, 3) points in W [m].
        drive: the drive.
        frames: (K,) frame numbers.
    """
    result = np.zeros(len(points), bool)
    look = sights_of(drive)
    tiles = _Tiles(points)
    first = sample_frames(drive.X_WS[frames, :3, 3], _FIRST_LOOKS)
    looks = np.concatenate([frames[first], np.delete(frames, first)]).tolist()
    with ThreadPoolExecutor(num_cores()) as threads:
        for frame in track(
            looks, f"looking from {drive.name}", len(looks), "scans"
        ):
            near = tiles.near(drive.X_WS[frame, :3, 3], drive.pattern.max_range)
            if not near:
                continue
            sight = look(frame)
            rows = np.concatenate([tiles.left[tile] for tile in near])
            for seen in threads.map(
                lambda chunk, sight=sight: chunk[
                    _observed_rows(points[chunk], sight)
                ],
                list(_chunks(rows)),
            ):
                result[seen] = True
            # Points that are seen already need no more rays.
            for tile in near:
                left = tiles.left[tile]
                tiles.left[tile] = left[~result[left]]
    return result


def _observed_rows(points: np.ndarray, sight: Sight) -> np.ndarray:
    """Returns the rows of the points (N, 3) in W that are observed."""
    p_WS, R_WS = sight.X_WS.translation(), sight.X_WS.rotation().matrix()
    rows, d_Sset, distances = sight.reached((points - p_WS) @ R_WS)
    hits = sight.scene.cast_rays(p_WS, d_Sset, distances, R_WSset=R_WS)
    # A miss is infinitely far behind the point.
    before = distances - hits.ranges
    is_free = before <= NEAR
    grazed = np.flatnonzero(~is_free & (before <= _GRAZING))
    d_Sset = d_Sset[grazed]
    hits = sight.scene.cast_rays(
        p_WS, d_Sset, distances[grazed], R_WSset=R_WS, with_normals=True
    )
    cosines = np.einsum("ij,ij->i", hits.normals_W, d_Sset @ R_WS.T)
    is_free[grazed] = before[grazed] * np.abs(cosines) <= _SKIN
    return rows[is_free]


class _Tiles:
    """Points sorted into square tiles; `left` has rows not yet observed."""

    def __init__(self, points: np.ndarray):
        cells = np.floor(points[:, :2] / _TILE).astype(np.int64)
        # Rays to neighbours meet the same surfaces, which is fast.
        fine = np.floor(points / _RAY_CUBE).astype(np.int64)
        order = np.lexsort((*fine.T, *cells.T))
        cells = cells[order]
        is_first = np.ones(len(points), bool)
        is_first[1:] = (np.diff(cells, axis=0) != 0).any(axis=1)
        starts = np.flatnonzero(is_first)
        self.left = np.split(order, starts[1:])
        self._middles = _TILE * (cells[starts] + 0.5)

    def near(self, p_WS: np.ndarray, reach: float) -> list[int]:
        """Returns the numbers of the tiles near a sensor at `p_WS` (3,) [m].

        Tiles beyond `reach` [m], and tiles whose points have all been observed,
        are left out.
        """
        away = np.linalg.norm(self._middles - p_WS[:2], axis=1)
        near = np.flatnonzero(away <= reach + _TILE)
        return [int(tile) for tile in near if len(self.left[tile])]


def is_there(points: np.ndarray, scene: RayCastingScene) -> np.ndarray:
    """Returns which points (N, 3) in W [m] lie on a surface, (N,) bool.

    A point lies on a surface of the scene if it is at most `NEAR` [m] away.
    """
    result = np.zeros(len(points), bool)
    left = np.arange(len(points))
    for axis in _AXES / np.linalg.norm(_AXES, axis=1, keepdims=True):
        for rows in _chunks(left):
            hits = scene.cast_rays(
                points[rows] - _REACH * axis,
                np.broadcast_to(axis, (len(rows), 3)),
                2.0 * _REACH,
                with_normals=True,
            )
            along = np.abs(np.minimum(hits.ranges, np.float32(9.0)) - _REACH)
            # The normal of a miss is zero.
            across = along * np.abs(hits.normals_W @ axis)
            result[rows] = (hits.geometry >= 0) & (across <= NEAR)
        left = left[~result[left]]
    for axis in _spiral():
        for rows in _chunks(left):
            hits = scene.cast_rays(
                points[rows] - NEAR * axis,
                np.broadcast_to(axis, (len(rows), 3)),
                2.0 * NEAR,
            )
            result[rows] = hits.geometry >= 0
        left = left[~result[left]]
    return result


def _spiral() -> np.ndarray:
    """Returns unit directions at even distances, (_SPIRAL, 3), z > 0.

    Source: Swinbank and Purser, Fibonacci grids, QJRMS 2006.
    """
    number = np.arange(_SPIRAL) + 0.5
    z = 1.0 - number / _SPIRAL
    angle = np.pi * (1.0 + np.sqrt(5.0)) * number
    around = np.sqrt(1.0 - z * z)
    return np.stack([around * cos(angle), around * sin(angle), z], axis=1)


def _chunks(rows: np.ndarray) -> Iterator[np.ndarray]:
    for start in range(0, len(rows), _CHUNK):
        yield rows[start : start + _CHUNK]
