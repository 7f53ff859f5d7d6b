"""Wrong or hostile files of OpenDRIVE give one line and do no harm."""

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
import numpy as np
import pytest

from cns_drake.base import InputError
from cns_drake.imports import ImportOptions
from cns_drake.imports.faults import ImportFaults
from cns_drake.imports.opendrive.lanes import lane_bands
from cns_drake.imports.opendrive.road_reader import read_roads
from cns_drake.imports.opendrive.town import build_town

LINE = geometry(0.0, 0.0, 0.0, 0.0, 50.0, "<line/>")
LANES = section(0.0, *TWO_LANES)


def faults_of(path):
    faults = ImportFaults()
    roads = read_roads(path, faults)
    return roads, {kind: number for kind, number, _ in faults.rows()}


BOMB = """<?xml version="1.0"?>
<!DOCTYPE OpenDRIVE [<!ENTITY a "aaaaaaaaaa"><!ENTITY b "&a;&a;&a;&a;&a;">]>
<OpenDRIVE><road id="&b;"/></OpenDRIVE>"""


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
        (f'<OpenDRIVE><road id="{"9" * 5000}"/></OpenDRIVE>', "5000 letters"),
    ],
)
def test_files_that_are_none(tmp_path, text, fault):
    path = tmp_path / "a.xodr"
    path.write_text(text)
    with pytest.raises(InputError) as info:
        read_roads(path, ImportFaults())
    assert str(info.value).startswith(f"{path}: ")
    assert fault in str(info.value)
    assert "\n" not in str(info.value)


def test_more_elements_than_any_road_map_has(tmp_path, monkeypatch):
    name = "cns_drake.base.xml_elements._MOST_ELEMENTS"
    monkeypatch.setattr(name, 1000)
    path = tmp_path / "a.xodr"
    path.write_text("<OpenDRIVE>" + "<road/>" * 2000 + "</OpenDRIVE>")
    with pytest.raises(InputError, match="more than 1000 elements"):
        read_roads(path, ImportFaults())


def geometry_with(**changed):
    values = {"s": 0, "x": 0, "y": 0, "hdg": 0, "length": 50, **changed}
    row = " ".join(f'{k}="{v}"' for k, v in values.items() if v is not None)
    return f"<geometry {row}><line/></geometry>"


@pytest.mark.parametrize(
    ("piece", "lanes", "fault"),
    [
        (geometry_with(x="1e300"), LANES, "geometry: x: '1e300' is no number"),
        (geometry_with(y="nan"), LANES, "geometry: y: 'nan' is no number"),
        (geometry_with(hdg="inf"), LANES, "geometry: hdg: 'inf'"),
        (geometry_with(length=None), LANES, "geometry: no length"),
        (geometry_with(length=-5), LANES, "geometry: length: -5"),
        (geometry_with(length=1e7), LANES, "more than 100000 m"),
        (geometry_with(x="far"), LANES, "'far' is no number"),
        (LINE.replace("<line/>", "<bezier/>"), LANES, "neither a line nor"),
        (LINE.replace("<line/>", "<arc/>"), LANES, "arc: no curvature"),
        (
            LINE.replace("<line/>", '<arc curvature="1e6"/>'),
            LANES, "a curve of curvature 1e+06",
        ),
        (
            LINE.replace(
                "<line/>", '<spiral curvStart="0" curvEnd="5e7"/>'
            ), LANES, "a spiral of curvature 5e+07",
        ),
        (
            LINE.replace(
                "<line/>",
                '<paramPoly3 aU="0" bU="0" cU="0" dU="0" aV="0" bV="0" cV="0"'
                ' dV="0"/>',
            ), LANES, "a curve without length",
        ),
        (LINE, section(0.0, lane(-1, "driving", 1e6)), "1e+06 m is more than"),
        (LINE, section("x", *TWO_LANES), "laneSection: s: 'x'"),
        (
            LINE, LANES.replace('id="-1"', 'id="1.5"'), "lane: id: 1.5 is no",
        ),
    ],
)  # fmt: skip
def test_numbers_that_no_road_has(tmp_path, piece, lanes, fault):
    path = write_roads(tmp_path / "a.xodr", road("17", 50.0, [piece], [lanes]))
    with pytest.raises(InputError) as info:
        read_roads(path, ImportFaults())
    assert str(info.value).startswith(f"{path}: road 17: line ")
    assert fault in str(info.value)


def test_what_cannot_be_used_is_counted(tmp_path):
    empty = geometry(50.0, 50.0, 0.0, 0.0, 0.0, "<line/>")
    path = write_roads(
        tmp_path / "a.xodr",
        straight("1", 0, 0, 50, 0),
        road("2", 0.0, [], [LANES]),
        road("3", 50.0, [LINE], []),
        road("4", 49.5, [LINE, empty], [LANES]),
    )
    roads, faults = faults_of(path)
    assert [one.name for one in roads.roads] == ["1", "4"]
    assert faults == {
        "road without a course, left out": 1,
        "road without lanes, left out": 1,
        "geometry without length, left out": 1,
        "road whose length differs from its course's, cut": 1,
    }
    assert roads.roads[1].length == 49.5


@pytest.mark.parametrize(
    ("more", "fault"),
    [
        ((straight("17", 0, 9, 50, 9),), "road 17: line 4: duplicate id, that"),
        (
            ('<junction id="a b"/>\n', '<junction id="a b"/>\n'),
            "junction a-b: line 5: duplicate id, that of line 4",
        ),
        (
            (straight("2", 0, 9, 50, 9, lanes=(*TWO_LANES, TWO_LANES[2])),),
            "road 2: line 4: lane -1: duplicate id",
        ),
    ],
)  # fmt: skip
def test_things_that_stand_twice_are_named(tmp_path, more, fault):
    path = write_roads(
        tmp_path / "a.xodr", straight("17", 0, 0, 50, 0) + "\n", *more
    )
    with pytest.raises(InputError) as info:
        build_town(path, ImportOptions())
    assert str(info.value).startswith(f"{path}: {fault}")
    assert "\n" not in str(info.value)


def test_networks_that_are_too_large(tmp_path):
    path = write_roads(
        tmp_path / "a.xodr",
        straight("1", 0, 0, 50, 0),
        straight("2", 30_000, 0, 30_050, 0),
    )
    with pytest.raises(InputError, match="30 km across"):
        read_roads(path, ImportFaults())


def test_lanes_of_less_than_no_width_have_none(tmp_path):
    lanes = section(
        0.0, lane(-1, "driving", (0.0, 2.0, -0.1)), lane(-2, "sidewalk", 2.0)
    )
    path = write_roads(tmp_path / "a.xodr", road("1", 50.0, [LINE], [lanes]))
    (one,) = read_roads(path, ImportFaults()).roads
    first, second = lane_bands(one)
    assert first.width.min() == 0.0
    assert second.width.min() == pytest.approx(2.0)


@pytest.mark.parametrize(
    ("lanes", "more", "fault"),
    [
        (
            (lane(-1, "driving", (0.0, 3.0, 1e7)),), "",
            r"lane -1: 5e\+08 m from the world's origin, more than 50000 m",
        ),
        (
            TWO_LANES, cubic("elevation", 0, 1e6, key="s"),
            r"lane 1: 1e\+06 m from the world's origin, more than 10000 m",
        ),
    ],
)  # fmt: skip
def test_lanes_that_lead_out_of_the_world(tmp_path, lanes, more, fault):
    path = write_roads(
        tmp_path / "a.xodr",
        straight("1", 0, 0, 50, 0, lanes=lanes, elevation=more),
    )
    with pytest.raises(InputError, match=fault) as info:
        build_town(path, ImportOptions())
    assert str(info.value).startswith(f"{path}: ")


def test_roads_too_long_to_be_built_on(tmp_path):
    path = write_roads(tmp_path / "a.xodr", straight("1", 0, 0, 12_000, 0))
    with pytest.raises(InputError, match="12000 m by 7 m; cut out a piece"):
        build_town(path, ImportOptions())


def test_ids_become_names_that_are_unique(tmp_path):
    path = write_roads(
        tmp_path / "a.xodr",
        *(
            straight(name, 0, 20 * k, 50, 20 * k)
            for k, name in enumerate(("a b", "a/b", "a-b", "", "&#10;"))
        ),
    )
    roads = read_roads(path, ImportFaults()).roads
    names = ["a-b", "a-b-2", "a-b-3", "unnamed", "-"]
    assert [one.name for one in roads] == names


def test_speed_limits_have_units(tmp_path):
    limits = (
        '<type s="0" type="town"><speed max="36" unit="km/h"/></type>'
        '<type s="9" type="town"><speed max="no limit"/></type>'
        '<type s="20" type="town"><speed max="10" unit="mph"/></type>'
        '<type s="30" type="town"><speed max="50" unit="kmh"/></type>'
        '<type s="35" type="town"/>'
        '<type s="40" type="town"><speed max="101"/></type>'
    )
    path = write_roads(
        tmp_path / "a.xodr", straight("1", 0, 0, 50, 0, more=limits)
    )
    faults = ImportFaults()
    (one,) = read_roads(path, faults).roads
    at = np.array([0.0, 8.9, 9.1, 20.0, 30.0, 36.0, 41.0])
    limits = [10.0, 10.0, 0.0, 4.4704, 0.0, 0.0, 0.0]
    assert one.limits.at(at, at).tolist() == pytest.approx(limits)
    (fault,) = faults.rows()
    assert fault == ("unlimited or unreadable speed, taken as 50 km/h", 3, "1")


def test_a_lane_of_nothing_among_others_is_paved(tmp_path):
    lanes = section(
        0.0, lane(-1, "none", 3.0), lane(-2, "shoulder", 1.0),
        lane(-3, "none", 3.0),
    )  # fmt: skip
    path = write_roads(tmp_path / "a.xodr", road("1", 50.0, [LINE], [lanes]))
    (one,) = read_roads(path, ImportFaults()).roads
    assert [b.kind for b in lane_bands(one)] == ["enclosed", "shoulder", "none"]


def lane_link(end, number):
    return f'<link><{end} id="{number}"/></link>'


def test_links_to_nothing_are_counted(tmp_path):
    linked = (
        lane(1, "driving", 3.5),
        lane(-1, "driving", 3.5, more=lane_link("successor", -2)),
    )
    fine = (lane(-1, "driving", 3.5, more=lane_link("predecessor", -1)),)
    link = (
        '<link><predecessor elementType="road" elementId="99999"/>'
        '<successor elementType="road" elementId="2" contactPoint="start"/>'
        "</link>"
    )
    junction = (
        '<link><predecessor elementType="road" elementId="1"'
        ' contactPoint="end"/><successor elementType="junction"'
        ' elementId="{}"/></link>'
    )
    more = (
        '<junction id="7"><connection id="0" incomingRoad="2"'
        ' connectingRoad="0"/><connection id="1" incomingRoad="2"'
        ' connectingRoad="3"/></junction>'
    )
    path = write_roads(
        tmp_path / "a.xodr",
        straight("1", 0, 0, 50, 0, lanes=linked, more=link),
        straight("2", 50, 0, 90, 0, lanes=fine, more=junction.format(7)),
        straight("3", 90, 0, 99, 0, junction="8", more=junction.format(9)),
        more,
    )
    faults = ImportFaults()
    assert len(read_roads(path, faults).roads) == 3
    assert set(faults.rows()) == {
        ("link to a road that is not in the file", 1, "1"),
        ("link to a lane that is not in the file", 1, "1"),
        (
            "connection of a junction with a road that is not in the file",
            1,
            "junction 7",
        ),
        ("road of a junction that is not in the file", 1, "3"),
        ("link to a junction that is not in the file", 1, "3"),
    }


@pytest.mark.parametrize(("end_deg", "count"), [(49.9, 0), (50.1, 1), (-97, 1)])
def test_superelevation_has_a_limit(tmp_path, end_deg, count):
    """The limit is reached at the end of the road, 50 m on."""
    growth = math.radians(end_deg) / 50.0
    banked = cubic("superelevation", 0, 0.0, growth, 0, 0, "s")
    path = write_roads(
        tmp_path / "a.xodr", straight("1", 0, 0, 50, 0, lateral=banked)
    )
    roads, faults = faults_of(path)
    kind = "superelevation beyond 50 deg, taken as level"
    assert faults.get(kind, 0) == count
    (one,) = roads.roads
    assert bool(one.superelevation) == (count == 0)


def test_a_piece_without_length_is_left_out(tmp_path):
    pieces = [
        geometry(0.0, 0.0, 0.0, 0.0, 25.0, "<line/>"),
        geometry(25.0, 25.0, 0.0, 0.3, 0.0, "<line/>"),
        geometry(25.0, 25.0, 0.0, 0.0, 25.0, "<line/>"),
    ]
    path = write_roads(tmp_path / "a.xodr", road("1", 50.0, pieces, [LANES]))
    roads, faults = faults_of(path)
    assert faults == {"geometry without length, left out": 1}
    assert [piece.s for piece in roads.roads[0].pieces] == [0.0, 25.0]


def one_side(text):
    return text.replace("<laneSection", '<laneSection singleSide="true"')


def widths_at(path, s):
    """Number of a lane -> its width and kind at a place along the road."""
    roads, faults = faults_of(path)
    found = {}
    for band in lane_bands(roads.roads[0]):
        if band.s[0] <= s <= band.s[-1]:
            width = float(np.interp(s, band.s, band.width))
            found[band.lane.number] = round(width, 3), band.kind
    return found, faults


def test_a_section_of_one_side_leaves_the_other_as_it_was(tmp_path):
    """The left lane grows by 0.02 m/m from the start of the road."""
    growing = (0.0, 3.0, 0.02)
    right = lane(-1, "driving", 3.5), lane(-2, "parking", 2.0)
    left = lane(1, "driving", 5.0, more=lane_link("predecessor", 1))
    sections = [
        section(0, lane(1, "driving", growing), lane(-1, "driving", 3.5)),
        one_side(section(20, *right)),
        one_side(section(30, left)),
        section(40, lane(1, "driving", 3.0)),
    ]
    path = write_roads(tmp_path / "a.xodr", road("1", 50.0, [LINE], sections))
    first = {1: (3.2, "driving"), -1: (3.5, "driving")}
    parking = {-1: (3.5, "driving"), -2: (2.0, "parking")}
    assert widths_at(path, 10) == (first, {})
    assert widths_at(path, 25)[0] == {1: (3.5, "driving"), **parking}
    assert widths_at(path, 35)[0] == {1: (5.0, "driving"), **parking}
    assert widths_at(path, 45)[0] == {1: (3.0, "driving")}


UNREAD = {
    '<height sOffset="0" inner="3" outer="3"/>': (
        "lane more than 1 m above its road, laid on it"
    ),
    '<speed sOffset="0" max="5"/>': "speed of lane, not read",
    '<access sOffset="0" rule="deny"/>': "access of lane, not read",
    '<folding a="1"/>': "folding of lane, not read",
    '<roadMark sOffset="0" type="solid"><sway ds="1"/></roadMark>': (
        "sway of roadMark, not read"
    ),
}


@pytest.mark.parametrize("more", UNREAD)
def test_elements_of_lanes_that_are_not_read_are_counted(tmp_path, more):
    lanes = (
        lane(1, "driving", 3.5),
        lane(-1, "driving", 3.5, more="<userData><x/></userData>" + more),
    )
    path = write_roads(
        tmp_path / "a.xodr", straight("1", 0, 0, 50, 0, lanes=lanes)
    )
    assert faults_of(path)[1] == {UNREAD[more]: 1}


@pytest.mark.parametrize(
    ("attribute", "fault"),
    [
        ('level="true"', None),
        ('direction="reversed"', None),
        ('direction="both"', "lane with traffic in direction both"),
        ('dynamicLaneType="true"', "dynamicLaneType of lane, not read"),
        ('dynamicLaneType="false"', None),
        ('roadWorks="true"', "roadWorks of lane, not read"),
    ],
)
def test_attributes_of_lanes(tmp_path, attribute, fault):
    text = lane(-1, "driving", 3.5).replace("<lane", f"<lane {attribute}")
    path = write_roads(
        tmp_path / "a.xodr", straight("1", 0, 0, 50, 0, lanes=(text,))
    )
    assert faults_of(path)[1] == ({} if fault is None else {fault: 1})


@pytest.mark.parametrize(
    ("more", "fault"),
    [
        (
            '<objects><object s="1" t="9" pitch="0.3" roll="0.0"/></objects>',
            "pitch of object, not read",
        ),
        (
            '<objects><object s="1" t="9"><outlines><outline/><outline/>'
            "</outlines></object></objects>",
            "further outline of an object, not read",
        ),
        (
            '<signals><signal s="1" t="9"><positionInertial x="1" y="2"/>'
            "</signal></signals>",
            "positionInertial of signal, not read",
        ),
        ('<surface><CRG file="a.crg"/></surface>', "surface of road, not read"),
        (
            '<surface/><railroad><switch name="a"/></railroad>',
            "railroad of road, not read",
        ),
        ('<include file="b.xodr"/>', "include of road, not read"),
    ],
)
def test_other_parts_of_roads_that_are_not_read_are_counted(
    tmp_path, more, fault
):
    path = write_roads(
        tmp_path / "a.xodr", straight("1", 0, 0, 50, 0, more=more)
    )
    assert faults_of(path)[1].get(fault) == 1


@pytest.mark.parametrize("gap", [0.0, 0.09, 0.11, 10.0])
def test_gaps_in_the_course_of_a_road_are_counted(tmp_path, gap):
    """Beside the next piece's start, along the road, and before its lanes."""

    def two(x, y, s, first=0.0):
        pieces = [
            geometry(0.0, 0.0, 0.0, 0.0, 50.0, "<line/>"),
            geometry(s, x, y, 0.0, 100.0 - s, "<line/>"),
        ]
        lanes = [section(first, lane(-1, "driving", 3.5))]
        return road("1", 100.0, pieces, lanes)

    def counted(one):
        return faults_of(write_roads(tmp_path / "a.xodr", one))[1]

    in_course = {"gap of over 0.1 m in the course of a road": 1}
    too_late = {"road whose course or lanes begin after its start": 1}
    counts = gap > 0.1
    assert counted(two(50.0, gap, 50.0)) == (in_course if counts else {})
    assert counted(two(50.0 + gap, 0, 50.0 + gap)) == (
        in_course if counts else {}
    )
    assert counted(two(50.0, 0, 50.0, gap)) == (too_late if counts else {})


def test_what_stands_above_the_roads_in_a_file_is_counted(tmp_path):
    fall = '<crossfall side="left" s="0" a="0.02" b="0" c="0" d="0"/>'
    path = write_roads(
        tmp_path / "a.xodr",
        straight("1", 0, 0, 50, 0, lateral=fall),
        '<junction id="7" type="virtual"/>',
        header='<offset x="9" y="8" z="0" hdg="0"/>',
    )
    assert faults_of(path)[1] == {
        "crossfall of lateralProfile, not read": 1,
        "type of junction, not read": 1,
        "offset of header, not read": 1,
    }
