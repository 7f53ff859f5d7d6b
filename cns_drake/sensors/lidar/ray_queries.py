"""Rays of any origin and direction, cast on the geometry that a LiDAR sees."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from pydrake.geometry import GeometryId

from cns_drake.scene import PerceptionGeometry
from cns_drake.sensors.lidar.seen_geometry import SeenGeometry


class RayHits(NamedTuple):
    """The surfaces that N rays hit first.

    Attributes:
        ranges: (N,) float32 distances [m], inf for a miss.
        geometry_ids: N `GeometryId`, None for a miss.
        normals_W: (N, 3) float32 unit normals in the world that face the
            origins of the rays, zero for a miss.

    Example:
        from cns_drake import Lidar, RayHits

        def nearest(lidar: Lidar, context, p_WR, d_W) -> float:
            hits: RayHits = lidar.CastRays(context, p_WR, d_W)
            return hits.ranges.min()
    """

    ranges: np.ndarray
    geometry_ids: list[GeometryId | None]
    normals_W: np.ndarray


def cast_free_rays(
    seen: SeenGeometry,
    p_WR: np.ndarray,
    d_W: np.ndarray,
    max_range: float | np.ndarray,
    time: float,
) -> RayHits:
    """Returns the hits of N rays, computed as for `Lidar.CastRays`.

    Args:
        seen: the geometry, with a scene.
        p_WR: (N, 3) origins in the world, or (3,) if all rays have the same
            origin [m].
        d_W: (N, 3) unit directions in the world.
        max_range: greatest range [m], one for all rays or (N,).
        time: time at which the rays are cast, from 0 at the start of the
            revolution to 1 at its end.

    Raises:
        ValueError: shapes do not match, a direction has another length than 1,
            or a number is not finite (ranges may be infinite).
    """
    p_W, d_W = np.asarray(p_WR, float), np.asarray(d_W, float)
    ranges = np.asarray(max_range, float)
    _check_rays(p_W, d_W, ranges)
    assert seen.scene is not None
    hits = seen.scene.cast_rays(
        p_W,
        d_W,
        ranges,
        times=np.array([time]),
        with_normals=True,
    )
    return RayHits(
        hits.ranges, geometry_ids(seen.built, hits.geometry), hits.normals_W
    )


def _check_rays(p_W: np.ndarray, d_W: np.ndarray, ranges: np.ndarray) -> None:
    """Checks the arguments of `cast_free_rays`.

    Raises:
        ValueError: shapes or values are impossible.
    """
    if (
        d_W.shape[1:] != (3,)
        or p_W.shape not in ((3,), d_W.shape)
        or ranges.shape not in ((), d_W.shape[:1])
    ):
        raise ValueError(
            f"p_WR {p_W.shape}, d_W {d_W.shape}, max_range {ranges.shape}: "
            "give (N, 3) or (3,), (N, 3), and a number or (N,)"
        )
    length = np.linalg.norm(d_W, axis=1)
    if not (np.abs(length - 1.0) <= 1e-6).all():
        raise ValueError("d_W: a direction does not have the length 1")
    if not (np.isfinite(p_W).all() and (ranges >= 0.0).all()):
        raise ValueError("p_WR, max_range: not finite, or negative")


def geometry_ids(
    geometries: Sequence[PerceptionGeometry], indices: np.ndarray
) -> list[GeometryId | None]:
    """Returns the ids of geometries by indices (N,); None if negative."""
    ids: list[GeometryId | None] = [shape.geometry_id for shape in geometries]
    ids.append(None)
    return [ids[k] for k in np.maximum(indices, -1).tolist()]
