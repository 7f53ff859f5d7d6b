"""The values that the paper prints, and who meets them."""

import subprocess
import sys
from types import SimpleNamespace

import pytest

from evaluation.paper import reference_for
from evaluation.paper.paper_values import paper
from evaluation.recognition.protocol import RetrievalProtocol
from evaluation.report.reference import NO_REFERENCE


def test_paper_values():
    change = paper().changes
    assert len(change) == 9
    # The first misprint: Table I prints 0.1120 here.
    assert change["downtown", "01", "04"] == 0.1674
    recognition = paper().recognitions
    assert len(recognition) == 40
    # The second: R@1 is printed as 0.9626.
    value = recognition["riverside", "02", "01", "ring++", "filtered"]
    assert value.recall_at_1 == 0.7626
    # All of RING++ then obeys F1 = 2 R / (1 + R), to the printed digits.
    for key, value in recognition.items():
        if key[3] == "ring++":
            r = value.recall_at_1
            assert value.f1_max == pytest.approx(2 * r / (1 + r), abs=1.1e-4)


def result(method, mode_protocol, pair=("riverside", "01", "02")):
    return SimpleNamespace(
        pair=pair,
        method=method,
        protocol=mode_protocol,
    )


def test_only_its_own_protocol_is_compared():
    reference = reference_for({"riverside", "town"})
    usual = RetrievalProtocol(scans_per_place=1)
    assert reference.covers(result("solid", usual))
    assert reference.values(result("solid", usual), "all").auc == 0.0703
    assert reference.values(result("solid", usual), "filtered") is None
    for other in (
        RetrievalProtocol(scans_per_place=1, radius=5.0),
        RetrievalProtocol(scans_per_place=1, gate=True),
        RetrievalProtocol(scans_per_place=2),
    ):
        assert not reference.covers(result("solid", other))
        assert reference.values(result("solid", other), "all") is None
    assert not reference.covers(result("layered-overlap", usual))
    assert not reference.covers(result("solid", usual, ("town", "01", "02")))


def test_a_city_of_one_s_own_has_no_reference():
    assert reference_for({"town"}) is NO_REFERENCE
    assert NO_REFERENCE.change("suburbia", ("01", "02")) is None
    assert NO_REFERENCE.judge([], []) == []


@pytest.mark.slow
@pytest.mark.night
def test_a_study_does_not_load_the_paper():
    code = (
        "import sys\n"
        "from evaluation.study import place_measurements\n"
        "from evaluation.study.report_jobs import stages_report\n"
        "assert not [m for m in sys.modules if 'evaluation.paper' in m]\n"
    )
    subprocess.run([sys.executable, "-c", code], check=True)
