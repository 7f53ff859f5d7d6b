"""Stages: nesting, and faults named in one line."""

import pytest

from evaluation.base import InputError
from worlds.city import load_stages

NAMES = ["tower_001", "tower_002", "tree_001", "tree_002", "car_001"]
GOOD = """
stages:
  "01":
    story: nothing yet
    absent:
      a tower: [tower_001]
  "02":
    story: a tower
    absent:
      trees: [tree_001, tree_002]
      another tower: [tower_002]
  "04":
    story: all of it
"""


def _first(field, group):
    """The first stage with a group."""
    return f"story: x\n    {field}: {{y: {{{group}}}}}"


def load(tmp_path, text):
    path = tmp_path / "stages.yaml"
    path.write_text(text)
    return load_stages(path, NAMES)


def test_a_stage_lacks_what_it_and_all_later_ones_list(tmp_path):
    stages = load(tmp_path, GOOD)
    assert stages.absent("04") == set()
    assert stages.absent("02") == {"tree_001", "tree_002", "tower_002"}
    assert stages.absent("01") == stages.absent("02") | {"tower_001"}


GROWING = """
stages:
  "01":
    story: low
    lower:
      towers: {height: 6, structures: ["tower_*"], but: [tower_002]}
  "02":
    story: less low
    lower:
      all: {height: 8, structures: ["tower_*", tree_001]}
    sites:
      one: {height: 12, structures: [tower_002]}
  "03": {story: high}
lots: {market: [tower_001]}
"""


def test_what_a_later_stage_raises_is_low_before(tmp_path):
    stages = load(tmp_path, GROWING)
    assert stages.heights("03") == {}
    second = {"tower_001": 8.0, "tower_002": 8.0, "tree_001": 8.0}
    assert stages.heights("02") == second
    assert stages.heights("01") == second | {"tower_001": 6.0}
    assert stages.sites("02") == {"tower_002": 12.0}
    assert stages.sites("01") == {}
    assert stages.lots == {"market": ["tower_001"]}


def test_there_is_no_stage_03(tmp_path):
    with pytest.raises(KeyError, match="03"):
        load(tmp_path, GOOD).absent("03")


@pytest.mark.parametrize(
    ("old", "new", "fault"),
    [
        ("[tower_001]", "[tower_009]", "01.absent.a tower: unknown structure "),
        (
            "story: nothing yet",
            _first("sites", "height: 9, structures: [tree_9]"),
            "01.sites.y.structures: unknown structure tree_9",
        ),
        (
            "story: nothing yet",
            _first("lower", "height: 9, structures: [tree_*], but: [tree_9]"),
            "01.lower.y.but: unknown structure tree_9",
        ),
        (
            "all of it",
            "all\n    sites: {x: {height: 9, structures: [car_001]}}",
            "the last stage",
        ),
        ("[tower_002]", "[tower_001]", "tower_001 is already in stages.01"),
        ("all of it", "all\n    absent: {x: [car_001]}", "the last stage"),
        ('"01"', '"05"', "rising order"),
        ("stages:", "lots: {pool: []}\nstages:", "lots.pool"),
        (GOOD, "stages: {}", "at least one stage"),
        (GOOD, "", "(top level)"),
    ],
)
def test_faults_are_named_in_one_line(tmp_path, old, new, fault):
    assert old in GOOD
    with pytest.raises(InputError) as caught:
        load(tmp_path, GOOD.replace(old, new))
    message = str(caught.value)
    assert fault in message
    assert message.startswith(str(tmp_path / "stages.yaml"))
    assert "\n" not in message
