"""The documented way from a map to a drive in traffic, with SUMO itself."""

import os
from pathlib import Path
import re
import subprocess
import sys

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


def drive(place):
    written = load_scenario(place / "neukolln/sequence_01.yaml")
    changed = {
        "traffic": {"fcd": str(place / "trace.xml")},
        "lidars": {"lidar": {"columns": 64}},
        "frames": 3,
    }
    values = written.model_dump(exclude_none=True) | changed
    simulate(make_scenario(values, written.source), place / "busy")
    (recording,) = (place / "busy").iterdir()
    return open_drive(recording)


def test_an_import_is_driven_in_the_traffic_of_sumo(place):
    assert len(drive(place).scan(2)) > 1000
