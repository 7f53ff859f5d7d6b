"""Runs that are killed, and the next run on the files that they leave.

The runs are real processes, forked from a server that has imported the
simulator once. Each is killed after it has reported a random number of frames.
It does not wait, so the kill comes at any moment: while a world is loaded,
a chunk is compressed or files get their names.
"""

from concurrent.futures import ThreadPoolExecutor
import contextlib
import multiprocessing
import os
import shutil
import signal
import threading

from helpers.bag_recordings import contents
from helpers.internal.reported_run import INTERRUPTED, run_and_report
from helpers.tiny_drive import FRAMES, tiny_scenario
import numpy as np
import pytest

pytestmark = pytest.mark.slow


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


def kill_often(runner, output, seed, kills, uninterrupted):
    """Kills runs of one recording after the other, then lets the last end."""
    rng = np.random.default_rng(seed)
    folder = output / "0" / "tiny_01"
    for _ in range(kills):
        kill_signal = (signal.SIGKILL, signal.SIGTERM)[rng.integers(2)]
        runner.run(folder.parent, kill_signal, rng.integers(FRAMES + 1))
        # A kill may come after the work, just before the process ends.
        if (folder / "tiny_01_0.mcap").exists():
            assert contents(folder) == uninterrupted
            shutil.rmtree(folder)
    runner.run(folder.parent)
    assert contents(folder) == uninterrupted


@pytest.mark.parametrize(
    ("drives", "kills"), [(1, 3), pytest.param(8, 5, marks=pytest.mark.night)]
)
def test_kills_leave_a_whole_recording_or_none(
    runner, uninterrupted, tmp_path, drives, kills
):
    with ThreadPoolExecutor(2) as pool:
        list(
            pool.map(
                lambda k: kill_often(
                    runner, tmp_path / str(k), k, kills, uninterrupted
                ),
                range(drives),
            )
        )
