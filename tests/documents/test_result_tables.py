"""The tables and sentences of the results have the numbers of the files."""

import csv

from helpers import documents
import pytest

from docs import result_tables

CLAIMS = {one.name: one for one in result_tables.claims()}
# Pages that have a claim's sentence, word for word.
SAID = {
    "README.md": ("survives-verified", "survivors", "ring-in-metropolis"),
    "docs/results.md": tuple(CLAIMS),
}


@pytest.mark.parametrize(
    "path", result_tables.files(), ids=lambda path: path.name
)
def test_a_file_is_what_the_program_writes(path):
    assert path.read_text("utf-8") == result_tables.files()[path]


@pytest.mark.parametrize("page", SAID)
def test_a_page_has_the_sentences_of_its_claims(page):
    text = " ".join(documents.read(page).text.split())
    for name in SAID[page]:
        assert CLAIMS[name].sentence in text


def test_a_claim_says_what_it_rests_on():
    for claim in CLAIMS.values():
        for path in claim.source.split(", "):
            assert (documents.ROOT / path).exists(), path
        assert claim.n > 0


def test_survival_is_judged_by_the_cities_means():
    """By another reader of the tables: the mean loss over eight cities."""
    losses = {}
    for name in ("stages.csv", "fresh.csv"):
        with (result_tables.BASELINES / name).open(newline="") as stream:
            for row in csv.DictReader(stream):
                if (
                    row["metric"] == "kept_strict"
                    and row["gate"] == "1"
                    and row["both.stage"] == "own"
                    and row["method"] == "layered-overlap"
                ):
                    city = name, row["map"]
                    loss = max(0.0, 1.0 - float(row["value"]))
                    losses.setdefault(city, []).append(loss)
    cities = [sum(some) / len(some) for some in losses.values()]
    assert len(cities) == CLAIMS["survives-verified"].n == 8
    mean = sum(cities) / 8
    assert mean == pytest.approx(CLAIMS["survives-verified"].estimate)
