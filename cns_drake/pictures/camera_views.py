"""Views of a camera, and the file `views.yaml` with a map's named views."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import numpy as np
from numpy.typing import ArrayLike
from pydantic import (
    BaseModel,
    ConfigDict,
    Field,
    TypeAdapter,
    ValidationError,
    model_validator,
)
from pydrake.math import RigidTransform, RotationMatrix

from evaluation.base import InputError, describe_validation_error, read_yaml

_Coordinate = Annotated[float, Field(ge=-1e6, le=1e6)]
# Nearer points are not in a picture [m].
_NEAREST = 0.1
Place = tuple[_Coordinate, _Coordinate, _Coordinate]


class View(BaseModel):
    """The position and direction of a camera.

    Attributes:
        position: position of the camera in W [m].
        target: point in W that is in the centre of the picture [m].
        fov_y_deg: vertical field of view [deg].
    """

    model_config = ConfigDict(extra="forbid", frozen=True)

    position: Place
    target: Place
    fov_y_deg: float = Field(default=50.0, ge=0.1, le=179.0)

    @model_validator(mode="after")
    def _check_direction(self) -> View:
        if np.linalg.norm(np.subtract(self.target, self.position)) < 1e-3:
            raise ValueError("position and target are the same")
        return self

    def pose(self) -> RigidTransform:
        """Returns the pose X_WC of the camera, with x forward, y left, z up."""
        return look_at(self.position, self.target)

    def project(
        self, p_WQset: np.ndarray, width: int, height: int
    ) -> tuple[np.ndarray, np.ndarray]:
        """Returns where points are in the picture of the camera.

        Points outside the picture are left out. Occluded points are not left
        out.

        Args:
            p_WQset: (N, 3) points in W [m].
            width, height: size of the picture [pixels].

        Returns:
            (M, 2) positions in the picture, from its upper left corner
            [pixels]; the indices (M,) of these points.
        """
        scale = height / 2 / np.tan(np.deg2rad(self.fov_y_deg) / 2)
        p_C = (self.pose().inverse() @ p_WQset.T).T
        ahead = np.flatnonzero(p_C[:, 0] > _NEAREST)
        slopes = p_C[ahead, 1:] / p_C[ahead, :1]
        pixels = np.array([width, height]) / 2 - scale * slopes
        inside = ((pixels > 0) & (pixels < [width, height])).all(axis=1)
        return pixels[inside], ahead[inside]


def load_views(path: Path) -> dict[str, View]:
    """Returns the views in a YAML file, by name.

    Raises:
        InputError: the file is missing or not a mapping of views.
    """
    content = read_yaml(path)
    try:
        return TypeAdapter(dict[str, View]).validate_python(content)
    except ValidationError as error:
        raise InputError(describe_validation_error(path, error)) from None


def look_at(p_WC: ArrayLike, p_WT: ArrayLike) -> RigidTransform:
    """Returns the pose X_WC of an upright camera at C that looks at T.

    The camera frame is x forward, y left, z up.
    """
    forward = np.asarray(p_WT, dtype=float) - np.asarray(p_WC, dtype=float)
    forward /= np.linalg.norm(forward)
    left = np.cross([0.0, 0.0, 1.0], forward)
    if np.linalg.norm(left) < 1e-6:  # If it looks straight down, north is up.
        left = np.array([-1.0, 0.0, 0.0])
    left /= np.linalg.norm(left)
    up = np.cross(forward, left)
    R_WC = RotationMatrix(np.column_stack([forward, left, up]))
    return RigidTransform(R_WC, p_WC)
