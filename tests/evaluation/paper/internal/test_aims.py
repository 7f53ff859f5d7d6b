"""The aims, judged on the paper's numbers and on numbers near them."""

import pytest

from evaluation.paper import paper
from evaluation.paper.findings import MET, MISSED, aims
from evaluation.paper.paper_values import Measured, Numbers
from evaluation.recognition import MODES


def make_results(change=lambda key: 0.0):
    """Returns the paper's own values, each changed by some function."""
    return [
        Measured(
            key[:3],
            key[3],
            "paper",
            dict.fromkeys(MODES, Numbers(value.auc + change(key), 0.0, 0.0)),
        )
        for key, value in paper().recognitions.items()
    ]


def make_changes(offset=0.0):
    changes = {}
    for (city, first, last), value in paper().changes.items():
        if city in paper().city_names:
            changes[city, first, last] = value + offset
            changes[city, last, first] = value + offset
    return changes


def verdicts(results, changes):
    return [one.verdict for one in aims(results, changes)]


def test_the_papers_own_numbers_meet_every_aim():
    assert verdicts(make_results(), make_changes()) == [MET] * 6


@pytest.mark.parametrize(
    ("offset", "verdict"), [(0.0149, MET), (0.0151, MISSED)]
)
def test_change_is_judged_by_its_limit(offset, verdict):
    for sign in (-1.0, 1.0):
        found = aims(make_results(), make_changes(sign * offset))
        assert [one.verdict for one in found] == [verdict] + [MET] * 5
    assert f"on {8 if verdict == MET else 0}." in found[0].evidence


def test_best_method_and_near_values():
    cities = [("suburbia", "01", "02"), ("suburbia", "02", "01")]

    def falls(key):
        return -0.5 if key[:3] in cities and key[3] == "ring++" else 0.0

    found = aims(make_results(falls), make_changes())
    assert found[1].verdict == MISSED
    assert found[1].evidence.startswith("It is so on 8. The best: RING++ on 8")
    # Eight of ten differences are 0.
    assert found[2].verdict == MET
    assert [one.verdict for one in found[3:]] == [MET] * 3


def test_the_mean_difference():
    known = paper().recognitions
    for offset, verdict in ((0.149, MET), (0.151, MISSED)):

        def change(key, offset=offset):
            # No AUC leaves its range.
            return -offset if known[key].auc > 0.5 else offset

        found = aims(make_results(change), make_changes())
        assert found[-1].verdict == verdict
        assert f"It is {offset:.3f}." in found[-1].evidence


def test_nothing_is_said_of_a_part_or_of_another_city():
    assert aims([], {}) == []
    assert aims(make_results()[1:], make_changes()) == []
