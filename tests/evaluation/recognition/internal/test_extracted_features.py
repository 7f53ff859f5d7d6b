"""Features of drives, which are extracted while they are read."""

from helpers.small_towns import drive
import numpy as np
import pytest

from evaluation.change import map_source
from evaluation.drives import open_drive
from evaluation.recognition import PAPER_PROTOCOL, choose_methods
from evaluation.recognition.features import extract_features

pytestmark = pytest.mark.slow

BOTH = frozenset({"places", "queries"})


def assert_equal(one, other):
    """Compares nested dataclasses, lists and arrays bit by bit."""
    assert type(one) is type(other)
    if isinstance(one, np.ndarray):
        assert (one.dtype, one.shape) == (other.dtype, other.shape)
        assert one.tobytes() == other.tobytes()
    elif hasattr(one, "__dataclass_fields__"):
        for name in one.__dataclass_fields__:
            assert_equal(getattr(one, name), getattr(other, name))
    elif isinstance(one, list | tuple):
        assert len(one) == len(other)
        for a, b in zip(one, other, strict=True):
            assert_equal(a, b)
    else:
        assert one == other


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    folder = tmp_path_factory.mktemp("drives") / "metropolis_01"
    drive(folder, "01", "a")
    return folder


@pytest.fixture(scope="module")
def recorded(folder):
    return open_drive(folder)


@pytest.mark.parametrize("roles", [frozenset(), BOTH])
def test_maps_are_those_of_which_the_tcr_is_measured(folder, recorded, roles):
    asked = {"a": (choose_methods()[0].make(), roles, PAPER_PROTOCOL)}
    found = extract_features(recorded, roles, asked)
    assert_equal(found.drive.coarse, map_source(recorded).voxels)
