"""The committed files of the cities equal the generator's files."""

import csv
import itertools
import xml.etree.ElementTree as ElementTree

from helpers.city_checks import (
    check_no_structure_stands_in_a_lane,
    check_no_structure_stands_in_another,
    check_nothing_low_reaches_far_out_of_its_footprint,
    is_ground,
)
from helpers.internal.shipped_cities import (
    LAST_STAGES,
    by_day_or_night,
    city,
    drawn,
    network_of,
    parse_strictly,
    stage_files,
    structure_of,
    visuals,
    world_of,
)
from pydrake.geometry import Role
import pytest
import yaml

from worlds.city import load_stages
from worlds.shapes import CLASS_IDS, STRUCTURES_NAME

pytestmark = pytest.mark.slow

MEGABYTE = 1_000_000


def files(world) -> dict[str, bytes]:
    """Returns all generated files of a world folder by relative path."""
    found = [
        *world.glob("stage_*.sdf"),
        *world.glob("meshes/*"),
        world / STRUCTURES_NAME,
    ]
    return {str(p.relative_to(world)): p.read_bytes() for p in found}


@pytest.fixture(scope="module", params=by_day_or_night())
def name(request):
    return request.param


@pytest.fixture(scope="module")
def stages(name):
    return load_stages(
        world_of(name) / "stages.yaml",
        [s.name for s in city(name).structures],
    )


@pytest.fixture(scope="module")
def standing(name):
    """Stage -> its structures."""
    return drawn(name).standing


def lot_of(structure: str) -> str:
    """Returns the building that later stands on the lot of a structure."""
    return structure.partition("_lot_")[0] if "_lot_" in structure else ""


def test_generating_anew_gives_the_committed_bytes(name):
    new, old = drawn(name).texts, files(world_of(name))
    assert sorted(new) == sorted(old)
    changed = [name for name in new if new[name].encode() != old[name]]
    assert changed == []


def test_stages_differ_by_the_listed_names_only(name, stages):
    whole = visuals(stage_files(name)[-1])
    names = {s.name for s in city(name).structures}
    assert {structure_of(v) for v in whole} == names
    previous: set[str] = set()
    for path in stage_files(name):
        stage = path.stem.removeprefix("stage_")
        present = visuals(path)
        absent = stages.absent(stage)
        sites = stages.sites(stage).keys()
        standing = {structure_of(v) for v in present}
        on_lots = {n for n in standing if lot_of(n)}
        assert standing - on_lots == names - absent | sites
        assert {lot_of(n) for n in on_lots} <= absent - sites
        grown = absent | stages.heights(stage).keys() | sites
        assert {
            visual: shape
            for visual, shape in present.items()
            if structure_of(visual) not in grown | on_lots
        } == {
            visual: shape
            for visual, shape in whole.items()
            if structure_of(visual) not in grown
        }
        assert previous <= standing
        previous = standing - on_lots


def test_nothing_stands_in_another_or_in_a_lane(name, standing):
    network = network_of(name)
    for structures in standing.values():
        above = [s for s in structures if not is_ground(s)]
        check_no_structure_stands_in_another(above)
        check_no_structure_stands_in_a_lane(above, network)
        lots = [s for s in above if lot_of(s.name)]
        check_nothing_low_reaches_far_out_of_its_footprint(lots, network)


def test_the_list_of_stages_is_complete(name, stages):
    assert [p.stem for p in stage_files(name)] == [
        f"stage_{stage}" for stage in stages.stages
    ]
    names = list(stages.stages)
    assert (names[0], names[-1]) == ("01", LAST_STAGES[name])
    buildings = {
        s.name for s in city(name).structures if s.semantic_class == "building"
    }
    # Most buildings stand from the first stage on, because the city grew.
    assert 10 < len(buildings & stages.absent("01")) < len(buildings) / 2


def test_cities_change_by_whole_buildings(name, stages, standing):
    """At least four of five buildings that differ are new, in each pair."""
    shapes = {
        stage: {
            s.name: s.model
            for s in structures
            if s.semantic_class == "building"
        }
        for stage, structures in standing.items()
    }
    for earlier, later in itertools.combinations(stages.stages, 2):
        before, after = shapes[earlier], shapes[later]
        assert before.keys() < after.keys()
        new = after.keys() - before.keys()
        # What does not change has the same model in all stages.
        differ = {n for n in before if before[n] is not after[n]}
        assert len(new) >= 4 * len(differ), (earlier, later)


def test_something_else_is_on_most_lots_that_are_not_built_on(name, standing):
    first, *_, last = standing.values()
    buildings = {s.name for s in last if s.semantic_class == "building"}
    open_lots = buildings - {s.name for s in first}
    used = {lot_of(s.name) for s in first} & open_lots
    assert len(used) > len(open_lots) / 2


def test_the_ground_is_there_at_all_stages(name, stages):
    ground = {s.name for s in city(name).structures if "ground" in s.tags}
    assert len(ground) > 10
    assert not ground & (stages.absent("01") | stages.heights("01").keys())


def test_the_table_names_every_structure_once(name):
    with (world_of(name) / STRUCTURES_NAME).open(newline="") as file:
        rows = list(csv.DictReader(file))
    structures = drawn(name).structures
    assert [int(row["instance"]) for row in rows] == list(
        range(1, len(structures) + 1)
    )
    assert [row["name"] for row in rows] == [s.name for s in structures]
    for row, structure in zip(rows, structures, strict=True):
        assert row["class"] == structure.semantic_class
        assert int(row["label"]) == CLASS_IDS[row["class"]]
        for axis, value in zip("xyz", structure.xyz, strict=True):
            assert float(row[axis]) == pytest.approx(value, abs=5.1e-4)
        assert float(row["yaw"]) == pytest.approx(structure.yaw, abs=5.1e-6)


def test_meshes_are_neither_missing_nor_orphaned(name):
    world = world_of(name)
    used = set()
    for path in stage_files(name):
        for uri in ElementTree.parse(path).iter("uri"):
            assert (world / uri.text).is_file(), uri.text
            used.add(uri.text)
    there = {f"meshes/{p.name}" for p in (world / "meshes").iterdir()}
    assert used == there


def test_a_stage_is_one_static_link_without_collision(name):
    for path in stage_files(name):
        root = ElementTree.parse(path).getroot()
        assert [m.findtext("static") for m in root.iter("model")] == ["true"]
        assert len(list(root.iter("link"))) == 1
        assert not list(root.iter("collision"))


def test_budgets(name):
    world = world_of(name)
    size = sum(map(len, files(world).values()))
    assert size <= 20 * MEGABYTE
    triangles = {
        p.name: _count_triangles(p) for p in (world / "meshes").iterdir()
    }
    for path in stage_files(name):
        assert 1000 < len(visuals(path)) < 7000
        uris = ElementTree.parse(path).iter("uri")
        names = [uri.text.removeprefix("meshes/") for uri in uris]
        assert sum(triangles[name] for name in names) <= 1_500_000


@pytest.mark.parametrize(
    "stages",
    [slice(-1, None), pytest.param(slice(0, -1), marks=pytest.mark.night)],
)
def test_drake_finds_each_visual(name, stages):
    """All stages are written alike; Drake takes a second for each."""
    for path in stage_files(name)[stages]:
        inspector = parse_strictly(path).model_inspector()
        ids = inspector.GetAllGeometryIds(Role.kPerception)
        names = [inspector.GetName(one).rpartition("::")[2] for one in ids]
        assert sorted(names) == sorted(visuals(path))


def _count_triangles(path) -> int:
    lines = path.read_text().splitlines()
    return sum(len(x.split()) - 3 for x in lines if x.startswith("f "))


def test_stories_are_shown(name):
    path = world_of(name) / "stages.yaml"
    raw = yaml.safe_load(path.read_text())
    for stage in raw["stages"].values():
        assert len(stage["story"].split()) > 10
