"""Poses of a vehicle while a LiDAR on it turns."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from pydrake.common.value import AbstractValue, Value
from pydrake.math import RigidTransform
from pydrake.systems.framework import Context, LeafSystem

from cns_drake.motion.trajectory import Trajectory


class Sweep(NamedTuple):
    """Poses of a frame P in the world at N times.

    Attributes:
        R_WPset: (N, 3, 3) float64.
        p_WPset: (N, 3) float64 [m].
    """

    R_WPset: np.ndarray
    p_WPset: np.ndarray

    def of_frame(self, X_PS: RigidTransform) -> Sweep:
        """Returns the poses of a frame S that is fixed in P."""
        return Sweep(
            self.R_WPset @ X_PS.rotation().matrix(),
            self.p_WPset + self.R_WPset @ X_PS.translation(),
        )


class VehicleSweep(LeafSystem):
    """Gives the poses of a vehicle at times shortly after the present one.

    A LiDAR keeps turning during a frame. Its output at a time needs poses of
    later times, which the SceneGraph does not have.

    .. pydrake_system::

        name: VehicleSweep
        output_ports:
        - sweep

    `sweep` is abstract, a `Sweep` of the vehicle frame B at the present time
    plus each offset. After the end of the trajectory B rests there.
    """

    def __init__(self, trajectory: Trajectory, offsets: np.ndarray):
        """Declares the port.

        Args:
            trajectory: of B.
            offsets: (N,) times after the present one [s].
        """
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
