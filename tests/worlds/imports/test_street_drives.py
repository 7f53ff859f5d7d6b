"""Drives in the lanes of streets: sides, one-way streets, overlap, stripes."""

from helpers.imported_cities import read_city
from helpers.small_osm import OsmWriter
import numpy as np
import pytest
from shapely.geometry import LineString, Point

from cns_drake.scenarios import load_scenario, plan_drive
from evaluation.base import InputError
from worlds.imports import ImportOptions, import_city

STEP = 90.0
WIDTH = 8.0


def write_grid(path, one_way=(), columns=4, rows=3, more=None, **extra):
    """Streets on a grid; those named, "x0" or "y2", are one-way.

    Returns the way's tags and line, by name.
    """
    osm = OsmWriter()
    low = -np.array([columns - 1, rows - 1]) * STEP / 2
    node = {
        (k, m): osm.node(low[0] + STEP * k, low[1] + STEP * m)
        for k in range(columns)
        for m in range(rows)
    }
    streets = {}
    for name, places in {
        **{f"x{k}": [(k, m) for m in range(rows)] for k in range(columns)},
        **{f"y{m}": [(k, m) for k in range(columns)] for m in range(rows)},
    }.items():
        tags = {"highway": "residential", "width": str(WIDTH), **extra}
        if name in one_way:
            tags["oneway"] = one_way[name]
        osm.way_of([node[place] for place in places], **tags)
        streets[name] = (
            tags.get("oneway"),
            LineString([low + STEP * np.array(place) for place in places]),
        )
    # Buildings surround the origin, which the map puts into their middle.
    for k, m in ((0, 0), (columns - 2, rows - 2)):
        x, y = low + STEP * (np.array([k, m]) + 0.5)
        osm.box(x - 15, y - 15, 30, 30, building="yes")
    if more is not None:
        more(osm)
    osm.write(path)
    return streets


def drives_of(folder):
    """Returns the places (N, 2) of both drives, and their directions."""
    for name in ("sequence_01", "other_01"):
        trajectory = plan_drive(load_scenario(folder / f"{name}.yaml"))
        times = np.arange(0.0, trajectory.duration, 0.1)
        jet = trajectory.path.evaluate(trajectory.path_parameter(times)[0])
        yield jet.p[:, :2], np.column_stack([np.cos(jet.yaw), np.sin(jet.yaw)])


@pytest.mark.sampled(3)
@pytest.mark.parametrize("side", ["right", "left"])
@pytest.mark.parametrize(
    "one_way",
    [
        {},
        {"y0": "yes", "y1": "-1", "y2": "yes", "x0": "yes", "x2": "-1"},
        {f"x{k}": ("yes", "-1")[k % 2] for k in range(4)},
    ],
)
def test_drives_keep_to_their_lanes(tmp_path, one_way, side):
    streets = write_grid(tmp_path / "city.osm", one_way)
    options = ImportOptions(drive_on=side)
    report = import_city(tmp_path / "city.osm", tmp_path / "town", options)
    assert len(report.drives) == 2
    assert min(report.drives) > 150.0
    checked = 0
    for places, directions in drives_of(tmp_path / "town"):
        assert LineString(places).is_simple
        for place, direction in zip(places, directions, strict=True):
            near = sorted(
                (line.distance(Point(place)), name)
                for name, (_, line) in streets.items()
            )
            # Away from the junctions.
            if near[1][0] < 26.0:
                continue
            way, line = streets[near[0][1]]
            ends = np.diff(np.array(line.coords)[[0, -1]], axis=0)[0]
            along = ends / np.linalg.norm(ends)
            foot = line.interpolate(line.project(Point(place)))
            off = place - (foot.x, foot.y)
            right = off @ (direction[1], -direction[0])
            assert abs(direction @ along) > 0.97
            if way is None:
                expected = WIDTH / 4 * (1 if side == "right" else -1)
            else:
                expected = 0.0
                assert (direction @ along > 0) == (way == "yes")
            assert right == pytest.approx(expected, abs=0.3)
            checked += 1
    assert checked > 100


def test_drives_share_a_part(tmp_path):
    write_grid(tmp_path / "city.osm")
    import_city(tmp_path / "city.osm", tmp_path / "town", ImportOptions())
    a, b = (LineString(places) for places, _ in drives_of(tmp_path / "town"))
    shared = a.intersection(b.buffer(1.0)).length
    assert 0.1 < shared / a.length < 0.9
    assert a.difference(b.buffer(15.0)).length > 20.0
    assert b.difference(a.buffer(15.0)).length > 20.0


def test_the_file_may_set_the_side(tmp_path):
    write_grid(tmp_path / "city.osm", driving_side="left")
    assert read_city(tmp_path / "city.osm").keeps_left
    write_grid(tmp_path / "city.osm")
    assert not read_city(tmp_path / "city.osm").keeps_left


def test_zebra_crossings_have_stripes(tmp_path):
    osm = OsmWriter()
    osm.box(-5, 20, 10, 10, building="yes")
    nodes = [
        osm.node(-40, 0),
        osm.node(0, 0, highway="crossing", crossing="zebra"),
        osm.node(20, 0, highway="crossing", crossing="unmarked"),
        osm.node(40, 0),
    ]
    osm.way_of(nodes, highway="residential", width="7")
    city = read_city(osm.write(tmp_path / "city.osm"))
    (one,) = (o for o in city.objects if o.object_type == "Crossing")
    assert one.structure.semantic_class == "road"
    a, b, c = np.moveaxis(one.triangles, 1, 0)
    normals = np.cross(b - a, c - a)
    assert (normals[:, 2] > 0).all()
    # Six stripes of 0.5 m by 3 m within the 7 m of the street.
    assert normals[:, 2].sum() / 2 == pytest.approx(6 * 1.5, rel=1e-3)
    low, high = one.triangles.min(axis=(0, 1)), one.triangles.max(axis=(0, 1))
    np.testing.assert_allclose(high - low, [3.0, 5.5, 0.0], atol=5e-3)
    np.testing.assert_allclose((high + low)[2] / 2, 0.01)


def test_a_place_on_another_continent_is_no_way_to_go(tmp_path):
    osm = OsmWriter()
    for x in (-60, -20, 20):
        osm.box(x, 20, 30, 10, building="yes")
    nodes = [osm.node(x, 0) for x in (-100, 0, 100)]
    far = osm.node(-900_000, 0)
    osm.way_of([*nodes, far], highway="residential", width="8")
    osm.write(tmp_path / "city.osm")
    report = import_city(
        tmp_path / "city.osm", tmp_path / "town", ImportOptions()
    )
    assert all(length < 300.0 for length in report.drives)


@pytest.mark.sampled(1)
@pytest.mark.slow
@pytest.mark.parametrize("barrier", ["house", "house around", "fence"])
def test_no_drive_goes_through_a_wall(tmp_path, barrier):
    streets = write_grid(tmp_path / "plain.osm")
    import_city(tmp_path / "plain.osm", tmp_path / "plain", ImportOptions())
    (first, _), _ = drives_of(tmp_path / "plain")
    # The house is in the way of the drive, between two junctions.
    name, line = max(
        ((name, line) for name, (_, line) in streets.items()),
        key=lambda item: sum(
            item[1].distance(Point(p)) < 5.0 for p in first[::10]
        ),
    )
    middle = line.interpolate(STEP / 2)
    x, y = middle.x, middle.y
    shape = {
        "house": Point(x, y).buffer(9.0, cap_style="square"),
        # The house is hollow; its walls are less than a metre thick.
        "house around": LineString([(x - 30, y), (x + 30, y)])
        if name[0] == "y"
        else LineString([(x, y - 30), (x, y + 30)]),
        "fence": LineString([(x - 12, y - 12), (x + 12, y + 12)]),
    }[barrier]
    if barrier == "house around":
        shape = shape.buffer(7.0, cap_style="flat")

    def add_barrier(osm):
        if barrier == "fence":
            osm.way(shape.coords, barrier="fence")
        else:
            osm.way(shape.exterior.coords[:-1], closed=True, building="yes")

    write_grid(tmp_path / "city.osm", more=add_barrier)
    report = import_city(
        tmp_path / "city.osm", tmp_path / "town", ImportOptions()
    )
    assert len(report.drives) == 2
    for places, _ in drives_of(tmp_path / "town"):
        assert LineString(places).distance(shape) > 1.0


@pytest.mark.sampled(1)
@pytest.mark.slow
@pytest.mark.parametrize("columns", [2, 3, 5])
def test_no_import_refuses_its_own_drives(tmp_path, columns):
    write_grid(
        tmp_path / "city.osm", columns=columns, rows=2, start_date="1790"
    )
    for name, years in (("a", (1800, 1900, 2020)), ("b", (2020,))):
        report = import_city(
            tmp_path / "city.osm", tmp_path / name, ImportOptions(years)
        )
        assert len(list((tmp_path / name).glob("route_*"))) == len(
            report.drives
        )
        for path in (tmp_path / name).glob("*_0?.yaml"):
            assert plan_drive(load_scenario(path)).length > 80.0


@pytest.mark.slow
def test_an_import_that_fails_leaves_no_folder(tmp_path):
    write_grid(tmp_path / "city.osm")

    def fail(folder, sizes):
        assert (folder / "stage_01.sdf").exists()
        assert folder.name == "town"
        raise InputError("no")

    def run(finish):
        source, output = tmp_path / "city.osm", tmp_path / "town"
        import_city(source, output, ImportOptions(), finish=finish)

    with pytest.raises(InputError, match="no"):
        run(fail)
    assert {path.name for path in tmp_path.iterdir()} == {"city.osm"}
    run(lambda folder, sizes: None)
    assert (tmp_path / "town" / "stage_01.sdf").exists()
