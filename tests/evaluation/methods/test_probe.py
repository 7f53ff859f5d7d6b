"""PROBE beside its formulas, written out cell by cell."""

import math

import numpy as np
import pytest
from scipy.stats import norm

from evaluation.base import InputError
from evaluation.methods import make_method

RINGS = 5
SECTORS = 8
SETTINGS = {"rings": RINGS, "sectors": SECTORS, "max_range": 10.0}


@pytest.fixture
def method():
    return make_method("probe", SETTINGS)


def scene(seed, number=40):
    rng = np.random.default_rng(seed)
    return rng.uniform([-9.0, -9.0, -1.0], [9.0, 9.0, 5.0], (number, 3))


def turned(points, sectors):
    a = 2.0 * math.pi * sectors / SECTORS
    c, s = math.cos(a), math.sin(a)
    return points @ np.array([[c, s, 0.0], [-s, c, 0.0], [0.0, 0.0, 1.0]])


def gaussian(sigma):
    """Returns offsets and shares of SciPy's truncated kernel."""
    reach = int(4.0 * sigma + 0.5)
    offsets = range(-reach, reach + 1)
    shares = norm.pdf(offsets, scale=sigma)
    return list(zip(offsets, shares / shares.sum(), strict=True))


def probabilities(occupied):
    along = np.zeros_like(occupied)
    for ring, row in enumerate(occupied):
        arc = (ring + 0.5) * 2.0 * (2.0 * math.pi / SECTORS)
        sigma = 2.0 * math.sqrt(max(row.mean(), 0.01)) / arc
        for sector in range(SECTORS):
            for offset, share in gaussian(max(sigma, 0.1)):
                along[ring, sector] += share * row[(sector + offset) % SECTORS]
    across = np.zeros_like(occupied)
    for ring in range(RINGS):
        for offset, share in gaussian(2.0 / 2.0):
            if 0 <= ring + offset < RINGS:
                across[ring] += share * along[ring + offset]
    return across


def divergence(a, b):
    """Returns the mean of both Kullback-Leibler divergences of two coins."""

    def relative(p, q):
        return p * math.log(p / q) + (1 - p) * math.log((1 - p) / (1 - q))

    return (relative(a, b) + relative(b, a)) / 2.0


def likeness(place, query):
    total = number = 0
    for a, b in zip(place.ravel(), query.ravel(), strict=True):
        if a + b > 1e-3:
            drawn = []
            for mu in (float(a), float(b)):
                sigma = math.sqrt(mu * (1.0 - mu))
                p = mu * (1.0 - sigma) + 0.5 * sigma
                drawn.append(min(max(p, 1e-6), 1.0 - 1e-6))
            total += divergence(*drawn)
            number += 1
    return math.exp(-total / number)


def test_cells_heights_and_probabilities(method):
    points = scene(1)
    found = method.describe(points)
    heights = np.full((RINGS, SECTORS), -math.inf)
    for x, y, z in points:
        ring = int(math.hypot(x, y) // 2.0)
        if ring < RINGS:
            sector = int((math.atan2(y, x) + math.pi) // (math.pi / 4.0))
            heights[ring, sector] = max(heights[ring, sector], z)
    occupied = np.isfinite(heights).astype(float)
    heights = np.where(occupied, heights, 0.0)
    np.testing.assert_allclose(
        found.heights, heights / np.linalg.norm(heights), atol=1e-12
    )
    np.testing.assert_allclose(found.mu, probabilities(occupied), atol=1e-6)


def test_the_first_point_of_a_voxel_stays(method):
    pair = np.array([[3.1, 0.1, 0.1], [3.2, 0.2, 0.4], [-5.0, 0.2, 1.0]])
    first = method.describe(pair).heights
    assert first.max() / first[first > 0.0].min() == pytest.approx(10.0)
    other = method.describe(pair[[1, 0, 2]]).heights
    assert other.max() / other[other > 0.0].min() == pytest.approx(2.5)


@pytest.mark.parametrize(("ahead", "counts"), [(9.999, 1), (10.001, 0)])
def test_range(method, ahead, counts):
    found = method.describe(np.array([[ahead, 0.0, 1.0]]))
    assert np.nansum(found.heights) == counts


def test_scores_and_turns(method):
    rng = np.random.default_rng(3)
    places = [method.describe(scene(seed)) for seed in (4, 5)]
    turns = rng.integers(1, SECTORS, 2)
    database = method.build_database(places)
    for number, (seed, turn) in enumerate(zip((4, 5), turns, strict=True)):
        query = method.describe(turned(scene(seed), int(turn)))
        scores = method.score(query, database)
        assert scores.argmax() == number
        X = method.relative_pose(query, database, number)
        back = turned(np.array([[1.0, 0.0, 0.0]]), int(turn)) @ X[:3, :3].T
        np.testing.assert_allclose(back, [[1.0, 0.0, 0.0]], atol=1e-9)
        for place, score in zip(places, scores, strict=True):
            cosines = [
                (place.heights * np.roll(query.heights, k, 1)).sum()
                for k in range(SECTORS)
            ]
            best = int(np.argmax(cosines))
            wanted = cosines[best] * likeness(
                place.mu, np.roll(query.mu, best, 1)
            )
            assert score == pytest.approx(wanted, rel=1e-6)


def test_bad_settings():
    with pytest.raises(InputError, match="probe: sigma_t"):
        make_method("probe", {"sigma_t": 0.0})
