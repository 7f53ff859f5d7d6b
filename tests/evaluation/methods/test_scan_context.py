import math

import numpy as np
import pytest

from evaluation.base import InputError
from evaluation.methods import known_methods, make_method

NAME = "scan-context++"


def method(**parameters):
    return make_method(NAME, parameters)


def make_scene(seed, number=150):
    """Returns walls and posts around the sensor, (N, 3) in its frame."""
    rng = np.random.default_rng([seed, 77])
    parts = []
    for _ in range(number):
        foot = rng.uniform(-75.0, 75.0, 2)
        height = rng.uniform(1.0, 15.0)
        size = rng.uniform(0.5, 6.0, 2)
        box = rng.uniform(size=(150, 3)) * [*size, height]
        parts.append(box + np.array([*foot, -1.6]))
    return np.concatenate(parts)


def turned(points, angle_deg):
    a = math.radians(angle_deg)
    R = np.array([[math.cos(a), -math.sin(a)], [math.sin(a), math.cos(a)]])
    result = points.copy()
    result[:, :2] = points[:, :2] @ R.T
    return result


def brute_force(a, b, shifts):
    """The best mean cosine of columns, column by column."""
    best = -math.inf, None
    for shift in shifts:
        moved = np.roll(b, shift, axis=1)
        cosines = []
        for j in range(a.shape[1]):
            norms = np.linalg.norm(a[:, j]) * np.linalg.norm(moved[:, j])
            if norms > 0.0:
                cosines.append(a[:, j] @ moved[:, j] / norms)
        if cosines and np.mean(cosines) > best[0]:
            best = np.mean(cosines), shift % a.shape[1]
    return best


@pytest.mark.parametrize("variant", ["polar", "cart"])
@pytest.mark.parametrize("seed", range(3))
def test_score_agrees_with_brute_force(variant, seed):
    m = method(variant=variant)
    query = m.describe(make_scene(seed, 30))
    places = [m.describe_place(make_scene(10 + k, 30)) for k in range(6)]
    scores = m.score(query, m.build_database(places), exhaustive=True)
    size = query.images.shape[2]
    half = 3 if variant == "polar" else 2
    for score, place in zip(scores, places, strict=True):
        key_distances = [
            np.linalg.norm(
                query.aligning_keys[0] - np.roll(place.aligning_keys[0], s)
            )
            for s in range(size)
        ]
        first = int(np.argmin(key_distances))
        expected, _ = brute_force(
            query.images[0],
            place.images[0],
            range(first - half, first + half + 1),
        )
        assert score == pytest.approx(expected, abs=1e-12)


@pytest.mark.parametrize("turns", [0, 1, 7, 30, 59])
def test_turning_by_whole_sectors_changes_nothing(turns):
    m = method(variant="polar")
    # Thinning has its own grid, which must not matter here.
    coarse = method(variant="polar", voxel_size=1e-3)
    scene = make_scene(1)
    query, place = (
        coarse.describe(turned(scene, 6.0 * turns)),
        (coarse.describe_place(scene)),
    )
    np.testing.assert_allclose(
        query.images[0], np.roll(place.images[0], turns, axis=1), atol=1e-9
    )
    database = coarse.build_database([place])
    assert coarse.score(query, database)[0] == pytest.approx(1.0, abs=1e-12)
    assert m.config.voxel_size == 0.5


@pytest.mark.parametrize("yaw_deg", [0.0, 42.0, 180.0, -90.0])
def test_relative_pose_of_a_turned_sensor(yaw_deg):
    m = method(variant="polar")
    scene = make_scene(2)
    database = m.build_database(
        [m.describe_place(make_scene(3)), m.describe_place(scene)]
    )
    # A sensor that is turned by yaw sees the scene turned back.
    query = m.describe(turned(scene, -yaw_deg))
    X_PQ = m.relative_pose(query, database, 1)
    a = math.radians(yaw_deg)
    expected = np.eye(4)
    expected[:2, :2] = [[math.cos(a), -math.sin(a)], [math.sin(a), math.cos(a)]]
    np.testing.assert_allclose(X_PQ, expected, atol=1e-9)


@pytest.mark.parametrize("side", [-2.0, 2.0])
def test_augmented_place_matches_neighbouring_lanes(side):
    scene = make_scene(4)
    m, plain = method(), method(variant="polar")
    # The query's sensor is moved to one side; its points move to the other.
    query = m.describe(scene - [0.0, side, 0.0])
    database = m.build_database(
        [m.describe_place(make_scene(5)), m.describe_place(scene)]
    )
    assert len(database.places) == 6
    augmented = m.score(query, database)[1]
    alone = plain.score(
        plain.describe(scene - [0.0, side, 0.0]),
        plain.build_database([plain.describe_place(scene)]),
    )[0]
    assert augmented == pytest.approx(1.0, abs=1e-9)
    assert alone < 0.95
    X_PQ = m.relative_pose(query, database, 1)
    np.testing.assert_allclose(X_PQ[:3, 3], [0.0, side, 0.0], atol=1e-12)
    np.testing.assert_allclose(X_PQ[:3, :3], np.eye(3), atol=1e-12)


@pytest.mark.parametrize("lanes", [-3, 0, 2])
def test_cart_context_finds_the_lane(lanes):
    m = method(variant="cart")
    # Cells away from the axes are regular.
    scene = make_scene(6)
    scene = scene[(np.abs(scene[:, 1]) > 10) & (np.abs(scene[:, 1]) < 28)]
    offset = 2.0 * lanes
    query = m.describe(scene - [0.0, offset, 0.0])
    database = m.build_database([m.describe_place(scene)])
    X_PQ = m.relative_pose(query, database, 0)
    np.testing.assert_allclose(X_PQ[:3, 3], [0.0, offset, 0.0], atol=1e-12)


def test_augmented_cart_context_matches_the_opposite_direction():
    m = method(variant="augmented-cart")
    scene = make_scene(7)
    query = m.describe(turned(scene, 180.0))
    database = m.build_database([m.describe_place(scene)])
    assert m.score(query, database)[0] > 0.999
    X_PQ = m.relative_pose(query, database, 0)
    np.testing.assert_allclose(X_PQ[:2, :2], -np.eye(2), atol=1e-12)


@pytest.mark.parametrize(
    "variant", ["polar", "augmented-polar", "cart", "augmented-cart"]
)
def test_the_same_place_is_the_most_similar(variant):
    m = method(variant=variant)
    scenes = [make_scene(20 + k) for k in range(12)]
    database = m.build_database([m.describe_place(s) for s in scenes])
    rng = np.random.default_rng(0)
    for k, scene in enumerate(scenes):
        noisy = scene + rng.normal(scale=0.05, size=scene.shape)
        scores = m.score(m.describe(noisy), database)
        assert np.nanargmax(scores) == k
        assert scores[k] <= 1.0 + 1e-12


def test_only_candidates_are_scored():
    m = method(candidates=3, variant="polar")
    scenes = [make_scene(40 + k, 20 + 5 * k) for k in range(10)]
    places = [m.describe_place(s) for s in scenes]
    database = m.build_database(places)
    query = m.describe(scenes[4])
    scores = m.score(query, database)
    keys = np.stack([place.retrieval_keys[0] for place in places])
    distances = np.linalg.norm(keys - query.retrieval_keys[0], axis=1)
    nearest = np.argsort(distances)[:3]
    assert set(np.flatnonzero(~np.isnan(scores))) == set(nearest)
    exhaustive = m.score(query, database, exhaustive=True)
    assert not np.isnan(exhaustive).any()
    np.testing.assert_array_equal(exhaustive[nearest], scores[nearest])


def test_candidates_are_counted_in_places():
    m = method(candidates=4)
    scenes = [make_scene(60 + k, 30) for k in range(12)]
    database = m.build_database([m.describe_place(s) for s in scenes])
    found = np.count_nonzero(
        ~np.isnan(m.score(m.describe(scenes[0]), database))
    )
    # Twelve contexts, of between four and twelve places.
    assert 4 <= found <= 12


def test_parameters():
    assert NAME in known_methods()
    assert make_method(NAME, {"candidates": "7"}).config.candidates == 7
    with pytest.raises(
        InputError, match=r"no method 'x' \(there are: .*scan-con"
    ):
        make_method("x", {})
    with pytest.raises(InputError, match=r"no parameter 'x'.*variant"):
        make_method(NAME, {"x": 1})
    with pytest.raises(InputError, match=r"scan-context\+\+: variant: "):
        make_method(NAME, {"variant": "spherical"})
    for name, value in (("candidates", 0), ("voxel_size", -1.0), ("rings", 0)):
        with pytest.raises(InputError, match=f"{name}: .*greater than"):
            make_method(NAME, {name: value})
