"""A pair of drives has the numbers of the single commands."""

from dataclasses import dataclass

from helpers.measured_pairs import place_outcome
from helpers.small_towns import drive
import numpy as np
import pytest

from cns_drake.base import Reporter
from evaluation.drives import open_drive
from evaluation.methods import make_method
from evaluation.recognition import RetrievalProtocol, overlap_matrix
from evaluation.study import (
    MakePart,
    MethodChoice,
    Part,
    RecordingSource,
    parts,
    place_measurements,
)
from evaluation.study.feature_extraction import FeatureExtraction
from evaluation.study.place_measurements import (
    PlaceComparison,
    measure_places,
    shown_overlaps,
)
from evaluation.study.study_files import FeatureFiles

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


def pair(folder, part, **changes):
    """Two drives, of which the database is described beforehand."""
    values = {
        "database": described(folder, "metropolis_01", "places"),
        "query": Once(folder / "metropolis_04"),
        "methods": METHODS,
        "protocol": PROTOCOL,
        "radii": (PROTOCOL.radius,),
    }
    compared = PlaceComparison(**(values | changes))
    return MakePart(Part(part), measure_places, (compared,))


def _done(step):
    step.run(Reporter())
    return step.part.read()


@pytest.mark.slow
def test_the_numbers_are_those_of_the_single_command(folder, tmp_path):
    step = pair(folder, tmp_path / "pair.data")
    found = _done(step)
    assert step.is_done()
    assert [(one.method, one.is_verified) for one in found] == [
        (choice.key, verified)
        for choice in METHODS
        for verified in (False, True)
    ]
    database, query = (
        open_drive(folder / name) for name in ("metropolis_01", "metropolis_04")
    )
    choices = [choice for choice in METHODS for _ in range(2)]
    for one, choice in zip(found, choices, strict=True):
        alone = place_outcome(
            database,
            query,
            make_method(choice.name, dict(choice.settings)),
            protocol=RetrievalProtocol(verified=one.is_verified),
        )
        for name in ("best_scores", "is_right", "first_right_ranks"):
            np.testing.assert_array_equal(
                getattr(one.outcomes, name), getattr(alone.outcomes, name)
            )
        np.testing.assert_array_equal(
            one.columns["translation_error"],
            alone.columns["translation_error"],
        )
        np.testing.assert_array_equal(
            one.columns["match_frame"], alone.columns["match_frame"]
        )


def test_the_best_match_agrees_with_the_matrix_of_overlaps(folder, tmp_path):
    database, query = (
        open_drive(folder / name) for name in ("metropolis_01", "metropolis_04")
    )
    matrix = overlap_matrix(database, query, PROTOCOL)
    apart = np.linalg.norm(
        query.X_WS[:, None, :3, 3] - database.X_WS[None, :, :3, 3], axis=2
    )
    # Places and queries are all frames of both drives.
    assert matrix.shape == apart.shape
    expected = np.where(apart <= PROTOCOL.radius, matrix, 0.0).max(axis=1)
    for one in _done(pair(folder, tmp_path / "pair.data")):
        np.testing.assert_allclose(one.columns["overlap"], expected, atol=1e-4)


@pytest.mark.slow
def test_drives_that_are_longer_than_the_memory_give_the_same(
    folder, tmp_path, monkeypatch
):
    stored = tmp_path / "stored"
    stored.mkdir()
    for name in ("metropolis_01", "metropolis_04"):
        (stored / name).symlink_to(folder / name)

    def compared(root):
        query = described(root, "metropolis_04", "queries")
        return pair(root, tmp_path / "pair.data", query=query).arguments[0]

    def measured(compared):
        shown = shown_overlaps(Reporter(), compared.by_method(0))
        return measure_places(Reporter(), compared), shown

    expected, expected_shown = measured(compared(folder))
    # Two items a block, and a group of places for every few.
    monkeypatch.setattr(parts, "_MOST_HELD", 3)
    monkeypatch.setattr(parts, "_BLOCK", 2)
    monkeypatch.setattr(place_measurements, "MOST_BYTES", 100_000)
    places, asked = (one[1].read()[1] for one in compared(stored).stored)
    assert places.places.descriptors.is_in_file
    assert asked.queries.descriptors.is_in_file
    found, shown = measured(compared(stored))
    np.testing.assert_array_equal(
        shown[PROTOCOL.radius], expected_shown[PROTOCOL.radius]
    )
    assert len(found) == len(expected) > 0
    for one, other in zip(found, expected, strict=True):
        assert one.columns.keys() == other.columns.keys()
        for name, column in one.columns.items():
            np.testing.assert_array_equal(column, other.columns[name])


@pytest.mark.slow
def test_places_of_other_cities_are_never_right(folder, tmp_path):
    others = (described(folder, "suburbia_01", "places")[1:],)
    plain = _done(pair(folder, tmp_path / "plain.data"))
    for number in (3, 100):
        step = pair(
            folder,
            tmp_path / f"{number}.data",
            distractors=others,
            num_distractors=number,
        )
        for before, after in zip(plain, _done(step), strict=True):
            places = before.outcomes.num_places
            assert after.outcomes.num_places == places + min(number, 9)
            np.testing.assert_array_equal(
                before.outcomes.has_match, after.outcomes.has_match
            )
            elsewhere = after.columns["match_drive"] == "suburbia_01"
            assert not after.outcomes.is_right[elsewhere].any()
            assert np.isnan(after.columns["distance"][elsewhere]).all()
    # Stage 01 lacks the structures that the query sees; the other town has
    # them.
    assert elsewhere.any()


def test_another_database_is_another_pair(folder, tmp_path):
    step = pair(folder, tmp_path / "pair.data")
    step.run(Reporter())
    other = pair(
        folder,
        step.part.path,
        database=RecordingSource(folder / "metropolis_04"),
    )
    assert step.is_done()
    assert not other.is_done()


def test_methods_that_would_take_very_long_are_left_out(
    folder, tmp_path, monkeypatch
):
    monkeypatch.setattr(place_measurements, "_LONGEST_MS", 0.0)
    notes = []
    reporter = Reporter(
        lambda kind, *values: kind == "note" and notes.extend(values)
    )
    # Only a large database is timed.
    step = pair(folder, tmp_path / "few.data")
    step.run(reporter)
    assert len(step.part.read()) == 2 * len(METHODS)
    assert not notes
    monkeypatch.setattr(place_measurements, "_MANY", 3)
    step = pair(folder, tmp_path / "many.data")
    step.run(reporter)
    assert step.part.read() == []
    assert notes == [
        f"{choice.name}: left out, because it would take over an hour"
        for choice in METHODS
    ]
