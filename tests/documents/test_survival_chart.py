"""The table of results, and the README's chart, show the shipped tables."""

import csv
import itertools
import re

from helpers import documents
import numpy as np
import pytest
import scipy.stats

from docs import draw
from evaluation.results.table_forms import title

PAGE = """# Results

## What survives

| map | stages | RING++ | [ours](a.md) |
|---|---|---|---|
| old town | 01, 04 | 0.92→0.84, 91% | →0.88 |
| old town | 02, 04 | 1.00→**0.05**, 5 % | 0.47→0.52, 109% |

## Other

| map | stages | BTC |
"""


_CELL = re.compile(r"([\d.]*)→([\d.]+)(?:, (\d+) ?%)?")


def read_table(text):
    """Reads the table below `## What survives`.

    Returns methods, pairs, and (P, M, 3): the AUC with the change, the kept
    part, NaN where there is none, and 1 where the field is bold, else 0.
    """
    _, _, section = text.partition("\n## What survives\n")
    rows = [
        [cell.strip() for cell in line.strip("|").split("|")]
        for line in section.partition("\n## ")[0].splitlines()
        if line.startswith("|")
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


def test_numbers_are_those_of_the_table():
    methods, pairs, values = read_table(PAGE)
    assert methods == ["RING++", "ours"]
    assert pairs == ["old town 01 → 04", "old town 02 → 04"]
    np.testing.assert_array_equal(values[:, :, 0], [[0.84, 0.88], [0.05, 0.52]])
    np.testing.assert_allclose(values[:, :, 1], [[0.91, np.nan], [0.05, 1.09]])
    assert values[:, :, 2].tolist() == [[0, 0], [1, 0]]


def test_the_chart_shows_the_shares_of_the_table(tmp_path):
    methods, pairs, values = read_table(documents.read("docs/results.md").text)
    shipped = draw.kept_shares("stages")
    fresh = draw.kept_shares("fresh")
    keys = {title(key).lower(): key for key in shipped}
    rows = [p for p, pair in enumerate(pairs) if "fresh" not in pair]
    for m, name in enumerate(methods):
        shown = sorted(shipped[keys[name.lower()]])
        # Cells are rounded to a per cent.
        np.testing.assert_allclose(
            shown, sorted(values[rows, m, 1]), atol=0.00501
        )
        assert len(fresh[keys[name.lower()]]) == 40
    finding = draw.survival(tmp_path / "chart.png")
    assert (tmp_path / "chart.png").stat().st_size > 1000
    survivors = sum(
        min(np.median(shipped[key]), np.median(fresh[key])) >= 0.95
        for key in shipped
    )
    assert (survivors, finding.split()[0]) == (2, "Two")


def test_the_page_has_all_pairs_and_methods():
    page = documents.read("docs/results.md")
    methods, pairs, values = read_table(page.text)
    assert (len(methods), len(pairs)) == (6, 18)
    assert np.isfinite(values[:, :, 0]).all()
    assert values[:, :, 0].max() == pytest.approx(1.0, abs=0.2)
    best = values[:, :, 0] == values[:, :, 0].max(axis=1, keepdims=True)
    assert values[:, :, 2].tolist() == best.tolist()


def test_fresh_rows_are_those_of_the_five_versions():
    found = {}
    table = documents.ROOT / "docs/notes/fresh.csv"
    with table.open(newline="", encoding="utf-8") as stream:
        for row in csv.DictReader(stream):
            pair = f"{row['map']}, fresh {row['db']} → {row['query']}"
            values = float(row["auc"]), float(row["auc_unchanged"])
            found.setdefault((pair, row["method"]), []).append(values)
    page = documents.read("docs/results.md")
    methods, pairs, values = read_table(page.text)
    names = [name.lower().replace(" ", "-") for name in methods]
    names = ["scan-context++" if "scan" in name else name for name in names]
    rows = [p for p, pair in enumerate(pairs) if "fresh" in pair]
    unbeaten = {}
    for p in rows:
        # (methods, versions, with the change or without).
        auc = np.array([found[pairs[p], name] for name in names])
        assert auc.shape == (6, 5, 2)
        mean = auc.mean(axis=1)
        kept = mean[:, 0] / mean[:, 1]
        np.testing.assert_allclose(values[p, :, 0], mean[:, 0], atol=0.0051)
        np.testing.assert_allclose(values[p, :, 1], kept, atol=0.0051)
        tests = []
        for a, b in itertools.combinations(range(6), 2):
            test = scipy.stats.ttest_rel(auc[a, :, 0], auc[b, :, 0])
            tests.append((test.pvalue, a if test.statistic < 0 else b))
        # Holm's method: each test in the order of p-values, until one fails.
        beaten = set()
        for number, (pvalue, worse) in enumerate(sorted(tests)):
            if pvalue * (15 - number) >= 0.05:
                break
            beaten.add(names[worse])
        unbeaten[pairs[p]] = {*names} - beaten
    # What the page says of them.
    both = unbeaten.pop("downtown, fresh 02 → 04")
    assert both == {"learned", "layered-overlap"}
    assert unbeaten.pop("riverside, fresh 01 → 02") == {"layered-overlap"}
    assert list(unbeaten.values()) == [{"learned"}] * 6


def test_the_first_table_has_the_medians_over_pairs():
    page = documents.read("docs/results.md")
    table = documents.table(page, "# Results")
    names = ["learned", "layered-overlap", "btc"]
    names += ["ring++", "scan-context++", "solid"]
    notes = documents.ROOT / "docs/notes"
    for row, file, column, unit in (
        (table[0], "results_fair.csv", "kept", 0.01),
        (table[1], "results_fair.csv", "kept_strict", 0.01),
        (table[2], "fresh.csv", "kept", 0.01),
        (table[3], "results_fair.csv", "auc_strict", 1.0),
        (table[4], "results_fair.csv", "r1", 1.0),
    ):
        with (notes / file).open(newline="", encoding="utf-8") as stream:
            pairs = list(csv.DictReader(stream))
        for name, shown in zip(names, row[1:], strict=True):
            values = [float(p[column]) for p in pairs if p["method"] == name]
            assert float(shown.removesuffix(" %")) * unit == pytest.approx(
                np.median(values), abs=0.0051
            ), (row[0], name)


def test_the_readme_says_how_networks_of_others_do():
    shares = draw.outside_shares()
    assert len(shares) == 9
    assert shares["learned"]["Metropolis", ""] == pytest.approx(0.97)
    # RING++ and BTC were not run in Metropolis.
    assert [city for city, _ in shares["RING++"]] == ["Suburbia"]
    networks = [*shares["SVT-Net"].values(), *shares["DPA-Net"].values()]
    assert len(networks) == 6
    text = " ".join(documents.read("README.md").text.split())
    assert f"retain at most {100.0 * max(networks):.0f} % of this" in text
    assert min(min(one.values()) for one in shares.values()) in networks
    # The methods that the title counts are named in the text.
    assert "layered overlap and the learned method" in text
