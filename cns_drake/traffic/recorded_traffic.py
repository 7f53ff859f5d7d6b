"""The recorded traffic of a map: a family, with a file `traffic.npz` per map.

The files of the shipped maps were recorded with release 4.0.0, the last one
that planned traffic by rules of its own: for each map 600 s of 60 vehicles and
72 pedestrians with the seed 1, who kept clear of the objects of all stages. No
ego car drove. The 60 pedestrians who got about most were kept.
"""

from collections.abc import Mapping
from pathlib import Path

import numpy as np

from cns_drake.traffic.ego_car import STEP, EgoBox, EgoPath, meetings_with_ego
from cns_drake.traffic.traffic_plan import (
    KINDS,
    WALKER_SIZE,
    Tracks,
    TrafficPlan,
    gait_phases,
)
from evaluation.base import read_npz, value_errors

_NAMES = (
    "period", "units", "kinds",
    "vehicles_start", "vehicles", "walkers_start", "walkers",
)  # fmt: skip
# Number of times in the recording that are tried as the start of the drive.
_TRIES = 8
# Time for which traffic goes on after the drive, for a LiDAR that still turns,
# and for the splines [s].
_AFTER = 2.0


def read_recorded(path: Path) -> TrafficPlan:
    """Reads the recorded traffic of a map.

    Raises:
        InputError: the file cannot be read, or is no recorded traffic.
    """
    by_name = {kind.name: kind for kind in KINDS}
    with value_errors(f"{path}: no recorded traffic"):
        found = read_npz(path, _NAMES)
        if missing := [name for name in _NAMES if name not in found]:
            raise ValueError(f"it has no array {missing[0]!r}")
        dt = float(found["period"].reshape(()))
        names = found["kinds"].reshape(-1).tolist()
        if unknown := [name for name in names if name not in by_name]:
            raise ValueError(f"kinds: {unknown[0]!r} is none")
        vehicles, walkers = (
            _coordinates(found, who) for who in ("vehicles", "walkers")
        )
        count = len(vehicles)
        if not (
            0.0 < dt < np.inf
            and count > 1
            and vehicles.shape == (count, len(names), 5)
            and (len(walkers), walkers.shape[2]) == (count, 4)
        ):
            raise ValueError("its arrays do not fit together")
    # Pedestrians begin anywhere in their gait.
    phases = np.arange(walkers.shape[1]) + gait_phases(walkers[..., :2], dt)
    return TrafficPlan(
        tuple(by_name[name] for name in names),
        Tracks(dt, vehicles),
        Tracks(dt, np.concatenate([walkers, phases[..., None]], axis=2)),
    )


def _coordinates(found: Mapping[str, np.ndarray], who: str) -> np.ndarray:
    """Returns the coordinates (K, N, D) of vehicles or walkers.

    The file contains their second differences along time, in integers.
    """
    whole = np.concatenate([found[f"{who}_start"], found[who]], axis=2)
    values = np.cumsum(np.cumsum(whole.astype(np.int64), axis=2), axis=2)
    units = found["units"].astype(float)[: len(values)]
    return np.asarray(values.T * units)


def play_recorded(
    recorded: TrafficPlan,
    *,
    vehicles: int,
    walkers: int,
    seed: int,
    duration: float,
    ego: EgoPath,
    ego_box: EgoBox,
) -> TrafficPlan:
    """Returns some of the road users of a recording, for a drive.

    The seed determines when in the recording the drive begins, and which road
    users are chosen. Those that would meet the ego car are not chosen. If then
    too few are left, other beginnings are tried, and the best one is taken.

    Args:
        recorded: the traffic of the map.
        vehicles, walkers: requested numbers, at most those of the recording.
        seed: seed of all choices.
        duration: duration of the drive [s]. If the recording is shorter, the
            drive begins with the recording.
        ego: motion of the ego car.
        ego_box: size of the ego car.
    """
    rng = np.random.default_rng(seed)
    both = recorded.vehicles, recorded.walkers
    orders = [rng.permutation(tracks.values.shape[1]) for tracks in both]
    sizes = (
        [kind.size for kind in recorded.kinds],
        [WALKER_SIZE] * len(orders[1]),
    )
    dt, length = recorded.vehicles.dt, len(recorded.vehicles.values)
    number = min(length, int(np.ceil((duration + _AFTER) / dt)) + 1)
    times = np.arange(0.0, min(duration, (length - 1) * dt) + STEP, STEP)
    best: TrafficPlan | None = None
    for start in rng.permutation(length - number + 1)[:_TRIES].tolist():
        parts = [
            Tracks(dt, tracks.values[start : start + number]) for tracks in both
        ]
        kept = []
        for part, order, boxes, wanted in zip(
            parts, orders, sizes, (vehicles, walkers), strict=True
        ):
            met = meetings_with_ego(part, boxes, times, ego, ego_box)
            is_apart = ~np.any(met, axis=0)[order]
            kept.append(np.sort(order[is_apart][:wanted]))
        left_out = vehicles + walkers - sum(map(len, kept))
        if best is None or left_out < best.left_out:
            best = TrafficPlan(
                tuple(recorded.kinds[k] for k in kept[0]),
                parts[0].select(kept[0]),
                parts[1].select(kept[1]),
                left_out,
            )
        if best.left_out == 0:
            break
    assert best is not None
    return best
