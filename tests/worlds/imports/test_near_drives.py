"""Imports of structures near a drive only, and a user's own drives."""

import csv

from helpers.small_cityjson import CityWriter, write_blocks
import numpy as np
import pytest
from shapely.geometry import LineString, box

from cns_drake.scenarios import load_scenario, plan_drive
from evaluation.base import InputError
from worlds.imports import ImportOptions, import_city

# The map's origin is the middle of the town of blocks.
MIDDLE = 72.0
WAY = [(-26.0, -70.0), (-26.0, 20.0)]
HOUSES = {
    f"house.{block}.{house}": box(x, y, x + 20.0, y + 20.0)
    for block in range(9)
    for house in range(4)
    for x, y in [
        (
            52.0 * (block % 3) + 20.0 * (house % 2) - MIDDLE,
            52.0 * (block // 3) + 20.0 * (house // 2) - MIDDLE,
        )
    ]
}


def write_way(path, points=WAY):
    lines = ["x,y", *(f"{x},{y}" for x, y in points)]
    path.write_text("\n".join(lines))
    return path


def names(folder):
    with (folder / "structures.csv").open() as stream:
        return {row["name"] for row in csv.DictReader(stream)}


@pytest.mark.parametrize("within", [7.0, 20.0, 50.0])
def test_only_structures_near_an_own_drive_are_kept(tmp_path, within):
    source = write_blocks(tmp_path / "blocks.json")
    way = write_way(tmp_path / "way.csv")
    options = ImportOptions((1915, 1980), along=way, within=within)
    report = import_city(source, tmp_path / "town", options)
    line = LineString(WAY)
    near = {n for n, house in HOUSES.items() if house.distance(line) <= within}
    assert 0 < len(near) < len(HOUSES)
    assert names(tmp_path / "town") == {*near, "ground"}
    assert report.stages["02"] == len(near)
    left_out = {kind: number for kind, number, _ in report.faults}
    assert left_out["structure far from the drives, left out"] == 36 - len(near)
    scenario = load_scenario(tmp_path / "town" / "sequence_02.yaml")
    path = plan_drive(scenario)
    np.testing.assert_allclose(path.pose(0.0).translation()[:2], WAY[0])
    assert path.length == pytest.approx(90.0, abs=0.1)


@pytest.mark.slow
def test_structures_near_the_proposed_drives(tmp_path):
    source = write_blocks(tmp_path / "blocks.json")
    options = ImportOptions(within=8.0)
    report = import_city(source, tmp_path / "town", options)
    whole = import_city(source, tmp_path / "whole", ImportOptions())
    assert report.drives == whole.drives
    lines = [
        np.loadtxt(
            tmp_path / "town" / f"route_{k}.csv", delimiter=",", skiprows=1
        )
        for k in "ab"
    ]
    for name, house in HOUSES.items():
        gap = min(house.distance(LineString(line[:, :2])) for line in lines)
        if gap < 7.0:
            assert name in names(tmp_path / "town")
        if gap > 12.0:
            assert name not in names(tmp_path / "town")
    assert len(names(tmp_path / "town")) < 37


def test_terrain_is_cut(tmp_path):
    city = CityWriter()
    city.box("house", 0.0, 5.0, (10.0, 10.0, 6.0))
    city.box("far", 300.0, 5.0, (10.0, 10.0, 6.0))
    triangles = []
    for x in range(-100, 400, 20):
        for y in range(-60, 60, 20):
            a, b, c, d = city.ring(
                [(x, y, 0), (x + 20, y, 0), (x + 20, y + 20, 0), (x, y + 20, 0)]
            )
            triangles += [[[a, b, c]], [[a, c, d]]]
    surface = {"type": "CompositeSurface", "lod": "1", "boundaries": triangles}
    city.add("ground", "TINRelief", surface)
    source = city.write(tmp_path / "city.json")
    whole = import_city(source, tmp_path / "whole", ImportOptions())
    # The origin is the middle of the terrain, 150 m east of the house's.
    way = write_way(tmp_path / "way.csv", [(-170, 0), (-120, 0)])
    options = ImportOptions(along=way, within=15.0)
    report = import_city(source, tmp_path / "town", options)
    assert names(tmp_path / "town") == {"house", "ground"}
    assert 20 < report.triangles < 0.2 * whole.triangles
    mesh = (tmp_path / "town" / "meshes" / "ground_body.obj").read_text()
    corners = np.array(
        [line.split()[1:4] for line in mesh.splitlines() if line[:2] == "v "],
        float,
    )
    assert np.abs(corners[:, 1]).max() <= 40.0
    assert corners[:, 0].min() >= -170 - 35
    assert corners[:, 0].max() <= -120 + 35


@pytest.mark.parametrize(
    ("points", "within", "fault"),
    [
        (
            [(900, 900), (990, 900)],
            20.0,
            "--within: nothing stands within 20 m",
        ),
        (
            [(0, 0), (30, 0), (30, 1), (0, 1)],
            None,
            r"way\.csv: a bend at 2\d\.\d, .* radius of \d\.\d\d m.* 4\.11 m",
        ),
    ],
)
def test_faults_of_drives_of_ones_own(tmp_path, points, within, fault):
    source = write_blocks(tmp_path / "blocks.json")
    way = write_way(tmp_path / "way.csv", points)
    options = ImportOptions(along=way, within=within)
    with pytest.raises(InputError, match=fault):
        import_city(source, tmp_path / "town", options)
    assert not (tmp_path / "town").exists()
