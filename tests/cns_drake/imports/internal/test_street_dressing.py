"""Streets get furniture from the file, then at random, away from the drives."""

from dataclasses import replace
from itertools import combinations

from helpers.city_checks import check_things_stand_on_the_ground
from helpers.small_cityjson import CityWriter
from helpers.small_osm import OsmWriter
import numpy as np
import pytest
from shapely.geometry import LineString, Point

from cns_drake.base import InputError
from cns_drake.city import GROUND_TAG, HEADROOM, part_triangles
from cns_drake.imports import (
    ImportOptions,
    import_cityjson,
    import_openstreetmap,
)
from cns_drake.imports.dressing import dressed_city
from cns_drake.imports.dressing.dressed_city import (
    dress_city,
    missing_sidewalks,
    with_kerb,
)
from cns_drake.imports.dressing.street_dressing import dress_streets
from cns_drake.imports.drives.steerable_drives import WaypointRoute
from cns_drake.imports.ground import ground_of, ground_structures
from cns_drake.imports.openstreetmap.small_objects import object_kind
from cns_drake.imports.staged_city import stage_city

WIDTH = 9.0


def write_street(osm, **tags):
    """Writes a street of 200 m along y = 0, and houses on both sides."""
    ends = [osm.node(-100, 0), osm.node(100, 0)]
    osm.way_of(ends, highway="residential", width=f"{WIDTH:g}", **tags)
    for x in (-90, 40):
        osm.box(x, 12, 50, 10, building="yes", height="12")
        osm.box(x, -22, 50, 10, building="yes", height="12")


def read(osm, folder):
    return import_openstreetmap(osm.write(folder / "city.osm"), None)


def origin(city):
    """Returns the position of the writer's origin in the map."""
    return city.streets[0].line.mean(axis=0)


def drive_of(city, y=2.25):
    x = np.linspace(-95, 95, 96)
    path = np.column_stack([x, np.full(96, y)]) + origin(city)
    return WaypointRoute(path, path)


def dressed(city, seed=0):
    ground = ground_of(city.objects)
    return dress_streets(
        city.objects,
        city.small_objects,
        city.streets,
        [drive_of(city)],
        ground,
        ground_structures(city.objects, ground),
        seed,
    )


def corners(structure):
    """Returns the corners of a structure below headroom, in the world."""
    c, s = np.cos(structure.yaw), np.sin(structure.yaw)
    found = []
    for part in structure.model.parts:
        p, _ = part_triangles(part, structure.model.meshes)
        found.append(p[p[:, 2] < HEADROOM])
    p = np.concatenate(found)
    xy = p[:, :2] @ np.array([[c, s], [-s, c]])
    return xy + structure.xyz[:2]


@pytest.mark.parametrize(
    ("tags", "name"),
    [({"highway": "street_lamp"}, "lamp_post"),
     ({"highway": "street_lamp", "lamp_mount": "wall_mounted"}, None),
     ({"emergency": "fire_hydrant"}, "hydrant"),
     ({"emergency": "fire_hydrant", "fire_hydrant:type": "underground"}, None),
     ({"traffic_sign": "DE:283"}, "sign_round"),
     ({"highway": "bus_stop", "shelter": "yes"}, "bus_shelter"),
     ({"highway": "bus_stop"}, "sign_rectangular"),
     ({"amenity": "cafe"}, None), ({"amenity": "no"}, None), ({}, None)],
)  # fmt: skip
def test_objects_of_tags(tags, name):
    assert object_kind(tags) == name


def test_things_of_the_file_stand_at_their_place(tmp_path):
    osm = OsmWriter()
    write_street(osm)
    lamp = osm.node(10, -6, highway="street_lamp")
    bench = osm.node(-30, -7, amenity="bench", direction="180")
    inside = osm.node(-70, -17, amenity="bench")
    sign = osm.node(30, 0, traffic_sign="DE:283")
    osm.way([(-60, -8.5), (60, -8.5)], natural="tree_row")
    city = read(osm, tmp_path)
    found = dressed(city)
    placed = {one.structure.name: one.structure for one in found.objects}
    at = placed[f"lamp_post_n{lamp}"]
    np.testing.assert_allclose(
        at.xyz[:2], origin(city) + np.array([10, -6]), atol=0.01
    )
    assert at.semantic_class == "pole"
    # Its arm, along its x, reaches over the street.
    assert at.yaw == pytest.approx(np.pi / 2, abs=1e-3)
    facing = placed[f"bench_n{bench}"].yaw
    assert facing == pytest.approx(-np.pi / 2, abs=1e-3)
    assert f"bench_n{inside}" not in placed
    # A sign on the middle of a street stands beside it, on the right.
    moved = placed[f"sign_round_n{sign}"]
    expected = origin(city) + np.array([30, -(WIDTH / 2 + 0.6)])
    np.testing.assert_allclose(moved.xyz[:2], expected, atol=0.01)
    trees = sorted(
        one.xyz[0] for name, one in placed.items() if name.startswith("lime")
    )
    assert len(trees) == 15
    np.testing.assert_allclose(np.diff(trees), 8.0, atol=0.01)
    assert found.by_file["Lamp post"] == 1
    assert found.no_room == 1


def test_things_stand_on_the_ground_below_them(tmp_path):
    """Beside the street the ground lies lower than the street."""
    osm = OsmWriter()
    write_street(osm, sidewalk="right")
    for x in range(-90, 90, 12):
        osm.node(x, 6.5, amenity="bench")
        osm.node(x + 6, -4.5, amenity="waste_basket")
    city = read(osm, tmp_path)
    ground = [one.structure for one in city.objects if one.is_ground]
    ground += ground_structures(city.objects, ground_of(city.objects))
    walks = [o.structure for o in city.objects if o.object_type == "Sidewalk"]
    check_things_stand_on_the_ground(
        [
            *(replace(one, tags=(GROUND_TAG,)) for one in [*ground, *walks]),
            *(one.structure for one in dressed(city).objects),
        ]
    )


def test_nothing_stands_in_the_way_or_in_each_other(tmp_path):
    osm = OsmWriter()
    write_street(osm)
    for x in range(-90, 90, 6):
        osm.node(x, 2.0 + 0.02 * x, amenity="bench")
    city = read(osm, tmp_path)
    found = dressed(city)
    path = LineString(drive_of(city).path)
    assert found.at_random["Parked vehicles"] > 5
    for one in found.objects:
        xy = corners(one.structure)
        assert min(path.distance(Point(p)) for p in xy) > 1.5
    outlines = [one.structure.footprint_W for one in found.objects]
    for a, b in combinations(outlines, 2):
        assert not a.intersects(b)


@pytest.mark.parametrize(
    ("tags", "parks"),
    [({}, True), ({"parking__both": "no"}, False),
     ({"parking__both": "lane"}, True),
     ({"parking__lane__right": "no_stopping"}, False)],
)  # fmt: skip
def test_cars_park_where_they_may(tmp_path, tags, parks):
    osm = OsmWriter()
    write_street(osm, **tags)
    found = dressed(read(osm, tmp_path))
    classes = {one.structure.semantic_class for one in found.objects}
    assert (
        ("car" in classes) == parks == (found.at_random["Parked vehicles"] > 0)
    )


def test_a_car_park_has_cars_within_it(tmp_path):
    osm = OsmWriter()
    write_street(osm, parking__both="no")
    osm.box(-30, -12, 60, 5.5, amenity="parking")
    city = read(osm, tmp_path)
    cars = [
        one.structure
        for one in dressed(city).objects
        if one.structure.semantic_class == "car"
    ]
    assert len(cars) > 5
    low = origin(city) + np.array([-30, -12])
    for car in cars:
        xy = np.array(car.footprint_W.exterior.coords)
        assert (xy > low - 0.3).all()
        assert (xy < low + np.array([60.3, 5.8])).all()


def test_lots_do_not_depend_on_each_other(tmp_path):
    osm = OsmWriter()
    write_street(osm)
    city = read(osm, tmp_path)
    names = [
        [
            (o.structure.name, o.structure.xyz)
            for o in dressed(city, seed).objects
        ]
        for seed in (0, 0, 1)
    ]
    assert names[0] == names[1] != names[2]


def test_sidewalks_are_added_where_the_file_is_silent(tmp_path):
    osm = OsmWriter()
    ends = [osm.node(-100, 0), osm.node(100, 0)]
    osm.way_of(ends, highway="residential", width="9")
    osm.way([(-100, 60), (100, 60)], highway="residential", sidewalk="no")
    osm.box(-5, 200, 9, 9, building="yes")
    city = read(osm, tmp_path)
    drives = [drive_of(city)]
    (walk,) = missing_sidewalks(city.objects, city.streets, drives)
    a, b, c = np.moveaxis(walk.triangles, 1, 0)
    area = np.linalg.norm(np.cross(b - a, c - a), axis=1).sum() / 2
    # Two strips, and around both ends half a ring of 16 corners.
    ring = 8 * np.sin(np.pi / 8) * (6.5**2 - 4.5**2)
    assert area == pytest.approx(2 * 2 * 200 + ring, rel=1e-3)
    kerb = with_kerb(walk).structure.model.meshes[f"{walk.structure.name}_kerb"]
    faces = kerb.vertices[np.array(kerb.faces)]
    edges = np.linalg.norm(faces[:, 1, :2] - faces[:, 0, :2], axis=1)
    around = 16 * 2 * np.sin(np.pi / 16)
    expected = 4 * 200 + around * (6.5 + 4.5)
    assert edges.sum() == pytest.approx(expected, rel=1e-3)
    assert {*faces[:, :, 2].ravel().round(3)} == {0.12, -0.13}
    # Each looks away from the sidewalk.
    normal = np.cross(faces[:, 1] - faces[:, 0], faces[:, 3] - faces[:, 0])
    middle = faces.mean(axis=1) + 0.01 * normal / np.linalg.norm(
        normal, axis=1, keepdims=True
    )
    line = LineString(city.streets[0].line)
    gaps = np.array([line.distance(Point(p[:2])) for p in middle])
    assert ((gaps < 4.5) | (gaps > 6.33)).all()


def test_a_city_counts_what_is_from_the_file_and_what_at_random(
    tmp_path, monkeypatch
):
    osm = OsmWriter()
    write_street(osm, sidewalk="both")
    osm.node(10, -6, highway="street_lamp")
    osm.node(-70, -17, amenity="bench")
    city = read(osm, tmp_path)
    again = read(osm, tmp_path)
    staged = stage_city("f", city, ImportOptions())
    ground = ground_of(staged.kept)
    before = {kind: number for kind, number, _ in city.faults.rows()}
    assert before["highway=street_lamp, left out"] == 1
    result = dress_city(staged, city, [drive_of(city)], ground, 0)
    after = {kind: number for kind, number, _ in city.faults.rows()}
    assert "highway=street_lamp, left out" not in after
    assert after["amenity=bench, left out"] == 1
    assert result.facts["by_file"]["Lamp post"] == 1
    assert result.facts["without_room"] == 1
    origins = result.origins
    kinds = {
        one.structure.name: origins.get(one.structure.name, "file")
        for one in result.city.kept
    }
    by_start = {
        start: {o for name, o in kinds.items() if name.startswith(start)}
        for start in ("building", "walk", "road", "lamp_post_n", "car")
    }
    assert by_start == {
        "building": {"dressed"}, "walk": {"dressed"}, "road": {"file"},
        "lamp_post_n": {"file"}, "car": {"lot"},
    }  # fmt: skip
    monkeypatch.setattr(dressed_city, "MAX_INSTANCE", len(result.city.kept))
    with pytest.raises(InputError, match="more than instance ids"):
        dress_city(staged, again, [drive_of(again)], ground, 0)
    (guessed,) = ground_structures(staged.kept, ground)
    (seen,) = result.guessed_ground
    # Four houses of 500 m^2 in 180 m by 44 m.
    assert (
        seen.model.parts[0].rgb
        == dressed_city.in_paving_colour(guessed).model.parts[0].rgb
    )
    assert seen.model.parts[0].rgb != guessed.model.parts[0].rgb


def test_only_cars_stand_on_another_street(tmp_path):
    """A lamp in a corner, moved off one street, would stand on the other."""
    osm = OsmWriter()
    write_street(osm)
    crossing = [osm.node(10, -40), osm.node(10, 40)]
    osm.way_of(crossing, highway="residential", width="8")
    on_it = osm.node(13.5, -4.2, highway="street_lamp")
    beside = osm.node(20, -5.5, highway="street_lamp")
    found = dressed(read(osm, tmp_path))
    names = {one.structure.name for one in found.objects}
    assert f"lamp_post_n{beside}" in names
    assert f"lamp_post_n{on_it}" not in names


def test_terrain_of_a_dense_city_is_paved_by_default(tmp_path):
    city = CityWriter()
    for k in range(4):
        city.box(f"house{k}", 30.0 * k, 10.0, (20.0, 15.0, 8.0))
    corners = [(-10, 0, 0), (130, 0, 0), (130, 30, 0), (-10, 30, 0)]
    ground = {
        "type": "CompositeSurface",
        "lod": "2",
        "boundaries": [[city.ring(corners)]],
    }
    city.add("terrain", "TINRelief", ground)
    for is_told in (False, True):
        if is_told:
            city.add("road", "Road", ground)
        path = city.write(tmp_path / f"{is_told}.json")
        found = import_cityjson(path, None, None)
        staged = stage_city(path, found, ImportOptions())
        below = ground_of(staged.kept)
        result = dress_city(staged, found, [], below, 0).city.kept
        (terrain,) = (o for o in result if o.object_type == "TINRelief")
        (before,) = (o for o in staged.kept if o.object_type == "TINRelief")
        same = terrain.structure.model.parts == before.structure.model.parts
        assert same is is_told


def test_trees_on_carriageways_and_kerbs_are_moved_beside_them(tmp_path):
    osm = OsmWriter()
    write_street(osm, sidewalk="both")
    crossing = [osm.node(10, -40), osm.node(10, 40)]
    osm.way_of(crossing, highway="residential", width="8")
    places = {
        "lane": (30, 3.5), "kerb": (-50, -4.6), "verge": (60, 7.0),
        "corner": (12, 4.2), "wall": (70, 11.0),
    }  # fmt: skip
    numbers = {
        name: osm.node(*place, natural="tree", height="7")
        for name, place in places.items()
    }
    city = read(osm, tmp_path)
    found = dressed(city)
    moved = {one.structure.name: (one, new) for one, new in found.moved.items()}
    for name, y in (("lane", WIDTH / 2 + 0.6), ("kerb", -WIDTH / 2 - 0.6)):
        old, new = moved.pop(f"tree_n{numbers[name]}")
        expected = origin(city) + np.array([places[name][0], y])
        np.testing.assert_allclose(new.structure.xyz[:2], expected, atol=0.01)
        offset = np.subtract(new.structure.xyz, old.structure.xyz)
        np.testing.assert_allclose(
            new.triangles - old.triangles,
            np.broadcast_to(offset, new.triangles.shape),
            atol=1e-9,
        )
    # Beside the one street is on the other one.
    assert not moved
