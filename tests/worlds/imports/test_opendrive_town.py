"""Towns along roads of OpenDRIVE: areas, buildings, drives, recordings."""

import math

from helpers.small_opendrive import lane, straight, turn, write_roads
import numpy as np
import pytest
from typer.testing import CliRunner
import yaml

from cns_drake.command_line import app
from cns_drake.scenarios import load_scenario, plan_drive, write_table
from evaluation.base import InputError
from evaluation.drives import open_drive

ARM = 12.0


def crossing(name, x, y, arms):
    """Lanes that join the arms of a junction: right, left and straight on.

    Args:
        arms: headings outwards, in quarter turns.
    """
    found = []
    for k in arms:
        heading = math.pi / 2 * k
        # The lane is on the right of incoming drivers.
        c, s = math.cos(heading), math.sin(heading)
        start = (x + ARM * c, y + ARM * s)
        inwards = heading + math.pi
        for m, angle in ((1, -1), (2, 0), (3, 1)):
            if (k + 2 - angle * -1) % 4 not in arms and angle:
                continue
            if not angle and (k + 2) % 4 not in arms:
                continue
            # The reference line is the middle line of the road.
            own = f"{name}_{k}_{m}"
            if angle == 0:
                end = (x - ARM * c, y - ARM * s)
                found.append(
                    straight(
                        own, *start, *end, junction=name,
                        lanes=(lane(-1, "driving", 3.5),),
                    )
                )  # fmt: skip
            else:
                found.append(
                    turn(
                        own, *start, inwards, ARM, angle * math.pi / 2,
                        junction=name,
                    )
                )  # fmt: skip
    return found


def town_roads(size=100.0, **more):
    """Six junctions about two squares, and a road out of them at both ends."""
    places = {
        "a": (0, 0), "b": (1, 0), "e": (2, 0),
        "d": (0, 1), "c": (1, 1), "f": (2, 1),
    }  # fmt: skip
    arms = {
        "a": (0, 1), "b": (0, 1, 2), "e": (0, 1, 2),
        "d": (0, 2, 3), "c": (0, 2, 3), "f": (2, 3),
    }  # fmt: skip
    found = []
    for name, (i, j) in places.items():
        found += crossing(name, i * size, j * size, arms[name])
    for first, last in ("ab", "be", "dc", "cf", "ad", "bc", "ef"):
        (x0, y0), (x1, y1) = (
            np.array(places[one]) * size for one in (first, last)
        )
        dx, dy = np.sign([x1 - x0, y1 - y0]) * ARM
        found.append(
            straight(first + last, x0 + dx, y0 + dy, x1 - dx, y1 - dy, **more)
        )
    end = 2 * size + ARM
    found.append(straight("eg", end, 0, end + 90.0, 0, **more))
    found.append(straight("hd", -90.0 - ARM, size, -ARM, size, **more))
    return found


@pytest.fixture(scope="module")
def source(tmp_path_factory):
    folder = tmp_path_factory.mktemp("roads")
    return write_roads(folder / "town.xodr", *town_roads())


def run(*arguments):
    return CliRunner().invoke(app, [str(a) for a in arguments])


@pytest.mark.night
@pytest.mark.slow
def test_the_command_from_end_to_end(source, tmp_path):
    output = tmp_path / "town"
    result = run("import", source, "--output", output, "--seed", "1")
    assert result.exit_code == 0, result.output
    # The table equals the worlds, though no world was loaded for it.
    table = output / "sequences.csv"
    counted = table.read_text()
    table.unlink()
    write_table(output)
    assert table.read_text() == counted
    facts = yaml.safe_load((output / "import.yaml").read_text())
    assert facts["source"] == "town.xodr"
    assert facts["seed"] == 1
    assert "town_01" in run("list", output).output
    for name in ("sequence_01", "sequence_02", "other_02"):
        trajectory = plan_drive(load_scenario(output / f"{name}.yaml"))
        assert trajectory.length > 80.0
    scenario = output / "sequence_02.yaml"
    result = run(
        "simulate", scenario, "--frames", "2", "--output", tmp_path / "rec"
    )
    assert result.exit_code == 0, result.output
    scan = open_drive(tmp_path / "rec" / "town_02").scan(0)
    # Road below the car, at the height of the wheels.
    below = np.hypot(scan["x"], scan["y"]) < 6.0
    road_ = below & (scan["label"] == 40)
    assert road_.sum() > 500
    assert np.abs(scan["z"][road_] + 1.6).max() < 0.01
    assert {40, 48, 50} <= set(np.unique(scan["label"]))


@pytest.mark.parametrize(
    ("option", "value"), [("--years", "1950"), ("--lod", "2")]
)
def test_options_of_other_formats(source, tmp_path, option, value):
    result = run("import", source, option, value, "--output", tmp_path / "out")
    assert isinstance(result.exception, InputError)
    assert f"{option}: " in str(result.exception)
