"""What the tests of road networks share."""

import copy

from helpers.road_crossing import CROSS, load_network
import pytest


@pytest.fixture
def cross():
    return copy.deepcopy(CROSS)


@pytest.fixture
def load(tmp_path):
    return lambda content: load_network(content, tmp_path)
