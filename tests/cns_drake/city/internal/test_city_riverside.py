"""The river of Riverside and its bridges."""

from functools import partial

from helpers.internal.shipped_cities import (
    ground_triangles,
    network_of,
    structures_of,
)
import numpy as np
import pytest
import shapely
from shapely.geometry import LineString, Point, box

from cns_drake.city import GROUND_TAG

pytestmark = [pytest.mark.slow, pytest.mark.night]

WATER = -2.8
# The river from bank to bank; its quays are at y = -131 and -197.
RIVER = (-182.0, -146.0)
# Points where the middle lines of the four street bridges and of the footbridge
# cross the river's [m].
STREETS = {"ring_west": 0.0, "mill": 90.4, "church": 336.8, "ring_east": 394.4}
FOOTBRIDGE = 204.0

network = partial(network_of, "riverside")
structures = partial(structures_of, "riverside")
triangles_of = partial(ground_triangles, "riverside")


def heights_at(x, y):
    """Returns name -> heights of the ground at a point in W [m]."""
    at = Point(x, y)
    found = {}
    for name, structure in structures().items():
        if GROUND_TAG not in structure.tags or name == "markings":
            continue
        if not structure.model.footprint.intersects(at):
            continue
        heights = set()
        for a, b, c in triangles_of(name):
            edges = np.column_stack([b - a, c - a])[:2]
            if abs(np.linalg.det(edges)) < 1e-6:
                continue  # A wall.
            u, v = np.linalg.solve(edges, (x, y) - a[:2])
            if min(u, v) >= 0 and u + v <= 1:
                z = a[2] + u * (b[2] - a[2]) + v * (c[2] - a[2])
                heights.add(round(float(z), 3))
        if heights:
            found[name] = sorted(heights)
    return found


@pytest.mark.parametrize("x", STREETS.values(), ids=list(STREETS))
@pytest.mark.parametrize("y", [RIVER[0] + 1.3, -170.7, RIVER[1] - 1.3])
def test_streets_cross_the_river_above_water(x, y):
    found = heights_at(x + 1.7, y)
    assert found.pop("carriageway") == [0.0]
    heights = sorted(z for zs in found.values() for z in zs)
    assert heights[0] == WATER
    # The underside is well above the water and below the carriageway.
    assert all(WATER + 1.5 < z < -0.5 for z in heights[1:])
    assert len(heights) == 2


def test_the_footbridge_crosses_the_river_above_water():
    found = heights_at(FOOTBRIDGE + 0.7, -172.3)
    deck = found.pop("ground_river_paved")
    assert deck == pytest.approx([0.15])
    below = sorted(z for zs in found.values() for z in zs)
    assert below[0] == WATER
    assert WATER + 1.5 < below[1] < deck[0] - 0.5


@pytest.mark.parametrize("x", [40.3, 150.7, 250.1, 366.2, 430.9])
def test_between_the_bridges_there_is_open_water(x):
    for y in np.linspace(RIVER[0] + 0.5, RIVER[1] - 0.5, 4):
        assert heights_at(x, y) == {"ground_river_water": [WATER]}
    for y in (RIVER[0] - 0.5, RIVER[1] + 0.5):
        found = heights_at(x, y)
        assert found
        assert min(z for zs in found.values() for z in zs) > 0.1


def test_the_river_has_walls_from_bank_to_bottom():
    """Along both banks, also below the bridges, water meets a wall."""
    for y in RIVER:
        covered = []
        for name in structures():
            if not name.startswith(("quay_river", "bridge_river")):
                continue
            if name.endswith("_water"):
                continue
            triangles = triangles_of(name)
            on = np.ptp(triangles[:, :, 1], axis=1) < 1e-6
            on &= np.abs(triangles[:, 0, 1] - y) < 1e-6
            on &= triangles[:, :, 2].min(axis=1) < WATER + 1e-6
            covered += [
                LineString([(t[:, 0].min(), y), (t[:, 0].max(), y)])
                for t in triangles[on]
            ]
        x0, _, x1, _ = structures()["ground_river_water"].model.footprint.bounds
        length = shapely.union_all(covered).length
        assert length == pytest.approx(x1 - x0, abs=0.01)


def test_every_bridge_has_sides_and_piers():
    bridges = [
        s
        for s in structures().values()
        if s.name.startswith("bridge_river") and not s.name.endswith("_water")
    ]
    assert len(bridges) == 5
    for bridge in bridges:
        parts = {part.name for part in bridge.model.parts}
        assert parts == {"sides", "underside", "abutments", "piers"}
        x0, y0, x1, y1 = bridge.model.footprint.bounds
        assert (y0, y1) == pytest.approx(RIVER)
        sides = bridge.model.meshes[f"{bridge.name}_sides"].vertices
        near = np.minimum(abs(sides[:, 0] - x0), abs(sides[:, 0] - x1))
        assert near.max() < 0.3
        assert sides[:, 2].max() == pytest.approx(0.15)
        piers = bridge.model.meshes[f"{bridge.name}_piers"].vertices
        assert piers[:, 2].min() == pytest.approx(WATER)
        # Boats have room between piers and banks.
        assert piers[:, 1].min() > RIVER[0] + 9
        assert piers[:, 1].max() < RIVER[1] - 9


@pytest.mark.parametrize("x", STREETS.values(), ids=list(STREETS))
def test_parapets_stand_on_both_sides_of_the_street_bridges(x):
    walls = [
        s.footprint_W
        for s in structures().values()
        if s.semantic_class == "fence" and "river" in s.tags
    ]
    lanes = network().areas.lane_area
    for left, right in ((x - 8.5, x - 4.5), (x + 4.5, x + 8.5)):
        strip = box(left, RIVER[0], right, RIVER[1])
        beside = [wall for wall in walls if strip.contains(wall)]
        length = sum(wall.bounds[3] - wall.bounds[1] for wall in beside)
        assert RIVER[1] - RIVER[0] - 1.0 < length < RIVER[1] - RIVER[0]
        assert not any(wall.intersects(lanes) for wall in beside)


def test_the_river_runs_from_bound_to_bound_below_its_banks():
    x0, y0, x1, y1 = structures()["ground_river_water"].model.footprint.bounds
    assert (y0, y1) == pytest.approx(RIVER)
    ground = [
        s.model.footprint.bounds
        for s in structures().values()
        if GROUND_TAG in s.tags
    ]
    # Quay walls are drawn a little longer than the world.
    assert x0 == pytest.approx(min(b[0] for b in ground), abs=0.5)
    assert x1 == pytest.approx(max(b[2] for b in ground), abs=0.5)
    # Structures on the banks stand above the water.
    for structure in structures().values():
        _, y, z = structure.xyz
        if GROUND_TAG not in structure.tags and RIVER[0] - 9 < y < RIVER[1] + 9:
            assert z > WATER + 2.0, structure.name


def test_cars_park_in_bays_and_on_drives_but_in_no_lane():
    lanes = network().areas.lane_area
    shapely.prepare(lanes)
    cars = [s for s in structures().values() if s.semantic_class == "car"]
    for car in cars:
        assert not lanes.intersects(car.footprint_W), car.name
    bays = network().areas.parking_bays
    in_bays = [car for car in cars if car.tags[0] == "bay"]
    assert {car.tags[1] for car in in_bays} == {name for name, _ in bays}
    for car in in_bays:
        assert any(
            area.contains(Point(car.xyz[:2]))
            for (name, _), area in bays.items()
            if name == car.tags[1]
        ), car.name
    # Bays take room from sidewalks, and leave room to walk.
    for (name, _), area in bays.items():
        assert not area.intersects(lanes.buffer(-0.01))
        road = network().roads[name]
        assert road.sidewalk - road.parking > 1.5


def test_front_gardens_are_fenced():
    """Fences line the garden street except at paths and driveways."""
    runs = shapely.union_all(
        [
            s.footprint_W.buffer(0.1)
            for s in structures().values()
            if "gardens" in s.tags
            and s.name.startswith(("hedge", "picket_fence", "garden_wall"))
        ]
    )
    front = LineString([(100.0, -66.4), (301.0, -66.4)])
    assert front.intersection(runs).length > 0.7 * front.length
