import math

import numpy as np
import pytest

from evaluation.base import from_xyz
from evaluation.change import covered, lacks_counterpart, temporal_change
from evaluation.maps import voxelise

NO_POINTS = np.empty((0, 3))


def make_city(seed=0, num_blocks=40, kept=1.0):
    """Returns the voxel centroids of ground with boxes on it."""
    rng = np.random.default_rng(seed)
    parts = [np.c_[rng.uniform(-150, 150, (20_000, 2)), np.zeros(20_000)]]
    for block in range(num_blocks):
        centre = rng.uniform(-140, 140, 2)
        size = rng.uniform([5, 5, 5], [15, 15, 40])
        points = rng.uniform(size=(800, 3)) * size + [*centre, 0]
        if block < kept * num_blocks:
            parts.append(points)
    return np.concatenate(parts)


def centroids(points):
    return voxelise(from_xyz(points))[0].centroids_W


FULL = centroids(make_city())
HALF = centroids(make_city(kept=0.5))
OTHER = centroids(make_city(seed=1, kept=0.7))


def ratio(source, target, **options):
    return temporal_change(source, target, **options).symmetric


def brute_force(source, target, tau):
    """TCR_sym by the definition, with an independent hull test."""
    from scipy.spatial import Delaunay

    counts = np.zeros(2, dtype=int)
    for a, b in ((source, target), (target, source)):
        in_hull = Delaunay(b).find_simplex(a, tol=1e-9) >= 0
        near = np.array([np.linalg.norm(b - p, axis=1).min() <= tau for p in a])
        counts += [(in_hull & near).sum(), in_hull.sum()]
    return 1.0 - counts[0] / counts[1]


@pytest.mark.parametrize("tau", [4.5, 9.0])
def test_agrees_with_the_definition(tau):
    # The oracle is slow, so it gets only some of the points.
    a, b = HALF[::15], OTHER[::15]
    expected = brute_force(a, b, tau)
    assert 0.1 < expected < 0.9
    assert ratio(a, b, tau=tau, margin=0.0) == expected


def test_by_hand():
    # A cube's 8 corners and its centre against the corners and a point outside:
    # worked out on paper.
    cube = np.array(
        [[x, y, z] for x in (0, 30) for y in (0, 30) for z in (0, 30)], float
    )
    source = np.vstack([cube, [[15, 15, 15]], [[15, 15, 20]]])
    target = np.vstack([cube, [[15, 15, 15 + 4.5]], [[60, 0, 0]]])
    change = temporal_change(source, target)
    # All of the source lies in the target's hull; only the centre and the
    # point above it are not at a corner, and both are within 4.5 m.
    assert change.source_to_target.num_in_hull == 10
    assert change.source_to_target.num_unchanged == 10
    # The point (60, 0, 0) of the target is outside and counts nowhere.
    assert change.target_to_source.num_in_hull == 9
    assert change.target_to_source.num_unchanged == 9
    assert change.symmetric == 0.0
    change = temporal_change(source, target, tau=4.0)
    assert change.source_to_target.num_unchanged == 9
    assert change.target_to_source.num_unchanged == 9
    assert change.source_to_target.ratio == pytest.approx(0.1)
    assert change.symmetric == pytest.approx(1.0 - 18.0 / 19.0)


def test_tau_is_inclusive():
    line = np.array([[0.0, 0, 0], [20.0, 0, 0]])
    shifted = np.array([[0.0, 0, 0], [15.5, 0, 0], [20.0, 0, 0]])
    change = temporal_change(shifted, line, tau=4.5)
    assert change.source_to_target.distances[1] == 4.5
    assert change.source_to_target.unchanged.all()
    below = math.nextafter(4.5, 0.0)
    change = temporal_change(shifted, line, tau=below)
    assert change.source_to_target.unchanged.tolist() == [True, False, True]


@pytest.mark.parametrize("cloud", [FULL, HALF, OTHER])
def test_no_change_from_itself(cloud):
    change = temporal_change(cloud, cloud)
    assert change.symmetric == 0.0
    assert change.num_in_hull == 2 * len(cloud)


@pytest.mark.parametrize(
    ("a", "b"), [(FULL, HALF), (HALF, OTHER), (FULL, OTHER)]
)
def test_order_does_not_matter_to_the_bit(a, b):
    there, back = temporal_change(a, b), temporal_change(b, a)
    assert there.symmetric == back.symmetric
    assert there.source_to_target.ratio == back.target_to_source.ratio


@pytest.mark.parametrize(
    ("a", "b"), [(FULL, HALF), (HALF, OTHER), (FULL, OTHER)]
)
def test_bounds(a, b):
    change = temporal_change(a, b)
    directed = (
        change.source_to_target.ratio,
        change.target_to_source.ratio,
    )
    assert 0.0 <= min(directed) <= change.symmetric <= max(directed) <= 1.0


def test_removing_shows_in_one_direction():
    change = temporal_change(HALF, FULL)
    assert change.source_to_target.ratio < 0.01
    assert change.target_to_source.ratio > 0.1


def test_larger_tau_never_raises_it():
    values = [ratio(HALF, OTHER, tau=t) for t in np.linspace(0.0, 12.0, 13)]
    assert np.all(np.diff(values) <= 0.0)
    assert values[0] > 0.9
    assert values[-1] < 0.1


@pytest.mark.parametrize(
    "voxels", [(1, 0, 0), (-7, 3, 2), (70_469, 805_356, 5)]
)
def test_moving_both_by_whole_voxels_changes_nothing(voxels):
    offset = 5.0 * np.array(voxels)
    first, second = make_city(kept=0.5), make_city(seed=1, kept=0.7)
    moved = [centroids(points + offset) for points in (first, second)]
    assert ratio(*moved) == ratio(HALF, OTHER)


def test_literal_equation_counts_outside_the_hull():
    # All points are near, but the source reaches out of the target's hull.
    target = np.array(
        [[x, y, z] for x in (0, 4) for y in (0, 4) for z in (0, 4)], float
    )
    source = np.vstack([target, target + np.array([2.0, 0, 0])])
    literal = temporal_change(source, target, restrict_to_hull=False)
    assert literal.symmetric < 0.0
    assert temporal_change(source, target).symmetric == 0.0


DEGENERATE = {
    "empty": NO_POINTS,
    "point": np.array([[3.0, 1.0, 2.0]]),
    "line": np.array([[x, 2.0 * x, -x] for x in np.arange(0.0, 100.0, 5.0)]),
    "plane": np.array(
        [[x, y, x + y] for x in range(0, 50, 5) for y in range(0, 50, 5)],
        dtype=float,
    ),
}


@pytest.mark.parametrize("name", ["point", "line", "plane"])
def test_flat_clouds_are_unchanged_from_themselves(name):
    cloud = DEGENERATE[name]
    for offset in (0.0, np.array([352_345.0, 4_026_780.0, 40.0])):
        change = temporal_change(cloud + offset, cloud + offset)
        assert change.symmetric == 0.0
        assert change.undefined_because is None


@pytest.mark.parametrize("name", DEGENERATE)
def test_flat_clouds_against_a_city(name):
    change = temporal_change(DEGENERATE[name], FULL)
    back = temporal_change(FULL, DEGENERATE[name])
    assert math.isnan(change.symmetric) == (name == "empty")
    if name != "empty":
        assert 0.0 <= change.symmetric <= 1.0
        assert change.symmetric == back.symmetric


@pytest.mark.parametrize(
    ("a", "b", "reason"),
    [
        (NO_POINTS, NO_POINTS, "holds no point"),
        (FULL, NO_POINTS, "holds no point"),
        (FULL, FULL + np.array([1e4, 0, 0]), "no point of either map"),
    ],
)
def test_undefined_is_nan_with_a_reason(a, b, reason):
    change = temporal_change(a, b)
    assert math.isnan(change.symmetric)
    assert math.isnan(change.source_to_target.ratio)
    assert reason in change.undefined_because


def test_nan_is_refused():
    broken = FULL.copy()
    broken[7, 1] = np.nan
    with pytest.raises(ValueError, match="not finite"):
        temporal_change(FULL, broken)


def test_mask_only_hides_from_the_count():
    change = temporal_change(HALF, FULL)
    everything = [np.ones(len(cloud), dtype=bool) for cloud in (HALF, FULL)]
    assert change.restricted(*everything).symmetric == change.symmetric
    kept = [cloud[:, 0] > 0.0 for cloud in (HALF, FULL)]
    east = change.restricted(*kept)
    rest = change.restricted(*[~mask for mask in kept])
    assert east.num_in_hull + rest.num_in_hull == change.num_in_hull
    assert east.num_unchanged + rest.num_unchanged == change.num_unchanged
    nothing = change.restricted(*[~mask for mask in everything])
    assert math.isnan(nothing.symmetric)


def test_coverage():
    points = np.array(
        [[0.0, 39.9, 90.0], [0.0, 40.1, 0.0], [30.0, 0.0, 0.0], [0, 0, 0]]
    )
    first = np.array([[x, 0.0, 1.6] for x in np.arange(-50.0, 1.0)])
    second = first[:21]
    # Height does not count; every trajectory must be near.
    assert covered(points, (first,)).tolist() == [True, False, True, True]
    assert covered(points, (first, second)).tolist() == [
        False,
        False,
        False,
        True,
    ]


def test_points_of_fine_maps_count_as_in_the_metric():
    other = np.array(
        [[x, y, z] for x in (0, 20) for y in (0, 20) for z in (0, 20)], float
    )
    points = np.array(
        [
            [0.0, 0.0, 4.4],
            [0.0, 0.0, 4.6],
            [10.0, 10.0, 10.0],
            [40.0, 0.0, 0.0],
            [24.0, 0.0, 0.0],
        ]
    )
    absent = lacks_counterpart(points, other)
    assert absent.tolist() == [False, True, True, True, False]
