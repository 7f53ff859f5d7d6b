import math
from types import SimpleNamespace

from helpers.small_page import make_content
import pytest

from evaluation.recognition.metrics import Interval
from evaluation.recognition.protocol import RetrievalProtocol
from evaluation.recognition.survival import Kept
from evaluation.report import survival
from evaluation.report.page import write_page
from evaluation.report.survival import (
    draw_survival,
    survival_numbers,
    survival_summary,
    survival_table,
)


def make(method, database, before, after, interval=(0.25, 0.75)):
    kept = Kept(before, after, Interval(*interval))
    has_control = not math.isnan(before)
    return SimpleNamespace(
        pair=("town", database, "03"),
        method=method,
        unchanged=SimpleNamespace() if has_control else None,
        control=f"town_{database}_stage_03" if has_control else None,
        auc=kept,
        auc_strict=(before, 0.5 * after),
        recall_at_full_precision=0.125,
        recall_at_1=Kept(before, before, Interval(*interval)),
        protocol=RetrievalProtocol(radius=5.0, scans_per_place=10),
    )


SOME = [
    make("btc", "01", 0.8, 0.4),
    make("btc", "02", 0.8, 0.6),
    make("solid", "01", 0.5, 0.05),
    make("solid", "02", 0.0, 0.0, (math.nan, math.nan)),
]
NO_CONTROL = make("btc", "00", math.nan, 0.5, (math.nan, math.nan))


def test_numbers():
    table = survival_numbers([SOME[0], NO_CONTROL])
    rows = [dict(zip(table.header, row, strict=True)) for row in table.rows]
    names = "map,db,query,method,auc_unchanged,auc_changed,kept"
    assert ",".join(table.header).startswith(names)
    assert rows[0]["kept"] == pytest.approx(0.5)
    assert (rows[0]["kept_low"], rows[0]["kept_high"]) == (0.25, 0.75)
    assert rows[0]["r1_kept"] == 1.0
    first, last = table.to_csv().splitlines()[1:]
    assert first.startswith("town,01,03,btc,0.8,0.4,0.5,0.25,0.75,")
    protocol = "5.0,10.0,5.0,100.0,10,,0,recorded"
    assert first.endswith(f",0.125,town_01_stage_03,{protocol},0.8,0.2")
    # Without a control, only the measured values stand there.
    assert last.startswith("town,00,03,btc,,0.5,,,,,")
    assert last.endswith(f",,{protocol},,0.25")


def test_table_for_print():
    table = survival_table([*SOME, NO_CONTROL])
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
    assert survival_summary(SOME) == (
        "Each method keeps part of its AUC without change (median of 2 pairs):"
        " BTC 62 %, SOLiD 10 %."
    )
    assert survival_summary(SOME[:1]).endswith("(one pair): BTC 50 %.")
    assert "For 1 of 3 pairs no control was" in (
        survival_summary([*SOME, NO_CONTROL])
    )
    assert survival_summary([NO_CONTROL]).startswith("Here no control was")
    assert survival_summary([]) == ""


def test_section_of_the_page(tmp_path):
    page = tmp_path / "report.html"
    write_page(page, make_content(tmp_path, survivals=[]))
    assert "survives the change" not in page.read_text()
    survivals = [make("a<b", "01", 0.8, 0.4)]
    write_page(page, make_content(tmp_path, survivals=survivals))
    text = page.read_text()
    assert "a&lt;b" in text
    assert "<td>0.800</td><td>0.400</td><td><b>50 %</b>" in text
    assert "<td>0.125</td></tr>" in text


def test_figure_shows_the_pairs_that_have_a_control(monkeypatch, tmp_path):
    drawn = []
    monkeypatch.setattr(
        survival, "save", lambda figure, stem: drawn.append(figure)
    )
    beaten = {(("town", "01", "03"), "solid")}
    draw_survival([*SOME, NO_CONTROL], tmp_path / "survival", beaten)
    (axes,) = drawn[0].axes
    texts = [text.get_text() for text in axes.texts]
    assert texts == [
        "town 01 → 03",
        "10 %",
        "50 %",
        "town 02 → 03",
        "–",
        "75 %",
        "kept",
    ]
    names = [label.get_text() for label in axes.get_yticklabels()]
    assert names == ["SOLiD", "BTC"] * 2
    lines = [line.get_xdata() for line in axes.lines]
    assert [list(x) for x in lines if len(x) == 2] == [
        [0.5, 0.05],
        [0.8, 0.4],
        [0.0, 0.0],
        [0.8, 0.6],
    ]
