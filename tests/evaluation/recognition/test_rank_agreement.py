"""Kendall's tau between the methods of two reports, on made folders."""

import csv
import itertools

import numpy as np
import pytest

from cns_drake.base.errors import InputError
from evaluation.recognition.rank_agreement import rank_agreement

METHODS = ("a", "b", "c", "d")
HEADER = ("map", "db", "query", "method", "correct", "has_match", "score")


def write_report(folder, pairs, number=200, protocols=()):
    """Writes a report in which all scores of a method are equal.

    AUC is then the part of its best places that are right.

    Args:
        folder: to write.
        pairs: pair -> part that is right, of each method.
        number: of queries of each pair.
        protocols: names in a further column, which repeats the table.
    """
    folder.mkdir()
    with (folder / "queries.csv").open("w", newline="") as stream:
        table = csv.writer(stream)
        table.writerow((*HEADER, "protocol") if protocols else HEADER)
        for pair, parts in pairs.items():
            for method, part in zip(METHODS, parts, strict=False):
                for k in range(number):
                    right = int(k < part * number)
                    row = ("town", "01", pair, method, right, 1, 0.5)
                    table.writerows((*row, one) for one in protocols)
                    if not protocols:
                        table.writerow(row)
    return folder


def counted_tau(first, second):
    """Pairs in the same order less those in the opposite, over all pairs."""
    signs = [
        np.sign((one - other) * (second[i] - second[k]))
        for (i, one), (k, other) in itertools.combinations(enumerate(first), 2)
    ]
    return np.mean(signs)


def test_tau_of_mean_areas(tmp_path):
    simulated = write_report(
        tmp_path / "simulated",
        {"02": (0.9, 0.7, 0.5, 0.1), "03": (0.7, 0.9, 0.2, 0.3)},
    )
    real = write_report(tmp_path / "real", {"x": (0.6, 0.2, 0.4, 0.1)})
    found = rank_agreement(simulated, real / "queries.csv")
    assert found.methods == METHODS
    np.testing.assert_allclose(found.first, [0.8, 0.8, 0.35, 0.2])
    np.testing.assert_allclose(found.second, [0.6, 0.2, 0.4, 0.1])
    # The first two are equal on one side: tau-b divides by the root of the
    # 5 of 6 pairs that are not.
    assert found.tau == pytest.approx(
        counted_tau(found.first, found.second) / np.sqrt(5 / 6)
    )


def test_equal_and_opposite_rankings(tmp_path):
    up = write_report(tmp_path / "up", {"02": (0.1, 0.4, 0.7, 0.95)})
    down = write_report(tmp_path / "down", {"02": (0.9, 0.6, 0.4, 0.1)})
    assert rank_agreement(up, up).tau == pytest.approx(1.0)
    found = rank_agreement(up, down)
    assert found.tau == pytest.approx(-1.0)
    # The values are far apart, so no sample swaps two of them.
    assert found.interval.low == found.interval.high == pytest.approx(-1.0)


def test_close_methods_leave_it_open(tmp_path):
    wide = {"02": (0.5, 0.51, 0.52, 0.53)}
    one = write_report(tmp_path / "one", wide, number=100)
    other = write_report(tmp_path / "other", {"02": (0.9, 0.7, 0.4, 0.1)})
    found = rank_agreement(one, other)
    # Queries that one method gets right, the better ones get right too. No
    # sample swaps two methods, but some have no query on which they differ.
    assert found.interval.low == found.tau == pytest.approx(-1.0)
    assert -0.95 < found.interval.high < 0.0
    assert found.to_json()["kendall_tau"] == found.tau


def test_only_methods_of_both(tmp_path):
    three = write_report(tmp_path / "three", {"02": (0.1, 0.2, 0.3)})
    four = write_report(
        tmp_path / "four", {"02": (0.1, 0.2, 0.3, 0.4), "03": (0.1, 0.2)}
    )
    assert rank_agreement(three, four).methods == ("a", "b")


@pytest.mark.parametrize(
    ("text", "fault"),
    [
        ("map,db,query\n", "no column 'method'"),
        (f"{','.join(HEADER)}\n", "no query"),
        (f"{','.join(HEADER)}\nt,1,2,a,2,1,0.5\n", "line 2: correct"),
        (f"{','.join(HEADER)}\nt,1,2,a,1,1,high\n", "line 2: correct"),
        (f"{','.join(HEADER)}\nt,1,2,a,1,1,-inf\n", "line 2: correct"),
        (f"{','.join(HEADER)}\nt,1,2,a,1,1,1e1000000\n", "line 2: correct"),
        (f"{','.join(HEADER)}\nt,1,2,a,1,1,0.5\n", "fewer than two methods"),
    ],
)
def test_bad_tables_are_named(tmp_path, text, fault):
    good = write_report(tmp_path / "good", {"02": (0.1, 0.2)})
    bad = tmp_path / "queries.csv"
    bad.write_text(text)
    with pytest.raises(InputError, match=fault):
        rank_agreement(good, bad)


def test_rows_of_one_protocol_count(tmp_path):
    parts = {"02": (0.1, 0.4, 0.7, 0.9)}
    plain = write_report(tmp_path / "plain", parts)
    both = write_report(tmp_path / "both", parts, 200, ("paper", "fair"))
    alone = write_report(tmp_path / "alone", parts, 200, ("recorded",))
    expected = rank_agreement(plain, plain)
    np.testing.assert_allclose(expected.second, parts["02"])
    for one in (both, alone):
        found = rank_agreement(plain, one)
        assert found.to_json() == expected.to_json()
    two = write_report(tmp_path / "two", parts, 20, ("paper", "own"))
    with pytest.raises(InputError, match="paper and own in one table"):
        rank_agreement(plain, two)
    rank_agreement(plain, two, protocol="paper")
    with pytest.raises(InputError, match="no query by protocol fair"):
        rank_agreement(plain, two, protocol="fair")
    with pytest.raises(InputError, match="'mine' is unknown"):
        rank_agreement(plain, two, protocol="mine")
    odd = write_report(tmp_path / "odd", parts, 20, ("fiar",))
    with pytest.raises(InputError, match="line 2: protocol: 'fiar'"):
        rank_agreement(odd, plain)
