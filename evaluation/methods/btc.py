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

Planes are found by `btc_planes`, keypoints and triangles by `btc_triangles`.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Annotated, Literal

import numpy as np
from pydantic import (
    AfterValidator,
    Field,
    NonNegativeFloat,
    PositiveFloat,
    PositiveInt,
)

from evaluation.methods.btc_keypoints import (
    find_keypoints,
    height_image,
    image_axes,
    suppress,
)
from evaluation.methods.btc_planes import Planes, base_plane, voxel_planes
from evaluation.methods.btc_triangles import (
    Triangles,
    TriangleTable,
    make_table,
    make_triangles,
    match,
)
from evaluation.methods.btc_verification import find_motion, plane_overlap
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
        image_axes: axes of the image on a plane, in which keypoints are found.
            `public` copies the authors' program, in which a wrong term tilts
            the second axis out of the plane (see
            `evaluation.methods.btc_keypoints.image_axes`). `orthogonal`
            corrects this error. [P] public.
        resolution: side of a cell of the image on a plane [m]; [O] 0.5.
        height_range: smallest and largest height of a point that is used,
            measured from the ground [m]; [O] -1, 4.
        height_step: thickness of each layer of the image [m]; [O] 0.1.
        num_layers: number of layers of the image; [P] 49. The range of heights
            divided by the step is 50, but a rounding error in the authors'
            program leaves out one layer. Points in this layer are ignored.
        min_heights: number of occupied layers that a keypoint needs; [O] 10.
        suppression_radius: radius within which only the keypoint with the most
            layers is used [m]; [O] 2.
        max_keypoints: largest number of keypoints per place; [O] 500.
        num_neighbours: number of keypoints from which the triangles of a
            keypoint are formed: the keypoint itself and the nearest keypoints;
            [O] 10.
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
    table: TriangleTable


@register("btc")
class Btc(Method[BtcDescription, BtcDatabase]):
    """BTC; the score is the share of the query's planes that match.

    A place has no score if too few triangles match, too few of the matches
    agree on a motion, or no plane fits. The public program's limit on the score
    of a loop is not applied.
    """

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
        """Returns the scores (D,) of some candidates.

        Args:
            query: descriptor of the query.
            database: the places.
            limit: number of candidates; see `_motions`.
        """
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
            database: the places.
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
