"""What work says about itself, and how a program shows it."""

import io
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


def test_a_log_has_at_most_a_line_in_half_a_minute(clock, log):
    log.doing("loading")
    clock.now += 0.5
    log.refresh()
    assert log.text() == []  # It might be done at once.
    clock.now += 0.51
    log.refresh()
    assert log.text() == ["loading, elapsed 0:01"]
    for done in range(2900):  # Ten minutes and 40 s, until 10:41.
        clock.now += 0.22
        log.doing(f"part {done // 100}", done % 100, 100, "scans")
    assert len(log.text()) == 1 + 638 // 30


def test_time_left_of_an_activity(clock, log):
    log.doing("resumed", 50, 100, "frames")  # Of an earlier run.
    for done in range(51, 70):
        clock.now += 10.0
        log.doing("resumed", done, 100, "frames")
        if "left" in log.text()[-1]:
            break
    # At one frame in ten seconds, once a tenth is done.
    assert (done, log.text()[-1]) == (
        57,
        "resumed, 57 of 100 frames, elapsed 1:10, about 7:10 left",
    )
    log.doing("another", 55, 100, "frames")
    clock.now += 30.0
    log.refresh()
    assert log.text()[-1] == "another, 55 of 100 frames, elapsed 1:40"


def test_jobs_in_a_log(clock, log):
    log.doing("planning")
    clock.now += 1.0
    with log.jobs(dict.fromkeys("abc", 10.0), 1, "cities") as jobs:
        jobs.start("a")
        assert log.text() == ["1 of 4 cities done, elapsed 0:00: starting"]
        jobs.start("b")
        for name in "ab":
            jobs.doing(name, "reading")
            jobs.doing(name, f"drawing town_0{name}", 2, 6, "streets")
        jobs.doing("unknown", "drawing")
        jobs.start("c")
        clock.now += 29.9
        log.refresh()
        assert len(log.text()) == 1
        clock.now += 0.1
        log.refresh()
        assert log.text()[1] == (
            "1 of 4 cities done, elapsed 0:30: drawing streets (2 times),"
            " starting"
        )
        jobs.end("a")
        jobs.end("b", fault=True)
        assert len(log.text()) == 2
    clock.now += 30.0
    log.refresh()
    assert log.text()[-1] == "planning, elapsed 1:01"


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
