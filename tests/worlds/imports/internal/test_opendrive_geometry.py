"""Roads of OpenDRIVE lie as in their file, by independent means too."""

import math

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
from scipy.special import fresnel
import shapely
from shapely.geometry import LineString

from worlds.imports.faults import ImportFaults
from worlds.imports.opendrive.curves import Spiral
from worlds.imports.opendrive.lanes import lane_bands
from worlds.imports.opendrive.road_reader import read_roads

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
