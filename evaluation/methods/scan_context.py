"""Scan Context++ (Kim, Choi, Kim: T-RO 2022).

A scan becomes a small image of heights around the sensor: over range and
azimuth (polar context) or along and across the road (cart context). Two keys
are means of this image. The retrieval key finds candidates in a KD-tree; it
does not change with the heading (in a polar context) or with the lane offset
(in a cart context). The aligning key gives the shift of the columns at which
two images are compared.

The polar context of a place changes if the place is seen from the next lane.
The augmented variant therefore stores each place of the database three times:
as seen, and as if seen from 2 m to the left and to the right.

The defaults are from the authors' T-RO program. On the same downsampled scans,
scores agree with this program to 1e-15 for all variants except
`augmented-cart`, which the program lacks. With `variant: polar`,
`min_points: 1` and `far_points: dropped`, scores agree with the authors' C++
program to 3e-4, the precision of its heights. Deliberate differences:

- The voxels for downsampling start at the sensor. The T-RO program leaves their
  origin to MATLAB, and the C++ program leaves it to its caller.
- The sensor's height is a parameter, 1.6 m for CNS, instead of 1.9 or 2 m.
- A function of the T-RO program wrongly adds up the shifts that it tries; the
  code here follows a corrected copy of this function.
- A cell may hold more than 500 points.
- Two scans without a column in common have no score.
"""

from collections.abc import Sequence
from dataclasses import dataclass
import math
from typing import Annotated, Literal

import numpy as np
from pydantic import Field, PositiveFloat, PositiveInt
from scipy.spatial import cKDTree

from evaluation.base import poses
from evaluation.maps import downsample
from evaluation.methods.method import Method, MethodConfig
from evaluation.methods.registry import register

# Number of contexts compared at a time; it limits the memory of an exhaustive
# comparison.
_CONTEXTS_AT_ONCE = 512
# Variants whose contexts are polar; those of the others are Cartesian.
_POLAR_VARIANTS = ("polar", "augmented-polar")
# Augmented variant -> number of contexts of a place; others have one.
_NUM_CONTEXTS = {"augmented-polar": 3, "augmented-cart": 2}

Variant = Literal["polar", "augmented-polar", "cart", "augmented-cart"]


class ScanContextConfig(MethodConfig):
    """Settings of Scan Context++.

    Letters in brackets name the source of a value: [T] stands for the authors'
    program of their T-RO paper, [C] for their C++ program, [E] for their
    evaluation program.

    Attributes:
        variant: kind of context: polar or Cartesian (cart). The augmented kinds
            add copies of each place: `augmented-polar` two, as seen from
            `lateral_shift` to the left and to the right; `augmented-cart` one,
            as seen in the opposite direction. [T] calls the default A-PC.
        voxel_size: side of the voxels to which each cloud is first downsampled
            [m]; [T] 0.5.
        rings: number of rings of the polar context; [T], [C] 20.
        sectors: number of sectors of the polar context; [T], [C] 60.
        max_range: range up to which the polar context has rings [m]; [T], [C]
            80.
        far_points: whether points beyond `max_range` count in the last ring
            (`last-ring`), as in [T], or are left out (`dropped`), as in [C].
        min_points: least number of points in a filled cell of the polar
            context; [T] 5, [C] 1.
        cart_cell: length and width of a cell of the Cartesian context [m]; [T]
            5 and 2.
        cart_range: half the length and half the width of the Cartesian context
            [m]; [T] 100 and 40.
        lateral_shift: distance by which the variant `augmented-polar` shifts
            the copies of a place to each side [m]; [T] 2.
        candidates: number of contexts that the search in the KD-tree returns
            for each context of a place; [E] 50.
        search_ratio: share of all shifts of the context that are compared,
            around the shift that fits the aligning key best; [C] 0.1.
    """

    variant: Variant = "augmented-polar"
    voxel_size: PositiveFloat = 0.5
    rings: PositiveInt = 20
    sectors: PositiveInt = 60
    max_range: PositiveFloat = 80.0
    far_points: Literal["last-ring", "dropped"] = "last-ring"
    min_points: PositiveInt = 5
    cart_cell: tuple[PositiveFloat, PositiveFloat] = (5.0, 2.0)
    cart_range: tuple[PositiveFloat, PositiveFloat] = (100.0, 40.0)
    lateral_shift: PositiveFloat = 2.0
    candidates: PositiveInt = 50
    search_ratio: Annotated[float, Field(ge=0.0, le=1.0)] = 0.1


@dataclass(frozen=True)
class Contexts:
    """One or more contexts of one scan.

    Attributes:
        images: (K, rows, columns) heights above the ground [m], 0 where empty;
            K is 1, except for a place of an augmented `variant`, which has
            further contexts.
    """

    images: np.ndarray

    @property
    def retrieval_keys(self) -> np.ndarray:
        """(K, rows) row means; a shift of the columns does not change them."""
        return self.images.mean(axis=2)

    @property
    def aligning_keys(self) -> np.ndarray:
        """(K, columns) column means, which shift with the columns."""
        return self.images.mean(axis=1)


@dataclass(frozen=True)
class ContextDatabase:
    """All contexts of D places, in one array of M >= D.

    Attributes:
        columns: (M, rows, columns) the contexts, with each column scaled to
            unit length; a column without points is all zero.
        filled: (M, columns) float64, 1 where a column is not all zero.
        aligning_keys: (M, columns) column means of the contexts, from which
            the shift between two contexts is first guessed.
        places: (M,) place of each context.
        tree: search tree over the retrieval keys.
        num_places: D.
    """

    columns: np.ndarray
    filled: np.ndarray
    aligning_keys: np.ndarray
    places: np.ndarray
    tree: cKDTree
    num_places: int


@register("scan-context++")
class ScanContext(Method[Contexts, ContextDatabase]):
    """Scan Context++; the score of two scans is 1 minus their distance."""

    title = "Scan Context++"
    style = ("#009E73", "-.", "^")
    source = "Kim, Choi, Kim: T-RO 2022"
    standard = True
    order = 1
    Config = ScanContextConfig
    skips_places = True
    divides = True
    config: ScanContextConfig

    def describe(self, points: np.ndarray) -> Contexts:
        return Contexts(
            self._context(self._downsampled_above_ground(points))[None]
        )

    def describe_place(self, points: np.ndarray) -> Contexts:
        prepared = self._downsampled_above_ground(points)
        images = [self._context(prepared)]
        if self.config.variant == "augmented-polar":
            for shift in (
                -self.config.lateral_shift,
                self.config.lateral_shift,
            ):
                images.append(self._context(prepared - [0.0, shift, 0.0]))
        if self.config.variant == "augmented-cart":
            # The view of a car in the opposite direction.
            images.append(self._context(prepared * [-1.0, -1.0, 1.0]))
        return Contexts(np.stack(images))

    def build_database(self, places: Sequence[Contexts]) -> ContextDatabase:
        images = np.concatenate([place.images for place in places])
        contexts = Contexts(images)
        columns, filled = _unit_columns(images)
        return ContextDatabase(
            columns=columns,
            filled=filled,
            aligning_keys=contexts.aligning_keys,
            places=np.repeat(
                np.arange(len(places)), [len(place.images) for place in places]
            ),
            tree=cKDTree(contexts.retrieval_keys),
            num_places=len(places),
        )

    def score(
        self,
        query: Contexts,
        database: ContextDatabase,
        *,
        exhaustive: bool = False,
    ) -> np.ndarray:
        if exhaustive:
            chosen = np.arange(len(database.places))
        else:
            chosen = self._nearest(query, database)[0]
        return self._score(query, database, chosen)

    @property
    def num_shortlisted(self) -> int:
        number = _NUM_CONTEXTS.get(self.config.variant, 1)
        return self.config.candidates * number

    def shortlist(
        self, query: Contexts, database: ContextDatabase
    ) -> np.ndarray:
        return -self._nearest(query, database)[1]

    def score_best(
        self, query: Contexts, database: ContextDatabase, number: int
    ) -> np.ndarray:
        chosen, _ = self._nearest(query, database)
        return self._score(query, database, chosen[:number])

    def _nearest(
        self, query: Contexts, database: ContextDatabase
    ) -> tuple[np.ndarray, np.ndarray]:
        """Returns the contexts whose retrieval keys are nearest to a query's.

        If several contexts are equally near, any of them may be found.

        Returns:
            (C,) indices of contexts, the nearest first; (C,) their distances.
        """
        number = min(self.num_shortlisted, len(database.places))
        distances, found = database.tree.query(
            query.retrieval_keys[0], k=np.arange(1, number + 1)
        )
        return found, distances

    def _score(
        self, query: Contexts, database: ContextDatabase, chosen: np.ndarray
    ) -> np.ndarray:
        """Returns the scores (D,) by some contexts only.

        Args:
            query: the context of the query.
            database: contexts of the places.
            chosen: (C,) indices of the contexts that are compared.
        """
        chosen = np.sort(chosen)
        scores = np.full(database.num_places, np.nan)
        for start in range(0, len(chosen), _CONTEXTS_AT_ONCE):
            batch = chosen[start : start + _CONTEXTS_AT_ONCE]
            similarities, _ = self._best_similarities(query, database, batch)
            # fmax takes the best context of a place, and NaN only if all are
            # NaN.
            np.fmax.at(scores, database.places[batch], similarities)
        return scores

    def relative_pose(
        self, query: Contexts, database: ContextDatabase, place: int
    ) -> np.ndarray | None:
        """Returns a rough pose X_PQ (4, 4) of a query in the frame of a place.

        Polar contexts give the heading; the lateral offset is zero, or the
        offset of the augmented copy that fits best. Cartesian contexts give the
        lateral offset; the heading is zero, or 180 deg if the augmented copy
        fits best. The result is None if no column is filled in both contexts.
        """
        chosen = np.flatnonzero(database.places == place)
        similarities, shifts = self._best_similarities(query, database, chosen)
        if np.isnan(similarities).all():
            return None
        best = int(np.nanargmax(similarities))
        num_columns = query.images.shape[2]
        shift = int(shifts[best])
        if self.config.variant in _POLAR_VARIANTS:
            # Shift s maps the place's context to the query's: what the place
            # sees at azimuth a, the query sees at a + s cells.
            side = (0.0, -1.0, 1.0)[best]
            return poses.yaw_pose(
                -2.0 * math.pi * shift / num_columns,
                y=side * self.config.lateral_shift,
            )
        # Half of the shifts are negative: 0, 1, ..., -2, -1.
        signed = (shift + num_columns // 2) % num_columns - num_columns // 2
        # The second context is the view of a car in the opposite direction.
        sign = 1.0 if best > 0 else -1.0
        X_PQ = np.diag([-sign, -sign, 1.0, 1.0])
        X_PQ[1, 3] = sign * signed * self.config.cart_cell[1]
        return X_PQ

    def _downsampled_above_ground(self, points: np.ndarray) -> np.ndarray:
        """Returns the downsampled points, with z from the ground."""
        lift = [0.0, 0.0, self.config.sensor_height]
        return downsample(points, self.config.voxel_size) + lift

    def _context(self, points: np.ndarray) -> np.ndarray:
        """Returns the context (rows, columns) of points (N, 3)."""
        if self.config.variant in _POLAR_VARIANTS:
            return _polar_context(points, self.config)
        return _cart_context(points, self.config)

    def _best_similarities(
        self, query: Contexts, database: ContextDatabase, chosen: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray]:
        """Compares a query with some contexts of a database.

        For a shift s of a context's columns, the similarity is the mean cosine
        between column j of the query and column j - s of the context, over
        columns that are filled in both. Only shifts near the shift at which the
        aligning keys fit best are tried.

        Args:
            query: the context of the query.
            database: contexts of the places.
            chosen: (C,) indices of contexts.

        Returns:
            (C,) best similarity, NaN without a common column; (C,) the shift at
            which it occurs.
        """
        num_columns = query.images.shape[2]
        columns, filled = _unit_columns(query.images)
        shifts = self._tried_shifts(
            query.aligning_keys[0], database.aligning_keys[chosen]
        )
        cosines = columns[0].T @ database.columns[chosen]
        column = np.arange(num_columns)
        partner = (column - shifts[:, :, None]) % num_columns
        row = np.arange(len(chosen))[:, None, None]
        sums = cosines[row, column, partner].sum(axis=2)
        common = (
            filled[0][column] * database.filled[chosen][row, partner]
        ).sum(axis=2)
        with np.errstate(invalid="ignore"):
            similarities = np.where(common > 0, sums / common, -np.inf)
        best = similarities.argmax(axis=1)
        context = np.arange(len(chosen))
        highest = similarities[context, best]
        return (
            np.where(np.isfinite(highest), highest, np.nan),
            shifts[context, best],
        )

    def _tried_shifts(self, key: np.ndarray, others: np.ndarray) -> np.ndarray:
        """Returns the shifts (C, S) that are tried for some contexts.

        Args:
            key: (columns,) aligning key of the query.
            others: (C, columns) aligning keys of the contexts.
        """
        first = _key_shift(key, others)
        # A half is rounded up.
        half = math.floor(0.5 * self.config.search_ratio * len(key) + 0.5)
        window = np.arange(-half, half + 1)
        return (first[:, None] + window) % len(key)


def _polar_context(points: np.ndarray, config: ScanContextConfig) -> np.ndarray:
    """Returns the highest point of each ring (row) and sector (column)."""
    r = np.hypot(points[:, 0], points[:, 1])
    if config.far_points == "dropped":
        near = r <= config.max_range
        points, r = points[near], r[near]
    azimuth = np.arctan2(points[:, 1], points[:, 0]) % (2.0 * math.pi)
    ring = np.minimum(
        (r * (config.rings / config.max_range)).astype(np.int64),
        config.rings - 1,
    )
    # A sector includes its upper limit but not its lower one.
    sector = np.ceil(azimuth * (config.sectors / (2.0 * math.pi))) - 1
    sector = np.clip(sector, 0, config.sectors - 1).astype(np.int64)
    return _highest(
        points[:, 2],
        ring * config.sectors + sector,
        (config.rings, config.sectors),
        config.min_points,
        floor=-np.inf,
    )


def _cart_context(points: np.ndarray, config: ScanContextConfig) -> np.ndarray:
    """Returns the greatest height per cell: rows along x, columns along y.

    As in the T-RO program, cells are counted outwards from the axes. The cells
    around the axes are therefore twice as large as the other cells, and the
    first row and column stay empty. As in that program, too, points below the
    ground count as ground.
    """
    rows, columns = (
        2 * int(half / cell)
        for half, cell in zip(config.cart_range, config.cart_cell, strict=True)
    )
    shape = rows, columns
    plane = points[:, :2]
    kept = ((np.abs(plane) < config.cart_range) & (plane != 0.0)).all(axis=1)
    plane = plane[kept]
    outward = np.floor(np.abs(plane) / config.cart_cell)
    index = (np.sign(plane) * outward).astype(np.int64) + np.array(shape) // 2
    return _highest(
        points[kept, 2],
        index[:, 0] * shape[1] + index[:, 1],
        shape,
        min_points=1,
        floor=0.0,
    )


def _highest(
    heights: np.ndarray,
    cells: np.ndarray,
    shape: tuple[int, int],
    min_points: int,
    floor: float,
) -> np.ndarray:
    """Returns the greatest height in each cell [m].

    Args:
        heights: (N,) heights of points [m].
        cells: (N,) number of each point's cell, row by row.
        shape: numbers of rows and of columns.
        min_points: least number of points in a cell; with fewer, the result is
            0.
        floor: least result in all other cells [m].
    """
    size = shape[0] * shape[1]
    highest = np.full(size, floor)
    np.maximum.at(highest, cells, heights)
    enough = np.bincount(cells, minlength=size) >= max(min_points, 1)
    return np.where(enough, highest, 0.0).reshape(shape)


def _unit_columns(images: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Returns images with columns scaled to length 1, and filled columns.

    The second result is 1 for a filled column. An empty column stays 0 in the
    images, and its second result is 0.
    """
    norms = np.linalg.norm(images, axis=1)
    filled = norms > 0.0
    return (
        images / np.where(filled, norms, 1.0)[:, None, :],
        filled.astype(np.float64),
    )


def _key_shift(key: np.ndarray, others: np.ndarray) -> np.ndarray:
    """Returns the shift (C,) at which each of `others` fits `key` best.

    The shift is the s that minimises |key - roll(other, s)|, which also
    maximises the product of the two keys. Of several equal shifts, the lowest
    is returned.
    """
    column = np.arange(len(key))
    rolled = key[(column + column[:, None]) % len(key)]
    return (others @ rolled.T).argmax(axis=1)
