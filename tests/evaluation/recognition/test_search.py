"""Databases in groups of drives, of which one is in memory at a time."""

from dataclasses import replace
import pickle
import time

import numpy as np
import pytest

from evaluation.methods import make_method
from evaluation.recognition import (
    RANDOM_YAW_PROTOCOL,
    DescribedScans,
    DriveDescriptors,
    Search,
    StoredDrives,
    compare_at_radii,
)

NUM_DRIVES = 4
NUM_PLACES = 6


def cloud(seed):
    """Returns 60 posts of random height and place, and the ground."""
    rng = np.random.default_rng(seed)
    ground = [*rng.uniform(-30.0, 30.0, (2, 16000)), np.full(16000, -1.6)]
    feet = rng.uniform(-28.0, 28.0, (60, 2))
    of = rng.integers(len(feet), size=6000)
    posts = feet[of] + rng.normal(0.0, 0.03, (6000, 2))
    tops = rng.uniform(0.0, 3.0, 60)[of]
    heights = -1.6 + (tops + 1.6) * rng.random(6000)
    return np.vstack([np.transpose(ground), np.column_stack([posts, heights])])


def moved(points, seed):
    """Returns the same scene a little beside, with a tenth of it gone."""
    rng = np.random.default_rng(seed)
    kept = points[rng.random(len(points)) > 0.1]
    return kept + np.append(rng.uniform(-1.0, 1.0, 2), 0.0)


def scans(descriptors, first):
    X_WS = np.tile(np.eye(4), (len(descriptors), 1, 1))
    X_WS[:, 0, 3] = 20.0 * (first + np.arange(len(descriptors)))
    frames = np.arange(len(descriptors))
    return DescribedScans(frames, frames * 10**8, X_WS, list(descriptors))


def drives_of(method):
    """Returns four drives of six places each.

    The last two are the same, but for Scan Context++: its search tree leaves
    open which of equally near contexts it finds.
    """
    last = 3 if method.name == "scan-context++" else 2
    found = []
    for drive in range(NUM_DRIVES):
        seeds = [min(drive, last) * NUM_PLACES + k for k in range(NUM_PLACES)]
        described = [method.describe_place(cloud(seed)) for seed in seeds]
        places = scans(described, drive * NUM_PLACES)
        found.append(DriveDescriptors(f"drive {drive}", places, places))
    return found


def queries_of(method):
    seeds = [0, 3, 8, 13, 17]
    return DriveDescriptors(
        "queries",
        scans([], 0),
        scans([method.describe(moved(cloud(s), s)) for s in seeds], 0),
    )


def stored(drives, most_bytes, reads):
    """Returns places of drives in files of 10 bytes; enters reads in a list."""

    def reader(number):
        def read():
            reads.append(number)
            return drives[number]

        return read

    numbers = range(len(drives))
    store = StoredDrives([reader(k) for k in numbers], [10] * 4, most_bytes)
    bare = [store.undescribed(k) for k in numbers]
    joined = DescribedScans(
        *(
            np.concatenate([getattr(one, name) for one in bare])
            for name in ("frames", "stamps_ns", "X_WS")
        )
    )
    of = np.repeat(numbers, NUM_PLACES)
    rows = np.tile(np.arange(NUM_PLACES), len(drives))
    return store.described(joined, of, rows)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "settings"),
    [
        pytest.param(
            "btc",
            {"min_votes": 1, "candidates": 7},
            marks=pytest.mark.night,
        ),
        pytest.param("learned", {}, marks=pytest.mark.night),
        ("ring++", {"cells": 20}),
        ("ring++", {"cells": 44, "candidates": 7}),
        ("scan-context++", {"candidates": 7}),
        ("scan-context++", {"candidates": 7, "variant": "cart"}),
        ("solid", {}),
    ],
)
def test_groups_give_the_same_as_the_whole(name, settings):
    method = make_method(name, settings)
    assert method.divides
    drives, queries = drives_of(method), queries_of(method)
    protocol = replace(RANDOM_YAW_PROTOCOL, radius=25.0)
    found = []
    # All drives in memory, one drive, or a third of a drive.
    for most_bytes in (40, 10, 4):
        places = stored(drives, most_bytes, [])
        assert len(places.descriptors) == NUM_DRIVES * NUM_PLACES
        database = DriveDescriptors("places", places, places)
        ((_, batch),) = compare_at_radii(
            Search(method, places), database, queries, protocol, [None, 25.0]
        )
        found.append(batch)
    whole, *others = found
    assert not np.isnan(whole[0].scores).all()
    pairs = [both for one in others for both in zip(whole, one, strict=True)]
    for expected, got in pairs:
        if name == "learned":
            # A product of matrices rounds by their size.
            np.testing.assert_allclose(got.scores, expected.scores, rtol=1e-5)
        else:
            np.testing.assert_array_equal(got.scores, expected.scores)
        np.testing.assert_array_equal(got.best_places, expected.best_places)
        np.testing.assert_array_equal(
            got.pose_errors.translation, expected.pose_errors.translation
        )


def test_a_search_chooses_from_all_groups():
    """As many places of each group as the search in the whole compares."""
    method = make_method(
        "scan-context++", {"candidates": 5, "variant": "polar"}
    )
    drives, queries = drives_of(method), queries_of(method)
    places = stored(drives, 10, [])
    known = np.ones((5, len(places.frames)), bool)
    scores = Search(method, places).scores(queries, range(5), known)
    assert (~np.isnan(scores)).sum(axis=1).tolist() == [5] * 5
    # If a place is excluded, each is compared, and the answer is another one.
    known[:, np.nanargmax(scores[0])] = False
    scores = Search(method, places).scores(queries, range(5), known)
    assert (~np.isnan(scores)).sum(axis=1).tolist() == [len(known[0]) - 1] * 5


def test_one_group_is_in_memory_at_a_time():
    method = make_method("solid", {})
    reads: list[int] = []
    places = stored(drives_of(method), 20, reads)
    assert places.descriptors.groups == [slice(0, 12), slice(12, 24)]
    assert reads == [0, 1, 2, 3]
    search = Search(method, places)
    queries = queries_of(method)
    search.scores(queries, range(5), np.ones((5, 24), bool))
    assert reads == [0, 1, 2, 3, 0, 1, 2, 3]
    # The last group is still there.
    search.poses(queries, range(5), [np.array([0, 23])] * 5)
    assert reads == [0, 1, 2, 3, 0, 1, 2, 3, 0, 1]


def test_the_cost_of_a_search(monkeypatch):
    """By a clock that only the method moves; the first query is slow."""
    spent = []
    monkeypatch.setattr(time, "process_time_ns", lambda: int(1e9 * sum(spent)))
    solid = make_method("solid", {})

    class Slow(type(solid)):
        def build_database(self, places):
            spent.append(0.5 * len(places))
            return super().build_database(places)

        def score(self, query, database, *, exhaustive=False):
            spent.append(next(times))
            return super().score(query, database, exhaustive=exhaustive)

    places = stored(drives_of(solid), 20, [])
    search = Search(Slow(), places)
    # Two groups of places.
    times = iter([100.0, 1.0, 2.0, 3.0, 5.0] * 2)
    search.scores(queries_of(solid), range(5), np.ones((5, 24), bool))
    found = search.cost("solid")
    assert (found.method, found.places, found.build_time) == ("solid", 24, 12.0)
    assert found.query_time == 5.0
    assert found.memory == 24 * len(pickle.dumps(places.descriptors[0], 5))


def test_a_large_drive_is_searched_in_shares():
    places = stored(drives_of(make_method("solid", {})), 4, [])
    shares = [(one.start, one.stop) for one in places.descriptors.groups]
    assert shares == [(k, k + 2) for k in range(0, 24, 2)]


def test_a_small_database_is_read_once():
    method = make_method("solid", {})
    reads: list[int] = []
    places = stored(drives_of(method), 40, reads)
    assert isinstance(places.descriptors, list)
    assert reads == [0, 1, 2, 3]
