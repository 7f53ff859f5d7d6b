"""Scenarios that are written to files."""

from helpers.small_map import scenario_values, write_small_map
import yaml

from cns_drake.scenarios import load_scenario, write_scenarios


def test_written_scenarios_are_the_same(tmp_path):
    scenarios = [
        load_scenario("metropolis_01").with_lidar("vlp-16"),
        load_scenario("metropolis_02").replaced(without=("bench_1",)),
    ]
    paths = write_scenarios(scenarios, tmp_path / "new" / "members")
    assert [load_scenario(path) for path in paths] == scenarios


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
