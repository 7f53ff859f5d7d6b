"""Pictures of stages: positions of structures, and visible changes."""

import numpy as np
from pydrake.geometry import FrameId, GeometryId
from pydrake.math import RigidTransform

from cns_drake.pictures.stage_scene import render
from cns_drake.ray_casting import RayCastingScene
from cns_drake.scene import EllipsoidSurface, PerceptionGeometry


def ball(position, rgb):
    return PerceptionGeometry(
        geometry_id=GeometryId.get_new_id(),
        name="ball",
        frame_id=FrameId.get_new_id(),
        X_FG=RigidTransform(position),
        surface=EllipsoidSurface((0.5, 0.5, 0.5)),
        rgb=rgb,
    )


def test_balls_appear_where_they_are_and_in_their_colours():
    geometries = [
        ball([10, 2.5, 0], (0.9, 0.1, 0.1)),  # Left.
        ball([10, -2.5, 0], (0.1, 0.1, 0.9)),  # Right.
        ball([10, 0, 2.0], (0.1, 0.9, 0.1)),  # Above.
    ]
    frames = {geometry.frame_id for geometry in geometries}
    scene = RayCastingScene(geometries, frames, lambda f: RigidTransform())
    picture = render(
        scene, geometries, RigidTransform(), width=160, height=90, fov_y_deg=50
    ).astype(int)
    scale = 45 / np.tan(np.deg2rad(25))
    for (y, z), channel in [((2.5, 0), 0), ((-2.5, 0), 2), ((0, 2.0), 1)]:
        column = int(80 - scale * y / 10)
        row = int(45 - scale * z / 10)
        pixel = picture[row, column]
        assert np.argmax(pixel) == channel
        assert pixel[channel] > 2 * np.delete(pixel, channel).max()
    sky = picture[5, 5]
    assert sky[2] >= sky[0] > 100
