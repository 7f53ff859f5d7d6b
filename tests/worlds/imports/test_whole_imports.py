"""What changes nothing in the world changes nothing in its map.

Each test is one of whole imports, for every source.
"""

import functools
import itertools
from xml.etree import ElementTree

from helpers.map_classes import take_away
from helpers.small_cityjson import CityWriter
from helpers.small_opendrive import cubic, straight, write_roads
from helpers.small_osm import LAT, LON, METRES_PER_DEGREE, OsmWriter
import numpy as np
from pydrake.math import RigidTransform, RollPitchYaw
import pytest
from shapely import LineString, MultiPoint
import yaml

from cns_drake import scan
from cns_drake.scenarios import load_scenario, make_scenario
from cns_drake.sensors import LidarSection
from cns_drake.simulation import simulate
from evaluation.base import InputError
from worlds.imports import ImportOptions, import_city
from worlds.shapes import read_mesh

pytestmark = pytest.mark.slow

PLAIN = ImportOptions(dressed=False)
# Origin of the files of CityJSON, in their survey grid [m].
SURVEY = (85000.0, 446000.0, 3.0)


def rotation(angle_deg):
    turn = np.exp(1j * np.radians(angle_deg))
    return np.array([[turn.real, -turn.imag], [turn.imag, turn.real]])


def write_osm(path, move=(0, 0, 0), turn_deg=0.0, order=1, add=()):
    osm = OsmWriter(move=move[:2], turn_deg=turn_deg)
    street = {"highway": "residential", "width": "8", "sidewalk": "both"}
    middle = [osm.node(0, 0, highway="crossing", crossing="zebra"),
              osm.node(0, 60)]  # fmt: skip
    osm.way_of([osm.node(-150, 0), middle[0], osm.node(90, 0)], **street)
    osm.way_of([middle[0], middle[1], osm.node(0, 150)], **street)
    osm.way_of([osm.node(-90, 60), middle[1], osm.node(90, 60)], **street)
    osm.way([(50, -60), (60, 90)], highway="primary", bridge="yes")
    for k, shape in enumerate(["skillion", "gabled", "hipped", "mansard"]):
        tags = {"height": str(8 + k), "roof__shape": shape}
        osm.box(-120 + 60 * k, 20, 14, 11 + k, building="yes", **tags)
    osm.box(-80, -60, 40, 25, natural="water")
    osm.way([(-40, -40), (-25, -40), (-25, -70)], barrier="hedge")
    osm.node(90, -40, man_made="chimney", height="45", diameter="1")
    osm.node(-60, -10, natural="tree", height="7")
    for outline, tags in add:
        osm.way(outline, closed=len(outline) > 2, **tags)
    osm.rows = osm.rows[::order]
    return osm.write(path)


def write_network(path, order=1, move=(0, 0, 0), seed=1, **change):
    """A grid of streets with random gaps and distances."""
    osm = OsmWriter(move=move[:2], **change)
    rng = np.random.default_rng(seed)
    size = (5, 4) if seed == 1 else (9, 8)
    x, y = (
        90.0 * (np.arange(n) - (n - 1) / 2) + rng.uniform(-20, 20, n)
        for n in size
    )
    across, up = map(range, size)
    node = {(k, m): osm.node(x[k], y[m]) for k in across for m in up}
    lines = [[(k, m) for m in up] for k in across]
    lines += [[(k, m) for k in across] for m in up]
    for line in lines:
        for ends in itertools.pairwise(line):
            if rng.random() < 0.85:
                nodes = [node[end] for end in ends]
                osm.way_of(nodes, highway="residential", width="8")
    osm.box(x[0] + 20, y[0] + 20, 20, 15, building="yes")
    osm.rows = osm.rows[::order]
    return osm.write(path)


def write_cityjson(
    path, move=(0, 0, 0), turn_deg=0.0, order=1, survey=SURVEY, add=()
):
    R = rotation(turn_deg)
    city = CityWriter(origin=survey)
    plain = city.vertex
    city.vertex = lambda x, y, z: plain(*(np.array([*(R @ (x, y)), z]) + move))
    for k, (x, y) in enumerate(itertools.product((0, 50, 100), (0, 50, 100))):
        city.box(f"house_{k}", x, y, (36, 34, 6 + k), z=0.01 * x)
    for name, kind, x, y, z, size, lowest in add:
        city.box(name, x, y, size, z=z, kind=kind)
        geometry = city.objects[name]["geometry"][0]
        if lowest is None:
            del geometry["semantics"]
        else:
            geometry["semantics"]["surfaces"][0]["type"] = lowest
    city.objects = dict(list(city.objects.items())[::order])
    return city.write(path)


def write_opendrive(
    path, move=(0, 0, 0), turn_deg=0.0, order=1, survey=(0, 0, 0), add=()
):
    def way(name, x0, y0, x1, y1, z=0.0, more=""):
        ends = np.array([(x0, y0), (x1, y1)]) @ rotation(turn_deg).T
        ends += move[:2]
        return straight(
            name, *ends.ravel().tolist(), more=more,
            elevation=cubic("elevation", 0, z + move[2], key="s"),
        )  # fmt: skip

    roads = [
        way("a", -10, 0, 110, 0, more=f"<objects>{''.join(add)}</objects>"),
        way("c", 80, -40, 80, 40, z=6.5),
    ]
    x, y, z = survey
    header = f'<offset x="{x}" y="{y}" z="{z}" hdg="0"/>'
    return write_roads(path, *roads[::order], header=header)


WRITERS = {
    ".osm": write_osm, ".city.json": write_cityjson, ".xodr": write_opendrive,
}  # fmt: skip
NETWORKS = {
    f".{seed}.osm": functools.partial(write_network, seed=seed)
    for seed in (1, 3)
}


class Imported:
    """A file that was imported, in the coordinates in which it was written."""

    def __init__(self, folder, suffix, **change):
        self.path = (WRITERS | NETWORKS)[suffix](
            folder / f"a{suffix}", **change
        )
        self.folder = folder / "map"
        import_city(self.path, self.folder, PLAIN)
        self.stage = sorted(self.folder.glob("stage_*.sdf"))[-1]
        facts = yaml.safe_load((self.folder / "import.yaml").read_text())
        self._away = np.zeros(3)
        origin = np.array(facts["origin"])
        if suffix.endswith(".osm"):
            degrees = origin[::-1] - (LON, LAT)
            self._away[:2] = degrees * METRES_PER_DEGREE
        else:
            usual = SURVEY if suffix == ".city.json" else (0, 0, 0)
            self._away += origin - change.get("survey", usual)
        self._away -= change.get("move", (0, 0, 0))
        self._R = rotation(-change.get("turn_deg", 0.0))

    def _written(self, p_W):
        p = p_W + self._away
        return np.column_stack([p[:, :2] @ self._R.T, p[:, 2]])

    def in_map(self, place):
        """Returns the place (3,) in W of a place of the file."""
        x, y, z = place
        return np.array([*(self._R.T @ (x, y)), z]) - self._away

    def vertices(self):
        """Returns name of a structure -> all vertices of its meshes (N, 3)."""
        found = {}
        for visual in ElementTree.parse(self.stage).iter("visual"):
            uri = visual.findtext(".//mesh/uri")
            if uri is None:
                continue
            x, y, z, _, _, yaw = map(float, visual.findtext("pose").split())
            p = read_mesh(self.folder / uri).vertices
            scale = visual.findtext(".//mesh/scale") or "1 1 1"
            p = p * np.array(scale.split(), float)
            p[:, :2] = p[:, :2] @ rotation(np.degrees(yaw)).T
            name = visual.get("name").split("/")[0]
            found.setdefault(name, []).append(
                self._written(np.add(p, (x, y, z)))
            )
        return {name: np.concatenate(some) for name, some in found.items()}

    def routes(self):
        """Returns the lines of the drives, seen from above."""
        tables = sorted(self.folder.glob("route_*.csv"))
        rows = [np.loadtxt(t, delimiter=",", skiprows=1)[:, :3] for t in tables]
        return [
            LineString(self._written(np.resize(p, (len(p), 3)))[:, :2])
            for p in rows
        ]

    def cast(self, place):
        """Returns the heights that a LiDAR sees exactly above and below."""
        place = self.in_map(place)
        X_WS = RigidTransform(RollPitchYaw(0, np.pi / 2, 0), place)
        lidar = LidarSection(preset="vlp-16", resolution=0.0)
        points = scan(self.stage, X_WS, lidar)
        p = np.stack([points[k] for k in "xyz"], axis=1).astype(float)
        p = p @ X_WS.rotation().matrix().T + place
        p = p[np.hypot(*(p[:, :2] - place[:2]).T) < 0.6][:, 2] + self._away[2]
        up = p > place[2] + self._away[2]
        return p[up], p[~up]


@pytest.fixture(scope="module")
def written(tmp_path_factory):
    """Returns a function: suffix -> the import of its usual file."""
    return functools.cache(
        lambda suffix: Imported(tmp_path_factory.mktemp("whole"), suffix)
    )


@pytest.mark.parametrize(
    ("suffix", "change"),
    [
        (suffix, change)
        for suffix, lacks in {
            **dict.fromkeys([".osm", *NETWORKS], ("z", "xyz", "survey")),
            **dict.fromkeys([".city.json", ".xodr"], ()),
        }.items()
        for name, change in {
            "xy": {"move": (5_000, -400, 0)},
            "z": {"move": (0, 0, -300)},
            "xyz": {"move": (3, 2, 41)},
            "turn": {"turn_deg": 217.0},
            "order": {"order": -1},
            "survey": {"survey": (297133.5, 5623440.5, 12.0)},
        }.items()
        if name not in lacks
    ],
    ids=str,
)  # fmt: skip
def test_a_city_that_is_moved_turned_or_sorted_is_the_same(
    written, tmp_path, suffix, change
):
    if suffix == ".city.json" and "survey" in change:
        change = {"survey": (91000.0, 440000.0, 12.0)}
    wanted, found = written(suffix), Imported(tmp_path, suffix, **change)
    own, others = wanted.vertices(), found.vertices()
    is_drawn = suffix == ".xodr"
    if is_drawn and "turn_deg" in change:  # The rest is drawn anew.
        own, others = (
            {k: p for k, p in some.items()
             if k.startswith(("carriageway", "sidewalks", "bridge"))}
            for some in (own, others)
        )  # fmt: skip
    assert own.keys() == others.keys()
    assert len(own) >= 3
    # The nodes of a town's ground are 2 m apart.
    on_nodes = not any(change.get("move", (0, 0))[:2])
    tolerance = 0.02 if on_nodes or not is_drawn else 0.5
    for name, p in own.items():
        if name.startswith(("ground", "tree")):  # Crowns are not turned.
            continue
        hulls = [MultiPoint(q[:, :2]).convex_hull for q in (p, others[name])]
        # Corners of round things are 0.2 m apart.
        assert hulls[0].hausdorff_distance(hulls[1]) < 0.2, name
        for extreme in (np.min, np.max):
            apart = extreme(others[name][:, 2]) - extreme(p[:, 2])
            assert abs(apart) < tolerance, name
    if "turn_deg" not in change or suffix.endswith(".osm"):
        routes = wanted.routes(), found.routes()
        assert len(routes[0]) == len(routes[1]) > 0
        for a, b in zip(*routes, strict=True):
            assert a.hausdorff_distance(b) < 2.0


def outline(*corners):
    return [(50 + x, -30 + y) for x, y in corners]


BOX = ((0, 0), (20, 0), (20, 10), (0, 10))
HOUSE = (20, 9, 2)
SQUARE = ((-4, -3), (4, -3), (4, 3), (-4, 3))
# What is not on the ground -> places at which a LiDAR sees its lower and upper
# sides [m]; none of what is not built.
THINGS = {
    ".osm": [
        ([(outline(*BOX), tags)], [((60, -25), *span)] if span else [])
        for tags, span in (
            ({"building": "roof", "height": "5.5"}, (5.0, 5.5)),
            ({"building": "carport"}, (2.5, 3.0)),
            ({"building": "yes", "wall": "no", "height": "6"}, (5.5, 6.0)),
            ({"building": "yes", "height": "7", "min_height": "4"}, (4, 7)),
            ({"building": "yes", "height": "7", "building__min_level": "1"},
             (3, 7)),
            ({"building__part": "yes", "height": "20", "min_height": "10"},
             (10, 20)),
            ({"building": "yes", "location": "underground"}, None),
            ({"building": "yes", "layer": "-1"}, None),
            ({"amenity": "parking", "parking": "underground"}, None),
            ({"amenity": "parking", "parking": "multi-storey"}, None),
            ({"amenity": "parking", "layer": "-2"}, None),
            ({"natural": "water", "tunnel": "culvert"}, None),
        )
    ] + [
        ([([(30, -60), (30, 40)], {"highway": "tertiary", "bridge": "yes"})],
         [((30, 0), 5.0, 6.0)]),
        ([([(30, -60), (30, 40)], {"highway": "tertiary", "tunnel": "yes"})],
         []),
    ],
    ".city.json": [
        ([("more", kind, 36, 20, z, HOUSE, lowest)],
         [((43, 25), *span)] if span else [])
        for kind, z, lowest, span in (
            ("Bridge", 26.0, "GroundSurface", (26, 28)),
            ("Tunnel", -7.0, "GroundSurface", None),
            ("Building", 25.5, "OuterCeilingSurface", (25.5, 27.5)),
            ("BuildingPart", 25.5, "OuterFloorSurface", (25.5, 27.5)),
            ("OtherConstruction", 24.0, "RoofSurface", (24, 26)),
        )
    ] + [
        # A canopy without semantics is too flat to be a house.
        ([("more", "Building", 36, 20, 25.5, (20, 9, 0.5), None)],
         [((43, 25), 25.5, 26.0)]),
        # A square on a roof.
        ([("more", "Square", 4, 4, 6.0, (20, 20, 0.1), None)], []),
    ],
    ".xodr": [
        (
            [
                '<object id="1" s="20" t="0" zOffset="5" hdg="0" length="2"'
                ' width="12" height="1"/>',
                *(
                    f'<object id="{k}" s="{s}" t="0" zOffset="5" hdg="0"'
                    f' height="1"><outline>{"".join(corners)}</outline>'
                    "</object>"
                    for k, s, corners in (
                        (2, 35, (f'<cornerLocal u="{u}" v="{v}" z="0"'
                                 ' height="1"/>' for u, v in SQUARE)),
                        (3, 50, (f'<cornerLocal u="{u}" v="{v}" z="2"'
                                 ' height="1"/>' for u, v in SQUARE)),
                        (4, 65, (f'<cornerRoad s="{65 + u}" t="{v}" dz="5"'
                                 ' height="1"/>' for u, v in SQUARE)),
                    )
                ),
                '<tunnel id="5" s="100" length="16" name="" type="standard"/>',
            ],
            [
                ((10, 0), 5, 6), ((25, 0), 5, 6), ((40, 0), 7, 8),
                ((55, 0), 5, 6), ((97, 0), 4.5, 4.9), ((80, 10), 5.7, 6.5),
            ],
        )
    ],
}  # fmt: skip


@pytest.mark.parametrize(
    ("suffix", "things", "spans"),
    [
        pytest.param(suffix, *one, id=f"{suffix}-{k}")
        for suffix, of_source in THINGS.items()
        for k, one in enumerate(of_source)
    ],
)
def test_what_is_not_on_the_ground_changes_no_ground(
    written, tmp_path, suffix, things, spans
):
    """A LiDAR sees its lower side from below, and its upper one from above."""
    without, with_it = written(suffix), Imported(tmp_path, suffix, add=things)
    # Lawns of towns are shaped around what stands on them.
    beginning = "carriageway" if suffix == ".xodr" else "ground"
    grounds = [
        np.concatenate(
            [p for k, p in one.vertices().items() if k.startswith(beginning)]
        )
        for one in (without, with_it)
    ]
    for extreme in (np.min, np.max):
        np.testing.assert_allclose(
            *(extreme(p, axis=0) for p in grounds), atol=1e-6
        )
    for xy, low, high in spans:
        # From within, both sides are seen.
        above, below = with_it.cast((*xy, (low + high) / 2))
        assert above.min() == pytest.approx(high, abs=0.02), xy
        assert below.max() == pytest.approx(low, abs=0.02), xy


@pytest.mark.parametrize("suffix", WRITERS)
def test_a_drive_needs_nothing_that_stands_beside_it(tmp_path, suffix):
    """Parked cars, plants and buildings are taken away, one after another."""
    path = WRITERS[suffix](tmp_path / f"a{suffix}")
    folder = tmp_path / "map"
    import_city(path, folder, ImportOptions(dressed=True))
    route = sorted(folder.glob("route_*.csv"))[0]
    x, y = np.loadtxt(route, delimiter=",", skiprows=1)[-1, :2]
    steps = "".join(
        f'<timestep time="{t}.00"><vehicle id="a" x="{x}" y="{y}"'
        ' angle="270" type="car" speed="0"/></timestep>'
        for t in range(9)
    )
    trace = tmp_path / "trace.xml"
    trace.write_text(f"<fcd-export>{steps}</fcd-export>")
    drive = sorted(folder.glob("sequence_*.yaml"))[-1]
    values = load_scenario(drive).model_dump(exclude_none=True)
    values |= {
        "traffic": {"fcd": str(trace)},
        "lidars": {"lidar": {"columns": 64}},
        "frames": 2,
    }
    for k, gone in enumerate((["car"], ["vegetation"], ["building"])):
        take_away(folder, gone)
        result = simulate(make_scenario(values, str(drive)), tmp_path / f"{k}")
        assert result.num_frames == 2


def broken(suffix, number):
    """Returns a text of ten things, some of which have no shape."""
    if suffix == ".osm":
        osm = OsmWriter()
        for k in range(10 - number):
            osm.box(30 * k, 0, 9, 9, building="yes")
        for k in range(number):
            osm.way([(30 * k, 40), (30 * k + 9, 40)], building="yes")
        return osm.write
    if suffix == ".city.json":
        city = CityWriter()
        for k in range(10):
            city.box(f"house_{k}", 30 * k, 0, (9, 9, 9))
            if k < number:
                (geometry,) = city.objects[f"house_{k}"]["geometry"]
                geometry["boundaries"] = [[[[9999, 9998, 9997]]]]
        return city.write
    roads = [straight(f"r{k}", 0, 30 * k, 99, 30 * k) for k in range(10)]
    for k in range(number):
        roads[k] = roads[k].replace("<lanes>", "<was>")
        roads[k] = roads[k].replace("</lanes>", "</was>")
    return lambda path: write_roads(path, *roads)


@pytest.mark.parametrize("suffix", WRITERS)
def test_a_file_that_is_lost_by_more_than_half_is_refused(tmp_path, suffix):
    path = broken(suffix, 5)(tmp_path / f"half{suffix}")
    import_city(path, tmp_path / "half", PLAIN)
    first = (tmp_path / "half/import.txt").read_text().splitlines()[0]
    assert first == "in the city: 5 of 10 elements of the file (50 %)"
    path = broken(suffix, 6)(tmp_path / f"more{suffix}")
    with pytest.raises(InputError, match=r"60 % of what should be in the city"):
        import_city(path, tmp_path / "more", PLAIN)


@pytest.mark.parametrize(
    ("suffix", "old", "new"),
    [
        (".osm", 'version="0.6"', 'version="0.7"'),
        (".osm", 'version="0.6"', 'version="1"'),
        (".city.json", '"version": "2.0"', '"version": "2.1"'),
        (".city.json", '"version": "2.0"', '"version": "1.9"'),
        (".city.json", '"version": "2.0"', '"version": "0.9"'),
        (".xodr", 'revMinor="6"', 'revMinor="9"'),
        (".xodr", 'revMajor="1"', 'revMajor="2"'),
    ],
)
def test_versions_that_are_not_read_are_refused(tmp_path, suffix, old, new):
    path = WRITERS[suffix](tmp_path / f"a{suffix}")
    text = path.read_text()
    assert text.count(old) >= 1
    path.write_text(text.replace(old, new, 1))
    with pytest.raises(InputError, match=r"version"):
        import_city(path, tmp_path / "map", PLAIN)
