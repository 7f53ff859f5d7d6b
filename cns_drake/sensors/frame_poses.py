"""The poses of many frames as one array."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from pydrake.common.value import AbstractValue, Value
from pydrake.geometry import FrameId
from pydrake.math import RigidTransform
from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import BodyIndex
from pydrake.systems.framework import Context, LeafSystem


class FramePoses(LeafSystem):
    """Joins the poses of a plant's bodies and those of other frames.

    A LiDAR that has the poses of all frames from here does not ask the
    SceneGraph for any. The SceneGraph would compute the poses of all geometry,
    which takes longer than a tenth of a recorded frame.

    .. pydrake_system::

        name: FramePoses
        input_ports:
        - body_poses
        - more_poses (if there are more frames)
        output_ports:
        - frame_poses

    `body_poses` is a list over a plant's bodies of X_WB, as a MultibodyPlant
    gives it; `more_poses` an (N, 4, 4) array; `frame_poses` is abstract, the
    (M, 4, 4) array of all poses, whose rows are `rows`.
    """

    def __init__(
        self, plant: MultibodyPlant, more: Mapping[FrameId, int] | None = None
    ):
        """Declares the ports.

        Args:
            plant: has the bodies, registered with a SceneGraph.
            more: other frames -> row of their poses in `more_poses`.
        """
        super().__init__()
        num_bodies = plant.num_bodies()
        frames = [
            plant.GetBodyFrameIdIfExists(BodyIndex(k))
            for k in range(num_bodies)
        ]
        self.rows = {f: k for k, f in enumerate(frames) if f is not None}
        self._body_poses = self.DeclareAbstractInputPort(
            "body_poses", AbstractValue.Make([RigidTransform()])
        )
        inputs = {self._body_poses.ticket()}
        self._more_poses = None
        if more is not None:
            self.rows |= {frame: num_bodies + k for frame, k in more.items()}
            self._more_poses = self.DeclareAbstractInputPort(
                "more_poses", Value(np.zeros((0, 4, 4)))
            )
            inputs.add(self._more_poses.ticket())
        self.DeclareAbstractOutputPort(
            "frame_poses",
            lambda: Value(np.zeros((0, 4, 4))),
            self._calc_frame_poses,
            inputs,
        )

    def _calc_frame_poses(
        self, context: Context, output: AbstractValue
    ) -> None:
        X_WFs = np.array(
            [X_WB.GetAsMatrix4() for X_WB in self._body_poses.Eval(context)]
        )
        if self._more_poses is not None:
            X_WFs = np.concatenate([X_WFs, self._more_poses.Eval(context)])
        output.set_value(X_WFs)
