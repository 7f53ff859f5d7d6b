"""What is read of a drive: all at once, each scan once, in order."""

from helpers.small_towns import drive
import numpy as np
import pytest

from evaluation.base import LongList, Store
from evaluation.change import map_source
from evaluation.drives import open_drive
from evaluation.recognition import (
    PROTOCOLS,
    Descriptors,
    DriveData,
    Map,
    Picture,
    asked_of_places,
    asked_of_queries,
    choose_methods,
    gathered,
)

pytestmark = pytest.mark.slow

METHODS = choose_methods(["solid", "btc"])
# Places, queries of two protocols, a map and a picture.
ASKED = tuple(
    dict.fromkeys(
        (
            *asked_of_queries(METHODS, PROTOCOLS["random-yaw"]),
            *asked_of_places(METHODS, PROTOCOLS["random-yaw"]),
            *asked_of_queries(METHODS, PROTOCOLS["paper"]),
            Map(),
            Picture((5.0, 10.0), 100.0),
        )
    )
)


def assert_equal(one, other):
    """Compares nested dataclasses, lists and arrays bit by bit."""
    if isinstance(one, np.ndarray):
        assert (one.dtype, one.shape) == (other.dtype, other.shape)
        assert one.tobytes() == other.tobytes()
    elif hasattr(one, "__dataclass_fields__"):
        for name in one.__dataclass_fields__:
            assert_equal(getattr(one, name), getattr(other, name))
    elif isinstance(one, list | tuple | LongList):
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
def found(folder):
    """All that is asked, of a drive whose scans are read once, in order."""
    recorded = open_drive(folder)
    read = []
    scan = recorded.scan

    def once(index):
        assert index == len(read)
        read.append(index)
        return scan(index)

    recorded.scan = once
    found = gathered(recorded, ASKED)
    assert len(read) == len(recorded)
    return found


def test_each_is_what_is_found_alone(folder, found):
    for one in ASKED:
        assert_equal(gathered(open_drive(folder), [one])[one], found[one])


def test_maps_are_those_of_which_the_tcr_is_measured(folder, found):
    assert_equal(found[Map()].voxels, map_source(open_drive(folder)).voxels)


def test_files_hold_what_the_memory_holds(folder, found, tmp_path):
    data = DriveData(
        lambda: open_drive(folder), ASKED, "a drive", Store(tmp_path)
    )
    assert data.missing() == [*ASKED]
    data.fill()
    assert data.missing() == []
    for one in ASKED:
        assert_equal(data.take(one), found[one])
    # What is there is not read again, and what is not, alone.
    more = Descriptors(
        *choose_methods(["scan-context++"]), "places", PROTOCOLS["paper"]
    )
    grown = DriveData(data.source, (*ASKED, more), "a drive", Store(tmp_path))
    assert grown.missing() == [more]
