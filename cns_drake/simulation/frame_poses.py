"""The poses of all frames of a drive, in one array."""

import numpy as np
from pydrake.common.value import AbstractValue, Value
from pydrake.math import RigidTransform
from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import BodyIndex
from pydrake.systems.framework import (
    Context,
    LeafSystem,
)

from cns_drake.ray_casting import KnownPoses
from cns_drake.traffic import TrafficMotion


class FramePoses(LeafSystem):
    """Joins the poses of a plant's bodies and of the traffic's parts.

    .. pydrake_system::

        name: FramePoses
        input_ports:
        - body_poses
        - traffic_poses (with traffic)
        output_ports:
        - frame_poses

    `body_poses` is abstract: the poses X_WB of the plant's bodies, as a list.
    `traffic_poses` and `frame_poses` are abstract, of type `KnownPoses`.

    A LiDAR that has all poses need not ask the SceneGraph, which would compute
    the poses of all geometry. This computation would take 5 % of a scan's time
    without traffic, and a third of a scan's time with traffic.
    """

    def __init__(self, plant: MultibodyPlant, traffic: TrafficMotion | None):
        """Declares the ports.

        Args:
            plant: the plant whose bodies have the poses on `body_poses`.
            traffic: the traffic whose parts have the poses on `traffic_poses`;
                None without traffic.
        """
        super().__init__()
        bodies = range(plant.num_bodies())
        frames = [plant.GetBodyFrameIdIfExists(BodyIndex(k)) for k in bodies]
        self._rows = {f: k for k, f in enumerate(frames) if f is not None}
        if traffic is not None:
            limbs = traffic.moving_frames.items()
            self._rows |= {f: len(frames) + k for f, k in limbs}
        self._body_poses = self.DeclareAbstractInputPort(
            "body_poses", AbstractValue.Make([RigidTransform()])
        )
        self._traffic_poses = self.DeclareAbstractInputPort(
            "traffic_poses", Value(object())
        )
        self.DeclareAbstractOutputPort(
            "frame_poses",
            lambda: Value(object()),
            self._calc_frame_poses,
            {self.all_input_ports_ticket()},
        )

    def _calc_frame_poses(
        self, context: Context, output: AbstractValue
    ) -> None:
        X_WFs = np.array(
            [X_WB.GetAsMatrix4() for X_WB in self._body_poses.Eval(context)]
        )
        if self._traffic_poses.HasValue(context):
            X_WLs = self._traffic_poses.Eval(context).X_WFs
            X_WFs = np.concatenate([X_WFs, X_WLs])
        output.set_value(KnownPoses(self._rows, X_WFs))
