"""What the tests of studies share."""

import pytest


@pytest.fixture(autouse=True)
def no_figures(unrendered_figures):
    """The tests ask which figures are made, not what they show."""
