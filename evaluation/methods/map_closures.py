"""MapClosures (Gupta et al., ICRA 2024), from its own package.

A local map becomes a bird's-eye image of density. ORB keypoints of two images
that agree on a motion in the plane are inliers; the number of inliers is the
score. The package `map-closures` does all of this. The package is an optional
extra, because it needs an older NumPy.

A query is compared with all places of the database.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from functools import partial
from typing import Any

import numpy as np
from pydantic import PositiveFloat, PositiveInt

from evaluation.base import InputError
from evaluation.maps import downsample
from evaluation.methods.method import Method, MethodConfig, PlaceScan
from evaluation.methods.registry import register

# The package offers a single operation: it stores a local map under a number,
# and aligns it with all stored maps of lower numbers. Queries are therefore
# stored as well, as in the package's own program. Here numbers descend, and all
# places have lower numbers than queries. A new place is then aligned with no
# map, and a query with all places but no other query.
#
# A number larger than any count of places. It is the number of the first query.
# Numbers of later queries descend, but stay far above the numbers of places,
# because the package skips the maps numbered just below. It is also the number
# of aligned maps to return: all of them.
_ABOVE_ALL_PLACES = 1 << 17


class MapClosuresConfig(MethodConfig):
    """Settings of MapClosures; the defaults are from the package.

    The height of the sensor is not used: the package finds the ground. By
    default, the `middle` of the merged scans stands for a `place`.

    Attributes:
        density_map_resolution: length of a pixel, and of the voxels to which
            local maps are downsampled [m].
        density_threshold: density below which a pixel is empty, as a fraction
            of the greatest density.
        hamming_distance_threshold: number of bits by which matching keypoints
            may differ.
    """

    place: PlaceScan | None = "middle"
    density_map_resolution: PositiveFloat = 0.5
    density_threshold: PositiveFloat = 0.05
    hamming_distance_threshold: PositiveInt = 50


@dataclass
class MapClosuresDatabase:
    """The local maps of a drive, and the places found by the last query.

    Attributes:
        num_places: number of local maps that queries may find.
        program: object of the package that stores all local maps: the maps of
            the places, and the maps of all queries so far.
        num_queries: number of queries so far.
        query: local map of the last query Q.
        found: place P -> number of inliers, and pose X_PQ (4, 4) of the last
            query at this place.
    """

    num_places: int
    program: Any
    num_queries: int = 0
    query: np.ndarray | None = None
    found: dict[int, tuple[int, np.ndarray]] = field(default_factory=dict)


@register("map-closures")
class MapClosures(Method[np.ndarray, MapClosuresDatabase]):
    """MapClosures, computed by the package of its authors.

    Descriptors are downsampled local maps (N, 3). At 10 m/s and 20 scans per
    second, a local map of 200 scans covers about 50 m of path in front of the
    LiDAR, and as much behind it.
    """

    title = "MapClosures"
    source = "Gupta et al.: ICRA 2024"
    order = 10
    Config = MapClosuresConfig
    skips_places = True
    config: MapClosuresConfig
    scans_per_place = 200

    def __init__(self, config: MapClosuresConfig | None = None):
        """Prepares the package.

        Raises:
            InputError: the package is not installed.
        """
        super().__init__(config)
        try:
            from map_closures import config as package_config
            from map_closures import map_closures
        except ImportError as error:
            raise InputError(
                "map-closures: not installed; run pip install "
                "'cns-eval[map-closures]' (NumPy below 2.3)"
            ) from error
        settings = self.config.model_dump(exclude={"sensor_height", "place"})
        values = package_config.MapClosuresConfig(**settings)
        self._make_program: Callable[[], Any] = partial(
            map_closures.MapClosures, values
        )

    def describe(self, points: np.ndarray) -> np.ndarray:
        return downsample(points, self.config.density_map_resolution)

    def build_database(
        self, places: Sequence[np.ndarray]
    ) -> MapClosuresDatabase:
        program = self._make_program()
        for number in reversed(range(len(places))):
            program.get_top_k_closures(number, places[number], 1)
        return MapClosuresDatabase(len(places), program)

    def score(
        self,
        query: np.ndarray,
        database: MapClosuresDatabase,
        *,
        exhaustive: bool = False,
    ) -> np.ndarray:
        self._align_with_all_places(query, database)
        scores = np.full(database.num_places, np.nan)
        for place, (inliers, _) in database.found.items():
            scores[place] = inliers
        return scores

    def relative_pose(
        self, query: np.ndarray, database: MapClosuresDatabase, place: int
    ) -> np.ndarray | None:
        self._align_with_all_places(query, database)
        found = database.found.get(place)
        return None if found is None else found[1]

    def _align_with_all_places(
        self, query: np.ndarray, database: MapClosuresDatabase
    ) -> None:
        """Aligns a query with all places, unless it was aligned last."""
        if database.query is query:
            return
        number = _ABOVE_ALL_PLACES - database.num_queries
        closures = database.program.get_top_k_closures(
            number, query, _ABOVE_ALL_PLACES
        )
        database.num_queries += 1
        database.query = query
        # The package has the motion from the earlier map to the later one.
        database.found = {
            closure.source_id: (
                closure.number_of_inliers,
                np.linalg.inv(np.asarray(closure.pose)),
            )
            for closure in closures
            if closure.source_id < database.num_places
            and closure.number_of_inliers > 0
        }
