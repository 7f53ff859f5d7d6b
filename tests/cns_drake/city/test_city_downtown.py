"""The heights of Downtown, its monument, and its districts."""

from functools import cache, partial

from helpers.drives import shipped_drive
from helpers.internal.shipped_cities import (
    ground_triangles,
    network_of,
    structures_of,
)
import numpy as np
import pytest
import shapely

from cns_drake.city import part_mesh

pytestmark = [pytest.mark.slow, pytest.mark.night]

RAMPS = (
    "north_street_ramp",
    "ramp_north_west",
    "ramp_north_east",
    "ramp_south_west",
    "ramp_south_east",
)

network = partial(network_of, "downtown")
structures = partial(structures_of, "downtown")
triangles_of = partial(ground_triangles, "downtown")


def standing(kind):
    return [s for s in structures().values() if s.semantic_class == kind]


class Surface:
    """Finds the heights of the upper sides of some ground."""

    def __init__(self, names):
        corners = np.concatenate([triangles_of(name) for name in names])
        u, v = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
        self._corners = corners[
            np.abs(u[:, 0] * v[:, 1] - u[:, 1] * v[:, 0]) > 1e-6
        ]
        self._tree = shapely.STRtree(shapely.polygons(self._corners[:, :, :2]))

    def heights(self, xy):
        """Returns the (N,) greatest heights at (N, 2) points [m]."""
        xy = np.asarray(xy, dtype=float)
        point, triangle = self._tree.query(
            shapely.points(xy), predicate="dwithin", distance=1e-3
        )
        a, b, c = np.moveaxis(self._corners[triangle], 1, 0)
        edges = np.stack([b - a, c - a], axis=2)
        uv = np.linalg.solve(edges[:, :2], (xy[point] - a[:, :2])[..., None])
        z = a[:, 2] + (edges[:, 2:] @ uv)[:, 0, 0]
        highest = np.full(len(xy), -np.inf)
        np.maximum.at(highest, point, z)
        return highest


@cache
def ground():
    return Surface(
        [
            name
            for name, s in structures().items()
            if "ground" in s.tags and name != "markings"
        ]
    )


@pytest.mark.parametrize("number", ["01", "02", "03", "04"])
def test_the_carriageway_carries_the_vehicle(number):
    trajectory = shipped_drive(f"downtown_{number}")[-1]
    p = trajectory.positions(np.arange(0.0, trajectory.duration, 0.2))
    z = Surface(["carriageway"]).heights(p[:, :2])
    off = np.abs(p[:, 2] - z)
    # The path rounds off the bends at the ends of ramps a little.
    assert off.max() < 0.08
    assert np.quantile(off, 0.98) < 0.02


@pytest.mark.parametrize("name", RAMPS)
def test_paint_lies_on_the_ramps(name):
    road = network().roads[name]
    structure = structures()["markings"]
    part = next(p for p in structure.model.parts if p.name == name)
    mesh = part_mesh(part, structure.model.meshes)
    p, triangles = mesh.vertices, mesh.triangles()
    middle = p[triangles].mean(axis=1)
    assert np.ptp(middle[:, 2]) > 6.0
    gap = middle[:, 2] - Surface(["carriageway"]).heights(middle[:, :2])
    # The paint is below the ramp only where the ramp bends most sharply.
    assert np.mean(gap > 0) > 0.98
    assert np.abs(gap).max() < 0.02
    assert road.length > 40


def test_no_ground_hangs_over_the_carriageway():
    lanes = network().areas.lane_area
    x0, y0, x1, y1 = lanes.bounds
    rng = np.random.default_rng(4)
    p = rng.uniform((x0, y0), (x1, y1), (12000, 2))
    p = p[shapely.contains_xy(lanes, *p.T)]
    assert len(p) > 1500
    np.testing.assert_allclose(
        ground().heights(p), Surface(["carriageway"]).heights(p), atol=1e-9
    )


def test_buildings_stand_on_level_ground():
    buildings = standing("building")
    sunk = []
    for building in buildings:
        rim = building.footprint_W.exterior.buffer(0.25).exterior
        p = shapely.get_coordinates(shapely.segmentize(rim, 1.0))
        beside = ~shapely.contains_xy(network().areas.sidewalks, *p.T)
        z = ground().heights(p[beside])
        # Some buildings stand at the city's rim.
        off = z[np.isfinite(z)] - building.xyz[2]
        sunk.append(np.abs(off).max())
    # Where houses stand wall to wall on a slope, the ground at the joint is
    # that of one of them; foundations reach 0.5 m deep.
    assert np.max(sunk) < 0.45
    assert np.quantile(sunk, 0.95) < 0.05
    floors = np.array([building.xyz[2] for building in buildings])
    # Some buildings are on the plateau, some on the slope, most at its foot.
    assert (floors > 8.0).sum() >= 12
    assert (floors < 1.0).sum() >= 100


def test_small_things_stand_on_the_ground():
    things = [
        s
        for s in structures().values()
        if "ground" not in s.tags and s.semantic_class != "building"
    ]
    p = np.array([s.xyz for s in things])
    gap = p[:, 2] - ground().heights(p[:, :2])
    assert np.abs(gap).max() < 0.5
    assert np.quantile(np.abs(gap), 0.97) < 0.25
    assert (p[:, 2] > 7.9).sum() > 60


def test_the_monument_stands_in_the_roundabout():
    obelisk = structures()["obelisk_001"]
    assert np.hypot(*obelisk.xyz[:2]) < 1.5
    top = max(
        part_mesh(part, obelisk.model.meshes).vertices[:, 2].max()
        for part in obelisk.model.parts
    )
    assert 19 < top < 23
    fountains = [
        s for s in structures().values() if s.name.startswith("fountain")
    ]
    near = [s for s in fountains if np.hypot(*s.xyz[:2]) < 12]
    assert len(near) == 4
