"""The tables and sentences of the results have the numbers of the files."""

import csv
import shutil

from helpers import documents
import pytest

from docs import result_tables

CLAIMS = {one.name: one for one in result_tables.claims()}
WRITTEN = result_tables.files()
# Columns that readers of `claims.csv` count on.
COLUMNS = (
    "claim,page,estimate,low,high,unit,n,source,declared,seen_before,"
    "overturned_by"
)


@pytest.mark.parametrize("path", WRITTEN, ids=lambda path: path.name)
def test_a_file_is_what_the_program_writes(path):
    assert path.read_text("utf-8") == WRITTEN[path]


@pytest.mark.parametrize("name", CLAIMS)
def test_a_claim_stands_on_its_page_and_among_the_limits(name):
    claim = CLAIMS[name]
    for page in (claim.page, "limits.md"):
        path = (result_tables.DOCS / page).resolve()
        text = " ".join(path.read_text("utf-8").split())
        assert claim.claim in text, page


@pytest.mark.parametrize("name", CLAIMS)
def test_a_claim_says_what_it_rests_on(name):
    claim = CLAIMS[name]
    assert claim.n > 0
    assert claim.low <= claim.estimate <= claim.high or claim.low != claim.low
    places = claim.source.partition("; ")[0].split(", ")
    for place in places:
        path, _, anchor = place.partition("#")
        assert (documents.ROOT / path).exists(), path
        if claim.numbers == "recomputed":
            assert path.endswith(".csv"), path
        elif anchor:
            assert anchor in documents.anchors(documents.read(path)), place
        else:
            pytest.fail(f"{name}: {place} is no section")


def test_names_of_claims_are_unique():
    assert len(CLAIMS) == len(result_tables.claims())


def test_columns_of_the_claims():
    head = (result_tables.DOCS / "claims.csv").read_text().partition("\n")[0]
    assert head.startswith(COLUMNS)


def test_all_pages_of_results_have_claims():
    pages = {"../README.md", *result_tables.HEADINGS}
    assert {one.page for one in CLAIMS.values()} == pages


def test_a_sentence_follows_its_file(tmp_path, monkeypatch):
    shutil.copytree(
        result_tables.DOCS,
        tmp_path / "docs",
        ignore=shutil.ignore_patterns("*.md", "pictures"),
    )
    path = tmp_path / "docs/notes/years.csv"
    text = path.read_text("utf-8")
    path.write_text(text.replace("riverside,5,0.010", "riverside,5,0.090"))
    monkeypatch.setattr(result_tables, "DOCS", tmp_path / "docs")
    changed = {
        one.name
        for one in result_tables.claims()
        if one.claim != CLAIMS[one.name].claim
    }
    assert changed == {"tcr-ages"}


def test_survival_is_judged_by_the_cities_means():
    """By another reader of the tables: the mean loss over twelve cities."""
    losses = {}
    for name in ("stages.csv", "fresh.csv"):
        with (result_tables.BASELINES / name).open(newline="") as stream:
            for row in csv.DictReader(stream):
                if (
                    row["metric"] == "relative_auc_strict"
                    and row["verified"] == "1"
                    and row["both.stage"] == "own"
                    and row["method"] == "layered-overlap"
                ):
                    city = name, row["map"], row.get("both.redraw.frozen")
                    loss = max(0.0, 1.0 - float(row["value"]))
                    losses.setdefault(city, []).append(loss)
    cities = [sum(some) / len(some) for some in losses.values()]
    assert len(cities) == CLAIMS["survives-verified"].n == 12
    mean = sum(cities) / 12
    assert mean == pytest.approx(CLAIMS["survives-verified"].estimate)


@pytest.mark.parametrize(
    "path",
    [
        *sorted(result_tables.DOCS.glob("notes/*.csv")),
        *sorted(result_tables.BASELINES.glob("*.csv")),
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
