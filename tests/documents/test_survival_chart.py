"""The tables of results, and the README's chart, show the shipped tables."""

import csv
import re

from helpers import documents
import numpy as np
import pytest
import scipy.stats

from docs import chart_pictures

KEYS = {
    "ring++": "ring++",
    "btc": "btc",
    "scan context++": "scan-context++",
    "solid": "solid",
    "layered overlap": "layered-overlap",
    "learned": "learned",
}
_CELL = re.compile(r"([\d.]*)→([\d.]+)(?:, (\d+) ?%)?")


def read_table(text):
    """Reads the first table below `## What survives`.

    Returns methods, pairs, and (P, M, 3): the AUC with the change, the kept
    part, NaN where there is none, and 1 where the field is bold, else 0.
    """
    _, _, section = text.partition("\n## What survives\n")
    _, _, first = section.partition("\n|")
    rows = [
        [cell.strip() for cell in line.strip("|").split("|")]
        for line in first.partition("\n\n")[0].splitlines()
    ]
    methods = [re.sub(r"\[(.+)\]\(.+\)", r"\1", cell) for cell in rows[0][2:]]
    pairs = [f"{row[0]} {row[1].replace(', ', ' → ')}" for row in rows[2:]]
    values = np.full((len(pairs), len(methods), 3), np.nan)
    for p, row in enumerate(rows[2:]):
        for m, cell in enumerate(row[2:]):
            _, changed, kept = _CELL.search(cell.replace("**", "")).groups()
            share = float(kept or "nan") / 100.0
            values[p, m] = float(changed), share, "**" in cell
    return methods, pairs, values


def column(name, method):
    """The pairs and values of a method in the table of results."""
    table = documents.ROOT / "docs/notes/results_fair.csv"
    with table.open(newline="", encoding="utf-8") as stream:
        return [
            (f"{row['map']} {row['db']} → {row['query']}", float(row[name]))
            for row in csv.DictReader(stream)
            if row["method"] == method
        ]


def over_cities(method, gate):
    """Mean and limits by the definition: the units are cities, not pairs."""
    rows = [
        one for one in chart_pictures.kept_rows()[gate] if one.method == method
    ]
    values = np.array([one.value for one in rows])
    cities = np.array([one.map for one in rows])
    mean, names = values.mean(), np.unique(cities)
    sums = [(values - mean)[cities == name].sum() for name in names]
    variance = len(names) / (len(names) - 1) * np.square(sums).sum()
    spread = np.sqrt(variance) / len(values)
    reach = scipy.stats.t.ppf(0.975, len(names) - 1) * spread
    return mean, mean - reach, mean + reach


def test_the_table_has_the_numbers_of_the_file():
    methods, pairs, values = read_table(documents.read("docs/results.md").text)
    for m, name in enumerate(methods):
        for k, of_file in enumerate(("auc", "kept")):
            known = dict(column(of_file, KEYS[name.lower()]))
            # Cells are rounded to two digits.
            np.testing.assert_allclose(
                values[:, m, k], [known[one] for one in pairs], atol=0.00501
            )


def test_the_chart_says_that_four_cities_are_too_few(tmp_path):
    finding = chart_pictures.survival(tmp_path / "chart.png")
    assert (tmp_path / "chart.png").stat().st_size > 1000
    assert finding == "4 cities cannot show what survives rebuilding"


def test_the_page_has_all_pairs_and_methods():
    page = documents.read("docs/results.md")
    methods, pairs, values = read_table(page.text)
    assert (len(methods), len(pairs)) == (6, 10)
    assert np.isfinite(values[:, :, 0]).all()
    assert values[:, :, 0].max() == pytest.approx(1.0, abs=0.2)
    best = values[:, :, 0] == values[:, :, 0].max(axis=1, keepdims=True)
    assert values[:, :, 2].tolist() == best.tolist()


def test_the_first_table_has_means_and_intervals_over_cities():
    page = documents.read("docs/results.md")
    table = documents.table(page, "# Results")
    names = ["layered-overlap", "learned", "btc"]
    names += ["ring++", "scan-context++", "solid"]
    for row, gate in ((table[0], False), (table[1], True)):
        for name, shown in zip(names, row[1:], strict=True):
            found = re.findall(r"-?[\d.]+", shown.replace("–-", " -"))
            np.testing.assert_allclose(
                [float(one) for one in found],
                over_cities(name, gate),
                atol=0.0051,
            )
    for row, of_file in ((table[2], "kept"), (table[3], "auc_strict")):
        for name, shown in zip(names, row[1:], strict=True):
            mean = np.mean([value for _, value in column(of_file, name)])
            assert float(shown.split()[0]) == pytest.approx(mean, abs=0.0051)
    assert "six methods" in page.text
