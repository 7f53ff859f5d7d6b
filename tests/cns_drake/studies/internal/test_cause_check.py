"""Causes that no drive can have are told with their field."""

import re

import pytest

from cns_drake.studies import causes
from cns_drake.studies.cause_check import check_causes
from evaluation.base import InputError
from evaluation.study import Cause


def cause(strength="ladder", **query):
    case = {strength: {"query": query}}
    return Cause(name="mine", title="Mine", about="a", strengths=case)


def test_shipped_causes_can_be_used():
    assert {"snow", "weather", "size"} <= set(causes())


@pytest.mark.parametrize(
    ("query", "fault"),
    [
        ({"transient": {"snwo": [0.1]}}, "transient.snwo: "),
        ({"transient": {"snow": [0.1, -1.0]}}, "transient.snow: "),
        ({"wheatherr": {"rain": [1]}}, "wheatherr: "),
        ({"lidar": ["cns", "vlp-99"]}, "lidar: no preset 'vlp-99'"),
        ({"hide_sector": [1000]}, "hide_sector: 1000 is not from 0"),
        ({"distractors": [3]}, "distractors: it is a field of database"),
    ],
)
@pytest.mark.parametrize("strength", ["ladder", "levels", "mine"])
def test_faults(strength, query, fault):
    with pytest.raises(InputError) as caught:
        check_causes([cause(strength, **query)])
    place = f"cause 'mine': strengths.{strength}.query[.:] ?"
    assert re.match(place + re.escape(fault), str(caught.value))


def test_what_another_map_has_is_no_fault():
    check_causes([cause(stage=["earlier 4"])])
