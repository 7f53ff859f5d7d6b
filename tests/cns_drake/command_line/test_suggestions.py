"""Suggested commands work on the files that are there."""

import os
import sys

import pytest

from evaluation.base import terminal


@pytest.fixture(autouse=True)
def on_the_path(monkeypatch):
    """The program runs as a user types it who has it on the PATH."""
    monkeypatch.setattr(sys, "argv", ["cns-drake"])


def test_a_suggestion_works_in_the_shell_that_runs_the_program(
    capsys, tmp_path, monkeypatch
):
    monkeypatch.chdir(tmp_path)
    for folder in ("env", "elsewhere"):
        (tmp_path / folder).mkdir()
        for name in ("cns-drake", "cns-eval"):
            (tmp_path / folder / name).touch(mode=0o755)
    monkeypatch.setattr(sys, "argv", ["env/cns-drake"])

    def program(path):
        monkeypatch.setenv("PATH", os.pathsep.join(map(str, path)))
        terminal.next_command("cns-eval", "compare", "a b")
        return suggested(capsys)

    assert program([]) == "next: env/cns-eval compare 'a b'\n"
    assert program([tmp_path / "env"]) == "next: cns-eval compare 'a b'\n"
    # Another installation of the program comes first on the PATH.
    other = [tmp_path / "elsewhere", tmp_path / "env"]
    assert program(other) == "next: env/cns-eval compare 'a b'\n"


def suggested(capsys):
    return capsys.readouterr().err
