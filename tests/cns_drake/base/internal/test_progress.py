"""What work says about itself, and how a program shows it."""

import io
import itertools
import shutil
import sys

import pytest

from cns_drake.base.progress_display import Display


class Clock:
    def __init__(self):
        self.now = 100.0

    def __call__(self):
        return self.now


class Terminal(io.StringIO):
    """A terminal that obeys the two commands that the display gives."""

    def isatty(self):
        return True

    def screen(self):
        lines = [""]
        for part in self.getvalue().split("\x1b["):
            text = part
            if "F" in part[:3]:
                up, _, text = part.partition("F")
                del lines[len(lines) - 1 - int(up) :]
                lines.append("")
            elif part.startswith("J"):
                text = part[1:]
            for k, piece in enumerate(text.split("\n")):
                if k:
                    lines.append("")
                lines[-1] += piece
        return lines[:-1]


@pytest.fixture
def clock():
    return Clock()


@pytest.fixture
def log(clock):
    """A display in a log that only the test asks to say something."""
    display = Display(io.StringIO(), clock)
    display.text = lambda: display._stream.getvalue().splitlines()
    return display


@pytest.fixture
def screen(clock, monkeypatch):
    stream = Terminal()
    display = Display(stream, clock)
    monkeypatch.setattr(
        shutil, "get_terminal_size", lambda: (display.width, 24)
    )
    display.width = 80
    display.lines = stream.screen
    return display


def test_a_log_says_what_changes_and_then_less_and_less(clock, log):
    log.doing("loading")
    clock.now += 0.5
    log.refresh()
    assert log.text() == []  # It might be done at once.
    clock.now += 0.51
    log.refresh()
    assert log.text() == ["loading, elapsed 0:01"]
    clock.now += 0.5
    log.doing("casting", 0, 8, "scans")
    assert len(log.text()) == 1
    clock.now += 0.51
    log.refresh()
    assert log.text()[1:] == ["casting, 0 of 8 scans, elapsed 0:02"]
    times = []
    for _ in range(6000):  # Ten minutes.
        clock.now += 0.1
        before = len(log.text())
        log.refresh()
        if len(log.text()) > before:
            times.append(clock.now)
    waits = [b - a for a, b in itertools.pairwise(times)]
    assert max(waits[:20]) < 2.0
    assert waits[-1] == pytest.approx(20.0, abs=1.5)
    assert len(times) < 110


def test_time_left_of_an_activity(clock, log):
    log.doing("resumed", 50, 100, "frames")  # Of an earlier run.
    for done in range(51, 100):
        clock.now += 1.0
        log.doing("resumed", done, 100, "frames")
        if "left" in log.text()[-1]:
            break
    # A tenth of what this run does, at one frame per second.
    assert (done, log.text()[-1]) == (
        55,
        "resumed, 55 of 100 frames, elapsed 0:05, about 0:45 left",
    )
    log.doing("another", 55, 100, "frames")
    clock.now += 1.0
    log.refresh()
    assert log.text()[-1] == "another, 55 of 100 frames, elapsed 0:06"


def test_jobs_in_a_log(clock, log):
    log.doing("planning")
    clock.now += 1.0
    with log.jobs({"a": 10.0, "b": 10.0, "c": 10.0}, 1, "cities") as jobs:
        jobs.start("a")
        jobs.doing("a", "reading")
        jobs.doing("a", "drawing", 2, 6, "streets")
        jobs.doing("unknown", "drawing")
        assert log.text() == ["1 of 4 cities done, elapsed 0:00; a: starting"]
        clock.now += 1.9
        log.refresh()
        assert log.text()[1] == (
            "1 of 4 cities done, elapsed 0:02; a: drawing, 2 of 6 streets"
        )
        jobs.end("a")
        assert log.text()[2] == "a: done, 2 of 4 cities done"
        jobs.start("b")
        jobs.end("b", fault=True)
        assert len(log.text()) == 3
    clock.now += 2.0
    log.refresh()
    assert log.text()[-1] == "planning, elapsed 0:05"


@pytest.mark.parametrize("width", [30, 60, 80, 200])
def test_a_line_for_all_jobs_and_one_for_each(clock, screen, width):
    screen.width = width
    names = ["features of metropolis_01_stage_04", "metropolis 01 > 04, ring++"]
    with screen.jobs(dict.fromkeys([*names, "short"], 1.0), 0, "jobs") as jobs:
        for name in (*names, "short"):
            jobs.start(name)
            jobs.doing(name, "describing", 120, 240, "scans")
        clock.now += 1.0
        for _ in range(3):
            screen.refresh()
        assert len(screen.lines()) == 4
        jobs.end("short")
        screen.refresh()
        lines = screen.lines()
    assert len(lines) == 3
    assert max(map(len, lines)) < width
    assert lines[0].startswith("1 of 3 jobs done"[: width - 1])
    for name, line in zip(names, lines[1:], strict=True):
        assert line.startswith(name[: width - 1])
        if width == 200:
            assert line.endswith(
                "describing, 120 of 240 scans  [##########..........] 50 %"
            )


def test_other_text_appears_above(clock, screen, monkeypatch):
    stream = screen._stream
    monkeypatch.setattr(sys, "stderr", stream)
    monkeypatch.setattr(sys, "stdout", stream)
    with screen:
        screen.doing("reading")
        clock.now += 1.0
        screen.refresh()
        assert screen.lines() == ["reading, elapsed 0:01"]
        print("a note", file=sys.stderr)
        screen.refresh()
        assert screen.lines() == ["a note", "reading, elapsed 0:01"]
        print("part of a ", end="")
        screen.refresh()  # Nothing is drawn into the line.
        print("result")
        screen.refresh()
        assert screen.lines()[:2] == ["a note", "part of a result"]
        assert len(screen.lines()) == 3
    assert screen.lines() == ["a note", "part of a result"]
    assert sys.stdout is sys.stderr is stream
