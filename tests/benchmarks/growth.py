"""How the cost of a frame grows with rays, triangles and moving objects.

    python tests/benchmarks/growth.py --output FIGURE.png
        [--drive NAME] [--rounds N]

Rays: 16 to 128 rings and 512 to 2048 columns; of the caster alone, and of a
whole recording (motion, points, messages, compression and file with it).
Triangles: a stage's, of some of its structures drawn at random up to all of
them, then with each triangle divided in four, up to four millions. Moving
objects: 0 to 200 cars of 1280 triangles each. Times are medians of CPU time;
exponents are slopes of straight lines through logarithms, for moving objects
of the time that they add.
"""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from pathlib import Path
import tempfile
import time

import matplotlib.pyplot as plt
import numpy as np
from stages import (
    MovingCars,
    count_triangles,
    interleaved,
    read_stage,
    sensor_poses,
    still,
)

from cns_drake.ray_casting import RayCastingScene
from cns_drake.scenarios import load_scenario
from cns_drake.scene import PerceptionGeometry, TriangleSurface
from cns_drake.sensors import SpinningPattern
from cns_drake.simulation import simulate

POSES = 8
REACH = 120.0
RINGS = (16, 32, 64, 128)
COLUMNS = (512, 1024, 2048)
TRIANGLES = (1e5, 2e5, 4e5, 8e5, 1.6e6, 2.5e6, 4e6)
OBJECTS = (0, 10, 20, 50, 100, 200)
# Presets whose beams cover the same elevations.
PRESETS = {32: "cns", 64: "os1-64", 128: "os1-128"}
FRAMES = 20
TICKS = (1, 2, 5, 10, 20, 50, 100, 200)
# What there are so many of, and the time of a frame [ms].
Series = list[tuple[int, float]]


def beams(rings: int, columns: int) -> np.ndarray:
    """Returns beams over the elevations of the dataset's LiDAR."""
    elevations = np.deg2rad(np.linspace(22.5, -22.5, rings))
    pattern = SpinningPattern(tuple(elevations), columns, 0.8, REACH, 0.05)
    return pattern.d_Sset[pattern.beams(0).packet_order]


def cast_all(scene: RayCastingScene, poses, d_S: np.ndarray) -> None:
    """Casts a scan from each pose."""
    for X_WS in poses:
        cast(scene, X_WS, d_S)


def cast(scene: RayCastingScene, X_WS, d_S: np.ndarray) -> None:
    """Casts a scan from one pose."""
    R_WS = X_WS.rotation().matrix()
    scene.cast_rays(X_WS.translation(), d_S, REACH, R_WSset=R_WS)


def make_scene(geometries: Sequence[PerceptionGeometry]) -> RayCastingScene:
    """Returns the scene of geometry that stands."""
    stands = {geometry.frame_id for geometry in geometries}
    return RayCastingScene(geometries, stands, still)


def ms_per_scan(variants: dict, rounds: int) -> dict:
    """Returns the median CPU time of each variant's scans [ms]."""
    times = interleaved(variants, rounds)
    return {key: 1e3 * spent.cpu / POSES for key, spent in times.items()}


def against_rays(geometries, poses, rounds: int) -> Series:
    """Returns the number of rays and ms a scan."""
    scene = make_scene(geometries)
    patterns = {(r, c): beams(r, c) for r in RINGS for c in COLUMNS}
    times = ms_per_scan(
        {
            size: lambda d_S=d_S: cast_all(scene, poses, d_S)
            for size, d_S in patterns.items()
        },
        rounds,
    )
    for (rings, columns), ms in times.items():
        print(f"  {rings:4} x {columns:4} rays {ms:8.2f} ms a scan")
    return [(r * c, ms) for (r, c), ms in times.items()]


def of_recordings(drive: str, rounds: int) -> Series:
    """Returns the number of rays and ms a frame of a whole recording."""
    result = []
    for rings, preset in PRESETS.items():
        for columns in COLUMNS:
            scenario = load_scenario(drive).with_lidar(preset)
            lidars = {
                name: lidar.model_copy(update={"columns": columns})
                for name, lidar in scenario.lidars.items()
            }
            scenario = scenario.model_copy(
                update={"lidars": lidars, "frames": FRAMES * (rounds + 1)}
            )
            seen = []

            def on_frame(done: int, total: int, seen=seen) -> None:
                if done % FRAMES == 0:
                    seen.append(time.process_time())

            with tempfile.TemporaryDirectory() as folder:
                simulate(scenario, Path(folder), on_frame=on_frame)
            ms = 1e3 * float(np.median(np.diff(seen))) / FRAMES
            print(f"  {rings:4} x {columns:4} rays {ms:8.2f} ms a frame")
            result.append((rings * columns, ms))
    return result


def with_triangles(
    geometries: Sequence[PerceptionGeometry], count: float
) -> list[PerceptionGeometry]:
    """Returns a stage with about so many triangles.

    Fewer than it has: some of its structures. More: of some structures each
    triangle is divided in four, which changes no surface, once or more.
    """
    geometries = list(geometries)
    total = count_triangles(geometries)
    rng = np.random.default_rng(0)
    while 4 * total <= count:
        geometries = [_divided(geometry) for geometry in geometries]
        total *= 4
    surplus = count - total
    for k in rng.permutation(len(geometries)):
        own = count_triangles([geometries[k]])
        if surplus < 0 and own > 0:
            geometries[k] = None
            surplus += own
        elif surplus > 0 and own > 0:
            geometries[k] = _divided(geometries[k])
            surplus -= 3 * own
        if abs(surplus) < 0.02 * count:
            break
    return [geometry for geometry in geometries if geometry is not None]


def _divided(geometry: PerceptionGeometry) -> PerceptionGeometry:
    """Returns a geometry with each triangle divided in four."""
    surface = geometry.surface
    if not isinstance(surface, TriangleSurface):
        return geometry
    a, b, c = np.moveaxis(surface.p_GVset[surface.triangles], 1, 0)
    ab, bc, ca = (a + b) / 2, (b + c) / 2, (c + a) / 2
    parts = [(a, ab, ca), (ab, b, bc), (ca, bc, c), (ab, bc, ca)]
    corners = np.concatenate([np.stack(part, axis=1) for part in parts])
    triangles = np.arange(3 * len(corners), dtype=np.int32).reshape(-1, 3)
    return PerceptionGeometry(
        geometry.geometry_id,
        geometry.name,
        geometry.frame_id,
        geometry.X_FG,
        TriangleSurface(corners.reshape(-1, 3), triangles),
        geometry.rgb,
    )


def against_triangles(geometries, poses, rounds: int) -> Series:
    """Returns the number of triangles and ms a scan."""
    d_S = beams(32, 1024)
    scenes = {}
    for count in TRIANGLES:
        stage = with_triangles(geometries, count)
        scenes[count_triangles(stage)] = make_scene(stage)
    times = ms_per_scan(
        {
            count: lambda scene=scene: cast_all(scene, poses, d_S)
            for count, scene in scenes.items()
        },
        rounds,
    )
    for count, ms in times.items():
        print(f"  {count:8} triangles {ms:8.2f} ms a scan")
    return list(times.items())


def against_objects(geometries, poses, rounds: int) -> Series:
    """Returns the number of moving objects and ms a scan."""
    d_S = beams(32, 1024)

    def drive(cars: MovingCars) -> None:
        for step, X_WS in enumerate(poses):
            cars.move(step)
            cast(cars.scene, X_WS, d_S)

    stages = {n: MovingCars(geometries, poses, n) for n in OBJECTS}
    times = ms_per_scan(
        {n: lambda cars=cars: drive(cars) for n, cars in stages.items()}, rounds
    )
    for count, ms in times.items():
        print(f"  {count:4} moving objects {ms:8.2f} ms a scan")
    return list(times.items())


def fit(series: Series) -> tuple[float, np.ndarray, np.ndarray]:
    """Returns the exponent of a power law, and where to draw it."""
    x, y = np.array(series).T
    exponent, start = np.polyfit(np.log(x), np.log(y), 1)
    along = np.geomspace(x.min(), x.max(), 100)
    return exponent, along, np.exp(start) * along**exponent


def draw(rays, recordings, triangles, objects, title: str, output: Path):
    """Draws the figure and prints the exponents."""
    figure, axes = plt.subplots(1, 3, figsize=(13, 4.2), layout="constrained")
    for axis, series, name, what, colour in [
        (axes[0], rays, "casting", "rays", "C0"),
        (axes[0], recordings, "whole recording", "rays", "C1"),
        (axes[1], triangles, "casting", "triangles", "C0"),
    ]:
        exponent, x, y = fit(series)
        print(f"  {name}: time ~ {what}^{exponent:.2f}")
        label = f"{name}: {what}$^{{{exponent:.2f}}}$"
        axis.loglog(*zip(*series, strict=True), "o", color=colour)
        axis.loglog(x, y, color=colour, label=label)
        axis.set_yticks(TICKS, map(str, TICKS))
        axis.minorticks_off()
    axes[0].set_xlabel("rays")
    axes[1].set_xlabel("triangles (32 x 1024 rays)")
    axes[1].set_ylim(1.0, 20.0)

    (_, alone), *others = objects
    exponent, x, y = fit([(n, max(ms - alone, 1e-3)) for n, ms in others])
    print(f"  casting: time added by moving objects ~ objects^{exponent:.2f}")
    axes[2].plot(*zip(*objects, strict=True), "o", color="C0")
    label = f"casting: {alone:.1f} ms + c objects$^{{{exponent:.2f}}}$"
    axes[2].plot(x, alone + y, color="C0", label=label)
    axes[2].set_xlabel("moving objects (32 x 1024 rays)")
    axes[2].set_ylim(bottom=0.0)
    for axis in axes:
        axis.set_ylabel("CPU time of a frame [ms]")
        axis.grid(True, alpha=0.3)
        axis.legend()
    figure.suptitle(title)
    figure.savefig(output, dpi=120)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--output", type=Path, required=True)
    parser.add_argument("--drive", default="metropolis_04")
    parser.add_argument("--rounds", type=int, default=7)
    arguments = parser.parse_args()
    drive, rounds = arguments.drive, arguments.rounds
    geometries = read_stage(drive)
    poses = sensor_poses(drive, POSES)
    print(f"{drive}, {rounds} rounds, medians of CPU time")
    draw(
        against_rays(geometries, poses, rounds),
        of_recordings(drive, rounds),
        against_triangles(geometries, poses, rounds),
        against_objects(geometries, poses, rounds),
        f"Cost of a frame, {drive}, one thread",
        arguments.output,
    )


if __name__ == "__main__":
    main()
