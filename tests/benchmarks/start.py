"""How long commands take to start.

    python tests/benchmarks/start.py [DRIVE] [--runs N]

`cns-drake --help` and `cns-drake list`, and from `cns-drake simulate` to the
end of a recording of one frame, on the stage with the most triangles. The
first run finds no compiled loops and nothing cached by an earlier run (but
files that the operating system may hold in memory); the others are repeated
runs, of which the median is printed.

Aims: 0.5 s for the first two, 10 s to the first frame.
"""

from __future__ import annotations

import argparse
import os
from pathlib import Path
import statistics
import subprocess
import sys
import tempfile
import time


def seconds(arguments: list[str], caches: Path) -> float:
    """Returns how long a command takes whose caches are in a folder."""
    start = time.perf_counter()
    done = subprocess.run(
        [sys.executable, "-m", "cns_drake", *arguments],
        env={
            **os.environ,
            "NUMBA_CACHE_DIR": str(caches / "numba"),
            "XDG_CACHE_HOME": str(caches),
        },
        capture_output=True,
        text=True,
    )
    if done.returncode != 0:
        raise SystemExit(done.stderr)
    return time.perf_counter() - start


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("drive", nargs="?", default="downtown_04")
    parser.add_argument("--runs", type=int, default=8)
    options = parser.parse_args()
    if options.runs < 2:
        parser.error("--runs: the first one warms the caches, so at least 2")
    with tempfile.TemporaryDirectory() as folder:
        writing = [f"--output={folder}/recordings", "--overwrite"]
        for arguments in (
            ["--help"],
            ["list"],
            ["simulate", options.drive, "--frames=1", *writing],
        ):
            caches = Path(folder, arguments[0])
            first, *repeated = (
                seconds(arguments, caches) for _ in range(options.runs)
            )
            print(
                f"{' '.join(arguments[:2]):<24} first {first:6.2f} s, "
                f"repeated {statistics.median(repeated):6.2f} s",
                flush=True,
            )


if __name__ == "__main__":
    main()
