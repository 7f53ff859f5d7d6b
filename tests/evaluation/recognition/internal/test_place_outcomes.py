"""A pair of drives has the numbers of the single commands."""

from helpers.small_towns import drive
import numpy as np
import pytest

from evaluation.base import Reporter, Store
from evaluation.base.jobs import parts
from evaluation.drives import RecordingSource
from evaluation.recognition import (
    Descriptors,
    DriveData,
    MethodChoice,
    PlaceComparison,
    RetrievalProtocol,
    asked_of_places,
    asked_of_queries,
    measure_places,
    place_measurements,
)

METHODS = (
    MethodChoice("solid"),
    MethodChoice("layered-overlap"),
    MethodChoice("solid", settings=(("ranges", "20"),)),
)
PROTOCOL = RetrievalProtocol()


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    folder = tmp_path_factory.mktemp("drives")
    drive(folder / "metropolis_01", "01", "a")
    drive(folder / "metropolis_04", "04", "b")
    drive(folder / "suburbia_01", "04", "a", city="suburbia")
    return folder


@pytest.mark.slow
def test_drives_that_are_longer_than_the_memory_give_the_same(
    folder, tmp_path, monkeypatch
):
    def compared(store):
        def data(name, ask):
            source = RecordingSource(folder / name)
            found = DriveData(source, ask(METHODS, PROTOCOL), name, store)
            found.fill()
            return found

        return PlaceComparison(
            (data("metropolis_01", asked_of_places),),
            data("metropolis_04", asked_of_queries),
            METHODS,
            PROTOCOL,
            (PROTOCOL.radius,),
        )

    def measured(compared):
        found = measure_places(Reporter(), compared)
        return [one for outcomes, _ in found for one in outcomes]

    expected = measured(compared(None))
    # Two items a block, and a group of places for every few.
    monkeypatch.setattr(parts, "_MOST_HELD", 3)
    monkeypatch.setattr(parts, "_BLOCK", 2)
    monkeypatch.setattr(place_measurements, "MOST_BYTES", 100_000)
    long = compared(Store(tmp_path))
    of_places = long.database[0].take(
        Descriptors(METHODS[0], "places", PROTOCOL)
    )
    assert of_places.places.descriptors.is_in_file
    found = measured(long)
    assert len(found) == len(expected) > 0
    for one, other in zip(found, expected, strict=True):
        columns = other.outcomes.columns
        assert one.outcomes.columns.keys() == columns.keys()
        for name, column in one.outcomes.columns.items():
            np.testing.assert_array_equal(column, columns[name])
