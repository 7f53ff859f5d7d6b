"""Exact overlap: closed forms of walls and screens, and its table."""

import csv
import json

from helpers.internal import eval_program
from helpers.internal.eval_program import assert_refused, run_program
import numpy as np
import pytest

from cns_drake.__main__ import main
from evaluation.base import InputError
from evaluation.recognition import read_overlaps


@pytest.mark.slow
def test_its_table_is_the_truth(short_recording, tmp_path, capsys):
    scenario = short_recording / "scenario.yaml"
    table = tmp_path / "overlaps.csv"
    command = ("truth", scenario, scenario, "--format", "overlaps")
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
    options = ("--format", "overlaps", "--output", tmp_path / "file/here")
    status, out, err = run_program(
        capsys, "cns-drake", main, "truth", *drives, *options
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
