"""One trial of a plan of traffic, and the bodies it has to leave out."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from cns_drake.traffic.overlaps import find_overlaps, whom_to_leave_out
from cns_drake.traffic.presence import EgoBox
from cns_drake.traffic.vehicle_kinds import VehicleKind
from cns_drake.traffic.walker_steps import WALKER_LENGTH, WALKER_WIDTH

# Boxes keep this distance, since they are compared only now and then [m].
_APART = 0.1


@dataclass(frozen=True)
class WantedBodies:
    """Numbers of vehicles and walkers that a plan should have."""

    vehicles: int
    walkers: int


class PlanningTrial:
    """K planned steps of N vehicles and M walkers, and their overlaps so far.

    Args:
        kinds: of the N vehicles.
        num_walkers: M.
        ego_track: (2 K - 1, 3) x, y [m], heading [rad] of the middle of the
            ego car's box at half steps.
        ego_box: its size.
        wanted: numbers of bodies; those in excess are spare.

    Attributes:
        kinds: of the N vehicles.
        vehicles: (K, N, 5) x, y, z of the middle of each box on the ground
            [m], yaw and pitch [rad].
        walkers: (K, M, 5) x, y, z on the ground [m], yaw and phase of the gait
            [rad].
    """

    def __init__(
        self,
        kinds: Sequence[VehicleKind],
        num_walkers: int,
        ego_track: np.ndarray,
        ego_box: EgoBox,
        wanted: WantedBodies,
    ) -> None:
        num_steps = (len(ego_track) + 1) // 2
        self.kinds = tuple(kinds)
        self.vehicles = np.zeros((num_steps, len(kinds), 5))
        self.walkers = np.zeros((num_steps, num_walkers, 5))
        self._ego_track = ego_track
        self._wanted = wanted
        ego_half = (ego_box.front - ego_box.rear) / 2, ego_box.half_width
        self._half = _APART / 2 + np.array(
            [
                ego_half,
                *((k.size[0] / 2, k.size[1] / 2) for k in kinds),
                *([(WALKER_LENGTH / 2, WALKER_WIDTH / 2)] * num_walkers),
            ]
        )
        self._overlaps = np.zeros((len(self._half), len(self._half)), bool)

    def look_for_overlaps(self, steps: range) -> None:
        """Adds the overlaps since the step before `steps`, at half steps."""
        first = max(steps.start - 1, 0)
        rows = slice(first, steps.stop)
        poses = np.concatenate(
            [
                self._ego_track[2 * first : 2 * steps.stop - 1, None],
                _at_half_steps(self.vehicles[rows]),
                _at_half_steps(self.walkers[rows]),
            ],
            axis=1,
        )
        find_overlaps(poses, self._half, self._overlaps)

    def kept(self) -> tuple[list[int], list[int]]:
        """Returns the vehicles and the walkers that meet no other body."""
        out = set(whom_to_leave_out(self._overlaps, 1))
        first_walker = 1 + len(self.kinds)
        vehicles = [k for k in range(1, first_walker) if k not in out]
        walkers = [
            k for k in range(first_walker, len(self._half)) if k not in out
        ]
        return (
            [k - 1 for k in vehicles[: self._wanted.vehicles]],
            [k - first_walker for k in walkers[: self._wanted.walkers]],
        )

    def left_out(self) -> int:
        """Returns how many of the wanted bodies the plan has to leave out."""
        vehicles, walkers = self.kept()
        wanted = self._wanted
        return wanted.vehicles - len(vehicles) + wanted.walkers - len(walkers)


def _at_half_steps(values: np.ndarray) -> np.ndarray:
    """Returns x, y, yaw (2 K - 1, N, 3) of (K, N, 5) at and between K times."""
    xy_yaw = values[:, :, [0, 1, 3]]
    xy_yaw[:, :, 2] = np.unwrap(xy_yaw[:, :, 2], axis=0)
    result = np.empty((2 * len(xy_yaw) - 1, *xy_yaw.shape[1:]))
    result[::2] = xy_yaw
    result[1::2] = (xy_yaw[1:] + xy_yaw[:-1]) / 2
    return result
