"""BTC, the binary and triangle combined descriptor (Yuan et al., T-RO 2024).

Spots that stand out from the ground (walls, trunks, posts) are keypoints; the
occupied heights above a keypoint are its binary descriptor. Triangles of nearby
keypoints do not change when the sensor moves. A place is therefore a candidate
if enough triangles of its cloud match triangles of the query, with similar
sides and similar descriptors at the vertices. A candidate has a score if its
triangles agree on a motion. The score is the share of the query's planes that
match planes of the candidate under this motion.

A cloud consists of several consecutive scans, in the frame of one of these
scans. (The method's authors describe all clouds in one world frame. This
favours the method, because the grids on which planes and keypoints are found
then coincide.)

Scores equal the public program's scores (checked on 243 single scans of two
LiDARs and 163 submaps, each against 308 places). Two details that the paper
does not determine follow the program. The first detail is the order in which
planes are compared (see `btc_planes`). Because of this order, scores depend on
the order of a cloud's points. The second detail is an error in the positions of
keypoints where the ground slopes sideways. The error lowers the scores there;
`image_axes: orthogonal` corrects this error.

Planes are found by `btc_planes`, keypoints by `btc_keypoints`. Scores have the
same bits on every processor: sums have a fixed order, and no library of linear
algebra finds eigenvectors and motions.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
import itertools
import math
from typing import Annotated, Literal

import numpy as np
from pydantic import (
    AfterValidator,
    Field,
    NonNegativeFloat,
    PositiveFloat,
    PositiveInt,
)
from scipy.spatial import cKDTree

from evaluation.base import compiled, rotated
from evaluation.methods.btc_keypoints import (
    Keypoints,
    count_bits,
    find_keypoints,
    height_image,
    image_axes,
    suppress,
)
from evaluation.methods.btc_planes import Planes, base_plane, voxel_planes
from evaluation.methods.method import Method, MethodConfig
from evaluation.methods.registry import register

# Greatest number of layers: the bits of an int64 without its sign.
_MAX_LAYERS = 62


def _increasing(limits: tuple[float, float]) -> tuple[float, float]:
    if not limits[0] < limits[1]:
        raise ValueError("the first limit must be below the second")
    return limits


class BtcConfig(MethodConfig):
    """Settings of BTC.

    Letters in brackets name the source of a value: [O] stands for the outdoor
    settings of the authors' program, [P] for constants in its code.
    `sensor_height` has no effect, because the method finds the ground in the
    cloud.

    Attributes:
        voxel_size: side of the voxels in which the method looks for planes [m];
            [O] 2.
        max_sparse_points: number of points that a voxel must exceed to be
            checked for a plane; [O] 10.
        flatness: largest variance of a plane's points along the normal of the
            plane [m^2]; [O] 0.01.
        merge_normal_limit: largest difference between the normals of two planes
            that are merged; [O] 0.1.
        merge_distance_limit: largest distance from the centre of a plane to
            another plane with which it is merged [m]; [O] 0.3.
        image_axes: axes of the image on a plane: those of the authors' program,
            in which a wrong term tilts the second axis out of the plane
            (`public`), or corrected ones (`orthogonal`). [P] public.
        resolution: side of a cell of the image on a plane [m]; [O] 0.5.
        height_range: smallest and largest height of a point that is used,
            measured from the ground [m]; [O] -1, 4.
        height_step: thickness of each layer of the image [m]; [O] 0.1.
        num_layers: number of layers of the image; [P] 49, by a rounding error
            in the authors' program: points in a 50th layer are ignored.
        min_heights: number of occupied layers that a keypoint needs; [O] 10.
        suppression_radius: radius within which only the keypoint with the most
            layers is used [m]; [O] 2.
        max_keypoints: largest number of keypoints per place; [O] 500.
        num_neighbours: number of keypoints from which the triangles of a
            keypoint are formed: itself and the nearest; [O] 10.
        side_range: smallest and largest length of a triangle's sides [m]; [O]
            2, 50.
        side_resolution: step to which side lengths are rounded in the hash
            table of triangles [m]; [O] 0.2.
        side_tolerance: largest relative difference between the sides of two
            triangles that match; [O] 0.01.
        min_similarity: smallest similarity of the descriptors of two triangles
            that match; [O] 0.7.
        min_votes: number of matching triangles that a place needs to be a
            candidate; [P] 5.
        candidates: number of candidates whose planes are compared: the places
            with the most matching triangles; [O] 50.
        normal_limit: largest difference between the normals of two planes that
            match; [O] 0.2.
        distance_limit: largest distance between the centre of a plane and
            another plane that still matches this plane [m]; [O] 0.5.
    """

    voxel_size: PositiveFloat = 2.0
    max_sparse_points: PositiveInt = 10
    flatness: PositiveFloat = 0.01
    merge_normal_limit: PositiveFloat = 0.1
    merge_distance_limit: PositiveFloat = 0.3
    image_axes: Literal["public", "orthogonal"] = "public"
    resolution: PositiveFloat = 0.5
    height_range: Annotated[
        tuple[float, float], AfterValidator(_increasing)
    ] = (-1.0, 4.0)
    height_step: PositiveFloat = 0.1
    num_layers: Annotated[int, Field(ge=1, le=_MAX_LAYERS)] = 49
    min_heights: PositiveInt = 10
    suppression_radius: NonNegativeFloat = 2.0
    max_keypoints: PositiveInt = 500
    num_neighbours: PositiveInt = 10
    side_range: Annotated[
        tuple[NonNegativeFloat, PositiveFloat], AfterValidator(_increasing)
    ] = (2.0, 50.0)
    side_resolution: PositiveFloat = 0.2
    side_tolerance: PositiveFloat = 0.01
    min_similarity: Annotated[float, Field(ge=0.0, le=1.0)] = 0.7
    min_votes: PositiveInt = 5
    candidates: PositiveInt = 50
    normal_limit: PositiveFloat = 0.2
    distance_limit: PositiveFloat = 0.5


# Fixed in the public program: least excess of the sum of the two short sides
# over the long one [m].
_MIN_DETOUR = 0.2
# Fixed in the public program: greatest difference of the sides of two triangles
# of a cloud that count as the same [m].
_SAME = 0.001
# Fixed in the public program: greatest distance of a query from the center of a
# cell that is searched [cells].
_REACH = 1.5

# The search reaches this much farther, to allow for rounding.
_MARGIN = 1.0 + 1e-9

# A similarity equal to the limit counts, whatever the rounding: in the public
# program's single precision, the limit 0.7 is 1e-8 less.
_ROUNDING = 1e-8


@dataclass(frozen=True)
class Triangles:
    """Triangles of keypoints.

    The vertices are ordered by the sides that meet there: the two shortest
    sides; the shortest and the longest side; the two longest sides.

    Attributes:
        sides: (T, 3) lengths, shortest first [m].
        positions: (T, 3, 3) positions of the vertices, one in each row [m].
        heights: (T, 3) int64, the binary descriptor of each vertex: bit k is
            set if the vertex's cell has points in layer k above the plane.
    """

    sides: np.ndarray
    positions: np.ndarray
    heights: np.ndarray

    def __len__(self) -> int:
        return len(self.sides)

    def take(self, chosen: np.ndarray) -> Triangles:
        """Returns some of the triangles, by index."""
        return Triangles(
            self.sides[chosen], self.positions[chosen], self.heights[chosen]
        )


@dataclass(frozen=True)
class _TriangleTable:
    """The triangles of some clouds, sorted by cell.

    A cell contains the triangles whose sides round to the same multiples of
    the resolution.

    Attributes:
        clouds: (T,) number of each triangle's cloud.
        resolution: step to which the sides are rounded [m].
        tree: search tree over the sides [m].
    """

    triangles: Triangles
    clouds: np.ndarray
    resolution: float
    tree: cKDTree


def make_triangles(
    keypoints: Keypoints, num_neighbours: int, side_range: tuple[float, float]
) -> Triangles:
    """Returns the triangles between each keypoint and its neighbours.

    Args:
        keypoints: the K keypoints.
        num_neighbours: number of nearest keypoints that are used, including the
            keypoint itself; all keypoints if there are fewer than this number.
        side_range: limits of the sides [m].
    """
    # The public program reads beyond its array if there are fewer keypoints.
    num_neighbours = min(num_neighbours, len(keypoints))
    if num_neighbours < 3:
        return Triangles(
            np.empty((0, 3)),
            np.empty((0, 3, 3)),
            np.empty((0, 3), dtype=np.int64),
        )
    positions = keypoints.positions
    corners = _corner_triples(positions, num_neighbours)
    ends = np.array([[0, 1], [0, 2], [1, 2]])
    difference = positions[corners[:, ends[:, 0]]]
    difference -= positions[corners[:, ends[:, 1]]]
    sides = np.sqrt((difference**2).sum(axis=2))
    order = np.argsort(sides, axis=1, kind="stable")
    sides = np.take_along_axis(sides, order, axis=1)
    low, high = side_range
    detour = sides[:, 0] + sides[:, 1] - sides[:, 2]
    kept = (sides[:, 0] >= low) & (sides[:, 2] <= high)
    kept &= detour >= _MIN_DETOUR
    sides, order, corners = sides[kept], order[kept], corners[kept]
    first = _first_of_each(sides)
    sides, order, corners = sides[first], order[first], corners[first]
    # Sides 0, 1 and 2 lie between corners 0-1, 0-2 and 1-2.
    meeting = np.stack(
        [
            order[:, 0] + order[:, 1] - 1,
            order[:, 0] + order[:, 2] - 1,
            order[:, 1] + order[:, 2] - 1,
        ],
        axis=1,
    )
    vertices = np.take_along_axis(corners, meeting, axis=1)
    return Triangles(sides, positions[vertices], keypoints.heights[vertices])


def _corner_triples(positions: np.ndarray, num_neighbours: int) -> np.ndarray:
    """Returns each keypoint with any two of its neighbours, (T, 3) indices.

    Args:
        positions: (K, 3) positions of the keypoints [m].
        num_neighbours: number of nearest keypoints, including the keypoint
            itself; at most K.
    """
    _, nearest = cKDTree(positions).query(positions, k=num_neighbours)
    # The keypoint itself, then two of its neighbours, in order of distance.
    one, other = np.triu_indices(num_neighbours - 1, k=1)
    return np.stack(
        [
            np.repeat(nearest[:, 0], len(one)),
            nearest[:, one + 1].ravel(),
            nearest[:, other + 1].ravel(),
        ],
        axis=1,
    )


def _first_of_each(sides: np.ndarray) -> np.ndarray:
    """Returns the first of all triangles with the same sides, as indices.

    Each triangle is found from up to three corners.

    Args:
        sides: (T, 3) sides of the triangles, shortest first [m].
    """
    lengths = (sides / _SAME).astype(np.int64)
    by_length = np.lexsort(lengths.T)
    differs = np.diff(lengths[by_length], axis=0, prepend=-1).any(axis=1)
    return np.sort(by_length[differs])


def make_table(
    clouds: Sequence[Triangles], resolution: float
) -> _TriangleTable:
    """Returns the triangles of several clouds, sorted for the search.

    Triangles whose sides round to the same multiples of the resolution form a
    cell. Triangles are sorted by cell, and keep their order within a cell.

    Args:
        clouds: triangles of each cloud; at least one.
        resolution: step to which the sides are rounded [m].
    """
    triangles = Triangles(
        np.concatenate([cloud.sides for cloud in clouds]),
        np.concatenate([cloud.positions for cloud in clouds]),
        np.concatenate([cloud.heights for cloud in clouds]),
    )
    numbers = np.repeat(np.arange(len(clouds)), [len(c) for c in clouds])
    order = np.lexsort(_cells(triangles.sides / resolution).T[::-1])
    triangles = triangles.take(order)
    return _TriangleTable(
        triangles, numbers[order], resolution, cKDTree(triangles.sides)
    )


def _cells(sides: np.ndarray) -> np.ndarray:
    """Returns the cells (T, 3) of sides (T, 3) in units of the resolution."""
    return (sides + 0.5).astype(np.int64)


def match(
    query: Triangles,
    table: _TriangleTable,
    side_tolerance: float,
    min_similarity: float,
) -> tuple[np.ndarray, np.ndarray]:
    """Returns the pairs of similar triangles of a query and of a table.

    Similar triangles have about the same side lengths, and about the same
    binary descriptors at their vertices.

    Args:
        query: triangles of one cloud.
        table: table in which similar triangles are sought.
        side_tolerance: greatest difference of the side lengths, as the norm of
            three differences divided by the norm of the query's three lengths.
            For large triangles, the limit is smaller, because only cells of the
            table near the query's lengths are searched.
        min_similarity: least Dice similarity of the descriptors, as the mean
            over three vertices.

    Returns:
        (M,) indices of triangles of the query, non-decreasing, and (M,) indices
        of triangles of the table. Matches of one query triangle are in the
        order of the table.
    """
    limits = side_tolerance * np.sqrt((query.sides**2).sum(axis=1))
    # Triangles farther away are in cells that are not searched; the corners of
    # a cell are sqrt(3) from its center.
    farthest = (_REACH + math.sqrt(3.0)) * table.resolution
    reach = np.minimum(limits, farthest) * _MARGIN
    near = table.tree.query_ball_point(query.sides, reach, return_sorted=True)
    of_query = np.repeat(np.arange(len(query)), [len(one) for one in near])
    of_table = np.fromiter(
        itertools.chain.from_iterable(near), np.int64, len(of_query)
    )
    sides = query.sides[of_query] / table.resolution
    others = table.triangles.sides[of_table] / table.resolution
    limit = side_tolerance * np.sqrt((sides**2).sum(axis=1))
    difference = np.sqrt(((others - sides) ** 2).sum(axis=1))
    to_center = np.sqrt(((_cells(others) + 0.5 - sides) ** 2).sum(axis=1))
    is_near = (to_center < _REACH) & (difference < limit)
    of_query, of_table = of_query[is_near], of_table[is_near]
    heights = query.heights[of_query]
    others = table.triangles.heights[of_table]
    common = count_bits(heights & others)
    similarity = 2.0 * common / (count_bits(heights) + count_bits(others))
    is_alike = similarity.sum(axis=1) / 3.0 > min_similarity - _ROUNDING
    return of_query[is_alike], of_table[is_alike]


@dataclass(frozen=True)
class BtcDescription:
    """The descriptor of a cloud.

    Attributes:
        planes: patches of planes, one for each voxel.
        triangles: triangles between the keypoints.
    """

    planes: Planes
    triangles: Triangles


@dataclass(frozen=True)
class BtcDatabase:
    """Descriptors of D places, prepared for the search.

    Attributes:
        places: descriptors of the places.
        table: triangles of all places.
    """

    places: Sequence[BtcDescription]
    table: _TriangleTable


@register("btc")
class Btc(Method[BtcDescription, BtcDatabase]):
    """BTC; the score is the share of the query's planes that match.

    A place has no score if too few triangles match, too few of the matches
    agree on a motion, or no plane fits. The public program's limit on the score
    of a loop is not applied.
    """

    title = "BTC"
    style = ("#D55E00", "--", "s")
    source = "Yuan et al.: T-RO 2024"
    standard = True
    order = 4
    Config = BtcConfig
    skips_places = True
    divides = True
    config: BtcConfig
    scans_per_place = 10

    def describe(self, points: np.ndarray) -> BtcDescription:
        config = self.config
        # For arrays in another memory order, numba would compile again.
        points = np.ascontiguousarray(points)
        planes = voxel_planes(
            points, config.voxel_size, config.max_sparse_points, config.flatness
        )
        base = base_plane(
            planes, config.merge_normal_limit, config.merge_distance_limit
        )
        center, normal = _horizontal_plane(points) if base is None else base
        axes = image_axes(normal, config.image_axes == "orthogonal")
        image = height_image(
            points,
            center,
            axes,
            resolution=config.resolution,
            height_range=config.height_range,
            height_step=config.height_step,
            num_layers=config.num_layers,
        )
        keypoints = find_keypoints(image, center, axes, config.min_heights)
        keypoints = suppress(
            keypoints, config.suppression_radius, config.max_keypoints
        )
        triangles = make_triangles(
            keypoints, config.num_neighbours, config.side_range
        )
        return BtcDescription(planes, triangles)

    def build_database(self, places: Sequence[BtcDescription]) -> BtcDatabase:
        return BtcDatabase(
            places=places,
            table=make_table(
                [place.triangles for place in places],
                self.config.side_resolution,
            ),
        )

    def score(
        self,
        query: BtcDescription,
        database: BtcDatabase,
        *,
        exhaustive: bool = False,
    ) -> np.ndarray:
        limit = None if exhaustive else self.config.candidates
        return self._score(query, database, limit)

    @property
    def num_shortlisted(self) -> int:
        return self.config.candidates

    def shortlist(
        self, query: BtcDescription, database: BtcDatabase
    ) -> np.ndarray:
        _, of_table = self._matches(query, database)
        clouds = database.table.clouds[of_table]
        votes = np.bincount(clouds, minlength=len(database.places))
        return -np.sort(-votes)[: self.config.candidates]

    def score_best(
        self, query: BtcDescription, database: BtcDatabase, number: int
    ) -> np.ndarray:
        return self._score(query, database, number)

    def _score(
        self, query: BtcDescription, database: BtcDatabase, limit: int | None
    ) -> np.ndarray:
        """Returns the scores (D,) of some candidates."""
        scores = np.full(len(database.places), np.nan)
        for place, X_PQ in self._motions(query, database, limit):
            planes = database.places[place].planes
            if len(query.planes) == 0 or len(planes) == 0:
                continue
            overlap = plane_overlap(
                query.planes,
                planes,
                X_PQ,
                self.config.normal_limit,
                self.config.distance_limit,
            )
            if overlap > 0.0:
                scores[place] = overlap
        return scores

    def relative_poses(
        self,
        query: BtcDescription,
        database: BtcDatabase,
        places: Sequence[int],
    ) -> list[np.ndarray | None]:
        """Returns the pose X_PQ of a query's LiDAR Q at each of several places.

        P is the LiDAR of the place. X_PQ is the pose on which most of the
        matching triangles agree; None if too few triangles match or agree.
        """
        database_of_places = self.build_database(
            [database.places[place] for place in places]
        )
        found = dict(self._motions(query, database_of_places, None))
        return [found.get(index) for index in range(len(places))]

    def _motions(
        self,
        query: BtcDescription,
        database: BtcDatabase,
        max_candidates: int | None,
    ) -> Iterator[tuple[int, np.ndarray]]:
        """Yields candidate places, each with the motion X_PQ of its triangles.

        Args:
            query: descriptor of the query.
            max_candidates: number of candidates: the places with the most
                matches; None for all.
        """
        table = database.table
        of_query, of_table = self._matches(query, database)
        clouds = table.clouds[of_table]
        # Sort by place; matches of a place stay in the order in which they were
        # found.
        order = np.argsort(clouds, kind="stable")
        votes = np.bincount(clouds, minlength=len(database.places))
        ends = np.cumsum(votes)
        candidates = np.argsort(-votes, kind="stable")[:max_candidates]
        for place in candidates[votes[candidates] >= self.config.min_votes]:
            pairs = order[ends[place] - votes[place] : ends[place]]
            X_PQ = find_motion(
                query.triangles.positions[of_query[pairs]],
                table.triangles.positions[of_table[pairs]],
            )
            if X_PQ is not None:
                yield int(place), X_PQ

    def _matches(
        self, query: BtcDescription, database: BtcDatabase
    ) -> tuple[np.ndarray, np.ndarray]:
        """Returns the similar triangles of a query and of all places.

        Returns:
            (M,) indices in the query's triangles; (M,) indices in the table.
        """
        return match(
            query.triangles,
            database.table,
            self.config.side_tolerance,
            self.config.min_similarity,
        )


def _horizontal_plane(points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Returns a plane for clouds (N, 3) in which no plane is found.

    As in the public program, the plane is horizontal and contains the first
    point.

    Returns:
        (3,) a point of the plane [m]; (3,) its normal.
    """
    first = points[0] if len(points) > 0 else np.zeros(3)
    return first, np.array([0.0, 0.0, 1.0])


# Fixed in the public program: approximate greatest number of pairs to try.
_TRIALS = 50
# Fixed in the public program: greatest distance of an aligned vertex from its
# partner [m].
_VERTEX_LIMIT = 3.0
# Fixed in the public program: number of pairs that must agree on a motion.
_MIN_AGREEING = 4


def align(query: np.ndarray, place: np.ndarray) -> np.ndarray:
    """Returns the motion that best aligns triangles with their partners.

    The motion is Kabsch's solution, without reflections.

    Args:
        query: (..., 3, 3) vertices, one in each row [m]; not on one line.
        place: (..., 3, 3) the partners of these vertices [m].

    Returns:
        (..., 4, 4) pose X_PQ of the query's frame Q in the place's frame P.
    """
    shape = query.shape
    motions = _alignments(query.reshape(-1, 3, 3), place.reshape(-1, 3, 3))
    return motions.reshape(*shape[:-2], 4, 4)


@compiled
def _alignments(query: np.ndarray, place: np.ndarray) -> np.ndarray:
    """Returns Kabsch's solution for pairs of triangles, (M, 4, 4).

    The best rotation turns the plane of one triangle into the plane of the
    other. What remains is an angle in this plane, whose tangent is a quotient
    of two sums. The order of operations is fixed, so that results have the same
    bits on every processor.

    Args:
        query, place: (M, 3, 3) vertices, one in each row [m].
    """
    result = np.zeros((len(query), 4, 4))
    # For both triangles: mean, axes (rows) and vertices along the first two
    # axes.
    means = np.empty((2, 3))
    axes = np.empty((2, 3, 3))
    flat = np.empty((2, 3, 2))
    for m in range(len(query)):
        for side in range(2):
            corners = query[m] if side == 0 else place[m]
            for k in range(3):
                means[side, k] = (
                    corners[0, k] + corners[1, k] + corners[2, k]
                ) / 3.0
            _plane_axes(corners, axes[side])
            for vertex in range(3):
                for axis in range(2):
                    flat[side, vertex, axis] = (
                        (corners[vertex, 0] - means[side, 0])
                        * axes[side, axis, 0]
                        + (corners[vertex, 1] - means[side, 1])
                        * axes[side, axis, 1]
                        + (corners[vertex, 2] - means[side, 2])
                        * axes[side, axis, 2]
                    )
        along, across = 0.0, 0.0
        for vertex in range(3):
            x, y = flat[0, vertex, 0], flat[0, vertex, 1]
            u, v = flat[1, vertex, 0], flat[1, vertex, 1]
            along += u * x + v * y
            across += v * x - u * y
        length = math.sqrt(along * along + across * across)
        c, s = along / length, across / length
        for i in range(3):
            one = c * axes[1, 0, i] + s * axes[1, 1, i]
            other = c * axes[1, 1, i] - s * axes[1, 0, i]
            for j in range(3):
                result[m, i, j] = (
                    one * axes[0, 0, j]
                    + other * axes[0, 1, j]
                    + axes[1, 2, i] * axes[0, 2, j]
                )
            result[m, i, 3] = means[1, i] - (
                result[m, i, 0] * means[0, 0]
                + result[m, i, 1] * means[0, 1]
                + result[m, i, 2] * means[0, 2]
            )
        result[m, 3, 3] = 1.0
    return result


@compiled
def _plane_axes(corners: np.ndarray, axes: np.ndarray) -> None:
    """Writes two axes in the plane of a triangle, and its normal.

    Args:
        corners: (3, 3) vertices, one in each row.
        axes: (3, 3) to fill: unit vectors, one in each row.
    """
    for k in range(3):
        axes[0, k] = corners[1, k] - corners[0, k]
        axes[1, k] = corners[2, k] - corners[0, k]
    _write_normal(axes[0], axes[1], axes[2])
    length = math.sqrt(
        axes[0, 0] * axes[0, 0]
        + axes[0, 1] * axes[0, 1]
        + axes[0, 2] * axes[0, 2]
    )
    for k in range(3):
        axes[0, k] /= length
    _write_normal(axes[2], axes[0], axes[1])


@compiled
def _write_normal(a: np.ndarray, b: np.ndarray, normal: np.ndarray) -> None:
    """Writes the unit vector (3,) in the direction of a x b."""
    x = a[1] * b[2] - a[2] * b[1]
    y = a[2] * b[0] - a[0] * b[2]
    z = a[0] * b[1] - a[1] * b[0]
    length = math.sqrt(x * x + y * y + z * z)
    normal[0], normal[1], normal[2] = x / length, y / length, z / length


def find_motion(query: np.ndarray, place: np.ndarray) -> np.ndarray | None:
    """Returns the pose on which most of M pairs of triangles agree.

    Every pair (or, if there are many, every n-th pair) proposes the pose that
    aligns its two triangles.

    Args:
        query: (M, 3, 3) vertices of the query's triangles in the query's frame
            Q [m], M > 0.
        place: (M, 3, 3) vertices of the matching triangles of the place in the
            place's frame P [m].

    Returns:
        X_PQ (4, 4), the first of several equally good poses; None if too few
        pairs agree.
    """
    stride = len(query) // _TRIALS + 1
    # One proposal for each whole stride.
    tried = np.arange(len(query) // stride) * stride
    motions = align(query[tried], place[tried])
    agreeing = _numbers_agreeing(motions, query, place)
    best = int(agreeing.argmax())
    return motions[best] if agreeing[best] >= _MIN_AGREEING else None


@compiled
def _numbers_agreeing(
    motions: np.ndarray, query: np.ndarray, place: np.ndarray
) -> np.ndarray:
    """Returns how many pairs of triangles agree on each motion, (N,) int64.

    Args:
        motions: (N, 4, 4) poses X_PQ.
        query, place: (M, 3, 3) vertices, see `find_motion`.
    """
    result = np.zeros(len(motions), np.int64)
    for n in range(len(motions)):
        X = motions[n]
        for m in range(len(query)):
            farthest = 0.0
            for vertex in range(3):
                x, y, z = query[m, vertex]
                squares = 0.0
                for k in range(3):
                    offset = (
                        X[k, 0] * x + X[k, 1] * y + X[k, 2] * z + X[k, 3]
                    ) - place[m, vertex, k]
                    squares += offset * offset
                farthest = max(farthest, squares)
            result[n] += farthest < _VERTEX_LIMIT * _VERTEX_LIMIT
    return result


def plane_overlap(
    query: Planes,
    place: Planes,
    X_PQ: np.ndarray,
    normal_limit: float,
    distance_limit: float,
) -> float:
    """Returns the share of a query's patches that match a patch of a place.

    Each patch is compared with the patch whose centre is nearest.

    Args:
        query: patches of the query, at least one.
        place: patches of the place, at least one.
        X_PQ: (4, 4) pose of the query's frame Q in the place's frame P.
        normal_limit: upper limit of the length of the difference of the two
            unit normals. The sign of a normal does not matter.
        distance_limit: upper limit of a centre's distance from the plane of the
            other patch [m].
    """
    normals = rotated(X_PQ[:3, :3], query.normals)
    centers = rotated(X_PQ[:3, :3], query.centers) + X_PQ[:3, 3]
    _, nearest = cKDTree(place.centers).query(centers)
    # |n1 - n2| < d of unit vectors; either sign of a normal will do.
    cosines = np.abs((normals * place.normals[nearest]).sum(axis=1))
    offsets = ((centers - place.centers[nearest]) * place.normals[nearest]).sum(
        axis=1
    )
    fitting = (cosines > 1.0 - 0.5 * normal_limit**2) & (
        np.abs(offsets) < distance_limit
    )
    return np.count_nonzero(fitting) / len(query)
