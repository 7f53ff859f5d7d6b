"""Suggested commands work on the files that are there."""

import os
import sys
from types import SimpleNamespace

import numpy as np
import pytest

from cns_drake.base import next_command
from cns_drake.command_line import suggestions
from evaluation.recognition import RetrievalProtocol

RECORDING = SimpleNamespace(name="town_01")


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
        next_command("cns-eval", "compare", "a b")
        return suggested(capsys)

    assert program([]) == "next: env/cns-eval compare 'a b'\n"
    assert program([tmp_path / "env"]) == "next: cns-eval compare 'a b'\n"
    # Another installation of the program comes first on the PATH.
    other = [tmp_path / "elsewhere", tmp_path / "env"]
    assert program(other) == "next: env/cns-eval compare 'a b'\n"


def make_drive(laps, seconds):
    """Returns a drive around a circle of 20 m radius, with 10 scans a second.

    Args:
        laps: number of laps.
        seconds: time of a lap [s].
    """
    times = np.arange(0.0, laps * seconds, 0.1)
    X_WS = np.tile(np.eye(4), (len(times), 1, 1))
    angles = 2.0 * np.pi * times / seconds
    X_WS[:, :2, 3] = 20.0 * np.stack([np.cos(angles), np.sin(angles)], axis=1)
    stamps_ns = (times * 1e9).astype(np.int64)
    return SimpleNamespace(X_WS=X_WS, stamps_ns=stamps_ns)


@pytest.mark.parametrize(
    ("laps", "seconds", "expected"),
    [(0.8, 60.0, False), (2.0, 60.0, True), (2.0, 10.0, False)],
)
def test_a_loop_is_closed_after_half_a_minute(laps, seconds, expected):
    assert suggestions.has_loop(make_drive(laps, seconds)) is expected


def scenario(*lidars):
    return SimpleNamespace(name="town_01", lidars=dict.fromkeys(lidars))


def suggested(capsys):
    return capsys.readouterr().err


def test_exports_go_to_a_new_folder(capsys, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    recording = tmp_path / "town_01"
    export = f"next: cns-drake export {recording} --format kitti"
    suggestions.suggest_export(recording, scenario("lidar"))
    assert suggested(capsys) == f"{export} --output kitti\n"
    (tmp_path / "kitti").mkdir()
    suggestions.suggest_export(recording, scenario("lidar"))
    assert suggested(capsys) == f"{export} --output kitti_town_01\n"
    (tmp_path / "kitti_town_01").mkdir()
    suggestions.suggest_export(recording, scenario("lidar"))
    assert suggested(capsys) == ""


def test_an_export_names_one_of_several_lidars(capsys, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    suggestions.suggest_export(tmp_path, scenario("left", "right"))
    assert "--lidar left" in suggested(capsys)
    suggestions.suggest_export(tmp_path, scenario("lidar", "right"))
    assert "--lidar" not in suggested(capsys)


def test_a_table_of_overlaps_needs_recordings(capsys, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    drives = [SimpleNamespace(name=name) for name in ("a", "b")]
    protocol = RetrievalProtocol(query_spacing=5.0)

    def lines():
        table = tmp_path / "overlaps.csv"
        suggestions.suggest_recognition(drives, ["a", "b"], table, protocol)
        return suggested(capsys).splitlines()

    first, second = lines()
    assert first == "next: cns-drake generate a b --output drives"
    assert second.startswith("next: cns-eval pr drives/a drives/b ")
    assert second.endswith(" --query-spacing 5.0")
    for name in ("a", "b"):
        (tmp_path / "drives" / name).mkdir(parents=True)
    assert lines() == [second]


def test_a_page_needs_a_drive_that_is_not_recorded(
    capsys, tmp_path, monkeypatch
):
    monkeypatch.chdir(tmp_path)
    suggestions.suggest_page(RECORDING, "town_01")
    assert suggested(capsys).startswith("next: cns-drake simulate town_01 ")
    (tmp_path / "drives" / "town_01").mkdir(parents=True)
    suggestions.suggest_page(RECORDING, "town_01")
    assert suggested(capsys) == ""
