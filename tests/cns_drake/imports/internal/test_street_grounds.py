"""Sidewalks and carriageways that files lack, on level and sloping ground."""

from helpers.small_cityjson import CityWriter
from helpers.small_osm import OsmWriter
import numpy as np
import pytest
import shapely
from shapely.geometry import LineString, box

from cns_drake.imports import import_cityjson, import_openstreetmap
from cns_drake.imports.dressing.dressed_city import paved_gaps
from cns_drake.imports.dressing.guessed_streets import guessed_streets
from cns_drake.imports.drives.steerable_drives import WaypointRoute
from cns_drake.imports.ground import ground_of


def straight_drive(y=0.0, start=-80.0, end=70.0):
    x = np.linspace(start, end, 81)
    path = np.column_stack([x, np.full(81, y)])
    return WaypointRoute(path, path)


def outline(one):
    """Returns the area of triangles from above, and whether none overlap."""
    polygons = shapely.polygons(one.triangles[:, [0, 1, 2, 0], :2])
    area = shapely.union_all(polygons, grid_size=1e-3)
    assert area.area == pytest.approx(shapely.area(polygons).sum(), rel=1e-3)
    return area


def test_narrow_gaps_between_walks_and_roads_are_paved(tmp_path):
    osm = OsmWriter()
    ends = [osm.node(-100, 0), osm.node(100, 0)]
    osm.way_of(ends, highway="residential", width="9", sidewalk="separate")
    osm.way([(-100, 8), (100, 8)], highway="footway", width="2")
    osm.way([(-100, -10), (100, -10)], highway="footway", width="2")
    osm.box(0, 4.5, 30, 2.5, leisure="park")
    osm.box(60, 4.5, 20, 10, building="yes", height="9")
    osm.box(-80, 10.5, 20, 10, building="yes", height="9")
    city = import_openstreetmap(osm.write(tmp_path / "a.osm"), None, True)
    origin = city.streets[0].line.mean(axis=0)
    path = straight_drive().path + origin
    found = list(paved_gaps(city.objects, [WaypointRoute(path, path)]))
    area = shapely.union_all([outline(one) for one in found])
    area = shapely.transform(area, lambda xy: xy - origin)
    # The other walk is 4.5 m away from the carriageway.
    middle = box(-90, 4.5, 90, 7.0)
    park_and_house = box(0, 0, 30, 20).union(box(60, 0, 80, 20))
    # Up to the wall of the other house, too.
    before_wall = box(-79, 9, -61, 10.5)
    expected = middle.difference(park_and_house).union(before_wall)
    missing = expected.difference(area.buffer(0.02))
    assert missing.area < 0.1
    assert area.intersection(park_and_house).area < 0.1
    assert area.bounds[1] > 4.0
    assert area.bounds[3] < 10.6
    for one in found:
        assert one.structure.semantic_class == "sidewalk"
        np.testing.assert_allclose(one.triangles[..., 2], 0.12)
    far = path + np.array([0.0, 500.0])
    assert not list(paved_gaps(city.objects, [WaypointRoute(far, far)]))


@pytest.mark.parametrize(("gap", "is_paved"), [(0.15, True), (0.06, False)])
def test_joints_of_walks_are_paved(tmp_path, gap, is_paved):
    osm = OsmWriter()
    ends = [osm.node(-60, 0), osm.node(60, 0)]
    osm.way_of(ends, highway="residential", width="9", sidewalk="separate")
    osm.box(-20, 30, 20, 10, building="yes", height="9")
    for y in (8.0, 10.0 + gap):
        osm.way([(-60, y), (60, y)], highway="footway", width="2")
    city = import_openstreetmap(osm.write(tmp_path / "a.osm"), None, True)
    origin = city.streets[0].line.mean(axis=0)
    path = straight_drive(start=-50.0, end=50.0).path + origin
    found = list(paved_gaps(city.objects, [WaypointRoute(path, path)]))
    area = shapely.union_all([outline(one) for one in found])
    area = shapely.transform(area, lambda xy: xy - origin)
    joint = box(-55, 9.0, 55, 9.0 + gap)
    expected = joint.area if is_paved else 0.0
    assert area.intersection(joint).area == pytest.approx(expected, abs=0.5)
    # The strip beside the carriageway has its middle in the same square.
    assert area.area > 200.0
    assert len(found) == 1


@pytest.mark.parametrize("has_terrain", [True, False])
def test_streets_are_laid_on_the_ground_below_drives(tmp_path, has_terrain):
    def height(x, y):
        return 2.0 + 0.05 * x + 0.02 * y if has_terrain else 2.0 + 0.0 * x

    city = CityWriter()
    for x in (-60.0, 0.0):
        for y, depth in ((4.9, 10.0), (-17.0, 10.0)):
            city.box(f"house{x}{y}", x, y, (40.0, depth, 9.0), z=2.0)
    if has_terrain:
        corners = [(-99, -50), (99, -50), (99, 50), (-99, 50)]
        ring = city.ring([(x, y, float(height(x, y))) for x, y in corners])
        surface = {
            "type": "CompositeSurface", "lod": "2",
            "boundaries": [[[ring[k] for k in some]]
                           for some in ((0, 1, 2), (0, 2, 3))],
        }  # fmt: skip
        city.add("terrain", "TINRelief", surface)
    found = import_cityjson(city.write(tmp_path / "a.json"), None, None)
    low = np.array(found.origin) - np.array(city.origin)
    drive = straight_drive()
    path = drive.path - low[:2]
    made = list(
        guessed_streets(
            found.objects,
            [WaypointRoute(path, path)],
            ground_of(found.objects),
        )
    )
    by_kind = {"Road": [], "Sidewalk": []}
    for one in made:
        by_kind[one.object_type].append(one)
        above = {"Road": 0.02, "Sidewalk": 0.12}[one.object_type]
        x, y, z = np.moveaxis(one.triangles + low, 2, 0)
        np.testing.assert_allclose(z - height(x, y), above, atol=2e-3)
        a, b, c = np.moveaxis(one.triangles, 1, 0)
        assert (np.cross(b - a, c - a)[:, 2] > 0.0).all()
    road, walks = (
        shapely.transform(
            shapely.union_all([outline(one) for one in by_kind[kind]]),
            lambda xy: xy + low[:2],
        )
        for kind in ("Road", "Sidewalk")
    )
    line = LineString(drive.path)
    assert road.symmetric_difference(line.buffer(3.9, 4)).area < 0.1
    houses = box(-60, 4.9, -20, 15).union(box(0, 4.9, 40, 15))
    expected = line.buffer(5.9, 4).difference(road).difference(houses)
    assert walks.symmetric_difference(expected).area < 3.0
    assert walks.intersection(houses).area < 0.01
    # A metre is left between the carriageway and the walls.
    assert walks.contains(box(-55, 4.0, -25, 4.8))
