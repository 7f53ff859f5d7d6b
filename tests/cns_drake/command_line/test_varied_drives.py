"""A study without recordings gives the results of recordings."""

from helpers.measured_pairs import place_outcome, values_of
from helpers.small_city import write_small_city
import pytest
from typer.testing import CliRunner
import yaml

from cns_drake.command_line import app
from evaluation import change_between
from evaluation.drives import open_drive
from evaluation.methods import make_method
from evaluation.recognition import RANDOM_YAW_PROTOCOL
from evaluation.results import Results
from worlds.city import generate_city

pytestmark = pytest.mark.slow


def run(*arguments):
    result = CliRunner().invoke(app, [str(a) for a in arguments])
    assert result.exit_code == 0, (result.output, result.exception)


@pytest.mark.night
def test_simulated_and_recorded_drives_agree(tmp_path, jobs_done):
    town = write_small_city(tmp_path / "town")
    generate_city(town)
    for stage, aside in (("01", 0.4), ("02", 0.0)):
        drive = {
            "map": ".",
            "stage": stage,
            "aside": aside,
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
    experiment = tmp_path / "mine.yaml"
    fields = {
        "maps": str(town),
        "drives": "stages",
        "database": {
            "stage": "last",
            "city": {"missing": [0.0, 0.5]},
            "ride": {"roughness": "C"},
        },
        "seeds": [4],
        "tasks": ["place", "change"],
        "methods": ["solid", "btc"],
    }
    experiment.write_text(yaml.safe_dump(fields))
    recorded, simulated = tmp_path / "recorded", tmp_path / "simulated"
    run("study", experiment, "--output", simulated)
    run("generate", "--vary", experiment, "--output", recorded)
    results = Results.read(simulated / "results.csv")
    for part, member in (
        (0.0, "town_01_missing_0p0_4"),
        (0.5, "town_01_missing_0p5_4"),
    ):
        here = results.where(
            **{"database.city.missing": part, "verified": False}
        )
        change = change_between(recorded / member, recorded / "town_02")
        (found,) = here.where(metric="tcr_sym").rows
        assert found.value == pytest.approx(change.metrics["tcr_sym"], abs=1e-9)
        for method in ("solid", "btc"):
            outcome = place_outcome(
                open_drive(recorded / member),
                open_drive(recorded / "town_02"),
                make_method(method, {}),
                protocol=RANDOM_YAW_PROTOCOL,
            )
            values = values_of(outcome)
            for metric in ("auc", "r1", "places"):
                (found,) = here.where(method=method, metric=metric).rows
                assert found.value == pytest.approx(values[metric], abs=1e-9)
    assert found.n == len(outcome.outcomes)
    assert not list(simulated.glob("**/*.mcap"))
