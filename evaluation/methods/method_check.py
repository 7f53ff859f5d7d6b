"""Public checks of methods, as scikit-learn has for estimators."""

from collections.abc import Callable, Mapping, Sequence
import dataclasses
import pickle
from typing import Any

import numpy as np

from evaluation.base import InputError, did_you_mean, errors_at, note, read_only
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
    """Checks that a method keeps the interface `Method`, by `method_checks`.

    Args:
        method: the method, with the settings to check.

    Raises:
        InputError: the method breaks the interface. The error says in one line
            what is wrong. If all is well, a note says so.

    Example:
        from evaluation import check_method, make_method

        check_method(make_method("solid", {}))
    """
    for check in method_checks:
        check(method)
    note(f"{method.name}: {len(method_checks)} checks passed")


def check_attributes(method: Method) -> None:
    """The method has a name, possible attributes, and a `Config` as config."""
    if not isinstance(method, Method):
        raise InputError(f"{method!r} is no Method (an object, not a class)")
    name = _name(method)
    if not (isinstance(name, str) and name.strip()):
        raise _fault(method, "name: missing; use the decorator register")
    with errors_at(name):
        check_class(type(method))
    known = (*_FIELDS, *_RARE_FIELDS)
    for field in method.point_fields:
        # Drives of your own can have fields of their own.
        if field not in known and (near := did_you_mean(field, known)):
            raise _fault(
                method, f"point_fields: no recording has {field!r}{near}"
            )
    if not isinstance(method.config, method.Config):
        raise _fault(method, "config: no object of the class Config")


def check_descriptors(method: Method) -> None:
    """Descriptors can be stored, and describing a cloud does not change it."""
    for of_place in (True, False):
        _describe(method, _cloud(method, 0), of_place=of_place)


def check_scores(method: Method) -> None:
    """Scores are finite numbers, one for each place, or NaN if that may be."""
    _, queries, database = _described(method)
    for query in queries:
        _scores(method, query, database, _NUM_PLACES)
        found = _call(
            method, "score_in_drive", [query], database, exhaustive=True
        )
        checked_scores(method, "score_in_drive", found, _NUM_PLACES)


def check_differences(method: Method) -> None:
    """Scores tell places apart, at least for one query."""
    _, queries, database = _described(method)
    is_constant = False
    for query in queries:
        scores = _scores(method, query, database, _NUM_PLACES)
        scores = scores[np.isfinite(scores)]
        if len(np.unique(scores)) > 1:
            return
        is_constant |= len(scores) > 1
    if is_constant:
        raise _fault(
            method,
            "score: every place has the same score, whatever the query is",
        )


def check_repetition(method: Method) -> None:
    """The same clouds have the same scores, however often they are compared."""
    _, queries, database = _described(method)
    _, queries_again, again = _described(method)
    for query, query_again in zip(queries, queries_again, strict=True):
        first, second = (
            _scores(method, query, database, _NUM_PLACES) for _ in range(2)
        )
        if not np.array_equal(first, second, equal_nan=True):
            raise _fault(
                method,
                "score: two calls with the same input return different scores",
            )
        third = _scores(method, query_again, again, _NUM_PLACES)
        if not np.array_equal(third, first, equal_nan=True):
            raise _fault(
                method,
                "describe: the same clouds, described twice, have different"
                " scores; give random numbers a fixed seed",
            )


def check_own_score(method: Method) -> None:
    """No cloud fits another cloud better than itself."""
    _, queries, database = _described(method)
    for number, query in enumerate(queries):
        scores = _scores(method, query, database, _NUM_PLACES)
        own = scores[number]
        if not np.isnan(own) and own < np.nanmax(scores):
            raise _fault(
                method,
                f"score: a cloud fits itself ({own:g}) less than another cloud"
                f" ({np.nanmax(scores):g}); a higher score must mean more"
                " similar",
            )


def check_poses(method: Method) -> None:
    """Relative poses are rigid, or None."""
    _, queries, database = _described(method)
    for query in queries:
        _check_poses(method, query, database)


def check_kept_descriptors(method: Method) -> None:
    """No descriptor is changed after it was described."""
    places, queries, database = _described(method)
    as_described = _copied((places, queries))
    for query in queries:
        _scores(method, query, database, _NUM_PLACES)
        _call(method, "score_in_drive", [query], database, exhaustive=True)
        _check_poses(method, query, database)
    if not _is_equal(_copied((places, queries)), as_described):
        raise _fault(
            method,
            "a descriptor was changed after it was described; of a long"
            " drive, it is read again from a file",
        )


def check_pickles(method: Method) -> None:
    """Descriptors and settings survive pickling, for worker processes."""
    places, (query, *_), database = _described(method)
    try:
        copies = pickle.loads(pickle.dumps((query, places, method.config)))
    except Exception as error:
        raise _fault(
            method,
            "a descriptor or the settings cannot be pickled for worker"
            f" processes: {type(error).__name__}: {error}",
        ) from error
    before = _scores(method, query, database, _NUM_PLACES)
    copied = _call(method, "build_database", copies[1])
    after = _scores(method, copies[0], copied, _NUM_PLACES)
    if not np.array_equal(before, after, equal_nan=True):
        raise _fault(method, "descriptors have other scores after pickling")


def check_batches(method: Method) -> None:
    """A batch of clouds is described as its clouds are one by one."""
    _, queries, database = _described(method)
    some = [read_only(cloud) for cloud in _clouds(method)]
    for of_places in (False, True):
        found = _call(method, "describe_batch", some, of_places=of_places)
        check_number(method, "describe_batch", found, len(some))
        if of_places:
            continue
        for one, query in zip(found, queries, strict=True):
            alone = _scores(method, query, database, _NUM_PLACES)
            scores = _scores(method, one, database, _NUM_PLACES)
            if not np.allclose(scores, alone, rtol=1e-4, equal_nan=True):
                raise _fault(
                    method,
                    "describe_batch describes a cloud in another way than"
                    " describe",
                )


def check_parts(method: Method) -> None:
    """A database that `divides` has the same scores part by part."""
    if not method.divides:
        return
    places, (query, *_), database = _described(method)
    whole = _scores(method, query, database, len(places))
    parts = [
        _scores(method, query, _call(method, "build_database", some), len(some))
        for some in (places[:2], places[2:])
    ]
    if not np.allclose(np.concatenate(parts), whole, equal_nan=True):
        raise _fault(
            method,
            "divides: the scores in parts of a database differ from those"
            " in the whole database",
        )


def check_rerank(method: Method) -> None:
    """A second stage returns a score for each place that it compares."""
    number = min(method.rerank_best, _NUM_PLACES)
    if not number:
        return
    _, (described, *_), database = _described(method)
    scores = _scores(method, described, database, _NUM_PLACES)
    best = np.argsort(-scores, kind="stable")[:number]
    query, *_ = clouds = [read_only(cloud) for cloud in _clouds(method)]
    places = [clouds[place] for place in best]
    found = _call(method, "rerank", query, places, scores[best])
    checked_scores(method, "rerank", found, number)


def check_few_points(method: Method) -> None:
    """Scans with no or few points, as real drives have, are allowed."""
    _, (whole, *_), database = _described(method)
    for number in (0, 1, 5):
        cloud = _cloud(method, 0, number)
        query = _describe(method, cloud, of_place=False)
        _scores(method, query, database, _NUM_PLACES)
        _check_poses(method, query, database)
        place = _describe(method, cloud, of_place=True)
        few = _call(method, "build_database", [place])
        _scores(method, whole, few, 1)
        _scores(method, query, few, 1)


# What `check_method` checks, for `pytest.mark.parametrize`: functions of a
# method, each of which raises an InputError.
method_checks: list[Callable[[Method], None]] = [
    check_attributes,
    check_descriptors,
    check_scores,
    check_differences,
    check_repetition,
    check_own_score,
    check_poses,
    check_kept_descriptors,
    check_pickles,
    check_batches,
    check_parts,
    check_rerank,
    check_few_points,
]


def _name(method: Method) -> Any:
    return getattr(type(method), "name", "")


def _fault(method: Method, text: str) -> InputError:
    return InputError(f"{_name(method)}: {text}")


def _call(
    method: Method, function: str, *arguments: Any, **options: Any
) -> Any:
    call: Callable = getattr(method, function)
    try:
        return call(*arguments, **options)
    except InputError:
        raise
    # A SystemExit would end the program of the caller.
    except (Exception, SystemExit) as error:
        advice = ""
        if "read-only" in str(error):
            advice = " (a cloud is shared: change a copy of it)"
        raise _fault(
            method,
            f"{function} raised {type(error).__name__}: {error}{advice}",
        ) from error


def _cloud(method: Method, seed: int, number: int | None = None) -> np.ndarray:
    """Returns a cloud, as a method gets it.

    Args:
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
    # Clouds differ in their number of points, as scans do.
    ground = rng.uniform(-_REACH, _REACH, (_NUM_GROUND + 10 * seed, 3))
    ground[:, 2] = 0.0
    points = np.concatenate([boxes.reshape(-1, 3), ground])
    points[:, 2] -= method.config.sensor_height
    points = points[rng.permutation(len(points))][:number]
    names = method.point_fields
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
    for name in names:  # Small whole numbers are a ring and a class, too.
        cloud[name] = rng.integers(0, 8, len(points))
    return cloud


def _clouds(method: Method) -> list[np.ndarray]:
    return [_cloud(method, seed) for seed in range(_NUM_PLACES)]


def _described(method: Method) -> tuple[list[Any], list[Any], Any]:
    """Returns clouds as described places and queries, and their database."""
    clouds = _clouds(method)
    places, queries = (
        [_describe(method, cloud, of_place=kind) for cloud in clouds]
        for kind in (True, False)
    )
    return places, queries, _call(method, "build_database", places)


def _describe(method: Method, cloud: np.ndarray, *, of_place: bool) -> Any:
    function = "describe_place" if of_place else "describe"
    given = read_only(cloud.copy())
    found = _call(method, function, given)
    if not np.array_equal(given, cloud):
        raise _fault(method, f"{function} changes the points")
    if fault := _not_plain(found):
        raise _fault(
            method,
            f"{function} returned {fault}, which cannot be stored (numbers,"
            " texts and arrays, or lists, tuples, dicts and dataclasses of"
            " them)",
        )
    return found


def _scores(
    method: Method, query: Any, database: Any, number: int
) -> np.ndarray:
    """Returns the scores of a query, after checking their form."""
    found = _call(method, "score", query, database, exhaustive=True)
    scores = checked_scores(method, "score", found, number)
    if np.isnan(scores).any() and not method.skips_places:
        raise _fault(method, "score returned NaN, but skips_places is not set")
    return scores


def _check_poses(method: Method, query: Any, database: Any) -> None:
    places = list(range(_NUM_PLACES))
    found = _call(method, "relative_poses", query, database, places)
    check_number(method, "relative_poses", found, _NUM_PLACES)
    for X_PQ in found:
        checked_pose(method, X_PQ)


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
