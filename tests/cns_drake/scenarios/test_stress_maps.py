"""The maps for stress tests: found by name, used by nothing else."""

import re

import pytest

from cns_drake.scenarios import load_scenario
from worlds.maps import (
    recordable_drives,
    recordable_maps,
    shipped_cities,
    shipped_maps,
)


def stress_maps():
    return sorted(shipped_maps().keys() - shipped_cities().keys())


def test_the_cities_are_those_of_the_paper():
    cities = ["downtown", "metropolis", "riverside", "suburbia"]
    assert list(shipped_cities()) == recordable_maps() == cities
    assert len(recordable_drives()) == 12


@pytest.mark.parametrize("name", stress_maps())
def test_a_stress_map_is_driven_by_name_only(name):
    drive = load_scenario(f"{name}_01")
    assert drive.folder.path == shipped_maps()[name]
    assert drive.world_file == shipped_maps()[name] / "stage_01.sdf"
    assert drive.name not in recordable_drives()


@pytest.mark.slow
def test_metropolis_cleared_has_the_last_stage_and_routes_of_metropolis():
    cleared, city = shipped_maps()["metropolis_cleared"], "metropolis"
    folder = shipped_maps()[city]
    for file in ("roads.yaml", "city.yaml", "views.yaml"):
        assert (cleared / file).read_bytes() == (folder / file).read_bytes()
    last = (cleared / "stage_04.sdf").read_text().splitlines()
    own = (folder / "stage_04.sdf").read_text().splitlines()
    changed = [i for i in range(len(own)) if own[i] != last[i]]
    assert len(own) == len(last)
    # A comment, and the names of the world and of its model.
    assert changed == [1, 3, 4]
    used = set(re.findall(r"<uri>(.*?)</uri>", "\n".join(own)))
    for file in used:
        assert (cleared / file).read_bytes() == (folder / file).read_bytes()
    for number in ("01", "02", "03", "04"):
        drives = [load_scenario(f"{m}_{number}") for m in (city, cleared.name)]
        assert drives[0].route == drives[1].route
