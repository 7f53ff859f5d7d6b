import re

from helpers.small_page import make_content
import numpy as np
import pytest

from evaluation.report.page import write_report
from evaluation.results.method_names import (
    Cell,
    Table,
    keyed,
    p_value_text,
    ranked,
)
from evaluation.results.ranges import range_of

PLAIN = Table(
    ("name", "value", "count"),
    (("a", 0.123456, 3), ("b", None, 4), ("c", float("nan"), 5)),
)
GROUPED = Table(
    ("pair_of", "AUC", "AUC"),
    (
        ("01 → 04", Cell(0.75, 0.5, 1), Cell(0.25, None, 2)),
        ("x & y", Cell(None, 0.125), Cell(0.5)),
    ),
    groups=(("", 1), ("RING++", 1), ("BTC", 1)),
    caption="A 95 % caption",
)


def test_plain():
    assert PLAIN.to_csv() == "name,value,count\na,0.123456,3\nb,,4\nc,,5\n"
    assert PLAIN.to_markdown() == (
        "| name | value | count |\n| --- | --- | --- |\n"
        "| a | 0.1235 | 3 |\n| b | – | 4 |\n| c | – | 5 |\n"
    )


def test_columns_of_items():
    table = Table.of(
        [(1, np.array([0.5, 0.25])), (2, np.array([]))],
        {
            "a": lambda item: item[0],
            ("b", "c"): lambda item: item[1],
            **keyed({"d": 2, "e": 3}, lambda item, k: item[1] * k > 1.0),
        },
        "A caption",
    )
    assert table.to_csv() == "a,b c,d,e\n1,0.5,0,1\n1,0.25,0,0\n"
    assert table.to_markdown().endswith("| 1 | 0.2500 | 0 | 0 |\n")
    assert table.groups == (("", 1), ("b", 1), ("", 2))
    assert table.caption == "A caption"
    single = Table.of("xy", {"letter": str, "number": ord})
    assert single.rows == (("x", 120), ("y", 121))


def test_a_column_without_values_can_go():
    table = Table(("map", "paper"), (("a", None), ("b", float("nan"))))
    assert table.without_empty("paper") == Table(("map",), (("a",), ("b",)))
    assert PLAIN.without_empty("value") is PLAIN


def test_markdown_marks_best_and_second():
    assert GROUPED.to_markdown().splitlines() == [
        "| pair_of | RING++ AUC | BTC AUC |",
        "| --- | --- | --- |",
        "| 01 → 04 | **0.7500** (0.5000) | <u>0.2500</u> |",
        "| x & y | – (0.1250) | 0.5000 |",
    ]


def test_latex_is_escaped_booktabs():
    lines = GROUPED.to_latex().splitlines()
    assert r"\caption{A 95 \% caption}" in lines
    assert (
        r"\multicolumn{1}{c}{} & \multicolumn{1}{c}{RING++} &"
        r" \multicolumn{1}{c}{BTC} \\" in lines
    )
    assert r"\cmidrule(lr){2-2}\cmidrule(lr){3-3}" in lines
    assert r"pair\_of & AUC & AUC \\" in lines
    assert (
        r"01 $\rightarrow$ 04 &"
        r" \shortstack{\textbf{0.7500}\\{\scriptsize 0.5000}} &"
        r" \underline{0.2500} \\" in lines
    )
    assert (
        r"x \& y & \shortstack{--\\{\scriptsize 0.1250}} & 0.5000 \\" in lines
    )
    text = "\n".join(lines)
    assert text.count("{") == text.count("}")
    assert text.isascii()


def test_html_is_escaped():
    text = GROUPED.to_html()
    assert '<th colspan="1" class="group">RING++</th>' in text
    cell = '<td class="first"><b>0.7500</b><small>0.5000</small></td>'
    assert cell in text
    assert '<td class="text">x &amp; y</td>' in text


def test_text_has_a_class_and_numbers_have_none():
    row = ("BTC", "12 %", "building (92)", "< 0.0001", None, "-1.5")
    text = Table(
        tuple("abcdef"), (row, ("A", None, None, "0", 1.0, "2"))
    ).to_html()
    assert re.findall(r'<th class="text">(\w)</th>', text) == ["a", "c"]
    assert text.count('<td class="text">') == 4


@pytest.mark.parametrize(
    ("value", "text"),
    [
        (0.0, "< 0.0001"),
        (0.49e-4, "< 0.0001"),
        (0.51e-4, "0.0001"),
        (1.0, "1.0000"),
        (float("nan"), "–"),
    ],
)
def test_no_p_value_is_zero(value, text):
    assert p_value_text(value) == text


@pytest.mark.parametrize(
    ("values", "ranks"),
    [
        ([0.2, 0.9, 0.5], [None, 1, 2]),
        # Values that are printed equally share a rank.
        ([0.90001, 0.90002, 0.5], [1, 1, 2]),
        ([None, 0.9, float("nan")], [None, None, None]),
        ([None, 0.9, 0.1], [None, 1, 2]),
        ([], []),
    ],
)
def test_ranks(values, ranks):
    cells = ranked(values, [0.5] * len(values))
    assert [cell.rank for cell in cells] == ranks
    assert [cell.printed for cell in cells] == [0.5] * len(values)


def test_empty_table_has_its_header():
    assert Table(("a", "b"), ()).to_csv() == "a,b\n"


def test_every_column_of_numbers_has_a_range(tmp_path, monkeypatch):
    """A new column is entered in the table of ranges, or fails here."""
    content = make_content(tmp_path)
    unknown = set()
    columns = 0
    made = Table.__post_init__

    def note(table):
        made(table)
        nonlocal columns
        groups = [name for name, span in table.groups for _ in range(span)]
        groups = groups or [""] * len(table.header)
        for k, names in enumerate(zip(table.header, groups, strict=True)):
            cells = [row[k] for row in table.rows]
            numbers = [
                one
                for one in cells
                if isinstance(one, Cell | float) or type(one) is int
            ]
            columns += bool(numbers)
            if numbers and not any(map(range_of, names)):
                unknown.add(" ".join(names))

    monkeypatch.setattr(Table, "__post_init__", note)
    write_report(content, tmp_path)
    assert columns > 50
    assert unknown == set()
