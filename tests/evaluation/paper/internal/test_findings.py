from dataclasses import replace

import numpy as np
import pytest

from evaluation.paper.findings import findings, paper_trend, trend
from evaluation.paper.paper_values import Measured, Numbers
from evaluation.recognition import MODES


def numbers(auc):
    return Numbers(auc=auc, recall_at_1=auc, f1_max=auc)


def make_results(city="metropolis", **aucs):
    """Returns a result for each method and pair; pairs are 01, 02, ...

    -> 09.
    """
    return [
        Measured(
            pair=(city, f"{i + 1:02d}", "09"),
            method=method.replace("ring", "ring++"),
            protocol="paper",
            by_mode=dict.fromkeys(MODES, numbers(value)),
        )
        for method, values in aucs.items()
        for i, value in enumerate(values)
    ]


def make_changes(values, city="metropolis"):
    changes = {}
    for i, value in enumerate(values):
        stage = f"{i + 1:02d}"
        changes[city, stage, "09"] = changes[city, "09", stage] = value
    return changes


def verdicts(results, changes):
    return [one.verdict for one in findings(results, changes)]


def test_all_as_in_the_paper():
    changes = [0.30, 0.25, 0.20, 0.15, 0.10]
    results = make_results(
        ring=[0.6, 0.7, 0.8, 0.85, 0.9], btc=[0.50, 0.51, 0.49, 0.50, 0.51]
    )
    assert verdicts(results, make_changes(changes)) == [
        "was fitted",
        *["holds"] * 3,
    ]


def test_none_as_in_the_paper():
    changes = [0.10, 0.12, 0.15, 0.20, 0.25]
    results = make_results(
        ring=[0.30, 0.31, 0.32, 0.33, 0.34], btc=[0.9, 0.8, 0.7, 0.6, 0.5]
    )
    found = findings(results, make_changes(changes))
    assert [one.verdict for one in found] == [
        "was fitted",
        *["does not hold"] * 3,
    ]
    assert "it reaches KAIST's: 0 of 1." in found[0].evidence
    assert "is BTC on 5. If all queries count for" in found[1].evidence
    assert found[1].evidence.endswith("is best on 0 of 5 pairs (BTC on 5).")
    assert "RING++ +1.00" in found[2].evidence
    assert "BTC -1.00" in found[2].evidence


@pytest.mark.parametrize("seed", range(4))
def test_the_best_method_is_that_of_table_ii(seed):
    """RING++ is counted in mode filtered there, and in mode all as well."""
    rng = np.random.default_rng(seed)
    aucs = rng.random((3, 6))
    names = ("ring", "btc", "solid")
    results = make_results(**dict(zip(names, aucs, strict=True)))
    filtered = np.minimum(aucs[0] + 0.3, 1.0)
    results = [
        replace(
            one,
            by_mode={**one.by_mode, "filtered": numbers(filtered[k])},
        )
        if one.method == "ring++"
        else one
        for k, one in enumerate(results)
    ]
    (ring,) = findings(results, {})
    wins = int((filtered > aucs[1:].max(axis=0)).sum())
    every = int((aucs[0] > aucs[1:].max(axis=0)).sum())
    assert ring.verdict == ("holds in part" if wins < 6 else "holds")
    assert wins > 0
    assert f"RING++ on {wins}" in ring.evidence.split(". ")[0]
    assert f"RING++ is best on {every} of 6 pairs" in ring.evidence


def test_a_verdict_names_the_tables_that_contradict_it():
    """By the paper's protocol RING++ is best; by another one, BTC is."""
    by_paper = make_results(ring=[0.6, 0.7], btc=[0.5, 0.4])
    own = make_results(ring=[0.3, 0.8], btc=[0.9, 0.9], learned=[1.0, 1.0])
    own = [replace(one, protocol="random-yaw") for one in own]
    (ring,) = findings(own + by_paper, {})
    assert ring.verdict == "holds"
    assert ring.claim.endswith("as the paper counts.")
    assert ring.evidence.endswith(
        " With the protocol random-yaw, as in the other tables, RING++ is"
        " best on 0 of 2 pairs (BTC on 2)."
    )
    (alone,) = findings(by_paper, {})
    assert "random-yaw" not in alone.evidence


def test_in_part():
    changes = [0.30, 0.25, 0.20, 0.15, 0.10]
    results = make_results(
        ring=[0.4, 0.7, 0.8, 0.85, 0.9],
        solid=[0.10, 0.10, 0.11, 0.10, 0.10],
        btc=[0.5, 0.3, 0.6, 0.2, 0.5],
    )
    assert verdicts(results, make_changes(changes)) == [
        "was fitted",
        *["holds in part"] * 3,
    ]


def test_too_few_pairs_are_said_to_be_too_few():
    results = make_results(ring=[0.6], btc=[0.5])
    found = findings(results, make_changes([0.1]))
    assert [one.verdict for one in found] == [
        "was fitted",
        "holds",
        "cannot be judged",
        "cannot be judged",
    ]
    assert "1 pair of drives" in found[-1].evidence


def test_missing_data_gives_no_finding():
    assert findings([], {}) == []
    assert verdicts(make_results(solid=[0.5]), {}) == []
    undefined = make_changes([float("nan")])
    assert len(findings(make_results(solid=[0.5]), undefined)) == 1


def test_only_the_paper_s_cities_are_judged():
    changes = [0.30, 0.25, 0.20, 0.15, 0.10]
    aucs = {"ring": [0.6, 0.7, 0.8, 0.85, 0.9], "btc": [0.5] * 5}
    assert findings(make_results("town", **aucs), make_changes(changes)) == (
        findings([], make_changes(changes))
    )
    own = make_changes(changes, "town")
    assert findings(make_results("town", **aucs), own) == []
    both = findings(
        make_results("town", **aucs) + make_results(ring=[0.6], btc=[0.5]),
        own | make_changes([0.1]),
    )
    assert both == findings(
        make_results(ring=[0.6], btc=[0.5]), make_changes([0.1])
    )


def test_trend():
    straight = trend([0.1, 0.2, 0.3], [0.9, 0.7, 0.5])
    assert straight.rho == pytest.approx(-1.0)
    assert straight.slope == pytest.approx(-0.2)
    assert straight.spread == pytest.approx(0.4)
    level = trend([0.1, 0.2, 0.3], [0.5, 0.5, 0.5])
    assert np.isnan(level.rho)
    assert not level.falls


def test_trends_of_the_paper():
    # By hand from the ranks of Table II: only RING++ gets worse.
    assert paper_trend("ring++").rho < 0
    assert paper_trend("btc").rho > 0.5
    assert paper_trend("scan-context++").rho > 0
    assert paper_trend("solid").num_pairs == 10
