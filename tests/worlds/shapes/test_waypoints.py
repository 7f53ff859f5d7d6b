"""Waypoints: reading them, rounding corners, heights, faults."""

import numpy as np
import pytest
from shapely.geometry import LineString, Point

from evaluation.base import InputError
from worlds.shapes import load_waypoint_path, make_waypoint_path


def level(xy):
    return np.zeros(len(xy))


@pytest.fixture
def load(tmp_path):
    def _load(text, spacing=0.5):
        path = tmp_path / "drive.csv"
        path.write_bytes(text.encode())
        return load_waypoint_path(path, spacing, ground=level)

    return _load


def test_a_straight_line_is_followed_exactly(load):
    path = load("1, 2, 3\n31, 42, 8\n")
    np.testing.assert_allclose(path.points[0], [1, 2, 3], atol=1e-9)
    np.testing.assert_allclose(path.points[-1], [31, 42, 8], atol=1e-9)
    assert path.length == pytest.approx(np.hypot(50, 5), rel=1e-6)
    steps = np.linalg.norm(np.diff(path.points, axis=0), axis=1)
    np.testing.assert_allclose(steps, path.spacing, rtol=1e-6)
    assert path.spacing == pytest.approx(0.5, rel=0.01)
    # Two points are joined by a straight line, in height as well.
    share = (path.points[:, 0] - 1) / 30
    np.testing.assert_allclose(path.points[:, 2], 3 + 5 * share, atol=1e-9)
    assert np.all(np.isinf(path.speed_limits))


@pytest.mark.parametrize("turn_deg", [-120, -90, -10, 45, 149])
def test_corners_are_arcs(turn_deg):
    turn = np.radians(turn_deg)
    start = np.array([7.0, -3.0])
    angle = 0.4
    legs = 60.0 * np.array([np.cos(angle), np.sin(angle)])
    onward = 60.0 * np.array([np.cos(angle + turn), np.sin(angle + turn)])
    corner = start + legs
    points = np.zeros((3, 3))
    points[:, :2] = [start, corner, corner + onward]
    path = make_waypoint_path(points, 0.25).points[:, :2]
    # The arc's middle lies r / cos(turn / 2) - r from the corner.
    tangent = np.tan(abs(turn) / 2)
    radius = min(8.0, 30.0 / tangent)
    nearest = LineString(path).distance(Point(corner))
    assert nearest == pytest.approx(
        radius / np.cos(turn / 2) - radius, abs=2e-3
    )
    heading = np.unwrap(np.arctan2(*np.diff(path, axis=0).T[::-1]))
    curvature = np.abs(np.diff(heading)) / 0.25
    assert curvature.max() == pytest.approx(1 / radius, rel=0.02)
    assert heading[-1] - heading[0] == pytest.approx(turn, abs=1e-6)
    np.testing.assert_allclose(path[-1], points[2, :2], atol=1e-9)


def test_narrow_corners_share_their_segment():
    # A staircase of 6 m steps: each corner gets 3 m on either side.
    points = [(0, 0, 0), (30, 0, 0), (30, 6, 0), (36, 6, 0), (36, 40, 0)]
    path = make_waypoint_path(points, 0.1)
    line = LineString(path.points[:, :2])
    for corner in points[1:4]:
        expected = 3 * (np.sqrt(2) - 1)
        assert line.distance(Point(corner)) == pytest.approx(expected, abs=0.01)


def test_dense_waypoints_are_passed_closely():
    angle = np.linspace(0, 4, 900)
    spiral = np.column_stack(
        [(30 + 2 * angle) * np.cos(angle), 30 * np.sin(angle), 0.5 * angle]
    )
    path = make_waypoint_path(spiral, 0.5)
    line = LineString(path.points)
    for point in spiral[::50]:
        nearest = line.interpolate(line.project(Point(point)))
        found = np.array([nearest.x, nearest.y, nearest.z])
        np.testing.assert_allclose(found, point, atol=0.02)


def test_heights_pass_the_waypoints_without_overshoot():
    points = [(0, 0, 0), (40, 0, 0), (80, 0, 6), (120, 0, 6), (120, 50, 2)]
    path = make_waypoint_path(points, 0.25).points
    assert path[:, 2].min() >= -1e-12
    assert path[:, 2].max() <= 6 + 1e-12
    for x, y, z in points:
        near = np.argmin(np.hypot(path[:, 0] - x, path[:, 1] - y))
        assert path[near, 2] == pytest.approx(z, abs=0.02)


@pytest.mark.parametrize(
    "text",
    [
        "0,0\n30,0\n30,40\n",
        "x,y\n0,0\n30,0\n30,40\n",
        "\ufeffX, Y, name\r\n0, 0, a\r\n\r\n30, 0, b\r\n30, 40, c\r\n",
        "z,y,x\n0,0,0\n0,0,30\n0,40,30\n",
        # A waypoint that is named twice counts once.
        "0,0,0\n30,0,0\n30,0,0\n30,40,0\n",
    ],
)
def test_ways_to_write_the_same(load, text):
    expected = make_waypoint_path([(0, 0, 0), (30, 0, 0), (30, 40, 0)], 0.5)
    np.testing.assert_array_equal(load(text).points, expected.points)


@pytest.mark.parametrize(
    ("text", "fault"),
    [
        ("", r"drive\.csv: the file has no waypoints"),
        ("x,y,z\n", r"drive\.csv: the file has no waypoints"),
        ("0,0\n", r"drive\.csv: fewer than two different waypoints"),
        ("0,0,0\n0,0,5\n", r"drive\.csv: fewer than two different"),
        ("0,0\n30,here\n", r"line 2: 'here' is not a finite number"),
        ("0,0,0\n\n30,0,nan\n", r"line 3: 'nan' is not a finite number"),
        ("0,0,0\n30,0\n", r"line 2: 2 column\(s\) are too few"),
        ("0,0,0,0\n", r"line 1: 4 column\(s\); it must be x, y or x, y, z"),
        ("x,y\n0,0,50\n9,0,50\n", "line 2: 3 columns are more than the 2"),
        ("Z,x,y,z\n0,0,5,0\n", "line 1: column 'z' is there twice"),
        ("x,y\n0,0\n1_0,0\n", "line 3: '1_0' is not a finite number"),
        ("lat,lon\n1,2\n", r"line 1: neither numbers nor the names"),
        ("0,0\n12,0\n", r"drive\.csv: 12\.0 m long; a drive needs at least 20"),
        ("0,0\n30,0\n1e9,0\n", r"line 3: 1e9 m are more than 100000000 m"),
        (
            "0,0\n9e5,0\n",
            r"drive\.csv: 900000 m long; a drive can have at most",
        ),
        ("0,0\n30,0\n1,1\n", r"line 2: turns by 178 deg"),
        ("x,y\n0,0\n30,0\n30,0\n1,1\n", r"line 3: turns by 178 deg"),
    ],
)
def test_faults_name_the_line(load, text, fault):
    with pytest.raises(InputError, match=fault) as error:
        load(text)
    assert "\n" not in str(error.value)
    assert "drive.csv" in str(error.value)


def test_files_that_cannot_be_read(tmp_path):
    with pytest.raises(InputError, match=r"gone\.csv: No such file"):
        load_waypoint_path(tmp_path / "gone.csv", 2.0)
    (tmp_path / "binary.csv").write_bytes(b"\xff\xfe\x00")
    with pytest.raises(InputError, match="not UTF-8"):
        load_waypoint_path(tmp_path / "binary.csv", 2.0)
