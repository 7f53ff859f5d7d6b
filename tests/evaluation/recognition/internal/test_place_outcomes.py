"""A pair of drives has the numbers of the single commands."""

from dataclasses import dataclass

from helpers.small_towns import drive
import numpy as np
import pytest

from evaluation.base import Reporter
from evaluation.base.jobs import parts
from evaluation.drives import RecordingSource, open_drive
from evaluation.recognition import (
    FeatureExtraction,
    FeatureFiles,
    MethodChoice,
    PlaceComparison,
    RetrievalProtocol,
    ScansOf,
    measure_places,
    place_measurements,
    shown_overlaps,
)

METHODS = (
    MethodChoice("solid"),
    MethodChoice("layered-overlap"),
    MethodChoice("solid", settings=(("ranges", "20"),)),
)
PROTOCOL = RetrievalProtocol()


@dataclass(frozen=True)
class Once:
    """Opens a recorded drive whose scans are read once each, in order."""

    path: object

    def __call__(self):
        recorded = open_drive(self.path)
        read = []
        scan = recorded.scan

        def once(index):
            assert index not in read
            read.append(index)
            return scan(index)

        recorded.scan = once
        return recorded

    def identity(self):
        return str(self.path)


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    folder = tmp_path_factory.mktemp("drives")
    drive(folder / "metropolis_01", "01", "a")
    drive(folder / "metropolis_04", "04", "b")
    drive(folder / "suburbia_01", "04", "a", city="suburbia")
    return folder


def described(folder, name, role):
    """The parts of a drive's scans and descriptions, which are there."""
    files = FeatureFiles(folder / "parts" / name)
    step = FeatureExtraction(
        RecordingSource(folder / name),
        frozenset({role}),
        METHODS,
        PROTOCOL,
        files,
        with_scans=True,
        with_map=False,
    )
    if not step.is_done():
        step.run(Reporter())
    return (files.scans, *(files.described(one.key) for one in METHODS))


@pytest.mark.slow
def test_drives_that_are_longer_than_the_memory_give_the_same(
    folder, tmp_path, monkeypatch
):
    stored = tmp_path / "stored"
    stored.mkdir()
    for name in ("metropolis_01", "metropolis_04"):
        (stored / name).symlink_to(folder / name)

    def compared(root):
        return PlaceComparison(
            described(root, "metropolis_01", "places"),
            described(root, "metropolis_04", "queries"),
            METHODS,
            PROTOCOL,
            (PROTOCOL.radius,),
        )

    def measured(compared):
        shown = shown_overlaps(Reporter(), ScansOf(compared))
        found = measure_places(Reporter(), compared)
        return [one for outcomes, _ in found for one in outcomes], shown

    expected, expected_shown = measured(compared(folder))
    # Two items a block, and a group of places for every few.
    monkeypatch.setattr(parts, "_MOST_HELD", 3)
    monkeypatch.setattr(parts, "_BLOCK", 2)
    monkeypatch.setattr(place_measurements, "MOST_BYTES", 100_000)
    places, asked = (one[1].read() for one in compared(stored).stored)
    assert places.places.descriptors.is_in_file
    assert asked.queries.descriptors.is_in_file
    found, shown = measured(compared(stored))
    np.testing.assert_array_equal(
        shown[PROTOCOL.radius], expected_shown[PROTOCOL.radius]
    )
    assert len(found) == len(expected) > 0
    for one, other in zip(found, expected, strict=True):
        columns = other.outcomes.columns
        assert one.outcomes.columns.keys() == columns.keys()
        for name, column in one.outcomes.columns.items():
            np.testing.assert_array_equal(column, columns[name])
