"""Features of drives, which are extracted while they are read."""

from dataclasses import dataclass, field
import os
import shutil

from helpers.small_towns import drive
import numpy as np
import pytest

from cns_drake.base import InputError, Reporter, xyz
from cns_drake.drives import Drive
from evaluation.change import read_map
from evaluation.drives import open_drive, within_cube
from evaluation.recognition import PAPER_PROTOCOL, describe_drive
from evaluation.study import (
    MakePart,
    Part,
    RecordingSource,
    choose_methods,
    extract_features,
)
from evaluation.study.feature_extraction import FeatureExtraction
from evaluation.study.place_measurements import PlaceComparison, measure_places
from evaluation.study.study_files import FeatureFiles

pytestmark = pytest.mark.slow

BOTH = frozenset({"places", "queries"})


class OnTheFly(Drive):
    """A drive whose scans can be read once, in order."""

    def __init__(self, recorded):
        self.name = recorded.name
        self.world_frame = recorded.world_frame
        self._recorded = recorded
        self._next = 0

    def __len__(self):
        return len(self._recorded)

    @property
    def stamps_ns(self):
        return self._recorded.stamps_ns

    @property
    def X_WS(self):
        return self._recorded.X_WS

    @property
    def scenario(self):
        return self._recorded.scenario

    @property
    def instances(self):
        return self._recorded.instances

    def scan(self, index):
        assert index == self._next
        self._next += 1
        return self._recorded.scan(index)


@dataclass
class Source:
    """Opens a drive on the fly, and counts how often."""

    recorded: Drive
    seed: int = 0
    opened: list = field(default_factory=list)

    def __call__(self):
        self.opened.append(OnTheFly(self.recorded))
        return self.opened[-1]

    def identity(self):
        return {"seed": self.seed}


def extract(source, methods, files, roles=BOTH, **options):
    """Extracts features unless all its parts exist."""
    step = FeatureExtraction(
        source, roles, tuple(methods), PAPER_PROTOCOL, files, **options
    )
    if not step.is_done():
        step.run(Reporter())
    assert step.is_done()


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


@pytest.fixture
def source(recorded):
    return Source(recorded)


@pytest.fixture
def files(tmp_path):
    return FeatureFiles(tmp_path / "features")


def test_stored_features_equal_computed_ones(recorded, source, files):
    choices = choose_methods()
    extract(source, choices, files)
    methods = [choice.make() for choice in choices]
    asked = {one.name: (one, BOTH, PAPER_PROTOCOL) for one in methods}
    found = extract_features(recorded, BOTH, asked)
    assert_equal(files.drive.read(), found.drive)
    assert_equal(files.fine.read(), found.fine)
    direct = describe_drive(recorded, methods, BOTH, PAPER_PROTOCOL)
    for choice, expected in zip(choices, direct, strict=True):
        placed, described = files.described(choice.name).read()
        assert_equal(described, expected)
        assert placed == found.drive.placed
    assert len(source.opened) == 1
    assert source.opened[0]._next == len(recorded)


def test_scans_of_places_and_queries_are_kept(recorded, source, files):
    extract(source, (), files, with_scans=True)
    extract(source, (), files, with_scans=True)
    assert len(source.opened) == 1
    kept = files.scans.read()
    assert kept.instances == recorded.instances
    assert kept.name == recorded.name
    assert_equal(kept.X_WS, recorded.X_WS)
    frames = files.drive.read().frames
    assert len(frames) > 1
    for frame in frames.tolist():
        scan, found = recorded.scan(frame), kept.scan(frame)
        assert found.dtype.names == ("x", "y", "z", "instance")
        scan = scan[within_cube(xyz(scan), PAPER_PROTOCOL.half_extent)]
        for name in found.dtype.names:
            np.testing.assert_array_equal(found[name], scan[name])


@pytest.mark.parametrize("roles", [frozenset(), BOTH])
def test_maps_are_those_of_which_the_tcr_is_measured(folder, recorded, roles):
    asked = {"a": (choose_methods()[0].make(), roles, PAPER_PROTOCOL)}
    found = extract_features(recorded, roles, asked)
    assert_equal(found.drive.coarse, read_map(folder).voxels)


def test_only_missing_or_stale_parts_are_computed(source, files):
    *others, btc = sorted(choose_methods(), key=lambda one: one.name == "btc")
    extract(source, others, files)
    stamps = {path: path.stat().st_mtime_ns for path in files.folder.iterdir()}
    extract(source, others, files)
    assert len(source.opened) == 1
    extract(source, (*others, btc), files)
    assert len(source.opened) == 2
    for method in others:
        path = files.described(method.name).path
        assert path.stat().st_mtime_ns == stamps[path]
    extract(source, (*others, btc), files, frozenset())
    assert len(source.opened) == 3
    assert len(files.drive.read().frames) == 0
    other = Source(source.recorded, 7, source.opened)
    extract(other, (), files, frozenset())
    assert len(source.opened) == 4


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


def test_drives_of_two_worlds_are_not_compared(tmp_path, recorded):
    class Elsewhere(OnTheFly):
        def __init__(self, other):
            super().__init__(other)
            self.world_frame = "utm"

    (solid,) = (one for one in choose_methods() if one.name == "solid")
    extracted = (FeatureFiles(tmp_path / "a"), FeatureFiles(tmp_path / "b"))
    extract(Source(recorded), (solid,), extracted[0], with_scans=True)
    other = Source(Elsewhere(recorded))
    extract(other, (solid,), extracted[1], with_scans=True)
    part = Part(tmp_path / "results" / "solid.data")
    database, query = (
        (one.scans, one.described(solid.name)) for one in extracted
    )
    compared = PlaceComparison(
        database,
        query,
        (solid,),
        PAPER_PROTOCOL,
        (7.5,),
    )
    step = MakePart(part, measure_places, (compared,))
    with pytest.raises(InputError, match="poses in frame 'utm'"):
        step.run(Reporter())
    assert not part.path.parent.exists()
