"""What happens to both programs while they are being imported."""

import os
import signal

from helpers.internal.signal_handlers import handlers_kept
import pytest

from cns_drake.base import InputError, start
from cns_drake.base import launch as start_module


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_an_interrupt_during_imports_waits(monkeypatch, capsys, number):
    ended = []
    monkeypatch.setattr(
        start_module, "end_interrupted", lambda: ended.append("interrupted")
    )

    def load():
        signal.raise_signal(number)
        ended.append("loaded")
        return lambda: pytest.fail("the program runs")

    with handlers_kept():
        start("program", load)
    assert ended == ["loaded", "interrupted"]
    assert capsys.readouterr() == ("", "program: interrupted\n")


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
