"""The values that the paper prints."""

import pytest

from evaluation.paper import paper
from evaluation.paper.paper_values import Measured


def test_paper_values():
    change = paper().changes
    assert len(change) == 9
    # The first misprint: Table I prints 0.1120 here.
    assert change["downtown", "01", "04"] == 0.1674
    recognition = paper().recognitions
    assert len(recognition) == 40
    # The second: R@1 is printed as 0.9626.
    value = recognition["riverside", "02", "01", "ring++"]
    assert value.recall_at_1 == 0.7626
    # All of RING++ then obeys F1 = 2 R / (1 + R), to the printed digits.
    assert paper().modes["ring++"] == "filtered"
    for key, value in recognition.items():
        if key[3] == "ring++":
            r = value.recall_at_1
            assert value.f1_max == pytest.approx(2 * r / (1 + r), abs=1.1e-4)


def test_only_its_own_protocol_is_compared():
    def measured(method, protocol, pair=("riverside", "01", "02")):
        return Measured(pair, method, protocol, {})

    usual = measured("solid", "paper")
    assert paper().is_comparable(usual)
    assert paper().printed(usual).auc == 0.0703
    for other in (
        measured("solid", "random-yaw"),
        measured("solid", "own"),
        measured("solid, places 2", "paper"),
        measured("layered-overlap", "paper"),
        measured("solid", "paper", ("town", "01", "02")),
    ):
        assert not paper().is_comparable(other)
