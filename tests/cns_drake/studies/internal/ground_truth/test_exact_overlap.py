"""Exact overlap: closed forms of walls and screens, and its table."""

import csv
import json

from helpers.internal import eval_program
from helpers.internal.eval_program import assert_refused, run_program
from helpers.small_map import box_visual, world_text
from helpers.tiny_drive import tiny_scenario
import numpy as np
import pytest

from cns_drake.__main__ import main
from cns_drake.base import InputError
from cns_drake.scenarios import load_scenario
from cns_drake.simulation import SimulationSource
from cns_drake.studies.ground_truth.exact_overlap import exact_overlaps
from evaluation.recognition import (
    RetrievalProtocol,
    overlap_matrix,
    read_overlaps,
)

PROTOCOL = RetrievalProtocol(query_spacing=5.0, place_spacing=5.0)
# The first pose is (-10, 5), heading along x: the front of the wall is 10 m to
# the left, from 10 m behind to 10 m ahead.
WALL = box_visual("wall/body", (-10, 15.5, 0, 0, 0, 0), (20, 1, 60))
# It stands half-way, from 1 m ahead on.
SCREEN = box_visual("screen/body", (1, 10.05, 0, 0, 0, 0), (20, 0.1, 60))


def drive(folder, visuals, **lidar):
    """The drive of `tiny_scenario` in a world of these visuals."""
    folder.mkdir()
    world = folder / "world.sdf"
    world.write_text(world_text(visuals))
    config = {"preset": "vlp-16", "columns": 1440} | lidar
    scenario = tiny_scenario(
        folder, world=str(world), lidars={"lidar": config}, frames=1
    )
    return SimulationSource(scenario)()


def test_the_part_before_a_screen_is_seen(tmp_path):
    query = drive(tmp_path / "query", [WALL])
    database = drive(tmp_path / "database", [WALL, SCREEN])
    # The wall fills 90 deg of azimuth, 45 of them behind; ahead, it is free up
    # to 2 m.
    share = (45.0 + np.degrees(np.arctan(2.0 / 10.0))) / 90.0
    found = exact_overlaps(database, query, PROTOCOL)
    # A column of beams is a quarter of a degree wide.
    assert found == pytest.approx(share, abs=0.25 / 90.0)
    assert exact_overlaps(query, query, PROTOCOL) == 1.0
    # The screen hides the wall, which is seen beyond its end alone.
    back = exact_overlaps(query, database, PROTOCOL)
    assert back == pytest.approx(
        (45.0 + np.degrees(np.arctan(0.2)))
        / (45.0 + np.degrees(np.arctan(0.2)) + hidden_by_screen()),
        abs=0.01,
    )


def hidden_by_screen():
    """Degrees of azimuth in which the screen returns beams."""
    return np.degrees(np.arctan(21.0 / 5.0) - np.arctan(1.0 / 5.0))


def test_what_is_gone_is_not_seen(tmp_path):
    query = drive(tmp_path / "query", [WALL])
    database = drive(tmp_path / "database", [SCREEN])
    assert exact_overlaps(database, query, PROTOCOL) == 0.0


@pytest.mark.parametrize(("off", "share"), [(-0.01, 1.0), (0.001, 0.0)])
def test_the_tolerance_is_along_the_line_of_sight(tmp_path, off, share):
    """Beams to the left meet the wall at up to 15 deg from its normal."""
    moved = box_visual("w/b", (-10, 15.7 + off, 0, 0, 0, 0), (20, 1, 60))
    query, database = (
        drive(tmp_path / name, [visual], columns=4, resolution=0.0)
        for name, visual in (("query", WALL), ("database", moved))
    )
    assert len(query.scan(0)) == 16
    assert exact_overlaps(database, query, PROTOCOL) == share


def test_the_field_of_view_and_the_ranges_count(tmp_path):
    query = drive(tmp_path / "query", [WALL], preset="os1-128")
    z = query.pattern.beams(0).d_Sset[:, 2]
    # The beams of the other LiDAR end at 15 deg, and cover half of one more.
    within = np.abs(np.degrees(np.arcsin(z))) <= 15.0
    low = drive(tmp_path / "low", [WALL])
    share = within.mean()
    assert 0.6 < share < 0.8
    found = exact_overlaps(low, query, PROTOCOL)
    # Two rings on either side may lie there; each has equally many returns.
    assert share - 1e-9 <= found <= share + 4.0 / 128.0
    assert exact_overlaps(query, low, PROTOCOL) == 1.0
    near = drive(tmp_path / "near", [WALL], max_range=9.9)
    assert exact_overlaps(near, query, PROTOCOL) == 0.0
    assert np.isnan(exact_overlaps(query, near, PROTOCOL)).all()


@pytest.mark.slow
@pytest.mark.night
def test_the_estimate_from_scans_is_close(short_recording):
    drive = SimulationSource(load_scenario(short_recording / "scenario.yaml"))()
    protocol = RetrievalProtocol(query_spacing=0.1, place_spacing=0.3)
    exact = exact_overlaps(drive, drive, protocol)
    estimate = overlap_matrix(drive, drive, protocol)
    assert exact.shape == estimate.shape
    assert exact.size > 20
    np.testing.assert_allclose(exact, estimate, atol=0.05)


@pytest.mark.slow
def test_its_table_is_the_truth(short_recording, tmp_path, capsys):
    scenario = short_recording / "scenario.yaml"
    table = tmp_path / "overlaps.csv"
    command = ("export", scenario, scenario, "--format", "overlap-table")
    options = ("--spacing", "0.2", "--output", tmp_path)
    status, out, err = run_program(
        capsys, "cns-drake", main, *command, *options
    )
    assert (status, out) == (0, f"{table}\n"), err
    with table.open(newline="") as stream:
        rows = list(csv.DictReader(stream))
    assert min(float(row["overlap"]) for row in rows) > 0.8
    pr = ("pr", short_recording, short_recording, "--method", "solid")
    truth = ("--truth", "overlap:0.5", "--exact-overlaps")
    used = tmp_path / "used.csv"
    options = (*truth, table, "--query-spacing", "0.2", "--overlaps", used)
    status, out, err = eval_program.run(capsys, *pr, *options, "--json")
    assert status == 0, err
    assert used.read_text() == table.read_text()
    assert json.loads(out)["queries_with_match"] == len(
        {row["query_frame"] for row in rows}
    )
    # The spacings are others, or no truth uses the table.
    assert_refused(capsys, [*pr, *truth, table], str(table), "spacings")
    assert_refused(capsys, [*pr, *truth[2:], table], "add --truth")


def test_a_folder_that_cannot_be_is_refused_at_once(tmp_path, capsys):
    (tmp_path / "file").write_text("")
    drives = ("metropolis_01", "metropolis_04")
    options = ("--format", "overlap-table", "--output", tmp_path / "file/here")
    status, out, err = run_program(
        capsys, "cns-drake", main, "export", *drives, *options
    )
    assert (status, out) == (2, "")
    (line,) = err.splitlines()
    assert line.startswith(f"cns-drake: error: {tmp_path / 'file'}")


@pytest.mark.parametrize(
    ("value", "fault"), [("x", "not a number"), ("1.5", "between 0 and 1")]
)
def test_bad_tables(tmp_path, value, fault):
    table = tmp_path / "overlaps.csv"
    table.write_text(f"query_frame,database_frame,overlap\n0,0,{value}\n")
    with pytest.raises(InputError, match=f"overlaps.csv: line 2.*{fault}"):
        read_overlaps(table, np.array([0]), np.array([0]))
    table.write_text("query_frame,database_frame,overlap\n0,0,\n")
    assert np.isnan(read_overlaps(table, np.array([0]), np.array([0]))).all()
