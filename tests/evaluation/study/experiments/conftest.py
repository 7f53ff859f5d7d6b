"""What the tests of experiments share."""

import pytest

from evaluation.study import load_experiment


@pytest.fixture
def read(tmp_path):
    """Reads an experiment from text."""

    def load(text, *overrides, **options):
        path = tmp_path / "mine.yaml"
        path.write_text(text)
        return load_experiment(path, overrides, **options)

    return load
