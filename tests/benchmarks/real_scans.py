"""Compares simulated scans with real ones of the same unit.

    python tests/benchmarks/real_scans.py KITTI/velodyne [--figure FILE.png]

KITTI/velodyne is a folder of scans of KITTI odometry, recorded by a Velodyne
HDL-64E. The simulated scans are those of `hdl-64e` in Suburbia, with ideal and
with calibrated returns.
"""

from __future__ import annotations

import argparse
from pathlib import Path

import matplotlib as mpl
from matplotlib import pyplot as plt
import numpy as np
from scipy.spatial import cKDTree

from cns_drake import load_scenario, make_station

# Firings of the unit in a turn of 0.1 s, by its manual.
_REAL_BEAMS = 64 * 2083
_NUM_SCANS = 15
# Points about a place: of several rings, so that they show a plane.
_NEIGHBOURS = 60
_ACROSS = 0.1
_SENSOR_HEIGHT = {"real": 1.73, "simulated": 1.6}


def read_real(folder: Path) -> list[np.ndarray]:
    """Returns scans as (N, 4) x, y, z [m] and intensity from 0 to 100."""
    scans = []
    for path in sorted(folder.glob("*.bin"))[:_NUM_SCANS]:
        scan = np.fromfile(path, np.float32).reshape(-1, 4).astype(float)
        scan[:, 3] *= 100.0
        scans.append(scan)
    return scans


def simulate(returns: str) -> tuple[list[np.ndarray], int]:
    """Returns scans likewise, and the number of beams."""
    scenario = load_scenario("suburbia_02").with_lidar("hdl-64e")
    scenario = scenario.with_returns(returns)
    diagram = make_station(scenario)
    context = diagram.CreateDefaultContext()
    port = diagram.GetOutputPort("lidar_scan")
    scans = []
    for number in range(_NUM_SCANS):
        context.SetTime(10.0 * number)
        scan = port.Eval(context)
        fields = ("x", "y", "z", "intensity")
        scans.append(np.stack([scan[f] for f in fields], axis=1).astype(float))
    pattern = diagram.GetSubsystemByName("lidar").pattern
    return scans, pattern.num_beams


def measure(scan: np.ndarray, num_beams: int, height: float) -> dict:
    """Returns figures of one scan."""
    p, intensity = scan[:, :3], scan[:, 3]
    ranges = np.linalg.norm(p, axis=1)
    rng = np.random.default_rng(1)
    near = np.flatnonzero((ranges > 4.0) & (ranges < 25.0))
    chosen = rng.choice(near, 3000, replace=False)
    distance, rows = cKDTree(p).query(p[chosen], _NEIGHBOURS)
    dense = distance[:, -1] < 0.8
    groups = p[rows[dense]]
    spread = groups - groups.mean(axis=1, keepdims=True)
    values, vectors = np.linalg.eigh(
        np.einsum("nki,nkj->nij", spread, spread) / _NEIGHBOURS
    )
    flat = (values[:, 1] > _ACROSS**2) & (values[:, 1] > 16.0 * values[:, 0])
    residual = np.sqrt(np.maximum(values[flat, 0], 0.0))
    normal = vectors[flat][:, :, 0]
    middle = p[chosen[dense][flat]]
    to_sensor = middle / np.linalg.norm(middle, axis=1, keepdims=True)
    cosine = np.abs(np.einsum("ni,ni->n", normal, to_sensor))
    bright = intensity[chosen[dense][flat]]
    ground = (np.abs(middle[:, 2] + height) < 0.3) & (
        np.abs(normal[:, 2]) > 0.95
    )
    front = np.abs(normal[:, 2]) < 0.2
    # Points that hang in the air between surfaces, with few neighbours.
    lone = cKDTree(p).query(p[chosen], 4)[0][:, -1] > 0.02 * ranges[chosen]
    steep = front & (cosine > 0.8)
    return {
        "share of returns": len(scan) / num_beams,
        "plane residual [mm]": 1e3 * float(np.median(residual)),
        "ground, below 10 m": _mean(bright[ground & (cosine > 0.17)]),
        "ground, beyond 10 m": _mean(bright[ground & (cosine <= 0.17)]),
        "fronts, facing": _mean(bright[steep]),
        "fronts, at a slant": _mean(bright[front & (cosine < 0.5)]),
        "lone points": float(np.mean(lone)),
    }


def _mean(values: np.ndarray) -> float:
    return float(np.median(values)) if len(values) > 20 else float("nan")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("folder", type=Path)
    parser.add_argument("--figure", type=Path)
    arguments = parser.parse_args()
    groups = {"real": (read_real(arguments.folder), _REAL_BEAMS)}
    for returns in ("ideal", "calibrated"):
        groups[returns] = simulate(returns)
    table = {}
    for name, (scans, num_beams) in groups.items():
        height = _SENSOR_HEIGHT["real" if name == "real" else "simulated"]
        figures = [measure(scan, num_beams, height) for scan in scans]
        table[name] = {
            key: np.nanmedian([one[key] for one in figures])
            for key in figures[0]
        }
    for key in table["real"]:
        print(key, *(f"{table[name][key]:.3f}" for name in table), sep=" | ")
    if arguments.figure:
        draw(groups, arguments.figure)


def draw(groups: dict, path: Path) -> None:
    """Draws intensity over range of each group."""
    mpl.use("Agg")
    figure, axes = plt.subplots(1, len(groups), figsize=(11, 3.2), sharey=True)
    for axis, (name, (scans, _)) in zip(axes, groups.items(), strict=True):
        scan = np.concatenate(scans)
        ranges = np.linalg.norm(scan[:, :3], axis=1)
        intensity = scan[:, 3] * (100.0 if name == "ideal" else 1.0)
        axis.hist2d(
            ranges, intensity, bins=(60, 52), range=((0, 60), (0, 104)),
            norm="log", cmap="viridis",
        )  # fmt: skip
        axis.set_title(name)
        axis.set_xlabel("range [m]")
    axes[0].set_ylabel("intensity [%]")
    figure.tight_layout()
    figure.savefig(path, dpi=110)


if __name__ == "__main__":
    main()
