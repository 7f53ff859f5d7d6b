"""Places elsewhere: drives through other cities."""

from pathlib import Path

from helpers.small_map import scenario_values, write_small_map
import pytest

from cns_drake.base import Cluster
from cns_drake.scenarios import load_scenario, make_scenario
from cns_drake.studies import study
from cns_drake.studies.study import distracting_drives


def test_drives_are_of_other_cities(tmp_path):
    query = load_scenario("metropolis_04").with_lidar("vlp-16")
    drives = distracting_drives(query, 1000, 5.0, tmp_path, Cluster())
    # Some 250 to 350 places each.
    assert 3 <= len(drives) <= 5
    assert all("metropolis" not in drive.name for drive in drives)
    assert len({drive.name for drive in drives}) == len(drives)
    assert all(drive.lidars == query.lidars for drive in drives)
    assert distracting_drives(query, 0, 5.0, tmp_path, Cluster()) == []


@pytest.fixture
def drawn(monkeypatch):
    """Cities that are drawn anew; each drive has one place."""
    found = []

    def redraw(folder, stage, seeds, output, cluster):
        found.append((folder.name, *seeds))
        return {seed: output / f"{folder.name}_c{seed}" for seed in seeds}

    monkeypatch.setattr(study, "redraw_cities", redraw)
    monkeypatch.setattr(study, "_num_places", lambda *_: 1)
    return found


def test_many_drives_have_twin_blocks(tmp_path, drawn):
    query = load_scenario("suburbia_02")
    notes = []
    drives = distracting_drives(
        query, 40, 5.0, tmp_path, Cluster(), notes.append
    )
    assert notes == [
        "suburbia_02: looking for 40 places elsewhere",
        "suburbia_02: found 20 places elsewhere",
        "suburbia_02: found 40 places elsewhere",
    ]
    maps = [Path(drive.map).name for drive in drives]
    # Ten shipped drives of the others, two of the same streets, and so on.
    assert maps.index("suburbia_c1") == 10
    assert maps.count("suburbia_c1") == 2
    assert "suburbia" not in maps
    assert drawn == [("suburbia", 1), ("downtown", 1)]
    assert len({drive.name for drive in drives}) == 40


def test_a_map_of_ones_own_is_not_drawn_anew(tmp_path, drawn):
    town = write_small_map(tmp_path / "town")
    values = scenario_values(town) | {"name": "town_04", "frames": 3}
    drives = distracting_drives(
        make_scenario(values, "test"), 12, 5.0, tmp_path, Cluster()
    )
    assert len(drives) == 12
    assert not drawn
