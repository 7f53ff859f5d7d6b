"""The public check of methods, on the shipped methods and on broken ones."""

import re
import sys

import numpy as np
import pytest

from evaluation import check_method, method_checks
from evaluation.base import InputError
from evaluation.methods import (
    METHODS,
    Method,
    MethodConfig,
    make_method,
    register,
    shipped_methods,
)


class Heights(Method):
    """Compares histograms of heights."""

    name = "heights"

    def describe(self, points):
        return np.histogram(points[:, 2], 40, (-3.0, 20.0))[0].astype(float)

    def build_database(self, places):
        return np.array(places)

    def score(self, query, database, *, exhaustive=False):
        return -np.abs(database - query).sum(axis=1)


@pytest.mark.parametrize("check", method_checks)
def test_a_correct_method_passes_each_check(check):
    """A check has a name, and says in one sentence what it checks."""
    check(Heights())
    assert check.__name__.startswith("check_")
    assert check.__doc__.endswith(".")
    assert ". " not in check.__doc__


def test_a_method_of_another_field_alone_passes():
    """Made-up points have values there that differ, as those of a radar."""

    def describe(self, points):
        ranges = np.hypot(points["x"], points["y"])
        return np.histogram(ranges, 20, (0.0, 80.0), weights=points["power"])[0]

    check_method(replaced(describe=describe, point_fields=("power",)))


@pytest.mark.slow
@pytest.mark.parametrize("name", [*shipped_methods(), "probe"])
def test_shipped_methods_pass(name):
    check_method(make_method(name, {}))


def test_styles_of_methods_differ():
    styles = [one.style for one in METHODS.values()]
    given = [style for style in styles if style]
    for parts in (given, [colour for colour, *_ in given]):
        assert len(set(parts)) == len(parts)


def replaced(**functions):
    return type("Broken", (Heights,), functions)()


def in_place(self, points):
    points -= 1.0
    return points[:, 2].max(initial=0.0)


def random(self, points):
    return np.random.default_rng().uniform(size=3)


calls = []


def drifting(self, query, database, *, exhaustive=False):
    calls.append(0)
    return -np.abs(database - query).sum(axis=1) - len(calls)


def of_whole(self, query, database, *, exhaustive=False):
    distance = np.abs(database - query).sum(axis=1)
    return -distance / max(distance.sum(), 1.0)


def counted(self, queries, database, *, exhaustive=False):
    queries[-1]["asked"] = queries[-1].get("asked", 0) + 1
    query = queries[-1]["heights"]
    return -np.abs(database - query).sum(axis=1)


IN_DICTIONARIES = {
    "describe": lambda self, points: {
        "heights": Heights.describe(self, points)
    },
    "build_database": lambda self, places: np.array(
        [place["heights"] for place in places]
    ),
    "score": lambda self, query, database, *, exhaustive=False: (
        -np.abs(database - query["heights"]).sum(axis=1)
    ),
}
FAULTS = {
    "a descriptor was changed": {**IN_DICTIONARIES, "score_in_drive": counted},
    "describe_place raised ValueError.*change a copy": {"describe": in_place},
    "described twice, have different": {"describe": random},
    "two calls with the same input": {"score": drifting},
    "higher score must mean": {
        "score": lambda self, query, database, *, exhaustive=False: np.abs(
            database - query
        ).sum(axis=1)
    },
    "score returned ndarray of shape": {
        "score": lambda self, query, database, *, exhaustive=False: np.zeros(2)
    },
    "every place has the same score": {
        "score": lambda self, query, database, *, exhaustive=False: np.ones(
            len(database)
        )
    },
    "infinite score": {
        "score": lambda self, query, database, *, exhaustive=False: np.full(
            len(database), np.inf
        )
    },
    "NaN, but skips_places": {
        "score": lambda self, query, database, *, exhaustive=False: np.full(
            len(database), np.nan
        )
    },
    "describe returned an object of the type set": {
        "describe": lambda self, points: {1, 2},
        "describe_place": Heights.describe,
    },
    "an array of objects": {
        "describe": lambda self, points: np.array([None, {}])
    },
    "raised ZeroDivisionError": {
        "describe": lambda self, points: (
            Heights.describe(self, points) if len(points) > 5 else 1 / 0
        )
    },
    "instead of .4, 4. floats or None": {
        "relative_pose": lambda self, query, database, place: np.eye(3)
    },
    "relative_pose returned no pose": {
        "relative_pose": lambda self, query, database, place: 2 * np.eye(4)
    },
    "relative_poses returned list of length 0": {
        "relative_poses": lambda self, query, database, places: []
    },
    "describe_batch returned list of length 1": {
        "describe_batch": lambda self, clouds, *, of_places: [0]
    },
    "describes a cloud in another way": {
        "describe_batch": lambda self, clouds, *, of_places: [
            self.describe(cloud) * 2 for cloud in clouds
        ]
    },
    "divides: the scores in parts": {"divides": True, "score": of_whole},
    "divides: a database that is searched": {"divides": True, "rerank_best": 2},
    "rerank returned": {
        "rerank_best": 2,
        "rerank": lambda self, query, places, scores: scores[:1],
    },
    "scans_per_place: 0": {"scans_per_place": 0},
    "batch_size: 1.5": {"batch_size": 1.5},
    "style: 'red'": {"style": "red"},
    "style: .*'wavy'": {"style": ("#FF0000", "wavy", "o")},
    "style: .*'sun'": {"style": ("#FF0000", "-", "sun")},
    "title: 7": {"title": 7},
    "point_fields: 'intensity'": {"point_fields": "intensity"},
    "point_fields: .*'x'": {"point_fields": ("x",)},
    "no recording has 'intensty'; did you mean intensity": {
        "point_fields": ("intensty",)
    },
    "describe_place raised SystemExit": {"describe": lambda *_: sys.exit()},
    "name: missing": {"name": ""},
}


def faults_one_by_one(method):
    for check in method_checks:
        try:
            check(method)
        except InputError as error:
            yield str(error)


@pytest.mark.parametrize("fault", FAULTS)
def test_a_broken_method_is_refused_in_one_line(fault):
    method = replaced(**FAULTS[fault])
    with pytest.raises(InputError, match=fault) as raised:
        check_method(method)
    assert "\n" not in str(raised.value)
    assert any(re.search(fault, one) for one in faults_one_by_one(method))


@pytest.mark.parametrize("name", ["", " ", " heights", "heights ", "a\nb"])
def test_names_that_tables_do_not_keep(name):
    with pytest.raises(ValueError, match="is no name of a method"):
        register(name)


def test_what_is_no_method():
    with pytest.raises(InputError, match="is no Method"):
        check_method(Heights)


def test_settings_that_cannot_be_pickled():
    class Config(MethodConfig):
        rings: int = 3

    method = replaced(Config=Config)
    with pytest.raises(InputError, match="cannot be pickled"):
        check_method(method)


def test_fields_of_points_are_given():
    seen = set()

    def describe(self, points):
        seen.add(points.dtype.names)
        return Heights.describe(self, np.stack([points[a] for a in "xyz"], 1))

    check_method(replaced(point_fields=("ring", "own"), describe=describe))
    assert seen == {("x", "y", "z", "ring", "own")}


@pytest.mark.parametrize("kind", [True, False])
def test_a_method_says_whether_it_estimates_poses(kind):
    own = {"relative_pose": lambda self, *_: np.eye(4)} if kind else {}
    assert replaced(**own).estimates_poses() is kind
