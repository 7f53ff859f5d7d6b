"""Layered overlap: a matched filter on maps of bits, made to survive change.

A scan becomes maps from above: one for each layer of height, one for poles
and one for kerbs. Two scans are compared at the pose at which most of their
filled cells coincide. Things that are gone or new only lower this number;
unchanged things add up at one pose.

The idea of a matched filter for places is that of Joseph, Fischer and
Milford (arXiv 2409.03998), which uses one map of occupied cells; layers, poles
and kerbs, and bits instead of a Fourier transform, are our ideas.
"""

from __future__ import annotations

from collections.abc import Sequence
import math

import numpy as np
from pydantic import (
    NonNegativeInt,
    PositiveFloat,
    PositiveInt,
)

from cns_drake.base.poses import make_pose
from evaluation.methods.method import Method, MethodConfig, register
from evaluation.methods.overlap_bits import fine_bits, turns
from evaluation.methods.overlap_coarse import (
    NUM_HEADINGS,
    LayeredDatabase,
    LayeredScan,
    build_database,
    search_coarse,
)
from evaluation.methods.overlap_layers import layer_cells
from evaluation.methods.overlap_search import climb

# The last: whole cells; steps of 2.5 deg and 1 m, then of half of that.
_LAST_TURNS = turns(288)
_LAST_STEPS = np.array([[2, 4], [1, 2]])
_TO_LAST = np.array([1, 2, 8, 8])


class LayeredOverlapConfig(MethodConfig):
    """Parameters of layered overlap.

    Source of all: trials on development worlds, which are not the worlds of
    the reported results.

    Attributes:
        cell: length of a cell of the finest maps, of 256 x 256 [m].
        min_points: points that fill a cell.
        poses: pairs of a place and a heading that the second search compares.
        refined: those of them that the third search compares.
        candidates: places that are compared cell by cell.
        weights: weights of common cells: low, middle, high, poles, kerbs.
        least_cells: weighted cells added to those of either scan, so that two
            nearly empty scans are not alike.
    """

    cell: PositiveFloat = 0.5
    min_points: PositiveInt = 1
    poses: PositiveInt = 8000
    refined: PositiveInt = 250
    candidates: PositiveInt = 40
    weights: tuple[
        NonNegativeInt,
        NonNegativeInt,
        NonNegativeInt,
        NonNegativeInt,
        NonNegativeInt,
    ] = (3, 3, 2, 60, 5)
    least_cells: NonNegativeInt = 150


@register("layered-overlap")
class LayeredOverlap(Method[LayeredScan, LayeredDatabase]):
    """Layered overlap, in four searches from coarse to fine.

    The first three take the pose at which most bits coincide, and rank places
    by the number of standard deviations above chance. The last one climbs from
    there, cell by cell. The score is the weighted number of the query's cells
    that meet one of the place or a neighbour of one, over the geometric mean of
    both scans' numbers.

    The first of equal counts wins. All counts are integers, so that scores are
    the same on every processor.
    """

    Config = LayeredOverlapConfig
    config: LayeredOverlapConfig

    def describe(self, points: np.ndarray) -> LayeredScan:
        config = self.config
        return LayeredScan(
            *layer_cells(
                points, config.sensor_height, config.cell, config.min_points
            )
        )

    def build_database(self, places: Sequence[LayeredScan]) -> LayeredDatabase:
        return build_database(places)

    def score(
        self,
        query: LayeredScan,
        database: LayeredDatabase,
        *,
        exhaustive: bool = False,
    ) -> np.ndarray:
        scores = np.full(len(database.places), np.nan)
        if len(query.cells) == 0:
            return scores
        config = self.config
        poses = self._search(
            query, database, config.poses, config.refined, exhaustive
        )
        if not exhaustive:
            poses = poses[: config.candidates]
        for pose in poses:
            place = database.places[pose[0]]
            if len(place.cells) > 0:
                found = self._climb(query, place, pose[1:])
                scores[pose[0]] = self._rate(query, place, found)
        return scores

    def relative_pose(
        self, query: LayeredScan, database: LayeredDatabase, place: int
    ) -> np.ndarray | None:
        """Returns turn and horizontal translation of the query.

        None if one of the two shows nothing.
        """
        return self.relative_poses(query, database, [place])[0]

    def relative_poses(
        self,
        query: LayeredScan,
        database: LayeredDatabase,
        places: Sequence[int],
    ) -> list[np.ndarray | None]:
        scans = [database.places[place] for place in places]
        poses: list[np.ndarray | None] = [None] * len(scans)
        if len(query.cells) == 0 or len(scans) == 0:
            return poses
        # Every place with every heading is refined.
        every = len(scans) * NUM_HEADINGS
        some = self.build_database(scans)
        for start in self._search(query, some, every, every):
            scan = scans[start[0]]
            if len(scan.cells) > 0:
                found = self._climb(query, scan, start[1:])
                poses[start[0]] = self._to_pose(found)
        return poses

    def _to_pose(self, found: np.ndarray) -> np.ndarray:
        """Returns X_PQ (4, 4) of the pose in a result of `climb`."""
        c, s = _LAST_TURNS[found[0]] / _LAST_TURNS[0, 0]
        R_PQ = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
        half_cell = 0.5 * self.config.cell
        return make_pose(
            R_PQ, np.array([found[1] * half_cell, found[2] * half_cell, 0.0])
        )

    def _search(
        self,
        query: LayeredScan,
        database: LayeredDatabase,
        poses: int,
        refined: int,
        exhaustive: bool = False,
    ) -> np.ndarray:
        """Returns (N, 4) places, each with heading and shifts to climb from."""
        found = search_coarse(query, database, poses, refined, exhaustive)
        return found * _TO_LAST

    def _climb(
        self, query: LayeredScan, place: LayeredScan, start: np.ndarray
    ) -> np.ndarray:
        """Returns pose and common cells of two scans, see `climb`."""
        return climb(
            query.cells,
            query.starts,
            fine_bits(place.cells, place.starts),
            np.array(self.config.weights),
            _LAST_TURNS,
            start,
            _LAST_STEPS,
        )

    def _rate(
        self, query: LayeredScan, place: LayeredScan, found: np.ndarray
    ) -> float:
        """Returns the score of two scans at the pose that was found."""
        config = self.config
        weights = np.array(config.weights)
        common = int(weights @ found[3:])
        of_query = int(weights @ np.diff(query.starts)) + config.least_cells
        of_place = int(weights @ np.diff(place.starts)) + config.least_cells
        if of_query == 0 or of_place == 0:
            return 0.0
        return common / math.sqrt(of_query * of_place)
