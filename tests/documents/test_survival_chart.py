"""The chart of the README shows what the table of the results says."""

from helpers import documents
import numpy as np
import pytest

from docs import survival_chart

PAGE = """# Results

## What survives

| map | stages | RING++ | [ours](a.md) |
|---|---|---|---|
| old town | 01, 04 | 0.92→0.84, 91% | →0.88 |
| old town | 02, 04 | 1.00→**0.05**, 5 % | 0.47→0.52, 109% |

## Other

| map | stages | BTC |
"""


def test_numbers_are_those_of_the_table(tmp_path):
    methods, pairs, values = survival_chart.read_table(PAGE)
    assert methods == ["RING++", "ours"]
    assert pairs == ["old town 01 → 04", "old town 02 → 04"]
    np.testing.assert_array_equal(values[:, :, 0], [[0.84, 0.88], [0.05, 0.52]])
    np.testing.assert_allclose(values[:, :, 1], [[0.91, np.nan], [0.05, 1.09]])
    assert values[:, :, 2].tolist() == [[0, 0], [1, 0]]
    survival_chart.draw(methods, pairs, values, tmp_path / "chart.png")
    assert (tmp_path / "chart.png").stat().st_size > 1000


def test_the_page_has_all_pairs_and_methods():
    page = documents.read("docs/results.md")
    methods, pairs, values = survival_chart.read_table(page.text)
    assert (len(methods), len(pairs)) == (6, 18)
    assert np.isfinite(values[:, :, 0]).all()
    assert values[:, :, 0].max() == pytest.approx(1.0, abs=0.2)
