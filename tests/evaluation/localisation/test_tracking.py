"""Tracking of a drive through a map, against closed forms."""

import json

from helpers.internal.eval_program import run
import pytest


@pytest.mark.slow
def test_the_command_tracks(towns, tmp_path, capsys):
    town = towns / "town_01"
    command = ["localise", town, town, "--method", "gicp", "--track"]
    options = ["--output", tmp_path, "--odometry-drift", "0.02", "--json"]
    status, out, _ = run(capsys, *command, *options)
    assert status == 0
    values = json.loads(out)
    assert values["queries"] == 8
    assert values["odometry_drift"] == 0.02
    assert values["way"] == pytest.approx(70.0)
    assert 0.0 <= values["within_03m"] <= 1.0
    assert values["lost_per_km"] >= 0.0
    picture = (tmp_path / "track.png").read_bytes()
    assert picture.startswith(b"\x89PNG")
    table = (tmp_path / "localisation.csv").read_text().splitlines()
    assert table[0].startswith("stretch,way,step,track_error,frame,")
    status, out, _ = run(capsys, *command)
    assert "losses of the track [1/km] " in out
