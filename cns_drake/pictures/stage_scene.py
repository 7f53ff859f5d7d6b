"""A stage of a city that can be photographed and scanned."""

from __future__ import annotations

from collections.abc import Collection
from pathlib import Path
from typing import Annotated

import numpy as np
from pydantic import BaseModel, ConfigDict, Field, model_validator
from pydrake.math import RigidTransform

from cns_drake.pictures.rendering import HAZE_LENGTH, look_at, render
from cns_drake.ray_casting.ray_casting_scene import (
    RayCastingScene,
    RayHits,
)
from cns_drake.scene.perception_geometry import read_perception_geometry
from cns_drake.scene.world import load_world

_Coordinate = Annotated[float, Field(ge=-1e6, le=1e6)]
Place = tuple[_Coordinate, _Coordinate, _Coordinate]


class View(BaseModel):
    """A camera.

    Attributes:
        position: of the camera in the world [m].
        target: a point in the middle of the picture [m].
        fov_y: vertical field of view [deg].
    """

    model_config = ConfigDict(extra="forbid", frozen=True)

    position: Place
    target: Place
    fov_y: float = Field(default=50.0, ge=0.1, le=179.0)

    @model_validator(mode="after")
    def _looks_somewhere(self) -> View:
        if np.linalg.norm(np.subtract(self.target, self.position)) < 1e-3:
            raise ValueError("position and target are the same")
        return self

    def pose(self) -> RigidTransform:
        """Returns X_WC; x forward, y left, z up."""
        return look_at(self.position, self.target)

    def project(
        self, p_WQset: np.ndarray, width: int, height: int
    ) -> tuple[np.ndarray, np.ndarray]:
        """Returns (M, 2) pixels and the indices (M,) of their points.

        Args:
            p_WQset: (N, 3) points in the world [m].
            width, height: of the picture [pixel].
        """
        scale = height / 2 / np.tan(np.deg2rad(self.fov_y) / 2)
        p_C = (self.pose().inverse() @ p_WQset.T).T
        ahead = np.flatnonzero(p_C[:, 0] > 0.1)
        slopes = p_C[ahead, 1:] / p_C[ahead, :1]
        pixels = np.array([width, height]) / 2 - scale * slopes
        inside = ((pixels > 0) & (pixels < [width, height])).all(axis=1)
        return pixels[inside], ahead[inside]


class StageScene:
    """The geometry of a stage, ready for pictures and scans."""

    def __init__(self, path: Path, without: Collection[str] = ()):
        """Loads an SDF world.

        Args:
            path: of the world.
            without: names of structures to leave out.

        Raises:
            InputError: the world cannot be loaded.
        """
        world = load_world(path, without=without)
        self._geometries = read_perception_geometry(
            world.scene_graph.model_inspector()
        )
        self._scene = RayCastingScene(
            self._geometries,
            {geometry.frame_id for geometry in self._geometries},
            lambda frame_id: RigidTransform(),
        )

    def photograph(
        self,
        view: View,
        width: int,
        height: int,
        haze_length: float = HAZE_LENGTH,
    ) -> np.ndarray:
        """Returns the rendered (height, width, 3) picture."""
        return render(
            self._scene,
            self._geometries,
            view.pose(),
            width=width,
            height=height,
            fov_y_deg=view.fov_y,
            haze_length=haze_length,
        )

    def cast_rays(
        self, p_WS: np.ndarray, d_Wset: np.ndarray, max_range: float
    ) -> RayHits:
        """Casts rays; see `RayCastingScene.cast_rays`."""
        return self._scene.cast_rays(p_WS, d_Wset, max_range)
