"""Buildings of OpenStreetMap that lie in each other."""

import re

from helpers.imported_cities import read_city
from helpers.small_osm import OsmWriter
import numpy as np
import pytest
from shapely.geometry import box

from worlds.imports import ImportOptions, import_city

TWICE = "building drawn twice, taken once"
NESTED = "building inside another one, taken as its part"


def read(osm, path, dressed=True):
    city = read_city(osm.write(path / "a.osm"), dressed=dressed)
    buildings = [one for one in city.objects if one.object_type == "Building"]
    kinds = {kind: (number, name) for kind, number, name in city.faults.rows()}
    return {one.structure.name: one for one in buildings}, kinds


def volume(one):
    a, b, c = np.moveaxis(one.triangles, 1, 0)
    return np.einsum("ij,ij->i", a, np.cross(b, c)).sum() / 6


@pytest.mark.parametrize("dressed", [True, False])
@pytest.mark.parametrize("role", ["outer", ""])
def test_a_way_around_a_court_is_not_a_second_building(tmp_path, role, dressed):
    osm = OsmWriter()
    court = osm.box(10, 10, 20, 10)
    outline = osm.box(0, 0, 40, 30, building="yes", height="9")
    whole = osm.relation(
        {role: [outline], "inner": [court]},
        type="multipolygon",
        building="university",
        height="9",
    )
    found, kinds = read(osm, tmp_path, dressed)
    assert list(found) == [f"building_r{whole}"]
    one = found[f"building_r{whole}"]
    assert volume(one) == pytest.approx((1200 - 200) * 9.0, rel=1e-3)
    assert kinds == {TWICE: (1, f"w{outline}")}


def test_a_court_or_an_open_multipolygon_replaces_no_building(tmp_path):
    osm = OsmWriter()
    kiosk = osm.box(10, 10, 20, 10, building="kiosk")
    outline = osm.box(0, 0, 40, 30)
    whole = osm.relation(
        {"outer": [outline], "inner": [kiosk]},
        type="multipolygon",
        building="yes",
    )
    single = osm.box(100, 0, 10, 10, building="yes")
    half = osm.way([(120, 0), (130, 0), (130, 10)])
    osm.relation({"outer": [single, half]}, type="multipolygon", building="yes")
    found, kinds = read(osm, tmp_path)
    assert set(found) == {
        f"building_{name}" for name in (f"r{whole}", f"w{kiosk}", f"w{single}")
    }
    assert TWICE not in kinds


@pytest.mark.parametrize(
    ("width", "is_twin"), [(18.1, True), (17.9, False), (20.0, True)]
)
def test_a_building_drawn_twice_is_taken_once(tmp_path, width, is_twin):
    osm = OsmWriter()
    first = osm.box(0, 0, 20, 10, building="yes", height="9")
    second = osm.box(
        0, 0, width, 10, building="retail", height="6", start_date="1967"
    )
    found, kinds = read(osm, tmp_path)
    one = found[f"building_w{first}"]
    if is_twin:
        assert len(found) == 1
        assert kinds == {TWICE: (1, f"w{second}")}
        assert volume(one) == pytest.approx(200 * 9.0, rel=1e-3)
        assert (one.tags["building"], one.tags["height"]) == ("retail", "9")
        assert one.year == 1967
    else:
        # It may have come later than the other one.
        assert len(found) == 2
        assert not kinds


@pytest.mark.parametrize(
    ("outside", "is_part"), [(0.0, True), (0.48, True), (0.52, False)]
)
def test_a_building_inside_another_one_is_its_part(tmp_path, outside, is_part):
    osm = OsmWriter()
    church = osm.box(0, 0, 30, 12, building="church", height="10")
    tower = osm.box(30 + outside - 5, 2, 5, 5, building="tower", height="30")
    found, kinds = read(osm, tmp_path)
    beside = box(30, 2, 30 + outside, 7).area
    if is_part:
        (one,) = found.values()
        assert one.structure.name == f"building_w{church}"
        assert kinds == {NESTED: (1, f"w{tower}")}
        expected = (360 - 25 + beside) * 10.0 + 25 * 30.0
        assert volume(one) == pytest.approx(expected, rel=0.02)
    else:
        assert len(found) == 2
        assert not kinds


@pytest.mark.parametrize(
    ("outer", "inner", "number"),
    [
        ({"start_date": "1900"}, {"start_date": "1900"}, 1),
        ({"start_date": "1900"}, {}, 1),
        ({"start_date": "1900"}, {"start_date": "1950"}, 2),
        ({}, {"start_date": "1950"}, 2),
        ({}, {"end_date": "2010"}, 2),
        ({"end_date": "2010"}, {}, 2),
    ],
)
def test_buildings_of_different_times_stay_apart(
    tmp_path, outer, inner, number
):
    osm = OsmWriter()
    osm.box(0, 0, 30, 12, building="yes", **outer)
    osm.box(5, 2, 5, 5, building="yes", **inner)
    found, _ = read(osm, tmp_path)
    assert len(found) == number


@pytest.mark.parametrize("dressed", [True, False])
def test_a_building_came_after_the_one_that_stood_there(tmp_path, dressed):
    osm = OsmWriter()
    old = osm.box(0, 0, 12, 12, building="yes", end_date="2010")
    new = osm.box(2, 2, 20, 20, building="yes")
    osm.box(50, 0, 10, 10, building="yes")
    source = osm.write(tmp_path / "city.osm")
    options = ImportOptions((2000, 2020), dressed=dressed)
    import_city(source, tmp_path / "town", options)
    for stage, standing in (("01", {old}), ("02", {new})):
        text = (tmp_path / "town" / f"stage_{stage}.sdf").read_text()
        found = set(re.findall(r"building_w(\d+)", text)) & {str(old), str(new)}
        # A plain import has what the file has.
        also = {new} if not dressed else set()
        assert found == {str(one) for one in standing | also}
