"""Which recordings are the shipped drives, whose results the tables have."""

from dataclasses import replace
from pathlib import Path

import pytest

from cns_drake import load_scenario
from cns_drake.scenarios import describe_scenario
from evaluation.study import RecordingInfo, scenario_digest
from evaluation.study.recordings.map_drives import unlike_shipped
from worlds.maps import recordable_drives


def recording(name, **changes):
    scenario = load_scenario(name).replaced(**changes)
    digest = scenario_digest(describe_scenario(scenario))
    return RecordingInfo(name, Path(name), "a", "01", None, scenario=digest)


def test_all_shipped_drives_are_known():
    """Otherwise, their digests in shipped_drives.csv are old."""
    drives = [recording(name) for name in recordable_drives()]
    assert len(drives) == 12
    assert unlike_shipped(drives) == ""
    for one in drives:
        other = replace(one, scenario="else")
        assert unlike_shipped([other]).startswith(f"{one.name} has other")


@pytest.mark.parametrize(
    ("changes", "is_other"),
    [
        ({"title": "Mine", "frames": 20}, False),
        ({"seed": 3}, True),
        ({"aside": 1.0}, True),
        ({"without": ("office_001",)}, True),
    ],
)
def test_a_drive_with_other_settings_is_another_one(changes, is_other):
    found = unlike_shipped([recording("riverside_01", **changes)])
    assert bool(found) is is_other


def test_drives_of_other_names_have_no_shipped_results():
    own = replace(recording("riverside_01"), name="mine_01", scenario="else")
    assert unlike_shipped([own]) == ""
