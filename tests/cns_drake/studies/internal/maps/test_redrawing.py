"""Cities drawn anew on the same streets: complete, or not written."""

import os

from helpers import city_checks
from helpers.internal import studies
from helpers.small_city import ROADS, write_small_city
import pytest

from cns_drake.scenarios import RedrawCity, map_step, redrawn_inputs
from evaluation.base import Cluster
from worlds.city import generate_city, load_plan, load_stages, make_city
from worlds.roads import load_road_network

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
    """Draws cities in the process of the test; returns seed -> folder."""
    cities = {
        seed: RedrawCity(output / f"{town.name}_c{seed}", town, "02", seed)
        for seed in seeds
    }
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(
            map_step,
            "run_jobs",
            lambda jobs, cluster, unit="": studies.do(jobs),
        )
        map_step.make_maps([*cities.values()], output, Cluster())
    return {seed: city.folder for seed, city in cities.items()}


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
    folder = redraw_here(town, [4], output)[4]
    assert list(output.iterdir()) == [folder]
