"""Rates from files, and counts of events."""

import numpy as np
import pytest

from cns_drake.ageing import DEFAULT_RATES, read_rates
from cns_drake.ageing.rates import Tally, poisson_p
from cns_drake.base import InputError


@pytest.mark.parametrize(
    ("text", "fault"),
    [
        ("eaten: 0.1", "eaten: unknown event"),
        ("built: 1.5", "built: 1.5 is no rate"),
        ("built: -0.1", "built: -0.1 is no rate"),
        ("built: true", "built: True is no rate"),
        ("built: yes", "quote it"),
        ("moved: 20.1", "moved: 20.1 is no length"),
        ("moved: -1", "moved: -1 is no length"),
        ("- built", "not a mapping"),
    ],
)
def test_faulty_rates(tmp_path, text, fault):
    path = tmp_path / "rates.yaml"
    path.write_text(text)
    with pytest.raises(InputError, match=fault):
        read_rates(path)


def test_rates_of_a_file_and_a_factor(tmp_path):
    path = tmp_path / "rates.yaml"
    path.write_text("felled: 0.04")
    rates = read_rates(path, 2.0)
    assert rates["felled"] == 0.08
    assert rates["moved"] == DEFAULT_RATES["moved"]  # A length has no factor.
    assert rates["built"] == 2 * DEFAULT_RATES["built"]
    with pytest.raises(InputError, match="--rate"):
        read_rates(path, 100.0)


def test_poisson_p():
    # P(N >= 9 | 4) = 0.02136, by summing the series.
    terms = [4.0**0]
    for k in range(1, 9):
        terms.append(terms[-1] * 4 / k)
    tail = 1.0 - np.exp(-4.0) * sum(terms)
    assert poisson_p(9, 4.0) == pytest.approx(2 * tail)
    assert poisson_p(4, 4.0) == 1.0
    tally = Tally({"lamps": 0.5})
    tally.count("lamps", 0.5, True, 1)
    assert "lamps,0.5,1,0.500,1,1.000000" in tally.to_csv()
