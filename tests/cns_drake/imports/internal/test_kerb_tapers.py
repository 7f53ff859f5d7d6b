"""Kerbs of imported roads swing over where a shoulder ends."""

from helpers.small_opendrive import lane, straight, turn, write_roads
import numpy as np
import pytest
import shapely
from shapely.geometry import LineString, Polygon, box

from cns_drake.imports.faults import ImportFaults
from cns_drake.imports.opendrive.imported_streets import (
    ImportedStreets,
    kerb_tapers,
)
from cns_drake.imports.opendrive.lanes import lane_bands, lane_polygon
from cns_drake.imports.opendrive.road_reader import read_roads

LANES = (lane(1, "driving", 3.5), lane(-1, "driving", 3.5))
WITH_SHOULDERS = (
    *LANES, lane(2, "shoulder", 0.3), lane(-2, "shoulder", 0.3),
    lane(3, "sidewalk", 2.0), lane(-3, "sidewalk", 2.0),
)  # fmt: skip


def read(path):
    roads = read_roads(path, ImportFaults()).roads
    return [band for one in roads for band in lane_bands(one)]


def test_a_shoulder_that_ends_is_tapered(tmp_path):
    path = write_roads(
        tmp_path / "a.xodr",
        straight("1", -40, 0, 0, 0, lanes=WITH_SHOULDERS),
        straight("2", 0, 0, 40, 0, lanes=LANES, junction="9"),
        straight("3", 40, 0, 80, 0, lanes=WITH_SHOULDERS),
    )
    carriageway = ImportedStreets(read(path)).areas.carriageway
    # Four tapers are ten times as long as the shoulders are wide.
    expected = 7.0 * 120.0 + 4 * 0.3 * 40.0 + 4 * 0.3 * 3.0 / 2.0
    assert carriageway.area == pytest.approx(expected, abs=0.05)
    for x, half in ((-1, 3.8), (1.5, 3.65), (3.2, 3.5), (38.5, 3.65)):
        across = LineString([(x, -9), (x, 9)]).intersection(carriageway)
        assert across.length == pytest.approx(2 * half, abs=0.02), x


@pytest.mark.parametrize(("heading", "angle"), [(0, 1.5), (0, -1.5), (2, -1.2)])
def test_no_kerb_turns_sharply_where_a_lane_bends(tmp_path, heading, angle):
    """The lane of the junction bends to the side of the shoulder or away."""
    c, s = np.cos(heading), np.sin(heading)
    shoulder = (
        lane(-1, "driving", 3.5), lane(-2, "shoulder", 0.3),
        lane(-3, "sidewalk", 2.0),
    )  # fmt: skip
    path = write_roads(
        tmp_path / "a.xodr",
        straight("1", -30 * c, -30 * s, 0, 0, lanes=shoulder),
        turn("2", 0, 0, heading, 12.0, angle),
    )
    bands = read(path)
    carriageway = ImportedStreets(bands).areas.carriageway
    lanes = [lane_polygon(b) for b in bands if b.kind != "sidewalk"]
    assert shapely.union_all(lanes).difference(carriageway).area < 0.05
    # About a triangle of 0.3 by 3 m is added.
    assert 0.2 < carriageway.area - shapely.union_all(lanes).area < 0.8
    (outline,) = carriageway.geoms
    xy = shapely.get_coordinates(outline.exterior.simplify(0.005))
    steps = np.diff(xy, axis=0)
    turns = np.angle(np.exp(1j * np.diff(np.arctan2(steps[:, 1], steps[:, 0]))))
    near = np.hypot(*xy[1:-1].T) < 10.0
    assert near.sum() > 3
    assert np.degrees(np.abs(turns[near])).max() < 25.0


def test_a_bay_between_two_steps_is_filled():
    """A kerb goes straight past a recess that is shorter than its tapers."""
    # The carriageway has a tooth of kerb, 1 m deep and 3 m long, at its edge.
    tooth = box(10, 0, 13, 1)
    carriageway = box(0, 0, 30, 8).difference(tooth)
    closed = shapely.union_all([carriageway, *kerb_tapers(carriageway)])
    assert closed.symmetric_difference(box(0, 0, 30, 8)).area < 1e-6


@pytest.mark.parametrize(
    "area",
    [
        box(0, 0, 30, 8),
        # Wider by more than any shoulder, askew, and a short piece of kerb.
        Polygon([(0, 0), (9, 0), (9, -3), (20, -3), (20, 8), (0, 8)]),
        Polygon([(0, 0), (9, 0), (11, -1), (20, -1), (20, 8), (0, 8)]),
        Polygon([(0, 0), (9, 0), (9, -0.5), (9.6, -0.5), (9.6, 8), (0, 8)]),
    ],
)
def test_other_edges_stay_as_they_are(area):
    assert kerb_tapers(area) == []
