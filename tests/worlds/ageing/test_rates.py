"""Rates from files, and counts of events."""

import pytest

from evaluation.base import InputError
from worlds.ageing import DEFAULT_RATES, read_rates


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
