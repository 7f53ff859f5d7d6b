"""The documented way from a map to a drive in traffic, with SUMO itself."""

import csv
import os
from pathlib import Path
import re
import subprocess
import sys
from xml.etree import ElementTree

from edges.inputs import write_quarter_osm
import pytest

from cns_drake import load_scenario, make_scenario, simulate
from evaluation import open_drive
from worlds import ImportOptions, import_city

sumo = pytest.importorskip("sumo")
pytestmark = pytest.mark.slow

PAGE = Path(__file__).parents[3] / "docs/imports.md"


@pytest.fixture(scope="module")
def place(tmp_path_factory):
    """A folder with an import of `neukolln.osm`, and its trace."""
    folder = tmp_path_factory.mktemp("sumo")
    write_quarter_osm(folder)
    (folder / "quarter.osm").rename(folder / "neukolln.osm")
    import_city(folder / "neukolln.osm", folder / "neukolln", ImportOptions())
    commands = re.findall(r"^(?:netconvert|python|sumo) .*", PAGE.read_text(),
                          re.MULTILINE)  # fmt: skip
    assert len(commands) == 3
    found = {"SUMO_HOME": sumo.SUMO_HOME}
    programs = Path(sys.executable).parent
    found["PATH"] = f"{programs}{os.pathsep}{os.environ['PATH']}"
    for command in commands:
        subprocess.run(
            ["/bin/sh", "-c", command], cwd=folder, check=True,
            env={**os.environ, **found}, capture_output=True,
        )  # fmt: skip
    return folder


def take_away(town, classes):
    """Takes the structures of some classes out of all stages of a map."""
    rows = list(csv.DictReader((town / "structures.csv").open()))
    gone = {row["name"] for row in rows if row["class"] in classes}
    for path in town.glob("stage_*.sdf"):
        tree = ElementTree.parse(path)
        for parent in tree.iter():
            for visual in parent.findall("visual"):
                if visual.get("name").split("/")[0] in gone:
                    parent.remove(visual)
        tree.write(path)
    kept = [row for row in rows if row["name"] not in gone]
    with (town / "structures.csv").open("w", newline="") as file:
        table = csv.DictWriter(file, rows[0].keys())
        table.writeheader()
        table.writerows(kept)


def drive(place, name):
    written = load_scenario(place / "neukolln/sequence_01.yaml")
    changed = {
        "traffic": {"fcd": str(place / "trace.xml")},
        "lidars": {"lidar": {"columns": 64}},
        "frames": 3,
    }
    values = written.model_dump(exclude_none=True) | changed
    simulate(make_scenario(values, written.source), place / name)
    (recording,) = (place / name).iterdir()
    return open_drive(recording)


def test_an_import_is_driven_in_the_traffic_of_sumo(place):
    """With all that stands, and without parked cars, plants and buildings."""
    assert len(drive(place, "busy").scan(2)) > 1000
    for gone in (["car", "truck", "bus"], ["vegetation"], ["building"]):
        take_away(place / "neukolln", gone)
        assert len(drive(place, f"no-{gone[0]}").scan(2)) > 100
