"""The numbers and tables of the documents are those of their files."""

import csv
import datetime

from helpers import documents
import numpy as np
import pytest

from docs import declared, fill_numbers, survival
from evaluation.study import load_experiment

FILLED = [
    page
    for page in documents.pages()
    if "<!-- numbers of" in page.text or "<!-- table of" in page.text
]
CITIES = """\
map,method,seed,auc,note
a,btc,1,0.25,x
a,btc,2,0.75,x
b,btc,1,0.125,x
b,solid,1,,"y, z"
"""


@pytest.fixture
def cities(tmp_path):
    path = tmp_path / "cities.csv"
    path.write_text(CITIES)
    return path


@pytest.mark.parametrize("page", FILLED, ids=lambda page: page.name)
def test_a_page_has_the_numbers_of_its_files(page):
    assert fill_numbers.filled(page.text) == page.text


def test_most_pages_of_results_have_such_numbers():
    assert {"README.md", "docs/results.md", "docs/ageing.md"} <= {
        page.name for page in FILLED
    }


@pytest.mark.parametrize(
    ("query", "text"),
    [
        ("{mean auc map=a:.2f}", "0.50"),
        ("{max auc map!=b:.0%}", "75"),
        ("{min mean auc by map:+.3f}", "+0.125"),
        ("{median auc method=btc|solid seed=1:.4f}", "0.1875"),
        ("{count auc}", "3"),
        ('{note "note=y, z"}', "y, z"),
        ("{note map=a}", "x"),
    ],
)
def test_a_query(cities, query, text):
    source = f"<!-- numbers of {cities}\none {query}\n-->\n"
    page = f"{source}\nIt is -0.7<!--one-->, or (0<!--one-->).\n"
    filled = fill_numbers.filled(page).partition("-->\n")[2]
    assert filled == f"\nIt is {text}<!--one-->, or ({text}<!--one-->).\n"


def test_what_rounds_to_0_has_no_sign(tmp_path):
    path = tmp_path / "n.csv"
    path.write_text("n\n-0.001\n")
    page = f"<!-- numbers of {path}\none {{n:.2f}}\n-->\n\n7<!--one-->\n"
    assert fill_numbers.filled(page).endswith("\n0.00<!--one-->\n")


@pytest.mark.parametrize(
    ("query", "text", "fault"),
    [
        ("{auc map=a:.2f}", "0<!--one-->", "2 values"),
        ("{auc map=c:.2f}", "0<!--one-->", "one: no row has a value"),
        ("{mean auc:.2f}", "0<!--other-->", "mark without its number"),
        ("{mean auc:.2f}", "none", "mark without its number"),
    ],
)
def test_a_number_that_is_not_known_is_an_error(cities, query, text, fault):
    page = f"<!-- numbers of {cities}\none {query}\n-->\n\n{text}\n"
    with pytest.raises(ValueError, match=fault):
        fill_numbers.filled(page)


def test_a_table(cities):
    page = f"""\
<!-- table of {cities}
rows: {{map: {{b: Town B, a: }}}}
columns: {{method: [solid, btc]}}
cell: '{{mean auc:.2f}} ({{count auc}})'
-->

| what stood here |
|---|

Text.
"""
    head, _, _ = page.partition("| what")
    assert fill_numbers.filled(page) == (
        f"{head}| map | SOLiD | BTC |\n|---|---|---|\n"
        "| Town B | – | 0.12 (1) |\n| a | – | 0.50 (2) |\n\nText.\n"
    )


def test_a_table_of_named_cells(cities):
    page = f"""\
<!-- table of {cities} method=btc
rows: {{map: , seed: }}
cells: {{AUC: '{{auc:.2f}}', kind: '{{note}}'}}
-->

"""
    assert fill_numbers.filled(page).endswith(
        "-->\n\n| map | seed | AUC | kind |\n|---|---|---|---|\n"
        "| a | 1 | 0.25 | x |\n| a | 2 | 0.75 | x |\n| b | 1 | 0.12 | x |\n"
    )


@pytest.mark.parametrize("program", [survival, declared])
def test_tables_are_what_their_programs_write(tmp_path, program):
    name = f"{program.__name__.rpartition('.')[2]}.csv"
    program.main(tmp_path / name)
    written = documents.ROOT / "docs/notes" / name
    assert (tmp_path / name).read_bytes() == written.read_bytes()


def test_a_declared_interval_by_hand():
    """RING++ without fronts: 3.182 standard errors of four cities."""
    rows = fill_numbers.csv_rows("what_changes.csv")
    kept = [
        float(row["value"])
        for row in rows
        if (row["cause"], row["metric"], row["method"], row["verified"])
        == ("missing", "relative_auc_strict", "ring++", "0")
    ]
    (found,) = (
        row
        for row in fill_numbers.csv_rows("declared.csv")
        if (row["condition"], row["method"], row["verified"])
        == ("missing", "ring++", "0")
    )
    half = 3.1824 * np.std(kept, ddof=1) / 2.0
    assert float(found["high"]) == pytest.approx(np.mean(kept) + half, abs=1e-4)
    assert float(found["low"]) == pytest.approx(np.mean(kept) - half, abs=1e-4)


def test_survival_is_judged_by_the_cities_means():
    """By another reader of the tables: the mean loss over twelve cities."""
    losses = {}
    for name in ("stages", "fresh"):
        path = documents.ROOT / f"evaluation/results/baselines/{name}.csv"
        with path.open(newline="") as stream:
            for row in csv.DictReader(stream):
                if (
                    row["metric"] == "relative_auc_strict"
                    and row["verified"] == "1"
                    and row["both.stage"] == "own"
                    and row["method"] == "layered-overlap"
                ):
                    city = name, row["map"], row.get("both.city.redraw.frozen")
                    loss = max(0.0, 1.0 - float(row["value"]))
                    losses.setdefault(city, []).append(loss)
    cities = [sum(some) / len(some) for some in losses.values()]
    (found,) = (
        row
        for row in fill_numbers.csv_rows("survival.csv")
        if (row["source"], row["verified"], row["method"])
        == ("tables", "1", "layered-overlap")
    )
    assert int(found["cities"]) == len(cities) == 12
    assert float(found["loss"]) == pytest.approx(sum(cities) / 12, abs=1e-6)


@pytest.mark.parametrize(
    "path",
    [
        *sorted(documents.ROOT.glob("docs/notes/*.csv")),
        *sorted(documents.ROOT.glob("evaluation/results/baselines/*.csv")),
    ],
    ids=lambda path: path.name,
)
def test_no_published_interval_is_without_width(path):
    """A result without an error is not known to be perfect."""
    with path.open(newline="", encoding="utf-8") as stream:
        for row in csv.DictReader(stream):
            for name in row:
                other = name.replace("low", "high")
                if other != name and row.get(other):
                    assert float(row[name]) < float(row[other]), row


def test_outside_results_stand_beside_what_was_predicted():
    path = documents.ROOT / "docs/notes/outside.csv"
    with path.open(newline="", encoding="utf-8") as stream:
        rows = list(csv.DictReader(stream))
    assert rows
    for row in rows:
        assert list(row) == [
            "declared",
            "source",
            "quantity",
            "predicted_low",
            "predicted_high",
            "found",
        ]
        assert row["source"]
        assert row["quantity"]
        predicted = [row["predicted_low"], row["predicted_high"]]
        if row["declared"]:
            # What was not predicted has neither a date nor an interval.
            date, experiment = row["declared"].split(" ")
            assert datetime.date.fromisoformat(date)
            assert load_experiment(documents.ROOT / experiment).conditions
            low, high = map(float, predicted)
            assert low <= high, row
        else:
            assert predicted == ["", ""]
            assert row["found"]
        if row["found"]:
            float(row["found"])
