"""The poses of a vehicle just after the current time, for its LiDARs."""

from typing import NamedTuple

import numpy as np
from pydrake.systems.framework import BasicVector, Context, LeafSystem

from cns_drake.motion.trajectory import Trajectory


class Sweep(NamedTuple):
    """Poses of a frame P in W at N times.

    Attributes:
        R_WPset: (N, 3, 3) rotations.
        p_WPset: (N, 3) positions [m].
    """

    R_WPset: np.ndarray
    p_WPset: np.ndarray

    def numbers(self) -> np.ndarray:
        """Returns the value of a port `sweep`.

        Returns:
            (12 N,): for each pose, the three rows of the matrix [R_WP p_WP].
        """
        return np.concatenate(
            [self.R_WPset, self.p_WPset[:, :, None]], axis=2
        ).ravel()


class VehicleSweep(LeafSystem):
    """A system that returns poses of a vehicle just after the current time.

    A LiDAR needs these poses because it rotates during a frame: most beams of a
    scan are cast after the time of the scan, but the SceneGraph has poses only
    for the time of the scan.

    .. pydrake_system::

        name: VehicleSweep
        output_ports:
        - sweep

    `sweep` is a vector, the `numbers` of a `Sweep`: poses of the vehicle frame
    B at the current time plus each of the given offsets. After the end of the
    trajectory, B stays at its last pose.
    """

    def __init__(self, trajectory: Trajectory, offsets: np.ndarray):
        """Declares the port, for time offsets (N,) [s]."""
        super().__init__()
        self._trajectory = trajectory
        self._offsets = np.array(offsets, dtype=float)
        self.DeclareVectorOutputPort(
            "sweep",
            12 * len(self._offsets),
            calc=self._calc_sweep,
            prerequisites_of_calc={self.time_ticket()},
        )

    def _calc_sweep(self, context: Context, output: BasicVector) -> None:
        times = context.get_time() + self._offsets
        output.SetFromVector(Sweep(*self._trajectory.poses(times)).numbers())
