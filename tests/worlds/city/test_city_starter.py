"""A user's own city, made from its roads alone."""

import subprocess
import sys

import numpy as np
import pytest
from shapely import Point
from typer.testing import CliRunner
import yaml

from cns_drake.command_line import app
from cns_drake.scenarios import load_scenario, plan_drive
from evaluation.base import InputError
from evaluation.drives import open_drive
from worlds.city import load_plan, load_stages, make_city, start_city
from worlds.roads import load_road_network

# By day, the recipe "start a city" starts one.
pytestmark = [pytest.mark.slow, pytest.mark.night]

ROADS = """
defaults: {lanes: [1, 1], lane_width: 3.5, sidewalk: 2.5, kerb_height: 0.15,
           speed_limit: 13.9}
junctions:
  a: {position: [0, 0], kerb_radius: 6}
  b: {position: [70, 0], kerb_radius: 6}
  c: {position: [70, 60], kerb_radius: 6}
  d: {position: [0, 60], kerb_radius: 6}
roads:
  south: {start: a, end: b}
  east: {start: b, end: c}
  north: {start: c, end: d}
  west: {start: d, end: a}
  loop: {start: b, end: c, via: [[130, 0, 22], [130, 60, 22]], parking: 2.2}
"""
INPUTS = ["city.yaml", "sequence_01.yaml", "sequence_02.yaml", "stages.yaml"]


def run(*words):
    return CliRunner().invoke(app, [*map(str, words)])


@pytest.fixture(scope="module")
def town(tmp_path_factory):
    """A folder with roads, made into a city by the command."""
    folder = tmp_path_factory.mktemp("own") / "town"
    folder.mkdir()
    (folder / "roads.yaml").write_text(ROADS)
    done = run("city", folder, "--new")
    assert done.exit_code == 0, done.stderr
    assert done.stdout == ""
    return folder


def test_the_plan_has_a_district_for_each_block(town):
    plan = load_plan(town / "city.yaml")
    network = load_road_network(town / "roads.yaml")
    blocks = [d for d in plan.districts if d.block is not None]
    assert len(blocks) == 2
    for district in blocks:
        assert not network.areas.carriageway.contains(Point(district.block))
    assert plan.districts[-1].name == "outskirts"


def test_the_first_stage_lacks_the_east(town):
    city = make_city(town)
    stages = load_stages(
        town / "stages.yaml", [structure.name for structure in city.structures]
    )
    absent = stages.absent("01")
    tall = [
        s
        for s in city.structures
        if s.semantic_class in ("building", "vegetation")
    ]
    missing = [s.xyz[0] for s in tall if s.name in absent]
    standing = [s.xyz[0] for s in tall if s.name not in absent]
    assert len(missing) > 10
    assert max(standing) <= min(missing)


def test_existing_files_stay(tmp_path):
    (tmp_path / "roads.yaml").write_text(ROADS)
    assert [path.name for path in sorted(start_city(tmp_path))] == INPUTS
    before = {name: (tmp_path / name).read_bytes() for name in INPUTS}
    (tmp_path / "sequence_02.yaml").unlink()
    told = []
    (path,) = start_city(tmp_path, 1, told.append)
    assert path.name == "sequence_02.yaml"
    begin = {f"kept: {tmp_path / n};" for n in INPUTS if n != path.name}
    assert {line.partition(" delete")[0] for line in told} == {
        *begin,
        f"writing {path}",
    }
    del before[path.name]
    after = {name: (tmp_path / name).read_bytes() for name in before}
    assert after == before


@pytest.mark.parametrize(
    "words", [("--seed", 5), ("--seed", 0), ("--new", "--check")]
)
def test_options_without_effect_are_refused(town, words):
    done = run("city", town, *words)
    assert isinstance(done.exception, InputError)
    assert str(done.exception).startswith(words[0])


@pytest.mark.night
def test_other_seeds_draw_other_towns(tmp_path, town):
    (tmp_path / "roads.yaml").write_text(ROADS)
    start_city(tmp_path, seed=1)
    for name in ("city.yaml", "sequence_01.yaml"):
        assert (tmp_path / name).read_text() != (town / name).read_text()


def test_it_is_listed_and_driven(town, tmp_path):
    listed = run("list", town)
    assert listed.exit_code == 0
    assert [line.split()[0] for line in listed.stdout.splitlines()[1:]] == [
        "town_01",
        "town_02",
    ]
    assert listed.stderr == ""
    done = run(
        "simulate",
        town / "sequence_02.yaml",
        "--frames",
        2,
        "--output",
        tmp_path,
    )
    assert done.exit_code == 0, done.stderr
    drive = open_drive(tmp_path / "town_02")
    # The vehicle's LiDAR is vertically above the first point of its path.
    start = plan_drive(load_scenario(town / "sequence_02.yaml")).pose(0.0)
    np.testing.assert_allclose(
        drive.X_WS[0][:3, 3],
        np.add(start.translation(), [0, 0, 1.6]),
        atol=1e-9,
    )
    assert len(drive.scan(1)) > 10_000


def test_roads_that_cannot_be_used_are_named(tmp_path):
    roads = yaml.safe_load(ROADS)
    roads["roads"]["east"]["end"] = "nowhere"
    (tmp_path / "roads.yaml").write_text(yaml.safe_dump(roads))
    done = subprocess.run(
        [sys.executable, "-m", "cns_drake", "city", ".", "--new"],
        cwd=tmp_path,
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 2
    # A slow machine says what it does before.
    *_, line = done.stderr.splitlines()
    assert "roads.yaml: roads.east.end: no junction 'nowhere'" in line
    assert not (tmp_path / "city.yaml").exists()
