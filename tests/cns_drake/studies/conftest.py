"""Tests of studies ask which figures are made, not what they show."""

import pytest


@pytest.fixture(autouse=True)
def no_figures(unrendered_figures):
    pass
