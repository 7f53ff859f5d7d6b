"""What work says about itself, and how a program shows it."""

import io
import itertools
import shutil
import sys

from helpers.internal.listening import Heard
import pytest

from cns_drake.base import (
    doing,
    progress,
    progress_display,
    show_progress,
    track,
)
from cns_drake.base.progress import heard_by, interlude, listener
from cns_drake.base.progress_display import Display, shown_times


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


def test_work_is_heard_by_one_listener():
    doing("before")
    first, second = Heard(), Heard()
    with heard_by(first):
        items = track("ab", "reading", 2, "scans")
        assert next(items) == "a"
        with heard_by(second):
            doing("compiling")
        assert list(items) == ["b"]
    doing("after")
    assert first.said == [
        ("reading", 0, 2, "scans"),
        ("reading", 1, 2, "scans"),
    ]
    assert second.said == [("compiling", 0, 0, "")]
    with listener().jobs({"a": 1.0}, 0, "jobs") as jobs:
        jobs.start("a")
        jobs.doing("a", "reading")
        jobs.end("a")


def test_after_an_interlude_the_work_before_it_goes_on():
    heard = Heard()
    doing("before")
    with heard_by(heard):
        with interlude("loading"):
            pass
        doing("casting", 3, 8, "rays")
        with pytest.raises(ValueError, match="stop"), interlude("compiling"):
            raise ValueError("stop")
    assert heard.said == [
        ("loading", 0, 0, ""),
        ("casting", 3, 8, "rays"),
        ("compiling", 0, 0, ""),
        ("casting", 3, 8, "rays"),
    ]


def test_after_an_inner_loop_the_outer_one_goes_on():
    heard = Heard()
    with heard_by(heard):
        for _ in track("ab", "localising", 2, "scans"):
            for _ in track("c", "mapping", 1, "scans"):
                pass
            doing("aligning")
        # A loop that was left early is no loop around the next one.
        for _ in track("ab", "judging", 2, "draws"):
            break
        for _ in track("a", "writing", 1, "files"):
            pass
    assert heard.said == [
        ("localising", 0, 2, "scans"),
        ("mapping", 0, 1, "scans"),
        ("localising", 0, 2, "scans"),
        ("aligning", 0, 0, ""),
        ("localising", 1, 2, "scans"),
        ("mapping", 0, 1, "scans"),
        ("localising", 1, 2, "scans"),
        ("aligning", 0, 0, ""),
        ("judging", 0, 2, "draws"),
        ("writing", 0, 1, "files"),
    ]


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


def test_a_log_that_takes_no_text(clock):
    stream = io.StringIO()
    display = Display(stream, clock)
    display.doing("reading")
    stream.close()
    clock.now += 1.0
    display.refresh()


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


def test_one_display_at_a_time():
    with show_progress():
        first = listener()
        assert isinstance(first, Display)
        with show_progress():
            assert listener() is first
        assert listener() is first
    assert listener() is progress._NOBODY


@pytest.mark.parametrize(
    ("seconds", "text"),
    [(16.4, "0:16"), (59.6, "1:00"), (725, "12:05"), (36_001, "10:00:01")],
)
def test_durations_are_labelled(seconds, text):
    assert shown_times(seconds, None) == f"elapsed {text}"
    assert shown_times(0.0, seconds) == f"elapsed 0:00, about {text} left"


@pytest.mark.parametrize(
    ("share", "full", "percent"),
    [(0.0, 0, 0), (0.989, 19, 98), (0.9999, 19, 99), (0.1 * 3 / 0.3, 20, 100)],
)
def test_a_bar_is_full_only_at_the_end(share, full, percent):
    bar = progress_display._bar(share)
    assert bar == f"[{'#' * full}{'.' * (20 - full)}] {percent} %"


@pytest.mark.parametrize(
    ("name", "shown"),
    [
        ("place town_01 town_02 59e74dc7", "place town_01 town_02"),
        ("describe town_01 queries 3fa9c1", "describe town_01 queries"),
        ("features of facade", "features of facade"),
        ("features of 20260101", "features of 20260101"),
        ("town_59e74dc7", "town_59e74dc7"),
    ],
)
def test_fingerprints_of_jobs_are_not_shown(name, shown):
    assert progress_display.shown_name(name) == shown
