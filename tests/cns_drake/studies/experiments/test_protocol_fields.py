"""Protocols that fields of an experiment describe."""

from cns_drake.studies.experiments.protocol_fields import protocol_from_fields
from evaluation.recognition.protocol import (
    FAIR_PROTOCOL,
    PAPER_PROTOCOL,
    RetrievalProtocol,
)


def test_protocols():
    assert protocol_from_fields({}, "") == FAIR_PROTOCOL
    assert protocol_from_fields({"base": "paper"}, "") == PAPER_PROTOCOL
    found = protocol_from_fields({"base": "recorded", "radius": 5}, "")
    assert found == RetrievalProtocol(radius=5)
