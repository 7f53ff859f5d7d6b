"""What work says about itself, and how a program shows it."""

import io
import os
import pty
import re
import sys

import pytest

from evaluation.base import progress_display
from evaluation.base.progress_display import Display


class Clock:
    def __init__(self):
        self.now = 100.0

    def __call__(self):
        return self.now


class Ended:
    """An event that a display waits for: nobody sets it before its time."""

    def __init__(self, clock, num_waits):
        self.clock = clock
        self.left = num_waits

    def wait(self, seconds):
        self.clock.now += seconds
        self.left -= 1
        return self.left < 0


@pytest.fixture
def clock():
    return Clock()


@pytest.fixture
def log(clock):
    """A display in a log."""
    return Display(io.StringIO(), clock)


def test_a_log_has_a_line_in_half_a_minute(clock, log):
    log.doing("part 7", 3, 100, "scans")
    log._ended = Ended(clock, num_waits=4)
    log._keep_telling()
    assert log._stream.getvalue().splitlines() == [
        f"part 7, 3 of 100 scans, elapsed {elapsed}"
        for elapsed in ("0:01", "0:31", "1:01", "1:31")
    ]


def test_work_that_ends_at_once_is_not_shown(clock, log):
    log._ended = Ended(clock, num_waits=0)
    log._keep_telling()
    assert log._stream.getvalue() == ""


def test_time_left_of_an_activity(clock, log):
    log.doing("resumed", 50, 100, "frames")  # Of an earlier run.
    for done in range(51, 70):
        clock.now += 10.0
        log.doing("resumed", done, 100, "frames")
        if "left" in log.line():
            break
    # At one frame in ten seconds, once a tenth of what was left is done.
    assert (done, log.line()) == (
        55,
        "resumed, 55 of 100 frames, elapsed 0:50, about 7:30 left",
    )
    log.doing("another", 55, 100, "frames")
    clock.now += 30.0
    assert log.line() == "another, 55 of 100 frames, elapsed 1:20"


def test_jobs_in_a_log(clock, log):
    log.doing("planning")
    clock.now += 1.0
    names = ["town_01, stage 2", "b", "c", "d"]
    with log.jobs(5, 1, "cities") as jobs:
        jobs.start(names[0])
        assert log.line() == (
            "1 of 5 cities done, elapsed 0:00; town 01, stage 2: starting"
        )
        for name in names[1:]:
            jobs.start(name)
        jobs.doing(names[0], "drawing", 2, 6, "streets")
        jobs.doing("unknown", "drawing")
        assert log.line() == (
            "1 of 5 cities done, elapsed 0:00; town 01, stage 2: drawing, 2 of"
            " 6 streets; b: starting; c: starting; and 1 more"
        )
        for name in names[:3]:
            clock.now += 10.0
            jobs.end(name, fault=name == "b")
        assert log.line() == (
            "4 of 5 cities done, elapsed 0:30, about 0:10 left; d: starting"
        )
    assert log.line() == "planning, elapsed 0:31"


@pytest.mark.parametrize("width", [30, 80, 200])
def test_bars_on_a_terminal(clock, monkeypatch, width):
    """Text of the program stays above them, and nothing stays of them."""
    ours, theirs = pty.openpty()
    monkeypatch.setenv("COLUMNS", str(width))
    with os.fdopen(theirs, "w") as stream:
        monkeypatch.setattr(sys, "stderr", stream)
        monkeypatch.setattr(sys, "stdout", stream)
        display = Display(stream, clock)
        monkeypatch.setattr(progress_display, "PATIENCE", 0.0)
        with display.jobs(2, 0, "jobs") as jobs:
            jobs.start("a")
            jobs.doing("a", "describing", 120, 240, "scans")
            display._keep_telling()
            print("a note", file=sys.stderr)
            print("a result of " + 50 * "long ")
            display.__exit__()
        assert sys.stdout is sys.stderr is stream
    written = b""
    while True:
        try:
            written += os.read(ours, 1 << 16)
        except OSError:  # All is read.
            break
    os.close(ours)
    shown = re.sub(r"\x1b\[[0-9;?]*[A-Za-z]", "", written.decode())
    assert "a note\r\n" in shown
    assert "a result of " + 50 * "long " in shown
    lines = shown.splitlines()
    for start in ("0 of 2 jobs", "a: desc"):
        (line, *_) = [one for one in lines if one.startswith(start)]
        assert len(line.rstrip()) <= width
        assert ("━" in line) == (width > 30)
    # In the end each line is erased, and the cursor is visible.
    *_, last = written.split(b"\n")
    assert b"\xe2\x94\x81" not in last
    assert last.count(b"\x1b[2K") >= 2
    assert written.rindex(b"\x1b[?25h") > written.rindex(b"\x1b[?25l")
