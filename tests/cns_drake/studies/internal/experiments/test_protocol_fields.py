"""Protocols that fields of an experiment describe."""

import pytest

from cns_drake.base import InputError
from cns_drake.studies import Experiment
from cns_drake.studies.experiments.conditions import conditions
from cns_drake.studies.experiments.protocol_fields import (
    condition_protocol,
    protocol_from_fields,
)
from evaluation.recognition import (
    PAPER_PROTOCOL,
    RANDOM_YAW_PROTOCOL,
    RetrievalProtocol,
)
from evaluation.results import PROTOCOL_BASE


def test_protocols():
    assert protocol_from_fields({}, "") == RANDOM_YAW_PROTOCOL
    assert protocol_from_fields({"base": "paper"}, "") == PAPER_PROTOCOL
    found = protocol_from_fields({"base": "recorded", "radius": 5}, "")
    assert found == RetrievalProtocol(radius=5)


def test_a_list_of_names_is_a_factor():
    experiment = Experiment(name="e", protocol=["random-yaw", "paper"])
    found = conditions(experiment)
    assert [one.factors for one in found] == [
        {PROTOCOL_BASE: "random-yaw"},
        {PROTOCOL_BASE: "paper"},
    ]
    # Each protocol has a baseline of its own.
    assert all(one.baseline == one.factors for one in found)
    assert [condition_protocol(one, "") for one in found] == [
        RANDOM_YAW_PROTOCOL,
        PAPER_PROTOCOL,
    ]


def test_a_list_holds_names():
    with pytest.raises(InputError, match=r"file: protocol\.base: .* none of"):
        protocol_from_fields({"base": {"radius": 5}}, "file")
