"""What OpenStreetMap's tags say about buildings: heights, roofs, years."""

from helpers.imported_cities import bounds, import_osm, volume
from helpers.small_osm import OsmWriter
import numpy as np
import pytest
import shapely

from worlds.imports import ImportOptions, import_city

L_SHAPE = [(0, 0), (30, 0), (30, 8), (8, 8), (8, 30), (0, 30)]
SHORT_L = [(0, 0), (12, 0), (12, 10), (10, 10), (10, 12), (0, 12)]
DART = [(0, 0), (10, 4), (20, 0), (10, 20)]


def building(tmp_path, outline=((0, 0), (12, 0), (12, 6), (0, 6)), **tags):
    """Returns a building with tags, and the city with what was counted."""
    osm = OsmWriter()
    osm.box(-60, 0, 10, 10, building="yes")
    number = osm.way(outline, closed=True, building="yes", **tags)
    city, found = import_osm(osm.write(tmp_path / "city.osm"))
    return found[f"building_w{number}"], city.faults.rows()


def height(tmp_path, **tags):
    one, faults = building(tmp_path, **tags)
    low, high = bounds(one)
    return high[2] - low[2], faults


@pytest.fixture(scope="module")
def usual(tmp_path_factory):
    """The height of a building that says nothing about it [m]."""
    return height(tmp_path_factory.mktemp("usual"))[0]


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
    ],
)
def test_lengths(tmp_path, usual, text, metres):
    top, faults = height(tmp_path, height=text.replace('"', "&quot;"))
    assert top == pytest.approx(metres or usual, abs=1e-4)
    assert len(faults) == (metres is None)


@pytest.mark.parametrize(
    ("text", "number"),
    [
        ("3", 3.0), ("2.5", 2.5), ("2,5", 2.5), ("3;4", 4.0), ("1; 2;3", 3.0),
        ("3-4", 4.0), ("3 – 5", 5.0), ("3 to 4", 4.0), ("~4", 4.0),
        ("many", None), ("-2", None), ("3 m", None), ("3;x", None),
    ],
)  # fmt: skip
def test_levels(tmp_path, usual, text, number):
    """A level is 3 m high."""
    top, faults = height(tmp_path, building__levels=text)
    assert top == pytest.approx(3.0 * number if number else usual)
    assert len(faults) == (number is None)


@pytest.mark.parametrize(
    "tags",
    [
        {"height": "0"},
        {"height": "851"},
        {"building__levels": "1000"},
        {"building__levels": "0"},
        {"min_height": "1e9"},
        {"roof__height": "x"},
        {"roof__direction": "x"},
    ],
)
def test_heights_that_cannot_be_are_the_usual_and_counted(
    tmp_path, usual, tags
):
    top, faults = height(tmp_path, **tags)
    assert top == pytest.approx(usual)
    ((kind, number, _),) = faults
    (key,) = tags
    expected = f"{key.replace('__', ':')} unreadable or implausible"
    assert kind.startswith(expected)
    assert number == 1


@pytest.mark.parametrize(
    ("tags", "expected"),
    [
        ({"building__levels": "2", "roof__shape": "gabled"}, 9.0),
        ({"building__levels": "2", "roof__levels": "1"}, 9.0),
        ({"building__levels": "0", "roof__levels": "1"}, 3.0),
        ({"height": "9", "min_height": "4"}, 5.0),
    ],
)
def test_levels_in_the_roof_are_above_the_others(tmp_path, tags, expected):
    assert height(tmp_path, **tags)[0] == pytest.approx(expected)


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
    osm = OsmWriter()
    osm.box(0, 0, 10, 10, building="yes")
    osm.box(40, 0, 10, 10, **{k.replace(":", "__"): v for k, v in tags.items()})
    city, found = import_osm(osm.write(tmp_path / "city.osm"))
    assert len(found) == (1 if why else 2)
    kinds = {kind: number for kind, number, _ in city.faults.rows()}
    expected = {f"{why} building, left out": 1} if why else {}
    assert kinds == expected


@pytest.mark.parametrize(
    ("text", "year"),
    [
        ("1890", 1890),
        ("79", 79),
        ("0079", 79),
        ("1890-05", 1890),
        ("1890-05-31", 1890),
        ("2010-06-09T12:00:00Z", 2010),
        ("~1890", 1890),
        ("circa 1890", 1890),
        ("before 1890", 1890),
        ("1890..1894", 1894),
        ("1890s", 1895),
        ("late 1890s", 1898),
        ("C19", 1850),
        ("early C19", 1820),
        ("221 BC", -220),
        ("-0220-09-10", -220),
        ("jd:2455511", 2010),
        # Not documented: a number is not searched in them.
        ("1890-1894", None),
        ("1890/1894", None),
        ("189X", None),
        ("1890?", None),
        ("1890-13", None),
        ("1890-05-32", None),
        ("built 1890", None),
        ("house 1890", None),
        ("18900", None),
        ("1890 or 1895", None),
    ],
)
@pytest.mark.parametrize("key", ["start_date", "end_date"])
def test_dates_match_as_a_whole(tmp_path, key, text, year):
    one, faults = building(tmp_path, **{key: text})
    assert (one.year if key == "start_date" else one.until) == year
    kinds = [kind for kind, *_ in faults]
    unread = f"date in {key} that is not understood"
    assert (unread in kinds) == (year is None)


@pytest.mark.parametrize(
    ("roof", "part"),
    [
        ("flat", 1.0),
        ("gabled", 0.5),
        ("pyramidal", 1 / 3),
        ("hipped", 1 / 3),
        ("skillion", 0.5),
        # Sum of dz (s s + s t + t t) / 3 over the frusta between their rings.
        ("dome", 0.655309),
        ("onion", 0.444080),
        # Between 12 m x 6 m and, 1.5 m from each side, 9 m x 3 m.
        ("mansard", (72 + 27 + 4 * 10.5 * 4.5) / 6 / 72),
    ],
)
@pytest.mark.parametrize("turned", [0, 1])
def test_roofs_hold_their_volume(tmp_path, roof, part, turned):
    corners = [(1, 1), (13, 1), (13, 7), (1, 7)]
    outline = corners[turned:] + corners[:turned]
    one, faults = building(
        tmp_path, outline, height="9", roof__height="3", roof__shape=roof
    )
    if roof == "hipped":  # A ridge of 6 m between two half pyramids.
        part = (6.0 * 0.5 + 6.0 / 3.0) / 12.0
    expected = 72.0 * (6.0 + 3.0 * part)
    assert volume(one.triangles) == pytest.approx(expected, rel=1e-3)
    assert faults == []


@pytest.mark.parametrize(
    ("tags", "slope"),
    [
        # Of a house of 12 m along x and 6 m along y.
        ({"roof__shape": "skillion"}, (0, -1)),
        ({"roof__shape": "skillion", "roof__direction": "N"}, (0, 1)),
        ({"roof__shape": "skillion", "roof__direction": "280"}, (-1, 0)),
        ({"roof__shape": "gabled"}, (0, -1)),
        ({"roof__shape": "gabled", "roof__orientation": "along"}, (0, -1)),
        ({"roof__shape": "gabled", "roof__orientation": "across"}, (1, 0)),
        ({"roof__shape": "gabled", "roof__direction": "ene"}, (1, 0)),
    ],
)
def test_a_roof_faces_where_its_tags_say(tmp_path, tags, slope):
    corners = [(1, 1), (13, 1), (13, 7), (1, 7)]
    one, faults = building(
        tmp_path, corners, height="9", roof__height="3", **tags
    )
    a, b, c = np.moveaxis(one.triangles, 1, 0)
    normals = np.cross(b - a, c - a)
    slopes = normals[normals[:, 2] > 1e-6]
    assert (slopes @ [*slope, 0] > 1.0).any()
    if tags["roof__shape"] == "skillion":
        assert (slopes @ [*slope, 0] > 1.0).all()
    assert np.abs(slopes @ [*slope[::-1], 0]).max() < 1e-6
    assert faults == []


def test_a_house_has_walls_below_a_roof_of_unknown_height(tmp_path):
    corners = [(0, 0), (12, 0), (12, 8), (0, 8)]
    one, _ = building(tmp_path, corners, height="3", roof__shape="gabled")
    assert volume(one.triangles) == pytest.approx(96 * 2.25, rel=1e-3)


@pytest.mark.parametrize(
    ("tags", "height"),
    [
        ({"man_made": "chimney"}, 40.0),
        ({"man_made": "silo", "height": "22"}, 22.0),
        ({"man_made": "tower", "building": "yes"}, 9.0),
        ({"man_made": "storage_tank", "roof__shape": "dome"}, 15.0),
    ],
)
def test_towers_and_tanks_are_built(tmp_path, tags, height):
    city = OsmWriter()
    ring = [
        (4 * np.cos(a), 4 * np.sin(a))
        for a in np.linspace(0, 2 * np.pi, 16, endpoint=False)
    ]
    city.way(ring, closed=True, **tags)
    _, found = import_osm(city.write(tmp_path / "a.osm"))
    (one,) = (x for x in found.values() if x.object_type == "Building")
    assert np.ptp(one.triangles[..., 2]) == pytest.approx(height, abs=0.01)


@pytest.mark.parametrize(
    ("tags", "size"),
    [
        ({"man_made": "chimney"}, (4, 4, 40)),
        ({"man_made": "mast", "height": "31.5"}, (1, 1, 31.5)),
        ({"man_made": "water_tower", "diameter": "12"}, (12, 12, 30)),
    ],
)
def test_towers_at_nodes_are_built_unless_they_stand_on_houses(
    tmp_path, tags, size
):
    city = OsmWriter()
    city.box(20, 0, 30, 30, building="yes")
    alone, on_roof = city.node(0, 0, **tags), city.node(35, 15, **tags)
    read, found = import_osm(city.write(tmp_path / "a.osm"))
    corners = found[f"building_n{alone}"].triangles.reshape(-1, 3)
    assert np.ptp(corners, axis=0) == pytest.approx(size, abs=0.02)
    assert f"building_n{on_roof}" not in found
    kind = f"man_made={tags['man_made']}, left out"
    assert (kind, 1, f"n{on_roof}") in read.faults.rows()


def test_what_is_flattened_is_told_by_its_share_of_the_volume(tmp_path):
    city = OsmWriter()
    house = {"building": "yes", "height": "9", "roof__height": "2"}
    city.box(40, 0, 10, 10, **house, roof__shape="gabled")
    name = city.way(L_SHAPE, closed=True, **house, roof__shape="gabled")
    path = city.write(tmp_path / "a.osm")
    report = import_city(path, tmp_path / "map", ImportOptions(dressed=False))
    flat = 9 * shapely.Polygon(L_SHAPE).area
    (share,) = report.shares.values()
    assert share.part == pytest.approx(flat / (flat + 100 * 8), rel=1e-3)
    assert (
        f"roof of shape gabled, made flat: 1, {100 * share.part:.2g} % of the"
        f" volume of all buildings, such as w{name}\n"
    ) in (tmp_path / "map" / "import.txt").read_text()


@pytest.mark.parametrize(
    ("corners", "roof", "is_made"),
    [
        (L_SHAPE, "pyramidal", False),
        (SHORT_L, "pyramidal", True),
        (DART, "gabled", True),
        (DART, "pyramidal", True),
    ],
)
def test_no_roof_leaves_its_outline(tmp_path, corners, roof, is_made):
    one, faults = building(
        tmp_path, corners, height="9", roof__height="3", roof__shape=roof
    )
    normals = np.cross(
        one.triangles[:, 1] - one.triangles[:, 0],
        one.triangles[:, 2] - one.triangles[:, 0],
    )
    upper = one.triangles[normals[:, 2] > 1e-6]
    x, y = np.array([*corners, corners[0]], float).T
    outline = abs((x[:-1] * y[1:] - x[1:] * y[:-1]).sum()) / 2
    assert normals[normals[:, 2] > 1e-6][:, 2].sum() / 2 == pytest.approx(
        outline, rel=1e-3
    )
    assert np.ptp(upper[..., 2]) == pytest.approx(3.0 if is_made else 0.0)
    kinds = [kind for kind, *_ in faults]
    assert kinds == ([] if is_made else [f"roof of shape {roof}, made flat"])
