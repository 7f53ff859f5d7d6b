"""Kills `cns-drake reproduce` on a small town, again and again.

    python tests/benchmarks/kills.py 200

Each time the program, one of its jobs or all of its processes are ended by
SIGKILL at a random moment; then the same command goes on. What it ends with
must be, byte for byte, what it makes undisturbed, but for the times that its
report tells.
"""

from __future__ import annotations

import argparse
import contextlib
from pathlib import Path
import random
import re
import shutil
import sys
import tempfile
import time

import psutil
import yaml

sys.path.append(str(Path(__file__).resolve().parents[1]))
from helpers.small_map import scenario_values, write_small_map

# These tell how long something took.
_TIMED = ("index.html",)


def write_town(folder: Path) -> Path:
    """Writes a map with two stages, which are driven along one route."""
    write_small_map(folder)
    for stage in ("01", "04"):
        values = scenario_values(folder, "metropolis_04") | {
            "map": ".",
            "stage": stage,
            "frames": 60,
            "lidars": {"lidar": {"columns": 16}},
        }
        del values["name"]
        file = folder / f"sequence_{stage}.yaml"
        file.write_text(yaml.safe_dump(values))
    return folder


def start(town: Path, output: Path) -> psutil.Popen:
    """Starts the command; what it tells goes to a file beside its output."""
    words = ["reproduce", str(town), "--output", str(output), "--jobs", "2"]
    with open(f"{output}.log", "w") as log:
        return psutil.Popen(
            [sys.executable, "-m", "cns_drake", *words],
            stdout=log,
            stderr=log,
            start_new_session=True,
        )


def contents(output: Path) -> dict[str, bytes]:
    """Returns name -> bytes of what a run leaves to people."""
    found = {}
    for path in sorted(output.rglob("*")):
        name = path.relative_to(output)
        # Parts state when the files that they were made of were changed.
        if path.is_file() and "parts" not in name.parts:
            data = path.read_bytes()
            if path.name in _TIMED:
                data = re.sub(rb"[0-9][0-9.]*", b"#", data)
            found[str(name)] = data
    return found


def kill(process: psutil.Popen, rng: random.Random) -> None:
    """Kills a program, with one or all of its jobs or alone."""
    with contextlib.suppress(psutil.NoSuchProcess):
        jobs = process.children(recursive=True)
        chosen = rng.choice(([], jobs, [rng.choice(jobs)] if jobs else []))
        for one in (*chosen, process):
            with contextlib.suppress(psutil.NoSuchProcess):
                one.kill()
    process.wait()


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("kills", type=int, help="how often to kill")
    parser.add_argument("--seed", type=int, default=0)
    options = parser.parse_args()
    rng = random.Random(options.seed)
    with tempfile.TemporaryDirectory() as folder:
        top = Path(folder)
        town = write_town(top / "town")
        began = time.monotonic()
        assert start(town, top / "whole").wait() == 0
        longest = (time.monotonic() - began) / 2.0
        whole = contents(top / "whole")
        killed = runs = 0
        while killed < options.kills:
            shutil.rmtree(top / "out", ignore_errors=True)
            process = start(town, top / "out")
            while killed < options.kills:
                try:
                    process.wait(rng.uniform(1.0, longest))
                    break
                except psutil.TimeoutExpired:
                    kill(process, rng)
                    killed += 1
                    process = start(town, top / "out")
            if process.wait() != 0 or contents(top / "out") != whole:
                sys.exit(f"run {runs}: {(top / 'out.log').read_text()}")
            runs += 1
            print(f"{killed} kills, {runs} runs, all alike", flush=True)


if __name__ == "__main__":
    main()
