"""Poses of frames that are known without a query of the SceneGraph."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import NamedTuple

import numpy as np
from pydrake.geometry import FrameId
from pydrake.math import RigidTransform


class KnownPoses(NamedTuple):
    """Poses of M frames F in the world.

    Attributes:
        rows: frame -> row of its pose. All KnownPoses of a simulation share
            this mapping.
        X_WFs: (M, 4, 4) poses.
    """

    rows: Mapping[FrameId, int]
    X_WFs: np.ndarray

    def __deepcopy__(self, memo: dict) -> KnownPoses:
        # A Context is cloned together with this value. It never changes, and
        # frames cannot be copied.
        return self

    def find(
        self, frame: FrameId, calc_X_WF: Callable[[FrameId], RigidTransform]
    ) -> RigidTransform:
        """Returns the pose X_WF of a frame F, computed if it is unknown.

        Args:
            frame: the frame F.
            calc_X_WF: function that computes X_WF from `frame`.
        """
        row = self.rows.get(frame)
        if row is None:
            return calc_X_WF(frame)
        return RigidTransform(self.X_WFs[row])


NOTHING_KNOWN = KnownPoses({}, np.zeros((0, 4, 4)))
