"""Wrong or hostile files of OpenDRIVE: refused in one line, or counted."""

import math

from helpers.small_opendrive import (
    TWO_LANES,
    cubic,
    geometry,
    lane,
    road,
    section,
    straight,
    write_roads,
)
import pytest

from evaluation.base import InputError
from worlds.imports import ImportOptions, import_city

LINE = geometry(0.0, 0.0, 0.0, 0.0, 50.0, "<line/>")
LANES = section(0.0, *TWO_LANES)
BOMB = """<?xml version="1.0"?>
<!DOCTYPE OpenDRIVE [<!ENTITY a "aaaaaaaaaa"><!ENTITY b "&a;&a;&a;&a;&a;">]>
<OpenDRIVE><road id="&b;"/></OpenDRIVE>"""


def refusal(path, folder):
    """Returns the one line that refuses a file, without the file's name."""
    with pytest.raises(InputError) as info:
        import_city(path, folder / "town", ImportOptions())
    assert not (folder / "town").exists()
    message = str(info.value)
    assert "\n" not in message
    assert message.startswith(f"{path}: ")
    return message.removeprefix(f"{path}: ")


@pytest.mark.parametrize(
    ("text", "fault"),
    [
        ("", "cannot be parsed"),
        ("<OpenDRIVE>", "cannot be parsed"),
        ("\x00\x01", "cannot be parsed"),
        ('<?xml version="1.0" encoding="klingon"?><OpenDRIVE/>', "parsed"),
        ("<osm/>", "osm is no OpenDRIVE"),
        ("<OpenDRIVE/>", "the file has no roads"),
        (BOMB, "holds a document type"),
        ("<OpenDRIVE>" + "<road>" * 5000, "nested more than 100 deep"),
        ("<OpenDRIVE>" + "<userData>" * 5000, "nested more than 100 deep"),
    ],
)
def test_files_that_are_none(tmp_path, text, fault):
    path = tmp_path / "a.xodr"
    path.write_text(text)
    assert fault in refusal(path, tmp_path)


def geometry_with(**changed):
    values = {"s": 0, "x": 0, "y": 0, "hdg": 0, "length": 50, **changed}
    row = " ".join(f'{k}="{v}"' for k, v in values.items() if v is not None)
    return f"<geometry {row}><line/></geometry>"


def shaped(shape):
    return LINE.replace("<line/>", shape)


@pytest.mark.parametrize(
    ("piece", "lanes", "fault"),
    [
        (geometry_with(x="1e300"), LANES, "geometry: x: '1e300' is no number"),
        (geometry_with(y="nan"), LANES, "geometry: y: 'nan' is no number"),
        (geometry_with(hdg="inf"), LANES, "geometry: hdg: 'inf'"),
        (geometry_with(length=None), LANES, "geometry: no length"),
        (geometry_with(length=-5), LANES, "geometry: length: -5"),
        (shaped("<bezier/>"), LANES, "neither a line nor"),
        (shaped("<arc/>"), LANES, "arc: no curvature"),
        (shaped('<arc curvature="1e6"/>'), LANES, "a curve of curvature 1e+06"),
        (
            shaped('<spiral curvStart="0" curvEnd="5e7"/>'),
            LANES,
            "a spiral of curvature 5e+07",
        ),
        (
            shaped(
                '<paramPoly3 aU="0" bU="0" cU="0" dU="0" aV="0" bV="0" cV="0"'
                ' dV="0"/>'
            ),
            LANES,
            "a curve without length",
        ),
        (LINE, section(0.0, lane(-1, "driving", 1e6)), "1e+06 m is more than"),
        (LINE, section("x", *TWO_LANES), "laneSection: s: 'x'"),
        (LINE, LANES.replace('id="-1"', 'id="1.5"'), "lane: id: 1.5 is no"),
    ],
)
def test_numbers_that_no_road_has(tmp_path, piece, lanes, fault):
    path = write_roads(tmp_path / "a.xodr", road("17", 50.0, [piece], [lanes]))
    message = refusal(path, tmp_path)
    assert message.startswith("road 17: line ")
    assert fault in message


@pytest.mark.parametrize(
    ("roads", "fault"),
    [
        (
            (straight("17", 0, 9, 50, 9), straight("17", 0, 0, 50, 0)),
            "road 17: line 3: duplicate id, that",
        ),
        (
            (straight("1", 0, 0, 50, 0), 2 * '\n<junction id="a b"/>'),
            "junction a-b: line 5: duplicate id, that of line 4",
        ),
        (
            (straight("2", 0, 9, 50, 9, lanes=(*TWO_LANES, TWO_LANES[2])),),
            "road 2: line 3: lane -1: duplicate id",
        ),
        (
            (straight("1", 0, 0, 50, 0), straight("2", 3e4, 0, 30_050, 0)),
            "30 km across",
        ),
        (
            (
                straight(
                    "1", 0, 0, 50, 0,
                    lanes=(lane(-1, "driving", (0.0, 3.0, 1e7)),),
                ),
            ),
            "lane -1: 5e+08 m from the world's origin, more than 50000 m",
        ),
        (
            (
                straight(
                    "1", 0, 0, 50, 0,
                    elevation=cubic("elevation", 0, 1e6, key="s"),
                ),
            ),
            "lane 1: 1e+06 m from the world's origin, more than 10000 m",
        ),
        ((straight("1", 0, 0, 12_000, 0),), "12000 m by 7 m; cut out a piece"),
    ],
)  # fmt: skip
def test_networks_that_are_refused(tmp_path, roads, fault):
    path = write_roads(tmp_path / "a.xodr", *roads)
    assert fault in refusal(path, tmp_path)


def banked(deg):
    growth = math.radians(deg) / 20.0
    return cubic("superelevation", 0, 0.0, growth, 0, 0, "s")


_UNREAD_OF_LANES = """<userData><x/></userData>
<height sOffset="0" inner="3" outer="3"/><speed sOffset="0" max="5"/>
<access sOffset="0" rule="deny"/><folding a="1"/>
<roadMark sOffset="0" type="solid"><sway ds="1"/></roadMark>"""
_UNREAD_OF_ROADS = """
<type s="0" type="town"><speed max="36" unit="km/h"/></type>
<type s="9" type="town"><speed max="no limit"/></type>
<type s="20" type="town"><speed max="10" unit="mph"/></type>
<type s="30" type="town"><speed max="50" unit="kmh"/></type>
<objects><object s="1" t="9" pitch="0.3" roll="0.0"/><object s="1" t="9">
<outlines><outline/><outline/></outlines></object></objects>
<signals><signal s="1" t="9"><positionInertial x="1" y="2"/></signal></signals>
<surface><CRG file="a.crg"/></surface>
<railroad><switch name="a"/></railroad><include file="b.xodr"/>"""


def course(name, y, along=0.0, aside=0.0, first=0.0):
    """Returns a road of two pieces of 10 m.

    Args:
        name: its name.
        y: its place [m].
        along, aside: gaps before the second piece [m].
        first: where its lanes begin [m].
    """
    s = 10.0 + along
    pieces = [
        geometry(0.0, 0.0, y, 0.0, 10.0, "<line/>"),
        geometry(s, s, y + aside, 0.0, 20.0 - s, "<line/>"),
    ]
    lanes = section(first, lane(-1, "driving", 3.5))
    return road(name, 20.0, pieces, [lanes])


@pytest.mark.slow
def test_what_is_not_read_is_counted(tmp_path):
    """With the number of cases and the first road; limits on both sides."""
    odd = lane(-1, "driving", 3.5, more=_UNREAD_OF_LANES)
    lanes = (
        lane(1, "driving", 3.5).replace("<lane", '<lane direction="both"'),
        odd.replace("<lane", '<lane dynamicLaneType="true" roadWorks="true"'),
    )
    line = geometry(0.0, 0.0, -40.0, 0.0, 50.0, "<line/>")
    empty = geometry(50.0, 50.0, -40.0, 0.0, 0.0, "<line/>")
    fall = '<crossfall side="left" s="0" a="0.02" b="0" c="0" d="0"/>'
    path = write_roads(
        tmp_path / "a.xodr",
        straight("fine", 0, 0, 150, 0),
        straight("odd", 0, 20, 50, 20, lanes=lanes, more=_UNREAD_OF_ROADS),
        straight("steep", 60, 20, 80, 20, lateral=banked(49.9)),
        straight("steeper", 90, 20, 110, 20, lateral=banked(-50.1)),
        straight("fall", 120, 20, 140, 20, lateral=fall),
        road("no-course", 0.0, [], [LANES]),
        road("no-lanes", 50.0, [LINE], []),
        road("shorter", 49.5, [line, empty], [LANES]),
        course("even", 200.0, along=0.09, first=0.09),
        course("broken", 210.0, along=0.11),
        course("aside", 220.0, aside=10.0),
        course("late", 240.0, first=0.11),
        '<junction id="6" type="virtual"/>',
        header='<offset x="9" y="8" z="0" hdg="0.1"/>',
    )
    report = import_city(path, tmp_path / "town", ImportOptions())
    counts = {kind: (number, first) for kind, number, first in report.faults}
    expected = {
        "lane more than 1 m above its road, laid on it": (1, "odd"),
        "speed of lane, not read": (1, "odd"),
        "access of lane, not read": (1, "odd"),
        "folding of lane, not read": (1, "odd"),
        "sway of roadMark, not read": (1, "odd"),
        "lane with traffic in direction both": (1, "odd"),
        "dynamicLaneType of lane, not read": (1, "odd"),
        "roadWorks of lane, not read": (1, "odd"),
        "pitch of object, not read": (1, "odd"),
        "further outline of an object, not read": (1, "object_odd_1"),
        "positionInertial of signal, not read": (1, "odd"),
        "surface of road, not read": (1, "odd"),
        "railroad of road, not read": (1, "odd"),
        "include of road, not read": (1, "odd"),
        "unlimited or unreadable speed, taken as 50 km/h": (2, "odd"),
        "superelevation beyond 50 deg, taken as level": (1, "steeper"),
        "crossfall of lateralProfile, not read": (1, "fall"),
        "road without a course, left out": (1, "no-course"),
        "road without lanes, left out": (1, "no-lanes"),
        "geometry without length, left out": (1, "shorter"),
        "road whose length differs from its course's, cut": (1, "shorter"),
        "type of junction, not read": (1, "6"),
        "hdg of offset, not read": (1, "the file"),
        "gap of over 0.1 m in the course of a road": (2, "broken"),
        "road whose course or lanes begin after its start": (1, "late"),
    }
    assert {kind: counts.get(kind) for kind in expected} == expected
