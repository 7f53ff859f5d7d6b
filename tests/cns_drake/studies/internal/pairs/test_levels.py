"""The frozen levels: their drives are those that were frozen."""

import csv

from helpers.recorded_traffic import write_rounds
from helpers.small_map import scenario_values, write_small_map
import pytest

from cns_drake.scenarios import make_scenario
from cns_drake.simulation import SimulationSource
from cns_drake.studies.maps.experiment_maps import pairs_by_map
from cns_drake.studies.pairs.changed_pairs import (
    changed_pairs,
    pair_fingerprint,
)
from cns_drake.studies.study import (
    check_frozen,
    drives_fingerprint,
    frozen_drives,
    plan_study,
)
from evaluation.base import Cluster, InputError, fingerprint
from evaluation.recognition import RECORDED_PROTOCOL
from evaluation.study import Pair, Study, StudyDrive, load_experiment
from worlds.maps import worlds_folder

TABLE = "levels.csv"


def run_of(output, *overrides):
    wanted = load_experiment("levels", ["methods=[solid]", *overrides])
    return Study(wanted, output, "levels", Cluster())


@pytest.mark.slow
@pytest.mark.night
def test_the_levels_are_as_they_were_frozen(tmp_path):
    with (worlds_folder() / TABLE).open() as stream:
        frozen = {
            (row["map"], int(row["level"])): row["drives"]
            for row in csv.DictReader(stream)
        }
    assert {level for _, level in frozen} == {0, 1, 2, 3, 4}
    assert frozen_drives(TABLE) == frozen
    found = {}
    run = run_of(tmp_path)
    plan_study(run)
    maps = list(pairs_by_map(run, ()))
    worlds = {}
    for pairs in changed_pairs(run, maps):
        for one in pairs:
            key = one.map_name, one.factors["level"]
            drawn = drives_fingerprint(one, worlds)
            found.setdefault(key, []).append(drawn)
    assert frozen == {
        key: fingerprint({"drives": prints}) for key, prints in found.items()
    }


@pytest.mark.slow
@pytest.mark.sampled(1)
@pytest.mark.parametrize(
    "change",
    [
        "seeds=[4709]",
        "cases.all.database.offset.left=[2.0, 2.4, 2.7, 3.1]",
        "query.frames=100",
        "levels=[3, 4]",
    ],
)
def test_other_drives_are_not_the_frozen_ones(tmp_path, change):
    if change.startswith("levels"):
        # Fewer levels are still those that were frozen.
        plan_study(run_of(tmp_path, change, "maps=[suburbia]"))
        return
    with pytest.raises(InputError, match=rf"{TABLE}: level \d of suburbia: "):
        plan_study(run_of(tmp_path, change, "maps=[suburbia]"))
    plan_study(run_of(tmp_path, change, "maps=[suburbia]", "frozen=null"))


def pair_of(*drives):
    """The drives of a database, and the query."""
    *database, query = (
        StudyDrive(one.name, SimulationSource(one)) for one in drives
    )
    return Pair(
        "small",
        ("a", "b"),
        {},
        1,
        None,
        RECORDED_PROTOCOL,
        tuple(database),
        query,
        RECORDED_PROTOCOL,
    )


def test_a_rebuilt_city_is_not_the_frozen_one(tmp_path):
    values = scenario_values(write_small_map(tmp_path / "small"))
    drive = make_scenario(values, "test")
    compared = pair_of(drive, drive)
    before = drives_fingerprint(compared, {})
    assert drives_fingerprint(compared, {}) == before
    known = pair_fingerprint(compared, [drive, drive])
    world = drive.world_file
    world.write_text(world.read_text().replace("<world", "<!-- new --><world"))
    assert drives_fingerprint(compared, {}) != before
    # The drives alone do not show it.
    assert pair_fingerprint(compared, [drive, drive]) == known
    # Neither does the city of another session hide behind the first one's.
    former = drive.replaced(stage="01" if drive.stage != "01" else "04")
    several = pair_of(drive, former, drive)
    assert pair_fingerprint(several, [drive, former, drive]) != known
    before = drives_fingerprint(several, {})
    world = former.world_file
    assert world != drive.world_file
    world.write_text(world.read_text().replace("<world", "<!-- new --><world"))
    assert drives_fingerprint(several, {}) != before


def test_other_traffic_of_a_map_is_not_the_frozen_one(tmp_path):
    """Also where the database, of the same world, has none."""
    folder = write_small_map(tmp_path / "small")
    drive = make_scenario(scenario_values(folder), "test")
    compared = pair_of(drive, drive.with_traffic(3))
    found = set()
    for vehicles in (20, 30):
        write_rounds(drive.folder.traffic, vehicles)
        found.add(drives_fingerprint(compared, {}))
    assert len(found) == 2


def test_maps_of_ones_own_are_not_frozen():
    known = {("town", 1): ["any"], ("suburbia", 9): ["any"]}
    check_frozen(TABLE, known)
    with pytest.raises(InputError, match="level 1 of suburbia"):
        check_frozen(TABLE, known | {("suburbia", 1): ["any"]})
    with pytest.raises(InputError, match=r"nothing\.csv"):
        check_frozen("nothing.csv", known)


def test_levels_of_a_table_are_numbers(tmp_path):
    table = tmp_path / "frozen.csv"
    table.write_text("map,level,drives\ntown,1,a\ntown,high,b\n")
    with pytest.raises(InputError, match=f"^{table}: line 3: level: 'high' is"):
        frozen_drives(str(table))
