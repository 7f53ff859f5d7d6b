"""A city that is moved, turned or written in another order is the same."""

import csv
import itertools
import re

from helpers.imported_cities import read_city
from helpers.small_cityjson import CityWriter
from helpers.small_opendrive import cubic, straight, write_roads
from helpers.small_osm import LAT, LON, METRES_PER_DEGREE, OsmWriter
import numpy as np
import pytest
from shapely import LineString, MultiPoint
from shapely.affinity import rotate
import yaml

from evaluation.base import InputError
from worlds.imports import ImportOptions, import_city

# Boxes: place, size, height of the foot.
BOXES = [
    (0, 0, 0, (12, 9, 8)),
    (40, 5, 0.4, (10, 10, 15)),
    (5, 60, -0.2, (20, 8, 6)),
    (70, 70, 0, (9, 9, 22)),
]


def rotation(angle_deg):
    turn = np.exp(1j * np.radians(angle_deg))
    return np.array([[turn.real, -turn.imag], [turn.imag, turn.real]])


def write(path, move=(0, 0, 0), turn_deg=0.0, order=1, scale=1.0):
    R = rotation(turn_deg)
    city = CityWriter(origin=(85000.0, 446000.0, 3.0))
    plain = city.vertex

    def vertex(x, y, z):
        x, y = R @ (x, y)
        return plain(*(scale * (np.array([x, y, z]) + move)))

    city.vertex = vertex
    for k in list(range(len(BOXES)))[::order]:
        x, y, z, size = BOXES[k]
        city.box(f"house_{k}", x, y, size, z)
    return city.write(path)


def corners(path, move=(0, 0, 0), turn_deg=0.0):
    """Returns name -> sorted corners, moved and turned back."""
    R = rotation(-turn_deg)
    city = read_city(path)
    found = {}
    for one in city.objects:
        p = one.triangles.reshape(-1, 3) + city.origin - [85000, 446000, 3]
        p = p - move
        p[:, :2] = p[:, :2] @ R.T
        found[one.structure.name] = np.unique(np.round(p, 2) + 0.0, axis=0)
    return found


@pytest.mark.parametrize(
    "change",
    [
        *({"move": (0, 0, z)} for z in (-300, -20, 500)),
        {"move": (10_000, 0, 0)},
        {"move": (0, -10_000, 0)},
        {"turn_deg": 37.0},
        {"order": -1},
    ],
    ids=str,
)
def test_a_city_that_is_moved_is_the_same(tmp_path, change):
    wanted = corners(write(tmp_path / "a.city.json"))
    moved = write(tmp_path / "b.city.json", **change)
    back = {k: v for k, v in change.items() if k != "order"}
    found = corners(moved, **back)
    assert found.keys() == wanted.keys()
    for name, points in wanted.items():
        np.testing.assert_allclose(found[name], points, atol=0.021)


def osm_corners(path, order=1, **change):
    """Returns name -> corners of what a file shows, moved and turned back."""
    osm = OsmWriter(**change)
    street = {"highway": "residential", "sidewalk": "both"}
    middle = [osm.node(x, 0) for x in (-150, -10, 120)]
    osm.way_of(middle, **street)
    osm.way_of([osm.node(-10, -90), middle[1], osm.node(-30, 110)], **street)
    osm.way([(50, -60), (60, 70)], highway="primary", bridge="yes")
    for k, shape in enumerate(["skillion", "gabled", "hipped", "mansard"]):
        tags = {"height": str(8 + k), "roof__shape": shape}
        osm.box(-120 + 60 * k, 20, 14, 11 + k, building="yes", **tags)
    osm.box(-80, -60, 40, 25, natural="water")
    osm.way([(-40, -40), (-25, -40), (-25, -70)], barrier="hedge")
    osm.node(90, -40, man_made="chimney", height="45", diameter="1")
    osm.node(-60, -10, natural="tree", height="7")
    osm.rows = osm.rows[::order]
    city = read_city(osm.write(path), dressed=True)
    R = rotation(-change.get("turn_deg", 0.0))
    found = {one.structure.name: one.triangles for one in city.objects}
    middle = found["road_w5"][:, :, :2].reshape(-1, 2) @ R.T
    for name, triangles in found.items():
        p = triangles.reshape(-1, 3).copy()
        p[:, :2] = p[:, :2] @ R.T - (middle.min(axis=0) + np.ptp(middle, 0) / 2)
        found[name] = p
    return found


@pytest.mark.parametrize(
    "change",
    [{"move": (10_000, 0)}, {"turn_deg": 217.0}, {"order": -1}],
    ids=str,
)
def test_streets_and_houses_that_are_moved_are_the_same(tmp_path, change):
    wanted = osm_corners(tmp_path / "a.osm")
    found = osm_corners(tmp_path / "b.osm", **change)
    assert found.keys() == wanted.keys()
    for name, points in wanted.items():
        hulls = [MultiPoint(p).convex_hull for p in (found[name], points)]
        # Corners of round things are 0.2 m apart.
        assert hulls[0].hausdorff_distance(hulls[1]) < 0.15, name
        for one in (np.min, np.max):
            assert abs(one(found[name][:, 2]) - one(points[:, 2])) < 0.01


def street_network(path, seed, order=1, size=(5, 4), **change):
    """A grid of streets, with random gaps and distances if there is a seed."""
    osm = OsmWriter(**change)
    rng = np.random.default_rng(seed)
    spread = 0.0 if seed is None else 20.0
    x, y = (
        90.0 * (np.arange(n) - (n - 1) / 2) + rng.uniform(-spread, spread, n)
        for n in size
    )
    across, up = map(range, size)
    node = {(k, m): osm.node(x[k], y[m]) for k in across for m in up}
    lines = [[(k, m) for m in up] for k in across]
    lines += [[(k, m) for k in across] for m in up]
    for line in lines:
        for ends in itertools.pairwise(line):
            if seed is None or rng.random() < 0.85:
                nodes = [node[end] for end in ends]
                osm.way_of(nodes, highway="residential", width="8")
    osm.box(x[0] + 20, y[0] + 20, 20, 15, building="yes")
    osm.rows = osm.rows[::order]
    return osm.write(path)


def proposed_drives(tmp_path, name, seed, **change):
    """Returns the lines of the drives, moved and turned back [m]."""
    source = street_network(tmp_path / f"{name}.osm", seed, **change)
    folder = tmp_path / name
    import_city(source, folder, ImportOptions(dressed=False))
    facts = yaml.safe_load((folder / "import.yaml").read_text())
    lat, lon = facts["origin"]
    R = rotation(-change.get("turn_deg", 0.0))
    origin = np.multiply([lon - LON, lat - LAT], METRES_PER_DEGREE)
    origin -= change.get("move", (0, 0))
    return [
        LineString(
            (np.loadtxt(table, delimiter=",", skiprows=1)[:, :2] + origin) @ R.T
        )
        for table in sorted(folder.glob("route_*.csv"))
    ]


@pytest.mark.slow
@pytest.mark.parametrize(
    ("seed", "size"), [(None, (5, 4)), (1, (5, 4)), (2, (5, 4)), (3, (9, 8))]
)
def test_streets_that_are_moved_have_the_same_drives(tmp_path, seed, size):
    wanted = proposed_drives(tmp_path, "plain", seed, size=size)
    assert len(wanted) == 2
    # A regular grid is the same when turned by 180 degrees, and so are drives.
    turns = (0, 180) if seed is None else (0,)
    for name, change in {
        "far": {"move": (10_000, 0)},
        "turned": {"turn_deg": 37.0},
        "reordered": {"order": -1},
    }.items():
        found = proposed_drives(tmp_path, name, seed, size=size, **change)
        apart = [
            max(
                rotate(a, turn, origin=(0, 0)).hausdorff_distance(b)
                for a, b in zip(wanted, found, strict=True)
            )
            for turn in turns
        ]
        assert min(apart) < 2.0, (name, apart)


@pytest.mark.night
@pytest.mark.slow
def test_roads_that_are_moved_have_the_same_town(tmp_path):
    def town(name, move, order):
        x, y, z = move
        up = cubic("elevation", 0, z, key="s")
        roads = [
            straight("a", x, y, x + 180, y, elevation=up),
            straight("b", x, y + 90, x + 180, y + 90, elevation=up),
        ]
        header = '<offset x="297133.5" y="5623440.5" z="12" hdg="0"/>'
        path = tmp_path / f"{name}.xodr"
        write_roads(path, *roads[::order], header=header)
        import_city(path, tmp_path / name, ImportOptions(seed=1))
        facts = yaml.safe_load((tmp_path / name / "import.yaml").read_text())
        assert facts["origin"] == [297133.5, 5623440.5, 12.0]
        with (tmp_path / name / "structures.csv").open(newline="") as stream:
            rows = [
                (*row[1:4], *map(float, row[4:7]))
                for row in list(csv.reader(stream))[1:]
            ]
        # Ground is one mesh, in coordinates of the map.
        things = [row for row in rows if any(row[3:])]
        places = np.array([row[3:] for row in things]) - move
        return [row[:3] for row in things], places

    names, places = town("plain", (0, 0, 0), 1)
    assert len(names) > 50
    for name, move, order in (
        ("far", (5_000, -5_000, 60), -1),
        ("low", (0, 0, -300), 1),
    ):
        found, moved = town(name, move, order)
        assert found == names
        np.testing.assert_allclose(moved[:, :2], places[:, :2], atol=0.011)
        # Only a town at z = 0 has lawns with a relief.
        np.testing.assert_allclose(moved[:, 2], places[:, 2], atol=0.5)


@pytest.mark.parametrize("scale", [1, 1e-3, 0.01, 100, 1 / 0.0254])
@pytest.mark.slow
def test_the_factor_that_is_named_cures_the_city(tmp_path, scale):
    def try_out(name, scale):
        path = write(tmp_path / f"{name}.city.json", scale=scale)
        import_city(path, tmp_path / name, ImportOptions(dressed=False))

    if scale != 1:
        with pytest.raises(InputError, match="multiply coordinates by") as told:
            try_out("as_given", scale)
        (factor,) = re.findall(r"by (\S+)\?", str(told.value))
        assert float(factor) == pytest.approx(1 / scale)
        scale *= float(factor)
    try_out("cured", scale)
