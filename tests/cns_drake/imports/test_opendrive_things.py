"""Signals and objects of OpenDRIVE, and lanes above others."""

import math

from helpers.small_opendrive import cubic, straight, write_roads
import numpy as np
import pytest
import shapely
from shapely.geometry import LineString, box

from cns_drake.imports.opendrive.lanes import lane_bands, split_levels
from cns_drake.imports.opendrive.road_reader import read_roads
from cns_drake.imports.opendrive.things import thing_structures
from cns_drake.imports.opendrive.town import build_town
from cns_drake.imports.options import ImportFaults

SIGNS = """<signals>
<signal id="1" s="20" t="-6" zOffset="2" type="206" dynamic="no"
 orientation="+"/>
<signal id="2" s="30" t="6" zOffset="4" type="1000001" dynamic="yes"
 orientation="-"/>
<signal id="3" s="40" t="-1" zOffset="5" type="274" dynamic="no"/>
</signals><objects>
<object id="1" type="building" s="50" t="20" zOffset="0" hdg="0"><outline>
<cornerLocal u="-5" v="-4" z="0" height="9"/>
<cornerLocal u="5" v="-4" z="0" height="9"/>
<cornerLocal u="5" v="4" z="0" height="9"/>
<cornerLocal u="-5" v="4" z="0" height="9"/></outline></object>
<object id="2" type="barrier" s="60" t="-12" zOffset="0"><outlines><outline>
<cornerRoad s="60" t="-12" dz="0" height="1"/>
<cornerRoad s="80" t="-12" dz="0" height="1"/>
<cornerRoad s="80" t="-12.5" dz="0" height="1"/>
<cornerRoad s="60" t="-12.5" dz="0" height="1"/></outline></outlines></object>
<object id="3" type="pole" s="90" t="7" zOffset="0" radius="0.1" height="5"/>
<object id="4" type="crosswalk" s="90" t="0" length="4" width="7"/>
<object id="5" type="pole" s="0" t="8" zOffset="0" length="0.2" width="0.2"
 height="3"><repeat s="100" length="40" distance="10"/></object>
<object id="6" type="tree" s="150" t="9" zOffset="0" radius="2" height="8"/>
</objects>"""


@pytest.mark.slow
def test_signals_and_objects_stand_at_their_places(tmp_path):
    path = write_roads(
        tmp_path / "a.xodr", straight("1", 0, 0, 200, 0, more=SIGNS)
    )
    built = build_town(path, 0)
    found = {s.name: s for s in built.city.structures}
    stop = found["signal_1_0"]
    assert stop.semantic_class == "traffic-sign"
    assert stop.xyz[:2] == (20.0, -6.0)
    # The sign faces the drivers that approach on the road.
    assert abs(stop.yaw) == pytest.approx(math.pi, abs=1e-4)
    house = found["object_1_0"]
    assert house.semantic_class == "building"
    assert house.footprint_W.equals(box(45, 16, 55, 24))
    fence = found["object_1_1"]
    assert fence.semantic_class == "fence"
    assert fence.footprint_W.equals(box(60, -12.5, 80, -12))
    assert found["object_1_2"].semantic_class == "pole"
    poles = [n for n in found if n.startswith("object_1_4")]
    assert len(poles) == 5
    assert found["object_1_5"].semantic_class == "vegetation"
    rows = {kind: number for kind, number, _ in built.faults.rows()}
    assert rows == {
        "no lanes for traffic: none leads on for ever": 1,
        "signal over a lane, left out": 1,
        "object that is painted on the road, left out": 1,
    }
    # Objects of the file are there at all stages, and stay free of buildings.
    absent = {n for stage in built.stages.stages for n in
              built.stages.absent(stage)}  # fmt: skip
    assert not absent & set(found).intersection({"object_1_0", *poles})
    drawn = [
        one.footprint_W
        for one in built.city.structures
        if one.semantic_class == "building" and one.name != "object_1_0"
    ]
    assert all(one.disjoint(house.footprint_W) for one in drawn)


def solids(path, objects, **more):
    """Returns vertices (N, 3) and footprint of the objects of a road."""
    text = f"<objects>{objects}</objects>"
    write_roads(path, straight("1", 0, 0, 100, 0, more=text, **more))
    (one,) = read_roads(path, ImportFaults()).roads
    found = list(thing_structures(one, box(0, -4, 100, 4), ImportFaults()))
    meshes = [m for s in found for m in s.model.meshes.values()]
    vertices = np.concatenate([mesh.vertices for mesh in meshes])
    return vertices, shapely.union_all([s.footprint_W for s in found])


def corner(tag, **numbers):
    values = " ".join(f'{key}="{v}"' for key, v in numbers.items())
    return f"<{tag} {values}/>"


def barrier(corners, attributes="", more=""):
    return (
        f'<object id="1" type="barrier" s="20" t="6" zOffset="0" hdg="0">{more}'
        f"<outlines><outline {attributes}>{corners}</outline></outlines>"
        "</object>"
    )


def test_each_corner_of_an_outline_has_its_heights(tmp_path):
    """On a road that rises by 1 in 10, and on one with a step of 0.5 m."""
    on_road = "".join(
        corner("cornerRoad", s=s, t=t, dz=0.2, height=h)
        for s, t, h in ((20, 6, 1), (80, 6, 2), (80, 7, 2), (20, 7, 1))
    )
    rise = cubic("elevation", 0, 0, 0.1, 0, 0, "s")
    path = tmp_path / "a.xodr"
    vertices, _ = solids(path, barrier(on_road), elevation=rise)
    for x, low, high in ((20, 2.2, 3.2), (80, 8.2, 10.2)):
        z = vertices[np.isclose(vertices[:, 0], x), 2]
        assert (z.min(), z.max()) == pytest.approx((low, high))
    local = "".join(
        corner("cornerLocal", u=u, v=v, z=z, height=1)
        for u, v, z in ((0, 0, 0), (8, 0, 0.5), (8, 2, 0.5))
    )
    vertices, _ = solids(path, barrier(local))
    z = vertices[np.isclose(vertices[:, 0], 28), 2]
    assert (z.min(), z.max()) == (0.5, 1.5)


@pytest.mark.parametrize("count", [2, 3])
def test_an_open_outline_is_a_wall(tmp_path, count):
    places = ((0, 0), (8, 0), (8, 5))[:count]
    corners = "".join(
        corner("cornerLocal", u=u, v=v, z=0, height=1) for u, v in places
    )
    _, footprint = solids(
        tmp_path / "a.xodr", barrier(corners, 'closed="false"')
    )
    line = LineString([(20 + u, 6 + v) for u, v in places])
    assert footprint.covers(line)
    assert footprint.hausdorff_distance(line) < 0.1


def test_a_wall_leads_from_one_side_to_the_other(tmp_path):
    """A repeated wall from t = 6 m to 12 m is as long as its diagonal."""
    repeat = (
        '<repeat s="20" length="8" distance="0" tStart="6" tEnd="12"'
        ' widthStart="0.2" heightStart="1"/>'
    )
    _, footprint = solids(
        tmp_path / "a.xodr",
        f'<object id="1" type="barrier" s="20" t="6" length="1">{repeat}'
        "</object>",
    )
    assert footprint.covers(LineString([(20.01, 6.01), (27.99, 11.99)]))
    assert footprint.area == pytest.approx(10.0 * 0.2, rel=0.01)


@pytest.mark.slow
def test_a_road_over_another_is_a_bridge(tmp_path):
    rise = cubic("elevation", 0, 6.0, 0, 0, 0, "s")
    path = write_roads(
        tmp_path / "a.xodr",
        straight("1", -60, 0, 60, 0),
        straight("2", 0, -60, 0, 60, elevation=rise),
    )
    _, raised = split_levels(
        [
            b
            for r in read_roads(path, ImportFaults()).roads
            for b in lane_bands(r)
        ]
    )
    assert {band.road.name for band in raised} == {"2"}
    # The bridge is a little longer than the roads below: 5.5 m, and 10 m.
    s = np.concatenate([band.s for band in raised])
    assert 41.0 < s.min() < 50.0
    assert 70.0 < s.max() < 79.0
    built = build_town(path, 0)
    # No kerb lies across the road where the bridge begins, and those of the
    # road below go on.
    (kerbs,) = (s for s in built.city.structures if s.name == "kerbs")
    across = box(-3, 8, 3, 20).union(box(-3, -20, 3, -8))
    assert kerbs.footprint_W.disjoint(across)
    assert kerbs.footprint_W.contains(LineString([(-9, 3.6), (9, 3.6)]))
    decks = [s for s in built.city.structures if s.name.startswith("bridge")]
    assert {one.semantic_class for one in decks} >= {"road", "other-structure"}
    below = LineString([(-60, 0), (60, 0)]).buffer(1.0)
    walls = [
        one.footprint_W
        for one in built.city.structures
        if one.semantic_class == "building"
    ]
    assert all(one.disjoint(below) for one in walls)
    assert all(one.disjoint(box(-5, -20, 5, 20)) for one in walls)


@pytest.mark.slow
def test_bridges_and_tunnels_that_are_not_built_are_counted(tmp_path):
    rise = cubic("elevation", 0, 6.0, 0, 0, 0, "s")
    spans = "".join(
        f'<{tag} id="{tag}" s="30" length="20" type="concrete"/>'
        for tag in ("bridge", "tunnel")
    )
    more = f"<objects>{spans}</objects>"
    path = write_roads(
        tmp_path / "a.xodr",
        straight("1", -40, 0, 40, 0, more=more),
        straight("2", 0, -40, 0, 40, elevation=rise, more=more),
    )
    rows = build_town(path, 0, dressed=True).faults.rows()
    assert {kind: number for kind, number, _ in rows} == {
        "tunnel, its road left open": 2,
        # Road 2 has a deck above road 1.
        "bridge over no other road, laid on the ground": 1,
        "no lanes for traffic: none leads on for ever": 1,
    }
    assert len(build_town(path, 0).faults.rows()) == 1
