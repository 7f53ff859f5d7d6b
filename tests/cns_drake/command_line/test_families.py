"""A family without recordings gives the results of its recordings."""

import csv

from helpers import studies
from helpers.small_city import write_small_city
import pytest
from typer.testing import CliRunner
import yaml

from cns_drake.city.generation.generate import generate_city
from cns_drake.command_line.cli import app
from cns_drake.studies import recording
from evaluation.command_line.cli import app as evaluation_app
from evaluation.study import trend_databases

pytestmark = [
    pytest.mark.slow,
    pytest.mark.usefixtures("unrendered_figures", "few_methods"),
]

# Members and their control have scenario files; the query drive has none.
RIDE, IMU = {"roughness": "C"}, {"rate": 100}


def run(program, *arguments):
    result = CliRunner().invoke(program, [str(a) for a in arguments])
    assert result.exit_code == 0, (result.output, result.exception)


def test_simulated_and_recorded_families_agree(tmp_path, monkeypatch):
    studies.run_here(monkeypatch, recording, trend_databases)
    town = write_small_city(tmp_path / "town")
    generate_city(town)
    for stage, heading in (("01", 0.4), ("02", 0.0)):
        drive = {
            "map": ".",
            "stage": stage,
            "aside": heading,
            "route": [
                {"road": "south", "direction": "backward", "lane": 1},
                {"road": "north", "direction": "backward", "lane": 1},
            ],
            "speeds": {
                "cruise": 14.0,
                "longitudinal_acceleration": 4.0,
                "lateral_acceleration": 6.0,
            },
            "lidars": {"lidar": {"columns": 64, "range_noise": 0.02}},
            "frames": 40,
        }
        (town / f"sequence_{stage}.yaml").write_text(yaml.safe_dump(drive))
        if stage == "01":
            drive |= {"stage": "02", "ride": RIDE, "imu": IMU}
            (town / "unchanged.yaml").write_text(yaml.safe_dump(drive))
    family = tmp_path / "family.yaml"
    values = {"base": "town/sequence_01.yaml", "missing": [0.0, 0.5]}
    family.write_text(yaml.safe_dump(values | {"ride": RIDE, "imu": IMU}))
    recorded, simulated = tmp_path / "recorded", tmp_path / "simulated"
    query_drive = town / "sequence_02.yaml"
    varied = "--vary", family
    run(app, "trend", *varied, "--query", query_drive, "--output", simulated)
    run(app, "generate", query_drive, *varied, "--output", recorded)
    run(app, "simulate", town / "unchanged.yaml", "--output", recorded)
    members = sorted(recorded.glob("town_01_m*"))
    run(
        evaluation_app,
        *("trend", *members, "--query", recorded / "town_02"),
        *("--control", recorded / "unchanged"),
        *("--output", tmp_path / "trend"),
    )
    tables = [
        (folder / "trend.csv").read_text()
        for folder in (simulated, tmp_path / "trend")
    ]
    assert tables[0] == tables[1]
    rows = list(csv.DictReader(tables[0].splitlines()))
    assert {row["database"] for row in rows} == {m.name for m in members}
    # One control serves both, because they share a route.
    unchanged = {(row["method"], row["auc_unchanged"]) for row in rows}
    assert len(unchanged) == len(rows) / 2
    assert any(row["kept"] for row in rows)
    assert not list(simulated.glob("**/*.mcap"))
