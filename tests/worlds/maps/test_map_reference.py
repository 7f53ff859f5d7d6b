"""Longitudes and latitudes on imported maps."""

import os

import numpy as np
import pyproj
import pytest
import yaml

from evaluation.base import InputError
from worlds.maps import MapFolder, metres_on_map, projected_system

# Longitudes and latitudes in Delft [deg].
DEGREES = np.array([(4.36, 52.01), (4.37, 52.012), (4.358, 52.0)])


def folder_of(path, **facts):
    (path / "import.yaml").write_text(
        yaml.safe_dump({"source": "a.json", "lod": "highest", **facts})
    )
    return MapFolder(path)


@pytest.mark.parametrize(
    ("system", "metres"),
    [
        ("EPSG:28992", 1.0),
        ("urn:ogc:def:crs:EPSG::7415", 1.0),
        # North first.
        ("EPSG:3034", 1.0),
        # In feet, far away from where it is meant for.
        ("EPSG:2263", 1200.0 / 3937.0),
        ("+proj=tmerc +lat_0=52 +lon_0=4.3 +datum=WGS84", 1.0),
    ],
)
def test_places_in_a_reference_system(tmp_path, system, metres):
    origin = [84_000.0, 446_000.0, -2.0]
    folder = folder_of(tmp_path, reference_system=system, origin=origin)
    found = metres_on_map(folder)(DEGREES)
    known = pyproj.Proj(pyproj.CRS(system).to_2d())
    x, y = known(*DEGREES.T)
    expected = metres * np.column_stack([x, y]) - origin[:2]
    # `Proj` knows projections alone, no shift between systems.
    np.testing.assert_allclose(found, expected, atol=150.0)
    steps = np.diff(found, axis=0), np.diff(expected, axis=0)
    np.testing.assert_allclose(*steps, rtol=1e-3, atol=0.05)


def test_places_of_openstreetmap(tmp_path):
    """As far apart as along the Earth, east and north."""
    facts = {"reference_system": "WGS 84", "origin": [52.01, 4.36]}
    found = metres_on_map(folder_of(tmp_path, **facts))(DEGREES)
    np.testing.assert_allclose(found[0], 0.0, atol=1e-9)
    geod = pyproj.Geod(ellps="WGS84")
    for (x, y), (longitude, latitude) in zip(found, DEGREES, strict=True):
        azimuth, _, distance = geod.inv(4.36, 52.01, longitude, latitude)
        assert np.hypot(x, y) == pytest.approx(distance, abs=0.2)
        if distance > 1.0:
            heading = np.degrees(np.arctan2(x, y))
            assert heading == pytest.approx(azimuth, abs=0.05)


@pytest.mark.parametrize(
    ("facts", "expected"),
    [
        ({"reference_system": "unknown"}, "'unknown' is none that PROJ knows"),
        ({"reference_system": "EPSG:4326"}, "its axes are not lengths"),
        ({"reference_system": "EPSG:5513"}, "its axes are not lengths"),
        ({"reference_system": "WGS 84", "origin": [1.0]}, "origin"),
        ({}, "reference_system"),
    ],
)
def test_maps_whose_place_is_unknown(tmp_path, facts, expected):
    folder = folder_of(tmp_path, **{"origin": [0.0, 0.0, 0.0], **facts})
    with pytest.raises(InputError, match=expected) as error:
        metres_on_map(folder)
    assert str(error.value).startswith(str(tmp_path / "import.yaml"))
    (tmp_path / "import.yaml").unlink()
    with pytest.raises(InputError, match=r"no import\.yaml tells"):
        metres_on_map(folder)


UTM = pyproj.CRS.from_epsg(25833)
FORMS = [
    "EPSG:25833", "epsg:25833", "25833", "EPSG:25833+7837",
    "https://www.opengis.net/def/crs/EPSG/0/25833",
    "http://www.opengis.net/def/crs/EPSG/0/25833",
    "urn:ogc:def:crs:EPSG::25833",
    "urn:ogc:def:crs,crs:EPSG::25833,crs:EPSG::7837",
    *(UTM.to_wkt(one) for one in ("WKT1_GDAL", "WKT1_ESRI", "WKT2_2019")),
    pyproj.CRS.from_user_input("EPSG:25833+7837").to_wkt("WKT1_GDAL"),
    UTM.to_wkt(pretty=True), "+proj=utm +zone=33 +ellps=GRS80 +type=crs",
    "+proj=utm +zone=33 +ellps=GRS80 +geoidgrids=./pipe +units=m +type=crs",
]  # fmt: skip


@pytest.mark.parametrize("name", FORMS)
def test_forms_of_a_reference_system(name):
    system = projected_system(name)
    (horizontal, *_) = system.sub_crs_list or [system]
    place = pyproj.Transformer.from_crs(horizontal, "EPSG:25833")
    assert place.transform(4e5, 5.8e6) == pytest.approx((4e5, 5.8e6), abs=1e-3)


@pytest.mark.parametrize(
    "name",
    [
        "+init=./pipe:x", "+init=/dev/stdin:x", "init=epsg:25833", "./pipe:x",
        "+proj=utm +zone=33 +nadgrids=./pipe +type=crs",
        "+proj=utm +zone=33 +ellps=./pipe", "+proj=pipeline +step +init=pipe:x",
        "http://localhost:8000/crs", "file:///dev/stdin", "/dev/stdin", "pipe",
        "https://www.opengis.net/def/crs/../../@/dev/stdin", "{}", "", "\0",
        UTM.to_json(), "+R=1+R" * 2000 + "!",
        'PROJCS["x",EXTENSION["PROJ4","+proj=utm +nadgrids=./pipe"]]',
        'BOUNDCRS[ABRIDGEDTRANSFORMATION["x",PARAMETERFILE["f","./pipe"]]]',
        f"PROJCRS[{'[' * 20_000}", "PROJCRS[" + "[" * 9_000,
    ],
)  # fmt: skip
def test_other_forms_do_not_reach_proj(name, tmp_path, monkeypatch):
    """PROJ would wait for the pipe."""
    monkeypatch.chdir(tmp_path)
    os.mkfifo("pipe")
    with pytest.raises(ValueError, match=r"not a code|not known"):
        projected_system(name)
