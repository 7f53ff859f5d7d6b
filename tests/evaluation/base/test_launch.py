"""What happens to both programs while they are imported, and run."""

import signal
import subprocess
import sys

import pytest

SCRIPT = """
import signal, sys, threading
from evaluation.base import start

class Fleeting:
    def __del__(self):
        signal.raise_signal(int(sys.argv[1]))

def run():
    Fleeting()
    threading.Event().wait(60)
    print("run", flush=True)

def load():
    print("loading", flush=True)
    return run if sys.argv[2] == "run" else run()

start("program", load)
"""


@pytest.mark.slow
@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
@pytest.mark.parametrize("when", ["load", "run"])
def test_an_interrupt_in_a_destructor_ends_the_program(number, when):
    ended = subprocess.run(
        [sys.executable, "-c", SCRIPT, str(int(number)), when],
        capture_output=True, text=True,
    )  # fmt: skip
    assert ended.returncode == 130
    assert ended.stdout == "loading\n"
    assert ended.stderr == "program: interrupted\n"


LAST = """
import atexit, gc
from evaluation.base import start

def run():
    gc.callbacks.append(lambda phase, facts: print(phase, facts))
    atexit.register(lambda: print("the end"))
    cycle = []
    cycle.append(cycle)

start("program", lambda: run)
"""


@pytest.mark.slow
def test_no_garbage_is_looked_for_at_the_end():
    ended = subprocess.run(
        [sys.executable, "-c", LAST], capture_output=True, text=True, check=True
    )
    # Python still looks, where nothing is left: the cycle stays.
    assert ended.stdout.startswith("the end\nstart ")
    assert "stop {'generation': 2, 'collected': 0," in ended.stdout
