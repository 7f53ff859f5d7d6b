"""The poses of a vehicle just after the current time, for its LiDARs."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from pydrake.common.value import AbstractValue, Value
from pydrake.math import RigidTransform
from pydrake.systems.framework import (
    Context,
    LeafSystem,
)

from cns_drake.base import product, rotated
from cns_drake.motion.trajectory import Trajectory


class Sweep(NamedTuple):
    """Poses of a frame P in W at N times.

    Attributes:
        R_WPset: (N, 3, 3) rotations.
        p_WPset: (N, 3) positions [m].
    """

    R_WPset: np.ndarray
    p_WPset: np.ndarray

    def of_frame(self, X_PS: RigidTransform) -> Sweep:
        """Returns the poses of a frame S that is fixed in P at X_PS."""
        return Sweep(
            product(self.R_WPset, X_PS.rotation().matrix()),
            self.p_WPset + rotated(self.R_WPset, X_PS.translation()),
        )


class VehicleSweep(LeafSystem):
    """A system that returns poses of a vehicle just after the current time.

    A LiDAR needs these poses because it rotates during a frame: most beams of a
    scan are cast after the time of the scan, but the SceneGraph has poses only
    for the time of the scan.

    .. pydrake_system::

        name: VehicleSweep
        output_ports:
        - sweep

    `sweep` is abstract: a `Sweep` of the vehicle frame B at the current time
    plus each of the given offsets. After the end of the trajectory, B stays at
    its last pose.
    """

    def __init__(self, trajectory: Trajectory, offsets: np.ndarray):
        """Declares the port, for time offsets (N,) [s]."""
        super().__init__()
        self._trajectory = trajectory
        self._offsets = np.array(offsets, dtype=float)
        self.DeclareAbstractOutputPort(
            "sweep",
            alloc=lambda: Value(object()),
            calc=self._calc_sweep,
            prerequisites_of_calc={self.time_ticket()},
        )

    def _calc_sweep(self, context: Context, output: AbstractValue) -> None:
        times = context.get_time() + self._offsets
        output.set_value(Sweep(*self._trajectory.poses(times)))
