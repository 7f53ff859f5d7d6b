"""The user chooses queries, places and matches."""

from dataclasses import replace
import pickle

from helpers.drive_files import make_scan, write_recording, yaw_pose
from helpers.measured_pairs import place_outcome, values_of
import numpy as np
import pytest

from evaluation.base import InputError
from evaluation.drives import open_drive
from evaluation.methods import Method, MethodConfig
from evaluation.recognition import (
    PAPER_PROTOCOL,
    ProtocolFieldError,
    RetrievalProtocol,
    retrieve,
)


class Means(Method):
    """Compares the means of clouds; a quick search finds few places."""

    name = "means"
    Config = MethodConfig

    def describe(self, points):
        return np.append(points.mean(axis=0), len(points))

    def build_database(self, places):
        return np.array(places)

    def score(self, query, database, *, exhaustive=False):
        scores = -np.linalg.norm(database - query, axis=1)
        if not exhaustive:
            scores[np.argsort(-scores)[2:]] = np.nan
        return scores


def record(folder, xs):
    """Drives along x, a frame each 50 ms; the scan at x shows its x."""
    scans = [
        make_scan(np.array([[5.0, 0.0, float(x)], [60.0, 0.0, 0.0]]))
        for x in xs
    ]
    X_WBs = [yaw_pose(x, 0.0, 0.0, 0.0) for x in xs]
    return open_drive(write_recording(folder, scans, X_WBs))


@pytest.fixture
def drives(tmp_path):
    database = record(tmp_path / "a", np.arange(0.0, 31.0, 1.0))
    return database, record(tmp_path / "b", np.arange(0.5, 31.0, 1.0))


def test_spacing_of_queries_and_places(drives):
    found = retrieve(*drives, Means(), RetrievalProtocol(query_spacing=3.0))
    assert found.query_frames.tolist() == [*range(0, 30, 3), 30]
    found = retrieve(*drives, Means(), RetrievalProtocol(place_spacing=15.0))
    assert found.database_frames.tolist() == [0, 15, 30]


@pytest.mark.parametrize(("radius", "number"), [(0.5, 1), (0.499, 0), (5.5, 3)])
def test_radius_includes_its_limit(drives, radius, number):
    found = retrieve(*drives, Means(), RetrievalProtocol(radius=radius))
    # The query is at 10.5 m, and places are 5 m apart.
    assert found.matches[1].sum() == number


def test_range_limits_points(drives):
    for half_extent, number in ((59.9, 1), (60.0, 2)):
        protocol = RetrievalProtocol(half_extent=half_extent)
        seen = []

        class Counting(Means):
            def describe(self, points, seen=seen):
                seen.append(len(points))
                return super().describe(points)

        retrieve(*drives, Counting(), protocol)
        assert set(seen) == {number}


def test_scans_are_merged_for_every_method(drives):
    class Counting(Means):
        scans_per_place = 2

        def describe(self, points):
            assert len(points) in sizes
            return super().describe(points)

    sizes = {4, 2}  # The last frame stands alone.
    retrieve(*drives, Counting(), PAPER_PROTOCOL)
    sizes = {6, 2}
    protocol = replace(PAPER_PROTOCOL, scans_per_place=3)
    outcome = place_outcome(*drives, Counting(), protocol=protocol)
    assert outcome.protocol.scans_per_place == 3
    assert place_outcome(*drives, Means()).protocol.scans_per_place == 1


def test_a_drive_against_itself(tmp_path):
    # There and back: 40 m in 41 frames of 50 ms each way.
    there = np.arange(0.0, 41.0)
    drive = record(tmp_path / "loop", np.concatenate([there, there[::-1]]))
    protocol = RetrievalProtocol(exclude_recent=0.5)
    found = retrieve(drive, drive, Means(), protocol)
    age = (found.query_frames[:, None] - found.database_frames) * 0.05
    assert np.isnan(found.scores[age < 0.5 - 1e-9]).all()
    # Each candidate has a score, not only the best ones of a search.
    assert not np.isnan(found.scores[age >= 0.5 - 1e-9]).any()
    near = found.distances <= 7.5
    np.testing.assert_array_equal(found.matches, near & (age >= 0.5 - 1e-9))
    outcome = place_outcome(drive, drive, Means(), protocol=protocol)
    # These are all queries of the way back except those just after the turn.
    assert values_of(outcome)["with_match"] in (3, 4)
    assert values_of(outcome)["r1"] == 1.0
    with pytest.raises(InputError, match=r"loop: never within 7.5 m of where"):
        place_outcome(
            drive, drive, Means(), protocol=RetrievalProtocol(exclude_recent=9)
        )


def test_others_are_asked_all_they_know(drives):
    protocol = RetrievalProtocol(exclude_recent=1000.0)
    found = retrieve(*drives, Means(), protocol)
    np.testing.assert_array_equal(found.matches, found.distances <= 7.5)


@pytest.mark.parametrize(
    "name",
    [
        "radius",
        "query_spacing",
        "place_spacing",
        "half_extent",
        "scans_per_place",
        "exclude_recent",
    ],
)
@pytest.mark.parametrize("value", [0, -1.0, np.nan, np.inf])
def test_what_is_not_positive_is_refused(name, value):
    option = name.replace("_", "-")
    with pytest.raises(InputError, match=f"--{option}: .* is not positive"):
        RetrievalProtocol(**{name: value})


@pytest.mark.parametrize(
    ("fields", "fault"),
    [
        ({"overlap": 70.0}, "--overlap: 70.0 is not above 0 and up to 1"),
        ({"overlap": 0.0}, "--overlap: 0.0 is not above 0"),
        ({"place": "Middle"}, "--place: no place 'Middle' .*mean middle"),
    ],
)
def test_what_no_match_could_have_is_refused(fields, fault):
    with pytest.raises(InputError, match=fault):
        RetrievalProtocol(**fields)


def test_an_error_says_which_field_is_wrong_also_in_another_process():
    with pytest.raises(ProtocolFieldError) as raised:
        RetrievalProtocol(query_spacing=-1)
    for error in (raised.value, pickle.loads(pickle.dumps(raised.value))):
        assert (error.field, error.fault) == (
            "query_spacing",
            "-1 is not positive",
        )
        assert str(error) == "--query-spacing: -1 is not positive"


def test_it_is_part_of_every_number():
    protocol = RetrievalProtocol(radius=3.0, scans_per_place=4)
    assert protocol.of(Means()) == protocol
    single = RetrievalProtocol().of(Means())
    assert (single.scans_per_place, single.place) == (1, None)
    text = protocol.to_text()
    assert "within 3 m" in text
    assert "4 scans a place, the middle scan gives the pose" in text


def test_the_gate_is_said():
    open_gate, shut = RetrievalProtocol(), RetrievalProtocol(verified=True)
    assert "verified" not in open_gate.to_text()
    assert "With geometric verification" in shut.to_text()
    assert (open_gate.verification_radius, shut.verification_radius) == (
        None,
        7.5,
    )
    # Descriptions of a drive do not depend on this option.
    assert shut.descriptor_options() == open_gate.descriptor_options()
