"""Scenarios that are written to files."""

import shutil

from helpers.small_map import scenario_values, write_small_map
import pytest
import yaml

from cns_drake.scenarios import load_scenario, write_scenarios
from evaluation.base import InputError
from worlds.maps import shipped_maps


def test_written_scenarios_are_the_same(tmp_path):
    scenarios = [
        load_scenario("metropolis_01").with_lidar("vlp-16"),
        load_scenario("metropolis_02").replaced(without=("bench_1",)),
    ]
    paths = write_scenarios(scenarios, tmp_path / "new" / "members")
    assert [load_scenario(path) for path in paths] == scenarios


def test_null_is_the_default_without_a_base_too(tmp_path):
    plain = scenario_values(write_small_map(tmp_path / "town"))
    for name, values in (
        ("plain", {}),
        ("nulls", dict.fromkeys(("imu", "lidars", "seed", "frames"))),
    ):
        text = yaml.safe_dump(plain | values | {"name": "drive"})
        (tmp_path / f"{name}.yaml").write_text(text)
    found = load_scenario(tmp_path / "nulls.yaml")
    assert found == load_scenario(tmp_path / "plain.yaml")


def test_a_folder_of_cities_and_scenarios_can_be_moved(tmp_path):
    output = tmp_path / "out"
    (output / "cities").mkdir(parents=True)
    town = write_small_map(output / "cities" / "town")
    drive = scenario_values(town) | {"name": "town_01"}
    (tmp_path / "drive.yaml").write_text(yaml.safe_dump(drive))
    scenario = load_scenario(tmp_path / "drive.yaml")
    (path,) = write_scenarios([scenario], output / "scenarios")
    assert load_scenario(path) == scenario
    assert yaml.safe_load(path.read_text())["map"] == "../cities/town"
    moved = tmp_path / "far" / "away"
    moved.parent.mkdir()
    output.rename(moved)
    member = load_scenario(moved / path.relative_to(output))
    assert member.folder.path == moved / "cities" / "town"
    # A map that lies elsewhere stays where it is.
    (path,) = write_scenarios(
        [load_scenario("metropolis_02")], moved / "scenarios"
    )
    assert yaml.safe_load(path.read_text())["map"] == "metropolis"


def test_the_drives_of_a_copied_map_go_through_the_copy(tmp_path):
    shipped = shipped_maps()["metropolis"]
    same, other = tmp_path / "metropolis", tmp_path / "mine"
    for copy in (same, other):
        copy.mkdir()
        for name in ("roads.yaml", "sequence_04.yaml"):
            shutil.copy(shipped / name, copy)
        (copy / "stage_04.sdf").touch()
    scenario = load_scenario(same / "sequence_04.yaml")
    assert scenario.folder.path == same
    assert load_scenario("metropolis_04").folder.path == shipped
    drive = other / "sequence_04.yaml"
    with pytest.raises(InputError, match=r"map: 'metropolis' is the shipped"):
        load_scenario(drive)
    drive.write_text(drive.read_text().replace("map: metropolis", "map: ."))
    assert load_scenario(drive).folder.path == other
    # A drive of one's own in any other folder goes where it says.
    alone = tmp_path / "sequence_04.yaml"
    shutil.copy(shipped / "sequence_04.yaml", alone)
    assert load_scenario(alone).folder.path == shipped
