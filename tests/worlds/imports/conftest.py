"""Imports leave their overviews unrendered, which take half of their time."""

from helpers.internal.studies import leave_figures_unrendered
import pytest


@pytest.fixture
def overviews():
    """For tests that look at an overview, or compare its bytes."""


@pytest.fixture(autouse=True)
def few_overviews(request, monkeypatch):
    if "overviews" not in request.fixturenames:
        leave_figures_unrendered(monkeypatch)
