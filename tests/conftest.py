"""Fixtures that several test modules use."""

import signal

from eval_program import write_towns
import pytest
from small_map import scenario_values, write_small_map

from cns_drake.scenario import make_scenario
from cns_drake.simulation import simulate

# What is started in the background ignores Ctrl-C, and so does all that it
# starts; the tests of interrupts need it.
signal.signal(signal.SIGINT, signal.default_int_handler)


def pytest_addoption(parser):
    parser.addoption(
        "--fuzz",
        type=int,
        default=5200,
        help="how many files test_fuzz damages (default: %(default)s)",
    )
    parser.addoption(
        "--fuzz-seed", type=int, default=0, help="in which ways it does"
    )


@pytest.fixture(scope="session")
def small_map(tmp_path_factory):
    """Folder of a map that loads at once, with stages 01 and 04."""
    return write_small_map(tmp_path_factory.mktemp("maps") / "small")


@pytest.fixture(scope="session")
def short_recording(small_map, tmp_path_factory):
    """Folder of a recording of 40 frames with the default LiDAR."""
    output = tmp_path_factory.mktemp("recordings")
    values = scenario_values(small_map) | {"frames": 40}
    return simulate(make_scenario(values, "test"), output).folder


@pytest.fixture(scope="session")
def towns(tmp_path_factory):
    """Folder of two small drives, see `eval_program.write_towns`."""
    folder = tmp_path_factory.mktemp("towns")
    write_towns(folder)
    return folder
