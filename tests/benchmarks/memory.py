"""Memory of recordings: their peak, and whether long ones grow.

    python tests/benchmarks/memory.py [DRIVE ...] [--frames N] [--long N]

Each drive is recorded in a process of its own, whole unless told
otherwise, and its peak of resident memory printed. Then a drive at random
through the first one's stage is recorded for 10,000 frames, with few columns,
since growth does not come from rays, and a line fitted to the resident
memory behind the first tenth.

Aims: under 1.2 GB for any drive of the dataset, and no growth. Linux only.
"""

from __future__ import annotations

import argparse
from pathlib import Path
import tempfile

from processes import in_process

# What it measures is imported in the processes that do it alone.
DRIVES = ("metropolis_04",)
COLUMNS = 32
# Faster than any drive at random is on average [m/s].
SPEED = 20.0


def print_peak(drive: str, frames: int | None) -> None:
    """Prints the peak of memory of recording a drive."""
    from cns_drake.scenarios import load_scenario

    scenario = load_scenario(drive)
    _record(scenario.model_copy(update={"frames": frames}), lambda done: None)
    print(f"{drive}: peak {_resident('VmHWM'):.0f} MB", flush=True)


def print_growth(drive: str, frames: int) -> None:
    """Prints how the memory of a long recording grows."""
    import numpy as np

    from cns_drake.recording import FRAME_PERIOD
    from cns_drake.roads import draw_route, load_road_network
    from cns_drake.scenarios import load_scenario

    scenario = load_scenario(drive)
    route = draw_route(
        load_road_network(scenario.folder.roads),
        SPEED * frames * FRAME_PERIOD,
        np.random.default_rng(0),
    )
    lidars = {
        name: lidar.model_copy(update={"columns": COLUMNS})
        for name, lidar in scenario.lidars.items()
    }
    seen = []

    def on_frame(done: int) -> None:
        if done % 100 == 0 and done >= frames // 10:
            seen.append((done, _resident("VmRSS")))

    _record(
        scenario.model_copy(
            update={"route": route, "lidars": lidars, "frames": frames}
        ),
        on_frame,
    )
    if len(seen) < 2:
        raise SystemExit(f"--long {frames}: too few frames, take at least 300")
    done, resident = np.array(seen).T
    slope = np.polyfit(done, resident, 1)[0]
    print(
        f"{drive}, {frames} frames of a drive at random: {resident[0]:.1f} MB "
        f"after {done[0]:.0f} frames, {resident[-1]:.1f} MB at the end, "
        f"{1000 * slope:+.3f} MB per 1,000 frames"
    )


def _record(scenario, on_frame) -> None:
    from cns_drake.simulation import simulate

    with tempfile.TemporaryDirectory() as folder:
        simulate(
            scenario,
            Path(folder),
            on_frame=lambda done, total: on_frame(done),
        )


def _resident(field: str) -> float:
    """Returns this process's memory, now or at its peak [MB]."""
    for line in Path("/proc/self/status").read_text().splitlines():
        name, _, value = line.partition(":")
        if name == field:
            return int(value.split()[0]) * 1024 / 1e6
    raise LookupError(field)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("drives", nargs="*", default=DRIVES)
    parser.add_argument("--frames", type=int, help="instead of all")
    parser.add_argument("--long", type=int, default=10_000)
    arguments = parser.parse_args()
    for drive in arguments.drives:
        in_process(print_peak, drive, arguments.frames)
    in_process(print_growth, arguments.drives[0], arguments.long)


if __name__ == "__main__":
    main()
