"""A CityJSON file becomes a map: stages, drives, scans."""

import csv
from pathlib import Path
import re
import resource
import shlex

from helpers.imported_cities import read_city
from helpers.small_cityjson import CityWriter, write_blocks
import numpy as np
import pytest
from shapely.geometry import LineString, box
from typer.testing import CliRunner
import yaml

from cns_drake.command_line import app
from cns_drake.scenarios import load_scenario, plan_drive
from evaluation.base import InputError
from evaluation.clouds import read_cloud
from evaluation.drives import open_drive
from worlds.imports import ImportOptions, import_city

pytestmark = pytest.mark.slow

YEARS = (1915, 1945, 1980)
HOUSES = [
    box(52 * (k % 3) + 20 * i, 52 * (k // 3) + 20 * j,
        52 * (k % 3) + 20 * i + 20, 52 * (k // 3) + 20 * j + 20)
    for k in range(9) for i in (0, 1) for j in (0, 1)
]  # fmt: skip


def run(*arguments):
    return CliRunner().invoke(app, [str(a) for a in arguments])


@pytest.fixture(scope="module")
def blocks(tmp_path_factory):
    folder = tmp_path_factory.mktemp("imports")
    source = write_blocks(folder / "blocks.json")
    output = folder / "blocks"
    report = import_city(source, output, ImportOptions(years=YEARS))
    return output, report


def stage_names(folder, stage):
    text = (folder / f"stage_{stage}.sdf").read_text()
    return {
        name.split("/")[0] for name in re.findall('visual name="([^"]+)', text)
    }


def test_stages_are_what_was_built_until_then(blocks):
    folder, report = blocks
    names = {
        f"house.{k}.{h}": 1900 + 10 * k for k in range(8) for h in range(4)
    }
    undated = {f"house.8.{h}" for h in range(4)}
    for stage, year in zip(("01", "02", "03"), YEARS, strict=True):
        built = {name for name, when in names.items() if when <= year}
        assert stage_names(folder, stage) == built | undated | {"ground"}
    assert report.undated == 4
    assert report.stages == {"01": 12, "02": 24, "03": 36}
    with (folder / "structures.csv").open() as stream:
        rows = list(csv.DictReader(stream))
    assert {row["name"] for row in rows} == {*names, *undated, "ground"}
    assert rows[0]["class"] == "terrain"
    facts = yaml.safe_load((folder / "import.yaml").read_text())
    assert facts["years"] == {"01": 1915, "02": 1945, "03": 1980}
    assert facts["origin"][:2] == [85072.0, 446072.0]


@pytest.mark.parametrize(
    ("undated", "numbers"),
    [("first", [12, 24, 36]), ("last", [8, 20, 36]),
     ("never", [8, 20, 32])],
)  # fmt: skip
def test_what_becomes_of_buildings_without_a_year(tmp_path, undated, numbers):
    source = write_blocks(tmp_path / "blocks.json")
    report = import_city(
        source, tmp_path / "out", ImportOptions(YEARS, undated=undated)
    )
    assert list(report.stages.values()) == numbers
    assert report.undated == 4


def test_drives_have_room_and_share_a_part(blocks):
    folder, report = blocks
    assert len(report.drives) == 2
    origin = np.array([72.0, 72.0])
    paths = {}
    for letter, name in (("b", "sequence_01"), ("a", "sequence_03")):
        scenario = load_scenario(folder / f"{name}.yaml")
        assert scenario.waypoints.endswith(f"route_{letter}.csv")
        trajectory = plan_drive(scenario)
        times = np.arange(0.0, trajectory.duration, 0.2)
        paths[letter] = LineString(trajectory.positions(times)[:, :2] + origin)
    for letter, path in paths.items():
        # A car is 1.9 m wide.
        assert min(path.distance(house) for house in HOUSES) > 1.2
        assert path.length > 80.0
        assert path.is_simple, letter
    shared = paths["a"].intersection(paths["b"].buffer(4.0)).length
    assert 0.1 < shared / paths["a"].length < 0.9
    others = {
        load_scenario(folder / f"other_0{k}.yaml").waypoints for k in (1, 3)
    }
    assert {Path(one).name for one in others} == {"route_a.csv", "route_b.csv"}


def test_a_scan_sees_the_walls(blocks, tmp_path):
    folder, _ = blocks
    out = tmp_path / "scan.pcd"
    # In the middle of the street between the first two blocks.
    pose = ["-26", "-52", "1.5", "0", "0", "0"]
    for stage in ("01", "03"):
        result = run(
            "scan", folder / f"stage_{stage}.sdf", "--pose", *pose,
            "--output", out,
        )  # fmt: skip
        assert result.exit_code == 0, result.output
        cloud = read_cloud(out)
        level = np.abs(cloud["z"]) < 1.0
        left = level & (np.abs(cloud["y"]) < 10) & (cloud["x"] < 0)
        np.testing.assert_allclose(cloud["x"][left], -6.0, atol=2e-3)
        assert left.sum() > 100
    right = level & (np.abs(cloud["y"]) < 10) & (cloud["x"] > 0)
    np.testing.assert_allclose(cloud["x"][right], 6.0, atol=2e-3)


def test_points_have_their_building(blocks, tmp_path):
    folder, _ = blocks
    scenario = folder / "sequence_03.yaml"
    result = run("simulate", scenario, "--frames", "1", "--output", tmp_path)
    assert result.exit_code == 0, result.output
    scan = open_drive(tmp_path / "blocks_03").scan(0)
    assert set(np.unique(scan["label"])) == {50, 72}
    with (folder / "structures.csv").open() as stream:
        names = {int(r["instance"]): r["name"] for r in csv.DictReader(stream)}
    seen = {names[instance] for instance in np.unique(scan["instance"])}
    assert len(seen) > 4


def test_a_summary_of_ten_lines(tmp_path):
    city = CityWriter()
    years = (1900, 1960, None)
    for k, year in enumerate(years):
        for side in (0.0, 30.0):
            city.box(
                f"house_{k}_{side:g}", 40.0 * k, side, (36.0, 20.0, 6.0),
                attributes={"yearOfConstruction": year},
            )  # fmt: skip
    for k in range(6):
        geometry = {"type": f"Shape{k}", "lod": "1", "boundaries": []}
        city.add(f"thing_{k}", "GenericCityObject", geometry)
    source = city.write(tmp_path / "city.json")
    output = tmp_path / "a town" / "town"
    output.parent.mkdir()
    result = run(
        "import", source, "--years", "1930", "1990", "--output", output
    )
    assert result.exit_code == 0, result.output
    lines = result.stdout.splitlines()
    assert len(lines) <= 10
    assert "kinds more" in result.stdout
    assert re.search(r"without a year +2", result.stdout)
    counts = (output / "import.txt").read_text().splitlines()
    assert counts[0] == "in the city: 6 of 12 elements of the file (50 %)"
    assert "Building: 6" in counts
    for k in range(6):
        kind = f"geometry of type Shape{k}, left out"
        share = "8.3 % of the elements of the file"
        assert f"{kind}: 1, {share}, such as thing_{k}" in counts
    assert re.fullmatch(
        f"written +{re.escape(str(output))}, with all counts in import.txt",
        lines[-2],
    )
    words = shlex.split(lines[-1])
    assert words[:3] == ["next", "cns-drake", "reproduce"]
    assert Path(words[3]) == output


@pytest.mark.parametrize("dates", [(None, None), (1900, 1910)])
def test_years_that_change_nothing(tmp_path, dates):
    city = CityWriter()
    for k, year in enumerate(dates):
        city.box(
            f"house_{k}", 40.0 * k, 0.0, (20.0, 20.0, 6.0),
            attributes={"yearOfConstruction": year},
        )  # fmt: skip
    source = city.write(tmp_path / "city.json")
    result = run(
        "import", source, "--years", "1950", "2000",
        "--output", tmp_path / "town",
    )  # fmt: skip
    assert result.exit_code == 0, result.output
    warnings = [line for line in result.stderr.splitlines() if "--grow" in line]
    dated = sum(year is not None for year in dates)
    assert len(warnings) == 1
    assert f"{dated} buildings have a year, {2 - dated} have" in warnings[0]


@pytest.mark.usefixtures("overviews")
def test_no_street_and_no_drive(tmp_path):
    city = CityWriter()
    city.box("a", 0, 0, (10, 10, 5))
    source = city.write(tmp_path / "city.json")
    result = run("import", source, "--output", tmp_path / "alone")
    assert result.exit_code == 0, result.output
    assert "draw waypoints on" in result.output
    assert (tmp_path / "alone" / "from_above.png").stat().st_size > 3000
    assert not list((tmp_path / "alone").glob("sequence_*"))


def test_roads_are_driven_where_there_are_some(tmp_path):
    city = CityWriter()
    city.box("a", 0, 0, (10, 10, 5))
    for k, (low, high) in enumerate(
        [((0, 20), (150, 26)), ((100, 26), (106, 120))]
    ):
        corners = [low, (high[0], low[1]), high, (low[0], high[1])]
        road = {
            "type": "MultiSurface",
            "lod": "1",
            "boundaries": [[city.ring([(x, y, 0.0) for x, y in corners])]],
        }
        city.add(f"road{k}", "Road", road)
    source = city.write(tmp_path / "city.json")
    output = tmp_path / "roads"
    report = import_city(source, output, ImportOptions())
    facts = yaml.safe_load((output / "import.yaml").read_text())
    origin = np.array(facts["origin"][:2]) - [85000.0, 446000.0]
    ways = box(0, 20, 150, 26).union(box(100, 26, 106, 120))
    assert report.drives[0] > 120.0
    scenario = load_scenario(output / "sequence_01.yaml")
    trajectory = plan_drive(scenario)
    times = np.arange(0.0, trajectory.duration, 0.2)
    path = LineString(trajectory.positions(times)[:, :2] + origin)
    # The inner corner has no kerb, and the wheels cut it a little.
    assert path.within(ways)
    assert path.buffer(0.8).difference(ways).area < 5.0


@pytest.mark.parametrize(
    ("options", "fault"),
    [
        (["--years", "1950", "1950"], "each year must be after the one before"),
        (["1950"], "give one file"),
        (["--lod", "7"], "no object has a surface"),
    ],
)
def test_options_that_cannot_be(tmp_path, capsys, options, fault):
    source = write_blocks(tmp_path / "blocks.json")
    result = run("import", source, *options, "--output", tmp_path / "out")
    assert isinstance(result.exception, InputError)
    assert fault in str(result.exception)
    assert not (tmp_path / "out").exists()
    assert not list(tmp_path.glob("out*"))


def year_of(tmp_path, attributes, name=None):
    city = CityWriter()
    city.box("a", 0.0, 0.0, (20.0, 20.0, 6.0), attributes=attributes)
    imported = read_city(
        city.write(tmp_path / "city.json"), year_attribute=name
    )
    (one,) = imported.objects
    return one.year


@pytest.mark.parametrize(
    ("attributes", "year"),
    [
        ({"oorspronkelijkbouwjaar": 1932}, 1932),
        ({"yearOfConstruction": "1932"}, 1932),
        ({"dateOfConstruction": "1932-05-01"}, 1932),
        ({"year_built": 1932.0}, 1932),
        ({"bouwjaar": None, "start_date": "about 1932"}, 1932),
        ({"oorspronkelijkbouwjaar": 0}, None),
        ({"oorspronkelijkbouwjaar": True}, None),
        ({"height": 1932}, None),
        ({"oorspronkelijkbouwjaar": 9999}, None),
        ({"bouwjaar": 1005, "start_date": "1932"}, 1932),
        ({"year_built": "1005"}, 1005),
        ({"start_date": "0000"}, None),
        ({"yearOfConstruction": "19321"}, None),
    ],
)
def test_years_are_found(tmp_path, attributes, year):
    assert year_of(tmp_path, attributes) == year


def test_years_that_are_none_or_to_come_are_counted(tmp_path):
    city = CityWriter()
    years = (9999, 1005, 9998, 1950, None)
    for k, year in enumerate(years):
        city.box(
            f"house_{k}", 40.0 * k, 0.0, (20.0, 20.0, 6.0),
            attributes={"oorspronkelijkbouwjaar": year},
        )  # fmt: skip
    source = city.write(tmp_path / "city.json")
    for undated, more in (
        ("first", set()),
        ("never", {("building without a year, left out", 3, "house_0")}),
    ):
        report = import_city(
            source,
            tmp_path / undated,
            ImportOptions((1900, 2000), undated=undated),
        )
        assert report.undated == 3
        assert set(report.faults) == {
            ("9999 in place of a year, taken as no year", 1, "house_0"),
            ("1005 in place of a year, taken as no year", 1, "house_1"),
            ("year after today", 1, "house_2"),
            ("building built after the last stage, left out", 1, "house_2"),
            *more,
        }


def test_a_year_of_one_s_own(tmp_path):
    attributes = {"built": 1750, "bouwjaar": 1900}
    assert year_of(tmp_path, attributes, "built") == 1750
    assert year_of(tmp_path, attributes, "never") is None


def test_far_structures_are_left_out(tmp_path):
    city = CityWriter()
    for k in range(4):
        city.box(f"house_{k}", 40.0 * k, 0.0, (20.0, 20.0, 6.0))
    city.box("far", 3e6, -2e6, (20.0, 20.0, 6.0))
    # A lake over half a continent, and a wall into space.
    city.box("high", 10.0, 50.0, (20.0, 20.0, 1e6))
    city.box("unknown", 10.0, 90.0, (20.0, 20.0, 6.0), z=-9999.0)
    lake = {
        "type": "MultiSurface",
        "lod": "1",
        "boundaries": [[city.ring([(0, 0, 0), (2e6, 0, 0), (0, 2e6, 0)])]],
    }
    city.add("lake", "WaterBody", lake)
    source = city.write(tmp_path / "city.json")
    report = import_city(source, tmp_path / "town", ImportOptions())
    assert report.stages == {"01": 4}
    kind = "object more than 10 km away or 3 km higher or lower, left out"
    assert (kind, 4, "far") in report.faults
    facts = yaml.safe_load((tmp_path / "town/import.yaml").read_text())
    assert facts["origin"] == [85070.0, 446035.0, 3.0]


@pytest.mark.night
def test_large_surfaces_are_no_burden(tmp_path):
    city = CityWriter()
    for x in range(0, 200, 40):
        city.box(f"low_{x}", x, 0.0, (30.0, 20.0, 6.0))
        city.box(f"high_{x}", x, 32.0, (30.0, 20.0, 6.0))
    far = 9000.0
    ring = [(-far, -far, 0), (far, -far, 0), (far, far, 0), (-far, far, 0)]
    land = {"type": "MultiSurface", "lod": "1"}
    land["boundaries"] = [[city.ring(ring)]]
    city.add("land", "LandUse", land)
    source = city.write(tmp_path / "city.json")
    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    report = import_city(source, tmp_path / "town", ImportOptions())
    after = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    assert report.drives[0] > 100.0
    assert after - before < 1_500_000  # [kB]
