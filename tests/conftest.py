"""Fixtures that several test modules use.

Slow modules are imported inside the fixtures, because the process that
distributes the tests needs none of them.
"""

import gc
import importlib.util
import os
import signal
import sys
import time
import timeit
from types import ModuleType

import pytest

from evaluation.base import num_cores

# What is imported is there to stay: nobody looks for garbage in it.
gc.disable()
gc.set_threshold(50_000)

# Where Open3D is an oracle, nobody needs its machine learning, which takes
# longer to import than all the rest of it.
sys.modules["open3d.ml"] = ModuleType("open3d.ml")

# A process started in the background ignores Ctrl-C, and so do its children.
# Tests of interrupts need the signal.
signal.signal(signal.SIGINT, signal.default_int_handler)

# Nothing here cuts the power. What a process has written is there for others
# without a wait for the disk, which takes longer than many tests.
os.fsync = os.fstat

# Files that take more than half a minute of processor time.
_LONGEST = (
    "test_recipes.py",
    "test_city_generation.py",
    "test_edges.py",
)


# Processor time of a quick test without its fixtures, at most [s], where the
# measure below takes as long as this [s]. The first test that needs a library
# loads it. Tests that take longer are named at the end of a run; none of them
# fails.
_BUDGET = 2.0
_MEASURED_IN = 0.018
# What quick tests do not do: start processes, and read a stage of a city.
_STARTS = ("subprocess.Popen", "os.fork", "os.posix_spawn")
_WORLDS = os.path.join(os.path.dirname(os.path.dirname(__file__)), "worlds", "")
# A property of each test: its processor time [s].
_TAKEN = "processor_time"
_seen: list[str] = []


def _look(event, arguments):
    """Notes what is done that no quick test may."""
    if event in _STARTS:
        _seen.append("starts a process")
    elif event == "open":
        path = str(arguments[0])
        name = os.path.basename(path)
        is_stage = name.startswith("stage_") and name.endswith(".sdf")
        if is_stage and path.startswith(_WORLDS):
            _seen.append(f"reads {path.removeprefix(_WORLDS)}")


sys.addaudithook(_look)


@pytest.hookimpl(tryfirst=True)
def pytest_runtest_setup():
    _seen.clear()


@pytest.hookimpl(wrapper=True)
def pytest_runtest_call(item):
    """Measures a test; fails a quick one that does what only slow ones may."""
    started = time.process_time()
    result = yield
    item.user_properties.append((_TAKEN, time.process_time() - started))
    if _seen and not item.get_closest_marker("slow"):
        pytest.fail(f"{item.nodeid} {_seen[0]}; mark it slow", pytrace=False)
    return result


@pytest.hookimpl(wrapper=True)
def pytest_runtest_teardown():
    """Fails a test that leaves SIGINT with another handler."""
    result = yield
    if signal.getsignal(signal.SIGINT) is not signal.default_int_handler:
        # The tests that follow would hear of no interrupt.
        signal.signal(signal.SIGINT, signal.default_int_handler)
        pytest.fail("SIGINT is left with another handler", pytrace=False)
    return result


def pytest_terminal_summary(terminalreporter):
    """Names quick tests that took long, on a slow machine longer."""
    measure = timeit.Timer("sum(range(100_000))", timer=time.process_time)
    budget = max(1.0, min(measure.repeat(5, 20)) / _MEASURED_IN) * _BUDGET
    for report in terminalreporter.getreports("passed"):
        taken = dict(report.user_properties).get(_TAKEN, 0.0)
        if "unit" in report.keywords and taken > budget:
            terminalreporter.write_line(
                f"{report.nodeid} took {taken:.1f} s of processor time:"
                " mark it slow, or make it quicker"
            )


def pytest_xdist_auto_num_workers(config):
    """One more than cores: tests wait for disks, servers and browsers."""
    if "PYTEST_XDIST_AUTO_NUM_WORKERS" in os.environ:
        return None  # It says how many.
    return num_cores() + 1


def pytest_addoption(parser):
    parser.addoption(
        "--night",
        action="store_true",
        help="run what takes too long beside the other tests as well",
    )
    parser.addoption(
        "--affected",
        nargs="?",
        const="main",
        metavar="COMMIT",
        help="run only what concerns changes since a commit (default: main)",
    )
    parser.addoption(
        "--fuzz",
        type=int,
        default=60,
        help="how many files test_fuzz damages (default: %(default)s)",
    )
    parser.addoption(
        "--fuzz-seed", type=int, default=0, help="in which ways it does"
    )


def pytest_ignore_collect(collection_path, config):
    """Leaves out files of tests: what no change concerns or nobody installed.

    Where cns-eval is installed alone, what needs the simulator is left out.
    """
    commit = config.option.affected
    is_alone = importlib.util.find_spec("pydrake") is None
    if not collection_path.match("test_*.py") or not (commit or is_alone):
        return None
    from helpers.affected import ROOT, changed_files, concerns, needs_simulator

    test = str(collection_path.relative_to(ROOT))
    if is_alone and needs_simulator(test):
        return True
    if commit and not concerns(test, changed_files(commit)):
        return True
    return None


def pytest_collection_modifyitems(config, items):
    """Puts the longest files first, then those with slow tests.

    None of them is then left for one process at the end. Tests for the night
    are left out in the day, and so are most cases of a test that is sampled.
    """
    if not config.option.night:
        late = {item for item in items if item.get_closest_marker("night")}
        late |= _beyond_samples(item for item in items if item not in late)
        config.hook.pytest_deselected(items=list(late))
        items[:] = [item for item in items if item not in late]
    for item in items:
        recorded = "short_recording" in item.fixturenames
        if recorded or hasattr(item.module, "simulate"):
            item.add_marker("slow")
        if not item.get_closest_marker("slow"):
            item.add_marker("unit")
    slow = {item.path for item in items if item.get_closest_marker("slow")}
    items.sort(
        key=lambda item: (item.path.name not in _LONGEST, item.path not in slow)
    )


def _beyond_samples(items):
    """Returns the cases of sampled tests that the day leaves out.

    Those that it runs are spread evenly over all cases.
    """
    cases = {}
    for item in items:
        if item.get_closest_marker("sampled"):
            cases.setdefault(item.function, []).append(item)
    left_out = set()
    for some in cases.values():
        (number,) = some[0].get_closest_marker("sampled").args
        taken = {k * len(some) // number for k in range(number)}
        left_out |= {one for k, one in enumerate(some) if k not in taken}
    return left_out


def pytest_collection_finish():
    gc.freeze()
    gc.enable()


@pytest.fixture(scope="session", autouse=True)
def cities_of_this_run(tmp_path_factory, pytestconfig):
    """Lets all processes share the cities, also those of later runs.

    See `shipped_cities`. Without pytest's cache they last for one run.
    """
    folder = tmp_path_factory.getbasetemp()
    if hasattr(pytestconfig, "workerinput"):
        folder = folder.parent
    if hasattr(pytestconfig, "cache"):
        folder = pytestconfig.cache.mkdir("cities")
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("CNS_DRAKE_TEST_CITIES", str(folder))
        yield


@pytest.fixture
def unrendered_figures(monkeypatch):
    """See `studies.leave_figures_unrendered`."""
    from helpers.internal.studies import leave_figures_unrendered

    leave_figures_unrendered(monkeypatch)


@pytest.fixture
def jobs_done(monkeypatch):
    """See `studies.jobs_here`."""
    from helpers.internal.studies import jobs_here

    return jobs_here(monkeypatch)


@pytest.fixture
def few_methods(monkeypatch):
    """Has studies compare two methods, whose names it returns.

    For tests of other results than those of each method.
    """
    from helpers.internal.studies import ship_methods

    return ship_methods(monkeypatch, "scan-context++", "solid")


@pytest.fixture
def own_methods(monkeypatch):
    """Lets a test register methods that later tests do not find."""
    from helpers.internal.registered_methods import forget_later

    forget_later(monkeypatch)


@pytest.fixture(scope="session")
def small_map(tmp_path_factory):
    """Folder of a map that loads at once, with stages 01 and 04."""
    pytest.importorskip("pydrake", reason="cns-eval is installed alone")
    from helpers.small_map import write_small_map

    return write_small_map(tmp_path_factory.mktemp("maps") / "small")


@pytest.fixture(scope="session")
def short_recording(small_map, tmp_path_factory):
    """Folder of a recording of 40 frames with the default LiDAR."""
    pytest.importorskip("pydrake", reason="cns-eval is installed alone")
    from helpers.small_map import scenario_values

    from cns_drake.scenarios import make_scenario
    from cns_drake.simulation import simulate

    output = tmp_path_factory.mktemp("recordings")
    values = scenario_values(small_map) | {"frames": 40}
    return simulate(make_scenario(values, "test"), output).folder


@pytest.fixture(scope="session")
def towns(tmp_path_factory):
    """Folder of two small drives, see `eval_program.write_towns`."""
    from helpers.internal.eval_program import write_towns

    folder = tmp_path_factory.mktemp("towns")
    write_towns(folder)
    return folder
