"""Plans of a small city, and their faults in one line."""

from helpers.city_checks import check_things_stand_on_the_ground
from helpers.small_city import PLAN, ROADS, write_small_city
import numpy as np
import pytest
import shapely

from evaluation.base import InputError
from worlds.city import City, make_city


@pytest.fixture
def lay_out_text(tmp_path):
    """Returns a function that turns the text of a plan into a city."""
    world = write_small_city(tmp_path / "town")

    def make(text: str, roads: str = ROADS) -> City:
        (world / "city.yaml").write_text(text)
        (world / "roads.yaml").write_text(roads)
        return make_city(world)

    return make


def standing(city: City, district: str) -> dict:
    """Returns a district's structures by place."""
    return {
        (s.semantic_class, s.xyz, s.yaw): s.model
        for s in city.structures
        if s.tags[0] == district
    }


@pytest.mark.slow
def test_it_builds_rows_along_the_streets(lay_out_text):
    city = lay_out_text(PLAN)
    houses = [s for s in city.structures if s.tags[0] == "north_block"]
    assert len(houses) > 8
    kinds = {s.tags[1] for s in houses}
    assert kinds == {"brick_block", "office"}
    roads = shapely.union_all(
        [s.model.footprint for s in city.structures if s.name == "sidewalks"]
    )
    for house in houses:
        assert roads.distance(house.footprint_W) > 1.8
        # The front, edge y = least of S, is the side at the street.
        x0, y0, x1, y1 = house.model.footprint.bounds
        sides = [
            roads.distance(shapely.Point(house.p_WP((x, y, 0.0))[:2]))
            for x, y in (
                ((x0 + x1) / 2, y0),
                ((x0 + x1) / 2, y1),
                (x0, (y0 + y1) / 2),
                (x1, (y0 + y1) / 2),
            )
        ]
        assert sides[0] == pytest.approx(2.0, abs=0.6)
        assert sides[1] > sides[0] + 5


@pytest.mark.slow
def test_relief_leaves_paths_buildings_and_borders_level(lay_out_text):
    city = lay_out_text(PLAN)
    ground = {s.name: s for s in city.structures if s.tags == ("ground",)}
    lawn = ground["ground_south_block_lawn"]
    vertices = np.concatenate(
        [mesh.vertices for mesh in lawn.model.meshes.values()]
    )
    assert 0.8 < vertices[:, 2].max() < 0.12 + 1.5
    assert vertices[:, 2].min() >= 0.12 - 1e-9
    area = lawn.model.footprint
    border = shapely.points(vertices[:, :2])
    on_border = area.boundary.distance(border) < 1e-6
    assert on_border.sum() > 20
    np.testing.assert_allclose(vertices[on_border, 2], 0.12, atol=1e-9)
    office = next(s for s in city.structures if s.name == "office_001")
    under = shapely.contains_xy(office.footprint_W, *vertices[:, :2].T)
    np.testing.assert_allclose(vertices[under, 2], 0.12, atol=1e-9)
    trees = [
        s
        for s in city.structures
        if s.name.startswith("tree") and s.tags[0] == "south_block"
    ]
    assert len(trees) > 10
    # Trees stand on the swells, not under them.
    assert max(s.xyz[2] for s in trees) > 0.5


@pytest.mark.night
@pytest.mark.slow
@pytest.mark.night
def test_things_stand_on_the_ground_and_cars_in_bays(lay_out_text):
    city = lay_out_text(PLAN)
    check_things_stand_on_the_ground(city.structures)
    bays = [s for s in city.structures if s.tags[0] == "bay"]
    assert len(bays) > 5
    assert {s.xyz[2] for s in bays} == {0.0}
    signs = [s for s in city.structures if s.semantic_class == "traffic-sign"]
    assert len(signs) > 5
    assert {s.xyz[2] for s in signs} == {0.12}


@pytest.mark.slow
@pytest.mark.night
def test_a_district_does_not_disturb_another(lay_out_text):
    before = lay_out_text(PLAN)
    after = lay_out_text(
        PLAN.replace("height: [14, 20]", "height: [20, 30], fill: 0.7")
    )
    assert standing(before, "north_block").keys() != (
        standing(after, "north_block").keys()
    )
    south, same = (
        standing(before, "south_block"),
        standing(after, "south_block"),
    )
    assert south.keys() == same.keys()
    for key, model in south.items():
        names = [part.shape for part in model.parts]
        assert len(names) == len(same[key].parts)
        assert model.footprint.equals(same[key].footprint)


@pytest.mark.slow
@pytest.mark.night
def test_the_seed_matters_and_nothing_else_does(lay_out_text):
    first, again = lay_out_text(PLAN), lay_out_text(PLAN)
    other = lay_out_text(PLAN.replace("seed: 3", "seed: 4"))
    assert poses(first) == poses(again)
    assert poses(first) != poses(other)


def poses(city: City) -> list:
    return [(s.name, s.xyz, s.yaw) for s in city.structures]


@pytest.mark.sampled(12)
@pytest.mark.parametrize(
    ("old", "new", "fault"),
    [
        ("block: [50, 40]", "block: [0, 0]", "north_block.block: no free"),
        (
            "block: [50, -25]",
            "block: [50, 40]",
            "south_block.block: no free ground",
        ),
        (
            "block: [50, -25]",
            "area: [[0, 0], [9, 9], [9, 0], [0, 9]]",
            "south_block.area: the corners make no simple polygon",
        ),
        ("  - name: outside\n    ground: lawn\n", "", "belong to no district"),
        ("name: outside", "name: north_block", "is there twice"),
        ("name: outside", "name: Outside", "districts.2.name"),
        ("archetype: office", "archetype: officce", "archetype officce"),
        (
            "at: [30, -21]",
            "at: [30, 5]",
            "buildings.0.at: the building reaches out",
        ),
        ("height: 20,", "height: 2000,", "buildings.0: office_"),
        ("at: [70, -28]", "at: [30, -21]", "objects.0.at: the place is taken"),
        (
            "at: [70, -28]}",
            "at: [70, -28], parameters: {wings: 2}}",
            "objects.0.parameters: ",
        ),
        ("size: [16, 14], ", "", "give either size or outline"),
        ("height: [14, 20]", "height: [20, 14]", "20 is greater than 14"),
        ("bounds: [-60", "bounds: [-1000000", "bounds: a side is 1"),
        (PLAN, "", "(top level)"),
    ],
)
def test_faults_are_named_in_one_line(lay_out_text, tmp_path, old, new, fault):
    assert old in PLAN
    with pytest.raises(InputError) as caught:
        lay_out_text(PLAN.replace(old, new))
    message = str(caught.value)
    assert fault in message
    assert message.startswith(str(tmp_path / "town/city.yaml"))
    assert "\n" not in message


@pytest.mark.night
def test_a_median_needs_no_trees(lay_out_text):
    """Trees stand on a road's median only if the plan lists some."""
    roads = ROADS.replace("parking: 2.2", "median: 3.0")
    numbers = []
    for trees in ("trees: {lime_tree: 1}, ", ""):
        plan = PLAN.replace("trees: {lime_tree: 1}, ", trees)
        city = lay_out_text(plan, roads)
        numbers.append(sum(s.tags[0] == "median" for s in city.structures))
    assert numbers[0] > 3
    assert numbers[1] == 0
