"""Geometric verification, by poses that are made by hand."""

import csv
import json

from helpers.internal.eval_program import run as run_program
from helpers.measured_pairs import place_outcome, values_of
import pytest

from evaluation.drives import open_drive
from evaluation.methods import make_method
from evaluation.recognition import RetrievalProtocol


@pytest.mark.slow
def test_the_option_of_pr_and_scores(capsys, towns, tmp_path):
    both = [towns / "town_01", towns / "town_02", "--method", "layered-overlap"]
    status, out, _ = run_program(capsys, "pr", *both, "--verified", "--json")
    assert status == 0
    assert json.loads(out)["protocol"]["verified"] is True
    _, out, _ = run_program(capsys, "pr", *both, "--verified")
    assert "With geometric verification" in out
    tables = []
    for options in ((), ("--verified",), ("--verified", "--radius", "1000")):
        output = tmp_path / "scores.csv"
        status, _, _ = run_program(
            capsys,
            "scores",
            towns / "town_01_scans",
            towns / "town_02_scans",
            "--method",
            "layered-overlap",
            "--output",
            output,
            *options,
        )
        assert status == 0
        with output.open(newline="") as stream:
            tables.append([row["score"] for row in csv.DictReader(stream)])
    free, shut, wide = tables
    assert wide == free
    assert shut != free
    # A rejected place has no score; a near one keeps its score.
    assert "" in shut
    assert any(
        one and one == other for one, other in zip(free, shut, strict=True)
    )


@pytest.mark.parametrize("name", ["ring++", "scan-context++", "solid"])
def test_shipped_methods_take_part(name, towns):
    drive = open_drive(towns / "town_01")
    method = make_method(name, {})
    shut = place_outcome(
        drive, drive, method, protocol=RetrievalProtocol(verified=True)
    )
    assert values_of(shut)["r1"] == 1.0
