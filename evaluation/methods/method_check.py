"""A public check of methods, as Gymnasium has for environments."""

from collections.abc import Callable, Mapping, Sequence
import dataclasses
import pickle
from typing import Any

import numpy as np

from cns_drake.base import InputError, did_you_mean, errors_at, read_only
from evaluation.methods.method import (
    Method,
    check_class,
    check_number,
    checked_pose,
    checked_scores,
)

# Clouds of the check: boxes on a level ground, as walls along streets.
_NUM_PLACES = 5
_NUM_BOXES = 40
_POINTS_PER_BOX = 150
_NUM_GROUND = 2500
_REACH = 60.0
# Types of the usual fields of points.
_FIELDS = {
    "intensity": np.float32,
    "ring": np.uint16,
    "t": np.uint32,
    "label": np.uint16,
    "instance": np.uint16,
}
# Further fields that recordings of some LiDARs have.
_RARE_FIELDS = ("ambient", "laser", "line", "range", "reflectivity", "velocity")
_PLAIN = (bool, int, float, complex, str, bytes, np.generic, type(None))


def check_method(method: Method) -> None:
    """Checks that a method keeps the interface `Method`.

    The check describes made-up clouds, also empty ones, and compares them: all
    results must have the right type, shape and number, be finite, be the same
    for the same input, and survive pickling, which worker processes need. The
    input must not be changed, and no descriptor once it has been described;
    scores must tell places apart, and a cloud must not fit another cloud better
    than itself.

    Args:
        method: the method, with the settings to check.

    Raises:
        InputError: the method breaks the interface. The error says in one line
            what is wrong.

    Example:
        from evaluation import check_method, make_method

        check_method(make_method("solid", {}))
    """
    if not isinstance(method, Method):
        raise InputError(f"{method!r} is no Method (an object, not a class)")
    _Check(method).run()


class _Check:
    """The steps of `check_method` for one method."""

    def __init__(self, method: Method):
        self._method = method
        self._name = getattr(type(method), "name", "")
        self._clouds: list[np.ndarray] = []

    def run(self) -> None:
        self._check_attributes()
        self._clouds = [self._cloud(seed) for seed in range(_NUM_PLACES)]
        places, queries = self._described()
        as_described = _copied((places, queries))
        database = self._call("build_database", places)
        self._check_differences(queries, database)
        places_again, queries_again = self._described()
        again = self._call("build_database", places_again)
        for number, query in enumerate(queries):
            scores = self._scores(query, database, _NUM_PLACES)
            if not np.array_equal(
                self._scores(queries_again[number], again, _NUM_PLACES),
                scores,
                equal_nan=True,
            ):
                raise self._fault(
                    "describe: the same clouds, described twice, have different"
                    " scores; give random numbers a fixed seed"
                )
            self._check_own_score(scores, number)
            self._check_poses(query, database)
        if not _is_equal(_copied((places, queries)), as_described):
            raise self._fault(
                "a descriptor was changed after it was described; of a long"
                " drive, it is read again from a file"
            )
        self._check_pickles(queries[0], places)
        self._check_batches(queries, database)
        self._check_parts(queries[0], database, places)
        self._check_rerank(self._scores(queries[0], database, _NUM_PLACES))
        self._check_few_points(database)

    def _described(self) -> tuple[list[Any], list[Any]]:
        """Returns the clouds' descriptors as places, and as queries."""
        places, queries = (
            [self._describe(cloud, of_place=kind) for cloud in self._clouds]
            for kind in (True, False)
        )
        return places, queries

    def _fault(self, text: str) -> InputError:
        return InputError(f"{self._name}: {text}")

    def _call(self, function: str, *arguments: Any, **options: Any) -> Any:
        """Returns what a function of the method returns."""
        call: Callable = getattr(self._method, function)
        try:
            return call(*arguments, **options)
        except InputError:
            raise
        # A SystemExit would end the program of the caller.
        except (Exception, SystemExit) as error:
            advice = ""
            if "read-only" in str(error):
                advice = " (a cloud is shared: change a copy of it)"
            raise self._fault(
                f"{function} raised {type(error).__name__}: {error}{advice}"
            ) from error

    def _check_attributes(self) -> None:
        method = self._method
        if not (isinstance(self._name, str) and self._name.strip()):
            raise self._fault("name: missing; use the decorator register")
        with errors_at(self._name):
            check_class(type(method))
        known = (*_FIELDS, *_RARE_FIELDS)
        for field in method.point_fields:
            # Drives of your own can have fields of their own.
            if field not in known and (near := did_you_mean(field, known)):
                raise self._fault(
                    f"point_fields: no recording has {field!r}{near}"
                )
        if not isinstance(method.config, method.Config):
            raise self._fault("config: no object of the class Config")

    def _cloud(self, seed: int, number: int | None = None) -> np.ndarray:
        """Returns a cloud, as a method gets it.

        Args:
            seed: seed of the cloud.
            number: how many of its points are returned; by default all.
        """
        rng = np.random.default_rng([seed, 17])
        foot = rng.uniform(-_REACH, _REACH, (_NUM_BOXES, 1, 2))
        size = rng.uniform([1.0, 1.0, 2.0], [8.0, 8.0, 20.0], (_NUM_BOXES, 3))
        inside = rng.uniform(size=(_NUM_BOXES, _POINTS_PER_BOX, 3))
        # Points of a box lie on its four walls.
        wall = rng.integers(0, 4, (_NUM_BOXES, _POINTS_PER_BOX))
        inside[..., 0] = np.where(wall < 2, wall, inside[..., 0])
        inside[..., 1] = np.where(wall >= 2, wall - 2, inside[..., 1])
        boxes = inside * size[:, None]
        boxes[..., :2] += foot
        ground = rng.uniform(-_REACH, _REACH, (_NUM_GROUND, 3))
        ground[:, 2] = 0.0
        points = np.concatenate([boxes.reshape(-1, 3), ground])
        points[:, 2] -= self._method.config.sensor_height
        points = points[rng.permutation(len(points))][:number]
        names = self._method.point_fields
        if not names:
            return points
        cloud = np.zeros(
            len(points),
            [
                *((axis, np.float64) for axis in "xyz"),
                *((name, _FIELDS.get(name, np.float32)) for name in names),
            ],
        )
        for axis, values in zip("xyz", points.T, strict=True):
            cloud[axis] = values
        return cloud

    def _describe(self, cloud: np.ndarray, *, of_place: bool) -> Any:
        function = "describe_place" if of_place else "describe"
        given = read_only(cloud.copy())
        found = self._call(function, given)
        if not np.array_equal(given, cloud):
            raise self._fault(f"{function} changes the points")
        if fault := _not_plain(found):
            raise self._fault(
                f"{function} returned {fault}, which cannot be stored (numbers,"
                " texts and arrays, or lists, tuples, dicts and dataclasses of"
                " them)"
            )
        return found

    def _scores(self, query: Any, database: Any, number: int) -> np.ndarray:
        """Returns the scores of a query, after checking them."""
        first, second = (
            checked_scores(
                self._method,
                "score",
                self._call("score", query, database, exhaustive=True),
                number,
            )
            for _ in range(2)
        )
        if not np.array_equal(first, second, equal_nan=True):
            raise self._fault(
                "score: two calls with the same input return different scores"
            )
        if np.isnan(first).any() and not self._method.skips_places:
            raise self._fault("score returned NaN, but skips_places is not set")
        found = self._call("score_in_drive", [query], database, exhaustive=True)
        checked_scores(self._method, "score_in_drive", found, number)
        return first

    def _check_differences(self, queries: list[Any], database: Any) -> None:
        """Checks that scores tell places apart, at least for one query."""
        is_constant = False
        for query in queries:
            scores = self._scores(query, database, _NUM_PLACES)
            scores = scores[np.isfinite(scores)]
            if len(np.unique(scores)) > 1:
                return
            is_constant |= len(scores) > 1
        if is_constant:
            raise self._fault(
                "score: every place has the same score, whatever the query is"
            )

    def _check_own_score(self, scores: np.ndarray, number: int) -> None:
        own = scores[number]
        if not np.isnan(own) and own < np.nanmax(scores):
            raise self._fault(
                f"score: a cloud fits itself ({own:g}) less than another cloud"
                f" ({np.nanmax(scores):g}); a higher score must mean more"
                " similar"
            )

    def _check_poses(self, query: Any, database: Any) -> None:
        places = range(_NUM_PLACES)
        found = self._call("relative_poses", query, database, list(places))
        check_number(self._method, "relative_poses", found, _NUM_PLACES)
        for X_PQ in found:
            checked_pose(self._method, X_PQ)

    def _check_pickles(self, query: Any, places: list[Any]) -> None:
        """Worker processes get descriptors and settings in pickles."""
        try:
            copies = pickle.loads(
                pickle.dumps((query, places, self._method.config))
            )
        except Exception as error:
            raise self._fault(
                "a descriptor or the settings cannot be pickled for worker"
                f" processes: {type(error).__name__}: {error}"
            ) from error
        before = self._scores(
            query, self._call("build_database", places), len(places)
        )
        after = self._scores(
            copies[0], self._call("build_database", copies[1]), len(places)
        )
        if not np.array_equal(before, after, equal_nan=True):
            raise self._fault("descriptors have other scores after pickling")

    def _check_batches(self, queries: list[Any], database: Any) -> None:
        some = [read_only(cloud.copy()) for cloud in self._clouds]
        for of_places in (False, True):
            found = self._call("describe_batch", some, of_places=of_places)
            check_number(self._method, "describe_batch", found, len(some))
            if of_places:
                continue
            for one, query in zip(found, queries, strict=True):
                alone = self._scores(query, database, _NUM_PLACES)
                scores = self._scores(one, database, _NUM_PLACES)
                if not np.allclose(scores, alone, rtol=1e-4, equal_nan=True):
                    raise self._fault(
                        "describe_batch describes a cloud in another way than"
                        " describe"
                    )

    def _check_parts(
        self, query: Any, database: Any, places: list[Any]
    ) -> None:
        if not self._method.divides:
            return
        whole = self._scores(query, database, len(places))
        parts = [
            self._scores(query, self._call("build_database", some), len(some))
            for some in (places[:2], places[2:])
        ]
        if not np.allclose(np.concatenate(parts), whole, equal_nan=True):
            raise self._fault(
                "divides: the scores in parts of a database differ from those"
                " in the whole database"
            )

    def _check_rerank(self, scores: np.ndarray) -> None:
        number = min(self._method.rerank_best, _NUM_PLACES)
        if not number:
            return
        best = np.argsort(-scores)[:number]
        clouds = [read_only(self._clouds[place].copy()) for place in best]
        query = read_only(self._clouds[0].copy())
        found = self._call("rerank", query, clouds, scores[best])
        checked_scores(self._method, "rerank", found, number)

    def _check_few_points(self, database: Any) -> None:
        """Scans of real drives can be empty."""
        for number in (0, 1, 5):
            cloud = self._cloud(0, number)
            query = self._describe(cloud, of_place=False)
            self._scores(query, database, _NUM_PLACES)
            self._check_poses(query, database)
            place = self._describe(cloud, of_place=True)
            few = self._call("build_database", [place])
            whole = self._describe(self._clouds[0], of_place=False)
            self._scores(whole, few, 1)
            self._scores(query, few, 1)


def _not_plain(value: Any) -> str:
    """Returns the type of a part that cannot be stored; "" if there is none."""
    if isinstance(value, _PLAIN):
        return ""
    if isinstance(value, np.ndarray):
        return "an array of objects" if value.dtype.hasobject else ""
    parts: Sequence[Any]
    if isinstance(value, Mapping):
        parts = [*value, *value.values()]
    elif isinstance(value, list | tuple):
        parts = value
    elif dataclasses.is_dataclass(value) and not isinstance(value, type):
        parts = [getattr(value, one.name) for one in dataclasses.fields(value)]
    else:
        return f"an object of the type {type(value).__name__}"
    return next(filter(None, map(_not_plain, parts)), "")


def _copied(value: Any) -> Any:
    """Returns a copy of a plain value; see `_not_plain`."""
    if isinstance(value, np.ndarray):
        return value.copy()
    if dataclasses.is_dataclass(value):
        names = [one.name for one in dataclasses.fields(value)]
        return {name: _copied(getattr(value, name)) for name in names}
    if isinstance(value, Mapping):
        return {key: _copied(one) for key, one in value.items()}
    if isinstance(value, list | tuple):
        return [_copied(one) for one in value]
    return value


def _is_equal(one: Any, other: Any) -> bool:
    """Returns whether two results of `_copied` are equal, bit for bit."""
    if type(one) is not type(other):
        return False
    if isinstance(one, np.ndarray):
        kinds = [(array.dtype, array.shape) for array in (one, other)]
        return kinds[0] == kinds[1] and one.tobytes() == other.tobytes()
    if isinstance(one, dict):
        return one.keys() == other.keys() and all(
            _is_equal(value, other[key]) for key, value in one.items()
        )
    if isinstance(one, list):
        return len(one) == len(other) and all(map(_is_equal, one, other))
    # A NaN does not equal itself.
    return one is other or bool(one == other)
