"""Which packages of `worlds` a drive needs: shapes, and a map its roads."""

import os
from pathlib import Path
import subprocess
import sys

from helpers.small_city import write_small_city
import pytest

from worlds.city import generate_city

ROOT = Path(__file__).parents[2]
# Runs a command or a line of Python, and prints what it has imported.
RUN = """
import sys
try:
    {line}
except SystemExit as end:
    assert not end.code
print(*(name for name in sys.modules if name.startswith("worlds.")))
"""
COMMAND = "from cns_drake.__main__ import main; main()"
WORLD = """<sdf version="1.9"><world name="yard"><model name="yard">
<static>true</static><link name="yard">
<visual name="wall"><pose>5 0 1 0 0 0</pose>
<geometry><box><size>1 4 2</size></box></geometry></visual>
<visual name="ground"><pose>0 0 -0.01 0 0 0</pose>
<geometry><box><size>99 99 0.02</size></box></geometry></visual>
</link></model></world></sdf>
"""
IN_YARD = """
world: yard.sdf
waypoints: way.csv
speeds: {cruise: 5}
driver: {wander: 0.3}
ride: {roughness: B}
"""
IN_TOWN = """
map: town
stage: "02"
route:
  - {road: north, direction: forward, lane: 1, start: 10.0, end: 120.0}
speeds: {cruise: 8.0}
"""
EACH_CHANGE = (
    "parked_cars=1,leaves=0.5,snow=0.2,scaffolds=1,works=1,furniture=1,"
    "roadsides=1,height_limit=4"
)
DRIVE = ("--frames", "1", "--output", "recordings", "--overwrite")


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    folder = tmp_path_factory.mktemp("houses")
    (folder / "yard.sdf").write_text(WORLD)
    (folder / "way.csv").write_text("x,y,z\n-40,-9,0\n40,-9,0\n")
    (folder / "yard.yaml").write_text(IN_YARD)
    (folder / "town.yaml").write_text(IN_TOWN)
    generate_city(write_small_city(folder / "town"))
    return folder


def packages_after(line, folder, *words):
    """Returns the packages of `worlds` that a line of Python imports."""
    done = subprocess.run(
        [sys.executable, "-c", RUN.format(line=line), *words],
        cwd=folder,
        env={**os.environ, "PYTHONPATH": str(ROOT)},
        capture_output=True,
        text=True,
    )
    assert done.returncode == 0, done.stderr
    return {name.split(".")[1] for name in done.stdout.split("\n")[-2].split()}


@pytest.mark.slow
def test_a_scan_needs_shapes_alone(folder):
    take = (
        "from pydrake.math import RigidTransform; import cns_drake; "
        "from cns_drake.sensors import LidarSection; "
        "cns_drake.scan('yard.sdf', RigidTransform([0, 0, 1]), LidarSection())"
    )
    assert packages_after(take, folder) == {"shapes"}


@pytest.mark.slow
@pytest.mark.parametrize(
    "words",
    [
        ("scan", "yard.sdf", "--pose", *"001000", "--output", "scan.pcd"),
        ("simulate", "yard.yaml", *DRIVE),
        ("simulate", "yard.yaml", *DRIVE, "--transient", EACH_CHANGE),
    ],
    ids=["scan", "drive", "temporary-changes"],
)
def test_a_foreign_world_needs_shapes_alone(folder, words):
    assert packages_after(COMMAND, folder, *words) == {"shapes"}


@pytest.mark.slow
@pytest.mark.parametrize("changes", [(), ("--transient", EACH_CHANGE)])
def test_a_map_needs_its_roads_and_nothing_that_builds_it(folder, changes):
    needed = packages_after(
        COMMAND, folder, "simulate", "town.yaml", *DRIVE, *changes
    )
    assert needed == {"shapes", "maps", "roads"}
