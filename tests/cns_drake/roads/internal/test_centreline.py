"""Lines and arcs against closed forms."""

import numpy as np
import pytest

from cns_drake.roads import blend, sample_stations
from cns_drake.roads.centreline import Centreline, _Piece


def test_rounded_corner_is_line_arc_line():
    # A right turn by 90 degrees: 70 m, an arc of 30 m radius, 20 m.
    curve = Centreline([(0, 0), (0, 100), (50, 100)], [30.0])
    assert curve.length == pytest.approx(70 + 30 * np.pi / 2 + 20)

    middle = 70 + 30 * np.pi / 4
    x, y, heading = curve.evaluate([middle])[0]
    centre = np.array([30.0, 70.0])
    expected = centre + 30 * np.array([-1, 1]) / np.sqrt(2)
    np.testing.assert_allclose([x, y], expected, atol=1e-12)
    assert heading == pytest.approx(np.pi / 4)


def test_heading_is_the_derivative_across_all_joints():
    curve = Centreline(
        [(-3, 2), (40, 5), (60, -50), (10, -90), (-60, -20)],
        [12.0, 20.0, 25.0],
    )
    s = np.linspace(0.01, curve.length - 0.01, 4001)
    step = 1e-5
    ahead, behind = curve.evaluate(s + step), curve.evaluate(s - step)
    tangent = (ahead[:, :2] - behind[:, :2]) / (2 * step)
    heading = curve.evaluate(s)[:, 2]
    np.testing.assert_allclose(tangent[:, 0], np.cos(heading), atol=1e-6)
    np.testing.assert_allclose(tangent[:, 1], np.sin(heading), atol=1e-6)


def test_two_arcs_may_meet_but_not_overlap():
    corners = [(0, 0), (50, 0), (50, 60), (0, 60)]
    Centreline(corners, [30.0, 30.0])
    with pytest.raises(ValueError, match=r"segment 1 need 60\.10 m"):
        Centreline(corners, [30.1, 30.0])


def test_consecutive_points_must_differ():
    with pytest.raises(ValueError, match="coincide"):
        Centreline([(0, 0), (5, 5), (5, 5)], [1.0])


def test_stations_include_both_ends_and_keep_the_spacing():
    stations = sample_stations(2.0, 12.5, 1.0)
    assert stations[0] == 2.0
    assert stations[-1] == 12.5
    assert np.diff(stations).max() <= 1.0
    assert len(sample_stations(0.0, 10.0, 1.0)) == 11


@pytest.mark.parametrize("max_radius", [np.inf, 6.0])
def test_blend_of_a_turn_is_the_widest_allowed_arc(max_radius):
    # The lines meet 20 m ahead of the start, 12 m behind the end.
    points = blend((0, 0), 0.0, (20, 12), np.pi / 2, 0.5, max_radius)
    radius = min(12.0, max_radius)
    centre = np.array([20 - radius, radius])
    on_arc = points[(points[:, 0] > centre[0]) & (points[:, 1] < radius)]
    distance = np.linalg.norm(on_arc - centre, axis=1)
    np.testing.assert_allclose(distance, radius, atol=1e-9)
    np.testing.assert_allclose(points[[0, -1]], [(0, 0), (20, 12)], atol=1e-9)


def test_blend_of_offset_lanes_keeps_the_headings():
    points = blend((0, 0), 0.1, (40, 7), 0.1, 0.01)
    for edge in (points[1] - points[0], points[-1] - points[-2]):
        assert np.arctan2(edge[1], edge[0]) == pytest.approx(0.1, abs=1e-3)
    np.testing.assert_allclose(points[[0, -1]], [(0, 0), (40, 7)], atol=1e-9)


def test_only_the_needed_pieces_are_computed(monkeypatch):
    """Looking at all pieces, 100,000 waypoints would take minutes."""
    corners = [(10.0 * k, float(k % 2)) for k in range(40)]
    curve = Centreline(corners, np.ones(38))
    asked = []
    evaluate = _Piece.evaluate

    def counted(piece, s):
        asked.append(len(s))
        return evaluate(piece, s)

    monkeypatch.setattr(_Piece, "evaluate", counted)
    s = np.array([curve.length, 3.0, 0.0, 2.0, -1.0])
    unsorted = curve.evaluate(s)
    assert sorted(asked) == [1, 4]
    np.testing.assert_array_equal(unsorted, [curve.evaluate([x])[0] for x in s])
