"""Signals and objects of OpenDRIVE, and lanes above others."""

import math

from helpers.small_opendrive import cubic, straight, write_roads
import numpy as np
import pytest
import shapely
from shapely.geometry import LineString, box

from cns_drake.base import InputError
from cns_drake.imports import ImportOptions
from cns_drake.imports.faults import ImportFaults
from cns_drake.imports.opendrive.lanes import lane_bands
from cns_drake.imports.opendrive.road_reader import read_roads
from cns_drake.imports.opendrive.things import thing_structures
from cns_drake.imports.opendrive.town import build_town, split_levels

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
    built = build_town(path, ImportOptions())
    found = {s.name: s for s in built.city.structures}
    stop = found["signal_1_0"]
    assert stop.semantic_class == "traffic-sign"
    assert stop.xyz[:2] == (20.0, -6.0)
    # The sign faces the drivers that approach on the road.
    assert abs(stop.yaw) == pytest.approx(math.pi, abs=1e-4)
    assert stop.kind == "sign"
    assert found["signal_1_1"].kind == "traffic_light_post"
    assert found["object_1_1"].kind == "barrier"
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
        "no lanes for traffic: each comes to a dead end": 1,
        "signal over a lane, left out": 1,
        "object that is painted on the road, left out": 1,
        "zOffset of signal, not read": 3,
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


WALL = (
    '<object id="1" type="barrier" s="5" t="{t0}" zOffset="0.1" hdg="0"'
    ' orientation="none" length="1" width="0.3" height="1.2"><repeat s="5"'
    ' length="{length}" distance="0" tStart="{t0}" tEnd="{t1}"'
    ' heightStart="1.2" heightEnd="{high}"/></object>'
)
# Radius of the road [m].
RADIUS = 25.0
# Where on the road the wall begins [m].
START = 5.0
# Length of the wall along the road [m].
LENGTH = 60.0


def bent_road(path, curve, objects, elevation=""):
    """Writes and reads a road of 70 m with one curve; returns its objects."""
    write_roads(
        path,
        straight(
            "1",
            0,
            0,
            70,
            0,
            elevation=elevation,
            more=f"<objects>{objects}</objects>",
        ),
    )
    text = path.read_text().replace("<line/>", curve, 1)
    path.write_text(text)
    faults = ImportFaults()
    (road,) = read_roads(path, faults).roads
    return list(thing_structures(road, box(0, 0, 0, 0), faults)), faults


def triangles_of(structure):
    (mesh,) = structure.model.meshes.values()
    return mesh.vertices[mesh.triangles()]


@pytest.mark.parametrize(
    ("curvature", "t0", "t1"),
    [
        (1 / RADIUS, -8.0, -8.0),
        (1 / RADIUS, 8.0, 8.0),
        (-1 / RADIUS, 8.0, 8.0),
        (1 / RADIUS, -6.5, -10.0),
        (-1 / RADIUS, -5.0, 12.0),
    ],
)
def test_a_wall_without_gaps_follows_the_curve(tmp_path, curvature, t0, t1):
    """Beside an arc its middle line is a circle, or a spiral of Archimedes."""
    wall = WALL.format(t0=t0, t1=t1, length=LENGTH, high=1.2)
    (found,), faults = bent_road(
        tmp_path / "a.xodr", f'<arc curvature="{curvature!r}"/>', wall
    )
    assert not list(faults.rows())
    assert (found.name, found.semantic_class) == ("object_1_0_0", "fence")
    s = np.linspace(START, START + LENGTH, 2000)
    t = t0 + (t1 - t0) * (s - START) / LENGTH
    angle = s * curvature
    radius = 1 / curvature - t
    middle = np.stack(
        [radius * np.sin(angle), 1 / curvature - radius * np.cos(angle)], axis=1
    )
    ideal = LineString(middle).buffer(0.15, cap_style="flat")
    footprint = found.footprint_W
    assert footprint.symmetric_difference(ideal).area < 0.02 * ideal.area
    assert footprint.buffer(0.02).covers(LineString(middle))
    # It is closed, its faces point outwards, and it holds its volume.
    a, b, c = np.moveaxis(triangles_of(found), 1, 0)
    volume = np.einsum("ij,ij->i", a, np.cross(b, c)).sum() / 6.0
    assert volume == pytest.approx(1.2 * ideal.area, rel=0.02)
    edges = np.concatenate([np.c_[a, b], np.c_[b, c], np.c_[c, a]]).round(6)
    forward = sorted(map(tuple, edges))
    assert forward == sorted(map(tuple, np.roll(edges, 3, axis=1)))


@pytest.mark.parametrize(
    "coefficients", [(0.0, 0.1, 0.0, 0.0), (3.0, -0.08, 0.004, 0.0)]
)
def test_a_wall_without_gaps_follows_the_slope(tmp_path, coefficients):
    elevation = cubic("elevation", 0, *coefficients, "s")
    wall = WALL.format(t0=-8, t1=-8, length=LENGTH, high=3.2)
    (found,), _ = bent_road(
        tmp_path / "a.xodr", "<line/>", wall, elevation=elevation
    )
    vertices = triangles_of(found).reshape(-1, 3)
    for s in np.unique(vertices[:, 0]):
        z = vertices[vertices[:, 0] == s, 2]
        foot = np.polyval(coefficients[::-1], s) + 0.1
        height = 1.2 + 2.0 * (s - START) / LENGTH
        # Places are whole millimetres.
        assert z.min() == pytest.approx(foot, abs=5e-4)
        assert z.max() == pytest.approx(foot + height, abs=5e-4)
    # Between its corners, too.
    s = np.unique(vertices[:, 0])
    middle = (s[:-1] + s[1:]) / 2.0
    foot = np.polyval(coefficients[::-1], s)
    between = (foot[:-1] + foot[1:]) / 2.0
    ideal = np.polyval(coefficients[::-1], middle)
    np.testing.assert_allclose(between, ideal, atol=0.005)


def test_a_wall_ends_with_its_road(tmp_path):
    wall = WALL.format(t0=6, t1=6, length=500, high=1.2)
    (found,), faults = bent_road(tmp_path / "a.xodr", "<line/>", wall)
    assert found.footprint_W.bounds == pytest.approx((5, 5.85, 70, 6.15))
    ((kind, number, _),) = faults.rows()
    assert (kind, number) == ("object beyond the end of its road, cut", 1)
    # It may begin before its road, too, where it is not as high.
    wall = WALL.replace('repeat s="5"', 'repeat s="-10"')
    wall = wall.format(t0=6, t1=6, length=20, high=3.2)
    (found,), faults = bent_road(tmp_path / "b.xodr", "<line/>", wall)
    assert found.footprint_W.bounds == pytest.approx((0, 5.85, 10, 6.15))
    vertices = triangles_of(found).reshape(-1, 3)
    assert vertices[vertices[:, 0] == 0.0, 2].max() == pytest.approx(2.3)
    assert [kind for kind, *_ in faults.rows()] == [
        "object beyond the end of its road, cut"
    ]


def test_a_wall_has_a_size_of_this_world(tmp_path):
    wall = WALL.format(t0=6, t1=6, length=20, high=1001)
    with pytest.raises(InputError, match="repeat: a size of over 1000 m"):
        bent_road(tmp_path / "a.xodr", "<line/>", wall)


def test_trees_without_a_distance_stay_trees(tmp_path):
    trees = WALL.replace("barrier", "tree").format(
        t0=6, t1=6, length=12, high=5
    )
    found, _ = bent_road(tmp_path / "a.xodr", "<line/>", trees)
    assert [one.xyz[0] for one in found] == [5.0, 9.0, 13.0, 17.0]
    assert {one.semantic_class for one in found} == {"vegetation"}


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
    built = build_town(path, ImportOptions())
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
@pytest.mark.night
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
    rows = build_town(path, ImportOptions(dressed=True)).faults.rows()
    assert {kind: number for kind, number, _ in rows} == {
        "tunnel, its road left open": 2,
        # Road 2 has a deck above road 1.
        "bridge over no other road, laid on the ground": 1,
        "no lanes for traffic: each comes to a dead end": 1,
    }
    assert len(build_town(path, ImportOptions()).faults.rows()) == 1
