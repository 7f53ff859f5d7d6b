"""Features of drives, which are extracted while they are read."""

import os
import shutil

from helpers.small_towns import drive
import numpy as np
import pytest

from evaluation.base import InputError
from evaluation.change import map_source
from evaluation.drives import RecordingSource, open_drive
from evaluation.recognition import PAPER_PROTOCOL
from evaluation.study import choose_methods
from evaluation.study.features import extract_features

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


def test_a_recording_is_identified_by_its_files(tmp_path):
    folder = tmp_path / "metropolis_01"
    drive(folder, "01", "a")
    first = RecordingSource(folder).identity()
    assert RecordingSource(folder).identity() == first
    # Also by a link, under whose name it is in tables.
    (tmp_path / "links").mkdir()
    link = tmp_path / "links/metropolis_01"
    link.symlink_to(folder)
    assert RecordingSource(link).identity() == first
    other = tmp_path / "other_name"
    other.symlink_to(folder)
    assert RecordingSource(other).identity() != first
    (path,) = folder.glob("*.mcap")
    content = path.read_bytes()
    path.unlink()
    drive(tmp_path / "other" / "metropolis_01", "02", "a")
    (other,) = (tmp_path / "other").rglob("*.mcap")
    other.rename(path)
    assert RecordingSource(folder).identity() != first
    path.write_bytes(content)
    assert RecordingSource(folder).identity() == first
    with pytest.raises(InputError, match=r"none: no such file"):
        RecordingSource(tmp_path / "none").identity()


def test_a_copy_of_a_recording_is_the_same(tmp_path):
    folder = tmp_path / "metropolis_01"
    drive(folder, "01", "a")
    (path,) = folder.glob("*.mcap")
    identities = [RecordingSource(one).identity() for one in (folder, path)]
    copy = tmp_path / "copy" / "metropolis_01"
    shutil.copytree(folder, copy)
    os.utime(copy / path.name, ns=(1, 1))
    assert RecordingSource(copy).identity() == identities[0]
    assert RecordingSource(copy / path.name).identity() == identities[1]
