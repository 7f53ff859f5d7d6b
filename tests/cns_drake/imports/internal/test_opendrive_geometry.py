"""Roads of OpenDRIVE lie as in their file, by independent means too."""

import math
import os
from pathlib import Path

from helpers.small_opendrive import (
    cubic,
    geometry,
    lane,
    road,
    sampled_lanes,
    section,
    write_roads,
)
import numpy as np
import pytest
from scipy.spatial import cKDTree
from scipy.special import fresnel
import shapely
from shapely.geometry import LineString, Polygon

from cns_drake.imports.faults import ImportFaults
from cns_drake.imports.opendrive.curves import Arc, Cubic, Spiral
from cns_drake.imports.opendrive.imported_streets import ImportedStreets
from cns_drake.imports.opendrive.lanes import lane_bands
from cns_drake.imports.opendrive.road_heights import RoadHeights
from cns_drake.imports.opendrive.road_reader import read_roads

# All kinds of curves, one after the other.
SHAPES = [
    ("<line/>", 20.0),
    ('<spiral curvStart="0" curvEnd="0.04"/>', 25.0),
    ('<arc curvature="0.04"/>', 30.0),
    ('<spiral curvStart="0.04" curvEnd="-0.08"/>', 40.0),
    ('<arc curvature="-0.08"/>', 12.0),
    ('<poly3 a="0" b="0.1" c="0.01" d="-0.0002"/>', 22.0),
    (
        '<paramPoly3 pRange="normalized" aU="0" bU="30" cU="-2" dU="1"'
        ' aV="0" bV="0" cV="8" dV="-3"/>', 30.0,
    ),
    (
        '<paramPoly3 pRange="arcLength" aU="0" bU="1" cU="0" dU="-0.00006"'
        ' aV="0" bV="0" cV="0.01" dV="0"/>', 20.0,
    ),
]  # fmt: skip


def write_every_kind(path):
    """A road of all curves, with heights, roll, and lanes that change."""
    pieces = []
    s = 0.0
    for k, (shape, length) in enumerate(SHAPES):
        # Roads are apart, so that none hides the faults of another.
        pieces.append(
            geometry(s, 60.0 * k, 7.0 * k, 0.3 * k - 1.0, length, shape)
        )
        s += length
    lanes = (
        lane(2, "sidewalk", 2.0),
        lane(1, "driving", (0.0, 3.5, 0.02, -0.0005, 0.000005)),
        lane(-1, "driving", 3.0, (30.0, 3.5)),
        lane(-2, "parking", 2.2),
    )
    more = (
        lane(1, "driving", (0.0, 0.0, 0.1), (35.0, 3.5)),
        lane(-1, "driving", 3.25),
    )
    return write_roads(
        path,
        road(
            "7", s, pieces,
            [section(0.0, *lanes), section(71.5, *more), section(150.0, *more)],
            elevation=cubic("elevation", 0, 1.0, 0.02, 0.0001, 0, "s")
            + cubic("elevation", 90, 3.6, -0.01, 0, 0.000002, "s"),
            lateral=cubic("superelevation", 0, 0.0, 0.0005, 0, 0, "s"),
            offset=cubic("laneOffset", 0, 0.0, 0, 0, 0, "s")
            + cubic("laneOffset", 71.5, 0.5, 0.01, 0, 0, "s"),
        ),
    )  # fmt: skip


def outlines(path):
    """(Road, lane) -> its edges by the program."""
    found = {}
    for one in read_roads(path, ImportFaults()).roads:
        for band in lane_bands(one):
            key = one.name, band.lane.number
            found.setdefault(key, []).append(band)
    return found


def deviation(path, spacing, only=None):
    """The greatest distance of independent places from the program's [m]."""
    bands = outlines(path)
    worst = 0.0
    count = 0
    for name, number, _, inner, outer in sampled_lanes(path, spacing, only):
        for edge, points in (("inner", inner), ("outer", outer)):
            lines = [LineString(getattr(b, edge)) for b in bands[name, number]]
            places = shapely.points(points)
            apart = np.min([shapely.distance(x, places) for x in lines], axis=0)
            # Heights where the two are nearest in plan.
            for place, xyz in zip(places, points, strict=True):
                line = min(lines, key=lambda x: x.distance(place))
                there = line.interpolate(line.project(place))
                worst = max(worst, abs(there.z - xyz[2]))
            worst = max(worst, float(apart.max()))
            count += len(points)
    assert count > 100
    return worst


def test_every_kind_of_curve_against_integration(tmp_path):
    path = write_every_kind(tmp_path / "all.xodr")
    # Chords between places on the borders have errors of little over 5 mm.
    assert deviation(path, 0.5) < 0.008


@pytest.mark.parametrize(
    ("start", "end", "length"),
    [(0.0, 0.05, 40.0), (0.05, 0.0, 40.0), (-0.1, 0.2, 100.0),
     (0.01, 0.010001, 300.0), (0.0, -2.0, 30.0)],
)  # fmt: skip
def test_spirals_against_fresnel_s_integrals(start, end, length):
    growth = (end - start) / length
    # All spirals are pieces of one, from where its curvature is 0.
    zero = -start / growth
    scale = math.sqrt(math.pi / abs(growth))

    def whole(s):
        sine, cosine = fresnel((s - zero) / scale)
        return scale * np.array([cosine, math.copysign(1, growth) * sine])

    s = np.linspace(0.0, length, 57)
    heading = growth * (s - zero) ** 2 / 2
    first = heading[0]
    turned = np.array(
        [
            [math.cos(first), math.sin(first)],
            [-math.sin(first), math.cos(first)],
        ]
    )
    expected = (turned @ (whole(s) - whole(0.0)[:, None])).T
    found = Spiral(start, end, length).evaluate(s)
    # Near an arc the closed form loses digits; the other one does not.
    atol = 1e-9 if abs(growth) > 1e-6 else 1e-3
    np.testing.assert_allclose(found[:, :2], expected, atol=atol)
    np.testing.assert_allclose(found[:, 2], heading - first, atol=1e-9)


def test_arcs_and_lines_in_closed_form():
    s = np.array([0.0, 1.0, math.pi * 5, math.pi * 10])
    found = Arc(0.1).evaluate(s)
    np.testing.assert_allclose(found[:, 0], 10 * np.sin(s / 10), atol=1e-12)
    np.testing.assert_allclose(
        found[:, 1], 10 * (1 - np.cos(s / 10)), atol=1e-12
    )
    np.testing.assert_array_equal(
        Arc(0.0).evaluate(s), np.stack([s, 0 * s, 0 * s], axis=1)
    )


def test_cubic_curves_run_at_the_speed_of_the_road():
    # A straight line with an uneven parameter.
    uneven = Cubic((0, 1, 1, 1), (0, 0, 0, 0), 1.0, 3.0)
    s = np.linspace(0.0, 3.0, 31)
    found = uneven.evaluate(s)
    np.testing.assert_allclose(found, np.stack([s, 0 * s, 0 * s], 1), atol=1e-9)
    # A parabola with a length in closed form: v = u^2 / 20.
    parabola = Cubic((0, 1, 0, 0), (0, 0, 0.05, 0), 30.0, 30.0, stretched=False)
    u = parabola.evaluate(np.array([17.0]))[0, 0]
    assert 5 * (
        u / 10 * math.sqrt(1 + (u / 10) ** 2) + math.asinh(u / 10)
    ) == pytest.approx(17.0, abs=1e-9)


def test_both_sides_of_every_joint_are_there(tmp_path):
    path = write_every_kind(tmp_path / "all.xodr")
    bands = outlines(path)["7", -1]
    # The lane steps from 3 m to 3.5 m, 30 m into its section.
    first = bands[0]
    at = np.flatnonzero(np.abs(first.s - 30.0) < 1e-9)
    assert len(at) == 2
    np.testing.assert_allclose(first.width[at], [3.0, 3.5], atol=1e-6)
    # Another section begins at the section's end, at the same place.
    assert first.s[-1] == bands[1].s[0] == 71.5
    assert bands[1].width[0] == pytest.approx(3.25, abs=1e-6)


def test_borders_in_place_of_widths(tmp_path):
    borders = (
        '<lane id="1" type="driving"><border sOffset="0" a="3" b="0.01" c="0"'
        ' d="0"/></lane>',
        '<lane id="-1" type="driving"><border sOffset="0" a="-4" b="0" c="0"'
        ' d="0"/></lane>',
        '<lane id="-2" type="sidewalk"><border sOffset="0" a="-6" b="0" c="0"'
        ' d="0"/></lane>',
    )
    line = geometry(0.0, 0.0, 0.0, 0.0, 50.0, "<line/>")
    path = write_roads(
        tmp_path / "a.xodr", road("1", 50.0, [line], [section(0, *borders)])
    )
    found = outlines(path)
    assert found["1", 1][0].outer[-1, 1] == pytest.approx(3.5)
    assert found["1", -1][0].outer[0, 1] == pytest.approx(-4.0)
    np.testing.assert_allclose(found["1", -2][0].width, 2.0)


def test_roads_far_off_are_moved_to_the_middle(tmp_path):
    line = geometry(0.0, 691000.25, 5335000.5, 0.0, 50.0, "<line/>")
    lanes = section(0.0, lane(-1, "driving", 3.0))
    path = write_roads(
        tmp_path / "a.xodr",
        road("1", 50.0, [line], [lanes]),
        header="<geoReference><![CDATA[+proj=utm +zone=32]]></geoReference>",
    )
    roads = read_roads(path, ImportFaults())
    assert roads.reference_system == "+proj=utm +zone=32"
    piece = roads.roads[0].pieces[0]
    assert roads.origin[0] + piece.x == pytest.approx(691000.25)
    assert roads.origin[1] + piece.y == pytest.approx(5335000.5)
    assert max(abs(piece.x), abs(piece.y)) < 1.0


@pytest.mark.slow
@pytest.mark.skipif(
    "CNS_CITY_FILES" not in os.environ,
    reason="CNS_CITY_FILES names no folder of real files",
)
def test_real_networks_against_integration():
    paths = sorted(Path(os.environ["CNS_CITY_FILES"]).glob("*.xodr"))
    assert paths
    for path in paths:
        assert deviation(path, 2.0) < 0.01, path
        check_surface(path)


def check_surface(path):
    """The surface covers exactly the file's lanes, at their height."""
    bands = [b for group in outlines(path).values() for b in group]
    streets = ImportedStreets(bands)
    surface = RoadHeights(bands)
    whole = shapely.union_all(
        [
            streets.areas.carriageway,
            streets.areas.sidewalks,
            streets.areas.medians,
        ]
    )
    areas, places = [], []
    for _, _, kind, inner, outer in sampled_lanes(path, 1.0):
        if kind == "none":
            continue
        area = Polygon(np.concatenate([inner, outer[::-1]])[:, :2])
        areas.append(shapely.make_valid(area))
        middle = (inner + outer) / 2
        inside = shapely.contains_xy(whole.buffer(0.1), *middle[:, :2].T)
        assert inside.all(), path
        places.append(middle)
    check_heights(surface, np.concatenate(places))
    areas = shapely.union_all(areas)
    assert areas.difference(whole.buffer(0.1)).area < 0.1
    beyond = whole.difference(areas.buffer(0.1)).difference(
        streets.junctions.buffer(0.1)
    )
    closed = [b for b in bands if b.kind == "enclosed"]
    shut = [
        Polygon(np.concatenate([b.inner, b.outer[::-1]])[:, :2]).buffer(0.1)
        for b in closed
    ]
    assert beyond.difference(shapely.union_all(shut)).area < 0.1


def check_heights(surface, places):
    """Heights are those of the file, or between two contradicting ones."""
    z = surface.heights(places[:, :2])
    off = np.flatnonzero(np.abs(z - places[:, 2]) > 0.1)
    near = cKDTree(places[:, :2]).query_ball_point(places[off, :2], 2.0)
    for k, some in zip(off, near, strict=True):
        heights = places[some, 2]
        assert np.ptp(heights) > 0.1
        assert heights.min() - 0.1 < z[k] < heights.max() + 0.1
    assert len(off) < 0.01 * len(places)
