"""What a new user waits for: the program as pip installs it, from nothing.

    python tests/benchmarks/first_hour.py [--only WORDS ...] [--prefix FOLDER]

The checkout is installed into a new environment outside of it, and all commands
run there with empty caches, one after the other. Each row of the table is a
command, with

- cpu: processor time of the command and of all processes that it starts [s];
- wall: time until the last of them has ended [s];
- memory: the most that all of them have at once, shared pages counted once
  [MB]; it is sampled, so that a shorter peak may be missed;
- reference: processor time of a fixed amount of Open3D's ray casting, the mean
  of one run before and one after the command [s];
- ratio: cpu / reference, by which two machines can be compared.

A row "again" is the same command with the caches of the row before. Linux only.
"""

from __future__ import annotations

import argparse
import contextlib
import ctypes
from dataclasses import dataclass
import os
from pathlib import Path
import resource
import subprocess
import sys
import tempfile
import threading
import time

import psutil

ROOT = Path(__file__).parents[2]
# Between two samples of memory [s].
SAMPLING = 0.5
# Of prctl(2): orphans become children of this process, so that the time of
# processes whose parents have ended is counted, too.
PR_SET_CHILD_SUBREAPER = 36

REFERENCE = """
import time
import numpy as np
import open3d.core
from open3d.t.geometry import RaycastingScene, TriangleMesh

rng = np.random.default_rng(0)
scene = RaycastingScene(nthreads=1)
for centre in rng.uniform(-100, 100, (2000, 2)):
    size = rng.uniform(2, 20, 3)
    box = TriangleMesh.create_box(*map(float, size))
    box.translate(np.array([*centre, 0.0], np.float32))
    scene.add_triangles(box)
turn = rng.uniform(-np.pi, np.pi, 2**21)
rise = rng.uniform(-0.4, 0.4, len(turn))
rays = np.stack(
    [
        *rng.uniform(-100, 100, (2, len(turn))),
        np.full(len(turn), 25.0),
        np.cos(rise) * np.cos(turn),
        np.cos(rise) * np.sin(turn),
        np.sin(rise) - 0.3,
    ],
    axis=1,
).astype(np.float32)
start = time.process_time()
hits = scene.cast_rays(open3d.core.Tensor(rays))["t_hit"].numpy()
taken = time.process_time() - start
assert 0.1 < np.isfinite(hits).mean() < 0.9
print(taken)
"""

FIRST_SCAN = """
from pydrake.geometry import (
    Box, GeometryInstance, PerceptionProperties, SceneGraph,
)
from pydrake.math import RigidTransform
from pydrake.systems.framework import DiagramBuilder
from cns_drake import add_lidar

builder = DiagramBuilder()
scene_graph = builder.AddSystem(SceneGraph())
wall = GeometryInstance(RigidTransform([5, 0, 0]), Box(1, 9, 9), "wall")
wall.set_perception_properties(PerceptionProperties())
source = scene_graph.RegisterSource("walls")
scene_graph.RegisterAnchoredGeometry(source, wall)
lidar = add_lidar(
    builder, scene_graph, scene_graph.world_frame_id(), RigidTransform(), "cns"
)
diagram = builder.Build()
context = diagram.CreateDefaultContext()
cloud = lidar.GetOutputPort("point_cloud_S").Eval(
    lidar.GetMyContextFromRoot(context)
)
assert cloud.size() > 0
"""

OPENING = """
from evaluation import open_drive

drive = open_drive("drives/metropolis_01")
assert len(drive.stamps_ns) == len(drive.X_WS)
"""

# Commands that simulate two frames, simulate a drive, run a study, and measure
# place recognition.
FRAMES = (
    "cns-drake simulate metropolis_01 --frames 2 --output frames --overwrite"
)
DRIVE = "cns-drake simulate metropolis_01 --output drives"
STUDY = "cns-drake reproduce metropolis --output output"
PR = "cns-eval pr output/metropolis_01 output/metropolis_04 --method solid"
# Row -> words of its command; the first word is a program of the environment.
# Rows may use what earlier rows have written.
ROWS = {
    "--version": ("cns-drake", "--version"),
    "--help": ("cns-drake", "--help"),
    "first scan of add_lidar": ("python", "-c", FIRST_SCAN),
    "first scan of add_lidar, again": ("python", "-c", FIRST_SCAN),
    "simulate --frames 2": FRAMES.split(),
    "simulate --frames 2, again": FRAMES.split(),
    "simulate": DRIVE.split(),
    "open its poses": ("python", "-c", OPENING),
    "reproduce metropolis": STUDY.split(),
    "pr --method solid": PR.split(),
}


@dataclass(frozen=True)
class Costs:
    """What a command costs, with all processes that it starts.

    Attributes:
        cpu: processor time [s].
        wall: time [s].
        memory: peak of the memory of all processes at once [bytes].
        printed: its standard output.
    """

    cpu: float
    wall: float
    memory: int
    printed: str


def measure(words: list[str], folder: Path, environment: dict) -> Costs:
    """Returns what a command in a folder costs.

    Raises:
        SystemExit: the command fails.
    """
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    start = time.perf_counter()
    errors = folder / "errors.txt"
    with errors.open("wb") as stream:
        process = subprocess.Popen(
            words,
            cwd=folder,
            env=environment,
            stdout=subprocess.PIPE,
            stderr=stream,
            text=True,
        )
    peaks = [0]
    ended = threading.Event()
    sampler = threading.Thread(target=_sample, args=(peaks, ended))
    sampler.start()
    printed, _ = process.communicate()
    while True:  # What it has left behind.
        try:
            os.wait()
        except ChildProcessError:
            break
    ended.set()
    sampler.join()
    wall = time.perf_counter() - start
    if process.returncode != 0:
        raise SystemExit(f"{' '.join(words)}: {errors.read_text()}")
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    cpu = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
    return Costs(cpu, wall, max(peaks), printed)


def _sample(peaks: list[int], ended: threading.Event) -> None:
    """Appends the memory of all processes below this one until they end."""
    while not ended.wait(SAMPLING):
        total = 0
        for process in psutil.Process().children(recursive=True):
            with contextlib.suppress(psutil.Error):  # It has ended.
                total += process.memory_full_info().pss
        peaks.append(total)


def install(prefix: Path) -> None:
    """Installs the checkout into a new environment, by the project's files."""
    subprocess.run([sys.executable, "-m", "venv", prefix], check=True)
    subprocess.run(
        [prefix / "bin/pip", "install", "--quiet", ROOT],
        check=True,
        stdout=sys.stderr,
    )


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument(
        "--only", nargs="+", default=[""], help="rows with one of these words"
    )
    parser.add_argument(
        "--prefix",
        type=Path,
        help="an environment with the installed program (default: a new one)",
    )
    arguments = parser.parse_args()
    ctypes.CDLL(None).prctl(PR_SET_CHILD_SUBREAPER, 1, 0, 0, 0)
    with tempfile.TemporaryDirectory(prefix="first_hour_") as name:
        folder = Path(name)
        prefix = arguments.prefix
        if prefix is None:
            print("installing the program", file=sys.stderr, flush=True)
            prefix = folder / "environment"
            install(prefix)
        (folder / "home").mkdir()
        inherited = {
            name: value
            for name, value in os.environ.items()
            if not name.startswith(("PYTHON", "NUMBA", "XDG", "CNS_DRAKE"))
        }
        environment = inherited | {
            "HOME": str(folder / "home"),
            "XDG_CACHE_HOME": str(folder / "home/cache"),
        }
        python = str(prefix.absolute() / "bin/python")

        def reference() -> float:
            words = [python, "-c", REFERENCE]
            return float(measure(words, folder, environment).printed)

        print(
            f"{'':<32}{'cpu':>9}{'wall':>9}{'memory':>9}{'reference':>11}"
            f"{'ratio':>8}",
            flush=True,
        )
        before = reference()
        for row, (program, *words) in ROWS.items():
            if not any(word in row for word in arguments.only):
                continue
            print(f"running: {row}", file=sys.stderr, flush=True)
            run = [str(prefix.absolute() / "bin" / program), *words]
            costs = measure(run, folder, environment)
            after = reference()
            mean = (before + after) / 2
            print(
                f"{row:<32}{costs.cpu:9.2f}{costs.wall:9.2f}"
                f"{costs.memory / 1e6:9.0f}{mean:11.2f}{costs.cpu / mean:8.1f}",
                flush=True,
            )
            before = after


if __name__ == "__main__":
    main()
