"""Runs that are killed, and the next run on the files that they leave.

The runs are real processes, forked from a server that has imported the
simulator once. Each is killed after it has reported a random number of frames.
It does not wait, so the kill comes at any moment: while a world is loaded,
frames are taken over, a chunk is compressed or files get their names.
"""

from concurrent.futures import ThreadPoolExecutor
import contextlib
import multiprocessing
import os
import signal
import threading

from helpers.bag_recordings import contents
from helpers.tiny_drive import FRAMES, run_and_report, tiny_scenario
from mcap.exceptions import McapError
from mcap.reader import NonSeekingReader
import numpy as np
import pytest

from cns_drake.base.interrupts import INTERRUPTED

pytestmark = pytest.mark.slow

KILLS_EACH = 5
TOPICS = {"/lidar/points", "/imu/data", "/odometry", "/tf"}
FRAMES_A_SECOND = 20


class Runner:
    """Starts runs of one scenario."""

    def __init__(self, scenario):
        self._scenario = scenario
        self._context = multiprocessing.get_context("forkserver")
        self._context.set_forkserver_preload(
            ["cns_drake.simulation.simulation"]
        )
        # A start polls all processes. Two threads that poll one that has just
        # ended would both read its only status.
        self._polling = threading.Lock()

    def run(self, output, kill_signal=None, kill_frame=0):
        """Runs to the end, or to a kill after some reported frames.

        Returns:
            The last reported frame, and whether the kill came before the end.
        """
        receiver, sender = self._context.Pipe(duplex=False)
        process = self._context.Process(
            target=run_and_report, args=(self._scenario, output, sender)
        )
        with self._polling:
            process.start()
        sender.close()
        frame = 0
        with contextlib.suppress(EOFError):
            while True:
                frame = receiver.recv()
                if kill_signal is not None and frame >= kill_frame:
                    with contextlib.suppress(ProcessLookupError):
                        os.kill(process.pid, kill_signal)
                    kill_signal = None
        with self._polling:
            process.join()
        assert process.exitcode in (
            0,
            INTERRUPTED,
            -signal.SIGKILL,
            -signal.SIGTERM,
        )
        return frame, process.exitcode != 0


def readable_frames(folder):
    """Counts complete frames with an independent reader."""
    topics = {}
    for path in folder.glob("*.mcap*"):
        with path.open("rb") as stream, contextlib.suppress(McapError):
            reader = NonSeekingReader(stream)
            for _, channel, message in reader.iter_messages(
                log_time_order=False
            ):
                topics.setdefault(message.log_time, set()).add(channel.topic)
    stamps = sorted(stamp for stamp in topics if topics[stamp] >= TOPICS)
    assert (np.diff(stamps) == 50_000_000).all()
    return len(stamps)


@pytest.fixture(scope="module")
def runner(tmp_path_factory):
    return Runner(tiny_scenario(tmp_path_factory.mktemp("tiny")))


@pytest.fixture(scope="module")
def uninterrupted(runner, tmp_path_factory):
    # The folder is as deep as the others, because the path to the world is
    # recorded.
    output = tmp_path_factory.mktemp("uninterrupted") / "0" / "0"
    assert runner.run(output) == (FRAMES, False)
    return contents(output / "tiny_01")


def kill_often(runner, output, seed, uninterrupted):
    """Kills runs of one recording after the other, then lets the last end.

    Returns:
        The most frames that a kill lost.
    """
    rng = np.random.default_rng(seed)
    kills = recordings = most_lost = 0
    while True:
        folder = output / str(recordings) / "tiny_01"
        readable = 0
        killed = True
        while killed:
            kill_signal = None
            if kills < KILLS_EACH:
                kill_signal = (signal.SIGKILL, signal.SIGTERM)[rng.integers(2)]
            frame, killed = runner.run(
                folder.parent, kill_signal, rng.integers(FRAMES + 1)
            )
            kills += killed
            # A kill may come after the work, just before the process ends.
            killed = not (folder / "metadata.yaml").exists()
            if killed:
                recorded = max(frame, readable)
                readable = readable_frames(folder)
                most_lost = max(most_lost, recorded - readable)
        assert contents(folder) == uninterrupted
        recordings += 1
        if kills == KILLS_EACH:
            return most_lost


@pytest.mark.parametrize(
    "drives", [1, pytest.param(8, marks=pytest.mark.night)]
)
def test_kills_lose_a_second_at_most_and_change_no_byte(
    runner, uninterrupted, tmp_path, drives
):
    with ThreadPoolExecutor(2) as pool:
        most_lost = list(
            pool.map(
                lambda k: kill_often(
                    runner, tmp_path / str(k), k, uninterrupted
                ),
                range(drives),
            )
        )
    assert max(most_lost) <= FRAMES_A_SECOND
    # If no frame was ever lost, all kills came between frames.
    assert max(most_lost) > 0
