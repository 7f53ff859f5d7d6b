"""When a study measures the conditions of the shipped results."""

from pathlib import Path

import pytest

from cns_drake.studies import study
from evaluation.base import Cluster
from evaluation.study import Study, load_experiment


def why(name, maps=(), *changes, **options):
    run = Study(
        load_experiment(name, changes, **options),
        Path(),
        name,
        Cluster(),
        print,
    )
    return study._unlike_shipped(run, maps)


@pytest.mark.parametrize("name", ["stages", "fresh", "ladder"])
def test_a_shipped_experiment_is_as_it_ships(name):
    assert why(name) == ""
    # What is measured of a condition does not change the condition.
    own = {"methods": ["solid"], "tasks": ["place"]}
    assert why(name, ["suburbia"], "maps=suburbia", **own) == ""


@pytest.mark.parametrize(
    ("changes", "fields"),
    [
        (["both.frames=9"], "both"),
        (["seeds=[1,2]", "drives=stages"], "drives, seeds"),
        (["protocol.radius=5"], "protocol"),
    ],
)
def test_other_fields_are_named(changes, fields):
    assert why("stages", (), *changes) == f"other values of {fields}"


def test_other_conditions_are_told(tmp_path):
    own = tmp_path / "mine.yaml"
    own.write_text("about: Mine?\n")
    assert why(own) == "mine is no shipped experiment"
    assert why("stages", quick=True) == "other values of protocol"
    assert why("stages", ["mine/suburbia"]) == (
        "mine/suburbia is no shipped map"
    )
