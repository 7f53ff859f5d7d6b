"""Calls in forked processes: results, faults, and the ends of processes."""

import os
from pathlib import Path
import signal
import subprocess
import sys
import time

import pytest

from cns_drake.base.errors import InputError
from cns_drake.base.jobs import side_by_side as module
from cns_drake.base.jobs.side_by_side import begun, mapped, side_by_side

# A test's process has threads, beside which nothing is forked.
BEGIN = """
import os, signal, sys, time
from pathlib import Path
from cns_drake.base.errors import InputError
from cns_drake.base.jobs import side_by_side as module
from cns_drake.base.jobs.side_by_side import begun, mapped, side_by_side
module.num_cores = lambda: 3

def meet(place, number=3):
    # Returns when this many processes are here.
    (place / str(os.getpid())).touch()
    while len(list(place.iterdir())) < number:
        time.sleep(0.01)
    return os.getpid()

"""


def run(program, *arguments, **options):
    return subprocess.run(
        [sys.executable, "-c", BEGIN + program, *map(str, arguments)],
        capture_output=True,
        text=True,
        timeout=60,
        **options,
    )


def test_each_call_is_made_once_and_results_are_in_order(tmp_path):
    done = run(
        """
place = Path(sys.argv[1])
calls = [lambda: meet(place)] * 3
first = side_by_side(calls)
assert len(set(first)) == 3, first
assert os.getpid() in first

def square(x):
    with open(place / "made", "a") as file:
        file.write(f"{x}\\n")
    return x * x

assert mapped(square, list(range(100))) == [x * x for x in range(100)]
made = (place / "made").read_text().split()
assert sorted(map(int, made)) == list(range(100))
assert mapped(square, []) == []
for pid in set(first) - {os.getpid()}:
    assert not Path(f"/proc/{pid}").exists()
""",
        tmp_path,
    )
    assert done.returncode == 0, done.stderr


def test_beside_threads_one_process_makes_all_calls(monkeypatch):
    monkeypatch.setattr(module, "num_cores", lambda: 3)
    monkeypatch.setattr(module.threading, "active_count", lambda: 2)
    assert side_by_side([os.getpid] * 5) == [os.getpid()] * 5
    assert mapped(str, range(40)) == [str(k) for k in range(40)]


def test_a_call_is_begun_beside_calls_side_by_side(tmp_path):
    done = run(
        """
place, parent = Path(sys.argv[1]), os.getpid()
with begun(lambda: meet(place, 4)) as wait:
    pids = side_by_side([lambda: meet(place, 4)] * 3)
    other = wait()
assert parent in pids and len({other, *pids}) == 4, (pids, other)
for pid in {other, *pids} - {parent}:
    assert not Path(f"/proc/{pid}").exists()
def die():
    if os.getpid() != parent:
        os.kill(os.getpid(), signal.SIGKILL)
    return "alive"
with begun(die) as wait:
    assert wait() == "alive"
def fail():
    raise InputError("its fault")
with begun(fail) as wait:
    try:
        wait()
    except InputError as error:
        print(error)
try:
    with begun(lambda: meet(place, 100)):
        raise InputError("another fault")
except InputError as error:
    print(error)
""",
        tmp_path,
    )
    assert done.returncode == 0, done.stderr
    assert done.stdout == "its fault\nanother fault\n"


def test_without_a_second_core_a_call_is_made_when_it_is_waited_for(
    monkeypatch,
):
    monkeypatch.setattr(module, "num_cores", lambda: 1)
    made = []
    with begun(lambda: made.append(os.getpid())) as wait:
        assert not made
        wait()
    assert made == [os.getpid()]


def test_the_first_fault_in_order_is_raised(tmp_path, monkeypatch):
    program = """
place = Path(sys.argv[1])
def fail(k):
    if k < 3:
        meet(place)
    if k:
        raise InputError(f"the fault of {k}")
try:
    side_by_side([lambda k=k: fail(k) for k in range(6)])
except InputError as error:
    print(error)
"""
    assert run(program, tmp_path).stdout == "the fault of 1\n"
    monkeypatch.setattr(module, "num_cores", lambda: 1)

    def fail(k):
        raise InputError(f"the fault of {k}")

    with pytest.raises(InputError, match="the fault of 0"):
        mapped(fail, range(6))


def test_calls_of_a_process_that_has_died_are_made_again(tmp_path):
    done = run(
        """
place, parent = Path(sys.argv[1]), os.getpid()
def die():
    if meet(place) != parent:
        os.kill(os.getpid(), signal.SIGKILL)
    return "alive"
assert side_by_side([die] * 3) == ["alive"] * 3
""",
        tmp_path,
    )
    assert done.returncode == 0, done.stderr


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGKILL])
def test_no_process_outlives_the_first(tmp_path, number):
    waiting = tmp_path / "waiting"
    waiting.mkdir()
    program = """
place = Path(sys.argv[1])
try:
    side_by_side([lambda: meet(place, 4)] * 3)
finally:
    (place.parent / f"tidied_{os.getpid()}").touch()
"""
    process = subprocess.Popen(
        [sys.executable, "-c", BEGIN + program, waiting],
        stderr=subprocess.DEVNULL,
        start_new_session=True,
    )
    while len(found := list(waiting.iterdir())) < 3:
        assert process.poll() is None
        time.sleep(0.01)
    os.killpg(process.pid, number)
    process.wait(30)
    for pid in (path.name for path in found):
        while Path("/proc", pid).exists():
            time.sleep(0.01)
    tidied = [path.name for path in tmp_path.glob("tidied_*")]
    assert tidied == (
        [f"tidied_{process.pid}"] if number == signal.SIGINT else []
    )
