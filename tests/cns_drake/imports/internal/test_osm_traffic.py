"""Traffic on streets of OpenStreetMap."""

from itertools import pairwise

from helpers.small_osm import OsmWriter
import numpy as np
import pytest
import shapely

from cns_drake.base import InputError
from cns_drake.imports import ImportOptions, import_city, import_openstreetmap
from cns_drake.imports.drives.steerable_drives import WaypointRoute
from cns_drake.imports.openstreetmap.traffic import lane_text_of_streets
from cns_drake.motion import Trajectory
from cns_drake.scenarios import DrivePlan, load_scenario, plan_drive
from cns_drake.scene import structure_name
from cns_drake.simulation import EGO_BOX, load_drive, plan_scenario_traffic
from cns_drake.traffic import WALKER_SIZE, plan_traffic, read_lanes

WIDTH = 12.5
# The origin is in the middle of the buildings.
CORNERS = [(-90, -70), (90, -70), (90, 70), (-90, 70)]


def write_blocks(path, *, wall=False, lanes="2", **ring):
    """Writes a ring of streets, and one across it with a crossing."""
    osm = OsmWriter()
    around = [osm.node(*xy) for xy in CORNERS]
    south, north = osm.node(0, -70), osm.node(0, 70)
    crossing = osm.node(0, 5, highway="crossing", crossing="zebra")
    osm.node(-12, -69, highway="traffic_signals")
    nodes = [around[0], south, around[1], around[2], north, around[3]]
    osm.way_of(
        [*nodes, around[0]], highway="tertiary", lanes=lanes,
        maxspeed="30 mph", **ring,
    )  # fmt: skip
    osm.way_of(
        [south, crossing, north], highway="primary", lanes="4", width="12.5",
        sidewalk="both",
    )  # fmt: skip
    # A street that ends.
    osm.way_of([around[2], osm.node(170, 70)], highway="residential")
    osm.box(-70, -35, 40, 70, building="yes")
    osm.box(30, -35, 40, 70, building="yes")
    if wall:
        osm.way([(80, -10), (100, -10)], barrier="wall")
    return osm.write(path)


ROUTE = np.array([(-86, -71.7), (0, -71.7), (86, -71.7)])


def lanes_of(path, tmp_path, side="right", added=()):
    city = import_openstreetmap(path, None)
    drive = WaypointRoute(ROUTE, ROUTE)
    text = lane_text_of_streets(
        city.streets,
        city.street_places,
        city.objects,
        added,
        [drive],
        side,
    )
    if text is None:
        return city, None
    file = tmp_path / "lanes.json"
    file.write_text(text)
    return city, read_lanes(file)


@pytest.fixture(scope="module")
def blocks(tmp_path_factory):
    folder = tmp_path_factory.mktemp("blocks")
    return lanes_of(write_blocks(folder / "a.osm"), folder)


def lines(graph):
    return [shapely.LineString(piece.points[:, :2]) for piece in graph.pieces]


def surface(city, kind="Road"):
    triangles = [
        one.triangles for one in city.objects if one.object_type == kind
    ]
    flat = np.concatenate(triangles)[:, :, :2]
    return shapely.union_all(shapely.polygons(flat), grid_size=0.001)


def test_lanes_lie_on_the_laid_streets(blocks):
    city, (graph, *_) = blocks
    paved = surface(city).buffer(0.02)
    for piece, line in zip(graph.pieces, lines(graph), strict=True):
        # Half a lane to both sides, but not where vehicles turn.
        room = line if piece.is_way else line.buffer(1.5, cap_style="flat")
        assert paved.covers(room)
    assert {piece.points[:, 2].max() for piece in graph.pieces} == {0.0}


@pytest.mark.parametrize("side", ["right", "left"])
def test_traffic_keeps_to_its_side(tmp_path, side):
    path = write_blocks(tmp_path / "a.osm")
    _, (graph, *_) = lanes_of(path, tmp_path, side)
    checked = 0
    for piece in graph.pieces:
        steps = np.gradient(piece.points, axis=0)
        x, y = piece.points[:, 0], piece.points[:, 1] + 70.0
        # On the southern street, right of the middle if it goes east.
        here = (np.abs(y) < 5) & (x > -70) & (x < -20)
        if piece.is_way or not here.any():
            continue
        is_right = (y[here] < 0) == (steps[here, 0] > 0)
        assert (is_right == (side == "right")).all()
        np.testing.assert_allclose(np.abs(y[here]), 3.25 / 2, atol=0.1)
        checked += 1
    assert checked == 2


def test_lanes_of_four(blocks):
    """The street across has two lanes a direction, and changes of lane."""
    _, (graph, *_) = blocks
    beside = 0
    for k, piece in enumerate(graph.pieces):
        if piece.right < 0:
            continue
        other = graph.pieces[piece.right]
        assert other.left == k
        assert not other.is_way
        ahead = piece.points[-1] - piece.points[0]
        across = other.points[0] - piece.points[0]
        # It is on the right: clockwise from the driving direction.
        assert ahead[0] * across[1] - ahead[1] * across[0] < 0
        assert np.linalg.norm(across) == pytest.approx(12.5 / 4, abs=0.1)
        beside += 1
    assert beside >= 4


def test_turns_follow_the_rules(blocks):
    """Left turns end in the innermost lane, right turns in the outermost."""
    _, (graph, *_) = blocks
    seen = set()
    for piece in graph.pieces:
        if piece.is_way:
            continue
        for k in piece.after:
            way = graph.pieces[k]
            a, b = way.points[-1] - way.points[-2], piece.points[-1]
            before = piece.points[-1] - piece.points[-2]
            turn = np.degrees(
                np.arctan2(
                    before[0] * a[1] - before[1] * a[0], before[:2] @ a[:2]
                )
            )
            assert abs(turn) < 126.0
            following = graph.pieces[way.after[0]]
            if turn > 60 and b[0] < 0 and abs(b[1] + 70) < 5:
                # Innermost: there is no lane on the left.
                assert following.left == -1
                assert following.right >= 0
                seen.add("left")
            if turn < -60 and b[0] > 0 and abs(b[1] + 70) < 5:
                assert following.right == -1
                assert following.left >= 0
                seen.add("right")
    assert seen == {"left", "right"}


def test_limits_and_dead_ends(blocks):
    _, (graph, *_) = blocks
    assert {piece.limit for piece in graph.pieces} == {13.411, 13.889}
    # No vehicle turns round in a street that ends.
    assert max(piece.points[:, 0].max() for piece in graph.pieces) < 100


def test_a_signal_governs_its_junction(blocks):
    _, (graph, *_) = blocks
    signalled = [p for p in graph.pieces if p.phase >= 0]
    assert {p.phase for p in signalled} == {0, 1}
    assert all(p.is_way for p in signalled)
    # One phase is for the street along, the other for the one across.
    phases = {True: set(), False: set()}
    for piece in signalled:
        place = piece.points[0, :2] - (0, -70)
        assert np.hypot(*place) < 25
        phases[bool(abs(place[1]) > abs(place[0]))].add(piece.phase)
    assert len(phases[True]) == len(phases[False]) == 1
    assert phases[True] != phases[False]
    assert len({piece.junction for piece in signalled}) == 1
    assert all(
        p.phase == -1
        for p in graph.pieces
        if p.is_way and np.hypot(*(p.points[0, :2] - (0, -70))) > 40
    )


def test_walkers_have_sidewalks_and_a_crossing(blocks):
    city, (graph, walkways, _) = blocks
    (crossing,) = graph.crossings
    np.testing.assert_allclose(
        np.sort(crossing.line[:, 0]), [-WIDTH / 2, WIDTH / 2],
        atol=0.1,
    )  # fmt: skip
    np.testing.assert_allclose(crossing.line[:, 1], 5.0, atol=0.1)
    over = [way for way in walkways if way.crossing == 0]
    assert len(over) == 1
    beside = [way for way in walkways if way.crossing < 0]
    # Each sidewalk is cut at the crossing.
    assert sorted(
        sum(end in (way.start, way.end) for way in beside)
        for end in (over[0].start, over[0].end)
    ) == [2, 2]
    walked = surface(city, "Sidewalk")
    for way in beside:
        line = shapely.LineString(way.points[:, :2])
        assert walked.covers(line.buffer(way.half_width))
        assert (way.points[:, 2] == 0.12).all()
    # Vehicles cross it on a way, for which they need a permit.
    for piece, line in zip(graph.pieces, lines(graph), strict=True):
        assert piece.is_way or not line.intersects(crossing.area)


def test_a_wall_closes_its_lanes(tmp_path):
    """Lanes in which something stands are left out, and what leads there."""
    path = write_blocks(tmp_path / "a.osm", wall=True)
    _, (graph, *_) = lanes_of(path, tmp_path)
    wall = shapely.LineString([(80, -10), (100, -10)])
    assert not any(line.dwithin(wall, 1.3) for line in lines(graph))


def test_one_way_streets(tmp_path):
    path = write_blocks(tmp_path / "a.osm", oneway="yes")
    _, (graph, *_) = lanes_of(path, tmp_path)
    eastwards = [
        np.gradient(piece.points[:, 0])[piece.points[:, 1] < -67]
        for piece in graph.pieces
        if not piece.is_way
    ]
    assert sum(map(len, eastwards)) > 100
    assert min(steps.min() for steps in eastwards if len(steps)) > 0


@pytest.mark.parametrize("is_cut", [False, True])
def test_lanes_do_not_fold_in_sharp_bends(tmp_path, is_cut):
    """Each of four lanes turns by 360 deg around a rectangle, and no more.

    Its corners lie within a street, or where one street ends and another
    begins.
    """
    osm = OsmWriter()
    nodes = [osm.node(*xy) for xy in CORNERS]
    nodes.append(nodes[0])
    for part in pairwise(nodes) if is_cut else (nodes,):
        osm.way_of(part, highway="tertiary", lanes="4", width="14")
    osm.box(-40, -30, 80, 60, building="yes")
    _, (graph, *_) = lanes_of(osm.write(tmp_path / "a.osm"), tmp_path)
    total = 0.0
    for piece in graph.pieces:
        x, y = np.diff(piece.points[:, :2], axis=0).T
        turns = np.abs(np.diff(np.unwrap(np.arctan2(y, x))))
        assert turns.max() < np.radians(50.0)
        total += turns.sum()
    assert total == pytest.approx(4 * 2 * np.pi, rel=0.05)


def test_two_lanes_merge_on_their_ways(tmp_path):
    """They stay apart where a street of four lanes goes on with two."""
    osm = OsmWriter()
    around = [osm.node(*xy) for xy in CORNERS]
    south, north = osm.node(0, -70), osm.node(0, 70)
    middle = osm.node(0, 0)
    nodes = [around[0], south, around[1], around[2], north, around[3]]
    osm.way_of([*nodes, around[0]], highway="tertiary", lanes="2")
    osm.way_of([south, middle], highway="primary", lanes="4", width="13")
    osm.way_of([middle, north], highway="primary", lanes="2", width="6.5")
    osm.box(-70, -35, 40, 70, building="yes")
    osm.box(30, -35, 40, 70, building="yes")
    _, (graph, *_) = lanes_of(osm.write(tmp_path / "a.osm"), tmp_path)
    (inner,) = (k for k in graph.lanes if graph.pieces[k].right >= 0)
    outer = graph.pieces[inner].right
    one, other = (lines(graph)[k] for k in (inner, outer))
    assert one.distance(other) == pytest.approx(13 / 4, abs=0.05)
    ways = [graph.pieces[k].after for k in (inner, outer)]
    assert len({graph.pieces[way].after for (way,) in ways}) == 1


def test_no_lane_without_a_round_trip(tmp_path):
    osm = OsmWriter()
    osm.way([(0, 0), (200, 0)], highway="primary")
    osm.box(20, 30, 40, 70, building="yes")
    _, found = lanes_of(osm.write(tmp_path / "a.osm"), tmp_path)
    assert found is None


def test_no_lanes_without_streets_near_the_drives(tmp_path):
    city = import_openstreetmap(write_blocks(tmp_path / "a.osm"), None)
    drive = WaypointRoute(ROUTE + 5000.0, ROUTE + 5000.0)
    for streets in ((), city.streets):
        found = lane_text_of_streets(
            streets,
            city.street_places,
            city.objects,
            (),
            [drive],
            "right",
        )
        assert found is None


def boxes(places, yaw, size):
    c, s = np.cos(yaw), np.sin(yaw)
    reach = np.array([(1, 1), (-1, 1), (-1, -1), (1, -1)]) * np.array(size) / 2
    corners = [
        (places[:, 0] + x * c - y * s, places[:, 1] + x * s + y * c)
        for x, y in reach
    ]
    return shapely.polygons(np.array(corners).transpose(2, 0, 1))


@pytest.mark.slow
@pytest.mark.night
def test_nobody_meets_anybody(blocks):
    """Two minutes with the ego car on the southern street."""
    city, (graph, walkways, _) = blocks

    def ego(t):
        x = np.minimum(8.0 * t - 86.0, 86.0)
        return np.column_stack([x, np.full(len(x), -71.7)]), np.zeros(len(x))

    plan = plan_traffic(
        graph, walkways, vehicles=12, walkers=12, seed=4, duration=120.0,
        ego=ego, ego_box=EGO_BOX,
    )  # fmt: skip
    assert len(plan.kinds) == plan.walkers.values.shape[1] == 12
    paved = surface(city).buffer(0.1)
    shapely.prepare(paved)
    on_street = []
    crossed = 0
    for t in np.arange(0.0, 120.0, 0.25):
        xy, yaw = ego(np.array([t]))
        xy[:, 0] += (EGO_BOX.rear + EGO_BOX.front) / 2
        length = EGO_BOX.front - EGO_BOX.rear
        found = [boxes(xy, yaw, (length, 2 * EGO_BOX.half_width))]
        where = plan.vehicles.at(t)[0]
        found += [
            boxes(row[None, :2], row[None, 3], kind.size[:2])
            for row, kind in zip(where, plan.kinds, strict=True)
        ]
        on_street += [
            shapely.area(shapely.intersection(one, paved)) / shapely.area(one)
            for one in found[1:]
        ]
        feet = plan.walkers.at(t)[0]
        found.append(boxes(feet[:, :2], feet[:, 3], WALKER_SIZE[:2]))
        crossed += int((np.abs(feet[:, 0]) < 4).sum())
        every = np.concatenate(found)
        a, b = shapely.STRtree(every).query(every, predicate="intersects")
        assert not (a < b).any()
    part = np.concatenate(on_street)
    # Long vehicles swing over the kerbs of corners without a radius.
    assert (part > 0.999).mean() > 0.95
    assert part.min() > 0.6
    assert crossed > 0
    travelled = np.abs(np.diff(plan.vehicles.values[..., :2], axis=0)).sum(0)
    assert (travelled.sum(axis=1) > 50.0).mean() > 0.8


@pytest.mark.slow
@pytest.mark.night
def test_an_import_carries_traffic(tmp_path):
    path = write_blocks(tmp_path / "a.osm")
    folder = tmp_path / "town"
    import_city(path, folder, ImportOptions(dressed=True))
    scenario = load_scenario(folder / "sequence_01.yaml")
    assert isinstance(plan_drive(scenario), Trajectory)
    plan = plan_scenario_traffic(scenario.with_traffic(5), plan_drive(scenario))
    assert len(plan.kinds) == 5
    with pytest.raises(InputError, match=r"vehicles: 900 .* hold \d+$"):
        plan_scenario_traffic(scenario.with_traffic(900), plan_drive(scenario))


@pytest.mark.slow
@pytest.mark.night
def test_things_in_the_lanes_give_way_to_traffic(tmp_path):
    """Parked cars on a lane are there without traffic only."""
    path = write_blocks(tmp_path / "a.osm")
    folder = tmp_path / "town"
    import_city(path, folder, ImportOptions(dressed=True))
    file = read_lanes(folder / "lanes.json")
    assert file.in_the_way
    scenario = load_scenario(folder / "sequence_01.yaml")
    plain, busy = (
        _names(load_drive(DrivePlan(one)).world)
        for one in (scenario, scenario.with_traffic(5))
    )
    assert plain - busy == set(file.in_the_way)


def _names(world):
    inspector = world.scene_graph.model_inspector()
    return {
        structure_name(inspector.GetName(geometry))
        for geometry in inspector.GetAllGeometryIds()
    }
