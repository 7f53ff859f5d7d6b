"""Causes that no drive can have are told with their field, and left out."""

import re

import pytest

from cns_drake.studies import causes, register_cause
from cns_drake.studies.cause_check import cause_fault
from evaluation.base import InputError
from evaluation.study import Cause
from evaluation.study import causes as all_causes


def cause(strength="ladder", section="query", **fields):
    case = {strength: {section: fields}}
    return Cause(name="mine", title="Mine", about="a", strengths=case)


def test_shipped_causes_can_be_used():
    assert set(causes()) == set(all_causes())
    assert {"snow", "weather", "size"} <= set(causes())


@pytest.mark.parametrize(
    ("query", "fault"),
    [
        ({"transient": {"snwo": [0.1]}}, "transient.snwo: "),
        ({"transient": {"snow": [0.1, -1.0]}}, "transient.snow: "),
        ({"wheatherr": {"rain": [1]}}, "wheatherr: "),
        ({"weather": {"visibility": [120, 60]}}, "weather.visibility: "),
        ({"lidars": {"*": {"preset": ["cns", "vlp-99"]}}}, "lidars.lidar.pre"),
        ({"distractors": [3]}, "distractors: it is a field of database"),
        ({"city": {"missing": [0.1, 1.1]}}, "city.missing: "),
    ],
)
@pytest.mark.parametrize("strength", ["ladder", "levels", "mine"])
def test_faults(strength, query, fault):
    place = f"cause 'mine': strengths.{strength}.query[.:] ?"
    told = cause_fault(cause(strength, **query))
    assert re.match(place + re.escape(fault), told)


def test_a_fault_of_the_protocol():
    told = cause_fault(cause(section="protocol", hide_sector=[1000]))
    assert "strengths.ladder.protocol.hide_sector: 1000 is not from 0" in told


def test_an_unusable_cause_is_not_registered():
    fields = cause(weather={"visibility": [120]}).model_dump()
    with pytest.raises(InputError, match=r"^cause 'mine': strengths\.ladder"):
        register_cause(fields)
    assert "mine" not in all_causes()


def test_what_another_map_has_is_no_fault():
    assert cause_fault(cause(stage=["earlier 4"])) == ""
