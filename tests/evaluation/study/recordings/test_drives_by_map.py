"""Which drives of a map are compared, and which take their places."""

from pathlib import Path

import pytest

from evaluation.base import InputError
from evaluation.study import RecordingInfo, drives_by_map


def info(name, stage, route="a", city="metropolis"):
    path = Path("nowhere") / name
    return RecordingInfo(name, path, city, stage, {"lanes": route})


def test_a_control_takes_the_place_of_one_drive():
    first = info("riverside_01", "01", "a", "riverside")
    last = info("riverside_02", "02", "b", "riverside")
    again = info("riverside_01_stage_02", "02", "a", "riverside")
    before = info("riverside_02_stage_01", "01", "b", "riverside")
    (city,) = drives_by_map([first, last, again])
    assert city.unchanged_pair(first, last) == (again, last)
    assert city.unchanged_pair(last, first) == (last, again)
    (city,) = drives_by_map([first, last, before])
    assert city.unchanged_pair(first, last) == (first, before)
    # With both, the queries keep their scans.
    (city,) = drives_by_map([first, last, before, again])
    assert city.unchanged_pair(first, last) == (again, last)
    assert city.unchanged_pair(last, first) == (before, first)
    (city,) = drives_by_map([first, last])
    assert city.unchanged_pair(first, last) is None


def test_one_name_for_two_recordings():
    twice = [info("town_01", "01", city="a"), info("town_01", "01", city="b")]
    with pytest.raises(InputError, match=r"town_01 is there twice"):
        drives_by_map(twice)
