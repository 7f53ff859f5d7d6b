"""A small city that ages: nested, repeatable, sound; and its faults."""

import numpy as np
import pytest
from scipy.stats import poisson
import shapely

from cns_drake.scene import geometry_by_structure, load_world
from worlds.ageing import DEFAULT_RATES
from worlds.ageing.aged_map import AgeingCity
from worlds.ageing.old_world import OldWorld
from worlds.maps import MapFolder


@pytest.fixture(scope="module")
def world(town):
    return OldWorld(
        MapFolder(town), lambda stage: geometry_by_structure(load_world(stage))
    )


@pytest.mark.slow
@pytest.mark.sampled(1)
@pytest.mark.parametrize("seed", [1, 2])
def test_rates_come_about(world, seed):
    """Numbers of 30 years are Poisson's, at one in a thousand for each."""
    city = AgeingCity(world, DEFAULT_RATES, seed, shapely.Polygon())
    for _ in range(30):
        city.live()
    tally = city.tally
    assert tally.expected["lamps"] > 5
    for event, rate in DEFAULT_RATES.items():
        if event == "moved":
            continue
        expected = rate * tally.exposure.get(event, 0)
        if event == "built":
            expected = tally.expected.get("built", 0.0)
        number = tally.number.get(event, 0)
        assert poisson.ppf(0.001, expected) <= number
        assert number <= poisson.ppf(0.999, expected)
    logged = [e.event for e in city.standing.events]
    assert logged.count("renewed") == tally.number["renewed"]
    assert logged.count("extended") == tally.number["extended"]


@pytest.mark.parametrize(
    ("farthest", "least"), [(0.0, 0.0), (0.1, 0.1), (0.2, 0.2), (5.0, 0.2)]
)
def test_furniture_moves_as_far_as_allowed(world, farthest, least):
    rates = {
        **dict.fromkeys(DEFAULT_RATES, 0.0),
        "lamps": 1.0,
        "moved": farthest,
    }
    city = AgeingCity(world, rates, 1, shapely.Polygon())
    city.live()
    moves = [e for e in city.standing.events if e.event == "furniture"]
    assert moves
    by = []
    for one in moves:
        middles = (
            np.array(foot.centroid.coords[0])
            for foot in (
                world.geometry[one.structure].footprint,
                city.standing.new[one.successor].footprint_W,
            )
        )
        by.append(np.linalg.norm(np.subtract(*middles)))
    by = np.array(by)
    stays = by < 0.01  # No place was free, or none is allowed.
    assert stays.all() == (farthest == 0.0)
    assert (by[~stays] < farthest + 0.01).all()
    assert (by[~stays] > least - 0.01).all()
