"""The order and the units of axes in CityJSON files."""

import json
import re

from helpers.imported_cities import read_city
from helpers.small_cityjson import CityWriter
import numpy as np
import pytest

from evaluation.base import InputError

FOOT = 1200 / 3937  # The survey foot of the United States.
NORTH_FIRST = np.array([[0.0, 1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
TOKYO = "EPSG:6677"
RIGA = "EPSG:3059"
MADRID = "EPSG:25830"


def read(path):
    """Returns a city, and name -> (N, 3) corners in its reference system."""
    city = read_city(path)
    return city, {
        one.structure.name: one.triangles.reshape(-1, 3) + city.origin
        for one in city.objects
    }


def bounds(found):
    corners = np.concatenate(list(found.values()))
    return corners.min(axis=0), corners.max(axis=0)


@pytest.mark.parametrize(
    ("system", "place", "matrix"),
    [
        # The city of New York, heights too in feet.
        ("EPSG:2263", (980000, 190000, 40), FOOT * np.eye(3)),
        ("EPSG:2263+5703", (980000, 190000, 40), np.diag([FOOT, FOOT, 1.0])),
        ("EPSG:2263+6360", (980000, 190000, 40), FOOT * np.eye(3)),
        # Wellington: northing, easting; and as most programs write it.
        ("EPSG:2193", (5427000, 1749000, 10), NORTH_FIRST),
        ("EPSG:2193", (1749000, 5427000, 10), np.eye(3)),
        # Prague: southing, westing.
        (
            "urn:ogc:def:crs:EPSG::5513",
            (1043000, 743000, 10),
            np.array([[0, -1, 0], [-1, 0, 0], [0, 0, 1]]),
        ),
        (
            "https://www.opengis.net/def/crs/EPSG/0/7415",
            (85e3, 446e3, 3),
            np.eye(3),
        ),
        # A depth below the sea of the Netherlands.
        ("EPSG:28992+5706", (85e3, 446e3, 3), np.diag([1.0, 1.0, -1.0])),
    ],
)
def test_coordinates_are_metres_east_north_up(tmp_path, system, place, matrix):
    city = CityWriter(origin=place)
    city.metadata = {"referenceSystem": system}
    city.box("a", 10.0, -5.0, (4.0, 3.0, 2.0), z=0.5)
    imported, found = read(city.write(tmp_path / "city.json"))
    expected = np.array(
        [
            np.add(place, (10 + i, -5 + j, 0.5 + k))
            for i in (0, 4) for j in (0, 3) for k in (0, 2)
        ]
    ) @ np.array(matrix).T  # fmt: skip
    np.testing.assert_allclose(
        np.unique(np.round(found["a"], 6), axis=0),
        np.unique(np.round(expected, 6), axis=0),
        atol=2e-6,
    )
    as_used = "coordinates with east first" in str(imported.faults.rows())
    assert as_used == (place == (1749000, 5427000, 10))


def test_templates_have_the_unit_of_the_system(tmp_path):
    city = CityWriter(origin=(980000, 190000, 40))
    city.metadata = {"referenceSystem": "EPSG:2263"}
    shape = CityWriter()
    faces = shape.box_faces(0, 0, 0, (1, 1, 1))
    city.templates = {
        "templates": [{"type": "MultiSurface", "lod": 2, "boundaries": faces}],
        "vertices-templates": [[v / 1000 for v in p] for p in shape.vertices],
    }
    instance = {
        "type": "GeometryInstance",
        "template": 0,
        "boundaries": [city.vertex(100, 0, 0)],
        "transformationMatrix": np.diag([2.0, 2.0, 2.0, 1.0]).ravel().tolist(),
    }
    city.add("tree", "SolitaryVegetationObject", instance)
    _, found = read(city.write(tmp_path / "city.json"))
    low, high = bounds(found)
    np.testing.assert_allclose(low, np.array([980100, 190000, 40]) * FOOT)
    np.testing.assert_allclose(high - low, 2.0 * FOOT)


def test_degrees_without_a_word(tmp_path):
    city = CityWriter(origin=(4.3, 52.0, 0.0))
    city.metadata = {}
    city.box("a", 0.001, 0.001, (0.01, 0.01, 30.0))
    with pytest.raises(InputError, match="look like degrees"):
        read(city.write(tmp_path / "city.json"))


def test_coordinates_beyond_the_area_of_their_system_are_counted(tmp_path):
    """The file puts a Dutch town into UTM zone 33, east of the Netherlands."""
    for code, number in (("7415", 0), ("32633", 1)):
        city = CityWriter()
        city.metadata["referenceSystem"] = (
            f"https://www.opengis.net/def/crs/EPSG/0/{code}"
        )
        city.box("house", 0.0, 0.0, (10.0, 10.0, 5.0))
        found, _ = read(city.write(tmp_path / f"{code}.json"))
        counts = {kind: count for kind, count, _ in found.faults.rows()}
        kind = "coordinates beyond the area of their reference system"
        assert counts.get(kind, 0) == number


# Berlin, Munich and Warsaw, as most programs write them: east first.
@pytest.mark.parametrize(
    ("system", "place", "is_north_first"),
    [
        ("EPSG:25833+7837", (391e3, 5820e3), False),
        ("EPSG:31468+5783", (4467e3, 5333e3), True),
        (
            "urn:ogc:def:crs,crs:EPSG::31468,crs:EPSG::5783",
            (4467e3, 5333e3),
            True,
        ),
        ("EPSG:2180+9651", (637e3, 487e3), True),
        # A system without an area; the faces show the order.
        ("+proj=utm +zone=33 +axis=neu +type=crs", (391e3, 5820e3), True),
    ],
)
def test_composed_systems_have_an_order_of_axes(
    tmp_path, system, place, is_north_first
):
    city = CityWriter(origin=(*place, 30.0))
    city.metadata = {"referenceSystem": system}
    city.box("house", 0, 0, (6, 4, 3))
    imported, found = read(city.write(tmp_path / "city.json"))
    low, high = bounds(found)
    np.testing.assert_allclose(low, [*place, 30], atol=1e-6)
    np.testing.assert_allclose(high - low, [6, 4, 3], atol=1e-6)
    rows = str(imported.faults.rows())
    assert ("read as east first" in rows) == is_north_first
    assert "beyond the area" not in rows


@pytest.mark.parametrize(
    ("latitude", "is_refused"), [(4.0, False), (8.0, True), (52.5, True)]
)
def test_a_projection_that_stretches_a_city_is_refused(
    tmp_path, latitude, is_refused
):
    """Web Mercator's lengths grow by 1 / cos(latitude), on a sphere."""
    phi = np.radians(latitude)
    north = 6378137.0 * np.log(np.tan(np.pi / 4 + phi / 2))
    city = CityWriter(origin=(1490000.0, float(north), 0.0))
    city.metadata = {"referenceSystem": "EPSG:3857"}
    city.box("house", 0, 0, (6, 4, 3))
    path = city.write(tmp_path / "city.json")
    if not is_refused:
        read(path)
        return
    with pytest.raises(InputError, match="referenceSystem: in EPSG") as info:
        read(path)
    (factor,) = re.findall(r"is (\S+) m long", str(info.value))
    assert float(factor) == pytest.approx(1 / np.cos(phi), rel=8e-3)


@pytest.mark.parametrize(
    ("system", "place", "is_east_first"),
    [
        # Both orders lie in the area; the first one is that of the system.
        (TOKYO, (-35000.0, -7000.0), False),
        (TOKYO, (-7000.0, -35000.0), True),
        (RIGA, (312000.0, 507000.0), False),
        (RIGA, (507000.0, 312000.0), True),
        # East first by definition, and written north first.
        (MADRID, (440000.0, 4474000.0), True),
        (MADRID, (4474000.0, 440000.0), False),
    ],
)
@pytest.mark.parametrize("kind", ["Solid", "MultiSurface"])
def test_no_order_of_axes_mirrors_a_city(
    tmp_path, system, place, is_east_first, kind
):
    """A house of 6 m by 4 m, and a mark 30 m east and 15 m north of it."""
    city = CityWriter(origin=(*place, 0.0))
    city.metadata = {"referenceSystem": system}
    vertex = city.vertex
    if not is_east_first:
        city.vertex = lambda x, y, z: vertex(y, x, z)
    city.box("house", 0, 0, (6, 4, 3))
    city.box("mark", 30, 15, (1, 1, 1))
    for one in city.objects.values():
        (geometry,) = one["geometry"]
        if kind == "MultiSurface":
            (geometry["boundaries"],) = geometry["boundaries"]
            (values,) = geometry["semantics"]["values"]
            geometry["semantics"]["values"] = values
        geometry["type"] = kind
    imported, corners = read(city.write(tmp_path / "city.json"))
    house, mark = corners["house"], corners["mark"]
    np.testing.assert_allclose(np.ptp(house, axis=0), [6, 4, 3], atol=1e-6)
    away = mark.min(axis=0) - house.min(axis=0)
    np.testing.assert_allclose(away, [30, 15, 0], atol=1e-6)
    rows = str(imported.faults.rows())
    as_defined = is_east_first == (system == MADRID)
    assert ("; read as" in rows) == (not as_defined)
    assert "beyond the area" not in rows


def test_an_order_that_no_face_shows_is_named(tmp_path):
    city = CityWriter(origin=(-35000.0, -7000.0, 0.0))
    city.metadata = {"referenceSystem": TOKYO}
    faces = city.box_faces(0, 0, 0, (6, 4, 3))
    city.add(
        "house",
        "Building",
        {"type": "MultiSurface", "lod": "2", "boundaries": faces},
    )
    imported, _ = read(city.write(tmp_path / "city.json"))
    kinds = {kind for kind, _, _ in imported.faults.rows()}
    assert "order of axes that no face shows, taken as defined" in kinds


def test_a_file_without_a_system_says_so(tmp_path):
    city = CityWriter()
    city.metadata = {}
    for k in range(2):
        city.box(f"a{k}", 9 * k, 0, (2, 2, 2))
    imported, _ = read(city.write(tmp_path / "city.json"))
    kind = "no reference system; metres east, north and up assumed"
    assert [row[0] for row in imported.faults.rows()] == [kind]
    vertex = city.vertex
    city.vertex = lambda x, y, z: vertex(y, x, z)
    for k in range(2):
        city.box(f"a{k}", 9 * k, 0, (2, 2, 2))
    imported, _ = read(city.write(tmp_path / "city.json"))
    assert any("may be mirrored" in row[0] for row in imported.faults.rows())


def test_lines_of_two_systems_are_refused(tmp_path):
    lines = []
    for system in ("EPSG:7415", "EPSG:28992"):
        city = CityWriter()
        city.metadata = {"referenceSystem": system}
        city.box("a", 0, 0, (2, 2, 2))
        lines.append(json.dumps(city.document()))
    path = tmp_path / "city.jsonl"
    path.write_text("\n".join(lines))
    with pytest.raises(InputError, match="line 2: metadata"):
        read(path)
    path.write_text("\n".join(lines[:1] * 2))
    imported, _ = read(path)
    kind = "object that is there twice, its last taken"
    assert imported.faults.rows() == [(kind, 1, "a")]
