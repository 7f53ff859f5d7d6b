"""Rays a second: this project's caster, its limit, and Open3D.

    python tests/benchmarks/ray_casting_rates.py [DRIVE ...] [--rounds N]

From sensor poses along the drive to ranges and the geometry that was hit,
32 x 1024 rays a scan. The limit is a C program that calls Embree with
coherent packets (needs a C compiler; left out without one): on the same
triangles, in single precision.
Aims: 0.85 of the limit and 2.5 times Open3D on one thread, 1.8 times as much
on two threads, at most 15 % more time with 20 moving cars.
"""

import argparse
import ctypes
from pathlib import Path
import shutil
import subprocess
import tempfile

import numpy as np
from stages import (
    MovingCars,
    Open3dStage,
    count_triangles,
    interleaved,
    read_stage,
    sensor_poses,
    still,
)

from cns_drake.ray_casting import RayCastingScene, load
from cns_drake.sensors import make_beam_pattern

DRIVES = ("metropolis_04", "downtown_04")
POSES = 16
CARS = 20
# Rays that pass an edge this closely may differ [m].
EDGE = 1e-4


def build_limit(folder: Path):
    """Returns the compiled `cast_limit`, or None without a compiler."""
    compiler = shutil.which("cc") or shutil.which("gcc")
    if compiler is None:
        return None
    source = Path(__file__).with_name("packet_limit.c")
    library = folder / "packet_limit.so"
    flags = ["-O3", "-march=native", "-shared", "-fPIC"]
    subprocess.run([compiler, *flags, source, "-o", library], check=True)
    return ctypes.CDLL(str(library)).cast_limit


def benchmark(drive: str, rounds: int, folder: Path) -> None:
    geometries = read_stage(drive)
    poses = sensor_poses(drive, POSES)
    pattern = make_beam_pattern("cns", 0.05)
    d_S = pattern.d_Sset[pattern.beams(0).packet_order]
    reach = pattern.max_range
    stands = {geometry.frame_id for geometry in geometries}
    scene = RayCastingScene(geometries, stands, still)
    on_two_threads = RayCastingScene(geometries, stands, still, num_threads=2)
    moving = MovingCars(geometries, poses, CARS)
    theirs = Open3dStage(geometries)

    def cast(caster, X_WS):
        R_WS = X_WS.rotation().matrix()
        return caster.cast_rays(X_WS.translation(), d_S, reach, R_WSset=R_WS)

    def ours(caster):
        for X_WS in poses:
            cast(caster, X_WS)

    def ours_with_cars():
        for step, X_WS in enumerate(poses):
            moving.move(step)
            cast(moving.scene, X_WS)

    def open3d_cast():
        for X_WS in poses:
            theirs.cast(theirs.rays(X_WS, d_S))

    variants = {
        "cns-drake": lambda: ours(scene),
        "cns-drake, 2 threads": lambda: ours(on_two_threads),
        f"cns-drake, {CARS} moving cars": ours_with_cars,
        "Open3D": open3d_cast,
    }
    limit = build_limit(folder)
    if limit is not None:
        variants["limit (C)"] = _limit_variant(
            limit, scene._scene._targets.fixed, scene._p_WO, poses, d_S, reach
        )
    times = interleaved(variants, rounds)

    triangles = count_triangles(geometries)
    rays = POSES * pattern.num_beams
    base = times["cns-drake"]
    print(f"{drive}: {triangles} triangles, {rounds} rounds, medians")
    for name, spent in times.items():
        print(
            f"  {name:<28} {1e3 * spent.wall / POSES:6.2f} ms a scan "
            f"(CPU {1e3 * spent.cpu / POSES:6.2f}) "
            f"{1e-6 * rays / spent.wall:6.2f} Mrays/s, "
            f"{spent.wall / base.wall:5.2f} of our time "
            f"(CPU {spent.cpu / base.cpu:5.2f})"
        )
    _compare(scene, theirs, poses, d_S, cast, reach)


class _Arguments(ctypes.Structure):
    """RTCIntersectArguments, of coherent rays without functions."""

    _fields_ = (
        ("flags", ctypes.c_uint),
        ("feature_mask", ctypes.c_uint),
        ("pointers", ctypes.c_void_p * 3),
    )


def _limit_variant(limit, fixed, p_WO, poses, d_S, reach):
    arguments = _Arguments(1 << 16, 0xFFFFFFFF)
    function = load().rtcIntersect16
    intersect16 = ctypes.cast(function, ctypes.c_void_p)
    count = len(d_S)
    rows = np.ascontiguousarray(d_S.T, dtype=np.float32)
    ranges = np.empty(count, np.float32)
    prim, geom = (np.empty(count, np.uint32) for _ in range(2))

    def pointer(array):
        return ctypes.c_void_p(array.ctypes.data)

    def run():
        for X_WS in poses:
            R = X_WS.rotation().matrix().astype(np.float32).ravel()
            p = (X_WS.translation() - p_WO).astype(np.float32)
            limit(
                intersect16,
                ctypes.c_void_p(fixed),
                ctypes.byref(arguments),
                pointer(R),
                pointer(p),
                pointer(rows),
                ctypes.c_int64(count),
                ctypes.c_float(reach),
                pointer(ranges),
                pointer(prim),
                pointer(geom),
            )

    return run


def _compare(scene, theirs, poses, d_S, cast, reach) -> None:
    """Counts rays whose range differs from Open3D's."""
    total = far = 0
    worst = 0.0
    for X_WS in poses:
        a = cast(scene, X_WS).ranges
        b = theirs.cast(theirs.rays(X_WS, d_S))
        b = np.where(b <= reach, b, np.inf)
        both = np.isfinite(a) & np.isfinite(b)
        error = np.abs(a[both] - b[both])
        apart = int((error > EDGE).sum()) + int((~both & (a != b)).sum())
        total += len(a)
        far += apart
        if (error <= EDGE).any():
            worst = max(worst, float(error[error <= EDGE].max()))
    print(
        f"  {far} of {total} rays differ from Open3D by more than {EDGE} m "
        f"(edges, curved shapes); the others by {worst:.1e} m at most"
    )


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("drives", nargs="*", default=DRIVES)
    parser.add_argument("--rounds", type=int, default=9)
    arguments = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        for drive in arguments.drives:
            benchmark(drive, arguments.rounds, Path(folder))


if __name__ == "__main__":
    main()
