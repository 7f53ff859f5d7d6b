"""What OpenStreetMap's tags say about buildings and streets."""

from helpers.imported_osm import import_osm
from helpers.small_osm import OsmWriter
import pytest

from cns_drake.imports.faults import ImportFaults
from cns_drake.imports.openstreetmap.building_tags import heights, why_absent
from cns_drake.imports.openstreetmap.tags import count, length
from cns_drake.imports.openstreetmap.way_tags import (
    sidewalk_sides,
    street_width,
)


@pytest.mark.parametrize(
    ("text", "metres"),
    [
        ("12", 12.0),
        ("12.5 m", 12.5),
        ("12,5", 12.5),
        ("40'", 12.192),
        ("5'6\"", 1.6764),
        ("12'6\"", 3.81),
        ("12' 6\"", 3.81),
        ("12’6”", 3.81),
        ("12 ft", 3.6576),
        ("12ft 6in", 3.81),
        ("12.5M", 12.5),
        ("12,5 m", 12.5),
        ("~15", 15.0),
        ("ca. 15 m", 15.0),
        ("10 - 12", 12.0),
        ("9;12.5", 12.5),
        ("150 cm", 1.5),
        ("0.01 mi", 16.09344),
        ("-5", None),
        ("12 parsecs", None),
        ("12 m high", None),
        ("", None),
        (";", None),
        ("9;tall", None),
        ("tall", None),
        ("1e300", None),
        ("99999", 99999.0),
        (None, None),
    ],
)
def test_lengths(text, metres):
    expected = metres if metres is None else pytest.approx(metres)
    assert length(text) == expected


def test_heights_widths_and_sides():
    assert heights({"building:levels": "4"}) == (0.0, 12.0, 0.0)
    roof = {"building:levels": "2", "roof:shape": "gabled"}
    assert heights(roof) == (0.0, 9.0, 3.0)
    assert heights({"height": "0"})[1] > 0.0
    low, high, _ = heights({"height": "5", "min_height": "50"})
    assert low < high
    assert street_width({"highway": "residential", "oneway": "yes"}) < 6.5
    assert street_width({"highway": "primary_link", "width": "5"}) == 5.0
    assert street_width({"highway": "footway"}) is None
    assert sidewalk_sides({"sidewalk": "right"}) == (False, True)


@pytest.mark.parametrize(
    ("text", "number"),
    [
        ("3", 3.0), ("2.5", 2.5), ("2,5", 2.5), ("3;4", 4.0), ("1; 2;3", 3.0),
        ("3-4", 4.0), ("3 – 5", 5.0), ("3 to 4", 4.0), ("~4", 4.0),
        ("many", None), ("-2", None), ("3 m", None), ("3;x", None),
    ],
)  # fmt: skip
def test_levels(text, number):
    assert count(text) == number


@pytest.mark.parametrize(
    "tags",
    [
        {"height": "-5"},
        {"height": "0"},
        {"height": "851"},
        {"height": "tall"},
        {"building:levels": "1000"},
        {"building:levels": "0"},
        {"building:levels": "some"},
        {"min_height": "1e9"},
        {"roof:height": "x"},
    ],
)
def test_heights_that_cannot_be_are_the_usual_and_counted(tags):
    faults = ImportFaults()
    assert heights(tags, ("w7", faults)) == heights({})
    ((kind, number, example),) = faults.rows()
    (key,) = tags
    assert kind.startswith(f"{key} unreadable or implausible")
    assert (number, example) == (1, "w7")


def test_levels_in_the_roof_are_above_the_others():
    tags = {"building:levels": "2", "roof:levels": "1"}
    assert heights(tags)[1] == 9.0
    assert heights(tags | {"roof:shape": "gabled"}) == (0.0, 9.0, 3.0)
    assert heights({"building:levels": "0", "roof:levels": "1"})[1] == 3.0


@pytest.mark.parametrize(
    ("tags", "why"),
    [
        ({"building": "yes", "location": "underground"}, "underground"),
        ({"building": "yes", "layer": "-1"}, "underground"),
        ({"building": "yes", "tunnel": "yes"}, "underground"),
        (
            {
                "building": "garage",
                "building:levels": "0",
                "building:levels:underground": "2",
            },
            "underground",
        ),
        ({"building": "demolished"}, "demolished"),
        ({"building": "house", "demolished": "yes"}, "demolished"),
        ({"building": "proposed"}, "proposed"),
        ({"building": "yes", "proposed": "yes"}, "proposed"),
        ({"building": "construction", "construction": "house"}, "unfinished"),
        ({"building": "ruins", "layer": "1"}, None),
        ({"building": "yes", "tunnel": "building_passage"}, None),
        (
            {
                "building": "house",
                "building:levels": "0",
                "roof:levels": "1",
                "building:levels:underground": "1",
            },
            None,
        ),
        ({"building": "yes", "demolished": "no"}, None),
    ],
)
def test_which_buildings_stand(tmp_path, tags, why):
    assert why_absent(tags) == why
    osm = OsmWriter()
    osm.box(0, 0, 10, 10, building="yes")
    osm.box(40, 0, 10, 10, **{k.replace(":", "__"): v for k, v in tags.items()})
    city, found = import_osm(osm.write(tmp_path / "city.osm"))
    assert len(found) == (1 if why else 2)
    kinds = {kind: number for kind, number, _ in city.faults.rows()}
    expected = {f"{why} building, left out": 1} if why else {}
    assert kinds == expected
