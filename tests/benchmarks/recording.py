"""The whole pipeline against casting alone, and where its time goes.

    python tests/benchmarks/recording.py [DRIVE ...]
        [--rounds N] [--frames N]

A recording (motion, rays, points, labels, messages, compression, file) and
Open3D's `cast_rays` on one thread take turns: so many frames are recorded,
then Open3D casts the rays of the same frames, which are prepared outside of
its time. Once with all cores, and once with one. A last recording tells the
share of each step, by the CPU time of the thread that does it.

Aims: at most 1.0 times Open3D's time with two cores, 1.5 times with one.
"""

import argparse
from collections import defaultdict
from collections.abc import Iterator
import contextlib
import functools
import os
from pathlib import Path
import sys
import tempfile
import threading
import time

import numpy as np
from processes import in_process
from stages import Open3dStage, read_stage
import zstandard

from cns_drake.motion import VehicleMotion
from cns_drake.ray_casting import RayCastingScene
from cns_drake.recording import FRAME_PERIOD, BagWriter, McapRecorder
from cns_drake.scenarios import Scenario, load_scenario, plan_drive
from cns_drake.sensors import Lidar, OdometrySensor, make_pattern, sensor_pose
from cns_drake.simulation import simulate
from evaluation.base import num_cores
from evaluation.drives import serialize

DRIVES = ("metropolis_04", "downtown_04")
# Step -> what does it; of calls within calls, the innermost counts.
STEPS = {
    "motion": (
        (VehicleMotion, "_calc_state"),
        (VehicleMotion, "_calc_position"),
        (VehicleMotion, "_calc_body_list"),
        (OdometrySensor, "_calc_odometry"),
    ),
    "cast": ((RayCastingScene, "cast_rays"),),
    "points": ((Lidar, "_calc_measured"),),
    "messages": (
        (sys.modules[McapRecorder.__module__], "encode_point_cloud"),
        (sys.modules["cns_drake.recording.messages"], "make_imu"),
        (sys.modules["cns_drake.recording.messages"], "make_odometry"),
        (sys.modules["cns_drake.recording.messages"], "make_tf"),
        (sys.modules[serialize.__module__], "serialize"),
    ),
    "compression": ((zstandard, "compress"),),
    "file": ((BagWriter, "write"),),
}


class TakingTurns:
    """Casts a segment's rays with Open3D whenever it has been recorded.

    Attributes:
        recorded: (wall, CPU) time of each segment's recording [s].
        cast: those of Open3D for the same rays [s].
    """

    def __init__(self, drive: str, scenario: Scenario, segment: int):
        """Prepares Open3D.

        Args:
            drive: name or file of the scenario.
            scenario: what is recorded.
            segment: frames to a turn.
        """
        self.recorded: list[np.ndarray] = []
        self.cast: list[np.ndarray] = []
        self._segment = segment
        self._stage = Open3dStage(read_stage(drive))
        self._drive = plan_drive(scenario)
        (lidar,) = scenario.lidars.values()
        self._X_BS = sensor_pose(lidar)
        self._d_Sset = make_pattern(lidar).beams(0).d_Sset
        self._start = _clocks()

    def on_frame(self, done: int, total: int) -> None:
        """Takes Open3D's turn behind the last frame of a segment."""
        if done % self._segment:
            return
        recorded = _clocks() - self._start
        batches = [
            self._stage.rays(
                self._drive.pose(k * FRAME_PERIOD) @ self._X_BS, self._d_Sset
            )
            for k in range(done - self._segment, done)
        ]
        start = _clocks()
        for rays in batches:
            self._stage.cast(rays)
        cast = _clocks() - start
        # The first turn also loads, compiles and builds.
        if done > self._segment:
            self.recorded.append(recorded)
            self.cast.append(cast)
        self._start = _clocks()


def _clocks() -> np.ndarray:
    return np.array([time.perf_counter(), time.process_time()])


class Stopwatch:
    """CPU time of steps, each without the steps that it calls."""

    def __init__(self):
        self.spent: dict[str, float] = defaultdict(float)
        self._inner = threading.local()

    @contextlib.contextmanager
    def on(self, steps) -> Iterator[None]:
        """Watches the functions of steps for a while."""
        with contextlib.ExitStack() as stack:
            for step, functions in steps.items():
                for owner, name in functions:
                    function = getattr(owner, name)
                    stack.callback(setattr, owner, name, function)
                    setattr(owner, name, self._timed(step, function))
            yield

    def _timed(self, step: str, function):
        @functools.wraps(function)
        def timed(*args, **kwargs):
            outer = getattr(self._inner, "spent", 0.0)
            self._inner.spent = 0.0
            start = time.thread_time()
            try:
                return function(*args, **kwargs)
            finally:
                total = time.thread_time() - start
                self.spent[step] += total - self._inner.spent
                self._inner.spent = outer + total

        return timed


def take_turns(drive: str, rounds: int, segment: int, label: str) -> None:
    """Prints how long a recording takes beside Open3D."""
    scenario = load_scenario(drive)
    scenario = scenario.model_copy(update={"frames": (rounds + 1) * segment})
    turns = TakingTurns(drive, scenario, segment)
    with tempfile.TemporaryDirectory() as folder:
        simulate(
            scenario,
            Path(folder),
            num_threads=num_cores(),
            on_frame=turns.on_frame,
        )
    recorded, cast = np.array(turns.recorded), np.array(turns.cast)
    wall, cpu = np.median(recorded / cast, axis=0)
    ours, theirs = (
        1e3 * np.median(times[:, 0]) / segment for times in (recorded, cast)
    )
    print(
        f"  {label:<8} recording {ours:6.2f} ms a frame, Open3D's rays alone "
        f"{theirs:6.2f} ms, ratio {wall:.2f} (CPU {cpu:.2f})",
        flush=True,
    )


def print_shares(drive: str, frames: int) -> None:
    """Prints the CPU time of each step of a recording."""
    watch = Stopwatch()
    clock = {}

    def on_frame(done: int, total: int) -> None:
        if done == 1:  # Building the scene is not a frame's.
            watch.spent.clear()
            clock["start"] = time.process_time()
        elif done == total:
            clock["end"] = time.process_time()

    scenario = load_scenario(drive)
    scenario = scenario.model_copy(update={"frames": frames + 1})
    with tempfile.TemporaryDirectory() as folder, watch.on(STEPS):
        simulate(scenario, Path(folder), on_frame=on_frame)
    total = clock["end"] - clock["start"]
    spent = {step: watch.spent[step] for step in STEPS}
    spent["Drake, rest"] = total - sum(spent.values())
    print(f"  CPU time {1e3 * total / frames:.2f} ms a frame:")
    for step, seconds in spent.items():
        print(
            f"    {step:<12} {1e3 * seconds / frames:6.2f} ms "
            f"{seconds / total:4.0%}"
        )


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("drives", nargs="*", default=DRIVES)
    parser.add_argument("--rounds", type=int, default=9)
    parser.add_argument("--frames", type=int, default=100, help="to a turn")
    arguments = parser.parse_args()
    rounds, frames = arguments.rounds, arguments.frames
    cores = os.sched_getaffinity(0)
    for drive in arguments.drives:
        print(f"{drive}: {rounds} rounds of {frames} frames, medians")
        for used in (cores, {min(cores)}):
            label = f"{len(used)} core{'s' * (len(used) > 1)}:"
            in_process(take_turns, drive, rounds, frames, label, cores=used)
        in_process(print_shares, drive, rounds * frames, cores={min(cores)})


if __name__ == "__main__":
    main()
