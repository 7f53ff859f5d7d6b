"""Recordings have the same bytes on every processor."""

import subprocess
import sys

from helpers.processors import PROGRAM, on_processor
from helpers.recorded_traffic import write_rounds
from helpers.small_city import ROADS
from helpers.small_map import write_small_map
from helpers.tiny_drive import tiny_scenario, write_scenario
from mcap.reader import make_reader
import pytest

from cns_drake.simulation import simulate

# By day, `test_equal_scores` takes another processor, and `tests/edges` pins a
# recording.
pytestmark = [pytest.mark.slow, pytest.mark.night]

FRAMES = 6


@pytest.fixture(scope="module")
def scenario(tmp_path_factory):
    folder = tmp_path_factory.mktemp("processors")
    town = write_small_map(folder / "town")
    (town / "roads.yaml").write_text(ROADS)
    write_rounds(town / "traffic.npz")
    return tiny_scenario(
        folder,
        world=None,
        map=str(town),
        stage="04",
        frames=FRAMES,
        ride={"roughness": "C", "seed": 4},
        imu={"rate": 200},
        odometry={"rate": 100},
        traffic={"vehicles": 10, "walkers": 20, "seed": 2},
        weather={"visibility": 150.0, "rain": 20.0, "snowfall": 5.0},
        lidars={
            "lidar": {
                "preset": "vlp-16",
                "columns": 256,
                "motion_distortion": True,
                "returns": "calibrated",
            }
        },
    )


def messages(folder):
    found = {}
    with (folder / f"{folder.name}_0.mcap").open("rb") as stream:
        for _, channel, message in make_reader(stream).iter_messages():
            found.setdefault(channel.topic, []).append(message.data)
    return found


# Numba keeps code for each kind of processor apart, and compiles all anew.
ANY = {"NUMBA_CPU_NAME": "generic"}


@pytest.mark.parametrize("loops", [{}, ANY])
def test_messages_are_those_of_another_processor(scenario, tmp_path, loops):
    file = write_scenario(scenario, tmp_path)
    command = [sys.executable, PROGRAM, "simulate", str(file)]
    subprocess.run(
        [*command, "--output", str(tmp_path / "other")],
        env=on_processor("oldest") | loops,
        check=True,
        capture_output=True,
    )
    own = messages(simulate(scenario, tmp_path / "own").folder)
    other = messages(tmp_path / "other" / scenario.name)
    assert len(own["/imu/data"]) > 10 * FRAMES - 10
    assert len(own["/odometry"]) > 5 * FRAMES - 5
    assert {topic for topic in own if own[topic] != other[topic]} == set()
    assert own.keys() == other.keys() >= {"/tf", "/lidar/points", "/objects"}
