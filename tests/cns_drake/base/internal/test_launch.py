"""What happens to both programs while they are being imported."""

import os
import signal
import subprocess
import sys

import pytest

from cns_drake.base import InputError, start
from cns_drake.base import launch as start_module

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


def test_a_program_that_cannot_be_loaded(monkeypatch, capsys):
    monkeypatch.setattr(start_module, "interrupt_on_termination", lambda: None)

    def load():
        raise InputError("a file: a fault")

    with pytest.raises(SystemExit) as error:
        start("program", load)
    assert error.value.code == 2
    assert capsys.readouterr() == ("", "program: error: a file: a fault\n")


def test_linear_algebra_has_one_thread_unless_the_user_says_otherwise(
    monkeypatch,
):
    environment = {"OPENBLAS_NUM_THREADS": "3"}
    monkeypatch.setattr(os, "environ", environment)
    monkeypatch.setattr(start_module, "interrupt_on_termination", lambda: None)
    found = {}
    start("program", lambda: lambda: found.update(environment))
    assert found["OPENBLAS_NUM_THREADS"] == "3"
    assert found["OMP_NUM_THREADS"] == "1"
