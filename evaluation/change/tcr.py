"""Temporal change ratio (TCR) of two maps, directed and symmetric.

Source: "The City that Never Settles", equations 1 to 3. The paper leaves the
following choices open; this module makes them.

- A map in the paper's equations, X, is the map of a whole drive in world
  coordinates. The points of X are the centroids of voxels, whose grid is fixed
  in the world (see `evaluation.maps.voxel_maps`).
- TCR_sym changes if that grid is shifted. The least and the greatest value over
  `GRIDS`, shifts that are spread evenly over a voxel, show by how much.
- The hull is widened by `HULL_MARGIN` on all sides. Flat ground is a face of
  the hull; without a margin, a millimetre would decide whether the ground
  counts.
- O, the unchanged points, is counted inside H, the points in the other map's
  convex hull; otherwise the ratio could become negative.
- The two sets that the paper unites contain points of different clouds, so that
  the union is a concatenation. TCR_sym is therefore the mean of the directed
  ratios, weighted by the sizes of H.
"""

from __future__ import annotations

from dataclasses import dataclass
import math

import numpy as np
from scipy.spatial import ConvexHull, QhullError, cKDTree

from evaluation.maps import VOXEL_SIZE

# Points up to this far outside of a hull count as inside [m]: a tenth of a
# voxel.
HULL_MARGIN = 0.5
# Shifts of the grid [m]: points of a rank-1 lattice, evenly spaced along each
# coordinate.
_NUM_GRIDS = 16
GRIDS = tuple(
    (
        VOXEL_SIZE * (k + 0.5) / _NUM_GRIDS,
        VOXEL_SIZE * (5 * k % _NUM_GRIDS + 0.5) / _NUM_GRIDS,
        VOXEL_SIZE * (7 * k % _NUM_GRIDS + 0.5) / _NUM_GRIDS,
    )
    for k in range(_NUM_GRIDS)
)
# Distance up to which a point has a counterpart in the other map [m].
TAU = 4.5
# Range of a trajectory within which a map counts as covered by it [m].
COVERAGE_RADIUS = 40.0
# Tolerance of the boundary and of flatness, relative to the extent of the
# cloud. Without it, rounding would put the hull's own corners outside.
_TOLERANCE = 1e-9
# Number of points processed at a time: their distances to all facets fit into
# the cache.
_CHUNK = 1 << 8


@dataclass(frozen=True)
class DirectedChange:
    """Which points of a map, the source, are unchanged in another, the target.

    Attributes:
        in_hull: (N,) bool, the set H: source points in the convex hull of the
            target.
        unchanged: (N,) bool, the set O: points of H that have a target point
            within the distance `tau`, see `temporal_change`.
        distances: (N,) distance to the nearest target point [m]; infinite
            if there is none.
    """

    in_hull: np.ndarray
    unchanged: np.ndarray
    distances: np.ndarray

    @property
    def num_in_hull(self) -> int:
        """Number of points in H."""
        return int(np.count_nonzero(self.in_hull))

    @property
    def num_unchanged(self) -> int:
        """Number of points in O."""
        return int(np.count_nonzero(self.unchanged))

    @property
    def ratio(self) -> float:
        """Temporal change ratio (TCR) of the NSS benchmark, from 0 to 1.

        This is the share of changed points among the points in the hull; NaN if
        no point is in the hull.
        """
        return _changed_share(self.num_unchanged, self.num_in_hull)

    def restricted(self, kept: np.ndarray) -> DirectedChange:
        """Returns the change, counted only over the points in a mask (N,)."""
        return DirectedChange(
            self.in_hull & kept, self.unchanged & kept, self.distances
        )


@dataclass(frozen=True)
class TemporalChange:
    """The change between two maps: TCR_sym and the labels of all points.

    Attributes:
        source_to_target: labels of the source's points, changed or not in the
            target.
        target_to_source: labels of the target's points, changed or not in the
            source.

    Example:
        from evaluation import temporal_change

        print(temporal_change(source, target).source_to_target.ratio)
    """

    source_to_target: DirectedChange
    target_to_source: DirectedChange

    @property
    def num_in_hull(self) -> int:
        """Number of points in the other map's hull, summed over both maps.

        In the paper, this is the size of the union of H(S, T) and H(T, S), for
        the source S and the target T.
        """
        return (
            self.source_to_target.num_in_hull
            + self.target_to_source.num_in_hull
        )

    @property
    def num_unchanged(self) -> int:
        """Number of unchanged points of both maps, summed.

        In the paper, this is the size of the union of O(S, T) and O(T, S), for
        the source S and the target T.
        """
        return (
            self.source_to_target.num_unchanged
            + self.target_to_source.num_unchanged
        )

    @property
    def symmetric(self) -> float:
        """TCR_sym, equation 1 of the paper; NaN if no point is in a hull."""
        return _changed_share(self.num_unchanged, self.num_in_hull)

    @property
    def undefined_because(self) -> str | None:
        """Reason why TCR_sym is NaN; None if it is a number."""
        if self.num_in_hull:
            return None
        sides = (self.source_to_target, self.target_to_source)
        if any(len(side.in_hull) == 0 for side in sides):
            return "a map holds no point"
        return "no point of either map lies in the hull of the other"

    def restricted(
        self, source_kept: np.ndarray, target_kept: np.ndarray
    ) -> TemporalChange:
        """Returns the change with only some of the points counted.

        Hulls and nearest neighbours still come from the whole maps.

        Args:
            source_kept: (N,) bool, points of the source to count.
            target_kept: (M,) bool, points of the target to count.
        """
        return TemporalChange(
            self.source_to_target.restricted(source_kept),
            self.target_to_source.restricted(target_kept),
        )


def temporal_change(
    source: np.ndarray,
    target: np.ndarray,
    *,
    tau: float = TAU,
    margin: float = HULL_MARGIN,
    restrict_to_hull: bool = True,
) -> TemporalChange:
    """Compares two maps by their temporal change ratios (TCR).

    Args:
        source: (N, 3) float64 voxel centroids, in the common world frame [m].
        target: (M, 3) float64 voxel centroids of the other map [m].
        tau: distance up to which a point is unchanged, inclusive [m].
        margin: distance by which the convex hulls are widened [m].
        restrict_to_hull: whether unchanged points count only if they lie in
            the convex hull of the other map. With False, all unchanged points
            count, as equation 2 of the paper literally says, and ratios can be
            negative.

    Returns:
        Which points of each map are unchanged. The ratios are properties of
        this result; `symmetric` is TCR_sym.

    Raises:
        ValueError: if a coordinate is not finite.

    Example:
        from evaluation import temporal_change

        print(temporal_change(source, target).symmetric)
    """
    for points in (source, target):
        if not np.isfinite(points).all():
            raise ValueError("a coordinate of the map is not finite")
    return TemporalChange(
        _directed_change(source, target, tau, margin, restrict_to_hull),
        _directed_change(target, source, tau, margin, restrict_to_hull),
    )


def covered(
    points: np.ndarray,
    trajectories: tuple[np.ndarray, ...],
    radius: float = COVERAGE_RADIUS,
) -> np.ndarray:
    """Returns which points lie near all of several trajectories.

    Even without a change, two routes see different parts of a city. This
    difference hardly affects points near both routes.

    Args:
        points: (N, 3) points in the world [m].
        trajectories: (K, 3) positions of the LiDAR in the world [m], one array
            for each drive.
        radius: greatest horizontal distance to the nearest position [m]. Height
            does not count, as a tall facade is seen from its foot.

    Returns:
        (N,) bool, whether a point is near every trajectory.

    Example:
        from evaluation import covered

        near_both = points[covered(points, (positions_a, positions_b))]
    """
    near = [
        cKDTree(positions[:, :2]).query(points[:, :2])[0] <= radius
        for positions in trajectories
    ]
    return np.all(near, axis=0)


def lacks_counterpart(
    points: np.ndarray, other: np.ndarray, tau: float = TAU
) -> np.ndarray:
    """Returns which points of a fine map the change ratio (TCR) finds changed.

    Args:
        points: (N, 3) points of the map [m].
        other: (M, 3) voxel centroids of the other map, M > 0 [m].
        tau: distance up to which a point has a counterpart [m].

    Returns:
        (N,) bool, whether a point lacks a counterpart in the other map, inside
        or outside of its convex hull.
    """
    # The search stops at the bound, because all distances beyond `tau` count
    # alike. SciPy finds only neighbours that are nearer than the bound, so
    # `tau` itself, which still counts as near, has to lie well below it.
    distances, _ = cKDTree(other).query(points, distance_upper_bound=2.0 * tau)
    return distances > tau


def _directed_change(
    source: np.ndarray,
    target: np.ndarray,
    tau: float,
    margin: float,
    restrict: bool,
) -> DirectedChange:
    """Returns which points of the source are unchanged in the target.

    For the arguments, see `temporal_change`.
    """
    in_hull = in_convex_hull(source, target, margin)
    if len(source) and len(target):
        centre = target.mean(axis=0)
        distances, _ = cKDTree(target - centre).query(source - centre)
    else:
        distances = np.full(len(source), np.inf)
    unchanged = distances <= tau
    if restrict:
        unchanged &= in_hull
    return DirectedChange(in_hull, unchanged, distances)


def _changed_share(num_unchanged: int, num_in_hull: int) -> float:
    """Returns the share of points in the hull that changed; NaN without any."""
    if num_in_hull == 0:
        return math.nan
    return 1.0 - num_unchanged / num_in_hull


def in_convex_hull(
    points: np.ndarray, vertices: np.ndarray, margin: float = 0.0
) -> np.ndarray:
    """Returns which points lie in a convex hull or on its boundary.

    A cloud without volume has a hull as well: a polygon in a plane, a line
    segment or a point. Coordinates are centred first, so that large offsets
    (UTM) do not cost precision.

    Args:
        points: (N, 3) float64.
        vertices: (M, 3) float64 points that span the hull.
        margin: distance by which each face of the hull is moved outwards [m].

    Returns:
        (N,) bool; all false if there are no vertices.
    """
    if len(vertices) == 0:
        return np.zeros(len(points), dtype=bool)
    centre = vertices.mean(axis=0)
    hull = vertices - centre
    inside = points - centre
    extent = float(np.ptp(hull, axis=0).max())
    tolerance = _TOLERANCE * max(1.0, extent)
    # Rows of `axes` are the directions of largest to smallest spread.
    axes = np.linalg.svd(hull.T @ hull)[2]
    spread = np.ptp(hull @ axes.T, axis=0)
    rank = int(np.count_nonzero(spread > 2.0 * tolerance))
    tolerance += margin
    while rank > 1:
        try:
            facets = ConvexHull(hull @ axes[:rank].T).equations
        except QhullError:
            # For Qhull the cloud is flat, up to rounding.
            rank -= 1
            continue
        return _in_half_spaces(inside @ axes[:rank].T, facets, tolerance) & (
            _is_within(inside, hull, axes[rank:], tolerance)
        )
    return _is_within(inside, hull, axes[:rank], tolerance) & (
        _is_within(inside, hull, axes[rank:], tolerance)
    )


def _in_half_spaces(
    points: np.ndarray, facets: np.ndarray, tolerance: float
) -> np.ndarray:
    """Returns which points fulfil n . p + d <= tolerance for all facets."""
    result = np.empty(len(points), dtype=bool)
    for start in range(0, len(points), _CHUNK):
        span = slice(start, start + _CHUNK)
        distances = points[span] @ facets[:, :-1].T + facets[:, -1]
        result[span] = (distances <= tolerance).all(axis=1)
    return result


def _is_within(
    points: np.ndarray,
    hull: np.ndarray,
    axes: np.ndarray,
    tolerance: float,
) -> np.ndarray:
    """Returns which points lie within the hull's extent along some axes."""
    heights = hull @ axes.T
    out = points @ axes.T
    return (
        (out >= heights.min(axis=0) - tolerance)
        & (out <= heights.max(axis=0) + tolerance)
    ).all(axis=1)
