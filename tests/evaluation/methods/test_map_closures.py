"""MapClosures: the calls of its package, and the use of their results.

The package needs an older NumPy, and is not installed here. A stand-in of its
interface aligns maps that are turned and shifted copies of each other.
"""

import sys
from types import ModuleType, SimpleNamespace

import numpy as np
import pytest

from evaluation.base import InputError
from evaluation.methods import known_methods, make_method, shipped_methods
from evaluation.recognition import choose_methods

NAME = "map-closures"
PACKAGE = "map_closures"


class Program:
    """Aligns a map with those of much lower numbers and as many points."""

    def __init__(self, config):
        self.config = config
        self.maps = []
        self.aligned = 0

    def get_top_k_closures(self, number, points, k):
        found = [
            SimpleNamespace(
                source_id=earlier,
                target_id=number,
                number_of_inliers=len(points),
                pose=motion(known, points),
            )
            for earlier, known in self.maps
            if earlier < number - 3 and len(known) == len(points)
        ]
        self.aligned += sum(earlier < number - 3 for earlier, _ in self.maps)
        self.maps.append((number, points))
        return found[:k]


def motion(source, target):
    """Returns (4, 4) that takes one cloud to another, point by point."""
    a, b = source - source.mean(axis=0), target - target.mean(axis=0)
    u, _, vt = np.linalg.svd(a.T @ b)
    X = np.eye(4)
    X[:3, :3] = (u @ vt).T
    X[:3, 3] = target.mean(axis=0) - X[:3, :3] @ source.mean(axis=0)
    return X


@pytest.fixture
def method(monkeypatch):
    package = ModuleType(PACKAGE)
    package.map_closures = SimpleNamespace(MapClosures=Program)
    package.config = SimpleNamespace(MapClosuresConfig=SimpleNamespace)
    monkeypatch.setitem(sys.modules, PACKAGE, package)
    return make_method(NAME, {"density_threshold": 0.1})


def turned(points):
    X = np.eye(4)
    X[:2, :2] = [[0.6, -0.8], [0.8, 0.6]]
    X[:3, 3] = 3.0, -2.0, 0.5
    return X, points @ X[:3, :3].T + X[:3, 3]


def test_it_is_run_only_where_it_is_named(method):
    assert NAME in known_methods()
    assert NAME not in shipped_methods()
    assert NAME not in {one.name for one in choose_methods()}
    # Only what is named runs.
    assert [one.name for one in choose_methods([NAME])] == [NAME]
    both = [one.name for one in choose_methods(["standard", NAME])]
    assert both == [*shipped_methods(), NAME]
    with pytest.raises(InputError, match="--method: solid is there twice"):
        choose_methods(["solid", "standard"])


@pytest.mark.parametrize(
    ("name", "fault"),
    [
        ("map-closure", "did you mean map-closures?"),
        (
            "solids",
            "neither a Python file nor one of standard, .*map-cl",
        ),
        ("nowhere.py", "nowhere.py: no such file"),
    ],
)
def test_other_names_are_refused(name, fault):
    with pytest.raises(InputError, match=fault) as refusal:
        choose_methods([name])
    assert "\n" not in str(refusal.value)


def test_without_its_package_one_line_names_the_command(monkeypatch):
    monkeypatch.setitem(sys.modules, PACKAGE, None)
    with pytest.raises(
        InputError, match=r"'cns-eval\[map-closures\]'"
    ) as refusal:
        make_method(NAME, {})
    assert "\n" not in str(refusal.value)
    with pytest.raises(InputError, match="not installed"):
        choose_methods([NAME])


def test_local_maps_are_thinned(method):
    points = np.random.default_rng(1).uniform(-20, 20, (20000, 3))
    cells = np.unique(np.floor((points + np.array([0, 0, 2.5])) / 0.5), axis=0)
    assert len(method.describe(points)) == len(cells)


def test_inliers_are_scores_and_poses_are_the_querys(method):
    rng = np.random.default_rng(2)
    places = [rng.normal(size=(number, 3)) for number in (40, 50, 60)]
    database = method.build_database(places)
    for place in (1, 2, 1):
        X_QP, query = turned(places[place])
        np.testing.assert_array_equal(
            method.score(query, database),
            [len(query) if k == place else np.nan for k in range(3)],
        )
        X_PQ = method.relative_pose(query, database, place)
        np.testing.assert_allclose(X_PQ @ X_QP, np.eye(4), atol=1e-9)
        assert method.relative_pose(query, database, 0) is None
    # There are three places and three queries; poses need no further map.
    # Queries are aligned with places only, and places with nothing.
    assert len(database.program.maps) == 6
    assert database.program.aligned == 3 * 3
    assert database.program.config.density_threshold == 0.1
    assert not hasattr(database.program.config, "sensor_height")
