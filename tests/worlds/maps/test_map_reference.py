"""Longitudes and latitudes on imported maps."""

import numpy as np
import pyproj
import pytest
import yaml

from evaluation.base import InputError
from worlds.maps import (
    MapFolder,
    metres_on_map,
)

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
