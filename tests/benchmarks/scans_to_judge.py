"""Simulated scans for `real_or_simulated.py`, as the notes describe them.

    python tests/benchmarks/scans_to_judge.py OUT [--scans N]
        [--drive NAME ...] [--full-streets]

Writes N scans of each drive, evenly over its time, into folders of their own:
`hdl-64e` with calibrated returns, 1.73 m above the ground, among 60 vehicles on
ride A. The motion of the car during a turn is undone, as in KITTI's scans.

With --full-streets, streets are filled with cars along the kerb and with
hedges, walls and shrubs behind them, wherever there is room. It shows how much
of what a classifier sees is what stands in a city, and not how it is measured.
"""

from __future__ import annotations

import argparse
import math
from pathlib import Path
import sys

import numpy as np
from pydrake.math import RigidTransform, RollPitchYaw
import shapely
from shapely.geometry.base import BaseGeometry

from cns_drake.base.points import encode_bin
from cns_drake.city.furniture.parked_cars import PARKED_CARS
from cns_drake.city.geometry.polygons import placed
from cns_drake.city.geometry.structures import Builder, Model, part_triangles
from cns_drake.city.placement.objects import OBJECTS
from cns_drake.motion.trajectory import Trajectory
from cns_drake.scenarios.scenario import Scenario
from cns_drake.scenarios.scenario_files import load_scenario, make_scenario
from cns_drake.scene.world import World
from cns_drake.simulation.loaded_drive import load_drive
from cns_drake.simulation.station import make_station
from cns_drake.transient.scene_editing import SceneEditing, Surroundings
from cns_drake.transient.world_structures import (
    GROUND_CLASSES,
    read_structures,
)

DRIVES = ("riverside_02", "metropolis_04", "suburbia_02")
# Turns of the unit [s], and steps of the poses during one.
_PERIOD, _STEPS = 0.1, 10
# Free width on both sides of the way of the car [m].
_CLEAR = 1.3
_CARS = ("city_car", "hatchback", "saloon", "estate", "suv", "van")
_FENCES = ("garden_wall", "hoarding")
# Rows beside the way: kinds, spacing, nearest place and by how much it varies,
# farthest place [m], and the part of the places that has one.
_ROWS = {
    "car": (_CARS, 6.0, 2.6, 0.0, 6.5, 0.5),
    "hedge": (("hedge",), 6.2, 6.5, 3.0, 14.0, 0.4),
    "fence": (_FENCES, 6.2, 6.5, 3.0, 14.0, 0.2),
    "shrub": (("shrub", "low_shrub"), 4.0, 7.0, 8.0, 18.0, 0.2),
}
_ROW_STEP = 0.4


def judged(name: str) -> Scenario:
    """Returns the scenario of a drive whose scans are judged."""
    own = load_scenario(name).model_dump(mode="json", exclude_none=True)
    key, lidar = next(iter(own["lidars"].items()))
    lidar |= {
        "preset": "hdl-64e",
        "rate": round(1.0 / _PERIOD),
        "returns": "calibrated",
        "columns": 2156,
        "xyz": [0.0, 0.0, 1.73],
        "motion_distortion": True,
    }
    for field in ("min_range", "max_range"):
        lidar.pop(field, None)
    own["lidars"] = {key: lidar}
    own.setdefault("traffic", {})["vehicles"] = 60
    own["ride"] = {"roughness": "A"}
    return make_scenario(own, name)


def undistorted(
    scan: np.ndarray, trajectory: Trajectory, X_BS: RigidTransform, begin: float
) -> np.ndarray:
    """Returns a scan as if it was taken in the middle of its turn.

    The turn begins at a time [s]; between steps, points are interpolated.
    """
    times = begin + np.linspace(0.0, _PERIOD, _STEPS + 1)
    X_SW = (trajectory.pose(begin + _PERIOD / 2) @ X_BS).inverse()
    X_SSs = np.array(
        [(X_SW @ trajectory.pose(t) @ X_BS).GetAsMatrix4() for t in times]
    )
    part = scan["t"] * 1e-9 / _PERIOD * _STEPS
    step = np.clip(part.astype(int), 0, _STEPS - 1)
    part = (part - step)[:, None]
    p = np.stack([scan[axis] for axis in "xyz"], axis=1).astype(float)
    before, after = (
        np.einsum("nij,nj->ni", X_SSs[k, :3, :3], p) + X_SSs[k, :3, 3]
        for k in (step, step + 1)
    )
    result = scan.copy()
    moved = (1.0 - part) * before + part * after
    for axis, values in zip("xyz", moved.T, strict=True):
        result[axis] = values
    return result


class _Filling:
    """Streets that are being filled, along a drive."""

    def __init__(self, world: World, drive: BaseGeometry):
        kept_free = drive.buffer(_CLEAR)
        self.editing = SceneEditing(world)
        self._around = Surroundings(
            self.editing, read_structures(world), drive, kept_free, seed=5
        )
        self._standing = self._around.obstacles(ignored=GROUND_CLASSES)
        self._areas: list[BaseGeometry] = []

    def put(
        self,
        row: str,
        builder: Builder,
        model: Model,
        places: np.ndarray,
        yaw: float,
    ) -> None:
        """Puts a thing at the first of (N, 2) places with room for it [m]."""
        corners = np.concatenate(
            [part_triangles(part, model.meshes)[0] for part in model.parts]
        )[:, :2]
        box = shapely.box(*corners.min(axis=0), *corners.max(axis=0))
        for at, z in zip(
            places, self._around.ground.heights(places), strict=True
        ):
            area = placed(box, at, yaw)
            if (
                np.isfinite(z)
                and self._standing.is_free(area)
                and not shapely.intersects(self._areas, area).any()
            ):
                break
        else:
            return
        self.editing.add(
            f"{row}_beside_{len(self._areas):05d}",
            builder.semantic_class,
            model,
            RigidTransform(RollPitchYaw(0.0, 0.0, yaw), [*at, z]),
            "full-streets",
        )
        self._areas.append(area)


def fill_streets(world: World, drive: shapely.LineString) -> World:
    """Returns a world with things on both sides of a drive."""
    filling, rng = _Filling(world, drive), np.random.default_rng(7)
    for row, (kinds, spacing, near, more, far, share) in _ROWS.items():
        for side in (1.0, -1.0):
            for along in np.arange(0.0, drive.length - 0.5, spacing):
                start, end = (
                    np.array(drive.interpolate(along + k).coords[0])
                    for k in (0.0, 0.5)
                )
                yaw = math.atan2(*(end - start)[::-1])
                if rng.uniform() > share:
                    continue
                name = str(rng.choice(kinds))
                builder = (PARKED_CARS if row == "car" else OBJECTS)[name]
                size = {}
                if row in ("hedge", "fence"):
                    size["length"] = 6.0
                if row == "hedge":
                    size["height"] = float(rng.uniform(1.2, 3.0))
                model = builder.build(rng, **size)
                aside = side * np.array([-math.sin(yaw), math.cos(yaw)])
                first = near + more * rng.uniform()
                away = np.arange(first, far, _ROW_STEP)[:, None]
                filling.put(row, builder, model, start + away * aside, yaw)
    return filling.editing.finish()


def write_scans(name: str, out: Path, number: int, *, is_full: bool) -> None:
    """Writes scans of a drive, ring by ring as KITTI's."""
    scenario = judged(name)
    loaded = load_drive(scenario)
    trajectory, world = loaded.trajectory, loaded.world
    if is_full:
        times = np.arange(0.0, trajectory.duration, 0.1)
        way = shapely.LineString(trajectory.poses(times)[1][:, :2])
        world = fill_streets(world, way)
    diagram = make_station(
        scenario, world=world, trajectory=trajectory, traffic=loaded.traffic
    )
    context = diagram.CreateDefaultContext()
    key, X_BS = next(iter(loaded.X_BSs.items()))
    for part in np.linspace(0.1, 0.9, number):
        frame = round(part * loaded.num_frames)
        print(f"{name}: frame {frame}", file=sys.stderr)
        context.SetTime(frame * _PERIOD)
        scan = diagram.GetOutputPort(f"{key}_scan").Eval(context)
        scan = undistorted(scan, trajectory, X_BS, frame * _PERIOD)
        azimuth = np.arctan2(scan["y"], scan["x"]) % (2.0 * np.pi)
        folder = out / f"{name}_{frame:05d}"
        folder.mkdir(parents=True)
        ordered = scan[np.lexsort((azimuth, scan["ring"]))]
        (folder / "000000.bin").write_bytes(encode_bin(ordered))


def main() -> None:
    """Runs the program."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("out", type=Path)
    parser.add_argument("--scans", type=int, default=7)
    parser.add_argument("--drive", action="append")
    parser.add_argument("--full-streets", action="store_true")
    options = parser.parse_args()
    for name in options.drive or DRIVES:
        write_scans(
            name, options.out, options.scans, is_full=options.full_streets
        )


if __name__ == "__main__":
    main()
