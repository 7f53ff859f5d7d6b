"""What effects add to a recording, and changes of the stage to its loading.

    python tests/benchmarks/effects.py [DRIVE]
        [--rounds N] [--frames N] [--loads N] [--only NAME ...]

Each variant of a recording has a process of its own. They take turns: so many
frames of the same drive are recorded by each, then the next round begins with
another variant. By default rounds go on to the end of the drive: some of its
streets have more traffic than others. The first turn also loads, compiles and
builds, and is not counted. Times are of the processor, of all threads of a
process. A ratio is of the sums of all turns, beside the median of those of
turns, which a disturbed turn does not change.

Aims, as such ratios: calibrated returns 1.4 of ideal ones, weather 1.2 of
calibrated returns in clear air, 60 vehicles and 60 walkers 1.2 of no traffic,
a fast IMU and the ride 0.1 of a frame of a drive without them.
"""

from __future__ import annotations

import argparse
from collections.abc import Mapping
import gc
import multiprocessing as mp
from multiprocessing.connection import Connection
import os
from pathlib import Path
import tempfile
import time

import numpy as np
from processes import in_process

from cns_drake.base import ALLOCATION
from cns_drake.scenarios import (
    DrivePlan,
    Scenario,
    count_frames,
    load_scenario,
    make_scenario,
    plan_drive,
)
from cns_drake.sensors import WeatherConfig
from cns_drake.simulation import load_drive, simulate

# Name -> the variant that it is compared with.
COMPARED = {
    "calibrated": "ideal",
    "dual": "calibrated",
    "fog": "calibrated",
    "rain": "calibrated",
    "snowfall": "calibrated",
    "traffic": "ideal",
    "imu": "slow",
}
WEATHER = {
    "fog": WeatherConfig(visibility=100.0),
    "rain": WeatherConfig(rain=10.0),
    "snowfall": WeatherConfig(snowfall=1.0),
}
TRANSIENT = {
    "parked_cars": 0.5,
    "leaves": 0.5,
    "snow": 0.2,
    "scaffolds": 0.4,
    "works": 0.2,
    "furniture": 0.5,
}


def varied(scenario: Scenario, name: str) -> Scenario:
    """Returns a variant of a scenario.

    Args:
        scenario: with ideal returns, and nothing else.
        name: of the variant; `slow` has turns of half the rate, and `imu` these
            as well, an IMU of 400 samples a second, and a road of class A.
    """
    if name == "calibrated":
        return scenario.with_returns("calibrated")
    if name == "dual":
        calibrated = scenario.with_returns("calibrated")
        return _with_lidars(calibrated, echoes="dual")
    if name in WEATHER:
        return scenario.with_returns("calibrated", WEATHER[name])
    if name == "traffic":
        return scenario.with_traffic(60)
    if name == "slow":
        return _with_lidars(scenario, rate=10)
    if name == "imu":
        sections = {"imu": {"rate": 400}, "ride": {"roughness": "A"}}
        return _with(_with_lidars(scenario, rate=10), sections)
    return scenario


def _with_lidars(scenario: Scenario, **fields) -> Scenario:
    return _with(scenario, {"lidars": dict.fromkeys(scenario.lidars, fields)})


def _with(scenario: Scenario, sections: Mapping) -> Scenario:
    values = scenario.model_dump(mode="json", exclude_none=True)
    _merge(values, sections)
    return make_scenario(values, scenario.name)


def _merge(values: dict, changes: Mapping) -> None:
    for key, value in changes.items():
        if isinstance(value, Mapping):
            _merge(values.setdefault(key, {}), value)
        else:
            values[key] = value


def record(
    drive: str, name: str, rounds: int, segment: int, turns: Connection
) -> None:
    """Records a variant, a turn whenever it is asked for one.

    Args:
        drive: name or file of the scenario.
        name: of the variant.
        rounds: number of turns, besides the first.
        segment: frames of a turn, at the default rate.
        turns: brings a word for each turn; takes the time of the processor
            after it [s].
    """
    scenario = varied(load_scenario(drive), name)
    normal = load_scenario(drive).frame_period
    step = round(segment * normal / scenario.frame_period)
    frames = (rounds + 1) * step
    # Ends of turns, each reported once.
    ends = iter(range(step, frames + 1, step))
    end = next(ends)
    gc.set_threshold(50_000)  # As jobs do.
    turns.recv()

    def on_frame(done: int, total: int) -> None:
        nonlocal end
        if done == end:
            turns.send(time.process_time())
            end = next(ends, 0)
            if end:
                turns.recv()

    with tempfile.TemporaryDirectory() as folder:
        scenario = scenario.model_copy(update={"frames": frames})
        simulate(scenario, Path(folder), on_frame=on_frame)


def most_rounds(drive: str, segment: int) -> int:
    """Returns the number of rounds to the end of the drive."""
    scenario = load_scenario(drive)
    frames = count_frames(scenario, plan_drive(scenario))
    # The first turn is not counted.
    return max(1, frames // segment - 1)


def take_turns(
    drive: str, names: list[str], rounds: int, segment: int
) -> dict[str, np.ndarray]:
    """Returns the time of each turn of each variant [s]."""
    context = mp.get_context("spawn")
    ends: dict[str, Connection] = {}
    for name in names:
        ends[name], other = context.Pipe()
        context.Process(
            target=record, args=(drive, name, rounds, segment, other)
        ).start()
        other.close()
    spent: dict[str, list[float]] = {name: [] for name in names}
    for k in range(rounds + 1):
        for name in names[k % len(names) :] + names[: k % len(names)]:
            ends[name].send("go")
            spent[name].append(ends[name].recv())
    return {name: np.diff(times) for name, times in spent.items()}


def print_ratios(spent: dict[str, np.ndarray], segment: int) -> None:
    """Prints how the variants compare."""
    for name, times in spent.items():
        text = f"  {name:<12} {1e3 * np.mean(times) / segment:6.2f} ms a frame"
        if name == "imu":
            more = (times - spent["slow"]) / spent["ideal"]
            text += f", more than slow by {np.median(more):.3f} of ideal"
        elif name in COMPARED:
            base = COMPARED[name]
            ratio = times.sum() / spent[base].sum()
            median = np.median(times / spent[base])
            text += f", ratio {ratio:.3f} of {base}, median {median:.3f}"
        print(text, flush=True)


def print_loading(drive: str, loads: int) -> None:
    """Prints how long a drive takes to load, without and with changes."""
    plain = load_scenario(drive)
    variants = {"plain": plain, "changed": plain.with_transient(**TRANSIENT)}
    spent: dict[str, list[float]] = {name: [] for name in variants}
    for _ in range(loads + 1):
        for name, scenario in variants.items():
            start = time.process_time()
            load_drive(DrivePlan(scenario))
            spent[name].append(time.process_time() - start)
    for name, times in spent.items():
        print(f"  loading {name:<8} {np.median(times[1:]):6.2f} s", flush=True)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("drive", nargs="?", default="metropolis_04")
    parser.add_argument("--rounds", type=int, help="instead of all")
    parser.add_argument("--frames", type=int, default=20, help="to a turn")
    parser.add_argument("--loads", type=int, default=3)
    parser.add_argument(
        "--only", nargs="*", choices=COMPARED, help="these variants"
    )
    options = parser.parse_args()
    # Recordings are made by jobs, and the C library reads this as it starts.
    os.environ.update(ALLOCATION)
    names = ["ideal", "slow", *COMPARED]
    if options.only is not None:
        bases = {COMPARED[name] for name in options.only}
        wanted = {"ideal", *options.only, *bases}
        names = [name for name in names if name in wanted]
    rounds = options.rounds or most_rounds(options.drive, options.frames)
    print(f"{options.drive}: {rounds} turns of {options.frames} frames")
    print_ratios(
        take_turns(options.drive, names, rounds, options.frames),
        options.frames,
    )
    if options.loads:
        in_process(print_loading, options.drive, options.loads)


if __name__ == "__main__":
    main()
