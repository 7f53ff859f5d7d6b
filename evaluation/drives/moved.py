"""A drive whose poses have been corrected."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from cns_drake.base.drives.drive import Drive
from evaluation.drives.drive_view import DriveView


class MovedDrive(DriveView):
    """The scans of another drive at corrected poses."""

    def __init__(
        self,
        drive: Drive,
        X_WS: np.ndarray,
        world_frame: str,
        datum: str | None,
    ):
        """Gives a drive other poses.

        Args:
            drive: of N scans.
            X_WS: (N, 4, 4).
            world_frame: name of W.
            datum: see `Drive.datum`.
        """
        super().__init__(drive)
        self.world_frame = world_frame
        self._X_WS = X_WS
        self._datum = datum

    @property
    def X_WS(self) -> np.ndarray:
        return self._X_WS

    def scan(self, index: int) -> np.ndarray:
        return self._drive.scan(index)

    @property
    def datum(self) -> str | None:
        return self._datum

    @property
    def notes(self) -> tuple[str, ...]:
        return self._drive.notes

    @property
    def instances(self) -> Mapping[int, Mapping] | None:
        return self._drive.instances
