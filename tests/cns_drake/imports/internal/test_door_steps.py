"""Doors and the floors behind them stand a step above the paving."""

from helpers.small_osm import OsmWriter
import numpy as np
import pytest

from cns_drake.city import UpperSides, part_triangles, turned_up
from cns_drake.imports import ImportOptions, import_openstreetmap
from cns_drake.imports.dressing.dressed_buildings import dress_buildings
from cns_drake.imports.dressing.dressed_city import dress_city
from cns_drake.imports.drives.steerable_drives import WaypointRoute
from cns_drake.imports.ground import ground_of
from cns_drake.imports.staged_city import stage_city


@pytest.fixture
def shops(tmp_path):
    """Shops whose walls stand 1.5 m behind the sidewalk of a street."""
    osm = OsmWriter()
    osm.way([(-90, 0), (90, 0)], highway="residential", sidewalk="both")
    for k in range(4):
        osm.box(-80 + 40 * k, 7, 30, 12, building="retail", height="8")
    city = import_openstreetmap(osm.write(tmp_path / "a.osm"), None, True)
    line = city.streets[0].line
    x = np.linspace(line[0, 0], line[-1, 0], 81)
    path = np.column_stack([x, np.full(81, line[0, 1])])
    return city, WaypointRoute(path, path)


def low_floors(structures):
    """Returns the upper sides (M, 3, 3) in walls, up to 0.35 m high."""
    found = [np.zeros((0, 3, 3))]
    for one in structures:
        for part in one.structure.model.parts:
            if part.name == "body":
                meshes = one.structure.model.meshes
                vertices, triangles = part_triangles(part, meshes)
                found.append(vertices[triangles])
    body = np.concatenate(found)
    a, b, c = np.moveaxis(body, 1, 0)
    looks_up = np.cross(b - a, c - a)[:, 2] > 1e-4
    return body[looks_up & (body[..., 2] < 0.35).all(axis=1)]


def test_floors_rise_with_the_paving(shops):
    city, drive = shops
    # Paving that rises along the street, across the heights of all doors.
    x = 100.0
    y = 40.0
    slope = 0.001
    ground = np.array(
        [[(-x, -y, 0.0), (x, -y, 0.0), (x, y, 0.0)],
         [(-x, -y, 0.0), (x, y, 0.0), (-x, y, 0.0)]]
    )  # fmt: skip
    ground[..., 2] = 0.1 + slope * ground[..., 0]
    for paving, least in ((ground, 0.03), (ground[:0], -1.0)):
        result = dress_buildings(
            city.objects, [drive], city.streets,
            ground_of(city.objects), 0, None, paving,
        )  # fmt: skip
        floors = low_floors(result.buildings.values()).reshape(-1, 3)
        above = floors[:, 2] - (0.1 + slope * floors[:, 0])
        assert len(floors) >= 24
        assert above.min() > least
        if len(paving):
            # A door is at most 5 m wide.
            assert above.max() < 0.04 + 5.0 * slope + 1e-3
        else:
            assert np.abs(above).min() < 0.03


def test_floors_lie_above_paved_gaps(shops):
    city, drive = shops
    staged = stage_city("a.osm", city, ImportOptions())
    ground = ground_of(staged.kept, True)
    result = dress_city(staged, city, [drive], ground, 0)
    walks = [one for one in result.city.kept if one.object_type == "Sidewalk"]
    assert any("gap" in one.structure.name for one in walks)
    sides = UpperSides(turned_up(np.concatenate([w.triangles for w in walks])))
    buildings = [
        one
        for one in result.city.kept
        if one.object_type.startswith("Building")
    ]
    floors = low_floors(buildings)
    front = floors.reshape(-1, 3)[:, :2] - [0.0, 0.1]
    beside = sides.heights(front)
    height = floors.reshape(-1, 3)[:, 2]
    assert np.isfinite(beside).sum() >= 12
    np.testing.assert_allclose(
        (height - beside)[np.isfinite(beside)], 0.04, atol=1e-3
    )
