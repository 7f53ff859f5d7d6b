"""A small town, and the changes to it along one drive."""

from helpers.transient_town import (
    DRIVE,
    LANES,
    change_maker,
    write_transient_town,
)
import pytest


@pytest.fixture(scope="session")
def sdf(tmp_path_factory):
    return write_transient_town(tmp_path_factory.mktemp("town"))


@pytest.fixture(scope="session")
def changed(sdf):
    """Returns the world after changes and its structures, cached."""
    return change_maker(sdf, DRIVE, LANES)
