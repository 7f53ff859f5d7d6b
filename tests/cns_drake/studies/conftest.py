"""What the tests of studies share."""

import pytest

from cns_drake.studies import load_experiment


@pytest.fixture(autouse=True)
def no_figures(unrendered_figures):
    """The tests ask which figures are made, not what they show."""


@pytest.fixture
def read(tmp_path):
    """Reads an experiment from text."""

    def load(text, *overrides, **options):
        path = tmp_path / "mine.yaml"
        path.write_text(text)
        return load_experiment(path, overrides, **options)

    return load
