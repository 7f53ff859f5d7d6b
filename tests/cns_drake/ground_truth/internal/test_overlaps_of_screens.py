"""Exact overlap: closed forms of walls and screens, and its table."""

from helpers.small_map import box_visual, world_text
from helpers.tiny_drive import tiny_scenario
import numpy as np
import pytest

from cns_drake.ground_truth.exact_overlap import exact_overlaps
from cns_drake.simulation import SimulationSource
from evaluation.recognition import RetrievalProtocol

PROTOCOL = RetrievalProtocol(query_spacing=5.0, place_spacing=5.0)
# The first pose is (-10, 5), heading along x: the front of the wall is 10 m to
# the left, from 10 m behind to 10 m ahead.
WALL = box_visual("wall/body", (-10, 15.5, 0, 0, 0, 0), (20, 1, 60))
# It stands half-way, from 1 m ahead on.
SCREEN = box_visual("screen/body", (1, 10.05, 0, 0, 0, 0), (20, 0.1, 60))


def drive(folder, visuals, **lidar):
    """The drive of `tiny_scenario` in a world of these visuals."""
    folder.mkdir()
    world = folder / "world.sdf"
    world.write_text(world_text(visuals))
    config = {"preset": "vlp-16", "columns": 1440} | lidar
    scenario = tiny_scenario(
        folder, world=str(world), lidars={"lidar": config}, frames=1
    )
    return SimulationSource(scenario)()


def test_the_part_before_a_screen_is_seen(tmp_path):
    query = drive(tmp_path / "query", [WALL])
    database = drive(tmp_path / "database", [WALL, SCREEN])
    # The wall fills 90 deg of azimuth, 45 of them behind; ahead, it is free up
    # to 2 m.
    share = (45.0 + np.degrees(np.arctan(2.0 / 10.0))) / 90.0
    found = exact_overlaps(database, query, PROTOCOL)
    # A column of beams is a quarter of a degree wide.
    assert found == pytest.approx(share, abs=0.25 / 90.0)
    assert exact_overlaps(query, query, PROTOCOL) == 1.0
    # The screen hides the wall, which is seen beyond its end alone.
    back = exact_overlaps(query, database, PROTOCOL)
    assert back == pytest.approx(
        (45.0 + np.degrees(np.arctan(0.2)))
        / (45.0 + np.degrees(np.arctan(0.2)) + hidden_by_screen()),
        abs=0.01,
    )


def hidden_by_screen():
    """Degrees of azimuth in which the screen returns beams."""
    return np.degrees(np.arctan(21.0 / 5.0) - np.arctan(1.0 / 5.0))


def test_what_is_gone_is_not_seen(tmp_path):
    query = drive(tmp_path / "query", [WALL])
    database = drive(tmp_path / "database", [SCREEN])
    assert exact_overlaps(database, query, PROTOCOL) == 0.0


@pytest.mark.parametrize(("off", "share"), [(-0.01, 1.0), (0.001, 0.0)])
def test_the_tolerance_is_along_the_line_of_sight(tmp_path, off, share):
    """Beams to the left meet the wall at up to 15 deg from its normal."""
    moved = box_visual("w/b", (-10, 15.7 + off, 0, 0, 0, 0), (20, 1, 60))
    query, database = (
        drive(tmp_path / name, [visual], columns=4, resolution=0.0)
        for name, visual in (("query", WALL), ("database", moved))
    )
    assert len(query.scan(0)) == 16
    assert exact_overlaps(database, query, PROTOCOL) == share


def test_the_field_of_view_and_the_ranges_count(tmp_path):
    query = drive(tmp_path / "query", [WALL], preset="os1-128")
    z = query.pattern.beams(0).d_Sset[:, 2]
    # The beams of the other LiDAR end at 15 deg, and cover half of one more.
    within = np.abs(np.degrees(np.arcsin(z))) <= 15.0
    low = drive(tmp_path / "low", [WALL])
    share = within.mean()
    assert 0.6 < share < 0.8
    found = exact_overlaps(low, query, PROTOCOL)
    # Two rings on either side may lie there; each has equally many returns.
    assert share - 1e-9 <= found <= share + 4.0 / 128.0
    assert exact_overlaps(query, low, PROTOCOL) == 1.0
    near = drive(tmp_path / "near", [WALL], max_range=9.9)
    assert exact_overlaps(near, query, PROTOCOL) == 0.0
    assert np.isnan(exact_overlaps(query, near, PROTOCOL)).all()
