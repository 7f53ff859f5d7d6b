import math

from helpers.small_page import make_content
import numpy as np
import pytest
from scipy import stats

from evaluation.report.contents import Report
from evaluation.report.page import write_page
from evaluation.report.tables.survival import (
    survival_numbers,
    survival_summary,
    survival_table,
    survivals,
)
from evaluation.results.table import Row

STAGES = {f"town_{number:02d}": f"{number:02d}" for number in range(4)}


def make(method, database, before, after, interval=(0.25, 0.75), town="town"):
    """The rows of a method on a pair; before is NaN without a control."""
    has_control = not math.isnan(before)
    share = after / before if before else math.nan
    known = {
        "last": {"auc": before, "auc_strict": before, "r1": before},
        "own": {
            "auc": after,
            "auc_strict": 0.5 * after,
            "r1": before if has_control else after,
            "recall_at_full_precision": 0.125,
            **(
                {"kept": share, "kept_r1": 1.0, "kept_strict": share}
                if has_control
                else {}
            ),
        },
    }
    return [
        Row(
            "stages",
            town,
            f"town_{database}",
            "town_03",
            1,
            {"both.stage": stage},
            "place",
            method,
            False,
            "fair",
            metric,
            value,
            *(interval if metric.startswith("kept") else ()),
        )
        for stage, values in known.items()
        for metric, value in values.items()
        if has_control or stage == "own"
    ]


SOME = [
    *make("btc", "01", 0.8, 0.4),
    *make("btc", "02", 0.8, 0.6),
    *make("solid", "01", 0.5, 0.05),
    *make("solid", "02", 0.0, 0.0, (math.nan, math.nan)),
]
NO_CONTROL = make("btc", "00", math.nan, 0.5)


def of(rows):
    return survivals(rows, STAGES)


def test_numbers():
    table = survival_numbers(of([*SOME[:10], *NO_CONTROL]))
    rows = [dict(zip(table.header, row, strict=True)) for row in table.rows]
    names = "map,db,query,method,auc_unchanged,auc_changed,kept"
    assert ",".join(table.header).startswith(names)
    assert rows[0]["kept"] == pytest.approx(0.5)
    assert (rows[0]["kept_low"], rows[0]["kept_high"]) == (0.25, 0.75)
    assert rows[0]["r1_kept"] == 1.0
    first, last = table.to_csv().splitlines()[1:]
    assert first.startswith("town,01,03,btc,0.8,0.4,0.5,0.25,0.75,")
    assert first.endswith(",0.125,0.8,0.2,fair")
    # Without a control, only the measured values stand there.
    assert last.startswith("town,00,03,btc,,0.5,,,,,")
    assert last.endswith(",0.125,,0.25,fair")


def test_table_for_print():
    table = survival_table(of([*SOME, *NO_CONTROL]))
    # Rows are sorted by pair, then in the paper's order of methods.
    assert [row[1:3] for row in table.rows] == [
        ("01 → 03", "SOLiD"),
        ("01 → 03", "BTC"),
        ("02 → 03", "SOLiD"),
        ("02 → 03", "BTC"),
        ("00 → 03", "BTC"),
    ]
    assert table.rows[1][3:6] == (0.8, 0.4, "50 % (25–75)")
    assert table.rows[2][5] == "–"
    assert table.rows[4][3:6] == ("no control", 0.5, None)
    assert r"50 \% (25--75)" in table.to_latex()


def test_summary():
    assert survival_summary(of(SOME[:10])) == (
        "Retained AUC strict, relative to the AUC strict without change (mean"
        " over pairs): BTC 50 %. Fewer than 4 cities do not show whether a"
        " method survives, that is, retains 90 %."
    )
    assert "BTC 62 %" in survival_summary(of(SOME[:20]))
    assert "For 1 of 3 pairs no control was" in (
        survival_summary(of([*SOME, *NO_CONTROL]))
    )
    assert survival_summary(of(NO_CONTROL)).startswith("Here no control was")
    assert survival_summary([]) == ""


@pytest.mark.parametrize(("lowest", "survives"), [(0.97, True), (0.88, False)])
def test_the_lower_limit_decides_what_survives(lowest, survives):
    shares = [lowest, 0.98, 0.99, 1.0]
    limits = stats.t.interval(0.95, 3, np.mean(shares), stats.sem(shares))
    assert (limits[0] >= 0.9) == survives
    rows = [
        row
        for town, share in zip("abcd", shares, strict=True)
        for method, after in (("btc", 0.8 * share), ("solid", 0.4))
        for row in make(method, "01", 0.8, after, town=town)
    ]
    text = survival_summary(of(rows))
    low, high = (f"{100.0 * one:.0f} %" for one in limits)
    assert f"BTC {100.0 * np.mean(shares):.0f} % ({low} to {high})" in text
    assert "SOLiD 50 % (50 % to 50 %)" in text
    assert text.endswith(f"at least 90 %: {'BTC' if survives else 'none'}.")


def test_section_of_the_page(tmp_path, monkeypatch):
    page = tmp_path / "report.html"
    write_page(page, make_content(tmp_path, pairs=[]))
    assert "survives the change" not in page.read_text()
    rows = of(make("a<b", "01", 0.8, 0.4))
    monkeypatch.setattr(Report, "survivals", rows)
    write_page(page, make_content(tmp_path))
    text = page.read_text()
    assert "a&lt;b" in text
    assert "<td>0.800</td><td>0.400</td><td><b>50 %</b>" in text
    assert "<td>0.125</td></tr>" in text
