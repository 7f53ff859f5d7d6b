"""Sloping ground: closed forms of the field, its streets and its pads."""

from functools import cache

import numpy as np
import pytest
import shapely
from shapely.geometry import Polygon, box

from cns_drake.city import Model, Structure
from cns_drake.city.ground.elevation import (
    LevelGround,
    Pad,
    aprons,
    make_ground,
    with_gaps_filled,
)
from cns_drake.roads import RoadSurface, load_road_network

KERB = 0.2
BOUNDS = (-50.0, -40.0, 150.0, 60.0)
# Two parallel roads, 60 m apart and 6 m apart in height. A ramp joins their
# eastern ends.
ROADS = """
defaults: {sidewalk: 2.0, kerb_height: 0.2, lane_width: 3.5}
junctions:
  a: {position: [-60, -20], height: 1.0, dead_end: true, kerb_radius: 4}
  b: {position: [120, -20], height: 1.0, kerb_radius: 5}
  c: {position: [120, 40], height: 7.0, kerb_radius: 5}
  d: {position: [-60, 40], height: 7.0, dead_end: true, kerb_radius: 4}
roads:
  low: {start: a, end: b}
  ramp: {start: b, end: c}
  high: {start: c, end: d}
"""


@cache
def network(folder):
    path = folder / "roads.yaml"
    path.write_text(ROADS)
    return load_road_network(path)


@pytest.fixture
def roads(tmp_path_factory):
    return network(tmp_path_factory.getbasetemp())


def streets_of(roads):
    return shapely.union_all([roads.areas.carriageway, roads.areas.sidewalks])


def ground_of(roads, pads=()):
    surface = RoadSurface(roads)
    return make_ground(surface, KERB, streets_of(roads), BOUNDS, pads)


def test_relaxed_fills_a_strip_linearly():
    z = np.full((5, 9), np.nan)
    z[:, 0], z[:, -1] = 2.0, 10.0
    expected = np.tile(np.linspace(2.0, 10.0, 9), (5, 1))
    np.testing.assert_allclose(with_gaps_filled(z), expected, atol=1e-9)


def test_relaxed_keeps_a_harmonic_polynomial():
    """x^2 - y^2 and x y solve the five-point Laplace equation exactly."""
    y, x = np.mgrid[0:12, 0:15].astype(float)
    z = 0.3 * (x**2 - y**2) - 0.2 * x * y + x
    holes = z.copy()
    holes[1:-1, 1:-1] = np.nan
    np.testing.assert_allclose(with_gaps_filled(holes), z, atol=1e-9)


def test_relaxed_stays_between_given_values():
    rng = np.random.default_rng(3)
    z = np.full((20, 30), np.nan)
    given = rng.random(z.shape) < 0.1
    z[given] = rng.uniform(-2, 5, given.sum())
    result = with_gaps_filled(z)
    assert not np.isnan(result).any()
    np.testing.assert_array_equal(result[given], z[given])
    assert result.min() >= np.nanmin(z) - 1e-9
    assert result.max() <= np.nanmax(z) + 1e-9


def test_level_streets_make_level_ground(tmp_path):
    path = tmp_path / "roads.yaml"
    path.write_text(
        ROADS.replace("height: 1.0, ", "").replace("height: 7.0, ", "")
    )
    roads = load_road_network(path)
    assert RoadSurface(roads).is_level
    ground = ground_of(roads)
    assert isinstance(ground, LevelGround)
    np.testing.assert_array_equal(ground(np.zeros(3), np.arange(3.0)), KERB)
    raised = Pad(box(0, 0, 10, 10), 1.5)
    assert not ground_of(roads, [raised]).is_level


def test_on_streets_the_ground_is_the_sidewalk(roads):
    surface = RoadSurface(roads)
    assert not surface.is_level
    ground = ground_of(roads)
    for name in ("low", "ramp", "high"):
        road = roads.roads[name]
        stations = np.linspace(road.first_station, road.last_station, 40)
        for offset in (-5.2, 0.0, 4.6):
            x, y, z, _ = road.evaluate(stations, offset).T
            inside = (x > BOUNDS[0]) & (y > BOUNDS[1]) & (y < BOUNDS[3])
            np.testing.assert_allclose(
                ground(x, y)[inside], z[inside] + KERB, atol=2e-3
            )


def test_between_parallel_streets_the_ground_rises_evenly(roads):
    """Far from the ramp the field is that of a strip: linear across it."""
    ground = ground_of(roads)
    edges = -20 + 5.5, 40 - 5.5
    y = np.linspace(edges[0] + 4, edges[1] - 4, 12)
    share = (y - edges[0]) / (edges[1] - edges[0])
    expected = 1.0 + KERB + 6.0 * share
    np.testing.assert_allclose(
        ground(np.full(12, -40.0), y), expected, atol=0.15
    )


def test_the_ground_meets_sidewalks_without_a_step(roads):
    ground, streets = ground_of(roads), streets_of(roads)
    outline = shapely.segmentize(streets.boundary, 3.0)
    p = shapely.get_coordinates(outline)
    inner = (p > np.array(BOUNDS[:2]) + 1) & (p < np.array(BOUNDS[2:]) - 1)
    p = p[inner.all(axis=1)]
    assert len(p) > 100
    rng = np.random.default_rng(1)
    for _ in range(4):
        step = rng.normal(size=p.shape)
        step *= 0.02 / np.hypot(*step.T)[:, None]
        jump = ground(*(p + step).T) - ground(*p.T)
        # The ramp itself climbs by less than 20 %.
        assert np.abs(jump).max() < 0.02


def test_pads_are_level_and_the_first_one_wins(roads):
    pads = [Pad(box(0, 0, 12, 10), 3.25), Pad(box(8, 4, 30, 14), 5.0)]
    ground = ground_of(roads, pads)
    rng = np.random.default_rng(2)
    x, y = rng.uniform((0, 0), (12, 10), (200, 2)).T
    np.testing.assert_allclose(ground(x, y), 3.25, atol=0.01)
    x, y = rng.uniform((12.5, 4), (30, 14), (200, 2)).T
    np.testing.assert_allclose(ground(x, y), 5.0, atol=0.01)
    # The ground has no step just outside of the free edge.
    y = rng.uniform(0, 3, 50)
    np.testing.assert_allclose(ground(np.full(50, -0.01), y), 3.25, atol=0.02)


def test_an_apron_surrounds_its_building_but_not_the_street(roads):
    footprint = Polygon([(-6, -4), (6, -4), (6, 4), (-6, 4)])
    model = Model((), {}, footprint)
    building = Structure("house_001", "building", model, (50.0, -10.2, 2.4))
    streets = streets_of(roads)
    (pad,) = aprons([building], streets)
    assert pad.height == 2.4
    assert pad.area.contains(building.footprint_W)
    assert pad.area.intersection(streets).area < 1e-6
    # The pad is 0.6 m wider at the sides and the back.
    x0, _, x1, y1 = pad.area.bounds
    assert (x0, x1, y1) == pytest.approx((43.4, 56.6, -5.6), abs=2e-3)


def test_the_same_input_gives_the_same_heights(roads):
    pads = [Pad(box(0, 0, 12, 10), 3.25)]
    rng = np.random.default_rng(5)
    x, y = rng.uniform(BOUNDS[:2], BOUNDS[2:], (500, 2)).T
    first, second = (ground_of(roads, pads)(x, y) for _ in range(2))
    np.testing.assert_array_equal(first, second)
    # Objects look up one point at a time.
    ground = ground_of(roads, pads)
    single = [ground(x[k : k + 1], y[k : k + 1])[0] for k in range(50)]
    np.testing.assert_allclose(single, first[:50], atol=1e-9)
