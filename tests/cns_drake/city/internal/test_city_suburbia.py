"""The gardens, streets, park and village of Suburbia."""

from functools import cache, partial
import itertools

from helpers.internal.shipped_cities import network_of, structures_of, world_of
import pytest
import shapely
from shapely.geometry import LineString, Point, box

from cns_drake.city import load_stages

pytestmark = pytest.mark.slow

ENCLOSURES = ("hedge", "picket_fence", "garden_wall")
HOUSES = ("detached_house", "semi_detached", "bungalow")

network = partial(network_of, "suburbia")
structures = partial(structures_of, "suburbia")


def named(*stems):
    return [
        s for s in structures().values() if s.name.rsplit("_", 1)[0] in stems
    ]


@cache
def absent():
    path = world_of("suburbia") / "stages.yaml"
    return load_stages(path, list(structures())).absent("01")


def test_every_junction_is_a_t():
    assert len(network().junctions) == 8
    assert all(len(j.arms) == 3 for j in network().junctions.values())


def test_gardens_in_the_west_are_enclosed():
    """Driveways are nearly the only ways out, as seen from the houses."""
    runs = shapely.union_all(
        [
            s.footprint_W.buffer(0.1)
            for s in named(*ENCLOSURES)
            if "gardens" in s.tags
        ]
    )
    for x, least in ((-14.3, 0.75), (-49.2, 0.9)):
        line = LineString([(x, -300.0), (x, -112.0)])
        assert line.intersection(runs).length > least * line.length
    # Between most neighbours in a row a fence runs from front to back.
    houses = sorted(
        (s.xyz[1] for s in named(*HOUSES) if -34 < s.xyz[0] < -14),
    )
    assert len(houses) >= 8
    parted = sum(
        LineString([(-41.0, a), (-41.0, b)]).intersects(runs)
        for a, b in itertools.pairwise(houses)
    )
    assert parted >= 6


def test_houses_have_gardens_with_plants():
    plants = shapely.MultiPoint(
        [s.xyz[:2] for s in structures().values() if is_plant(s)]
    )
    for house in named(*HOUSES):
        around = house.footprint_W.buffer(12.0)
        assert len(shapely.get_parts(around.intersection(plants))) >= 2


def is_plant(structure) -> bool:
    return structure.semantic_class == "vegetation"


def test_cars_stand_outside_the_lanes_in_bays_and_drives():
    lanes = network().areas.lane_area
    shapely.prepare(lanes)
    cars = [s for s in structures().values() if s.semantic_class == "car"]
    assert len(cars) > 60
    for car in cars:
        assert not lanes.intersects(car.footprint_W), car.name
    bays = network().areas.parking_bays
    roads = {s.tags[1] for s in cars if s.tags[0] == "bay"}
    assert roads == {name for name, _ in bays}
    for car in cars:
        if car.tags[0] == "bay":
            bay = shapely.union_all(
                [area for (name, _), area in bays.items() if name in car.tags]
            )
            assert bay.contains(Point(car.xyz[:2])), car.name


@pytest.mark.parametrize(
    ("area", "stems", "least"),
    [
        # The shopping street and the church beside it.
        ((46, -240, 132, -190), ("shop_house", "shop_strip"), 2),
        ((140, -235, 185, -195), ("church",), 1),
        # The park, and the tree line along its northern street.
        ((-3, -186, 112, -110), ("park_pavilion", "boat_shed"), 2),
        ((-3, -119, 112, -110), ("tree",), 12),
        # The old farm, and the hedgerows around the fields.
        ((-95, -370, -40, -310), ("old_farm_barn", "old_farm_house"), 3),
        ((-95, -31, 283, -15), ("tree", "shrub"), 30),
    ],
)  # fmt: skip
def test_the_village_has(area, stems, least):
    inside = [
        s
        for s in named(*stems)
        if box(*area).contains(Point(s.xyz[:2])) and s.name not in absent()
    ]
    assert len(inside) >= least


def test_the_village_has_no_apartment_blocks_yet():
    assert {s.name for s in named("balcony_flats")} <= absent()
    assert {s.name for s in named("bungalow")} & absent()
    assert not {s.name for s in named("church", "school")} & absent()


def test_the_pond_lies_below_the_lawn():
    water = structures()["ground_park_water"]
    mesh = next(iter(water.model.meshes.values()))
    assert mesh.vertices[:, 2].max() < 0.0
    assert water.model.footprint.area > 200


def test_stage_01_is_not_bare():
    """Part of the village is close to every point of the drive."""
    left = shapely.MultiPoint(
        [
            s.xyz[:2]
            for s in structures().values()
            if s.name not in absent()
            and s.semantic_class in ("building", "vegetation", "fence")
        ]
    )
    for road in network().roads.values():
        for x, y, *_ in road.evaluate(road.stations())[::10]:
            near = Point(x, y).buffer(60.0).intersection(left)
            assert len(shapely.get_parts(near)) >= 3, (road.name, x, y)


def test_nothing_hangs_on_missing_structures():
    """Street furniture stays; a cleared lot has no cars."""
    for name in absent():
        assert not name.startswith("lamp"), name
    lots = [
        structures()[name].footprint_W.buffer(1.0)
        for name in absent()
        if structures()[name].semantic_class == "building"
    ]
    lots = shapely.union_all(lots)
    shapely.prepare(lots)
    for structure in structures().values():
        if structure.semantic_class == "car" and structure.name not in absent():
            assert not lots.intersects(structure.footprint_W)
