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
