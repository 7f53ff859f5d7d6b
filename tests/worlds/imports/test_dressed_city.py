"""Walls of the file get details from tags and at random."""

import csv
import re

from helpers.small_osm import OsmWriter
import pytest
from typer.testing import CliRunner
import yaml

from cns_drake.command_line import app
from cns_drake.scenarios import write_table


def write_quarter(folder, end=180):
    osm = OsmWriter()
    for k in range(4):
        for y in (8, -20):
            osm.box(40 * k, y, 30, 12, building="yes", height=str(9 + k))
    ends = [osm.node(-20, 0), osm.node(end, 0)]
    osm.way_of(ends, highway="residential", width="8", sidewalk="both")
    osm.node(30, 5.5, natural="tree")
    return osm.write(folder / "quarter.osm")


def run_import(folder, *options, **quarter):
    source = write_quarter(folder, **quarter)
    output = folder / "quarter"
    result = CliRunner().invoke(
        app, ["import", str(source), "--output", str(output), *options]
    )
    assert result.exit_code == 0, result.output
    return output


@pytest.mark.slow
def test_nothing_is_added_far_from_a_drive(tmp_path):
    """Along a street that goes on for 360 m behind it."""
    path = tmp_path / "path.csv"
    path.write_text("x,y\n" + "".join(f"{x},1.8\n" for x in range(-80, 61, 10)))
    folder = run_import(tmp_path, "--along", str(path), end=500)
    with (folder / "structures.csv").open() as stream:
        rows = [r for r in csv.DictReader(stream) if r["origin"] == "lot"]
    assert 120.0 < max(float(row["x"]) for row in rows) <= 160.0


@pytest.mark.night
@pytest.mark.slow
def test_the_notes_count_details_of_the_file_and_at_random(tmp_path):
    folder = run_import(tmp_path, "--grow", "0.5")
    facts = yaml.safe_load((folder / "import.yaml").read_text())["dressing"]
    assert facts["seed"] == 0
    assert facts["buildings"] >= 8
    assert facts["at_random"]["windows"] > 50
    with (folder / "structures.csv").open() as stream:
        origins = {r["name"]: r["origin"] for r in csv.DictReader(stream)}
    for name, origin in origins.items():
        if name == "ground":
            assert origin == "guess"
        elif name.startswith("building"):
            assert origin == "dressed"
        elif name.startswith(("road", "tree")):
            assert origin == "file"
        else:
            # Sidewalks have kerbs; lamps and cars are not in the file.
            assert origin == ("dressed" if name.startswith("walk") else "lot")
    # The table equals the worlds, though no world was loaded for it.
    table = folder / "sequences.csv"
    told = table.read_text()
    table.unlink()
    write_table(folder)
    assert table.read_text() == told
    # Each stage parses, and both have the house that changes nothing.
    for stage in ("01", "02"):
        text = (folder / f"stage_{stage}.sdf").read_text()
        assert "/glass" in text
        for mesh in set(re.findall("meshes/[^<]+", text)):
            assert (folder / mesh).is_file()
