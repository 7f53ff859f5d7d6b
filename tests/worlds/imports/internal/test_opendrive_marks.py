"""Painted lines of OpenDRIVE lie on the borders of their lanes."""

import numpy as np
import pytest

from worlds.imports.faults import ImportFaults
from worlds.imports.opendrive.lanes import lane_bands
from worlds.imports.opendrive.road_marks import road_marks
from worlds.imports.opendrive.road_reader import read_roads

RADIUS = 50.0
# A bend to the left, from its middle; two lanes of 3.5 m, one line in the
# middle that changes, and a double line at the right edge.
ROAD = f"""<OpenDRIVE><header revMajor="1" revMinor="6"/>
<road name="" length="90" id="1" junction="-1">
<planView><geometry s="0" x="0" y="0" hdg="0" length="90">
<arc curvature="{1 / RADIUS}"/></geometry></planView>
<lanes><laneSection s="0">
<left><lane id="1" type="driving"><width sOffset="0" a="3.5" b="0" c="0" d="0"/>
</lane></left>
<center><lane id="0" type="none">
<roadMark sOffset="30" type="solid" color="yellow" width="0.2"/>
<roadMark sOffset="0" type="broken" color="white" width="0.1"/>
</lane></center>
<right><lane id="-1" type="driving">
<width sOffset="0" a="3.5" b="0" c="0" d="0"/>
<roadMark sOffset="0" type="solid broken" color="no colour"/></lane></right>
</laneSection></lanes></road></OpenDRIVE>"""


@pytest.fixture(scope="module")
def paint(tmp_path_factory):
    path = tmp_path_factory.mktemp("road") / "road.xodr"
    return painted(path, ROAD, ImportFaults())


def painted(path, text, faults):
    """Returns colour -> triangles in the world, about the bend's middle."""
    path.write_text(text)
    roads = read_roads(path, faults)
    bands = [band for road in roads.roads for band in lane_bands(road)]
    (one,) = road_marks("marks", bands, lambda xy: np.full(len(xy), 0.5))
    assert one.name == "marks_1"
    middle = np.array([-roads.origin[0], RADIUS - roads.origin[1], 0.0])
    found = {}
    for part in one.model.parts:
        mesh = one.model.meshes[part.shape.mesh]
        found[part.name] = mesh.vertices[mesh.triangles()] - middle
    return found


def radii(triangles):
    return np.linalg.norm(triangles[..., :2], axis=-1)


def area(triangles):
    a, b, c = np.moveaxis(triangles, 1, 0)
    return np.linalg.norm(np.cross(b - a, c - a), axis=1).sum() / 2


def test_lines_lie_on_their_borders(paint):
    assert set(paint) == {"yellow", "white", "standard"}
    for colour, radius, half in (("white", 50.0, 0.05), ("yellow", 50.0, 0.1)):
        off = radii(paint[colour]) - radius
        assert np.abs(np.abs(off) - half).max() < 0.005
    # The inner line is first; the middle of the bend is on the left.
    outer = RADIUS + 3.5
    r = radii(paint["standard"]).reshape(-1)
    expected = [outer + a + b for a in (-0.12, 0.12) for b in (-0.06, 0.06)]
    nearest = np.abs(r[:, None] - expected).min(axis=1)
    assert nearest.max() < 0.005


def with_lines(*lines, kind="broken broken"):
    """Returns the road with lines of its own on the right edge."""
    inner = "".join(f"<line {line}/>" for line in lines)
    return ROAD.replace(
        'type="solid broken" color="no colour"/>',
        f'type="{kind}" color="red"><type name="x" width="0.2">{inner}</type>'
        "</roadMark>",
    )


@pytest.mark.parametrize("kind", ["broken broken", "custom"])
def test_dashes_are_those_of_the_file(tmp_path, kind):
    text = with_lines(
        'length="2" space="4" tOffset="0.3" sOffset="1" width="0.1"',
        'length="0" space="0" tOffset="-0.4" sOffset="10" width="0.25"',
        kind=kind,
    )
    faults = ImportFaults()
    red = painted(tmp_path / "road.xodr", text, faults)["red"]
    assert not faults.rows()
    # Outwards is to the right, and the bend's middle is on the left.
    edge = RADIUS + 3.5
    inner = (radii(red) < edge).all(axis=1)
    dashes, line = red[inner], red[~inner]
    off = radii(dashes) - (edge - 0.3)
    assert np.abs(np.abs(off) - 0.05).max() < 0.005
    off = radii(line) - (edge + 0.4)
    assert np.abs(np.abs(off) - 0.125).max() < 0.005
    # 15 dashes, from 1 m to 87 m along the road; and from 10 m to its end.
    places = np.arctan2(dashes[..., 0], -dashes[..., 1]) * RADIUS
    assert places.min() == pytest.approx(1.0, abs=0.01)
    assert places.max() == pytest.approx(1.0 + 14 * 6.0 + 2.0, abs=0.01)
    inside = 15 * 2.0 * 0.1 * (edge - 0.3) / RADIUS
    assert area(dashes) == pytest.approx(inside, rel=0.01)
    outside = 80.0 * 0.25 * (edge + 0.4) / RADIUS
    assert area(line) == pytest.approx(outside, rel=0.01)
