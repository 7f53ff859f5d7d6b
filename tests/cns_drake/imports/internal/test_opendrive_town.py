"""Towns along roads of OpenDRIVE: areas, buildings, drives, recordings."""

from itertools import pairwise
import math

from helpers.small_opendrive import (
    cubic,
    geometry,
    lane,
    road,
    section,
    straight,
    turn,
    write_roads,
)
import numpy as np
import pytest
import shapely
from shapely.geometry import LineString, Point
from typer.testing import CliRunner
import yaml

from cns_drake.base import InputError
from cns_drake.city import UpperSides, ground_triangles
from cns_drake.command_line import app
from cns_drake.imports import REPORT_NAME, ImportOptions
from cns_drake.imports.drives.search import find_drives
from cns_drake.imports.drives.steerable_drives import WaypointRoute
from cns_drake.imports.faults import ImportFaults
from cns_drake.imports.opendrive.band_graph import BandGraph
from cns_drake.imports.opendrive.imported_streets import ImportedStreets
from cns_drake.imports.opendrive.lanes import lane_bands, lane_polygon
from cns_drake.imports.opendrive.road_heights import KerbHeights, RoadHeights
from cns_drake.imports.opendrive.road_reader import read_roads
from cns_drake.imports.opendrive.town import build_town, lane_text_of_bands
from cns_drake.imports.opendrive.town_files import write_town
from cns_drake.scenarios import load_scenario, plan_drive, write_table
from cns_drake.traffic import read_lanes
from evaluation.drives import open_drive

ARM = 12.0
R = ARM - 1.75
L = ARM + 1.75


def crossing(name, x, y, arms):
    """Lanes that join the arms of a junction: right, left and straight on.

    Args:
        arms: headings outwards, in quarter turns.
    """
    found = []
    for k in arms:
        heading = math.pi / 2 * k
        # The lane is on the right of incoming drivers.
        c, s = math.cos(heading), math.sin(heading)
        start = (x + ARM * c, y + ARM * s)
        inwards = heading + math.pi
        for m, angle in ((1, -1), (2, 0), (3, 1)):
            if (k + 2 - angle * -1) % 4 not in arms and angle:
                continue
            if not angle and (k + 2) % 4 not in arms:
                continue
            # The reference line is the middle line of the road.
            own = f"{name}_{k}_{m}"
            if angle == 0:
                end = (x - ARM * c, y - ARM * s)
                found.append(
                    straight(
                        own, *start, *end, junction=name,
                        lanes=(lane(-1, "driving", 3.5),),
                    )
                )  # fmt: skip
            else:
                found.append(
                    turn(
                        own, *start, inwards, ARM, angle * math.pi / 2,
                        junction=name,
                    )
                )  # fmt: skip
    return found


def town_roads(size=100.0, **more):
    """Six junctions about two squares, and a road out of them at both ends."""
    places = {
        "a": (0, 0), "b": (1, 0), "e": (2, 0),
        "d": (0, 1), "c": (1, 1), "f": (2, 1),
    }  # fmt: skip
    arms = {
        "a": (0, 1), "b": (0, 1, 2), "e": (0, 1, 2),
        "d": (0, 2, 3), "c": (0, 2, 3), "f": (2, 3),
    }  # fmt: skip
    found = []
    for name, (i, j) in places.items():
        found += crossing(name, i * size, j * size, arms[name])
    for first, last in ("ab", "be", "dc", "cf", "ad", "bc", "ef"):
        (x0, y0), (x1, y1) = (
            np.array(places[one]) * size for one in (first, last)
        )
        dx, dy = np.sign([x1 - x0, y1 - y0]) * ARM
        found.append(
            straight(first + last, x0 + dx, y0 + dy, x1 - dx, y1 - dy, **more)
        )
    end = 2 * size + ARM
    found.append(straight("eg", end, 0, end + 90.0, 0, **more))
    found.append(straight("hd", -90.0 - ARM, size, -ARM, size, **more))
    return found


@pytest.fixture(scope="module")
def source(tmp_path_factory):
    folder = tmp_path_factory.mktemp("roads")
    return write_roads(folder / "town.xodr", *town_roads())


@pytest.fixture(scope="module")
def town(source):
    return build_town(source, ImportOptions(seed=1))


def bands_of(path):
    roads = read_roads(path, ImportFaults()).roads
    return [band for one in roads for band in lane_bands(one)]


def test_junctions_have_no_holes(source):
    streets = ImportedStreets(bands_of(source))
    carriageway = streets.areas.carriageway
    for x, y in ((0, 0), (100, 0), (100, 100), (200, 0)):
        around = Point(x, y).buffer(ARM)
        for part in shapely.get_parts(carriageway.intersection(around)):
            assert not part.interiors
    # The middle of the T-junction belongs to no lane and is road nevertheless.
    assert carriageway.contains(Point(100, 0))
    # Two lanes of 3.5 m and a sidewalk of 2 m on both sides.
    across = LineString([(50, -20), (50, 20)])
    assert across.intersection(carriageway).length == pytest.approx(
        7.0, abs=0.02
    )
    walks = streets.areas.sidewalks.intersection(across)
    assert walks.length == pytest.approx(4.0, abs=0.02)
    assert streets.areas.sidewalks.intersection(carriageway).area < 1e-6


def test_what_lanes_of_a_junction_enclose_is_road(tmp_path):
    corners = [(0, 0), (14, 0), (7, 7), (0, 0)]
    only = (lane(-1, "driving", 3.5),)
    path = write_roads(
        tmp_path / "a.xodr",
        *(
            straight(f"{k}", *a, *b, junction="5", lanes=only)
            for k, (a, b) in enumerate(pairwise(corners))
        ),
    )
    bands = bands_of(path)
    middle = Point(7, 3)
    assert all(lane_polygon(band).disjoint(middle) for band in bands)
    assert ImportedStreets(bands).areas.carriageway.contains(middle)


@pytest.mark.slow
@pytest.mark.night
def test_buildings_stand_apart_from_streets_and_each_other(source, town):
    lanes = []
    for band in bands_of(source):
        corners = np.concatenate([band.inner, band.outer[::-1]])[:, :2]
        lanes.append(shapely.make_valid(shapely.polygons(corners)))
    streets = shapely.union_all(lanes)
    buildings = [
        one.footprint_W
        for one in town.city.structures
        if one.semantic_class == "building"
    ]
    assert len(buildings) > 10
    for k, one in enumerate(buildings):
        assert one.distance(streets) > 0.5
        for other in buildings[:k]:
            assert one.intersection(other).area < 0.2


@pytest.mark.slow
@pytest.mark.night
def test_no_ground_lies_on_kerbs(town):
    areas = {one.name: one.footprint_W for one in town.city.structures}
    kerbs = areas.pop("kerbs")
    assert kerbs.area > 10.0
    grounds = [name for name in areas if name.startswith("ground_")]
    assert grounds
    for name in grounds:
        assert areas[name].intersection(kerbs).area < 0.01, name


@pytest.mark.slow
@pytest.mark.night
def test_everything_has_its_class(town):
    classes = {s.name: s.semantic_class for s in town.city.structures}
    assert classes["carriageway"] == "road"
    assert classes["sidewalks"] == "sidewalk"
    assert town.kinds["junctions"] == 6
    assert town.kinds["roads"] == 9


@pytest.mark.slow
@pytest.mark.night
def test_drives_keep_to_their_lanes(source, town):
    assert len(town.drives) == 2
    middle = {}
    for band in bands_of(source):
        along = band.lane.number < 0
        line = band.middle[:, :2] if along else band.middle[::-1, :2]
        middle[band.road.name, band.lane.number] = LineString(line)
    lines = shapely.MultiLineString(
        [
            line
            for (_, number), line in middle.items()
            if abs(number) == 1
        ]
    )  # fmt: skip
    for drive in town.drives:
        assert drive.length > 80.0
        places = shapely.points(drive.path)
        # Coordinates are rounded at each waypoint, every 2 m.
        assert shapely.distance(lines, places).max() < 0.03
        # Traffic keeps right: the road's middle line is on the left.
        for name, line in (
            ("ab", LineString([(12, 0), (88, 0)])),
            ("bc", LineString([(100, 12), (100, 88)])),
            ("eg", LineString([(212, 0), (302, 0)])),
        ):
            near = [
                k for k in range(len(drive.path) - 1)
                if line.distance(Point(drive.path[k])) < 2.0
                and line.project(Point(drive.path[k])) > 5.0
                and line.project(Point(drive.path[k])) < line.length - 5.0
            ]  # fmt: skip
            for k in near:
                step = drive.path[k + 1] - drive.path[k]
                foot = line.interpolate(line.project(Point(drive.path[k])))
                away = np.array([foot.x, foot.y]) - drive.path[k]
                assert step[0] * away[1] - step[1] * away[0] > 0.0, name
        turns = np.diff(np.unwrap(np.arctan2(*np.diff(drive.path, axis=0).T)))
        assert np.abs(turns).max() < 0.3
    a, b = (LineString(drive.path) for drive in town.drives)
    shared = a.intersection(b.buffer(0.5)).length
    assert 0.05 < shared / a.length < 0.95
    assert a.is_simple
    assert b.is_simple


def test_left_hand_traffic_keeps_left(tmp_path):
    path = write_roads(
        tmp_path / "a.xodr", straight("1", 0, 0, 200, 0, rule="LHT")
    )
    (drive,) = find_drives(BandGraph(bands_of(path)))
    step = drive.path[-1] - drive.path[0]
    assert drive.path[0, 1] * step[0] > 0.0
    assert abs(drive.path[0, 1]) == pytest.approx(1.75)


def test_heights_follow_grade_and_roll(tmp_path):
    slope = cubic("elevation", 0, 2.0, 0.05, 0, 0, "s")
    roll = cubic("superelevation", 0, 0.04, 0, 0, 0, "s")
    path = write_roads(
        tmp_path / "a.xodr",
        straight("1", 0, 0, 100, 0, elevation=slope, lateral=roll),
    )
    surface = RoadHeights(bands_of(path))
    xy = np.random.default_rng(0).uniform((1, -5), (99, 5), (200, 2))
    expected = 2.0 + 0.05 * xy[:, 0] + math.tan(0.04) * xy[:, 1]
    np.testing.assert_allclose(surface.heights(xy), expected, atol=2e-3)
    assert not surface.is_level


@pytest.mark.slow
def test_kerbs_are_closed_where_a_slope_begins(tmp_path):
    # The slope begins within a tile; the road's edges cross several.
    rise = cubic("elevation", 0, 0.0, 0, 0, 0, "s") + cubic(
        "elevation", 150, 0.0, 0.05, 0, 0, "s"
    )
    path = write_roads(
        tmp_path / "a.xodr", straight("1", 10, 5, 210, 45, elevation=rise)
    )
    built = build_town(path, ImportOptions())
    (kerbs,) = (one for one in built.city.structures if one.name == "kerbs")
    upright = 0.0
    for mesh in kerbs.model.meshes.values():
        a, b, c = np.moveaxis(mesh.vertices[mesh.triangles()], 1, 0)
        normals = np.cross(b - a, c - a) / 2.0
        areas = np.linalg.norm(normals, axis=1)
        upright += areas[np.abs(normals[:, 2]) < 1e-3 * areas].sum()
    rim = built.streets.areas.carriageway.length
    assert upright == pytest.approx(0.1 * rim, rel=2e-3)


@pytest.mark.slow
def test_parking_lanes_are_parking(tmp_path):
    lanes = (
        lane(1, "driving", 3.5), lane(-1, "driving", 3.5),
        lane(-2, "parking", 2.5), lane(-3, "biking", 1.5),
        lane(-4, "sidewalk", 2.0),
    )  # fmt: skip
    path = write_roads(
        tmp_path / "a.xodr", straight("1", 0, 0, 200, 0, lanes=lanes)
    )
    built = build_town(path, ImportOptions())
    classes = {s.name: s for s in built.city.structures}
    assert classes["parking_bays"].semantic_class == "parking"
    bays = classes["parking_bays"].model.footprint
    assert bays.area == pytest.approx(500.0)
    assert classes["paths"].semantic_class == "sidewalk"
    cars = [s for s in built.city.structures if "bay" in s.tags]
    assert len(cars) > 8
    assert all(bays.buffer(0.4).contains(one.footprint_W) for one in cars)


def run(*arguments):
    return CliRunner().invoke(app, [str(a) for a in arguments])


@pytest.mark.night
@pytest.mark.slow
def test_the_command_from_end_to_end(source, town, tmp_path):
    output = tmp_path / "town"
    result = run("import", source, "--output", output, "--seed", "1")
    assert result.exit_code == 0, result.output
    again = tmp_path / "again" / "town"
    again.mkdir(parents=True)
    write_town(again, source, town)
    names = [{path.name for path in one.iterdir()} for one in (output, again)]
    assert names[0] - names[1] == {"sequences.csv", REPORT_NAME}
    for path in again.rglob("*"):
        if path.is_file():
            twin = output / path.relative_to(again)
            assert twin.read_bytes() == path.read_bytes(), path
    # The table equals the worlds, though no world was loaded for it.
    table = output / "sequences.csv"
    counted = table.read_text()
    table.unlink()
    write_table(output)
    assert table.read_text() == counted
    facts = yaml.safe_load((output / "import.yaml").read_text())
    assert facts["source"] == "town.xodr"
    assert facts["seed"] == 1
    assert "town_01" in run("list", output).output
    for name in ("sequence_01", "sequence_02", "other_02"):
        trajectory = plan_drive(load_scenario(output / f"{name}.yaml"))
        assert trajectory.length > 80.0
    scenario = output / "sequence_02.yaml"
    result = run(
        "simulate", scenario, "--frames", "2", "--output", tmp_path / "rec"
    )
    assert result.exit_code == 0, result.output
    scan = open_drive(tmp_path / "rec" / "town_02").scan(0)
    # Road below the car, at the height of the wheels.
    below = np.hypot(scan["x"], scan["y"]) < 6.0
    road_ = below & (scan["label"] == 40)
    assert road_.sum() > 500
    assert np.abs(scan["z"][road_] + 1.6).max() < 0.01
    assert {40, 48, 50} <= set(np.unique(scan["label"]))


@pytest.mark.parametrize(
    ("option", "value"), [("--years", "1950"), ("--lod", "2")]
)
def test_options_of_other_formats(source, tmp_path, option, value):
    result = run("import", source, option, value, "--output", tmp_path / "out")
    assert isinstance(result.exception, InputError)
    assert f"{option}: " in str(result.exception)


@pytest.mark.slow
@pytest.mark.night
def test_a_drive_of_ones_own_through_what_stands_near(source, town):
    xy = np.array([[20.0, -1.75], [60.0, -1.75], [100.0, -1.75]])
    own = WaypointRoute(xy, xy)
    options = ImportOptions(seed=1, within=40.0, grow=0.8)
    near = build_town(source, options, [own])
    (drive,) = near.drives
    np.testing.assert_array_equal(drive.waypoints, np.c_[xy, np.zeros(3)])
    ground = {"road", "parking", "sidewalk", "terrain", "other-ground"}
    way = LineString(xy)
    kept = {one.name for one in near.city.structures}
    for one in town.city.structures:
        stays = (
            one.semantic_class in ground or way.distance(one.footprint_W) <= 40
        )
        assert (one.name in kept) == stays, one.name
    # The file's objects and what is generated are left out alike, and counted.
    gone = len(town.city.structures) - len(near.city.structures)
    counts = {kind: count for kind, count, _ in near.faults.rows()}
    assert counts["structure far from the drives, left out"] == gone > 0
    buildings = {
        one.name
        for one in near.city.structures
        if one.semantic_class == "building"
    }
    absent = {
        name
        for names in near.stages.stages["01"].absent.values()
        for name in names
    }
    share = len(absent & buildings) / len(buildings)
    assert share == pytest.approx(0.8, abs=1.5 / len(buildings))


def test_lanes_without_area(tmp_path):
    line = geometry(0.0, 0.0, 0.0, 0.0, 50.0, "<line/>")
    own = section(0.0, lane(-1, "none", 3.0))
    path = write_roads(tmp_path / "a.xodr", road("1", 50.0, [line], [own]))
    with pytest.raises(InputError, match="no lane in it has an area"):
        build_town(path, ImportOptions())


def height(start, inner, outer):
    return f'<height sOffset="{start}" inner="{inner}" outer="{outer}"/>'


def upper_side(built, *names):
    """A function of x, y: the height of the highest structure there."""
    structures = [s for s in built.city.structures if s.name in names]
    sides = UpperSides(ground_triangles(structures))
    return lambda x, y: float(sides.heights(np.array([[x, y]]))[0])


@pytest.mark.slow
def test_lanes_have_the_heights_of_the_file(tmp_path):
    """A dropped kerb from 50 m on, a sidewalk that rises, a raised lane."""
    rising, dropped = height(0, 0.1, 0.3), height(0, 0.15, 0.15)
    dropped += height(50, 0.0, 0.0)
    lanes = (
        lane(2, "sidewalk", 2.0, more=rising), lane(1, "driving", 3.5),
        lane(-1, "driving", 3.5),
        lane(-2, "driving", 3.5, more=height(0, 0.2, 0.2)),
        lane(-3, "sidewalk", 2.0, more=dropped),
    )  # fmt: skip
    path = write_roads(
        tmp_path / "a.xodr", straight("1", 0, 0, 120, 0, lanes=lanes)
    )
    built = build_town(path, ImportOptions())
    top = upper_side(built, "sidewalks", "kerbs", "carriageway")
    for x in (20.3, 90.7):
        assert top(x, 1.75) == pytest.approx(0.0, abs=0.005)
        assert top(x, -5.25) == pytest.approx(0.2, abs=0.005)
        for y in (3.6, 4.5, 5.4):
            expected = 0.1 + 0.1 * (y - 3.5)
            assert top(x, y) == pytest.approx(expected, abs=0.01)
    for y in (-7.3, -8.0, -8.9):
        # Beside the raised lane the road leads on at its height.
        assert top(90.7, y) - top(20.3, y) == pytest.approx(-0.15, abs=0.005)
    # The ground beside meets the sidewalk.
    ground = upper_side(built, *(s.name for s in built.city.structures))
    assert ground(20.3, 5.6) == pytest.approx(0.3, abs=0.02)


@pytest.mark.sampled(1)
@pytest.mark.slow
@pytest.mark.parametrize("roll", [0.1, -0.08])
def test_a_level_lane_is_not_banked(tmp_path, roll):
    lanes = (
        lane(2, "sidewalk", 2.0).replace("<lane", '<lane level="true"'),
        lane(1, "driving", 3.5), lane(-1, "driving", 3.5),
        lane(-2, "sidewalk", 2.0),
    )  # fmt: skip
    banked = cubic("superelevation", 0, roll, 0, 0, 0, "s")
    path = write_roads(
        tmp_path / "a.xodr",
        straight("1", 0, 0, 120, 0, lanes=lanes, lateral=banked),
    )
    by_number = {band.lane.number: band for band in bands_of(path)}
    level, other = by_number[2], by_number[-2]
    edge = 3.5 * np.array([np.cos(roll), np.sin(roll)])
    np.testing.assert_allclose(level.inner[:, 1:], [edge] * len(level.s))
    np.testing.assert_allclose(
        level.outer[:, 1:], [[edge[0] + 2.0, edge[1]]] * len(level.s)
    )
    np.testing.assert_allclose(
        other.outer[:, 2] - other.inner[:, 2], -2.0 * np.sin(roll)
    )
    top = upper_side(build_town(path, ImportOptions()), "sidewalks", "kerbs")
    rise = top(60.3, 5.3) - top(60.3, 3.7)
    assert rise == pytest.approx(0.0, abs=0.01)
    fall = top(60.3, -5.3) - top(60.3, -3.7)
    assert fall == pytest.approx(-1.6 * np.tan(roll), abs=0.01)


def test_a_reversed_lane_leads_the_other_way(tmp_path):
    one = lane(1, "driving", 3.5).replace("<lane", '<lane direction="reversed"')
    path = write_roads(
        tmp_path / "a.xodr", straight("1", 0, 0, 200, 0, lanes=(one,))
    )
    (drive,) = find_drives(BandGraph(bands_of(path)))
    assert (drive.path[-1] - drive.path[0])[0] > 100.0


def slow_end(length):
    """Limits of 12 m/s, and of 3 m/s on the last 10 m."""
    return "".join(
        f'<type s="{s}" type="town"><speed max="{limit}"/></type>'
        for s, limit in ((0.0, 12), (length - 10.0, 3))
    )


def test_a_short_slow_part_does_not_slow_a_drive(tmp_path):
    path = write_roads(
        tmp_path / "a.xodr", straight("1", 0, 0, 200, 0, more=slow_end(200))
    )
    (drive,) = find_drives(BandGraph(bands_of(path)))
    assert drive.limit == 12.0


@pytest.mark.parametrize("pieces", [1, 2])
def test_a_ring_road_without_a_junction_has_traffic(tmp_path, pieces):
    radius = 60.0
    length = 2.0 * math.pi * radius / pieces
    lanes = section(0.0, lane(1, "driving", 3.5), lane(-1, "driving", 3.5))
    roads = []
    for k in range(pieces):
        start = 2.0 * math.pi * k / pieces
        x, y = radius * math.sin(start), -radius * math.cos(start)
        arc = f'<arc curvature="{1 / radius!r}"/>'
        piece = geometry(0.0, x, y, start, length, arc)
        more = slow_end(length)
        roads.append(road(str(k), length, [piece], [lanes], more=more))
    path = write_roads(tmp_path / "ring.xodr", *roads)
    bands = bands_of(path)
    text = lane_text_of_bands(bands, KerbHeights(bands, 0.1))
    lanes_file = tmp_path / "lanes.json"
    lanes_file.write_text(text)
    graph_pieces = read_lanes(lanes_file).graph.pieces
    assert {piece.limit for piece in graph_pieces} == {12.0}
    whole = sum(piece.length for piece in graph_pieces)
    assert whole == pytest.approx(2 * 2 * math.pi * radius, rel=5e-3)


@pytest.mark.parametrize("kind", ["driving", "shoulder", "bus", "parking"])
def test_a_raised_lane_keeps_its_class(tmp_path, kind):
    lanes = (
        lane(1, "driving", 3.5), lane(-1, "driving", 3.5),
        lane(-2, kind, 3.5, more=height(0, 0.1, 0.1)),
    )  # fmt: skip
    path = write_roads(
        tmp_path / "a.xodr", straight("1", 0, 0, 60, 0, lanes=lanes)
    )
    streets = ImportedStreets(bands_of(path))
    assert streets.areas.carriageway.contains(Point(30.0, -5.0))
    surface = RoadHeights(bands_of(path))
    for y, z in ((1.75, 0.0), (-1.75, 0.0), (-5.25, 0.1)):
        assert surface.heights((30.2, y))[0] == pytest.approx(z, abs=0.005)
