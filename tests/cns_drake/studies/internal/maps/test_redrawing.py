"""Cities drawn anew on the same streets: complete, or not written."""

import csv
import os
import shutil

from helpers import city_checks
from helpers.internal import studies
from helpers.small_city import ROADS, STAGES, write_small_city
import pytest
import yaml

from cns_drake.base import Cluster, InputError, Reporter
from cns_drake.city import (
    differing_files,
    generate_city,
    load_plan,
    load_stages,
    make_city,
)
from cns_drake.city.generation import generate
from cns_drake.roads import load_road_network
from cns_drake.scene import load_world, structures_in
from cns_drake.studies.maps import map_step
from cns_drake.studies.maps.redrawing import (
    RedrawCity,
    redraw_cities,
    redrawn_inputs,
)

pytestmark = pytest.mark.slow

SEED = 3  # Draws the small city.


@pytest.fixture
def town(tmp_path):
    return write_small_city(tmp_path / "town")


@pytest.fixture(scope="module")
def drawn(tmp_path_factory):
    """Returns the small city as generated, and seed -> city drawn anew."""
    folder = tmp_path_factory.mktemp("drawn")
    town = write_small_city(folder / "town")
    cities = redraw_here(town, [SEED, 4], folder / "cities")
    generate_city(town)
    return town, cities


def redraw_here(town, seeds, output):
    """Draws cities in the process of the test."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(
            map_step,
            "run_jobs",
            lambda jobs, cluster, unit="": studies.do(jobs),
        )
        return redraw_cities(town, "02", seeds, output, Cluster())


def contents(folder):
    """Returns path -> bytes of all files below a folder."""
    return {
        path.relative_to(folder).as_posix(): path.read_bytes()
        for path in folder.rglob("*")
        if path.is_file()
    }


def test_only_the_seed_of_the_inputs_is_another(town):
    inputs = redrawn_inputs(town, "02", 7)
    assert inputs["roads.yaml"] == ROADS.encode()
    for name, content in inputs.items():
        (town / name).write_bytes(content)
    plan = load_plan(town / "city.yaml")
    assert plan.seed == 7
    before = load_plan(write_small_city(town / "again") / "city.yaml")
    assert plan == before.model_copy(update={"seed": 7})
    stages = load_stages(town / "stages.yaml", [])
    assert list(stages.stages) == ["02"]
    for name in ("city.yaml", "stages.yaml"):
        assert inputs[name].startswith(b"# Of a city drawn anew by cns-drake")


def test_with_its_own_seed_a_city_is_as_it_was(drawn):
    town, cities = drawn
    before, after = contents(town), contents(cities[SEED])
    del after["drawn.data"]
    for name in ("stage_01.sdf", "stages.yaml", "city.yaml"):
        del before[name]
        after.pop(name, None)
    last = after.pop("stage_02.sdf").decode()
    assert last.count(f"town_c{SEED}") == 3
    assert last.replace(f"town_c{SEED}", "town") == (
        before.pop("stage_02.sdf").decode()
    )
    # Structures of stage 01 alone: objects on lots, and lower buildings.
    table = before.pop("structures.csv").decode().splitlines()
    assert after.pop("structures.csv").decode().splitlines() == [
        row for row in table if "_lot_" not in row
    ]
    assert after.items() <= before.items()
    assert all(name.startswith("meshes") for name in before.keys() - after)


def test_another_seed_gives_another_city_on_the_same_streets(drawn):
    town, cities = drawn
    folder = cities[4]
    assert folder.name == "town_c4"
    assert (folder / "roads.yaml").read_bytes() == ROADS.encode()
    before, after = make_city(town).structures, make_city(folder).structures
    streets, streets_after = (
        {
            name: mesh.to_obj()
            for s in city
            if s.name.startswith(("carriageway", "sidewalk", "markings"))
            for name, mesh in s.model.meshes.items()
        }
        for city in (before, after)
    )
    assert len(streets) >= 3
    assert streets_after == streets
    places = [
        {s.xyz for s in city if s.semantic_class == "vegetation"}
        for city in (before, after)
    ]
    assert len(places[0] & places[1]) < 0.1 * len(places[0])
    standing = [s for s in after if not city_checks.is_ground(s)]
    network = load_road_network(folder / "roads.yaml")
    city_checks.check_no_structure_stands_in_another(standing)
    city_checks.check_no_structure_stands_in_a_lane(standing, network)
    city_checks.check_nothing_low_reaches_far_out_of_its_footprint(
        standing, network
    )


@pytest.mark.night
def test_the_folder_is_a_map_like_any_other(drawn):
    folder = drawn[1][4]
    assert differing_files(folder) == []
    with (folder / "structures.csv").open() as table:
        names = {row["name"] for row in csv.DictReader(table)}
    assert structures_in(load_world(folder / "stage_02.sdf")) == names
    assert [p.name for p in folder.glob("stage_*.sdf")] == ["stage_02.sdf"]


@pytest.mark.night
def test_drawn_by_processes_or_here_the_bytes_are_the_same(drawn, tmp_path):
    town, cities = drawn
    again = redraw_cities(
        town, "02", [4, SEED], tmp_path / "deep" / "cities", Cluster(2)
    )
    assert list(again) == [4, SEED]
    for seed, folder in again.items():
        assert contents(folder) == contents(cities[seed])
    # The folder has nothing else: no lock, no unfinished file.
    assert sorted(p.name for p in again[4].parent.iterdir()) == [
        "town_c3",
        "town_c4",
    ]


def test_finished_cities_are_kept(town, drawn, tmp_path, monkeypatch):
    output = tmp_path / "cities"
    folder = copied(drawn, output)
    monkeypatch.setattr(
        generate, "generate_city", lambda *_: pytest.fail("drawn again")
    )
    assert redraw_here(town, [4], output) == {4: folder}
    # Neither the gaps of the map's own stages nor its folder matters.
    (town / "stages.yaml").write_text(STAGES.replace("tree_002", "tree_003"))
    moved = tmp_path / "elsewhere"
    moved.mkdir()
    town.rename(moved / "town")
    assert redraw_here(moved / "town", [4], output) == {4: folder}


def copied(drawn, output):
    """Returns a copy of the city of seed 4, in a new folder."""
    _, cities = drawn
    return shutil.copytree(cities[4], output / cities[4].name)


@pytest.mark.parametrize("change", ["plan", "roads", "program"])
def test_what_was_drawn_of_something_else_is_replaced(
    town, drawn, tmp_path, monkeypatch, change
):
    folder = copied(drawn, tmp_path / "cities")
    (folder / "meshes" / "old.obj").touch()
    if change == "program":
        monkeypatch.setattr(RedrawCity, "version", 2)
    else:
        file = town / {"plan": "city.yaml", "roads": "roads.yaml"}[change]
        text = file.read_text()
        old, new = {
            "plan": ("height: 20", "height: 23"),
            "roads": ("speed_limit: 10.0", "speed_limit: 9.0"),
        }[change]
        assert old in text
        file.write_text(text.replace(old, new))
    step = RedrawCity(folder, town, "02", 4)
    assert not step.is_done()
    if change != "program":
        return  # To draw it anew is the same for all changes.
    notes = []
    step.run(Reporter(lambda kind, text: notes.append(text)))
    assert notes == [f"{folder}: replaced, since its inputs have changed"]
    assert step.is_done()
    found, expected = contents(folder), contents(drawn[1][4])
    assert found.pop("drawn.data") != expected.pop("drawn.data")
    assert found == expected


@pytest.mark.parametrize("other", ["file", "empty folder", "map", "nowhere"])
def test_anything_else_of_that_name_is_left_alone(town, tmp_path, other):
    folder = tmp_path / "cities" / "town_c4"
    folder.parent.mkdir()
    if other == "file":
        folder.write_text("mine")
    elif other == "empty folder":
        folder.mkdir()
    elif other == "map":
        write_small_city(folder)
    else:
        folder.symlink_to(tmp_path / "nowhere")
    before = contents(tmp_path)
    with pytest.raises(
        InputError, match=r"town_c4: this folder is there already"
    ):
        redraw_here(town, [5, 4], folder.parent)
    # The job does not use it either if it appears meanwhile.
    with pytest.raises(
        InputError, match=r"town_c4: this folder is there already"
    ):
        RedrawCity(folder, town, "02", 4).run(Reporter())
    assert contents(tmp_path) == before
    assert [p.name for p in folder.parent.iterdir()] == ["town_c4"]


@pytest.mark.night
def test_an_interrupted_run_leaves_nothing_and_goes_on(
    town, tmp_path, monkeypatch
):
    output = tmp_path / "cities"
    replace = os.replace
    calls = []

    def interrupted(source, target):
        calls.append(target)
        if len(calls) == 5:
            raise KeyboardInterrupt
        replace(source, target)

    with monkeypatch.context() as patch:
        patch.setattr(os, "replace", interrupted)
        with pytest.raises(KeyboardInterrupt):
            redraw_here(town, [4], output)
    assert list(output.iterdir()) == []
    # A killed process could not clean up.
    (output / "town_c4.part" / "town_c4" / "meshes").mkdir(parents=True)
    (output / "town_c4.part" / "town_c4" / "meshes" / "old.obj").touch()
    folder = redraw_here(town, [4], output)[4]
    assert list(output.iterdir()) == [folder]
    assert not (folder / "meshes" / "old.obj").exists()


@pytest.mark.parametrize(
    ("file", "old", "new", "fault"),
    [
        ("city.yaml", "seed: 3", "sead: 3", "{town}/city.yaml: sead: "),
        ("city.yaml", "office: 1", "ofice: 1", "{town}: seed 4: city.yaml: "),
        ("city.yaml", "[30, -21]", "[30, 9]", "{town}: seed 4: city.yaml: "),
        ("roads.yaml", "west, end", "vest, end", "{town}: seed 4: roads.yaml"),
    ],
)
def test_a_city_that_cannot_be_drawn_is_one_line(
    town, tmp_path, file, old, new, fault
):
    text = (town / file).read_text()
    assert old in text
    (town / file).write_text(text.replace(old, new))
    with pytest.raises(InputError) as caught:
        redraw_here(town, [4], tmp_path / "cities")
    assert str(caught.value).startswith(fault.format(town=town))
    assert "\n" not in str(caught.value)
    assert not list(tmp_path.glob("cities/*"))


@pytest.mark.night
def test_all_that_cannot_be_drawn_are_named(town, tmp_path):
    plan = yaml.safe_load((town / "city.yaml").read_text())
    plan["cars"] = {"salon": 1}
    (town / "city.yaml").write_text(yaml.safe_dump(plan))
    with pytest.raises(InputError) as caught:
        redraw_cities(town, "02", [4, 5], tmp_path / "cities", Cluster(2))
    for seed in (4, 5):
        assert f"seed {seed}: city.yaml: cars: unknown" in str(caught.value)


def test_a_folder_of_cities_that_is_none_is_named(town, tmp_path):
    output = tmp_path / "cities"
    output.write_text("a file")
    with pytest.raises(InputError, match="/cities: not a folder"):
        redraw_here(town, [4], output)
