"""Interrupts each command, again and again, and tells how long it takes to end.

    python tests/benchmarks/interruptions.py FOLDER [NAME ...]

At random moments, a command gets Ctrl-C, as its whole process group does in a
terminal, or SIGTERM; or one of its jobs is killed by SIGKILL. A row on stderr
tells the moment, the time and processor time from there to the end, the exit
status, the lines, and what is left: processes, and files that are new. In the
end, a table has the longest time of each command. Recordings are made in FOLDER
first, unless they are there.
"""

import argparse
import contextlib
import os
from pathlib import Path
import random
import resource
import shutil
import signal
import sys
import time
from typing import NamedTuple

import psutil

DRIVES = ("metropolis_01", "metropolis_04")
# Words of commands that take two drives.
PAIR = " ".join(f"drives/{name}" for name in DRIVES)
DRAKE = "cns_drake"
EVAL = "evaluation"
# Name -> module and words of a command that runs for long.
COMMANDS = {
    "simulate": f"{DRAKE} simulate metropolis_01 --output out",
    "generate": f"{DRAKE} generate {' '.join(DRIVES)} --jobs 2 --output out",
    "study": f"{DRAKE} study ladder suburbia --jobs 2 --output out",
    "reproduce": f"{DRAKE} reproduce metropolis --jobs 2 --output out",
    "train": f"{DRAKE} train --minutes 1 --jobs 2 --output out/w.npz",
    "age": f"{DRAKE} age suburbia --years 1 5 --output out",
    "import": f"{DRAKE} import corner.osm --output out",
    "scan": f"{DRAKE} scan town/stage_01.sdf --pose 0 0 2 0 0 0 --output o.pcd",
    "city": f"{DRAKE} city town",
    "list": f"{DRAKE} list town",
    "film": f"{DRAKE} film metropolis_01 --output out.webp",
    "kitti": f"{DRAKE} export drives/metropolis_01 --format kitti --output out",
    "truth": f"{DRAKE} truth {PAIR} --output out",
    "pairs": f"{DRAKE} pairs {' '.join(DRIVES)} --jobs 2 --output out",
    "overlaps": (
        f"{DRAKE} truth {' '.join(DRIVES)} --format overlaps --output out"
    ),
    "compare": f"{EVAL} compare tables",
    "tcr": f"{EVAL} tcr {PAIR} --output out",
    **{
        f"pr-{name}": f"{EVAL} pr {PAIR} --method {name} --verified --output o"
        for name in ("ring++", "btc", "learned", "solid", "scan-context++")
    },
    "pr-overlap": f"{EVAL} pr {PAIR} --method solid --truth overlap:0.5",
    "report": f"{EVAL} report drives --jobs 2 --output out",
    **{
        f"localise-{jobs}": (
            f"{EVAL} localise {PAIR} --method gicp --jobs {jobs} --output out"
        )
        for jobs in (1, 2)
    },
    "localise-track": f"{EVAL} localise {PAIR} --method gicp --track",
    "map-update": f"{EVAL} map-update maps --baseline m3c2 --output out",
}
# These run jobs in processes of their own.
WITH_JOBS = (
    "generate",
    "study",
    "reproduce",
    "train",
    "pairs",
    "report",
    "localise-2",
)
SIGNALS = ("SIGINT", "SIGTERM")
# After a command has ended, its processes are given this time to end [s].
GRACE = 1.0


def make_inputs(folder: Path) -> None:
    """Makes what the commands read, unless it is there."""
    from cns_drake.scenarios import load_scenario
    from cns_drake.simulation import simulate
    import evaluation
    from worlds.maps import shipped_maps

    for name in DRIVES:
        if not (folder / "drives" / name).exists():
            drive = load_scenario(name).with_lidar("os1-32")
            drive = drive.model_copy(update={"frames": 800})
            simulate(drive, folder / "drives", overwrite=True)
    if not (folder / "town").exists():
        shutil.copytree(shipped_maps()["suburbia"], folder / "town")
        (folder / "town" / "sequences.csv").unlink(missing_ok=True)
    sys.path.append(str(Path(__file__).resolve().parents[1]))
    from helpers.small_osm import write_corner

    write_corner(folder / "corner.osm")
    shipped = Path(evaluation.__file__).parent / "results" / "baselines"
    (folder / "tables").mkdir(exist_ok=True)
    shutil.copy(min(shipped.glob("*.csv")), folder / "tables" / "results.csv")


class Struck(NamedTuple):
    """What an interrupted command did.

    Attributes:
        seconds: time from the signal to the end; None if the command had ended.
        row: one line on everything.
    """

    seconds: float | None
    row: str


def session_of(number: int) -> list[psutil.Process]:
    """Returns the program with its descendants."""
    with contextlib.suppress(psutil.NoSuchProcess):
        main = psutil.Process(number)
        return [main, *main.children(recursive=True)]
    return []


def time_of(processes: list[psutil.Process]) -> float:
    """Returns the processor time of processes so far [s]."""
    total = 0.0
    for one in processes:
        with contextlib.suppress(psutil.Error):
            total += sum(one.cpu_times()[:2])
    return total


def strike(words: list[str], folder: Path, how: str, moment: float) -> Struck:
    """Runs a command, interrupts it, and returns what it did."""
    for path in (folder / "out", folder / "out.webp", folder / "o.pcd"):
        shutil.rmtree(path, ignore_errors=True)
        path.unlink(missing_ok=True)
    before = set(folder.rglob("*"))
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    with open(folder / "log", "w+") as log:
        program = psutil.Popen(
            [sys.executable, "-m", *words],
            stdout=log, stderr=log, cwd=folder, start_new_session=True,
            preexec_fn=lambda: signal.signal(
                signal.SIGINT, signal.default_int_handler
            ),
        )  # fmt: skip
        with contextlib.suppress(psutil.TimeoutExpired):
            program.wait(moment)
        ended_before = not program.is_running()
        processes = session_of(program.pid)
        so_far = time_of(processes[:1])
        jobs = [
            one
            for one in processes[1:]
            if "forkserver" in " ".join(one.cmdline()) and one.children()
        ]
        # It may just have ended.
        with contextlib.suppress(ProcessLookupError, psutil.NoSuchProcess):
            if how == "SIGINT":
                os.killpg(program.pid, signal.SIGINT)
            elif how == "SIGTERM":
                program.terminate()
            elif jobs:
                random.choice(jobs[0].children()).kill()
        since = time.monotonic()
        try:
            status = program.wait(120.0)
        except psutil.TimeoutExpired:
            status = None
        seconds = time.monotonic() - since
        time.sleep(GRACE)
        left = [one for one in processes[1:] if one.is_running()]
        for one in (program, *left):
            with contextlib.suppress(psutil.NoSuchProcess):
                one.kill()
        log.seek(0)
        lines = [
            line for line in log.read().splitlines() if "elapsed" not in line
        ]
    now = resource.getrusage(resource.RUSAGE_CHILDREN)
    spent = now.ru_utime + now.ru_stime - used.ru_utime - used.ru_stime - so_far
    new = {
        str(path.relative_to(folder))
        for path in set(folder.rglob("*")) - before
        if path.is_file() and "parts" not in path.parts
    } - {"log"}
    row = (
        f"{how:7} at {moment:5.1f} s{' (had ended)' if ended_before else ''}:"
        f" {seconds:5.1f} s, {spent:4.1f} s of processors, status {status},"
        f" {len(left)} processes left, {len(lines)} lines: {lines[-2:]},"
        f" {sum('it is repeated' in line for line in lines)} on repeats,"
        f" files: {sorted(new)[:4]}"
    )
    return Struck(None if ended_before else seconds, row)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("folder", type=Path)
    parser.add_argument("names", nargs="*", help="commands; all by default")
    parser.add_argument("--times", type=int, default=3, help="of each command")
    parser.add_argument("--longest", type=float, default=30.0)
    parser.add_argument("--seed", type=int, default=0)
    options = parser.parse_args()
    options.folder.mkdir(parents=True, exist_ok=True)
    make_inputs(options.folder)
    rng = random.Random(options.seed)
    longest: dict[str, dict[str, float]] = {}
    for name in options.names or COMMANDS:
        words = COMMANDS[name].split()
        ways = ["SIGINT", "SIGTERM", *(["SIGKILL"] * (name in WITH_JOBS))]
        times = longest[name] = {}
        for number in range(options.times):
            moment = rng.uniform(1.0, options.longest)
            way = ways[number % len(ways)]
            struck = strike(words, options.folder, way, moment)
            print(f"{name:15} {struck.row}", file=sys.stderr, flush=True)
            if struck.seconds is not None:
                times[way] = max(times.get(way, 0.0), struck.seconds)
    print("| command | SIGINT [s] | SIGTERM [s] |\n|---|---|---|")
    for name, times in longest.items():
        cells = (f"{times[w]:.1f}" if w in times else "" for w in SIGNALS)
        print(f"| {name} | {' | '.join(cells)} |")


if __name__ == "__main__":
    main()
