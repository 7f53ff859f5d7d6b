"""What happens to both programs while they are being imported."""

import signal
import subprocess
import sys

import pytest

SCRIPT = """
import signal, sys
from cns_drake.base import start

def load():
    print("loading", flush=True)
    signal.raise_signal(int(sys.argv[1]))
    print("loaded", flush=True)

start("program", load)
"""


@pytest.mark.slow
@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_an_interrupt_during_imports_ends_the_program(number):
    ended = subprocess.run(
        [sys.executable, "-c", SCRIPT, str(int(number))],
        capture_output=True, text=True,
    )  # fmt: skip
    assert ended.returncode == 130
    assert ended.stdout == "loading\n"
    assert ended.stderr == "program: interrupted\n"
